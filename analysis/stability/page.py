"""The atlas as a page: one self-contained HTML file, with maps, cells and boundaries as files
beside it."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from analysis.pages.html import jsonable, prose, render, write_picture
from analysis.pages.numbers import number, percent
from analysis.pages.section import Picture
from analysis.stability.case import Boundary, Map, Outcome, Row
from analysis.stability.charts import LOOKS, draw_map, tick
from analysis.support.files import whole_file, write_text

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
    images = {
        made.case.name: write_picture(
            Picture(name=made.case.name, caption=made.case.title, figure=draw_map(made)),
            folder / "figures",
        )
        for made in maps
    }
    _write_rows(folder / "cells.csv", CELL_COLUMNS, _cell_rows(maps))
    _write_rows(folder / "boundaries.csv", BOUNDARY_COLUMNS, _boundary_rows(maps))
    content = {made.case.name: _numbers(made) for made in maps}
    text = json.dumps(jsonable(content), indent=1, ensure_ascii=False)
    write_text(folder / "atlas.json", text + "\n")
    cells = [cell for made in maps for cell in made.cells.values()]
    wild = [
        cell for cell in cells if cell.guard and cell.outcome in (Outcome.ENERGY_GAIN, Outcome.LOST)
    ]
    page = render(
        "stability.html",
        command=command,
        quick=quick,
        maps=[_content(made, images[made.case.name]) for made in maps],
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


def _write_rows(path: Path, head: Sequence[str], rows: Iterator[tuple[object, ...]]) -> None:
    with whole_file(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(head)
        writer.writerows(rows)


def _numbers(made: Map) -> dict[str, Any]:
    """A map as `json` takes it; rows that are no numbers as their labels."""
    case = made.case
    return {
        "title": case.title,
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


def _content(made: Map, image: str) -> dict[str, Any]:
    case = made.case
    return {
        "name": case.name,
        "title": case.title,
        "fails": prose(case.fails),
        "edge": prose(case.edge),
        "words": prose(" ".join(case.words.split())),
        "image": image,
        "column": case.columns.label,
        "row": case.rows.label,
        "quantities": [prose(name) for name in case.quantities],
        "count": len(made.cells),
        "failed": _failed(made),
        "silent": _silent(made),
        "guarded": any(cell.guard for cell in made.cells.values()),
        "boundaries": [_edge(edge) for edge in made.boundaries],
        "compared": [_edge(edge) for edge in made.boundaries if edge.theory == edge.theory],
        "numbered": isinstance(case.rows.values[0], float),
        "cells": [
            {
                "row": tick(row),
                "column": tick(column),
                "outcome": str(cell.outcome),
                "stable": cell.outcome is Outcome.STABLE,
                "silent": cell.silent,
                "said": cell.said,
                "guard": cell.guard,
                "reason": cell.reason,
                "numbers": [number(value, 4) for value in cell.numbers],
            }
            for (column, row), cell in made.cells.items()
        ],
    }


def _edge(edge: Boundary) -> dict[str, str]:
    """A boundary as the page shows it: no more digits than its bracket has."""
    told = {name: number(getattr(edge, name), 4) for name in ("low", "high", "measured", "theory")}
    difference = "–"
    if edge.theory == edge.theory:
        difference = f"{percent(edge.difference)} ± {percent(edge.half_width)}"
    return {"row": tick(edge.row), **told, "difference": difference}
