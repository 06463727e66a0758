"""The chart of a scene, whole: its points, and cost against the number of disks, each method at the
cheapest setting that is accurate enough."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import MAKERS, OF_FIXED_SIZE, make
from analysis.support.parallel import workers
from analysis.support.progress import Progress
from analysis.work_precision.continuum.ladder import COARSE, SIDES
from analysis.work_precision.measure import Measured, measure
from analysis.work_precision.point import Point, PointStatus
from analysis.work_precision.soft_runs import (
    FULL,
    LAWS,
    QUICK,
    STIFFER,
    Grid,
    settings_of,
    soft_engines,
)
from analysis.work_precision.window_start import prepare_window

ACCURACY = 0.01
LINES, CROWDS = (5, 10, 20, 40, 80), (75, 150, 300, 600)
# Cost against size: of the middle stiffness of the chart.
SIZES = Grid(stiffer=STIFFER[len(STIFFER) // 2 :][:1], shares=(1.0, 4.0, 8.0))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chart:
    """A scene and what was measured on its window.

    scaling: the points of cost against size; none for a scene of fixed size, or a quick chart.
    warnings: what went wrong on the way.
    quick: whether it was measured with few settings."""

    scene: Scene
    measured: Measured
    scaling: tuple[Point, ...]
    warnings: tuple[str, ...]
    quick: bool = False

    @property
    def mesh_sides(self) -> tuple[float, ...]:
        """Sides of the triangles of the continuum, in mean radii."""
        return COARSE if self.quick else SIDES


def build_chart(
    scene: Scene,
    runs: Path,
    *,
    quick: bool = False,
    processes: int | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Chart:
    """Measure a scene with all engines that are there, all solvers, the rivals and the continuum;
    quick: with few settings, and in one size.

    Everything that takes long is kept in runs/work_precision/<scene>: a build that was interrupted
    goes on where it stopped. Raises ValueError as `workers` and `prepare_window` do."""
    folder = (runs / "work_precision" / scene.name).absolute()
    engines = soft_engines()
    missing = [name for name in LAWS if name not in engines]
    sides = COARSE if quick else SIDES
    with workers(processes, scheduler) as executor:
        window = prepare_window(scene, folder)
        settings = list(settings_of(window, engines, QUICK if quick else FULL))
        measured = measure(window, scene.name, settings, folder, executor, progress, sides)
        sizes = () if quick else tuple(scaling(scene, engines, folder, executor, progress))
    return Chart(
        scene=scene,
        measured=measured,
        scaling=sizes,
        warnings=(
            *(f"{name} is not found: it is not on the chart" for name in missing),
            *measured.warnings,
        ),
        quick=quick,
    )


def sizes_of(scene: Scene) -> tuple[int, ...]:
    """Give the sizes at which a scene of the product is made again; none for a scene of fixed size,
    or one of the user's."""
    if scene.name not in MAKERS or scene.name in OF_FIXED_SIZE:
        return ()
    return CROWDS if scene.drive else LINES


def scaling(
    scene: Scene,
    engines: Sequence[str],
    folder: Path,
    executor: Executor,
    progress: Progress | None = None,
) -> Iterator[Point]:
    """Yield for each size and method the cheapest point whose numerical error, of what the disks
    receive, is within ACCURACY. A method without such a point at a size is left out there."""
    for size in sizes_of(scene):
        place = folder / f"{size}_disks"
        window = prepare_window(make(scene.name, size), place)
        settings = list(settings_of(window, engines, SIZES))
        made = measure(window, scene.name, settings, place, executor, progress, SIDES)
        yield from cheapest(p for p in made.points if p.quantity.startswith("disk_"))


def cheapest(points: Iterable[Point], accuracy: float = ACCURACY) -> list[Point]:
    """Choose of each method the cheapest point whose numerical error is within the accuracy."""
    best: dict[str, Point] = {}
    for point in points:
        if (
            point.status != PointStatus.OK
            or point.cpu_seconds is None
            or point.numerical_error is None
        ):
            continue
        if point.numerical_error <= accuracy:
            other = best.get(point.key)
            if other is None or point.cpu_seconds < (other.cpu_seconds or 0.0):
                best[point.key] = point
    return list(best.values())
