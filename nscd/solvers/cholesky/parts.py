"""Parts of a crowd: disks that are near each other in the order of elimination, and the contacts
between them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.arrays import Index32, Indices
from nscd.compiling import inner, kernel
from nscd.compiling.team import MOST
from nscd.solvers.cholesky.dissection import SHARED

# A crowd of SHARED disks has so many.
PARTS = MOST


class Parts(NamedTuple):
    """Hold p parts of disks and contacts in elimination order.

    disk: (p+1,) where the disks of each begin
    contact: (p+1,) where the contacts within each begin; those between parts follow"""

    disk: Any
    contact: Any


def parts_of(place: Index32, first: Index32, second: Index32) -> tuple[Indices, Parts]:
    """Order contacts (k,) by parts, and within by the place (n,) of their first disk.

    first, second: (k,) disks, second −1 for a wall"""
    found: tuple[Indices, Parts] = _parts(
        place, first, second, PARTS if len(place) >= SHARED else 1
    )
    return found


@inner
def one_part(place: Any, first: Any) -> Any:
    """Do the same where all are one part."""
    n, none = len(place), np.zeros(2, np.int64)
    disk, contact = none, none.copy()
    disk[1], contact[1] = n, len(first)
    return _by_place(place[first], n), Parts(disk, contact)


@kernel
def _parts(place: Any, first: Any, second: Any, parts: int) -> Any:
    n, k = len(place), len(first)
    disk, contact = np.empty(parts + 1, np.int64), np.zeros(parts + 2, np.int64)
    part = np.empty(n, np.int64)
    for p in range(parts + 1):
        disk[p] = n * p // parts
    for p in range(parts):
        part[disk[p] : disk[p + 1]] = p
    row, within, at = _by_place(place[first], n), np.empty(k, np.int64), np.empty(k, np.int64)
    for c in range(k):
        p = part[place[first[c]]]
        within[c] = p if second[c] < 0 or part[place[second[c]]] == p else parts
        contact[within[c] + 1] += 1
    for p in range(parts + 1):
        contact[p + 1] += contact[p]
    begin = contact[: parts + 1].copy()
    for c in row:
        at[begin[within[c]]] = c
        begin[within[c]] += 1
    return at, Parts(disk, contact[: parts + 1].copy())


@inner
def _by_place(place: Any, n: int) -> Any:
    """The order (k,) of some places below n, the earlier of equal ones first."""
    begin, order = np.zeros(n + 1, np.int64), np.empty(len(place), np.int64)
    for i in place:
        begin[i + 1] += 1
    for i in range(n):
        begin[i + 1] += begin[i]
    for c in range(len(place)):
        order[begin[place[c]]] = c
        begin[place[c]] += 1
    return order
