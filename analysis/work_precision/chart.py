"""The chart of a scene, whole: its points, their Pareto fronts, and cost against size."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from analysis.engines import ENGINES
from analysis.scene.scene import Scene
from analysis.support.parallel import workers
from analysis.support.progress import Progress
from analysis.work_precision.continuum.ladder import SIDES
from analysis.work_precision.measure import Measured, measure
from analysis.work_precision.point import Point
from analysis.work_precision.scaling import scaling
from analysis.work_precision.soft_runs import settings_of
from analysis.work_precision.window_start import prepare_window


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chart:
    """A scene, what was measured on its window, the points of cost against size (none for a scene
    of fixed size), and what went wrong on the way."""

    scene: Scene
    measured: Measured
    scaling: tuple[Point, ...]
    warnings: tuple[str, ...]


def build_chart(
    scene: Scene,
    runs: Path,
    *,
    processes: int | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Chart:
    """Measure a scene with all engines that are there, all solvers, the rivals and the continuum.

    Everything that takes long is kept in runs/work_precision/<scene>: a build that was interrupted
    goes on where it stopped. Raises ValueError as `workers` and `prepare_window` do."""
    folder = (runs / "work_precision" / scene.name).absolute()
    engines = tuple(engine.NAME for engine in ENGINES if engine.find())
    warnings = [
        f"{engine.NAME} is not found: it is not on the chart"
        for engine in ENGINES
        if not engine.find()
    ]
    with workers(processes, scheduler) as executor:
        window = prepare_window(scene, folder)
        settings = list(settings_of(window, engines))
        measured = measure(
            window, scene.name, settings, folder, executor, progress, mesh_sides=SIDES
        )
        sizes = scaling(scene, engines, folder, executor, progress)
    return Chart(
        scene=scene,
        measured=measured,
        scaling=tuple(sizes),
        warnings=(*warnings, *measured.warnings),
    )
