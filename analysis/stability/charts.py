"""A map of a case as a picture: colour, letter and hatch say the outcome; lines say where theory
puts its edge."""

import itertools

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from analysis.pages.drawing import BLACK, DARK_GREY, GREY, ORANGE, SKY, VERMILION, WHITE, YELLOW
from analysis.pages.numbers import significant
from analysis.stability.case import Axis, Map, Outcome, Row

# Okabe–Ito, of clearly different lightness, with a letter and a hatch of its own
LOOKS = {
    Outcome.STABLE: (WHITE, "S", ""),
    Outcome.INACCURATE: (YELLOW, "I", ".."),
    Outcome.ENERGY_GAIN: (ORANGE, "E", "//"),
    Outcome.LOST: (VERMILION, "L", "xx"),
    Outcome.NOT_CONVERGED: (SKY, "N", "\\\\"),
    Outcome.REFUSED: (GREY, "R", "--"),
}


def draw_map(made: Map) -> Figure:
    """Draw the map: one box per cell, "!" where the method said that all was well and it was
    not."""
    case = made.case
    columns, rows = case.columns.values, case.rows.values
    labels = [tick(value) for value in rows]
    wide = 0.78 if len(columns) <= 10 else 0.62
    width = 1.9 + 0.11 * max(map(_width, rows)) + wide * len(columns)
    figure = Figure(figsize=(max(width, 6.0), 1.8 + 0.46 * len(rows)), layout="constrained")
    axes = figure.add_subplot()
    _draw_cells(axes, made)
    compared = _draw_boundaries(axes, made)
    axes.set_xlim(-0.5, len(columns) - 0.5)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xticks(range(len(columns)), [tick(value) for value in columns])
    axes.set_yticks(range(len(rows)), labels)
    axes.set_xlabel(case.columns.label)
    # above the rows' names, since a turned label would be longer than a map of few rows is high
    axes.text(
        *(-0.01, 1.02, f"{case.rows.label} ↓"),
        transform=axes.transAxes, ha="right", va="bottom", fontsize=9,
    )  # fmt: skip
    axes.tick_params(length=0)
    handles = _handles(made, compared)
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    return figure


def _draw_cells(axes: Axes, made: Map) -> None:
    columns, rows = made.case.columns.values, made.case.rows.values
    box = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none"}
    for (column, row), cell in made.cells.items():
        x, y = columns.index(column), rows.index(row)
        colour, letter, hatch = LOOKS[cell.outcome]
        axes.add_patch(
            Rectangle((x - 0.5, y - 0.5), 1, 1, fc=colour, ec=DARK_GREY, hatch=hatch, lw=0.6)
        )
        letter += "!" if cell.silent else ""
        axes.text(x, y, letter, ha="center", va="center", fontsize=9, bbox=box)


def _draw_boundaries(axes: Axes, made: Map) -> bool:
    """Whether a boundary by theory lies within the map."""
    compared = False
    for edge in made.boundaries:
        y = made.case.rows.values.index(edge.row)
        place = _place(made.case.columns, edge.theory)
        if place is None:
            continue
        compared = True
        axes.plot([place] * 2, [y - 0.5, y + 0.5], color=BLACK, lw=2.5, solid_capstyle="butt")
        if (middle := _place(made.case.columns, edge.measured)) is not None:
            axes.plot([middle], [y - 0.34], marker="D", color=BLACK, mfc="white", ms=6)
    return compared


def _handles(made: Map, compared: bool) -> list[Patch | Line2D]:
    outcomes = {cell.outcome for cell in made.cells.values()}
    handles: list[Patch | Line2D] = [
        Patch(fc=colour, hatch=hatch, ec=DARK_GREY, label=f"{letter}  {outcome}")
        for outcome, (colour, letter, hatch) in LOOKS.items()
        if outcome in outcomes
    ]
    if compared:
        handles.append(Line2D([], [], color=BLACK, lw=2.5, label="boundary by theory"))
        label = "boundary measured"
        handles.append(Line2D([], [], color=BLACK, marker="D", mfc="white", ls="", label=label))
    if any(cell.silent for cell in made.cells.values()):
        handles.append(Line2D([], [], ls="", label="!  its own status: 0 or solved"))
    return handles


def tick(value: Row) -> str:
    """Write the value of a row or column."""
    return significant(value, 4) if isinstance(value, float) else str(value)


def _width(value: Row) -> int:
    return 5 if isinstance(value, float) else len(str(value))


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
