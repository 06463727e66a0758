"""percussions chart."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from analysis.cli.app import (
    Jobs,
    Out,
    Runs,
    SceneName,
    Scheduler,
    command_line,
    progress,
    show,
    warn,
)


def chart(
    scene: SceneName,
    quick: Annotated[
        bool, typer.Option("--quick", help="A coarse chart: few settings, and one size.")
    ] = False,
    runs: Runs = Path("out"),
    scheduler: Scheduler = None,
    jobs: Jobs = None,
    out: Out = Path("chart"),
) -> None:
    """Measure cost against error of every method on a scene.

    Writes a page with charts, and its points as CSV and JSON.

    Example: percussions chart arch --out chart/arch
    """
    from analysis.scene.scene import read_scene
    from analysis.work_precision.chart import build_chart
    from analysis.work_precision.page import front_table, write_chart

    chosen = read_scene(scene)
    with progress() as bars:
        made = build_chart(
            chosen, runs, quick=quick, processes=jobs, scheduler=scheduler, progress=bars
        )
    page = write_chart(made, out, command_line())
    for quantity in made.measured.quantities:
        head, rows = front_table(made, quantity)
        title = f"Pareto fronts, all methods and soft contacts alone: {quantity.words}"
        show(
            list(head),
            [list(row) for row in rows],
            numbers_from=2,
            title=f"{title} ({quantity.unit})",
        )
    for warning in made.warnings:
        warn(warning)
    print(page.resolve().as_uri())
