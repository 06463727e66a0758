"""The numbers in the frames of a dump: streaming, float64, checked."""

from __future__ import annotations

import atexit
import functools
import math
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import numpy as np

from analysis.dumps.frame import DumpError, Frame
from analysis.support.reading import DAMAGED, NUMBER, open_file
from nscd import _core
from nscd.arrays import Floats, Indices

# So many bytes are read at once where frames are read one after the other.
AHEAD = 1 << 18
# Columns of words, which LAMMPS writes on request; nothing here reads them.
WORDS = frozenset({"element", "typelabel"})


@dataclass(slots=True)
class _Ahead:
    """Tables that were read and not asked for yet, and the frame behind them."""

    tables: dict[int, Floats]
    next: int = 0


@dataclass(frozen=True)
class DumpIndex:
    """Hold where the frames of a dump are, and the names of the columns of its tables; whether these
    are binary."""

    path: Path
    frames: tuple[Frame, ...]
    columns: tuple[str, ...]
    binary: bool = False
    _ahead: _Ahead = field(
        default_factory=lambda: _Ahead({}), init=False, repr=False, compare=False
    )

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
        ahead = self._ahead
        if number not in ahead.tables:
            ahead.tables = self._read(number, AHEAD if number == ahead.next else 0)
            ahead.next = max(ahead.tables) + 1
        return ahead.tables.pop(number)

    def _read(self, number: int, ahead: int) -> dict[int, Floats]:
        """A frame, and those behind it that are within so many bytes and have numbers only."""
        frame, last = self.frames[number], number + 1
        while last < len(self.frames) and self.frames[last].end < frame.offset + ahead:
            last += 1
        content = self.text(range(number, last))
        numbers = None if WORDS & set(self.columns) else self.numbers(range(number, last), content)
        parts = self._parts(range(number, last))
        if numbers is None:
            return {number: self._by_row(content[: parts[0, 1]], frame)}
        tables = np.split(numbers, np.cumsum(parts[:-1, 2]))
        for table, (start, end, _) in zip(tables, parts, strict=True):
            infinite = not self.binary and np.isinf(table).any()
            if infinite and _too_large(table, content[start:end]):
                return {number: self._by_row(content[: parts[0, 1]], frame)}
        return dict(zip(range(number, last), tables, strict=True))

    def _parts(self, numbers: range) -> Indices:
        """Start and end (bytes behind the first one's start) and rows of frames."""
        frames = self.frames[numbers.start : numbers.stop]
        parts = np.array([(one.offset, one.end, one.rows) for one in frames])
        parts[:, :2] -= frames[0].offset
        return parts

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

    def numbers(self, numbers: range, text: bytes) -> Floats | None:
        """Read the tables of frames from their text, one below the other; None where there is
        anything but numbers."""
        return _core.rows(text, self._parts(numbers), len(self.columns), self.binary)

    def _by_row(self, content: bytes, frame: Frame) -> Floats:
        """The numbers of a frame that may have others than numbers."""
        rows = content.split(b"\n")[:-1]
        if len(rows) != frame.rows:
            raise DumpError(f"{self.path}, step {frame.step}: changed while it was read")
        numbers = np.array([self._row(row, frame.line + n) for n, row in enumerate(rows)])
        return numbers.reshape(frame.rows, len(self.columns))

    def _row(self, content: bytes, line: int) -> list[float]:
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
            if _overflown(row[-1], word):
                raise DumpError(f"{where} is too large")
        return row

    def ids(self, number: int, column: Floats, what: str = "id") -> Indices:
        """Take a column of one frame, (rows,), as ids or numbers of walls.

        Raises DumpError naming the line of one that is not a whole number from 1 to 2³¹ − 1."""
        good = (column >= 1) & (column < 2**31) & (column == np.floor(column))
        if not good.all():
            row = int(np.argmin(good))
            raise DumpError(
                f"{self.path}, {self.frames[number].where(row)}: {what}: {column[row]:.12g} "
                "where a whole number ≥ 1 is needed"
            )
        return column.astype(np.int64)


def _overflown(number: float, word: str) -> bool:
    """Whether digits are more than a float64 holds; the word inf stays what it is."""
    return math.isinf(number) and any(sign.isdigit() for sign in word)


def _too_large(table: Floats, content: bytes) -> bool:
    rows = content.decode("ascii", "replace").split("\n")
    return any(
        _overflown(table[row, column], rows[row].split()[column])
        for row, column in np.argwhere(np.isinf(table))
    )


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
