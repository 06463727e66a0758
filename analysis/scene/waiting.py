"""Where a crowd waits: random places before its doors, of which the disks cover a given share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from analysis.scene.scene import SceneError
from nscd.arrays import Floats, Indices

# Share of the floor that disks cover where they wait: dense, and still without order.
COVER = 0.6
# They cannot be placed at random above it.
MOST_COVER = 0.6
# Disks put one after the other at random can cover 0.547.
PUT_COVER = 0.42
ON_WALL_M = 1e-6
TRIES, HALVINGS = 20_000, 40

Ends = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Doorway:
    """Describe a door and who goes to it.

    ends: its ends, m, on one side of the outline of the floor
    share: of the crowd that goes there, over the sum of the shares of all doors
    start: the part of the floor where these people wait; where left out they wait nearest to it
    """

    ends: Ends
    share: float = 1.0
    start: shapely.Geometry | None = None


def opposing(length: float, width: float, door: float | None = None) -> tuple[Doorway, Doorway]:
    """Describe two streams through a room −length < x < 0: to each of its short sides, from the
    half before the other; door: width of both doors, m, the whole side where left out."""
    half = 0.5 * (width if door is None else door)
    ends = [((x, -half), (x, half)) for x in (0.0, -length)]
    middle = -0.5 * length
    starts = (
        shapely.box(-length, -0.5 * width, middle, 0.5 * width),
        shapely.box(middle, -0.5 * width, 0.0, 0.5 * width),
    )
    one, two = (Doorway(ends=end, start=start) for end, start in zip(ends, starts, strict=True))
    return one, two


def cover_of(radius: Floats, floor: shapely.Geometry) -> float:
    """Compute the share of a floor that disks cover."""
    return float(np.pi * (radius**2).sum() / floor.area) if floor.area else np.inf


def counts_of(doors: Sequence[Doorway], people: int) -> list[int]:
    """Divide people among doors by their shares, the largest remainders up. Raises SceneError for a
    door that nobody goes to."""
    shares = np.array([door.share for door in doors], dtype=float)
    if not (np.isfinite(shares).all() and (shares > 0).all()):
        raise SceneError(f"door: shares {shares.tolist()}; numbers above 0 are needed")
    exact = people * shares / shares.sum()
    counts = np.floor(exact).astype(int)
    counts[np.argsort(counts - exact, kind="stable")[: people - counts.sum()]] += 1
    if not counts.all():
        number = int(np.argmin(counts)) + 1
        raise SceneError(
            f"door: nobody of {people} goes to door {number}; a larger share is needed"
        )
    return [int(count) for count in counts]


def places(
    free: shapely.Geometry,
    doors: Sequence[Doorway],
    counts: Sequence[int],
    radius: Floats,
    seed: int,
) -> tuple[Floats, Indices]:
    """Put people at random places (n,2) m, and say which door (n,) each goes to.

    free: where centres may be, m
    counts: of those who go to each door
    radius: (n,) m

    Those with a start of their own wait there, nearest to their door, the others nearest to any
    door, and each of those goes to the door that is nearest as far as the counts allow. Disks that
    are somewhat smaller are put one after the other where they overlap none. Raises SceneError
    where they do not fit."""
    random = np.random.default_rng([seed, 5])
    common = [number for number, door in enumerate(doors) if door.start is None]
    groups = [[number] for number, door in enumerate(doors) if door.start is not None]
    if common:
        groups.insert(0, common)
    place, going = np.empty((0, 2)), np.empty(0, dtype=np.int64)
    for group in groups:
        first, start = len(place), doors[group[0]].start
        size = sum(counts[number] for number in group)
        own = radius[first : first + size]
        allowed = free if start is None else free.intersection(start)
        area = _before(allowed, doors, group, own)
        place = _put(area, place, radius, size, random)
        going = np.append(going, _assigned(place[first:], doors, group, counts))
    return place, going


def _before(
    free: shapely.Geometry, doors: Sequence[Doorway], group: Sequence[int], radius: Floats
) -> shapely.Geometry:
    """The part nearest to the doors of a group where its disks cover COVER, or all of it."""
    size = float(np.pi * (radius**2).sum()) / COVER
    lines = shapely.union_all([shapely.LineString(doors[number].ends) for number in group])
    if free.is_empty or free.area < MOST_COVER * size:
        raise SceneError(
            f"people: {len(radius)} of mean radius {radius.mean():.3g} m do not fit where they are "
            f"to wait: {free.area:.3g} m² for their centres"
        )
    least, most = 0.0, float(shapely.hausdorff_distance(lines, free)) + lines.length
    for _ in range(HALVINGS):
        middle = 0.5 * (least + most)
        smaller = free.intersection(lines.buffer(middle)).area < size
        least, most = (middle, most) if smaller else (least, middle)
    return free.intersection(lines.buffer(most))


def _put(
    area: shapely.Geometry,
    before: Floats,
    radius: Floats,
    count: int,
    random: np.random.Generator,
) -> Floats:
    """Places of `count` more people than those before, within an area."""
    start, end = len(before), len(before) + count
    place = np.concatenate([before, np.empty((count, 2))])
    share = np.sqrt(PUT_COVER / max(COVER, cover_of(radius[start:end], area)))
    shapely.prepare(area)
    for person in range(start, end):
        apart_from = share * (radius[:person] + radius[person])
        for _ in range(TRIES):
            place[person] = random.uniform(area.bounds[:2], area.bounds[2:])
            near = np.hypot(*(place[:person] - place[person]).T) < apart_from
            if not near.any() and shapely.contains_xy(area, *place[person]):
                break
        else:
            raise SceneError(f"people: no place is left for person {person + 1} of {len(radius)}")
    return place


def _assigned(
    place: Floats, doors: Sequence[Doorway], group: Sequence[int], counts: Sequence[int]
) -> Indices:
    """The door of each of a group: door after door takes those whom it suits best, by how much
    farther they have to the nearest of the doors that are left."""
    points = shapely.points(place)
    far = np.array([shapely.distance(points, shapely.LineString(doors[d].ends)) for d in group])
    going, free = np.full(len(place), group[-1]), np.ones(len(place), dtype=bool)
    for row, number in enumerate(group[:-1]):
        gain = np.where(free, far[row + 1 :].min(0) - far[row], -np.inf)
        chosen = np.argsort(-gain, kind="stable")[: counts[number]]
        going[chosen], free[chosen] = number, False
    return going
