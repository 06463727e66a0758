"""A scene measured for the library: every method over a short grid of time steps and
stiffnesses."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from pathlib import Path

from analysis.scene.scene import Scene
from analysis.work_precision.measure import measure
from analysis.work_precision.point import Point
from analysis.work_precision.soft_runs import Grid, settings_of
from analysis.work_precision.window_start import prepare_window

# Finer time steps cost more than any asked error is worth, coarser ones fail. YADE has the errors
# of LAMMPS with the same law (tests compare them), so that fewer of its runs tell its cost.
DRIVEN = Grid(shares=(0.25, 1.0, 4.0, 8.0), of_engine={"yade": (1.0, 4.0)})
# The errors of an impact are found without the library, which knows what its runs cost.
IMPACT = Grid(stiffer=(1.0,), shares=(1.0, 4.0))


def measured_points(
    scene: Scene,
    label: str,
    engines: Sequence[str],
    folder: Path,
    executor: Executor,
    grid: Grid | None = None,
) -> tuple[Point, ...]:
    """Measure the points of a scene over a grid (of its kind if left out), under the name `label`;
    runs are kept in the folder and reused the next time. Raises what `prepare_window` raises."""
    folder.mkdir(parents=True, exist_ok=True)
    window = prepare_window(scene, folder)
    settings = settings_of(window, engines, grid or (DRIVEN if window.driven else IMPACT))
    return measure(window, label, list(settings), folder, executor).points
