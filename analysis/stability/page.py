"""The atlas as a page: one self-contained HTML file, with maps, cells and boundaries as files
beside it."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from analysis.pages.html import render, write_pictures
from analysis.pages.numbers import NONE, number, percent
from analysis.pages.section import Cell, Picture, Section, Table
from analysis.pages.words import Words
from analysis.stability.case import Boundary, Case, Map, Outcome, Row
from analysis.stability.charts import LOOKS, draw_map, tick
from analysis.support.files import write_json, write_rows, write_text

CELL_COLUMNS = (
    "case", "row", "column", "outcome", "own_status", "guard", "reason", "quantity", "value",
)  # fmt: skip
BOUNDARY_COLUMNS = (
    "case", "row", "low", "high", "measured", "theory", "relative_difference", "half_bracket",
)  # fmt: skip


def write_atlas(
    maps: Sequence[Map], folder: Path, command: str, quick: bool, wall_seconds: float
) -> Path:
    """Write `index.html`, `figures/`, `cells.csv`, `boundaries.csv` and `atlas.json`; return the
    path of the page.

    command, quick, wall_seconds: how the maps were made, and how long that took (s)."""
    words = Words(__package__)
    sections = [_section(words, made) for made in maps]
    images = write_pictures(sections, folder / "figures")
    write_rows(folder / "cells.csv", CELL_COLUMNS, _cell_rows(maps))
    write_rows(folder / "boundaries.csv", BOUNDARY_COLUMNS, _boundary_rows(maps))
    write_json(folder / "atlas.json", {made.case.name: _numbers(made) for made in maps})
    cells = [cell for made in maps for cell in made.cells.values()]
    wild = [
        cell for cell in cells if cell.guard and cell.outcome in (Outcome.ENERGY_GAIN, Outcome.LOST)
    ]
    page = render(
        "stability.html",
        command=command,
        quick=quick,
        sections=sections,
        images=images,
        summary=words.table("summary", [row for made in maps for row in _summary_rows(made)]),
        attempts={made.case.name: _attempts(words, made) for made in maps},
        outcomes=[(LOOKS[o][1], o, sum(cell.outcome is o for cell in cells)) for o in Outcome],
        cell_count=len(cells),
        silent=sum(cell.silent for cell in cells),
        wild=len(wild),
        halted=sum(cell.guard != "nothing" for cell in wild),
        reused=sum(cell.reused for cell in cells),
        wall_seconds=wall_seconds,
        cores=os.cpu_count(),
    )
    write_text(folder / "index.html", page)
    return folder / "index.html"


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


def told(case: Case) -> dict[str, str]:
    """Give the words of a case: title; fails (which methods, and how); words (of the map); edge
    (what the boundary is by theory, where there is one)."""
    return Words("analysis.stability.cases").parts(case.name, **case.values)


def _failed(made: Map) -> int:
    return sum(cell.outcome is not Outcome.STABLE for cell in made.cells.values())


def _silent(made: Map) -> int:
    return sum(cell.silent for cell in made.cells.values())


def _cell_rows(maps: Sequence[Map]) -> Iterator[tuple[object, ...]]:
    for made in maps:
        for (column, row), cell in made.cells.items():
            told = (str(cell.outcome), cell.said, cell.guard, cell.reason)
            for name, value in zip(made.case.quantities, cell.numbers, strict=True):
                yield made.case.name, row, column, *told, name, repr(value)


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
        "title": told(case)["title"],
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
    case, says = made.case, told(made.case)
    rows = [list(_edge(edge).values()) for edge in made.boundaries]
    values = {"row": case.rows.label, "column": case.columns.label, "edge": says.get("edge", "")}
    return Section(
        number=case.name,
        title=says["title"],
        introduction=[words.text("fails", fails=says["fails"]), says["words"]],
        pictures=[Picture(name=case.name, caption=says["title"], figure=draw_map(made))],
        tables=[words.table("boundaries", rows, **values)] if rows else [],
    )


def _summary_rows(made: Map) -> Iterator[list[Cell]]:
    """What failed in a case, one row per boundary that has a theory, or one."""
    case, says = made.case, told(made.case)
    lead: list[Cell] = [
        f"[{says['title']}](#{case.name})",
        says["fails"],
        f"{_failed(made)} of {len(made.cells)}",
        f"**{_silent(made)}**" if _silent(made) else 0,
    ]
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
        told = [
            tick(row),
            tick(column),
            str(cell.outcome) if stable else f"**{cell.outcome}**",
            f"**{cell.said}**" if cell.silent else cell.said,
            *([cell.guard] if guarded else []),
            cell.reason,
        ]
        rows.append([*told, *(number(value, 4) for value in cell.numbers)])
    heads = {"row": case.rows.label, "column": case.columns.label, "quantities": case.quantities}
    return words.table("attempts", rows, guarded=guarded, **heads)


def _edge(edge: Boundary) -> dict[str, str]:
    """A boundary as the page shows it: no more digits than its bracket has."""
    told = {name: number(getattr(edge, name), 4) for name in ("low", "high", "measured", "theory")}
    difference = NONE
    if edge.theory == edge.theory:
        difference = f"{percent(edge.difference)} ± {percent(edge.half_width)}"
    return {"row": tick(edge.row), **told, "difference": difference}
