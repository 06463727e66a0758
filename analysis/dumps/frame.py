"""One frame of a dump, and what is said of a dump that cannot be used."""

from __future__ import annotations

from typing import NamedTuple

LARGEST_STEP = 2**62
# Lengths (m) and times (s) beyond this are damage, and no places for MDAnalysis' float32.
LARGEST_LENGTH = 1e30


class DumpError(ValueError):
    """Refuse a dump that cannot be used; the message names the file and the line, step or
    column."""


class Frame(NamedTuple):
    """Say where one frame of a dump is.

    step: of the simulation
    time: s, where the dump has ITEM: TIME
    low, high: (2,) m, the box in x and y
    rows: of its table
    line: number of the first row in the file, from 1; 0 where there are no lines
    offset, length: bytes of the table in the (decompressed) file
    """

    step: int
    time: float | None
    low: tuple[float, float]
    high: tuple[float, float]
    rows: int
    line: int
    offset: int = 0
    length: int = 0

    @property
    def end(self) -> int:
        """Give the place behind the table (bytes)."""
        return self.offset + self.length

    def where(self, row: int) -> str:
        """Say where a row of the table is in the file."""
        return f"line {self.line + row}" if self.line else f"step {self.step}, row {row + 1}"
