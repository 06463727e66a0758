"""The typer application, and what its commands share."""

from __future__ import annotations

import contextlib
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress

from analysis.support.progress import Progress as Report

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    help="Contact forces in a dense crowd: penalty (LAMMPS, YADE) against rigid (percussions), side by side.",
)
Out = Annotated[Path, typer.Option("--out", help="Folder for the results.")]
Runs = Annotated[Path, typer.Option(help="Folder for the runs; unchanged ones are used again.")]
SceneName = Annotated[str, typer.Argument(help="Name of a scene, or its .toml file.")]


@contextlib.contextmanager
def progress() -> Iterator[Report]:
    """A progress bar on a terminal; nothing where the output is not one."""
    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as bars:
        tasks: dict[str, int] = {}

        def report(label: str, share: float) -> None:
            if label not in tasks:
                tasks[label] = bars.add_task(label, total=1.0)
            bars.update(tasks[label], completed=share)  # type: ignore[arg-type]

        yield report


def command_line() -> str:
    """The command as it was typed, for the pages."""
    return shlex.join(["percussions", *sys.argv[1:]])
