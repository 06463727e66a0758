"""The sides of a floor, and the doors in them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import shapely

from analysis.scene.scene import SceneError
from analysis.scene.waiting import ON_WALL_M, Doorway
from nscd.arrays import Floats


def opened(
    floor: shapely.Polygon, ways: Sequence[Doorway]
) -> tuple[list[tuple[Floats, Floats]], list[Floats], list[Doorway]]:
    """Find the sides of a floor less its doors (both ends of each, m), the unit vector out of each
    door, and the doors on their sides.

    Raises SceneError for a door that is not on one side of the outline or overlaps another one."""
    sides = list(_sides(floor))
    outer = list(sides[: len(floor.exterior.coords) - 1])
    outward, placed = [], []
    for way in ways:
        ends = np.asarray(way.ends, dtype=float)
        if not np.isfinite(ends).all() or not np.ptp(ends, axis=0).any():
            raise SceneError(f"door: {way.ends}; two points are needed")
        side = next((one for one in outer if _on(one, ends)), None)
        if side is None:
            raise SceneError(f"door: {way.ends} m is not on one side of the room's outline")
        start, along = side[0], side[1] - side[0]
        at = np.sort((ends - start) @ along / (along @ along))
        first, last = (start + share * along for share in at)
        # the floor is on the left of its sides
        outward.append(np.array([along[1], -along[0]]) / np.hypot(*along))
        placed.append(replace(way, ends=(point(first), point(last))))
        if any(placed[-1].ends == other.ends for other in placed[:-1]):
            continue
        whole = next((i for i, one in enumerate(sides) if _on(one, ends)), None)
        if whole is None:
            raise SceneError(f"door: {way.ends} m overlaps another door")
        pieces = ((sides[whole][0], first), (last, sides[whole][1]))
        sides[whole : whole + 1] = [(a, b) for a, b in pieces if np.hypot(*(b - a)) > ON_WALL_M]
    return sides, outward, placed


def _on(side: tuple[Floats, Floats], ends: Floats) -> bool:
    """Whether both ends of a door are on a side."""
    distance = shapely.distance(shapely.LineString(side), shapely.points(ends))
    return bool(distance.max() <= ON_WALL_M)


def _sides(floor: shapely.Polygon) -> Iterator[tuple[Floats, Floats]]:
    """Both ends of each side, those of the outline first."""
    for ring in (floor.exterior, *floor.interiors):
        yield from pairwise(np.asarray(ring.coords))


def point(place: Floats) -> tuple[float, float]:
    """Round a place (2,) m to a nanometre."""
    x, y = (round(float(each), 9) + 0.0 for each in place)
    return x, y
