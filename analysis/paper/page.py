"""The page of a part of the paper: one self-contained HTML file, with pictures, claims and tables
as files beside it."""

from __future__ import annotations

import csv
import json
import os
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import markupsafe

from analysis.pages.html import jsonable, prose, render, sentence, write_picture
from analysis.pages.numbers import number
from analysis.pages.section import Cell, Table, Verdict
from analysis.paper.build_continuum import build_continuum
from analysis.paper.build_discrete import build_discrete
from analysis.paper.built import Built
from analysis.paper.errata import errata
from analysis.paper.pages import CONTINUUM, DISCRETE, PageName, link_pages
from analysis.support.files import whole_file, write_text
from analysis.support.progress import Progress

ORDER = (Verdict.FAILS, Verdict.PARTLY, Verdict.HOLDS)
SOLVED, NONE = "solved", "–"
DIGITS = 4


def write_discrete_page(
    folder: Path,
    runs: Path,
    command: str,
    figures: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> tuple[Path, list[str]]:
    """Build the chosen figures of the discrete section and write `index.html`, `figures/`,
    `claims.csv`, `numbers.json`.

    Returns the page's path and the warnings, each with its figure. Raises ValueError for an unknown
    figure."""
    started = time.perf_counter()
    return _write_page(DISCRETE, folder, command, build_discrete(runs, figures, progress), started)


def write_continuum_page(
    folder: Path,
    runs: Path,
    command: str,
    figures: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> tuple[Path, list[str]]:
    """The same of the continuum section: `continuum.html`, `figures/`, `continuum_claims.csv`,
    `continuum_numbers.json`."""
    started = time.perf_counter()
    return _write_page(
        CONTINUUM, folder, command, build_continuum(runs, figures, progress), started
    )


def _write_page(
    page: PageName, folder: Path, command: str, built: Sequence[Built], started: float
) -> tuple[Path, list[str]]:
    drawing = time.process_time()
    images = {
        picture.name: write_picture(picture, folder / "figures")
        for made in built
        for picture in made.section.pictures
    }
    drawing = time.process_time() - drawing
    write_claims(folder / f"{page.prefix}claims.csv", built)
    content = {made.section.number: _numbers(made) for made in built}
    numbers = folder / f"{page.prefix}numbers.json"
    write_text(numbers, json.dumps(jsonable(content), indent=1, ensure_ascii=False) + "\n")
    text = render(
        page.template,
        command=command,
        prefix=page.prefix,
        sections=[_section_content(made, images) for made in built],
        verdicts=[(verdict, _claims_with(verdict, built)) for verdict in ORDER],
        claim_count=sum(len(made.section.claims) for made in built),
        errata=[
            {name: prose(words) for name, words in asdict(entry).items()}
            for entry in errata(page.errata)
        ],
        built=built,
        drawing_seconds=drawing,
        wall_seconds=time.perf_counter() - started,
        most=max(built, key=lambda made: made.total_seconds),
        total_seconds=drawing + sum(made.total_seconds for made in built),
        cores=os.cpu_count(),
    )
    write_text(folder / page.file, text)
    link_pages(folder)
    warnings = [f"{made.label}: {warning}" for made in built for warning in made.section.warnings]
    return folder / page.file, warnings


def write_claims(path: Path, built: Sequence[Built]) -> None:
    """One row a claim: figure, where in the paper, statement, verdict, reason."""
    with whole_file(path) as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["figure", "where", "statement", "verdict", "reason"])
        for made in built:
            for claim in made.section.claims:
                rows.writerow(
                    [
                        made.section.number,
                        claim.where,
                        claim.statement,
                        str(claim.verdict),
                        claim.reason,
                    ]
                )


def _claims_with(verdict: Verdict, built: Sequence[Built]) -> list[dict[str, Any]]:
    return [
        {
            "label": made.label,
            "anchor": _anchor(made),
            "where": prose(claim.where),
            "statement": prose(claim.statement),
            "reason": sentence(claim.reason),
        }
        for made in built
        for claim in made.section.claims
        if claim.verdict == verdict
    ]


def _anchor(made: Built) -> str:
    return f"fig-{made.section.number.replace('.', '-')}"


def _section_content(made: Built, images: dict[str, str]) -> dict[str, Any]:
    section = made.section
    return {
        "number": section.number,
        "label": made.label,
        "anchor": _anchor(made),
        "figure": section.number[:1].isdigit(),
        "title": section.title,
        "warnings": [prose(words) for words in section.warnings],
        "words": [prose(words) for words in section.words],
        "differs": [prose(words) for words in section.differs],
        "claims": [
            {
                "where": prose(claim.where),
                "statement": prose(claim.statement),
                "verdict": claim.verdict,
                "fails": claim.verdict == Verdict.FAILS,
            }
            for claim in section.claims
        ],
        "tables": [_table_content(table) for table in section.tables],
        "pictures": [
            {"name": p.name, "caption": prose(p.caption), "image": images[p.name]}
            for p in section.pictures
        ],
    }


def _table_content(table: Table) -> dict[str, Any]:
    rows = [
        [_cell_content(head, cell) for head, cell in zip(table.head, row, strict=True)]
        for row in table.rows
    ]
    return {"caption": prose(table.caption), "head": _heads(table), "rows": rows}


def _heads(table: Table) -> list[tuple[markupsafe.Markup, str]]:
    """Each head and its class: above words it stands where they begin."""
    first = table.rows[0] if table.rows else [0.0] * len(table.head)
    worded = [isinstance(cell, str) and cell != NONE for cell in first]
    return [(prose(head), "words" if w else "") for head, w in zip(table.head, worded, strict=True)]


def _cell_content(head: str, cell: Cell) -> tuple[markupsafe.Markup, str]:
    """A cell as HTML and its class: an answer that is not plainly solved is an alarm."""
    if not isinstance(cell, str):
        return markupsafe.Markup(number(cell, _digits(cell)).replace("-", "−")), ""
    if cell == NONE:
        return prose(cell), ""
    return prose(cell), "name alarm" if head == "status" and cell != SOLVED else "name"


def _digits(value: float) -> int:
    """As many as DIGITS, or fewer where they are all that there is: 0.05, not 0.05000."""
    enough = (
        d for d in range(1, DIGITS) if abs(value - float(f"{value:.{d}g}")) <= 1e-12 * abs(value)
    )
    return next(enough, DIGITS)


def _numbers(made: Built) -> dict[str, Any]:
    section = made.section
    return {
        "title": section.title,
        "warnings": list(section.warnings),
        "words": list(section.words),
        "differs": list(section.differs),
        "tables": [
            {
                "caption": table.caption,
                "head": list(table.head),
                "rows": [list(row) for row in table.rows],
            }
            for table in section.tables
        ],
        "cpu_seconds": {"here": made.cpu_seconds, "engines": made.engines.cpu_seconds},
        "engine_runs": {
            "made": made.engines.made,
            "reused": made.engines.reused,
            "failed": made.engines.failed,
        },
    }
