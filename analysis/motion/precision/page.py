"""Whole runs on a page: the error of every statistic against CPU time, and the same as a table."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from analysis.motion.intervals import in_all
from analysis.motion.precision.measured import Bias, Measured, Precision
from analysis.motion.precision.points import NAME
from analysis.pages.drawing import COLOURS, GRID, MARKERS
from analysis.pages.names import engine_name
from analysis.pages.numbers import NONE, number, signed, significant
from analysis.pages.section import Picture, Section
from analysis.pages.words import Words
from analysis.scene.variation import how_varied

COLUMNS = 3
# Between words above a panel, as a share of its width.
APART = 0.06


def whole_runs_section(found: Precision) -> Section:
    """Put whole runs into words, a picture and a table."""
    words, scene = Words(__package__), found.scene
    values = {
        "reference": found.reference.setting.title,
        "crowds": found.crowds,
        "duration": scene.run.duration_s,
        "varied": how_varied(scene, found.crowds),
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
        if not isfinite(error):
            return in_all(number(mean), len(one.crowds))
        return f"{significant(mean)} ± {significant(error, 2)}"
    bias = one.bias(found.reference, name)
    if not isfinite(bias.share):
        return NONE
    if not isfinite(bias.low):
        return in_all(signed(bias.share), bias.crowds)
    return f"{signed(bias.share)} ({signed(bias.low)} to {signed(bias.high)})"


def whole_runs_picture(found: Precision) -> Figure:
    """Draw the error of each statistic against CPU time, all engines on one picture."""
    names = list(found.statistics)
    lines = -(-len(names) // COLUMNS)
    figure = Figure(figsize=(13.0, 1.0 + 4.0 * lines), layout="constrained")
    panels = figure.subplots(lines, COLUMNS, squeeze=False).ravel()
    for axes, name in zip(panels, names, strict=False):
        _draw(axes, found, name)
        axes.set_title(found.statistics[name].title, pad=52)
        axes.set(xlabel="CPU time of a run (s)", ylabel="above the reference (%)")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter(NullFormatter())
    for axes in panels[len(names) :]:
        axes.axis("off")
    handles, labels = panels[0].get_legend_handles_labels()
    known = dict(zip(labels, handles, strict=True))
    figure.legend(known.values(), known, loc="outside lower center", ncols=3, frameon=False)
    return figure


def _draw(axes: Axes, found: Precision, name: str) -> None:
    """One panel: an engine has a colour and a marker, which is hollow where it is coarse."""
    engines = list(dict.fromkeys(one.setting.engine for one in found.every))
    for one in found.every:
        place = engines.index(one.setting.engine) % len(COLOURS)
        bias, colour = one.bias(found.reference, name), COLOURS[place]
        coarse = one.setting.is_coarse
        axes.errorbar(
            [one.cpu_seconds],
            [100 * bias.share],
            yerr=np.array([_reach(bias)]).T,
            fmt=MARKERS[place],
            color=colour,
            mfc="white" if coarse else colour,
            capsize=3,
            label="_" if coarse else engine_name(one.setting.engine),
        )
    axes.axhline(0.0, color=GRID, zorder=0)
    axes.set_xscale("log")
    axes.margins(x=0.1, y=0.12)
    _name(axes, found, name, engines)


def _name(axes: Axes, found: Precision, name: str, engines: Sequence[str]) -> None:
    """Write the settings above a panel, side by side in the order of their cost, each with a line
    to its point: points lie too near to each other for words."""
    named = sorted(
        (one for one in found.every if not one.setting.is_coarse), key=lambda one: one.cpu_seconds
    )
    left, right = np.log(axes.get_xlim())
    at = (np.log([one.cpu_seconds for one in named]) - left) / (right - left)
    for place in range(1, len(at)):
        at[place] = max(at[place], at[place - 1] + APART)
    for place in reversed(range(len(at))):
        at[place] = min(at[place], 1.0 - APART * (len(at) - 1 - place))
    for one, share in zip(named, at, strict=True):
        colour = COLOURS[engines.index(one.setting.engine) % len(COLOURS)]
        axes.annotate(
            one.setting.short,
            (one.cpu_seconds, 100 * one.bias(found.reference, name).share),
            xytext=(share, 1.03),
            textcoords="axes fraction",
            rotation=90,
            ha="center",
            va="bottom",
            fontsize=8,
            color=colour,
            arrowprops={"arrowstyle": "-", "color": colour, "lw": 0.5, "alpha": 0.6},
        )


def _reach(bias: Bias) -> Sequence[float]:
    """How far its bar goes down and up (%); no bar where nothing is known."""
    if not isfinite(bias.low):
        return 0.0, 0.0
    return 100 * (bias.share - bias.low), 100 * (bias.high - bias.share)
