"""A map of a case as a picture: colour, letter and hatch say the outcome; lines say where theory
puts its edge."""

from __future__ import annotations

import itertools

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from analysis.pages.drawing import BLACK, DARK_GREY, GREY, ORANGE, SKY, VERMILION, YELLOW
from analysis.pages.numbers import significant
from analysis.stability.case import Axis, Map, Outcome, Value

# Okabe–Ito, of clearly different lightness, with a letter and a hatch of its own
LOOKS = {
    Outcome.STABLE: ("#FFFFFF", "S", ""),
    Outcome.INACCURATE: (YELLOW, "I", ".."),
    Outcome.ENERGY_GAIN: (ORANGE, "E", "//"),
    Outcome.LOST: (VERMILION, "L", "xx"),
    Outcome.NOT_CONVERGED: (SKY, "N", "\\\\"),
    Outcome.REFUSED: (GREY, "R", "--"),
}


def draw_map(made: Map) -> Figure:
    """The map: one box a cell, "!" where the method said that all was well and it was not."""
    case = made.case
    columns, rows = case.columns.values, case.rows.values
    wide = 0.78 if len(columns) <= 10 else 0.62
    width, height = 1.9 + 0.11 * _longest(rows) + wide * len(columns), 1.8 + 0.46 * len(rows)
    figure = Figure(figsize=(max(width, 6.0), height), layout="constrained")
    axes = figure.add_subplot()
    for cell in made.cells:
        x, y = columns.index(cell.column), rows.index(cell.row)
        colour, letter, hatch = LOOKS[cell.outcome]
        axes.add_patch(
            Rectangle(
                (x - 0.5, y - 0.5), 1, 1, facecolor=colour, edgecolor=DARK_GREY, hatch=hatch, lw=0.6
            )
        )
        axes.text(
            x,
            y,
            letter + ("!" if cell.silent else ""),
            ha="center",
            va="center",
            fontsize=9,
            bbox={"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none"},
        )
    handles: list[Patch | Line2D] = [
        Patch(
            facecolor=LOOKS[o][0],
            hatch=LOOKS[o][2],
            edgecolor=DARK_GREY,
            label=f"{LOOKS[o][1]}  {o}",
        )
        for o in Outcome
        if any(cell.outcome is o for cell in made.cells)
    ]
    for edge in made.boundaries:
        y = rows.index(edge.row)
        place = _place(case.columns, edge.theory)
        if place is not None:
            axes.plot(
                [place, place], [y - 0.5, y + 0.5], color=BLACK, lw=2.5, solid_capstyle="butt"
            )
        if place is not None and (middle := _place(case.columns, edge.measured)) is not None:
            axes.plot([middle], [y - 0.34], marker="D", color=BLACK, mfc="white", ms=6)
    if any(_place(case.columns, edge.theory) is not None for edge in made.boundaries):
        handles.append(Line2D([], [], color=BLACK, lw=2.5, label="boundary by theory"))
        handles.append(
            Line2D([], [], color=BLACK, marker="D", mfc="white", ls="", label="boundary measured")
        )
    if any(cell.silent for cell in made.cells):
        handles.append(Line2D([], [], ls="", label="!  its own status: 0 or solved"))
    axes.set_xlim(-0.5, len(columns) - 0.5)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xticks(range(len(columns)), [tick(value) for value in columns])
    axes.set_yticks(range(len(rows)), [tick(value) for value in rows])
    axes.set_xlabel(case.columns.label)
    # above the rows' names, since a turned label would be longer than a map of few rows is high
    axes.text(
        -0.01,
        1.02,
        f"{case.rows.label} ↓",
        transform=axes.transAxes,
        ha="right",
        va="bottom",
        fontsize=9,
    )
    axes.tick_params(length=0)
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    return figure


def tick(value: Value) -> str:
    """A value as a tick label."""
    if isinstance(value, str):
        return value
    return significant(value, 4)


def _longest(values: tuple[Value, ...]) -> int:
    return max(len(value) if isinstance(value, str) else 5 for value in values)


def _place(axis: Axis, value: float) -> float | None:
    """Where a value is among the columns (0 the middle of the first), logarithmic between positive
    neighbours; None beyond them."""
    known = np.array([v for v in axis.values if not isinstance(v, str)], dtype=float)
    if not np.isfinite(value) or len(known) < 2 or not known.min() <= value <= known.max():
        return None
    for i, (a, b) in enumerate(itertools.pairwise(known)):
        if min(a, b) <= value <= max(a, b):
            logarithmic = min(a, b) > 0
            part = np.log(value / a) / np.log(b / a) if logarithmic else (value - a) / (b - a)
            return float(i + part)
    return None
