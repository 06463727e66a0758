"""Who touches whom in one frame, in compiled code."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.compiling import inner
from nscd.contacts import FARTHEST, MARGIN, MOST_PAIRS
from nscd.segments import Near, _touching, _touching_walls, cells_of

ROUNDING = 4.0 * float(np.finfo(float).eps)
# Centres that are nearer to each other, or to a wall, than this (m) have no normal, or none that is
# known.
SAME_PLACE = 1e-290


class Touching(NamedTuple):
    """Hold the contacts of one frame, as `Contacts` does, and whether they are sound."""

    first: Any
    second: Any
    is_wall: Any
    normal: Any
    gap: Any
    sound: Any


@inner
def touch(position: Any, radius: Any, segments: Any, far: float, asked: Any) -> Touching:
    """Find contacts as `find_contacts` does; none, and unsound, where it is to look itself."""
    n = len(radius)
    smallest, largest = np.inf, 0.0
    for i in range(n):
        smallest, largest = min(smallest, radius[i]), max(largest, radius[i])
        far = max(far, max(abs(position[i, 0]), abs(position[i, 1])))
    gap = asked.gap + ROUNDING * far
    pairs, walled = _scratch(4 * n + 64), _scratch(64 + n)
    count = walls = 0
    sound = far <= FARTHEST * smallest and asked.gap <= smallest
    if sound and n > 1:
        reach = (2.0 * largest + gap) * MARGIN
        cells, near = cells_of(position, reach), 0
        while True:
            count, near = _touching(position, radius, gap, reach, cells, pairs, MOST_PAIRS)
            sound = near <= MOST_PAIRS
            if not sound or count <= len(pairs.gap):
                break
            pairs = _scratch(count)
    while sound and len(segments.start):
        walls = _touching_walls(position, radius, gap, segments, walled)
        if walls <= len(walled.gap):
            break
        walled = _scratch(walls)
    k = count + walls if sound else 0
    first, second, is_wall = np.empty(k, np.int64), np.empty(k, np.int64), np.empty(k, np.bool_)
    normal, gaps = np.empty((k, 2)), np.empty(k)
    for c in range(k):
        part, row = (pairs, c) if c < count else (walled, c - count)
        first[c], second[c], is_wall[c], gaps[c] = (
            part.first[row], part.second[row], c >= count, part.gap[row],
        )  # fmt: skip
        for a in range(2):
            normal[c, a] = part.vector[row, a] / part.distance[row]
        least = radius[first[c]] if is_wall[c] else min(radius[first[c]], radius[second[c]])
        sound = sound and part.distance[row] > SAME_PLACE
        sound = sound and -gaps[c] / least <= asked.deepest
    return Touching(first, second, is_wall, normal, gaps, sound)


@inner
def _scratch(most: int) -> Near:
    return Near(
        np.empty(most, np.int64), np.empty(most, np.int64), np.empty((most, 2)), np.empty(most),
        np.empty(most),
    )  # fmt: skip
