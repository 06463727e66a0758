"""The points that no other point beats in both cost and error."""

from __future__ import annotations

from collections.abc import Sequence

from analysis.work_precision.point import Point, PointStatus

WORTH = 0.05


def pareto_front(points: Sequence[Point]) -> list[Point]:
    """Of points of one quantity those that are `ok` and for which no cheaper one has an error as
    small, from cheap to accurate: numerical plus model error against CPU seconds, so that no point
    wins by errors that cancel. A dearer point has to be better by WORTH: smaller gains are lost in
    the noise of CPU time."""
    usable = [
        (point.cpu_seconds, point.error_sum, point)
        for point in points
        if point.status == PointStatus.OK
        and point.cpu_seconds is not None
        and point.error_sum is not None
    ]
    front: list[Point] = []
    least = float("inf")
    for _, error, point in sorted(usable, key=lambda entry: entry[:2]):
        if not front or error < (1 - WORTH) * least:
            front.append(point)
            least = error
    return front
