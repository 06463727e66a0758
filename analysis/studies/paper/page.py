"""The paper's pages: their sections, how they are built, and one HTML file each with what lies beside."""

import base64
import functools
import hashlib
import os
import re
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field, replace
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import analysis
import nscd
from analysis.engines.run import Cost, EngineRun, run_ahead
from analysis.pages.html import drawn, render, write_pictures
from analysis.pages.section import Claim, Drawn, Section, Table, Verdict
from analysis.studies.paper.continuum import bridge, solid_chain
from analysis.studies.paper.continuum import fig7_border as fig7
from analysis.studies.paper.continuum import fig8_turbulence as fig8
from analysis.studies.paper.continuum import fig9_exit_pressure as fig9
from analysis.studies.paper.continuum import fig10_density as fig10
from analysis.studies.paper.continuum import fig11_left_velocities as fig11
from analysis.studies.paper.continuum import mesh_precision as mesh
from analysis.studies.paper.discrete import fig1_four_disks as fig1
from analysis.studies.paper.discrete import fig2_corridor as fig2
from analysis.studies.paper.discrete import fig3_chains as fig3
from analysis.studies.paper.discrete import fig4_arch as fig4
from analysis.studies.paper.discrete import fig5_masses as fig5
from analysis.studies.paper.discrete import fig6_rivals as fig6
from analysis.support import cache
from analysis.support.columns import Columns
from analysis.support.files import shipped, write_json, write_rows, write_text
from analysis.support.parallel import Progress, Task, do_all, workers

PAGE = shipped("docs/errata.md")


class Erratum(NamedTuple):
    """One entry: where in the paper, what is printed there, what is correct and why."""

    where: str
    printed: str
    correct: str
    why: str


def errata(section: str, page: Path = PAGE) -> list[Erratum]:
    """The rows of the table below the heading that starts with `## {section}`.

    Raises ValueError for a page without that heading, or with a row that has other parts."""
    chapters = re.split(r"^## ", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    chosen = [chapter for chapter in chapters[1:] if chapter.startswith(section)]
    if not chosen:
        raise ValueError(f"{page}: no heading '## {section}'")
    rows = [line.strip()[1:-1] for line in chosen[0].splitlines() if line.startswith("|")]
    entries = []
    for row in rows[2:]:  # after the heads and the rule
        parts = [_marked(cell.replace("\\|", "|")) for cell in re.split(r"(?<!\\)\|", row)]
        if len(parts) != len(Erratum._fields) or not all(parts):
            raise ValueError(f"{page}: not {', '.join(Erratum._fields)}: {row}")
        entries.append(Erratum(*parts))
    return entries


def _marked(words: str) -> str:
    """Words in one line, with u_d and x^{2} of the docs as u~d~ and x^2^, as pages take them.

    In the docs, which are also read elsewhere, `~` would strike out."""
    words = re.sub(r"\s+", " ", words).strip()
    words = re.sub(r"\^(?:\{([^}]*)\}|\(([^)]*)\)|(\w))", lambda m: _within(m, "^"), words)
    return re.sub(
        r"(?<=(?<!\w)[^\W_])_(?:\{([^}]*)\}|([A-Za-z0-9]+))", lambda m: _within(m, "~"), words
    )


def _within(match: re.Match[str], mark: str) -> str:
    """The group that matched between two marks, in which a space would end them."""
    return mark + match[match.lastindex or 0].replace(" ", "\u00a0") + mark


# What the numbers of a kept section depend on, beside the sources.
LIBRARIES = ("numpy", "scipy", "scikit-fem", "netgen-mesher", "matplotlib")


class Part(NamedTuple):
    """A figure of the paper, or a study beside the figures.

    build: its section, from progress, and before it the folder that keeps runs if it needs engines
    engine_runs: the runs that it needs, for that folder; None: it needs no engine"""

    number: str  # 8, 3.2.1, or a word
    seconds: float  # CPU seconds that building takes, about
    build: Callable[..., Section]
    engine_runs: Callable[[Path], list[EngineRun]] | None = None


DISCRETE: Sequence[Part] = (
    Part("1", 2, fig1.build, fig1.engine_runs),
    Part("2", 8, fig2.build, fig2.engine_runs),
    Part("3", 2, fig3.build),
    Part("4", 12, fig4.build, fig4.engine_runs),
    Part("5", 3, fig5.build, fig5.engine_runs),
    Part("6", 40, fig6.build, fig6.engine_runs),
)
CONTINUUM: Sequence[Part] = (
    Part("7", 8, fig7.build),
    Part("3.2.1", 2, solid_chain.build),
    Part("8", 70, fig8.build),
    Part("9", 10, fig9.build),
    Part("10", 20, fig10.build),
    Part("11", 6, fig11.build),
    Part("mesh", 30, mesh.build),
    Part("bridge", 110, bridge.build),
)
LABELS = {"mesh": "Speed and accuracy", "bridge": "From contacts to stress"}


def label(number: str) -> str:
    """Name a section: Fig. 8, Section 3.2.1, or the study beside the figures."""
    return f"Fig. {number}" if number.isdigit() else LABELS.get(number, f"Section {number}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Built:
    """A section and what it cost.

    engines: the engine runs made for it first; a run of several sections counts for the first"""

    section: Section
    cpu_seconds: float  # s, in Python
    engines: Cost = field(default_factory=Cost)
    reused: bool = False  # whether an earlier build made it
    used: Sequence[str] = ()  # names of the engines whose runs it shows

    @property
    def total_seconds(self) -> float:
        """CPU seconds of Python and the engines."""
        return self.cpu_seconds + self.engines.cpu_seconds

    @property
    def label(self) -> str:
        """Fig. 8, Section 3.2.1, or the name of a study beside the figures."""
        return label(self.section.number)

    @property
    def anchor(self) -> str:
        """What links on the page lead to."""
        return f"fig-{self.section.number.replace('.', '-')}"


def build(
    parts: Sequence[Part],
    runs: Path,
    figures: Iterable[str] | None = None,
    progress: Progress | None = None,
) -> list[Built]:
    """Build the chosen sections (all by default), on as many cores as there are.

    Engine runs come first, and unchanged ones are taken from `runs`, as are sections without engine
    runs that the same product has built. Raises ValueError for a figure that no part has."""
    numbers = [part.number for part in parts]
    wanted = list(numbers if figures is None else figures)
    for figure in wanted:
        if figure not in numbers:
            raise ValueError(f"figure: {figure}. This part of the paper has {', '.join(numbers)}")
    parts = [part for part in parts if part.number in wanted]
    needed = {part.number: part.engine_runs(runs) for part in parts if part.engine_runs}
    costs = run_ahead([run for chosen in needed.values() for run in chosen], progress)
    built = {
        part.number: found
        for part in parts
        if not part.engine_runs and (found := stored_section(folder_of(runs, part)))
    }
    missing = [part for part in parts if part.number not in built]
    if len(missing) < 2:
        new = [_make(part, runs, progress) for part in missing]
    else:
        tasks = [Task(call=_make, arguments=(part, runs), work=part.seconds) for part in missing]
        with workers() as executor:
            new = do_all(tasks, executor, "sections", progress, timed=True)
    for part, made in zip(missing, new, strict=True):
        mine = [costs.pop(run.folder, Cost()) for run in needed.get(part.number, [])]
        used = sorted({run.engine for run in needed.get(part.number, [])})
        built[part.number] = replace(made, engines=sum(mine, Cost()), used=used)
    return [built[part.number] for part in parts]


def _make(part: Part, runs: Path, progress: Progress | None = None) -> Built:
    """Build and draw a section; a worker process reports no progress."""
    made_by, started = edition(), time.process_time()
    section = part.build(runs, progress) if part.engine_runs else part.build(progress)
    section = replace(section, pictures=[drawn(picture) for picture in section.pictures])
    built = Built(section=section, cpu_seconds=time.process_time() - started)
    if not part.engine_runs:
        keep(built, folder_of(runs, part), made_by)
    return built


def folder_of(runs: Path, part: Part) -> Path:
    """Name the folder that keeps a part's section."""
    return runs / "paper_sections" / part.number


@functools.cache
def edition() -> str:
    """Digest what a section without engines depends on: our sources and words, the libraries."""
    versions = " ".join(f"{name} {metadata.version(name)}" for name in LIBRARIES)
    digest = hashlib.sha256(versions.encode())
    for package in (nscd, analysis):
        root = Path(package.__path__[0])
        for path in sorted([*root.rglob("*.py"), *root.rglob("*.md")]):
            digest.update(str(path.relative_to(root)).encode() + path.read_bytes())
    return digest.hexdigest()


def keep(built: Built, folder: Path, made_by: str) -> None:
    """Write a drawn section as one JSON file, whole or not at all; made_by: the edition."""
    content = asdict(built.section) | {"cpu_seconds": built.cpu_seconds}
    cache.store(folder / "section.json", made_by, content)


def stored_section(folder: Path) -> Built | None:
    """Read the section that this edition of the product has kept; None where there is none."""
    content = cache.cached(folder / "section.json", edition())
    if content is None:
        return None
    try:
        seconds = content.pop("cpu_seconds")
        for picture in content["pictures"]:
            picture |= {kind: base64.b64decode(picture[kind]) for kind in ("png", "pdf", "narrow")}
        content["pictures"] = [Drawn(**picture) for picture in content["pictures"]]
        content["tables"] = [Table(**table) for table in content["tables"]]
        content["claims"] = [
            Claim(**claim | {"verdict": Verdict(claim["verdict"])}) for claim in content["claims"]
        ]
        return Built(section=Section(**content), cpu_seconds=float(seconds), reused=True)
    except (ValueError, KeyError, TypeError):
        return None


# A longer table is a file beside the page.
MOST_ROWS = 3
ORDER = (Verdict.FAILS, Verdict.PARTLY, Verdict.HOLDS)
CLAIMS = Columns("claims")


class Page(NamedTuple):
    """A part of the paper on a page."""

    template: str  # name of the template
    file: str  # name of the page
    prefix: str  # start of the names of the files beside it
    errata: str  # heading of its part of the errata
    parts: Sequence[Part]  # what stands on it


PAGES = {
    "discrete": Page("paper_discrete.html", "index.html", "", "Section 2", DISCRETE),
    "continuum": Page(
        "paper_continuum.html", "continuum.html", "continuum_", "Section 3", CONTINUUM
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
    built = [with_long_tables_apart(made, folder, page.prefix) for made in built]
    images = write_pictures((made.section for made in built), folder / "figures")
    entries, beside = errata(page.errata), f"{folder}/{page.prefix}"
    claims = [(made, claim) for made in built for claim in made.section.claims]
    rows = [(made.section.number, *asdict(claim).values()) for made, claim in claims]
    write_rows(Path(f"{beside}claims.csv"), CLAIMS, rows)
    write_rows(Path(f"{beside}errata.csv"), Erratum._fields, entries)
    content = {made.section.number: _numbers(made) for made in built}
    write_json(Path(f"{beside}numbers.json"), content)
    text = render(
        page.template,
        command=command,
        prefix=page.prefix,
        other=other,
        built=built,
        images=images,
        contents=_contents(built),
        engines=[name for made in built for name in made.used],
        verdicts=[
            (verdict, [(one, made.anchor) for made, one in claims if one.verdict == verdict])
            for verdict in ORDER
        ],
        claim_count=len(rows),
        errata=entries,
        wall_seconds=time.perf_counter() - started,
        most=max(built, key=lambda made: made.total_seconds),
        total_seconds=sum(made.total_seconds for made in built),
        cores=os.cpu_count(),
    )
    write_text(folder / page.file, text)


def with_long_tables_apart(made: Built, folder: Path, prefix: str) -> Built:
    """Write tables of more than MOST_ROWS rows beside the page, which names their files."""
    tables = []
    for count, table in enumerate(made.section.tables, start=1):
        if len(table.rows) > MOST_ROWS:
            table = replace(table, file=f"{prefix}{made.anchor}-{count}.csv")
            write_rows(folder / table.file, table.head, table.rows)
        tables.append(table)
    return replace(made, section=replace(made.section, tables=tables))


def _contents(built: Sequence[Built]) -> list[tuple[str, str]]:
    """What the page links to at its head."""
    names = [f"{made.label}: " if made.section.number.isdigit() else "" for made in built]
    figures = [(b.anchor, name + b.section.title) for b, name in zip(built, names, strict=True)]
    claims = "claims", "Which statements hold"
    return [*figures, claims, ("errata", "Errata"), ("cost", "What this page cost")]


def _numbers(made: Built) -> dict[str, Any]:
    section, runs = made.section, asdict(made.engines)
    lists = {name: list(getattr(section, name)) for name in ("warnings", "words", "differs")}
    return {"title": section.title, **lists} | {
        "tables": [asdict(table) for table in section.tables],
        "cpu_seconds": {"here": made.cpu_seconds, "engines": runs.pop("cpu_seconds")},
        "engine_runs": runs,
    }
