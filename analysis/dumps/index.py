"""The index of a dump: where its frames are, found in one pass; their headers and their numbers, in
float64, checked."""

import atexit
import functools
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np

from analysis.dumps.find_frames import BEGIN, BinaryFrames, DumpError, Frame, TextFrames, is_binary
from analysis.support.reading import DAMAGED, NUMBER, UnreadableError, open_file
from nscd import _core
from nscd.arrays import Floats, Indices, Mask

# Columns of words, which LAMMPS writes on request; nothing here reads them.
WORDS = frozenset({"element", "typelabel"})


@dataclass(frozen=True)
class DumpIndex:
    """Hold where the frames of a dump are, and the names of the columns of its tables; whether these
    are binary.

    units: si or cgs, where it says them; periodic: whether the box is, along x
    sample: words of some rows of a text, from all of it"""

    path: Path
    frames: tuple[Frame, ...]
    columns: tuple[str, ...]
    binary: bool = False
    units: str = ""
    periodic: bool = False
    sample: tuple[tuple[str, ...], ...] = ()

    @functools.cached_property
    def steps(self) -> tuple[int, ...]:
        """The step of each frame."""
        return tuple(frame.step for frame in self.frames)

    @functools.cached_property
    def counts(self) -> tuple[int, ...]:
        """The number of rows of each frame."""
        return tuple(frame.rows for frame in self.frames)

    def table(self, number: int) -> Floats:
        """Read the numbers of one frame, (rows, columns); columns of words are NaN.

        Raises DumpError naming the line of a row that has not one number per column."""
        here = range(number, number + 1)
        return self.numbers(here, self.text(here))

    def text(self, numbers: range) -> bytes:
        """Read the bytes from the table of a frame to the end of that of a later one.

        Raises DumpError naming the step where they cannot be read."""
        first, last = self.frames[numbers[0]], self.frames[numbers[-1]]
        try:
            content = _opened.read(self.path, first.offset, last.end - first.offset)
        except DAMAGED as error:
            raise DumpError(f"{self.path}, step {first.step}: damaged: {error}") from None
        if len(content) < last.end - first.offset:
            raise DumpError(f"{self.path}, step {first.step}: changed while it was read")
        return content

    def numbers(self, numbers: range, text: bytes) -> Floats:
        """Read the tables of frames from their text, one below the other; columns of words are NaN.

        Raises DumpError naming the line of a row that has not one number per column."""
        frames = self.frames[numbers.start : numbers.stop]
        parts = np.array([(one.offset, one.end, one.rows) for one in frames])
        parts[:, :2] -= frames[0].offset  # of the start of the text
        named = not self.binary and WORDS & set(self.columns)
        found = None if named else _core.rows(text, parts, len(self.columns), self.binary)
        if found is not None and (self.binary or not np.isinf(found).any()):
            return found
        # row by row, as words are, and to see whether digits are too many or a row is wrong
        return np.concatenate(
            [
                self._by_row(text[start:end], frame)
                for frame, (start, end, _) in zip(frames, parts, strict=True)
            ]
        )

    def _by_row(self, content: bytes, frame: Frame) -> Floats:
        """The numbers of a frame that may have others than numbers."""
        rows = content.split(b"\n")[:-1]
        if len(rows) != frame.rows:
            raise DumpError(f"{self.path}, step {frame.step}: changed while it was read")
        numbers = np.array(
            [self._numbers_of_row(row, frame.line + n) for n, row in enumerate(rows)]
        )
        return numbers.reshape(frame.rows, len(self.columns))

    def _numbers_of_row(self, content: bytes, line: int) -> list[float]:
        words = content.decode("utf-8", "replace").split()
        if len(words) != len(self.columns):
            raise DumpError(
                f"{self.path}, line {line}: {len(words)} words where {len(self.columns)} "
                f"({' '.join(self.columns)}) are needed: {' '.join(words)[:80]!r}"
            )
        row = []
        for name, word in zip(self.columns, words, strict=True):
            where = f"{self.path}, line {line}: {name}: {word[:40]!r}"
            if name not in WORDS and not NUMBER.fullmatch(word):
                raise DumpError(f"{where} is not a number")
            row.append(math.nan if name in WORDS else float(word))
            # the word inf stays what it is
            if math.isinf(row[-1]) and any(sign.isdigit() for sign in word):
                raise DumpError(f"{where} is too large")
        return row

    def ids(self, numbers: range, column: Floats, what: str = "id") -> Indices:
        """Take a column of some frames, one below the other, as ids or numbers of walls.

        Raises DumpError naming the line of one that is not a whole number from 1 to 2³¹ − 1."""
        good = (column >= 1) & (column < 2**31) & (column == np.floor(column))
        large = (column >= 2**31) & (column < 2**63) & (column == np.floor(column))
        self.refuse(numbers, large, f"{what}: ", column, f". At most {2**31 - 1} is read")
        self.refuse(numbers, ~good, f"{what}: ", column, " where a whole number ≥ 1 is needed")
        return column.astype(np.int64)

    def refuse(
        self,
        numbers: range,
        bad: Mask,
        what: str,
        values: Floats | Indices | None = None,
        rest: str = "",
    ) -> None:
        """Raise DumpError naming the first bad row of some frames, one below the other: what is
        wrong, the value there, and the rest."""
        if bad.any():
            row = within = int(np.argmax(bad))
            frames = iter(self.frames[numbers.start :])
            while within >= (frame := next(frames)).rows:
                within -= frame.rows
            value = "" if values is None else f"{values[row]:.12g}"
            raise DumpError(f"{self.path}, {frame.where(within)}: {what}{value}{rest}")


class _Open:
    """The dumps that were read last stay open: forwards, a compressed one is unpacked only once."""

    most = 8

    def __init__(self) -> None:
        self.files: dict[object, IO[bytes]] = {}

    def read(self, path: Path, offset: int, length: int) -> bytes:
        """Some bytes of a dump, plain or compressed."""
        found = path.stat()
        key = (path, os.getpid(), found.st_ino, found.st_mtime_ns)
        if key not in self.files:
            if len(self.files) == self.most:
                self.files.pop(next(iter(self.files))).close()
            self.files[key] = open_file(path)
        file = self.files[key]
        try:
            file.seek(offset)
            return file.read(length)
        except DAMAGED:  # some decompressors cannot be used after an error
            self.files.pop(key).close()
            raise

    def close(self) -> None:
        """Close all."""
        while self.files:
            self.files.popitem()[1].close()


_opened = _Open()
atexit.register(_opened.close)


def index_dump(path: Path, kind: str = "ATOMS") -> DumpIndex:
    """Find and check the frames of a dump (kind ATOMS; text, or binary as LAMMPS writes it) or a dump
    local (kind ENTRIES), plain or compressed.

    Raises DumpError for a missing or empty file, one that is not such a dump, one that ends in
    mid-frame, periodic or triclinic boxes, steps or times that do not grow, times in some frames
    only, and columns that change or occur twice."""
    try:
        with open_file(path) as file:
            binary = kind == "ATOMS" and is_binary(file.read(len(BEGIN)))
            file.seek(0)
            reader = BinaryFrames(path, file) if binary else TextFrames(path, file, kind)
            frames = tuple(reader.all())
    except DAMAGED as error:
        raise DumpError(f"{path}: damaged: {error}") from None
    except UnreadableError as error:
        raise DumpError(str(error)) from None
    if not frames:
        raise DumpError(f"{path}: empty: no frame in it")
    _check_times(path, frames)
    rows = (row for row in reader.sample if len(row) == len(reader.columns))
    sample = tuple(tuple(word.decode("latin-1") for word in row) for row in rows)
    return DumpIndex(path, frames, reader.columns, binary, reader.units, reader.periodic, sample)


def _check_times(path: Path, frames: tuple[Frame, ...]) -> None:
    """Refuse frames that a table with a column of times could not tell apart."""
    timed = [frame.time is not None for frame in frames]
    if any(timed) and not all(timed):
        step = frames[timed.index(not timed[0])].step
        raise DumpError(f"{path}, step {step}: a time is in some frames and not in others")
    if not timed[0]:
        return
    late = np.diff(np.array([frame.time for frame in frames], dtype=np.float64)) <= 0
    if late.any():
        before, after = frames[late.argmax()], frames[late.argmax() + 1]
        raise DumpError(
            f"{path}, step {after.step}: its time, {after.time:.6g} s, follows {before.time:.6g} s. "
            "Times must grow. Without them (`dump_modify ID time no`) frames go by their steps"
        )
