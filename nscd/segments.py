"""Who is near: nearest points of straight segments, how walls that meet answer for one another, and
pairs of disks, from cells."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.arrays import Floats
from nscd.compiling import inner, kernel

# Ends of walls that are nearer to each other than this (m) are one point.
SAME_POINT_M = 1e-9
# A nearest point that is nearer to an end than this (m) is the end: over the joint of two walls in
# line, rounding would put it into both.
ROUNDING_M = 1e-12
# A grid never has more cells than this times the number of disks: who has left the room may be far.
CELLS_PER_DISK = 8


class Segments(NamedTuple):
    """Connected walls as the kernels take them.

    start, along: (w,2) m
    vertex: (w,2) numbers of their two ends, the same where walls meet
    inner: (w,2) whether the end lies within another wall
    """

    start: Any
    along: Any
    vertex: Any
    inner: Any


def nearest_on_segment(points: Floats, start: Floats, end: Floats) -> Floats:
    """Find the point of a segment that is nearest to each of some points.

    points (n,2) m; start, end (2,) m: one segment for all of them, or (n,2): one each. Returns
    (n,2) m: start + s·(end − start) with s = (x − start)·(end − start)/|end − start|² cut to [0,
    1]. A segment without length is its start.
    """
    along = end - start
    square = _dot(along, along)
    share = _dot(points - start, along) / np.where(square > 0, square, 1.0)
    nearest: Floats = start + np.clip(share, 0.0, 1.0)[:, None] * along
    return nearest


@kernel
def headed(position: Any, start: Any, end: Any, outward: Any, place: Any, speed: float) -> Any:
    """Velocities (n,2) m/s of who walks at a speed to the nearest point of a segment; along
    `outward` on it, and beyond the line through `place` across `outward`.

    position (n,2) m; start, end, place (2,) m; outward (2,) unit vector"""
    velocity = np.empty_like(position)
    along = (end[0] - start[0], end[1] - start[1])
    square = along[0] * along[0] + along[1] * along[1]
    for i in range(len(position)):
        x, y = position[i, 0], position[i, 1]
        share = (x - start[0]) * along[0] + (y - start[1]) * along[1]
        share = min(max(share / square, 0.0), 1.0) if square > 0.0 else 0.0
        dx, dy = start[0] + share * along[0] - x, start[1] + share * along[1] - y
        distance = np.hypot(dx, dy)
        beyond = (x - place[0]) * outward[0] + (y - place[1]) * outward[1] >= 0.0
        if beyond or distance == 0.0:
            velocity[i, 0], velocity[i, 1] = speed * outward[0], speed * outward[1]
        else:
            velocity[i, 0], velocity[i, 1] = speed * (dx / distance), speed * (dy / distance)
    return velocity


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(a @ b if b.ndim == 1 else (a * b).sum(1))


def connect(start: Floats, end: Floats) -> Segments:
    """Find where walls from start to end, both (w,2) m, meet: at their ends, or an end within
    another wall."""
    count = len(start)
    ends = np.stack([start, end], axis=1).reshape(-1, 2)
    vertex = np.arange(2 * count)
    for number in range(2 * count):
        apart = np.hypot(*(ends[:number] - ends[number]).T)
        if number and apart.min() <= SAME_POINT_M:
            vertex[number] = vertex[int(np.argmin(apart))]
    inner = np.zeros(2 * count, dtype=bool)
    for number in range(count):
        distance = np.hypot(*(nearest_on_segment(ends, start[number], end[number]) - ends).T)
        own = (vertex == vertex[2 * number]) | (vertex == vertex[2 * number + 1])
        inner |= (distance <= SAME_POINT_M) & ~own
    return Segments(
        np.array(start, dtype=np.float64),
        np.array(end - start, dtype=np.float64),
        vertex.reshape(-1, 2).astype(np.int32),
        inner.reshape(-1, 2),
    )


@inner
def share_of(segments: Any, w: int, x: float, y: float) -> Any:
    """Find where on wall w, 0 to 1, its nearest point to (x, y) is."""
    ax, ay = segments.along[w, 0], segments.along[w, 1]
    length = np.sqrt(ax * ax + ay * ay)
    s = ((x - segments.start[w, 0]) * ax + (y - segments.start[w, 1]) * ay) / length
    if s <= ROUNDING_M:
        return 0.0
    return 1.0 if s >= length - ROUNDING_M else s / length


@inner
def is_of_another(segments: Any, w: int, share: float, x: float, y: float) -> bool:
    """Decide whether the nearest point of wall w to (x, y), at `share` of it, is one that another
    wall answers for: one that it ends in, one that comes nearer beyond their common end, or the
    first of those that all end there.

    So a disk has one contact for each nearest point of connected walls: one along walls in line and
    at a corner that points at it, two in a corner that it sits in."""
    if 0.0 < share < 1.0:
        return False
    end = 0 if share == 0.0 else 1
    if segments.inner[w, end]:
        return True
    vertex = segments.vertex[w, end]
    for other in range(len(segments.start)):
        if other == w:
            continue
        for far in range(2):
            if segments.vertex[other, far] != vertex:
                continue
            s = share_of(segments, other, x, y)
            if s != float(far) or other < w:
                return True
    return False


class Cells(NamedTuple):
    """Hold which disks are in which cell.

    head: (p,q) first disk in a cell, −1 where there is none
    after: (n,) the next disk in the same cell, −1 after the last
    at: (n,2) cell of each disk"""

    head: Any
    after: Any
    at: Any


@kernel
def cells_of(position: Any, size: float) -> Any:
    """Sort disks at (n,2) m into cells of a size (m); the last row and column also have all that is
    farther."""
    n = len(position)
    x0, y0 = position[:, 0].min(), position[:, 1].min()
    room = CELLS_PER_DISK * n + 64
    nx = int(min((position[:, 0].max() - x0) / size + 1.0, room))
    ny = int(min((position[:, 1].max() - y0) / size + 1.0, room / nx + 1.0))
    head = np.full((nx, ny), -1, np.int32)
    after = np.full(n, -1, np.int32)
    at = np.empty((n, 2), np.int32)
    for a in range(n - 1, -1, -1):
        i = min(int(min((position[a, 0] - x0) / size, room)), nx - 1)
        j = min(int(min((position[a, 1] - y0) / size, room)), ny - 1)
        at[a, 0], at[a, 1] = i, j
        after[a] = head[i, j]
        head[i, j] = a
    return Cells(head, after, at)


class Near(NamedTuple):
    """Hold pairs that touch, and what is known of them.

    first, second: (k,) a disk, and another or a wall
    vector: (k,2) m, from its centre to that of the other, or to the nearest point of the wall
    distance: (k,) m, its length
    gap: (k,) m"""

    first: Any
    second: Any
    vector: Any
    distance: Any
    gap: Any

    @classmethod
    def room(cls, most: int) -> Near:
        """Make room for so many."""
        first, second = np.empty((2, most), np.int64)
        vector = np.empty((most, 2))
        return cls(first, second, vector, np.empty(most), np.empty(most))

    def cut(self, count: int) -> Near:
        """Keep the first ones."""
        return Near(*(array[:count] for array in self))


def touching_pairs(
    position: Floats, radius: Floats, tolerance: float, reach: float, most: int
) -> Near | None:
    """Find the pairs i < j of disks at (n,2) m with a gap |x_j − x_i| − r_i − r_j of at most
    `tolerance` m, by (i, j); None where more than `most` are within `reach` m, beyond which no disks
    touch."""
    if len(position) < 2:
        return Near.room(0)
    cells, room = cells_of(position, reach), 4 * len(position)
    while True:
        found = Near.room(room)
        count, near = _touching(position, radius, tolerance, reach, cells, found, most)
        if near > most:
            return None
        if count <= room:
            return found.cut(count)
        room = count


@kernel
def _touching(
    position: Any, radius: Any, tolerance: float, reach: float, cells: Any, found: Any, most: int
) -> Any:
    """Put in the pairs for which there is room. Returns how many there are, and how many are within
    reach, or just more than `most`."""
    head, after, at = cells.head, cells.after, cells.at
    nx, ny = head.shape
    count = near = 0
    for a in range(len(position)):
        begin = count
        for p in range(max(at[a, 0] - 1, 0), min(at[a, 0] + 2, nx)):
            for q in range(max(at[a, 1] - 1, 0), min(at[a, 1] + 2, ny)):
                b = head[p, q]
                while b >= 0:
                    if b > a:
                        dx = position[b, 0] - position[a, 0]
                        dy = position[b, 1] - position[a, 1]
                        if dx * dx + dy * dy <= reach * reach:
                            near += 1
                            distance = np.hypot(dx, dy)
                            gap = distance - radius[a] - radius[b]
                            if gap <= tolerance:
                                _put(found, begin, count, a, b, dx, dy, distance, gap)
                                count += 1
                    b = after[b]
        if near > most:
            return count, near
    return count, near


@inner
def _put(
    found: Any,
    begin: int,
    count: int,
    a: int,
    b: int,
    dx: float,
    dy: float,
    distance: float,
    gap: float,
) -> None:
    """Put a pair among those of its first disk, by its second, if there is room."""
    if count >= len(found.first):
        return
    row = count
    while row > begin and found.second[row - 1] > b:
        for array in (found.first, found.second):
            array[row] = array[row - 1]
        for numbers in (found.distance, found.gap):
            numbers[row] = numbers[row - 1]
        found.vector[row, 0], found.vector[row, 1] = (
            found.vector[row - 1, 0],
            found.vector[row - 1, 1],
        )
        row -= 1
    found.first[row], found.second[row] = a, b
    found.vector[row, 0], found.vector[row, 1] = dx, dy
    found.distance[row], found.gap[row] = distance, gap


def touching_walls(position: Floats, radius: Floats, tolerance: float, segments: Segments) -> Near:
    """Find disks at (n,2) m whose nearest point of a wall is at most r + `tolerance` m away, and that
    wall itself answers for, by (disk, wall)."""
    room = 64 + len(position)
    while True:
        found = Near.room(room)
        count = int(_touching_walls(position, radius, tolerance, segments, found))
        if count <= room:
            return found.cut(count)
        room = count


@kernel
def _touching_walls(position: Any, radius: Any, tolerance: float, segments: Any, found: Any) -> int:
    """Put in those for which there is room, and count all."""
    start, along, count = segments.start, segments.along, 0
    for a in range(len(position)):
        x, y = position[a, 0], position[a, 1]
        # the tolerance is at least what rounding makes of a gap, and the box rounds too
        reach = radius[a] + 2.0 * tolerance
        for w in range(len(start)):
            x0, y0 = start[w, 0], start[w, 1]
            x1, y1 = x0 + along[w, 0], y0 + along[w, 1]
            if x - reach > max(x0, x1) or x + reach < min(x0, x1):
                continue
            if y - reach > max(y0, y1) or y + reach < min(y0, y1):
                continue
            square = along[w, 0] * along[w, 0] + along[w, 1] * along[w, 1]
            share = (x - x0) * along[w, 0] + (y - y0) * along[w, 1]
            share = min(max(share / square, 0.0), 1.0)
            dx, dy = x0 + share * along[w, 0] - x, y0 + share * along[w, 1] - y
            distance = np.hypot(dx, dy)
            gap = distance - radius[a]
            if gap <= tolerance and not is_of_another(
                segments, w, share_of(segments, w, x, y), x, y
            ):
                _put(found, count, count, a, w, dx, dy, distance, gap)
                count += 1
    return count
