"""percussions standards."""

from pathlib import Path

import typer

from analysis.cli.app import command_line, progress, show, show_page
from analysis.cli.options import Out, Processes


def standards(
    *,
    case: list[str] | None = None,
    engine: str = "rigid",
    runs: Out = Path("out"),
    jobs: Processes | None = None,
    out: Out = Path("standards"),
) -> None:
    """Run tests of NIST TN 1822, ISO 20414 and RiMEA, and tell which pass.

    Exit status 1 if one fails. Writes standards.html, standards.csv and standards.json. About 30 s
    of CPU with the rigid engine.

    case: Name of a test. May be repeated. Default: all.
    engine: Engine.

    Example: percussions standards --case corridor --case corner --out standards"""
    from analysis.standards.page import choose, run_tests, write_page

    chosen = choose(case)
    with progress() as bars:
        tested = run_tests(chosen, engine, runs, bars, jobs)
    page = write_page(tested, engine, out, command_line())
    rows = [(one.case.name, *one.called, one.result, one.words["found"]) for one in tested]
    show(("test", "NIST", "ISO", "RiMEA", "result", "found"), rows, numbers_from=6)
    show_page(page)
    raise typer.Exit(not all(one.judged.passed for one in tested))
