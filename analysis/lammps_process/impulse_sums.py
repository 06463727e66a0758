"""Impulses of contacts between two frames, summed over the steps of an engine."""

from __future__ import annotations

from typing import IO, TYPE_CHECKING

from analysis.support.frames import IMPULSE_COLUMNS, write_frame
from nscd import _core

if TYPE_CHECKING:
    from nscd.arrays import Floats, Index32


class ImpulseSums:
    """Sum the impulses of contacts, and write them into impulses.dump frame by frame."""

    def __init__(self, file: IO[str]) -> None:
        self._file, self._sums = file, _core.EngineSums()

    def add_pairs(self, ids: Floats, forces: Floats, times: float) -> None:
        """Add what pairs gave in a step.

        ids: (k,2)
        forces: (k,4) N, on the first: two parts that are added, each (x, y)
        times: s, what makes them the impulse of the first on the second"""
        self._sums.add_pairs(ids, forces, times)

    def add_wall(self, wall: int, ids: Index32, rows: Floats, times: float) -> None:
        """Add what a wall, numbered from 1, gave in a step to disks (n,).

        rows: (n, 3 or more), whether the disk touches it, and the force (x, y) N on the disk
        times: s, what makes that the impulse of the disk on the wall"""
        self._sums.add_wall(wall, ids, rows, times)

    def write(self, step: int) -> None:
        """Write a frame with the sums since the last one, the smaller id first; then begin
        again."""
        write_frame(self._file, "ENTRIES", step, IMPULSE_COLUMNS, self._sums.close())
