"""percussions chart."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from analysis.cli.app import (
    Jobs,
    Out,
    Runs,
    SceneName,
    Scheduler,
    command_line,
    progress,
    say_expected,
    show,
    warn,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from analysis.scene.scene import Scene
    from analysis.work_precision.whole_runs import Planned

# Crowds of whole runs: they about double what a chart costs.
SEEDS = 3


def chart(
    scene: SceneName,
    quick: Annotated[bool, typer.Option("--quick")] = False,
    seeds: Annotated[int | None, typer.Option(min=0, max=1000)] = None,
    runs: Runs = Path("out"),
    scheduler: Scheduler = None,
    jobs: Jobs = None,
    out: Out = Path("chart"),
) -> None:
    """Measure cost against error of every method on a scene.

    Each on one instant, and the engines on whole runs of several crowds.

    Writes a page with charts, and its points as CSV and JSON.

    quick: A coarse chart: few settings, and one size.
    seeds: Crowds that every engine runs from start to end, for errors of means; 0: none. Left out:
        3, none of a quick chart.

    Example: percussions chart arch --out chart/arch"""
    from analysis.scene.scene import read_scene
    from analysis.work_precision.chart import build_chart
    from analysis.work_precision.page import front_table, write_chart
    from analysis.work_precision.point import write_points
    from analysis.work_precision.soft import check_chart
    from analysis.work_precision.whole_runs import (
        NAME,
        WholeRunPoint,
        measure_whole_runs,
        whole_runs_of,
        whole_runs_section,
    )

    chosen = read_scene(scene)
    check_chart(chosen)
    crowds = (0 if quick else SEEDS) if seeds is None else seeds
    whole = whole_runs_of(chosen, crowds, runs)
    _say_expected(chosen, runs, quick, jobs, whole)
    with progress() as bars:
        made = build_chart(
            chosen, runs, quick=quick, processes=jobs, scheduler=scheduler, progress=bars
        )
        found = measure_whole_runs(chosen, whole, progress=bars, processes=jobs) if whole else None
    page = write_chart(made, out, command_line(), [whole_runs_section(found)] if found else ())
    if found:
        write_points(out, found.points, NAME, WholeRunPoint)
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


def _say_expected(
    scene: Scene, runs: Path, quick: bool, jobs: int | None, whole: Sequence[Planned]
) -> None:
    from analysis.advice.library import expected_seconds
    from analysis.engines import PENALTY
    from analysis.work_precision.soft import (
        FULL,
        QUICK,
        pressing,
        run_folder,
        scene_of,
        settings_of,
    )
    from analysis.work_precision.window import driven_window, impact_window

    driven = scene.drive is not None
    window = driven_window(scene, scene.snapshot.position) if driven else impact_window(scene)
    folder = runs / "work_precision" / scene.name
    names = [engine.NAME for engine in PENALTY if engine.find()]
    missing = [
        setting
        for setting in settings_of(window, names, QUICK if quick else FULL)
        if not run_folder(folder, setting).exists()
    ]
    seconds = sum(expected_seconds(scene_of(window, one), one.engine) for one in missing)
    start = pressing(scene)
    if start is not None and names and not (folder / "start.npz").exists():
        # on one core, before anything else
        seconds += (jobs or os.cpu_count() or 1) * expected_seconds(start, names[0])
    more = [one.run for one in whole if not one.run.is_finished()]
    seconds += sum(expected_seconds(run.scene, run.engine) for run in more)
    say_expected(seconds, f"{len(missing) + len(more)} runs of engines", jobs)
