"""The paper's pages: one self-contained HTML file each, with pictures, claims and tables beside."""

from __future__ import annotations

import csv
import json
import os
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import markupsafe

from analysis.pages.html import jsonable, prose, render, sentence, write_picture
from analysis.pages.numbers import number
from analysis.pages.section import Cell, Table, Verdict
from analysis.paper.build import CONTINUUM, DISCRETE, Built, Part, build
from analysis.paper.errata import errata
from analysis.support.files import whole_file, write_text
from analysis.support.progress import Progress

ORDER = (Verdict.FAILS, Verdict.PARTLY, Verdict.HOLDS)
SOLVED, NONE = "solved", "–"
DIGITS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Page:
    """A part of the paper on a page.

    template: name of the template
    file: name of the page
    prefix: start of the names of the files beside it
    errata: heading of its part of the errata
    parts: what stands on it
    """

    template: str
    file: str
    prefix: str
    errata: str
    parts: Sequence[Part]


PAGES = {
    "discrete": Page(
        template="paper_discrete.html",
        file="index.html",
        prefix="",
        errata="Section 2",
        parts=DISCRETE,
    ),
    "continuum": Page(
        template="paper_continuum.html",
        file="continuum.html",
        prefix="continuum_",
        errata="Section 3",
        parts=CONTINUUM,
    ),
}


def write_pages(
    names: Sequence[str],
    folder: Path,
    runs: Path,
    command: str,
    figures: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> tuple[list[Path], list[str]]:
    """Build the chosen figures of the named pages, and write the pages and the files beside them.

    A page links to the other one if that is written too, or stands in the folder already. Returns
    the paths of the pages and the warnings. Raises ValueError for an unknown figure."""
    started = time.perf_counter()
    pages = [PAGES[name] for name in names]
    made = build([part for page in pages for part in page.parts], runs, figures, progress)
    chosen = {
        page: [b for b in made if b.section.number in [part.number for part in page.parts]]
        for page in pages
    }
    pages = [page for page in pages if chosen[page]]
    there = [page for page in PAGES.values() if page in pages or (folder / page.file).exists()]
    for page in pages:
        other = next((one.file for one in there if one != page), None)
        _write_page(page, folder, command, chosen[page], other, started)
    warnings = [f"{b.label}: {warning}" for b in made for warning in b.section.warnings]
    return [folder / page.file for page in pages], warnings


def _write_page(
    page: Page,
    folder: Path,
    command: str,
    built: Sequence[Built],
    other: str | None,
    started: float,
) -> None:
    images = {
        picture.name: write_picture(picture, folder / "figures")
        for made in built
        for picture in made.section.pictures
    }
    write_claims(folder / f"{page.prefix}claims.csv", built)
    content = {made.section.number: _numbers(made) for made in built}
    numbers = folder / f"{page.prefix}numbers.json"
    write_text(numbers, json.dumps(jsonable(content), indent=1, ensure_ascii=False) + "\n")
    text = render(
        page.template,
        command=command,
        prefix=page.prefix,
        other=other,
        sections=[_section_content(made, images) for made in built],
        verdicts=[(verdict, _claims_with(verdict, built)) for verdict in ORDER],
        claim_count=sum(len(made.section.claims) for made in built),
        errata=[
            {name: prose(words) for name, words in asdict(entry).items()}
            for entry in errata(page.errata)
        ],
        built=built,
        wall_seconds=time.perf_counter() - started,
        most=max(built, key=lambda made: made.total_seconds),
        total_seconds=sum(made.total_seconds for made in built),
        cores=os.cpu_count(),
    )
    write_text(folder / page.file, text)


def write_claims(path: Path, built: Sequence[Built]) -> None:
    """Write one row per claim: figure, where in the paper, statement, verdict, reason."""
    with whole_file(path) as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["figure", "where", "statement", "verdict", "reason"])
        for made in built:
            for claim in made.section.claims:
                rows.writerow([made.section.number, *asdict(claim).values()])


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
    lists = ("warnings", "words", "differs")
    return {name: [prose(words) for words in getattr(section, name)] for name in lists} | {
        "number": section.number,
        "label": made.label,
        "anchor": _anchor(made),
        "figure": section.number[:1].isdigit(),
        "title": section.title,
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
        "tables": [asdict(table) for table in section.tables],
        "cpu_seconds": {"here": made.cpu_seconds, "engines": made.engines.cpu_seconds},
        "engine_runs": {
            "made": made.engines.made,
            "reused": made.engines.reused,
            "failed": made.engines.failed,
        },
    }
