"""Impulses of contacts between two frames, summed over the steps of an engine."""

from __future__ import annotations

from types import ModuleType
from typing import IO, TYPE_CHECKING

import numpy as np

from analysis.support.frames import IMPULSE_COLUMNS, write_frame

if TYPE_CHECKING:
    from nscd.arrays import Floats, Indices

# Ids are below 2³¹; one integer says both bodies, and above them whether the second is a wall.
_BITS = 31
# Of the table at first; no key is 0.
_PLACES = 1 << 12
# So many rows are added without the compiled table, 0.1 s: it takes 0.7 s to import.
_FEW = 100_000


class ImpulseSums:
    """Sum the impulses of contacts, and write them into impulses.dump frame by frame.

    A dictionary of all contacts since the last frame; after `few` rows a compiled table, since
    Python's own ways, and numpy's, take longer than a step. Both add the same numbers in the same
    order."""

    def __init__(self, file: IO[str], few: int = _FEW) -> None:
        self._file, self._few = file, few
        self._sums: dict[int, tuple[float, float]] = {}
        self._table: _Table | None = None

    def add_pairs(self, ids: Floats, forces: Floats, times: float) -> None:
        """Add what pairs gave in a step.

        ids: (k,2)
        forces: (k,4) N, on the first: two parts that are added, each (x, y)
        times: s, what makes them the impulse of the first on the second
        """
        if table := self._compiled(len(ids)):
            table.add_pairs(ids, forces, times)
            return
        for (one, other), (x, y, more_x, more_y) in zip(ids.tolist(), forces.tolist(), strict=True):
            x, y = x + more_x, y + more_y
            if x != 0.0 or y != 0.0:
                first, second, sign = int(one), int(other), times
                if first > second:
                    first, second, sign = second, first, -times
                self._add(first << _BITS | second, sign * x, sign * y)

    def add_wall(self, wall: int, ids: Indices, rows: Floats, times: float) -> None:
        """Add what a wall, numbered from 1, gave in a step to disks (n,).

        rows: (n, 3 or more), whether the disk touches it, and the force (x, y) N on the disk
        times: s, what makes that the impulse of the disk on the wall
        """
        touching = rows[:, 0].nonzero()[0] if self._table is None else ids
        if table := self._compiled(len(touching) + 1):
            table.add_wall(wall, ids, rows, times)
            return
        for row in touching.tolist():
            key = 1 << 2 * _BITS | int(ids[row]) << _BITS | wall
            self._add(key, times * float(rows[row, 1]), times * float(rows[row, 2]))

    def _add(self, key: int, x: float, y: float) -> None:
        had = self._sums.get(key, (0.0, 0.0))
        self._sums[key] = had[0] + x, had[1] + y

    def _compiled(self, rows: int) -> _Table | None:
        """The table, from where so many more rows are too many for Python on."""
        self._few -= rows
        if self._few < 0 and self._table is None:
            self._table = _Table(*self._held())
            self._sums = {}
        return self._table

    def _held(self) -> tuple[Indices, Floats]:
        """Keys in their order, and their sums (x, y) since the last frame."""
        keys = sorted(self._sums)
        sums = np.array([self._sums[key] for key in keys], dtype=float).reshape(-1, 2)
        return np.array(keys, dtype=np.int64), sums

    def write(self, step: int) -> None:
        """Write a frame with the sums since the last one, the smaller id first; then begin
        again."""
        keys, sums = self._table.held() if self._table else self._held()
        one = (1 << _BITS) - 1
        columns = [keys >> _BITS & one, keys & one, keys >> 2 * _BITS, *sums.T]
        write_frame(self._file, "ENTRIES", step, IMPULSE_COLUMNS, columns)
        self._sums = {}
        if self._table:
            self._table.clear()


class _Table:
    """Hold sums by key, in compiled code."""

    def __init__(self, keys: Indices, sums: Floats) -> None:
        self._kernels = _kernels()
        self._begin(_PLACES)
        self._add(keys, sums)

    def _begin(self, places: int) -> None:
        self._keys, self._sums = np.zeros(places, np.int64), np.zeros((places, 2))
        self._used = 0

    def clear(self) -> None:
        """Forget all."""
        self._begin(len(self._keys))

    def add_pairs(self, ids: Floats, forces: Floats, times: float) -> None:
        self._room(len(ids))
        self._used += self._kernels.add_pairs(self._keys, self._sums, ids, forces, times)

    def add_wall(self, wall: int, ids: Indices, rows: Floats, times: float) -> None:
        self._room(len(ids))
        self._used += self._kernels.add_wall(self._keys, self._sums, wall, ids, rows, times)

    def held(self) -> tuple[Indices, Floats]:
        """Keys in their order, and their sums."""
        held = np.flatnonzero(self._keys)
        held = held[np.argsort(self._keys[held])]
        return self._keys[held], self._sums[held]

    def _add(self, keys: Indices, sums: Floats) -> None:
        self._room(len(keys))
        self._used += self._kernels.add_keys(self._keys, self._sums, keys, sums)

    def _room(self, more: int) -> None:
        """Make the table large enough for so many new contacts: at most half full."""
        places = len(self._keys)
        if 2 * (self._used + more) <= places:
            return
        while 2 * (self._used + more) > places:
            places *= 2
        keys, sums = self.held()
        self._begin(places)
        self._used = self._kernels.add_keys(self._keys, self._sums, keys, sums)


def _kernels() -> ModuleType:
    from analysis.lammps_process import impulse_table

    return impulse_table
