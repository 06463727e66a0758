"""One instant of a scene: each engine against the percussions of its positions, contact by contact."""

import math
from collections.abc import Mapping, Sequence, Set
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import linregress, t

from analysis.compare import comparison as compared
from analysis.compare.study import Study
from analysis.engines.penalty import penalty_of
from analysis.pages.drawing import BLACK, BLUE, ORANGE, label, legend_below, panels
from analysis.pages.names import engine_label, engine_name
from analysis.pages.numbers import number, percent
from analysis.pages.section import Cell, Picture, Section
from analysis.pages.words import Words
from analysis.percussions.setting import FORCE
from analysis.percussions.snapshot import percussions_of
from analysis.scene.scene import Scene
from nscd import Snapshot
from nscd.indeterminacy.determinacy import determinacy

LEVEL = 0.90
# Positions (over the mean radius) that differ by less are the same.
SAME = 1e-6
MEASURES: Mapping[str, str] = {
    "contact": "per contact",
    "disk_sum": "per sum at a disk",
    "disk_vector": "per resultant of a disk",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """Hold the power of k with which a difference grows: power, and its 90 % interval."""

    power: float
    low: float
    high: float

    @property
    def verdict(self) -> str:
        """Say what the interval allows to conclude."""
        if self.high < 0:
            return "approach each other"
        return "move apart" if self.low > 0 else "do not approach each other measurably"


def fit_power(stiffnesses: Sequence[float], differences: Sequence[float]) -> Fit | None:
    """Fit log(difference) = power · log(k) + c by least squares; None for fewer than four finite
    differences above 0. The interval is Student's, of the scatter about the line."""
    pairs = [(k, d) for k, d in zip(stiffnesses, differences, strict=True) if 0 < d < np.inf]
    if len({k for k, _ in pairs}) < compared.FEWEST:
        return None
    found = linregress(*np.log(np.array(pairs)).T)
    reach = float(t.ppf(0.5 + LEVEL / 2, len(pairs) - 2)) * found.stderr
    return Fit(power=found.slope, low=found.slope - reach, high=found.slope + reach)


def moved_between(study: Study, engine: str) -> float:
    """Return the largest distance (m) between the places of a person in the runs of an engine, 0
    where it is rounding; of runs begun anew of the people who were left, and between neighbouring
    stiffnesses."""
    mine = [c.snapshot for c in study.comparisons if c.record.engine == engine]
    pairs = pairwise(mine) if engine in study.anew else ((mine[0], one) for one in mine)
    moved = max(_relative_difference(one, other) for one, other in pairs)
    return moved if moved > SAME * float(study.scene.snapshot.radius.mean()) else 0.0


def _relative_difference(one: Snapshot, other: Snapshot) -> float:
    """The largest distance (m) between the places of a person, of those in both."""
    _, here, there = np.intersect1d(one.ids, other.ids, return_indices=True)
    way = one.position[here] - other.position[there]
    return float(np.hypot(*way.T).max(initial=0.0))


def scatter(comparisons: Sequence[compared.Comparison]) -> Figure:
    """Draw rigid against penalty, contact by contact; filled where mechanics determines the rigid
    force."""
    columns = min(len(comparisons), 4)
    rows = -(-len(comparisons) // columns)
    figure, every = panels(3.9 * columns, 3.9 * rows + 0.4, rows, columns)
    for axes, comparison in zip(every, comparisons, strict=False):
        (penalty, rigid), fixed = comparison.match.normal_parts(), comparison.match.determined
        top = 1.05 * max(float(penalty.max()), float(rigid.max()), 1e-12)
        low = min(0.0, 1.05 * float(penalty.min()), 1.05 * float(rigid.min()))
        axes.plot([low, top], [low, top], color=BLACK, lw=0.8, label="equal")
        axes.plot(
            penalty[~fixed], rigid[~fixed], "o", ms=4, mfc="none", mec=ORANGE, mew=0.8,
            label="not determined, or in one model only",
        )  # fmt: skip
        axes.plot(penalty[fixed], rigid[fixed], "s", ms=2.5, color=BLUE, label="determined")
        force, percussion = (
            ("contact force", "p/τ") if comparison.unit == FORCE else ("∫f dt", "percussion p")
        )
        axes.set(xlim=(low, top), ylim=(low, top), aspect="equal")
        x, y = f"penalty ({force}, {comparison.unit})", f"rigid ({percussion}, {comparison.unit})"
        label(axes, x, y, engine_label(comparison))
    for axes in every[len(comparisons) :]:
        axes.remove()
    legend_below(figure, every[0], 3)
    return figure


Run = dict[str, Any]
# What the relative differences of a table are of.
KINDS = ("contact", "determined", "disk_sum", "disk_vector")


def contacts_section(study: Study, runs: Sequence[Run]) -> Section:
    """Put a study into words, tables and pictures; runs: the numbers of each comparison."""
    scene = study.scene
    words = Words(__name__, kind="impulse" if scene.analysis.kind == "impact" else "force")
    if not study.comparisons:
        title = words.text("title", time=scene.analysis.time_s)
        return Section(number=scene.name, title=title, words=[words.text("nothing")])
    named = zip(study.comparisons, runs, strict=True)
    rows = [_row(engine_label(comparison), run) for comparison, run in named]
    name, caption = f"{scene.name}-scatter", words.text("scatter")
    return Section(
        number=scene.name,
        title=words.text("title", time=scene.analysis.time_s),
        introduction=[words.text("instant", friction=scene.contact.friction)],
        words=_found(words, study, runs),
        pictures=[Picture(name=name, caption=caption, figure=scatter(study.comparisons))],
        tables=[words.table("runs", rows)],
        files=[run["csv"] for run in runs],
    )


def _found(words: Words, study: Study, runs: Sequence[Run]) -> list[str]:
    sentences = []
    for run in runs:
        block = "found" if run["difference_from_first_engine"] is None else "agree"
        sentences.append(words.text(block, run=run))
    engines = {comparison.record.engine for comparison in study.comparisons}
    moved = {engine: moved_between(study, engine) for engine in engines}
    sentences += _trends(words, runs, moved, study.anew)
    moving = max(c.balance.unbalanced for c in study.comparisons)
    if moving > compared.AT_REST:
        sentences.append(words.text("moving", share=moving))
    if study.scene.reconciliation:
        sentences.append(words.text("frame", frame=_real_frame(study.scene)))
    return sentences


def _trends(
    words: Words, runs: Sequence[Run], moved: Mapping[str, float], anew: Set[str] = frozenset()
) -> list[str]:
    """What rising stiffness does, one sentence for all engines of which the same is to be said.

    moved: how far (m) somebody is from one run of an engine to another; where that is not nothing,
        motion and softness cannot be told apart and nothing is concluded
    anew: engines whose stiffer runs began where the softest had come to rest"""
    sentences: dict[str, list[str]] = {}
    for engine in sorted({run["engine"] for run in runs}):
        mine = [run for run in runs if run["engine"] == engine]
        mine.sort(key=lambda run: float(run["stiffness"]))
        k = [run["stiffness"] for run in mine]
        table = {
            key: [float(run["statistics"][f"{key}_relative_difference"]) for run in mine]
            for key in MEASURES
        }
        if len(k) < 2 or not all(math.isfinite(value) for value in table["contact"]):
            continue
        same = engine in anew or not moved.get(engine)
        fits = {MEASURES[key]: fit_power(k, values) for key, values in table.items() if same}
        values = {
            "stiffnesses": k,
            "differences": [(MEASURES[key], row) for key, row in table.items()],
            "moved": moved.get(engine, 0.0),
            "anew": engine in anew,
            "fits": {title: fit for title, fit in fits.items() if fit},
            "fewest": compared.FEWEST,
        }
        sentence = words.text("trend", engines="ENGINES", **values)
        sentences.setdefault(sentence, []).append(mine[0]["engine_name"])
    return [sentence.replace("ENGINES", " and ".join(names), 1) for sentence, names in sentences.items()]


def _real_frame(scene: Scene) -> dict[str, Any]:
    """Percussions of the imported frame as forces p/τ (N)."""
    found = percussions_of(scene, scene.snapshot, tolerance=1e-10)
    force = found.solution.reaction / (found.window or 1.0)
    return {
        "contacts": len(found.contacts),
        "mean": float(force.mean()) if len(force) else 0.0,
        "largest": float(force.max(initial=0.0)),
        "determined": int(
            determinacy(found.contacts, len(scene.snapshot), scene.snapshot).determined.sum()
        ),
        "status": str(found.solution.status),
        "residual": found.solution.residual,
    }


def _row(name: str, run: Run) -> list[Cell]:
    """A run beside its percussions; a time step that is longer than the safe one in bold."""
    found, record = run["statistics"], run["record"]
    step = number(record["time_step_s"])
    return [
        name,
        run["status"],
        number(found["contact_correlation"], 2),
        *(percent(found[f"{kind}_relative_difference"], 2) for kind in KINDS),
        f"**{step}**" if record["time_step_s"] > 1.001 * run["safe_time_step_s"] else step,
        number(record["cpu_seconds"], 2),
    ]


def runs_of(study: Study) -> list[dict[str, Any]]:
    """The numbers of each run, and how far it is from the first engine with the same contacts."""
    runs = []
    for comparison in study.comparisons:
        same = [c for c in study.comparisons if c.scene.contact == comparison.scene.contact]
        stiffness = comparison.scene.contact.stiffness_N_per_m
        first, engine = same[0], comparison.record.engine
        runs.append(
            _numbers(comparison)
            | {
                "csv": f"{study.scene.name}_{engine}_k{stiffness:.6g}.csv",
                "difference_from_first_engine": None
                if first is comparison
                else compared.penalty_difference(first, comparison),
                "first_engine": engine_name(first.record.engine),
            }
        )
    return runs


def _numbers(comparison: compared.Comparison) -> dict[str, Any]:
    record, match = comparison.record, comparison.match
    spans = compared.wall_ranges(comparison)
    return {
        "engine": record.engine,
        "engine_name": engine_name(record.engine),
        "stiffness": comparison.scene.contact.stiffness_N_per_m,
        "safe_time_step_s": penalty_of(comparison.scene).safe_time_step,
        "time_s": comparison.snapshot.time,
        "record": asdict(record) | {"particle_steps": record.particle_steps},
        "statistics": compared.statistics(comparison),
        "status": str(comparison.solution.status),
        "solver": comparison.solution.solver,
        "percussion_seconds": comparison.solution.seconds,
        "drive_sum": comparison.balance.drive.tolist(),
        "wall_sum": match.penalty[match.is_wall].sum(0).tolist(),
        "rigid_wall_sum": match.rigid[match.is_wall].sum(0).tolist(),
        "drive_magnitudes": comparison.balance.magnitudes,
        "walls": [(*load, span) for load, span in zip(comparison.wall_loads(), spans, strict=True)],
        "unit": comparison.unit,
    }
