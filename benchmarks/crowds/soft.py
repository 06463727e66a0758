"""Rigid or soft: each headline quantity of a crowd before a door against s = N F/(k r), relative to
the rigid engine.

    nice -n 19 python benchmarks/crowds/soft.py FOLDER [--read]

Crowds of the shipped scene `arch`, of several sizes, pushes and seeds; walls are never softer than
s = 3.5. Runs that are in the folder are taken as they are, and what was read of a run is kept in
FOLDER/soft.csv: with --read nothing is run. Writes FOLDER/soft.png and prints the tables of
docs/results/rigid_or_soft.md."""

import itertools
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from analysis.dumps.windows import RunWindows
from analysis.engines import EngineError
from analysis.engines.run import EngineRun
from analysis.engines.softness import VALID, WITH_CARE
from analysis.pages.drawing import COLOURS, GRID, SKY, VERMILION
from analysis.pages.numbers import signed
from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import crowd_before_a_door, make, room_with_a_door
from analysis.studies.exposure.loads import loads_of, passed, pressing, values_of
from analysis.support.files import write_text
from benchmarks.machine import options, table

# Push of a person (N) → desired speed (m/s), relaxation time (s), and when 1,200 people who begin at
# rest are pressed together (s).
PUSHES = {300.0: (2.0, 0.5, 2.0), 100.0: (2.0, 1.5, 4.0), 30.0: (0.6, 1.5, 7.0)}
RIGID = 0.0
SOFTNESS = (RIGID, 0.35, 1.0, 3.0, 9.0, 17.0)
# People, push (N), each of so many crowds.
CROWDS = 3
FAMILIES = tuple(
    (people, push)
    for people in (75, 150, 300, 594, 1200)
    for push in (PUSHES if people in (150, 1200) else (300.0,))
)
WALLS = 3.5
WINDOW_S = 3.0
MEASURES = {
    "wall_load_N": "wall load per person inside",
    "person_mean_N": "mean load of a person",
    "contact_95_N": "95 % contact force",
    "person_largest_N": "largest load of a person",
    "flow_per_s": "flow",
    "density_per_m2": "density within 2 m of the door",
}
BODY = "body"
# How a family is drawn: colour and mark say how many people, the line says the push (N).
LOOKS = {75: "v", 150: "o", 300: "s", 594: "D", 1200: "^"}
COLOUR_OF = dict(zip(LOOKS, (*COLOURS, SKY, VERMILION), strict=False))
LINES = {300.0: "-", 100.0: "--", 30.0: ":"}
# Radii (m) of soft people who are tried, and of the rigid disks they are compared with.
RADII, HARD_M = (0.17, 0.2, 0.23, 0.26), 0.17
BODY_PUSHES, BODY_PEOPLE, BODY_CROWDS = (100.0, 30.0), 150, 2


class Case(NamedTuple):
    """Name one run: people, push (N), s as words (0: rigid; body: the law of a chest), number of the
    crowd, mean radius (m)."""

    people: int
    push: float
    softness: str
    crowd: int
    radius: float = HARD_M

    def run(self, out: Path) -> EngineRun:
        """Make the run."""
        scene = _crowd(self.people, 1 + self.crowd, self.radius)
        speed, time, begin = PUSHES[self.push]
        scene = scene.with_drive(speed_m_per_s=speed, relaxation_time_s=time)
        lasts = begin + WINDOW_S
        scene = scene.with_run(duration_s=lasts, frames=round(10 * lasts), impulses=True)
        engine = "lammps"
        if self.softness == BODY:
            scene = scene.with_contact(law="body_hertz")
        elif float(self.softness) == RIGID:
            engine = "rigid"
        else:
            total = self.people * self.push / self.radius
            k = total / float(self.softness)
            stiff = max(k, total / WALLS)
            scene = scene.with_contact(stiffness_N_per_m=k, wall_stiffness_N_per_m=stiff)
        return EngineRun(scene=scene, engine=engine, folder=out / "_".join(map(str, self)))


def _crowd(people: int, seed: int, radius: float) -> Scene:
    """The crowd of `arch` of other people, with a mean radius (m)."""
    scene = make("arch", people, seed)
    if radius == HARD_M:
        return scene
    disks = crowd_before_a_door(people, seed, radius)
    farthest = np.hypot(*disks.position.T).max() + disks.radius.max()
    walls, _ = room_with_a_door(float(farthest))
    return scene.model_copy(update={"snapshot": disks, "walls": walls})


def cases() -> list[Case]:
    """List all runs: small crowds first, and of these one crowd after the other."""
    bodies = itertools.product(BODY_PUSHES, [BODY], range(BODY_CROWDS), RADII)
    found = [Case(BODY_PEOPLE, *one) for one in bodies]
    hard = itertools.product(FAMILIES, SOFTNESS, range(CROWDS))
    found += [Case(*family, f"{s:g}", crowd) for family, s, crowd in hard]
    return sorted(found, key=lambda case: (case.people > BODY_PEOPLE, case.crowd))


def measured(run: EngineRun, begin: float) -> dict[str, float]:
    """Run a case, or take the finished run; give the means of its windows of 0.1 s from `begin`
    (s) on."""
    record = run.record()
    rows, before = [], 0.0
    for window in RunWindows(run.folder, record.time_step_s).between_frames():
        gone = passed(run.scene, window.now)
        if window.start >= begin - 1e-9:
            loads, inside = loads_of(run.scene, window), len(window.now) - gone
            values = values_of(run.scene, window, loads)
            rows.append(
                {
                    "wall_load_N": values["walls"] / inside,
                    "person_mean_N": float(loads["contact_sum"].sum()) / inside,
                    "contact_95_N": float(np.quantile(pressing(window), 0.95)),
                    "person_largest_N": values["person_largest"],
                    "flow_per_s": (gone - before) / window.duration,
                    "density_per_m2": values["density_door"],
                }
            )
        before = gone
    means = {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}
    return means | {"overlap_largest": record.overlap_largest, "cpu_s": record.cpu_seconds}


def over_rigid(known: pd.DataFrame) -> pd.DataFrame:
    """Give each measure over that of the rigid run of the same crowd, where there is one and it is
    not 0."""
    rigid = known[known.softness == f"{RIGID:g}"].drop(columns="softness")
    same = [name for name in Case._fields if name != "softness"]
    both = known[known.radius == HARD_M].merge(rigid, on=same, suffixes=("", "_rigid"))
    for key in MEASURES:
        both[key] /= both[f"{key}_rigid"].replace(0.0, np.nan)
    return both


def picture(known: pd.DataFrame) -> Figure:
    """Draw each measure over the rigid one against s: a family of crowds each, means and the range
    over crowds."""
    relative = over_rigid(known).query("softness not in ('0', 'body')").astype({"softness": float})
    figure = Figure(figsize=(11.0, 6.4), layout="constrained")
    for axes, (key, title) in zip(figure.subplots(2, 3).ravel(), MEASURES.items(), strict=True):
        axes.axhline(1.0, color=GRID, zorder=0)
        axes.axvspan(VALID, WITH_CARE, color=GRID, alpha=0.35, zorder=0)
        for number, (people, push) in enumerate(FAMILIES):
            family = relative[(relative.people == people) & (relative.push == push)]
            found = family.groupby("softness")[key].agg(["mean", "min", "max"]).dropna()
            if len(found):
                axes.errorbar(
                    np.array(found.index) * 1.04 ** (number - 4), found["mean"],
                    yerr=[found["mean"] - found["min"], found["max"] - found["mean"]],
                    fmt=LOOKS[people] + LINES[push], color=COLOUR_OF[people], capsize=3, lw=1,
                    ms=5, label=f"{people} people, {push:g} N",
                )  # fmt: skip
        axes.set(xscale="log", title=title, xlabel="s = N F/(k r)", ylabel="over the rigid value")
        axes.set_ylim(bottom=0.0)
    figure.axes[0].legend(fontsize=8, loc="lower left")
    return figure


def tables(known: pd.DataFrame) -> str:
    """Write the tables of the page: each measure relative to rigid at each s, over all families;
    soft people of other radii; cost."""
    relative, lines = over_rigid(known), []
    for s in SOFTNESS[1:]:
        here = relative[relative.softness == f"{s:g}"]
        deep = known[known.softness == f"{s:g}"].overlap_largest.max()
        lines.append([f"{s:g}", *(_cell(here[key].dropna()) for key in MEASURES), f"{deep:.2f}"])
    text = table(["s", *MEASURES.values(), "largest overlap (r)"], lines)
    lines, small = [], known[(known.people == BODY_PEOPLE) & (known.crowd < BODY_CROWDS)]
    laws = [(f"{RIGID:g}", HARD_M), *((BODY, radius) for radius in RADII)]
    for push, (law, radius) in itertools.product(BODY_PUSHES, laws):
        rows = small[(small.push == push) & (small.softness == law) & (small.radius == radius)]
        if len(rows):
            means = [f"{mean:.3g}" for mean in rows[list(MEASURES)].mean()]
            name = f"{radius:g}" + (" rigid" if law != BODY else "")
            lines.append([f"{push:g}", name, *means, f"{rows.overlap_largest.max():.2f}"])
    text += "\n\n" + table(["push (N)", "radius (m)", *MEASURES, "largest overlap (r)"], lines)
    return f"{text}\n\n{len(known)} runs, {known.cpu_s.sum():.0f} CPU s"


def _cell(values: pd.Series) -> str:
    """The mean difference from 1 in percent, and the range of 90 % of the crowds."""
    if values.empty:
        return "–"
    mean, low, high = map(signed, (values.mean() - 1, *(values.quantile([0.05, 0.95]) - 1)))
    return f"{mean} ({low} to {high})"


def main() -> None:
    """Run every case that is not known, and draw."""
    args = options(__doc__, "out", read=False)
    path = args.out / "soft.csv"
    known = pd.DataFrame(columns=[*Case._fields, *MEASURES, "overlap_largest", "cpu_s"])
    if path.exists():
        known = pd.read_csv(path, dtype={"softness": str})
    done = set(known[list(Case._fields)].itertuples(index=False, name=None))
    for case in () if args.read else (case for case in cases() if case not in done):
        try:
            found = measured(case.run(args.out / "runs"), PUSHES[case.push][-1])
        except EngineError as error:
            print(error, flush=True)
            continue
        known.loc[len(known)] = {**case._asdict(), **found}
        write_text(path, known.to_csv(index=False))
        print(*case, f"{found['cpu_s']:.1f} CPU s", flush=True)
    print(tables(known))
    picture(known).savefig(args.out / "soft.png", dpi=120)


if __name__ == "__main__":
    main()
