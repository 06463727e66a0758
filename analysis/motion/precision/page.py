"""Whole runs on a page: the error of every statistic against CPU time, and the same as a table."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.motion.intervals import signed
from analysis.motion.precision.measured import Bias, Measured, Precision
from analysis.motion.precision.points import NAME
from analysis.pages.drawing import COLOURS, GRID, MARKERS
from analysis.pages.names import engine_name
from analysis.pages.numbers import NONE, number, significant
from analysis.pages.section import Picture, Section
from analysis.pages.words import Words
from analysis.scene.variation import how_varied

COLUMNS = 3


def whole_runs_section(found: Precision) -> Section:
    """Put whole runs into words, a picture and a table."""
    words, scene = Words(__package__), found.scene
    values = {
        "reference": found.reference.setting.title,
        "crowds": found.crowds,
        "duration": scene.run.duration_s,
        "varied": how_varied(scene),
        "driven": scene.drive is not None,
        "heads": [f"{one.title} ({one.unit})" for one in found.statistics.values()],
    }
    return Section(
        number=NAME,
        title=words.text("title"),
        introduction=[words.text("what", **values), words.text("cost")],
        pictures=[
            Picture(
                name=NAME,
                caption=words.text("picture", **values),
                figure=whole_runs_picture(found),
            )
        ],
        tables=[words.table("table", whole_runs_rows(found), **values)],
        warnings=found.failures,
        files=[f"{NAME}.csv"],
    )


def whole_runs_rows(found: Precision) -> list[list[str]]:
    """List a row per setting: crowds, CPU seconds, and each statistic with its error."""
    rows = []
    for one in found.every:
        costs = (one.cpu_seconds, one.with_impulses)
        cells = [one.setting.title, str(len(one.crowds)), *(significant(cost, 2) for cost in costs)]
        rows.append(cells + [_cell(one, found, name) for name in found.statistics])
    return rows


def _cell(one: Measured, found: Precision, name: str) -> str:
    """The mean of a reference; of others by how much they are above it, with 90 %."""
    if one is found.reference:
        mean, error = one.mean(name)
        return f"{significant(mean)} ± {significant(error, 2)}" if isfinite(error) else number(mean)
    bias = one.bias(found.reference, name)
    if not isfinite(bias.share):
        return NONE
    ends = f" ({signed(bias.low)} to {signed(bias.high)})" if isfinite(bias.low) else ""
    return signed(bias.share) + ends


def whole_runs_picture(found: Precision) -> Figure:
    """Draw the error of each statistic against CPU time, all engines on one picture."""
    names = list(found.statistics)
    lines = -(-len(names) // COLUMNS)
    figure = Figure(figsize=(13.0, 1.0 + 4.0 * lines), layout="constrained")
    panels = figure.subplots(lines, COLUMNS, squeeze=False).ravel()
    for axes, name in zip(panels, names, strict=False):
        _draw(axes, found, name)
        axes.set(title=found.statistics[name].title, xscale="log")
        axes.set(xlabel="CPU time of a run (s)", ylabel="above the reference (%)")
    for axes in panels[len(names) :]:
        axes.axis("off")
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False
    )
    return figure


def _draw(axes: Axes, found: Precision, name: str) -> None:
    engines = list(dict.fromkeys(one.setting.engine for one in found.every))
    shown = []
    for place, engine in enumerate(engines):
        own = [one for one in found.every if one.setting.engine == engine]
        biases = [one.bias(found.reference, name) for one in own]
        axes.errorbar(
            [one.cpu_seconds for one in own],
            [100 * bias.share for bias in biases],
            yerr=np.array([_reach(bias) for bias in biases]).T,
            fmt=MARKERS[place % len(MARKERS)],
            color=COLOURS[place % len(COLOURS)],
            capsize=3,
            label=engine_name(engine),
        )
        shown += [
            (one.cpu_seconds, 100 * bias.share, one.setting.short, COLOURS[place % len(COLOURS)])
            for one, bias in zip(own, biases, strict=True)
        ]
    for x, y, text, colour in shown:
        axes.annotate(
            text, (x, y), xytext=(5, 3), textcoords="offset points", fontsize=7, color=colour
        )
    axes.axhline(0.0, color=GRID, zorder=0)
    axes.margins(x=0.2, y=0.12)


def _reach(bias: Bias) -> Sequence[float]:
    """How far its bar goes down and up (%); no bar where nothing is known."""
    if not isfinite(bias.low):
        return 0.0, 0.0
    return 100 * (bias.share - bias.low), 100 * (bias.high - bias.share)
