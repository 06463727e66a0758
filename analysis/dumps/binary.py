"""LAMMPS' binary dumps, as `dump custom` writes them into a file whose name ends in .bin.

A frame is a head and, of each process that LAMMPS ran on, the number of its numbers (int32) and these
(float64, row by row). The head, without gaps, in the order of the machine that wrote it:

    int64      −10, the length of what follows
    10 bytes   DUMPCUSTOM
    int32      1, by which the order of bytes is known; int32 revision, 2
    int64      step; int64 rows; int32 whether the box is triclinic
    6 int32    boundaries, 0 for p: x low and high, y, z; 6 float64 m: the box
    int32      columns; int32 length and bytes of the units; int8 whether float64 s, the time, follows
    int32      length and bytes of the columns' names; int32 processes"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np

from analysis.dumps.frame import LARGEST_LENGTH, DumpError, Frame, Frames
from analysis.support.reading import LARGEST_WHOLE

MAGIC = b"DUMPCUSTOM"
BEGIN = struct.pack("<q", -len(MAGIC)) + MAGIC
SMALL = b"\xff" * 7
REVISION, ORDER = 2, 1
HEAD = struct.Struct("<qqi6i6di")
# Names of columns have a few hundred bytes, and nobody has as many processors.
LONGEST_NAMES, MOST_PROCESSES = 1 << 16, 1 << 20
HOW = "Write it as text, or with LAMMPS of 2020 or newer and `dump custom`"


def is_binary(start: bytes) -> bool:
    """Tell from its first bytes whether a dump is binary: a small negative number, in either
    order."""
    return SMALL in start[:8]


class BinaryFrames(Frames):
    """The frames of a binary dump."""

    def __init__(self, path: Path, file: IO[bytes]) -> None:
        super().__init__(path)
        self._file, self._at, self._step = file, 0, -1

    def all(self) -> Iterator[Frame]:
        """Read all heads, in order. Raises DumpError naming the step."""
        while start := self._file.read(len(BEGIN)):
            self._at += len(start)
            yield self._frame(start)

    def _frame(self, start: bytes) -> Frame:
        if start != BEGIN[: len(start)] or (len(start) < len(BEGIN) and self._step < 0):
            if self._step < 0:
                raise DumpError(
                    f"{self.path}: not a LAMMPS dump of atoms with named columns. {HOW}"
                )
            raise DumpError(f"{self.path}: damaged behind step {self._step}: no frame follows")
        if len(start) < len(BEGIN):
            raise self._cut()
        order, revision = self._take("<ii")
        if (order, revision) != (ORDER, REVISION):
            what = f"revision {revision}" if order == ORDER else "another order of bytes"
            raise DumpError(f"{self.path}: a binary dump of {what}. {HOW}")
        step, rows, triclinic, *rest = self._take(HEAD.format)
        where = f"{self.path}, step {step}"
        boundaries, (x0, x1, y0, y1, *z), width = rest[:6], rest[6:12], rest[12]
        self.check_step(str(self.path), self._step, step)
        if (
            not 0 <= rows <= LARGEST_WHOLE
            or not np.abs([x0, x1, y0, y1, *z]).max() <= LARGEST_LENGTH
        ):
            raise DumpError(f"{where}: damaged: {rows} rows, a box of {[x0, x1, y0, y1, *z]}")
        self._step = step
        pairs = zip(boundaries[::2], boundaries[1::2], strict=True)
        self.check_box(where, triclinic, ["p" if 0 in pair else "f" for pair in pairs])
        self.check_units(where, " ".join(self._words(where)) or "si")
        time = self._time(where)
        names = self._words(where)
        if len(names) != width or not width:
            raise DumpError(f"{where}: damaged: {len(names)} names of {width} columns")
        self.check_columns(where, names, step)
        offset = self._at
        self._pass_numbers(where, rows * width)
        return Frame(step, time, (x0, y0), (x1, y1), rows, 0, offset, self._at - offset)

    def _time(self, where: str) -> float | None:
        (timed,) = self._take("<b")
        if not timed:
            return None
        time = float(self._take("<d")[0])
        if not abs(time) <= LARGEST_LENGTH:
            raise DumpError(f"{where}: time: {time} is not a number")
        return time

    def _pass_numbers(self, where: str, count: int) -> None:
        """Go past the numbers of a frame, which are to be so many."""
        (processes,) = self._take("<i")
        if not 0 <= processes <= MOST_PROCESSES:
            raise DumpError(f"{where}: damaged: it is of {processes} processes")
        found = 0
        for _ in range(processes):
            (some,) = self._take("<i")
            found += some
            if some < 0 or found > count:
                break
            self._at = self._file.seek(8 * some, 1)
        if found != count:
            raise DumpError(f"{where}: damaged: {found} numbers where {count} are needed")
        # a file ends where its last byte is, wherever one looks for it
        if count:
            self._file.seek(-1, 1)
            if not self._file.read(1):
                raise self._cut()

    def _words(self, where: str) -> tuple[str, ...]:
        (length,) = self._take("<i")
        if not 0 <= length <= LONGEST_NAMES:
            raise DumpError(f"{where}: damaged: names of {length} bytes")
        return tuple(self._bytes(length).decode("ascii", "replace").split())

    def _take(self, kinds: str) -> tuple[Any, ...]:
        return struct.unpack(kinds, self._bytes(struct.calcsize(kinds)))

    def _bytes(self, count: int) -> bytes:
        found = self._file.read(count)
        self._at += len(found)
        if len(found) < count:
            raise self._cut()
        return found

    def _cut(self) -> DumpError:
        return DumpError(
            f"{self.path}: truncated: the file ends inside a frame, at byte {self._at}"
        )
