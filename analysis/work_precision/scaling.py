"""Cost against the number of disks, each method at the cheapest setting that is accurate enough."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import Executor
from pathlib import Path

from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import MAKERS, OF_FIXED_SIZE, make
from analysis.support.progress import Progress
from analysis.work_precision.continuum.ladder import SIDES
from analysis.work_precision.measure import measure
from analysis.work_precision.point import Point, PointStatus
from analysis.work_precision.soft_runs import LAWS, STIFFER, SoftSetting
from analysis.work_precision.window_start import prepare_window

ACCURACY = 0.01
LINES, CROWDS = (5, 10, 20, 40, 80), (75, 150, 300, 600)
SHARES = (1.0, 4.0, 8.0)


def sizes_of(scene: Scene) -> tuple[int, ...]:
    """The sizes at which a scene of the product is made anew; none for a scene of fixed size, or
    one of the user's."""
    if scene.name not in MAKERS or scene.name in OF_FIXED_SIZE:
        return ()
    return CROWDS if scene.drive else LINES


def scaling(
    scene: Scene,
    engines: Sequence[str],
    folder: Path,
    executor: Executor,
    progress: Progress | None = None,
) -> list[Point]:
    """For each size and method the cheapest point whose numerical error, of what the disks receive,
    is within ACCURACY.

    Soft contacts are of the middle stiffness of the chart. A method without such a point at a size
    is left out there."""
    found: list[Point] = []
    for size in sizes_of(scene):
        made = make(scene.name, size)
        place = folder / f"{size}_disks"
        window = prepare_window(made, place)
        stiffness = STIFFER[len(STIFFER) // 2] * made.contact.stiffness_N_per_m
        settings = [
            SoftSetting(engine=name, law=law, stiffness_N_per_m=stiffness, share=share)
            for name in engines
            for law in LAWS[name]
            for share in SHARES
        ]
        points = measure(
            window, scene.name, settings, place, executor, progress, mesh_sides=SIDES
        ).points
        found += cheapest(p for p in points if p.quantity.startswith("disk_"))
    return found


def cheapest(points: Iterable[Point], accuracy: float = ACCURACY) -> list[Point]:
    """Of each method the cheapest point whose numerical error is within the accuracy."""
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
