"""Impulses of contacts between two frames, summed over the steps of an engine."""

from __future__ import annotations

from typing import IO

import numpy as np

from analysis.dumps.contacts import IMPULSE_COLUMNS
from analysis.dumps.writing import write_frame
from nscd.arrays import Floats

# Rows that are kept before they are summed: about 40 MB.
MOST_ROWS = 1_000_000


class ImpulseSums:
    """Sum the impulses of contacts, and write them into impulses.dump frame by frame."""

    def __init__(self, file: IO[str]) -> None:
        self._file = file
        self._parts: list[Floats] = []
        self._rows = 0

    def add(self, keys: Floats, impulse: Floats) -> None:
        """Add what contacts gave in a step.

        keys: (k,3), id of a disk; id of the other, or number of the wall from 1; 1 for a wall, else 0
        impulse: (k,2) N·s, of the first on the second
        """
        self._parts.append(np.column_stack([keys, impulse]))
        self._rows += len(keys)
        if self._rows > MOST_ROWS:
            self._parts = [self._summed()]
            self._rows = len(self._parts[0])

    def write(self, step: int) -> None:
        """Write a frame with the sums since the last one, the smaller id first; then begin again."""
        rows = self._summed()
        keys = rows[:, :3].astype(np.int64)
        write_frame(self._file, "ENTRIES", step, IMPULSE_COLUMNS, [*keys.T, *rows[:, 3:].T])
        self._parts, self._rows = [], 0

    def _summed(self) -> Floats:
        rows = np.concatenate([np.empty((0, 5)), *self._parts])
        swapped = (rows[:, 2] == 0) & (rows[:, 0] > rows[:, 1])
        rows[swapped] = rows[swapped][:, [1, 0, 2, 3, 4]] * [1, 1, 1, -1, -1]
        keys, place = np.unique(rows[:, [2, 0, 1]], axis=0, return_inverse=True)
        total = np.zeros((len(keys), 2))
        np.add.at(total, place.ravel(), rows[:, 3:])
        return np.column_stack([keys[:, [1, 2, 0]], total])
