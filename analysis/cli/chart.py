"""percussions chart."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from analysis.cli.app import command_line, progress, say_expected, show, show_page, warn
from analysis.cli.options import Out, Processes, Replicates

if TYPE_CHECKING:
    from collections.abc import Sequence

    from analysis.scene.scene import Scene
    from analysis.work_precision.whole_runs import Planned

# Crowds of whole runs: they about double what a chart costs.
SEEDS = 3


def chart(
    scene: str,
    *,
    quick: bool = False,
    seeds: Replicates | None = None,
    runs: Out = Path("out"),
    scheduler: str | None = None,
    jobs: Processes | None = None,
    out: Out = Path("chart"),
) -> None:
    """Measure cost against error of every method on a scene.

    Each on one instant, and the engines on whole runs of several crowds.

    Writes a page with charts, and its points as CSV and JSON.

    quick: A coarse chart: few settings, and one size.
    seeds: Crowds that every engine runs from start to end, for errors of means. 0: none. Default:
        3, none of a quick chart.

    Example: percussions chart arch --out chart/arch"""
    from analysis.scene.scene import read_scene
    from analysis.work_precision import chart as instants
    from analysis.work_precision import page, point, soft, whole_runs

    chosen = read_scene(scene)
    soft.check_chart(chosen)
    crowds = (0 if quick else SEEDS) if seeds is None else seeds
    whole = whole_runs.whole_runs_of(chosen, crowds, runs)
    _say_expected(chosen, runs, quick, jobs, whole)
    found, sections = None, []
    with progress() as bars:
        made = instants.build_chart(
            chosen, runs, quick=quick, processes=jobs, scheduler=scheduler, progress=bars
        )
        if whole:
            found = whole_runs.measure_whole_runs(chosen, whole, progress=bars, processes=jobs)
            sections = [whole_runs.whole_runs_section(found)]
    written = page.write_chart(made, out, command_line(), sections)
    if found:
        point.write_points(out, found.points, whole_runs.NAME, whole_runs.WholeRunPoint)
    for quantity in made.measured.quantities:
        head, rows = page.front_table(made, quantity)
        title = f"Pareto fronts, all methods and soft contacts alone: {quantity.words}"
        show(head, rows, numbers_from=2, title=f"{title} ({quantity.unit})")
    for warning in made.warnings:
        warn(warning)
    show_page(written)


def _say_expected(
    scene: Scene, runs: Path, quick: bool, jobs: int | None, whole: Sequence[Planned]
) -> None:
    from analysis.advice.library import expected_seconds
    from analysis.engines import PENALTY
    from analysis.work_precision import soft
    from analysis.work_precision.window import driven_window, impact_window

    driven = scene.drive is not None
    window = driven_window(scene, scene.snapshot.position) if driven else impact_window(scene)
    folder = runs / "work_precision" / scene.name
    names = [engine.NAME for engine in PENALTY if engine.find()]
    settings = soft.settings_of(window, names, soft.QUICK if quick else soft.FULL)
    missing = [one for one in settings if not soft.run_folder(folder, one).exists()]
    seconds = sum(expected_seconds(soft.scene_of(window, one), one.engine) for one in missing)
    start = soft.pressing(scene)
    if start is not None and names and not (folder / "start.npz").exists():
        # on one core, before anything else
        seconds += (jobs or os.cpu_count() or 1) * expected_seconds(start, names[0])
    more = [one.run for one in whole if not one.run.is_finished()]
    seconds += sum(expected_seconds(run.scene, run.engine) for run in more)
    say_expected(seconds, f"{len(missing) + len(more)} runs of engines", jobs)
