"""The page of measured forces, and its numbers as CSV."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from analysis.pages import drawing
from analysis.pages.html import render, write_pictures
from analysis.pages.numbers import between, decimals, number, percent, significant
from analysis.pages.ranges import Chart
from analysis.pages.section import Cell, Section
from analysis.pages.words import Words
from analysis.studies.measured.models import EDGE, INNER, TOLERANCE, Law, Step
from analysis.support.columns import Columns
from analysis.support.files import write_rows, write_text
from nscd.show import contact_lines

# A friction shows in the forces if their distance is at most so many times the least of any.
NEAR = 1.1
SECONDS = 0.04  # a disk, guessed before a run, of one core
HEAD = ["model", "correlation", "all contacts", "error", "top tenth", "AUC", "log-likelihood"]
TABLE = Columns("measured")


def summary(steps: Sequence[Step]) -> list[list[str]]:
    """Give the rows of HEAD: means over the steps."""
    mean = {
        name: np.mean([s.predictions[name].scores for s in steps], axis=0)
        for name in steps[0].predictions
    }
    return [[name, *(decimals(float(x), 2) for x in row[:6])] for name, row in mean.items()]


def write_measured(
    steps: Sequence[Step], laws: Sequence[Law], friction: float, folder: Path, command: str
) -> list[Path]:
    """Write `measured.csv` and `index.html` with its pictures; return their paths."""
    words, shown, about = Words(__package__), steps[len(steps) // 2], _values(steps, laws, friction)
    every = {
        name.replace(", μ =", ""): (sum(r) / len(r), min(r), max(r))
        for name, r in about["all"].items()
    }
    tables = [
        words.table("table_scores", summary(steps)),
        words.table("table_steps", _steps(steps)),
    ]
    if laws:
        rows = [
            [*map(significant, law[:3]), *(percent(x, 2) for x in law[3:6]), decimals(law.width, 1)]
            for law in laws
        ]
        tables.append(words.table("table_laws", rows))
    first = Section(
        number="result", title=words.text("title"), introduction=[words.text("lead", **about)],
        words=[words.text("verdict", **about)], warnings=_warnings(steps),
        charts=[Chart("correlation with measured forces", "", every)],
        pictures=[words.picture("forces", _forces(shown, friction), shown=shown.packing.name)],
    )  # fmt: skip
    folds = [
        Section(
            number="friction", title=words.text("title_friction"),
            words=[words.text("friction", **about)],
            pictures=[words.picture("distance", _distances(steps))],
        ),
        Section(number="numbers", title=words.text("title_numbers"), tables=tables, files=["measured.csv"]),
        Section(
            number="assumptions", title=words.text("title_assumptions"),
            introduction=words.items("assumptions", **about),
        ),
    ]  # fmt: skip
    scores = [
        [s.packing.name, name, *map(repr, map(float, one.scores)), one.status]
        for s in steps
        for name, one in s.predictions.items()
    ]
    write_rows(folder / "measured.csv", TABLE, scores)
    page = render(
        "measured.html", command=command, first=first, folds=folds,
        name=shown.packing.name if len(steps) == 1 else f"{len(steps)} steps",
        contents=[(one.number, one.title) for one in (first, *folds)],
        images=write_pictures([first, *folds], folder / "figures"),
    )  # fmt: skip
    write_text(folder / "index.html", page)
    return [folder / "measured.csv", folder / "index.html"]


def _steps(steps: Sequence[Step]) -> list[list[Cell]]:
    """The experiment's own numbers."""
    return [
        [
            p.name, len(p.snapshot), int((p.sides > 0).sum()), float(p.force[p.sides > 0].mean()),
            number(p.error.correlation, 2), p.error.alpha, p.error.beta, int(p.boundary.sum()),
            percent(p.unbalanced, 2), p.scale,
        ]
        for p in (one.packing for one in steps)
    ]  # fmt: skip


def _values(steps: Sequence[Step], laws: Sequence[Law], friction: float) -> dict[str, Any]:
    """What the sentences say."""
    names = [name for name in steps[0].predictions if "," in name]
    every = {name: [s.predictions[name].scores.correlation for s in steps] for name in names}
    best = max(every, key=lambda name: sum(every[name]))
    far = [(s.distance, NEAR * min(one.rms for one in s.distance.values())) for s in steps]
    stated = {
        "with_friction": [one[friction].rms for one, _ in far],
        "without": [one[0.0].rms for one, _ in far],
        "shuffled": [s.shuffled[friction].rms for s in steps],
        "least": [min(mu for mu, each in one.items() if each.rms <= maximum) for one, maximum in far],
        "best_range": every[best],
        "percussions": every[f"percussions, μ = {friction:g}"],
    }
    return {name: between(min(r), max(r)) for name, r in stated.items()} | {
        "steps": len(steps), "best": best, "friction": significant(friction), "near": percent(NEAR - 1, 2),
        "two_sided": not any(s.packing.error.assumed for s in steps), "inner": INNER, "edge": EDGE,
        "tolerance": TOLERANCE, "laws": laws, "all": every,
    }  # fmt: skip


def _warnings(steps: Sequence[Step]) -> list[str]:
    """What is not as it should be: one side only, and solvers that did not end well."""
    message = "the error bar is assumed, not from both sides of contacts"
    lines = [f"{s.packing.name}: {message}" for s in steps if s.packing.error.assumed]
    for s in steps:
        found = {name: one.status for name, one in s.predictions.items()}
        for what, far in (("distance", s.distance), ("distance, shuffled", s.shuffled)):
            found |= {f"{what}, μ = {mu:g}": one.status for mu, one in far.items()}
        bad = {name: one for name, one in found.items() if one not in ("", "solved", "converged")}
        lines += [f"{s.packing.name}, {name}: {status}" for name, status in bad.items()]
    return lines


def _forces(step: Step, friction: float) -> Figure:
    """Measured forces beside those of two models."""
    packing = step.packing
    names = [f"{model}, μ = {friction:g}" for model in ("ensemble", "percussions")]
    shown = {"measured": packing.force} | {name: step.predictions[name].force for name in names}
    norm = Normalize(0, float(np.quantile(packing.force[packing.force > 0], 0.98)))
    figure, every = drawing.panels(9.5, 3.8, 1, 3, sharex=True, sharey=True)
    lines = contact_lines(packing.snapshot, packing.contacts)
    for axes, (name, force) in zip(every, shown.items(), strict=True):
        drawing.draw_disks(axes, packing.snapshot)
        some = force > packing.least
        drawing.draw_forces(axes, lines[some], force[some], norm)
        axes.set(title=name, aspect="equal", xticks=[], yticks=[])
        axes.autoscale_view()
    drawing.add_scale(figure, every, norm, "normal force (N)")
    return figure


def _distances(steps: Sequence[Step]) -> Figure:
    """The distance from an admissible state against friction, of every step and of shuffled forces."""
    figure, (axes,) = drawing.panels(7.0, 3.6)
    for s in steps:
        for far, style, label in ((s.distance, "o-", "measured"), (s.shuffled, "s", "shuffled")):
            colour = drawing.BLUE if far is s.distance else drawing.GREY
            rms = [one.rms for one in far.values()]
            axes.plot(list(far), rms, style, color=colour, ms=4, lw=1, label=label)
    axes.set(xlabel="friction μ", ylabel="distance from equilibrium (σ)", ylim=(0, None))
    axes.grid(color=drawing.GRID)
    drawing.legend_below(figure, axes, 2)
    return figure
