"""The command that recomputes the paper's figures."""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from analysis.cli.app import Out, Runs, command_line, progress

commands = typer.Typer()


class PaperSection(StrEnum):
    """A section of the paper that has a page."""

    DISCRETE = "discrete"
    CONTINUUM = "continuum"


@commands.command()
def paper(
    section: Annotated[
        PaperSection | None, typer.Argument(help="Section of the paper. Left out: both.")
    ] = None,
    figure: Annotated[
        list[str] | None,
        typer.Option(
            help="Number of a figure (continuum: also 3.2.1, mesh, bridge); several times for "
            "several. Left out: all."
        ),
    ] = None,
    runs: Runs = Path("out"),
    out: Out = Path("paper"),
) -> None:
    """Recompute the paper's figures: a page for each section that says which statements hold, and
    the pictures as files.

    Example: percussions paper discrete --figure 1 --figure 3 --out paper
    """
    from analysis.paper.page import write_pages

    names = [str(one) for one in PaperSection] if section is None else [str(section)]
    with progress() as bars:
        pages, warnings = write_pages(names, out, runs, command_line(), figure, bars)
    for warning in warnings:
        print(f"warning: {warning}", file=sys.stderr)
    for page in pages:
        print(page.resolve().as_uri())
