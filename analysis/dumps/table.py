"""The frames of a LAMMPS text dump: where they are, and the numbers in each. Streaming, float64,
checked."""

import functools
import math
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np

from analysis.dumps.numbers import numbers_of
from analysis.support.reading import (
    DAMAGED,
    LARGEST_WHOLE,
    NUMBER,
    UnreadableError,
    next_line,
    open_file,
    whole_number,
)
from nscd.arrays import Floats, Indices

LARGEST_STEP = 2**62
# Lengths (m) and times (s) beyond this are damage, and no places for MDAnalysis' float32.
LARGEST_LENGTH = 1e30
# Columns of words, which LAMMPS writes on request; nothing here reads them.
WORDS = frozenset({"element", "typelabel"})


class DumpError(ValueError):
    """Refuse a dump that cannot be used; the message names the file and the line, step or
    column."""


@dataclass(frozen=True, slots=True)
class Frame:
    """Say where one frame of a dump is.

    step: of the simulation
    time: s, where the dump has ITEM: TIME
    low, high: (2,) m, the box in x and y
    count: rows of its table
    line: number of the first row in the file, from 1
    offset, length: bytes of the table in the (decompressed) file
    """

    step: int
    time: float | None
    low: tuple[float, float]
    high: tuple[float, float]
    count: int
    line: int
    offset: int = 0
    length: int = 0


@dataclass(frozen=True)
class DumpIndex:
    """Hold where the frames of a dump are, and the names of the columns of its tables."""

    path: Path
    frames: tuple[Frame, ...]
    columns: tuple[str, ...]

    @functools.cached_property
    def steps(self) -> tuple[int, ...]:
        """The step of each frame."""
        return tuple(frame.step for frame in self.frames)

    @functools.cached_property
    def counts(self) -> tuple[int, ...]:
        """The number of rows of each frame."""
        return tuple(frame.count for frame in self.frames)

    def table(self, number: int) -> Floats:
        """Read the numbers of one frame, (rows, columns); columns of words are NaN.

        Raises DumpError naming the line of a row that has not one number per column."""
        frame = self.frames[number]
        try:
            content = _opened.read(self.path, frame.offset, frame.length)
        except DAMAGED as error:
            raise DumpError(f"{self.path}, step {frame.step}: damaged: {error}") from None
        width = len(self.columns)
        if not WORDS & set(self.columns):
            numbers = numbers_of(content, frame.count, width)
            if numbers is not None:
                return self._held(numbers, content, frame)
        rows = content.split(b"\n")[:-1]
        if len(rows) != frame.count:
            raise DumpError(f"{self.path}, step {frame.step}: changed while it was read")
        numbers = np.array([self._row(row, frame.line + n) for n, row in enumerate(rows)])
        return self._held(numbers.reshape(frame.count, width), content, frame)

    def _held(self, numbers: Floats, content: bytes, frame: Frame) -> Floats:
        """Refuse digits that no float64 holds; the word inf stays what it is."""
        for place, column in np.argwhere(np.isinf(numbers)):
            word = content.split(b"\n")[place].split()[column].decode("utf-8", "replace")
            if any(sign.isdigit() for sign in word):
                raise DumpError(
                    f"{self.path}, line {frame.line + place}: {self.columns[column]}: "
                    f"{word[:40]!r} is too large"
                )
        return numbers

    def _row(self, content: bytes, line: int) -> list[float]:
        words = content.decode("utf-8", "replace").split()
        if len(words) != len(self.columns):
            raise DumpError(
                f"{self.path}, line {line}: {len(words)} words where {len(self.columns)} "
                f"({' '.join(self.columns)}) are needed: {' '.join(words)[:80]!r}"
            )
        row = []
        for name, word in zip(self.columns, words, strict=True):
            if name not in WORDS and not NUMBER.fullmatch(word):
                raise DumpError(f"{self.path}, line {line}: {name}: {word[:40]!r} is not a number")
            row.append(math.nan if name in WORDS else float(word))
        return row

    def ids(self, number: int, column: Floats, what: str = "id") -> Indices:
        """Take a column of one frame, (rows,), as ids or numbers of walls.

        Raises DumpError naming the line of one that is not a whole number from 1 to 2³¹ − 1."""
        good = (column >= 1) & (column < 2**31) & (column == np.floor(column))
        if not good.all():
            row = int(np.argmin(good))
            raise DumpError(
                f"{self.path}, line {self.frames[number].line + row}: {what}: {column[row]:.12g} "
                "where a whole number ≥ 1 is needed"
            )
        return column.astype(np.int64)


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
        file.seek(offset)
        return file.read(length)


_opened = _Open()


def index_dump(path: Path, kind: str = "ATOMS") -> DumpIndex:
    """Find and check the frames of a dump (kind ATOMS) or a dump local (kind ENTRIES), plain or
    compressed.

    Raises DumpError for a missing or empty file, one that is not such a dump, one that ends in
    mid-frame, periodic or triclinic boxes, steps that do not grow, and columns that change or occur
    twice."""
    frames: list[Frame] = []
    columns: tuple[str, ...] = ()
    try:
        with open_file(path) as file:
            reader = _Heads(path, kind, file)
            while (found := reader.next_frame()) is not None:
                frame, names = found
                if frames and frame.step <= frames[-1].step:
                    raise DumpError(
                        f"{path}, line {reader.step_line}: step {frame.step} follows step "
                        f"{frames[-1].step}; frames must be in order, each once"
                    )
                if frames and (frame.time is None) != (frames[0].time is None):
                    raise DumpError(
                        f"{path}, step {frame.step}: ITEM: TIME is in some frames and not in others"
                    )
                if columns and names != columns:
                    raise DumpError(
                        f"{path}, line {frame.line - 1}: the columns change at step {frame.step}"
                    )
                columns = names
                frames.append(reader.past(frame, len(columns), len(frames) + 1))
    except UnreadableError as error:
        raise DumpError(str(error)) from None
    if not frames:
        raise DumpError(f"{path}: empty: no frame in it")
    return DumpIndex(path, tuple(frames), columns)


class _Heads:
    """Reads the heads of frames, one after the other, and goes past their rows."""

    def __init__(self, path: Path, kind: str, file: IO[bytes]) -> None:
        self.path, self.kind, self.file = path, kind, file
        self.line = self.step_line = 0
        self.count_item = f"NUMBER OF {kind}"

    def _next(self) -> str:
        self.line += 1
        return next_line(self.file, self.path, self.line).decode("utf-8", "replace")

    def _value(self) -> str:
        text = self._next()
        if not text:
            raise DumpError(f"{self.path}, line {self.line}: truncated: the file ends in a head")
        return text.strip()

    def next_frame(self) -> tuple[Frame, tuple[str, ...]] | None:
        """The next head and the columns of its table; None at the end of the file."""
        step = count = -1
        time: float | None = None
        box: list[tuple[float, float]] = []
        if not (text := self._next()):
            return None
        while True:
            words = text.split()
            item = " ".join(words[1:]) if words[:1] == ["ITEM:"] else ""
            where = f"{self.path}, line {self.line}"
            if item == "TIMESTEP" and step < 0:
                step = self._whole("step", LARGEST_STEP)
                self.step_line = self.line
            elif item == "TIME" and time is None:
                time = self._number(self._value(), "time")
            elif item == "UNITS":
                if (units := self._value()) != "si":
                    raise DumpError(
                        f"{self.path}, line {self.line}: units {units[:40]}; only si is read here"
                    )
            elif item == self.count_item and step >= 0 and count < 0:
                count = self._whole("rows", LARGEST_WHOLE)
            elif item.startswith("BOX BOUNDS") and count >= 0 and not box:
                box = self._box(words[3:], where)
            elif item.split()[:1] == [self.kind] and box:
                break
            else:
                raise DumpError(
                    f"{where}: not the head of a frame of a LAMMPS dump with ITEM: {self.kind}: "
                    f"{text.strip()[:40]!r}"
                )
            text = self._next()
            if not text:
                raise DumpError(
                    f"{self.path}, line {self.line}: truncated: the file ends in a head"
                )
        columns = tuple(words[2:])
        if twice := {name for name in columns if columns.count(name) > 1}:
            raise DumpError(f"{where}: column {' and '.join(sorted(twice))} occurs twice")
        if strange := [name for name in columns if not name.isascii()]:
            raise DumpError(f"{where}: column {strange[0]!r} is not of ASCII letters")
        (x0, x1), (y0, y1) = box
        return Frame(step, time, (x0, y0), (x1, y1), count, self.line + 1), columns

    def _box(self, flags: list[str], where: str) -> list[tuple[float, float]]:
        """The box in x and y. Contacts across a periodic boundary would be missed."""
        if {"xy", "abc"} & set(flags):
            raise DumpError(f"{where}: a triclinic box; only boxes along x and y are read here")
        for flag in flags:
            if not re.fullmatch("[pfsm]{2}", flag):
                raise DumpError(
                    f"{where}: BOX BOUNDS: {flag[:40]!r} is not a boundary such as ff or pp"
                )
        for axis, flag in zip("xy", flags, strict=False):
            if "p" in flag:
                raise DumpError(
                    f"{where}: the box is periodic in {axis} ({' '.join(flags)}): contacts across "
                    "its boundary would be missed; write the dump with boundary f or s in x and y"
                )
        bounds = [self._value().split() for _ in range(3)]
        if any(len(words) != 2 for words in bounds):
            raise DumpError(f"{where}: BOX BOUNDS: two numbers for each of x, y, z are needed")
        return [(self._number(a, "box"), self._number(b, "box")) for a, b in bounds][:2]

    def _whole(self, what: str, most: int) -> int:
        word = self._value()
        return whole_number(word, f"{self.path}, line {self.line}: {what}", least=0, most=most)

    def _number(self, word: str, what: str) -> float:
        if not NUMBER.fullmatch(word) or not abs(float(word)) <= LARGEST_LENGTH:
            raise DumpError(f"{self.path}, line {self.line}: {what}: {word[:40]!r} is not a number")
        return float(word)

    def past(self, frame: Frame, width: int, number: int) -> Frame:
        """The frame with the place of its table, whose rows are gone past."""
        offset, last = self.file.tell(), b"\n"
        for _ in range(frame.count):
            last = next_line(self.file, self.path, self.line + 1)
            if not last:
                break
            self.line += 1
        if frame.count and (not last.endswith(b"\n") or len(last.split()) < width):
            raise DumpError(
                f"{self.path}: truncated: the file ends inside step {frame.step}, frame {number}"
            )
        length = self.file.tell() - offset
        return Frame(
            frame.step, frame.time, frame.low, frame.high, frame.count, frame.line, offset, length
        )
