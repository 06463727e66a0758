"""The paper's pages: one self-contained HTML file each, with pictures, claims and tables beside."""

import os
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from analysis.pages.html import render, write_pictures
from analysis.pages.numbers import number
from analysis.pages.section import Section, Table, Verdict
from analysis.paper.build import CONTINUUM, DISCRETE, Built, Part, build
from analysis.paper.errata import errata
from analysis.support.files import write_json, write_rows, write_text
from analysis.support.progress import Progress

ORDER = (Verdict.FAILS, Verdict.PARTLY, Verdict.HOLDS)
CLAIMS = ("where", "statement", "what came out", "see")
ERRATA = ("where", "printed", "correct", "why")
COSTS = (
    "section",
    "engine runs made",
    "taken as they were",
    "failed",
    "engines (CPU s)",
    "the rest (CPU s)",
    "built",
)


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
    images = write_pictures((made.section for made in built), folder / "figures")
    write_claims(folder / f"{page.prefix}claims.csv", built)
    content = {made.section.number: _numbers(made) for made in built}
    write_json(folder / f"{page.prefix}numbers.json", content)
    text = render(
        page.template,
        command=command,
        prefix=page.prefix,
        other=other,
        built=built,
        images=images,
        contents=_contents(page, built),
        verdicts=[(verdict, _claims(verdict, built)) for verdict in ORDER],
        claim_count=sum(len(made.section.claims) for made in built),
        errata=Table(caption="", head=ERRATA, rows=_errata(page)),
        costs=_costs(built),
        wall_seconds=time.perf_counter() - started,
        most=max(built, key=lambda made: made.total_seconds),
        total_seconds=sum(made.total_seconds for made in built),
        cores=os.cpu_count(),
    )
    write_text(folder / page.file, text)


def write_claims(path: Path, built: Sequence[Built]) -> None:
    """Write one row per claim: figure, where in the paper, statement, verdict, reason."""
    rows = [
        (made.section.number, *asdict(claim).values())
        for made in built
        for claim in made.section.claims
    ]
    write_rows(path, ("figure", "where", "statement", "verdict", "reason"), rows)


def _contents(page: Page, built: Sequence[Built]) -> list[Section]:
    """What the page links to at its head."""
    entries = [("claims", "Which statements hold")]
    for made in built:
        figure = f"{made.label}: " if made.section.number.isdigit() else ""
        entries.append((made.anchor, figure + made.section.title))
    entries += [("errata", "Errata")] if errata(page.errata) else []
    entries.append(("cost", "What this page cost"))
    return [Section(number=anchor, title=title) for anchor, title in entries]


def _claims(verdict: Verdict, built: Sequence[Built]) -> Table:
    """The claims with this verdict, each with a link to its section."""
    rows = [
        (claim.where, claim.statement, _sentence(claim.reason), f"[{made.label}](#{made.anchor})")
        for made in built
        for claim in made.section.claims
        if claim.verdict == verdict
    ]
    return Table(caption=f"**{verdict.capitalize()} ({len(rows)})**", head=CLAIMS, rows=rows)


def _errata(page: Page) -> list[tuple[str, ...]]:
    return [tuple(asdict(entry).values()) for entry in errata(page.errata)]


def _sentence(words: str) -> str:
    """The words, beginning large and ending with a stop."""
    return words[:1].upper() + words[1:] + ("" if words.endswith(".") else ".")


def _costs(built: Sequence[Built]) -> Table:
    """What each section cost; failed runs in bold."""
    rows = [
        (
            made.label,
            made.engines.made,
            made.engines.reused,
            f"**{made.engines.failed}**" if made.engines.failed else 0,
            number(made.engines.cpu_seconds),
            number(made.cpu_seconds),
            "earlier" if made.kept else "now",
        )
        for made in built
    ]
    caption = "CPU seconds by section; a run that several sections use counts for the first"
    return Table(caption=caption, head=COSTS, rows=rows)


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
