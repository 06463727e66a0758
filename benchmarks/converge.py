"""Rigid steps that grow short against springs that grow stiff: whole runs of a scene, over crowds.

    python benchmarks/converge.py FOLDER [--crowds 10] [--duration 4] [--models rigid:0.005 ...]

Each model is ENGINE:NUMBER, the number being the step (s) of the rigid engine or the stiffness (N/m)
of another. Runs that are in the folder are taken as they are; with --read nothing is run, and models
are compared on the crowds that the folder has. Prints a table, writes FOLDER/converge.png."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from analysis.engines import EngineError
from analysis.engines.record import RunRecord
from analysis.engines.run import EngineRun, run_folder
from analysis.motion.series import Series, read_series
from analysis.pages.drawing import COLOURS, GRID
from analysis.scene.scene import Scene, read_scene
from analysis.scene.variation import variant
from nscd.arrays import Floats

MODELS = (
    "rigid:0.001",
    "rigid:0.005",
    "rigid:0.02",
    "lammps:1e6",
    "lammps:1e7",
    "lammps:1e8",
    "yade:1e6",
)
# Title, unit, measure, and from when to when (s; None: the end of the run).
STATISTICS = {
    "wall load, 0.5–1 s": ("kN", 1e-3, "walls", 0.5, 1.0),
    "wall load, second half": ("kN", 1e-3, "walls", None, None),
    "mean contact force": ("N", 1.0, "contact_mean", None, None),
    "95 % contact force": ("N", 1.0, "contact_95", None, None),
    "flow": ("1/s", 1.0, "flow", None, None),
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Model:
    """Hold the statistics of one model, crowd by crowd.

    crowds: (c,) their numbers
    values: (c,) per statistic
    cpu_s: CPU s of a simulated second, the median of the crowds
    """

    name: str
    crowds: Sequence[int]
    values: Mapping[str, Floats]
    cpu_s: float

    def bias(self, reference: Model, statistic: str) -> tuple[float, float, int]:
        """Give by what share it is above the reference, on the crowds that both have, the standard
        error of that, and how many these are."""
        shared = [number for number in self.crowds if number in reference.crowds]
        mine, theirs = (
            np.array([one.values[statistic][list(one.crowds).index(number)] for number in shared])
            for one in (self, reference)
        )
        error = float(np.std(mine - theirs, ddof=1)) if len(shared) > 1 else np.nan
        mean = float(theirs.mean())
        return float(mine.mean()) / mean - 1, error / np.sqrt(len(shared)) / mean, len(shared)


def run_of(scene: Scene, model: str, number: int, duration: float, out: Path) -> EngineRun:
    """Name the run of one crowd by one model, in windows of 0.1 s."""
    engine, value = model.split(":")
    frames = round(10 * duration)
    made = variant(scene, number).with_run(duration_s=duration, frames=frames, impulses=True)
    rigid, number_of = engine == "rigid", float(value)
    made = (
        made.with_run(rigid_step_s=number_of)
        if rigid
        else made.with_contact(stiffness_N_per_m=number_of)
    )
    folder = run_folder(out / f"crowd_{number}", made, engine)
    return EngineRun(scene=made, engine=engine, folder=folder)


def statistics_of(series: Series) -> dict[str, float]:
    """Compute each statistic of a run: the mean of its windows."""
    found = {}
    for name, (_, scale, measure, begin, end) in STATISTICS.items():
        first = 0.5 * series.time[-1] if begin is None else begin
        kept = series.time - series.window_s >= first - 1e-9
        if end is not None:
            kept &= series.time <= end + 1e-9
        found[name] = scale * float(series.values[measure][kept].mean())
    return found


def read_model(name: str, runs: Mapping[int, EngineRun], duration: float) -> Model | None:
    """Read the finished runs of a model; None where there are none."""
    rows, costs, crowds = [], [], []
    for number, run in runs.items():
        try:
            record = RunRecord.read(run.folder)
            record.check_finished(run.folder, run.scene.model_copy(update={"name": "scene"}))
        except EngineError:
            continue
        rows.append(statistics_of(read_series(run.folder, record.time_step_s)))
        costs.append(record.cpu_seconds / duration)
        crowds.append(number)
    if not rows:
        return None
    values = {key: np.array([row[key] for row in rows]) for key in STATISTICS}
    return Model(name=name, crowds=crowds, values=values, cpu_s=float(np.median(costs)))


def table(models: Sequence[Model]) -> str:
    """Write means and standard errors over crowds, and the bias against the first model."""
    reference = models[0]
    head = ["model", "crowds", "CPU s per s"]
    head += [f"{name} ({known[0]})" for name, known in STATISTICS.items()]
    lines = [head, ["---"] * len(head)]
    for model in models:
        cells = [model.name, str(len(model.crowds)), f"{model.cpu_s:.2g}"]
        for name in STATISTICS:
            values = model.values[name]
            cell = f"{values.mean():.4g}"
            if len(values) > 1:
                cell += f" ± {np.std(values, ddof=1) / np.sqrt(len(values)):.2g}"
            share, error, shared = model.bias(reference, name)
            if model is not reference and shared > 1:
                cell += f" ({100 * share:+.1f} ± {100 * error:.1f} %)"
            cells.append(cell)
        lines.append(cells)
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def picture(models: Sequence[Model]) -> Figure:
    """Draw the bias of each statistic against CPU time, with two standard errors."""
    figure = Figure(figsize=(11.0, 6.4), layout="constrained")
    panels = figure.subplots(2, 3).ravel()
    engines = list(dict.fromkeys(model.name.split(":")[0] for model in models))
    for axes, name in zip(panels, STATISTICS, strict=False):
        for number, engine in enumerate(engines):
            own = [model for model in models if model.name.startswith(engine)]
            biases = [model.bias(models[0], name) for model in own]
            axes.errorbar(
                [model.cpu_s for model in own],
                [100 * share for share, *_ in biases],
                yerr=[0.0 if np.isnan(error) else 200 * error for _, error, _ in biases],
                fmt="os^"[number % 3],
                color=COLOURS[number % 4],
                capsize=3,
                label=engine,
            )
            for place, (model, (share, *_)) in enumerate(zip(own, biases, strict=True)):
                value = float(model.name.split(":")[1])
                text = f"{1e3 * value:g} ms" if engine == "rigid" else f"{value:.0e}"
                axes.annotate(
                    text.replace("e+0", "e"), (model.cpu_s, 100 * share), xytext=(5, 4 - 14 * (place % 2)),
                    textcoords="offset points", fontsize=8,
                )  # fmt: skip
        axes.axhline(0.0, color=GRID, zorder=0)
        axes.set(xscale="log", title=name, xlabel="CPU s per simulated second", ylabel="bias (%)")
        axes.margins(x=0.18, y=0.15)
    panels[-1].axis("off")
    panels[-1].legend(*panels[0].get_legend_handles_labels(), loc="center", title="engine")
    return figure


def main() -> None:
    """Run every crowd by every model, and compare them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--scene", type=Path, default=Path("scenes/arch.toml"))
    parser.add_argument("--crowds", type=int, default=10)
    parser.add_argument("--duration", type=float, default=4.0)
    parser.add_argument("--models", nargs="+", default=MODELS)
    parser.add_argument("--read", action="store_true")
    given = parser.parse_args()
    scene = read_scene(given.scene)
    numbers = range(given.crowds)
    runs = {
        model: {n: run_of(scene, model, n, given.duration, given.out) for n in numbers}
        for model in given.models
    }
    for number in [] if given.read else numbers:
        for model, own in runs.items():
            record = own[number].record()
            print(number, model, f"{record.cpu_seconds:.2f} s", flush=True)
    found = [read_model(model, own, given.duration) for model, own in runs.items()]
    models = [model for model in found if model is not None]
    print(table(models))
    picture(models).savefig(given.out / "converge.png", dpi=120)


if __name__ == "__main__":
    main()
