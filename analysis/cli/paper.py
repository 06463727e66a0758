"""percussions paper."""

from enum import StrEnum
from pathlib import Path

from analysis.cli.app import command_line, progress, say_expected, show_page, warn
from analysis.cli.options import Out


class PaperSection(StrEnum):
    """A section of the paper that has a page."""

    DISCRETE = "discrete"
    CONTINUUM = "continuum"


def paper(
    section: PaperSection | None = None,
    *,
    figure: list[str] | None = None,
    runs: Out = Path("out"),
    out: Out = Path("paper"),
) -> None:
    """Recompute the paper's figures, and say which of its statements hold.

    Writes a page for each section, and the pictures as files.

    section: Section of the paper. Default: both.
    figure: Number of a figure (continuum: also 3.2.1, mesh, bridge). May be repeated.
        Default: all.

    Example: percussions paper discrete --figure 1 --figure 3 --out paper"""
    from analysis.paper.page import write_pages

    names = [str(one) for one in ([section] if section else PaperSection)]
    _say_expected(names, runs, figure)
    with progress() as bars:
        pages, warnings = write_pages(names, out, runs, command_line(), figure, bars)
    for warning in warnings:
        warn(warning)
    for page in pages:
        show_page(page)


def _say_expected(names: list[str], runs: Path, figures: list[str] | None) -> None:
    from analysis.advice.library import expected_seconds
    from analysis.paper.page import PAGES, folder_of, kept

    seconds = 0.0
    for part in (part for name in names for part in PAGES[name].parts):
        if figures and part.number not in figures:
            continue
        if part.engine_runs or not kept(folder_of(runs, part)):
            seconds += part.seconds
        for run in part.engine_runs(runs) if part.engine_runs else []:
            if not run.is_finished():
                seconds += expected_seconds(run.scene, run.engine)
    say_expected(seconds, "what is not there yet", None)
