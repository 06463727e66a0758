"""Neighbours of a step: all pairs and walls within a margin, from a cell list, compiled."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.arrays import Floats, Index32
from nscd.bodies import Walls
from nscd.compiling import inner, kernel
from nscd.segments import Segments, cells_of, connect, is_of_another, share_of


class Neighbours(NamedTuple):
    """Hold candidates for contact.

    first: (k,) disk
    second: (k,) disk; −1 for a wall
    wall: (k,) wall; −1 for a pair
    normal: (k,2) unit vector, first → second
    gap: (k,) m"""

    first: Index32
    second: Index32
    wall: Index32
    normal: Floats
    gap: Floats


def segments_of(walls: Walls | None) -> Segments:
    """Give walls as the kernel takes them."""
    if walls is None or not len(walls):
        return connect(np.empty((0, 2)), np.empty((0, 2)))
    return connect(walls.start, walls.end)


def neighbours(position: Floats, radius: Floats, segments: Segments, margin: float) -> Neighbours:
    """Find every pair and every wall whose gap is at most `margin` (m).

    position (n,2) m, radius (n,) m. A disk has one contact for each nearest point of connected
    walls: one at a corner that points at it, two in a corner that it sits in.
    """
    found: Neighbours = find(position, radius, segments, margin)
    return found


@kernel(apart=True)
def find(position: Any, radius: Any, segments: Any, margin: float) -> Any:
    """Find the neighbours, compiled."""
    # eight neighbours each are ample for disks of similar size; the search grows the room it needs
    most = 8 * len(radius) + 16
    while True:
        out = Neighbours(
            np.empty(most, np.int32),
            np.empty(most, np.int32),
            np.empty(most, np.int32),
            np.empty((most, 2)),
            np.empty(most),
        )
        count = _search(position, radius, segments, margin, out)
        if count <= most:
            return Neighbours(
                out.first[:count],
                out.second[:count],
                out.wall[:count],
                out.normal[:count],
                out.gap[:count],
            )
        most = count


@inner
def _search(position: Any, radius: Any, segments: Any, margin: float, out: Any) -> int:
    n, most = len(radius), len(out.gap)
    head, after, at = cells_of(position, 2.0 * radius.max() + max(margin, 0.0))
    nx, ny = head.shape
    count = 0
    for a in range(n):
        for p in range(max(at[a, 0] - 1, 0), min(at[a, 0] + 2, nx)):
            for q in range(max(at[a, 1] - 1, 0), min(at[a, 1] + 2, ny)):
                b = head[p, q]
                while b >= 0:
                    if b > a:
                        dx = position[b, 0] - position[a, 0]
                        dy = position[b, 1] - position[a, 1]
                        near = radius[a] + radius[b] + margin
                        if dx * dx + dy * dy <= near * near:
                            d = np.sqrt(dx * dx + dy * dy)
                            if count < most:
                                out.first[count], out.second[count] = a, b
                                out.wall[count] = -1
                                out.normal[count, 0], out.normal[count, 1] = dx / d, dy / d
                                out.gap[count] = d - radius[a] - radius[b]
                            count += 1
                    b = after[b]
        count = _walls_of(a, position, radius, segments, margin, out, count)
    return count


@inner
def _walls_of(
    a: int, position: Any, radius: Any, segments: Any, margin: float, out: Any, count: int
) -> int:
    x, y = position[a, 0], position[a, 1]
    near = radius[a] + margin
    for w in range(len(segments.start)):
        share = share_of(segments, w, x, y)
        dx = segments.start[w, 0] + share * segments.along[w, 0] - x
        dy = segments.start[w, 1] + share * segments.along[w, 1] - y
        if dx * dx + dy * dy > near * near or is_of_another(segments, w, share, x, y):
            continue
        d = np.sqrt(dx * dx + dy * dy)
        if count < len(out.gap):
            out.first[count], out.second[count], out.wall[count] = a, -1, w
            out.normal[count, 0], out.normal[count, 1] = dx / d, dy / d
            out.gap[count] = d - radius[a]
        count += 1
    return count
