"""Impulses of contacts between two frames, summed over the steps of an engine."""

from __future__ import annotations

from typing import IO

import numpy as np

from analysis.dumps.contacts import IMPULSE_COLUMNS
from analysis.dumps.writing import write_frame
from nscd.arrays import Floats, Indices

# Ids are below 2³¹; one integer says both bodies, and above them whether the second is a wall.
_BITS = 31


class ImpulseSums:
    """Sum the impulses of contacts, and write them into impulses.dump frame by frame."""

    def __init__(self, file: IO[str]) -> None:
        self._file = file
        self._begin()

    def _begin(self) -> None:
        # rising, and what each has received so far
        self._keys, self._sums = np.empty(0, np.int64), np.empty((0, 2))

    def add(self, first: Indices, second: Indices, wall: bool, impulse: Floats) -> None:
        """Add what contacts gave in a step, each at most once.

        first: (k,) id of a disk
        second: (k,) id of the other disk, or number of the wall from 1 where `wall`
        impulse: (k,2) N·s, of the first on the second
        """
        if not wall:
            swapped = first > second
            first, second = np.where(swapped, second, first), np.where(swapped, first, second)
            impulse = np.where(swapped[:, None], -impulse, impulse)
        keys = (int(wall) << 2 * _BITS) | (first << _BITS) | second
        place = np.searchsorted(self._keys, keys)
        known = place < len(self._keys)
        known[known] = self._keys[place[known]] == keys[known]
        if not known.all():
            every = np.union1d(self._keys, keys)
            sums = np.zeros((len(every), 2))
            sums[np.searchsorted(every, self._keys)] = self._sums
            self._keys, self._sums = every, sums
            place = np.searchsorted(every, keys)
        self._sums[place] += impulse

    def write(self, step: int) -> None:
        """Write a frame with the sums since the last one, the smaller id first; then begin
        again."""
        one = (1 << _BITS) - 1
        keys = [self._keys >> _BITS & one, self._keys & one, self._keys >> 2 * _BITS]
        write_frame(self._file, "ENTRIES", step, IMPULSE_COLUMNS, [*keys, *self._sums.T])
        self._begin()
