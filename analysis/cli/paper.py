"""The command that makes the paper's figures anew."""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from analysis.cli.app import Out, Runs, command_line, progress

commands = typer.Typer()


class PaperSection(StrEnum):
    """A section of the paper of which a page can be made."""

    DISCRETE = "discrete"
    CONTINUUM = "continuum"


@commands.command()
def paper(
    section: Annotated[PaperSection, typer.Argument(help="Section of the paper.")],
    figure: Annotated[
        list[str] | None,
        typer.Option(
            help="Number of a figure (continuum: also 3.2.1, mesh, bridge); give it several times. Left out: all."
        ),
    ] = None,
    runs: Runs = Path("out"),
    out: Out = Path("paper"),
) -> None:
    """Make the paper's figures anew: one HTML page that says which of its statements hold, and the
    pictures as files.

    Example: percussions paper discrete --figure 1 --figure 3 --out paper
    """
    from analysis.paper.page import write_continuum_page, write_discrete_page

    write = write_discrete_page if section is PaperSection.DISCRETE else write_continuum_page
    with progress() as bars:
        page, warnings = write(out, runs, command_line(), figure, bars)
    for warning in warnings:
        print(f"warning: {warning}", file=sys.stderr)
    print(page.resolve().as_uri())
