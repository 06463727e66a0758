"""Disks sorted into square cells, and the pairs of them that are near each other."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from nscd.arrays import Floats, Indices

# A grid never has more cells than this times the number of disks: who has left the room may be far.
CELLS_PER_DISK = 8


class Cells(NamedTuple):
    """Hold which disks are in which cell.

    head: (p,q) first disk in a cell, −1 where there is none
    after: (n,) the next disk in the same cell, −1 after the last
    at: (n,2) cell of each disk"""

    head: Any
    after: Any
    at: Any


@njit(cache=True)
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


def pairs_within(position: Floats, reach: float, most: int) -> tuple[Indices, Indices] | None:
    """Find the pairs i < j of disks at (n,2) m that are at most `reach` m from each other; None where
    there are more than `most`."""
    if len(position) < 2:
        none = np.empty(0, dtype=np.int64)
        return none, none
    cells = cells_of(position, reach)
    first, second, count = np.empty(0, np.int64), np.empty(0, np.int64), 4 * len(position)
    while len(first) < count <= most:
        first, second = np.empty((2, count), np.int64)
        count = int(_pairs(position, reach, cells, first, second, most))
    return (first[:count], second[:count]) if count <= most else None


@njit(cache=True)
def _pairs(position: Any, reach: float, cells: Any, first: Any, second: Any, most: int) -> int:
    """Put in the pairs for which there is room, and count all of them, or just more than `most`."""
    head, after, at = cells.head, cells.after, cells.at
    nx, ny = head.shape
    count = 0
    for a in range(len(position)):
        for p in range(max(at[a, 0] - 1, 0), min(at[a, 0] + 2, nx)):
            for q in range(max(at[a, 1] - 1, 0), min(at[a, 1] + 2, ny)):
                b = head[p, q]
                while b >= 0:
                    if b > a:
                        dx = position[b, 0] - position[a, 0]
                        dy = position[b, 1] - position[a, 1]
                        if dx * dx + dy * dy <= reach * reach:
                            if count < len(first):
                                first[count], second[count] = a, b
                            count += 1
                    b = after[b]
        if count > most:
            return count
    return count
