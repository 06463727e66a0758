"""Impulses of contacts between two frames, summed over the steps of an engine."""

from __future__ import annotations

from typing import IO

import numba
import numpy as np

from analysis.dumps.contacts import IMPULSE_COLUMNS
from analysis.dumps.writing import write_frame
from nscd.arrays import Floats, Indices

# Ids are below 2³¹; one integer says both bodies, and above them whether the second is a wall.
_BITS = 31
# Of the table at first; no key is 0.
_PLACES = 1 << 12


class ImpulseSums:
    """Sum the impulses of contacts, and write them into impulses.dump frame by frame.

    A compiled table of all contacts since the last frame: numpy's own ways took longer than a
    step."""

    def __init__(self, file: IO[str]) -> None:
        self._file = file
        self._begin(_PLACES)

    def _begin(self, places: int) -> None:
        self._keys, self._sums = np.zeros(places, np.int64), np.zeros((places, 2))
        self._used = 0

    def add_pairs(self, ids: Floats, forces: Floats, times: float) -> None:
        """Add what pairs gave in a step.

        ids: (k,2)
        forces: (k,4) N, on the first: two parts that are added, each (x, y)
        times: s, what makes them the impulse of the first on the second
        """
        self._room(len(ids))
        self._used += _add_pairs(self._keys, self._sums, ids, forces, times)

    def add_wall(self, wall: int, ids: Indices, rows: Floats, times: float) -> None:
        """Add what a wall, numbered from 1, gave in a step to disks (n,).

        rows: (n, 3 or more), whether the disk touches it, and the force (x, y) N on the disk
        times: s, what makes that the impulse of the disk on the wall
        """
        self._room(len(ids))
        self._used += _add_wall(self._keys, self._sums, wall, ids, rows, times)

    def _room(self, more: int) -> None:
        """Make the table large enough for so many new contacts: at most half full."""
        places = len(self._keys)
        if 2 * (self._used + more) <= places:
            return
        keys, sums = self._keys, self._sums
        while 2 * (self._used + more) > places:
            places *= 2
        self._begin(places)
        held = keys > 0
        self._used = _add_keys(self._keys, self._sums, keys[held], sums[held])

    def write(self, step: int) -> None:
        """Write a frame with the sums since the last one, the smaller id first; then begin
        again."""
        held = np.flatnonzero(self._keys)
        held = held[np.argsort(self._keys[held])]
        keys, sums, one = self._keys[held], self._sums[held], (1 << _BITS) - 1
        columns = [keys >> _BITS & one, keys & one, keys >> 2 * _BITS, *sums.T]
        write_frame(self._file, "ENTRIES", step, IMPULSE_COLUMNS, columns)
        self._begin(len(self._keys))


@numba.njit(cache=True)
def _place_of(keys, key):  # type: ignore[no-untyped-def]
    """Where a key is in the table, or the empty place where it belongs."""
    last = len(keys) - 1
    place = (key * 0x9E3779B97F4A7C1 >> 20) & last
    while keys[place] != 0 and keys[place] != key:
        place = (place + 1) & last
    return place


@numba.njit(cache=True)
def _add_one(keys, sums, key, x, y):  # type: ignore[no-untyped-def]
    """Add to one key; return 1 if it is new, else 0."""
    place = _place_of(keys, key)
    new = keys[place] == 0
    keys[place] = key
    sums[place, 0] += x
    sums[place, 1] += y
    return 1 if new else 0


@numba.njit(cache=True)
def _add_keys(keys, sums, more, impulse):  # type: ignore[no-untyped-def]
    new = 0
    for row in range(len(more)):
        new += _add_one(keys, sums, more[row], impulse[row, 0], impulse[row, 1])
    return new


@numba.njit(cache=True)
def _add_pairs(keys, sums, ids, forces, times):  # type: ignore[no-untyped-def]
    new = 0
    for row in range(len(ids)):
        x, y = forces[row, 0] + forces[row, 2], forces[row, 1] + forces[row, 3]
        if x == 0.0 and y == 0.0:
            continue
        first, second = np.int64(ids[row, 0]), np.int64(ids[row, 1])
        sign = times
        if first > second:
            first, second, sign = second, first, -times
        new += _add_one(keys, sums, first << _BITS | second, sign * x, sign * y)
    return new


@numba.njit(cache=True)
def _add_wall(keys, sums, wall, ids, rows, times):  # type: ignore[no-untyped-def]
    new = 0
    for row in range(len(ids)):
        if rows[row, 0] != 0.0:
            key = np.int64(1) << 2 * _BITS | np.int64(ids[row]) << _BITS | np.int64(wall)
            new += _add_one(keys, sums, key, times * rows[row, 1], times * rows[row, 2])
    return new
