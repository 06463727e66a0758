"""percussions stability."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from analysis.cli.app import Jobs, Out, Runs, Scheduler, command_line, progress


def stability(
    case: Annotated[
        list[str] | None, typer.Option(help="Name of a case; give it several times. Left out: all.")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="A coarse atlas.")] = False,
    runs: Runs = Path("out"),
    scheduler: Scheduler = None,
    jobs: Jobs = None,
    out: Out = Path("stability"),
) -> None:
    """Find where each method fails, by provoked failures, and compare with theory.

    Example: percussions stability --case time_step --case skin --out stability
    """
    from analysis.stability.atlas import build, choose
    from analysis.stability.page import summary, write_atlas

    started = time.perf_counter()
    with progress() as bars:
        maps = build(choose(case, quick), runs, quick, bars, jobs, scheduler)
    page = write_atlas(maps, out, command_line(), quick, time.perf_counter() - started)
    for line in summary(maps):
        print(line)
    print(page.resolve().as_uri())
