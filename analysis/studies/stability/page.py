"""The atlas as a page, with its maps, and as files beside it."""

import itertools
import os
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from analysis.engines import PENALTY
from analysis.pages import drawing
from analysis.pages.html import write_html
from analysis.pages.numbers import NONE, number, percent, significant
from analysis.pages.section import Cell, Picture, Section, Table
from analysis.pages.words import Words
from analysis.studies.stability.case import (
    ENGINE_QUANTITIES,
    Axis,
    Boundary,
    Case,
    Map,
    Outcome,
    Row,
)
from analysis.support.columns import Columns
from analysis.support.files import write_json, write_rows

# Okabe–Ito, of clearly different lightness, with a letter and a hatch of its own
LOOKS = {
    Outcome.STABLE: (drawing.WHITE, "S", ""),
    Outcome.INACCURATE: (drawing.YELLOW, "I", ".."),
    Outcome.ENERGY_GAIN: (drawing.ORANGE, "E", "//"),
    Outcome.LOST: (drawing.VERMILION, "L", "xx"),
    Outcome.NOT_CONVERGED: (drawing.SKY, "N", "\\\\"),
    Outcome.REFUSED: (drawing.GREY, "R", "--"),
}


def draw_overview(maps: Sequence[Map], *, narrow: bool = False) -> Figure:
    """Draw how the attempts of each case ended, and (not narrow) its boundaries over theory."""
    size = (drawing.NARROW_IN if narrow else 7.2, 1.1 + (0.24 if narrow else 0.3) * len(maps))
    figure, every = drawing.panels(*size, 1, 1 if narrow else 2, sharey=True)
    positions, done = range(len(maps)), np.zeros(len(maps))
    for outcome, (colour, letter, hatch) in LOOKS.items():
        ended = [sum(cell.outcome is outcome for cell in one.cells.values()) for one in maps]
        if any(ended):
            fraction = 100 * np.array(ended) / [len(one.cells) for one in maps]
            style = {"color": colour, "hatch": hatch, "ec": drawing.DARK_GREY, "lw": 0.6}
            every[0].barh(positions, fraction, left=done, label=f"{letter}  {outcome}", **style)
            done += fraction
    titles = [textwrap.fill(words_of(one.case)["title"], 26) for one in maps]
    every[0].set_yticks(positions, titles, fontsize=7 if narrow else 9)
    drawing.label(every[0], "attempts (%)", xlim=(0, 100))
    every[0].invert_yaxis()
    for axes in every[1:]:
        axes.axvline(1.0, color=drawing.BLACK, lw=1)
        for index, one in enumerate(maps):
            edges = [edge for edge in one.boundaries if np.isfinite(edge.theory)]
            for edge, y in zip(edges, index + np.linspace(-0.25, 0.25, len(edges)), strict=True):
                ends = [edge.low / edge.theory, edge.high / edge.theory]
                axes.plot(ends, [y] * 2, color=drawing.BLACK)
                at = [edge.measured / edge.theory]
                axes.plot(at, [y], "D", color=drawing.BLACK, mfc="white", ms=4)
        drawing.label(axes, "boundary measured / by theory")
    figure.legend(loc="outside lower center", ncols=2 if narrow else 6, fontsize=8, frameon=False)
    return figure


def draw_map(made: Map, *, narrow: bool = False) -> Figure:
    """Draw the map: one box per cell, "!" where the method said that all was well and it was
    not."""
    case = made.case
    columns, rows = case.columns.values, case.rows.values
    bar_width = 0.34 if narrow else 0.78 if len(columns) <= 10 else 0.62
    longest = max(5 if isinstance(row, float) else len(str(row)) for row in rows)
    width = 1.9 + (0.06 if narrow else 0.11) * longest + bar_width * len(columns)
    minimum = drawing.NARROW_IN if narrow else 6.0
    figure, (axes,) = drawing.panels(max(width, minimum), 1.8 + 0.46 * len(rows))
    _draw_cells(axes, made)
    compared = _draw_boundaries(axes, made)
    limits: dict[str, Any] = {"xlim": (-0.5, len(columns) - 0.5), "ylim": (len(rows) - 0.5, -0.5)}
    drawing.label(axes, case.columns.label, **limits)
    axes.set_xticks(range(len(columns)), [tick(value) for value in columns])
    axes.set_yticks(range(len(rows)), [tick(value) for value in rows])
    # above the rows' names, since a turned label would be longer than a map of few rows is high
    axes.text(
        *(-0.01, 1.02, f"{case.rows.label} ↓"),
        transform=axes.transAxes, ha="right", va="bottom", fontsize=9,
    )  # fmt: skip
    axes.tick_params(length=0, labelsize=8 if narrow else None)
    if narrow and len(columns) > 6:
        axes.tick_params(axis="x", rotation=90)
    names, style = _handles(made, compared), {"ncols": 2 if narrow else 3, "fontsize": 8}
    figure.legend(handles=names, loc="outside lower center", frameon=False, **style)
    return figure


def _draw_cells(axes: Axes, made: Map) -> None:
    columns, rows = made.case.columns.values, made.case.rows.values
    box = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none"}
    for (column, row), cell in made.cells.items():
        x, y = columns.index(column), rows.index(row)
        colour, letter, hatch = LOOKS[cell.outcome]
        axes.add_patch(
            Rectangle(
                (x - 0.5, y - 0.5), 1, 1, fc=colour, ec=drawing.DARK_GREY, hatch=hatch, lw=0.6
            )
        )
        letter += "!" if cell.silent else ""
        axes.text(x, y, letter, ha="center", va="center", fontsize=9, bbox=box)


def _draw_boundaries(axes: Axes, made: Map) -> bool:
    """Whether a boundary by theory lies within the map."""
    compared = False
    for edge in made.boundaries:
        y = made.case.rows.values.index(edge.row)
        position = _index_of(made.case.columns, edge.theory)
        if position is None:
            continue
        compared = True
        axes.plot(
            [position] * 2, [y - 0.5, y + 0.5], color=drawing.BLACK, lw=2.5, solid_capstyle="butt"
        )
        if (middle := _index_of(made.case.columns, edge.measured)) is not None:
            axes.plot([middle], [y - 0.34], marker="D", color=drawing.BLACK, mfc="white", ms=6)
    return compared


def _handles(made: Map, compared: bool) -> list[Patch | Line2D]:
    outcomes = {cell.outcome for cell in made.cells.values()}
    handles: list[Patch | Line2D] = [
        Patch(fc=colour, hatch=hatch, ec=drawing.DARK_GREY, label=f"{letter}  {outcome}")
        for outcome, (colour, letter, hatch) in LOOKS.items()
        if outcome in outcomes
    ]
    if compared:
        handles.append(Line2D([], [], color=drawing.BLACK, lw=2.5, label="boundary by theory"))
        label = "boundary measured"
        handles.append(
            Line2D([], [], color=drawing.BLACK, marker="D", mfc="white", ls="", label=label)
        )
    if any(cell.silent for cell in made.cells.values()):
        handles.append(Line2D([], [], ls="", label="!  its own status: 0 or solved"))
    return handles


def tick(value: Row) -> str:
    """Write the value of a row or column."""
    return significant(value, 4) if isinstance(value, float) else str(value)


def _index_of(axis: Axis, value: float) -> float | None:
    """Where a value is among the columns (0 the middle of the first), logarithmic between positive
    neighbours; None beyond them."""
    finite_values = np.array([v for v in axis.values if not isinstance(v, str)], dtype=float)
    if not np.isfinite(value) or len(finite_values) < 2 or not finite_values.min() <= value <= finite_values.max():
        return None
    for i, (a, b) in enumerate(itertools.pairwise(finite_values)):
        if min(a, b) <= value <= max(a, b):
            logarithmic = min(a, b) > 0
            part = np.log(value / a) / np.log(b / a) if logarithmic else (value - a) / (b - a)
            return float(i + part)
    return None


CELL_COLUMNS = Columns("cells")
BOUNDARY_COLUMNS = Columns("boundaries")


def write_atlas(
    maps: Sequence[Map], folder: Path, command: str, quick: bool, wall_seconds: float
) -> Path:
    """Write `index.html`, `figures/`, `cells.csv`, `boundaries.csv` and `atlas.json`; return the
    path of the page.

    command, quick, wall_seconds: how the maps were made, and how long that took (s)."""
    words = Words(__package__)
    sections, about = [_section(words, made) for made in maps], _counts(maps)
    width, narrow = (draw_overview(maps, narrow=one) for one in (False, True))
    first = Section(
        number="result",
        title=words.text("result"),
        introduction=[words.text("lead", **about)],
        words=words.items("found", **about),
        pictures=[words.picture("overview", width, narrow)],
    )
    write_rows(folder / "cells.csv", CELL_COLUMNS, _cell_rows(maps))
    write_rows(folder / "boundaries.csv", BOUNDARY_COLUMNS, _boundary_rows(maps))
    write_json(folder / "atlas.json", {made.case.name: _numbers(made) for made in maps})
    return write_html(
        folder / "index.html",
        "stability.html",
        [first, *sections],
        command=command,
        engines=[one.NAME for one in PENALTY] if any(one.case.quantities == ENGINE_QUANTITIES for one in maps) else (),
        quick=quick,
        first=first,
        sections=sections,
        judged=words.items("judged", **about),
        summary=words.table("summary", [row for made in maps for row in _summary_rows(made)]),
        attempts={made.case.name: _attempts(words, made) for made in maps},
        **about,
        wall_seconds=wall_seconds,
        cores=os.cpu_count(),
    )


def _counts(maps: Sequence[Map]) -> dict[str, Any]:
    """What the page counts over all cases."""
    cells = [cell for made in maps for cell in made.cells.values()]
    edges = [one for made in maps for one in made.boundaries if np.isfinite(one.theory)]
    gone = (Outcome.ENERGY_GAIN, Outcome.LOST)
    wild = [cell for cell in cells if cell.guard and cell.outcome in gone]
    return {
        "cases": len(maps),
        "cell_count": len(cells),
        "failed": sum(map(_failed, maps)),
        "silent": sum(map(_silent, maps)),
        "wild": len(wild),
        "halted": sum(cell.guard != "nothing" for cell in wild),
        "reused": sum(cell.reused for cell in cells),
        "edges": len(edges),
        "inside": sum(one.low <= one.theory <= one.high for one in edges),
        "worst": max((abs(one.difference) for one in edges), default=0.0),
    }


def summary(maps: Sequence[Map]) -> Iterator[str]:
    """Yield one line per case, with its counts, and one per boundary that has a theory."""
    for made in maps:
        yield (
            f"{made.case.name:<20}{_failed(made):>4} of {len(made.cells)} attempts not stable, "
            f"{_silent(made)} of them unnoticed by the method"
        )
        for edge in made.boundaries:
            if edge.theory == edge.theory:
                shown = _edge(edge)
                yield (
                    f"{'':<20}{edge.row}: measured {shown['low']} to {shown['high']}, "
                    f"theory {shown['theory']} ({shown['difference']})"
                )


def words_of(case: Case) -> dict[str, str]:
    """Give the words of a case: title; fails (which methods, and how); words (of the map); edge
    (what the boundary is by theory, where there is one)."""
    return Words("analysis.studies.stability.cases").parts(case.name, **case.values)


def _failed(made: Map) -> int:
    return sum(cell.outcome is not Outcome.STABLE for cell in made.cells.values())


def _silent(made: Map) -> int:
    return sum(cell.silent for cell in made.cells.values())


def _cell_rows(maps: Sequence[Map]) -> Iterator[tuple[object, ...]]:
    for made in maps:
        for (column, row), cell in made.cells.items():
            cells = (str(cell.outcome), cell.said, cell.guard, cell.reason)
            for name, value in zip(made.case.quantities, cell.numbers, strict=True):
                yield made.case.name, row, column, *cells, name, repr(value)


def _boundary_rows(maps: Sequence[Map]) -> Iterator[tuple[object, ...]]:
    for made in maps:
        for edge in made.boundaries:
            ends = (edge.low, edge.high, edge.measured, edge.theory)
            numbers = (*ends, edge.difference, edge.half_width)
            yield made.case.name, edge.row, *map(repr, numbers)


def _numbers(made: Map) -> dict[str, Any]:
    """A map as `json` takes it; rows that are no numbers as their labels."""
    case = made.case
    return {
        "title": words_of(case)["title"],
        "columns": asdict(case.columns),
        "rows": asdict(case.rows) | {"values": [_plain(row) for row in case.rows.values]},
        "quantities": list(case.quantities),
        "cells": [
            {"column": column, "row": _plain(row), **asdict(cell)}
            for (column, row), cell in made.cells.items()
        ],
        "boundaries": [asdict(edge) | {"row": _plain(edge.row)} for edge in made.boundaries],
    }


def _plain(row: Row) -> float | str:
    return row if isinstance(row, float) else str(row)


def _section(words: Words, made: Map) -> Section:
    """A case: what fails, its map, and where the outcome changes."""
    case, says = made.case, words_of(made.case)
    rows = [list(_edge(edge).values()) for edge in made.boundaries]
    values = {"row": case.rows.label, "column": case.columns.label, "edge": says.get("edge", "")}
    return Section(
        number=case.name,
        title=says["title"],
        introduction=[words.text("fails", fails=says["fails"], **_counts([made]))],
        pictures=[
            Picture(
                name=case.name,
                caption=says["words"],
                figure=draw_map(made),
                narrow=draw_map(made, narrow=True),
            )
        ],
        tables=[words.table("boundaries", rows, **values)] if rows else [],
    )


def _summary_rows(made: Map) -> Iterator[list[Cell]]:
    """What failed in a case, one row per boundary that has a theory, or one."""
    case, says = made.case, words_of(made.case)
    link, failed = f"[{says['title']}](#{case.name})", f"{_failed(made)} of {len(made.cells)}"
    silent = f"**{_silent(made)}**" if _silent(made) else 0
    lead: list[Cell] = [link, says["fails"], failed, silent]
    edges = [_edge(edge) for edge in made.boundaries if edge.theory == edge.theory]
    for edge in edges:
        row = edge["row"]
        if isinstance(case.rows.values[0], float):
            row = f"{case.rows.label}: {row}"
        yield [*lead, row, f"{edge['low']} to {edge['high']}", edge["theory"], edge["difference"]]
    if not edges:
        yield [*lead, NONE, NONE, NONE, NONE]


def _attempts(words: Words, made: Map) -> Table:
    """Every attempt of a case; in bold what is not stable, and a status that hides it."""
    case = made.case
    guarded = any(cell.guard for cell in made.cells.values())
    rows: list[list[Cell]] = []
    for (column, row), cell in made.cells.items():
        stable = cell.outcome is Outcome.STABLE
        ended = str(cell.outcome) if stable else f"**{cell.outcome}**"
        message = f"**{cell.said}**" if cell.silent else cell.said
        cells = [tick(row), tick(column), ended, message, *([cell.guard] if guarded else [])]
        rows.append([*cells, cell.reason, *(number(value, 4) for value in cell.numbers)])
    headers = {"row": case.rows.label, "column": case.columns.label, "quantities": case.quantities}
    return words.table("attempts", rows, guarded=guarded, **headers)


def _edge(edge: Boundary) -> dict[str, str]:
    """A boundary as the page shows it: no more digits than its bracket has."""
    cells = {name: number(getattr(edge, name), 4) for name in ("low", "high", "measured", "theory")}
    difference = NONE
    if edge.theory == edge.theory:
        difference = f"{percent(edge.difference)} ± {percent(edge.half_width)}"
    return {"row": tick(edge.row), **cells, "difference": difference}
