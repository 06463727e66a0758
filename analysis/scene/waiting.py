"""Where a crowd waits: random positions before its doors, where disks cover a given share."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from analysis.scene.scene import SceneError
from nscd import _core
from nscd.arrays import Floats, Indices, Mask
from nscd.segments import lengths

# Share of the floor that disks cover where they wait: dense, and still without order.
COVER = 0.6
# They cannot be placed at random above it.
MOST_COVER = 0.6
# Disks put one after the other at random can cover 0.547.
PUT_COVER = 0.42
ON_WALL_M = 1e-6
TRIES, HALVINGS = 20_000, 40
# Of the floor, where it is divided: about so many are taken by people, and there are no more; and
# how often doors offer for them.
CELLS, MOST_CELLS, ROUNDS = 2000, 40_000, 1000

Ends = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Doorway:
    """Describe a door and who goes to it.

    ends: its ends, m, on one side of the outline of the floor
    share: of the crowd that goes there, over the sum of the shares of all doors
    start: the part of the floor where these people wait; anywhere where left out
    spread: whether they wait all over that part; without, where it is nearest to the door"""

    ends: Ends
    share: float = 1.0
    start: shapely.Geometry | None = None
    spread: bool = False


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
    return float(np.pi * (radius * radius).sum() / floor.area) if floor.area else np.inf


def counts_of(doors: Sequence[Doorway], people: int) -> list[int]:
    """Divide people among doors by their shares, the largest remainders up. Raises SceneError for a
    door that nobody goes to."""
    fractions = np.array([door.share for door in doors], dtype=float)
    if not (np.isfinite(fractions).all() and (fractions > 0).all()):
        raise SceneError(f"door: shares {fractions.tolist()}. Numbers above 0 are needed")
    exact = people * fractions / fractions.sum()
    counts = np.floor(exact).astype(int)
    counts[np.argsort(counts - exact, kind="stable")[: people - counts.sum()]] += 1
    if not counts.all():
        number = int(np.argmin(counts)) + 1
        raise SceneError(
            f"door: nobody of {people} goes to door {number}. A larger share is needed"
        )
    return [int(count) for count in counts]


def straight(
    points: shapely.Geometry, door: Ends, floor: shapely.Polygon, barriers: Sequence[Ends]
) -> Mask:
    """Tell from which points (n,) the shortest way to a door stays on the floor and crosses no
    barrier."""
    way = shapely.shortest_line(points, shapely.LineString(door))
    widened = floor.buffer(ON_WALL_M)
    shapely.prepare(widened)
    found: Mask = shapely.covers(widened, way)
    if barriers:
        ends = np.stack([shapely.get_coordinates(way)[at::2] for at in (0, 1)])
        walls = np.array(barriers, dtype=float).swapaxes(0, 1).copy()
        found &= _core.clear_of(ends[0], ends[1], walls[0], walls[1], ON_WALL_M) > 0
    return found


def positions_of(
    floor: shapely.Polygon,
    barriers: Sequence[Ends],
    doors: Sequence[Doorway],
    counts: Sequence[int],
    radius: Floats,
    seed: int,
) -> Floats:
    """Put people at random positions (n,2) m, door after door.

    barriers: ends of straight walls on the floor, m
    counts: of those who go to each door
    radius: (n,) m, in the same order

    Each door has its own part of the floor, as large as its people need: where they have a straight
    way to it, as near as the others leave room for. Disks that are somewhat smaller are put one
    after the other where they overlap none. Raises SceneError where they do not fit."""
    random = np.random.default_rng([seed, 5])
    largest = float(radius.max())
    free = floor.buffer(-largest)
    if barriers:
        lines = shapely.linestrings(np.array(barriers, dtype=float))
        near = shapely.buffer(lines, largest, quad_segs=16)  # one by one: faster by far
        free = free.difference(shapely.union_all(near))
    own = np.split(radius, np.cumsum(counts)[:-1])
    for door, mine in zip(doors, own, strict=True):
        _check_fit(free if door.start is None else free.intersection(door.start), mine)
    _check_fit(free, radius)
    if all(door.spread for door in doors):
        areas = [free if door.start is None else free.intersection(door.start) for door in doors]
    elif len(doors) == 1 and not barriers and floor.equals(floor.convex_hull):
        areas = [_before(free, doors[0], radius)]
    else:
        areas = _parts(floor, free, barriers, doors, own)
    position = np.empty((0, 2))
    for area, mine in zip(areas, own, strict=True):
        _check_fit(area, mine)
        position = _place_people(area, position, radius, len(mine), random)
    return position


def _check_fit(free: shapely.Geometry, radius: Floats) -> None:
    """Raise SceneError where there is no room for the centres of disks."""
    if free.is_empty or free.area < np.pi * float((radius * radius).sum()):
        raise SceneError(
            f"people: {len(radius)} of mean radius {radius.mean():.3g} m do not fit where they are "
            f"to wait: {free.area:.3g} m² for their centres"
        )


def _before(free: shapely.Geometry, door: Doorway, radius: Floats) -> shapely.Geometry:
    """The part nearest to a door where disks cover COVER, or all of it."""
    size = float(np.pi * (radius * radius).sum()) / COVER
    free = free if door.start is None else free.intersection(door.start)
    line = shapely.LineString(door.ends)
    minimum, maximum = 0.0, float(shapely.hausdorff_distance(line, free)) + line.length
    for _ in range(HALVINGS):
        middle = 0.5 * (minimum + maximum)
        smaller = free.intersection(line.buffer(middle)).area < size
        minimum, maximum = (middle, maximum) if smaller else (minimum, middle)
    return free.intersection(line.buffer(maximum))


def _parts(
    floor: shapely.Polygon,
    free: shapely.Geometry,
    barriers: Sequence[Ends],
    doors: Sequence[Doorway],
    own: Sequence[Floats],
) -> list[shapely.Geometry]:
    """Divide the floor among doors, as square cells, so that the fewest people have a wall before
    their door and the ways are short."""
    from scipy.ndimage import binary_erosion

    sizes = np.array([float(np.pi * (radius * radius).sum()) / COVER for radius in own])
    side = float(np.sqrt(max(sizes.sum() / CELLS, free.area / MOST_CELLS)))
    x0, y0, x1, y1 = free.bounds
    x, y = np.arange(x0 + side / 2, x1, side), np.arange(y0 + side / 2, y1, side)
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    inside = shapely.contains_xy(free, *np.moveaxis(grid, -1, 0))
    middles = grid[inside]
    points = shapely.points(middles)
    # people are moved apart afterwards, and keep their straight way
    margin = int(np.ceil(max(radius.max() for radius in own) / side))
    cost = np.empty((len(doors), len(points)))
    for row, door in enumerate(doors):
        clear = np.ones(inside.shape, dtype=bool)
        clear[inside] = straight(points, door.ends, floor, barriers)
        clear = binary_erosion(clear, iterations=margin, border_value=1)[inside]
        cost[row] = shapely.distance(points, shapely.LineString(door.ends))
        if door.start is None:
            cost[row] += np.where(clear, 0.0, 2 * cost[row].max())
        else:
            cost[row, ~shapely.intersects_xy(door.start, middles)] = np.inf
    wanted = sizes / (side * side) * min(1.0, len(points) * (side * side) / sizes.sum())
    wanted = np.where(wanted < 20, np.ceil(wanted) + 1, wanted)  # few large ones, cut by walls
    going = _shared_out(cost, wanted.astype(np.int64))
    boxes = shapely.box(*(middles - side / 2).T, *(middles + side / 2).T)
    return [free.intersection(shapely.union_all(boxes[going == row])) for row in range(len(doors))]


def _shared_out(cost: Floats, wanted: Indices) -> Indices:
    """Give each door (d,) so many cells that the sum of prices (d,c) is least; −1 for the others.

    An auction: door after door offers what buys its number of cells, until no offer changes."""
    wanted = np.minimum(wanted, np.isfinite(cost).sum(1) - 1)
    discount = np.zeros(len(cost))
    for _ in range(ROUNDS):
        before = discount.copy()
        for row, number in enumerate(wanted):
            others = np.delete(cost - discount[:, None], row, axis=0).min(0, initial=0.0)
            discount[row] = np.partition(cost[row] - others, number)[number]
        if np.allclose(discount, before, rtol=1e-6, atol=0.0):
            break
    best = (cost - discount[:, None]).argmin(0)
    going = np.where((cost - discount[:, None]).min(0) < 0, best, -1)
    # cells of one price are bought together or not at all: what a door lacks it takes of the free
    for row, number in enumerate(wanted):
        order = np.argsort(cost[row], kind="stable")
        free = order[(going[order] < 0) & np.isfinite(cost[row, order])]
        going[free[: max(0, number - (going == row).sum())]] = row
    return going


def _place_people(
    area: shapely.Geometry, before: Floats, radius: Floats, count: int, random: np.random.Generator
) -> Floats:
    """Places of `count` more people than those before, within an area."""
    start, end = len(before), len(before) + count
    position = np.concatenate([before, np.empty((count, 2))])
    fraction = np.sqrt(PUT_COVER / max(COVER, cover_of(radius[start:end], area)))
    shapely.prepare(area)
    for person in range(start, end):
        apart_from = fraction * (radius[:person] + radius[person])
        for _ in range(TRIES):
            position[person] = random.uniform(area.bounds[:2], area.bounds[2:])
            near = lengths(position[:person] - position[person]) < apart_from
            if not near.any() and shapely.contains_xy(area, *position[person]):
                break
        else:
            raise SceneError(f"people: no place is left for person {person + 1} of {len(radius)}")
    return position
