"""The atlas as a page: one self-contained HTML file, with maps, cells and boundaries as files
beside it."""

from __future__ import annotations

import csv
import json
import os
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from analysis.pages.html import jsonable, prose, render, write_picture
from analysis.pages.numbers import number, percent
from analysis.pages.section import Picture
from analysis.stability.atlas import build, choose
from analysis.stability.case import Boundary, Map, Outcome
from analysis.stability.charts import LOOKS, draw_map, tick
from analysis.support.files import whole_file, write_text
from analysis.support.progress import Progress


def write_atlas(
    folder: Path,
    runs: Path,
    command: str,
    *,
    names: Sequence[str] | None = None,
    quick: bool = False,
    processes: int | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> tuple[Path, list[Map]]:
    """Make the chosen cases and write `index.html`, `figures/`, `cells.csv`, `boundaries.csv` and
    `atlas.json`.

    Returns the page's path and the maps. Raises ValueError for an unknown case.
    """
    started = time.perf_counter()
    maps = build(choose(names, quick), runs, quick, progress, processes, scheduler)
    images = {
        made.case.name: write_picture(
            Picture(name=made.case.name, caption=made.case.title, figure=draw_map(made)),
            folder / "figures",
        )
        for made in maps
    }
    write_cells(folder / "cells.csv", maps)
    write_boundaries(folder / "boundaries.csv", maps)
    content = {made.case.name: _numbers(made) for made in maps}
    write_text(
        folder / "atlas.json", json.dumps(jsonable(content), indent=1, ensure_ascii=False) + "\n"
    )
    cells = [cell for made in maps for cell in made.cells]
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
        wall_seconds=time.perf_counter() - started,
        cores=os.cpu_count(),
    )
    write_text(folder / "index.html", page)
    return folder / "index.html", maps


def write_cells(path: Path, maps: Sequence[Map]) -> None:
    """One row a cell and quantity: case, row, column, outcome, its own status, the guard's verdict,
    reason, quantity, value."""
    with whole_file(path) as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(
            [
                "case",
                "row",
                "column",
                "outcome",
                "own_status",
                "guard",
                "reason",
                "quantity",
                "value",
            ]
        )
        for made in maps:
            for cell in made.cells:
                for name, value in zip(made.case.quantities, cell.numbers, strict=True):
                    rows.writerow(
                        [
                            made.case.name,
                            cell.row,
                            cell.column,
                            str(cell.outcome),
                            cell.said,
                            cell.guard,
                            cell.reason,
                            name,
                            repr(value),
                        ]
                    )


def write_boundaries(path: Path, maps: Sequence[Map]) -> None:
    """One row a boundary: case, row, the bracket, its middle, theory, (measured − theory)/theory
    and half the bracket over theory."""
    with whole_file(path) as file:
        rows = csv.writer(file, lineterminator="\n")
        names = [
            "case",
            "row",
            "low",
            "high",
            "measured",
            "theory",
            "relative_difference",
            "half_bracket",
        ]
        rows.writerow(names)
        for made in maps:
            for edge in made.boundaries:
                numbers = (
                    edge.low,
                    edge.high,
                    edge.measured,
                    edge.theory,
                    edge.difference,
                    edge.half_width,
                )
                rows.writerow([made.case.name, edge.row, *map(repr, numbers)])


def _numbers(made: Map) -> dict[str, Any]:
    return {
        "title": made.case.title,
        "columns": asdict(made.case.columns),
        "rows": asdict(made.case.rows),
        "quantities": list(made.case.quantities),
        "cells": [asdict(cell) for cell in made.cells],
        "boundaries": [asdict(edge) for edge in made.boundaries],
    }


def _content(made: Map, image: str) -> dict[str, Any]:
    case = made.case
    return {
        "name": case.name,
        "title": case.title,
        "fails": prose(case.fails),
        "edge": prose(case.edge),
        "words": [prose(words) for words in case.words],
        "image": image,
        "column": case.columns.label,
        "row": case.rows.label,
        "quantities": [prose(name) for name in case.quantities],
        "count": len(made.cells),
        "failed": sum(cell.outcome is not Outcome.STABLE for cell in made.cells),
        "silent": sum(cell.silent for cell in made.cells),
        "guarded": any(cell.guard for cell in made.cells),
        "boundaries": [_edge(edge) for edge in made.boundaries],
        "compared": [_edge(edge) for edge in made.boundaries if edge.theory == edge.theory],
        "numbered": not isinstance(case.rows.values[0], str),
        "cells": [
            {
                "row": tick(cell.row),
                "column": tick(cell.column),
                "outcome": str(cell.outcome),
                "stable": cell.outcome is Outcome.STABLE,
                "silent": cell.silent,
                "said": cell.said,
                "guard": cell.guard,
                "reason": cell.reason,
                "numbers": [number(value, 4) for value in cell.numbers],
            }
            for cell in made.cells
        ],
    }


def _edge(edge: Boundary) -> dict[str, Any]:
    """A boundary as the page shows it: no more digits than its bracket has."""
    return {
        "row": tick(edge.row),
        "low": number(edge.low, 4),
        "high": number(edge.high, 4),
        "measured": number(edge.measured, 4),
        "theory": number(edge.theory, 4),
        "difference": f"{percent(edge.difference)} ± {percent(edge.half_width)}"
        if edge.theory == edge.theory
        else "–",
    }
