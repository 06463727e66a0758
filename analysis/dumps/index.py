"""The index of a dump: where its frames are, found in one pass; their headers and their numbers, in
float64, checked."""

import atexit
import functools
import math
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np

from analysis.dumps.binary import BEGIN, BinaryFrames, is_binary
from analysis.dumps.frame import LARGEST_LENGTH, LARGEST_STEP, DumpError, Frame
from analysis.support.reading import (
    DAMAGED,
    LARGEST_WHOLE,
    NUMBER,
    Lines,
    UnreadableError,
    next_line,
    open_file,
    whole_number,
)
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


# In the form of a head a line of values is this mark, which no text has, and what is in the line.
# All other lines are in it as they are.
MARK = 0
STEP, TIME, COUNT, BOX = b"stcb"


class Headers:
    """Reads heads of frames at wherever the file is.

    line: number of lines that were read so far
    step_line: that of the last step
    form: of the last head: its lines, those of values being marked"""

    def __init__(self, path: Path, kind: str, file: Lines) -> None:
        self.path, self.kind, self.file = path, kind, file
        self.line = self.step_line = 0
        self.form = b""
        self._count_item = f"NUMBER OF {kind}"

    def _next(self) -> str:
        self.line += 1
        line = next_line(self.file, self.path, self.line)
        self.form += line
        return line.decode("utf-8", "replace")

    def _value(self, values: int | None = None) -> str:
        before = self.form
        text = self._next()
        if not text:
            raise DumpError(f"{self.path}, line {self.line}: truncated: the file ends in a head")
        if values is not None:
            self.form = before + bytes((MARK, values)) + b"\n"
        return text.strip()

    def next_frame(self) -> tuple[Frame, tuple[str, ...]] | None:
        """Read the next head: the frame without the place of its table, and the columns of that;
        None at the end of the file.

        Raises DumpError naming the line."""
        step = count = -1
        time: float | None = None
        box: list[tuple[float, float]] = []
        self.form = b""
        if not (text := self._next()):
            return None
        while True:
            words = text.split()
            item = " ".join(words[1:]) if words[:1] == ["ITEM:"] else ""
            where = f"{self.path}, line {self.line}"
            if item == "TIMESTEP" and step < 0:
                step = self._whole("step", STEP, LARGEST_STEP)
                self.step_line = self.line
            elif item == "TIME" and time is None:
                time = self._number(self._value(TIME), "time")
            elif item == "UNITS":
                if (units := self._value()) != "si":
                    raise DumpError(
                        f"{self.path}, line {self.line}: units {units[:40]}; only si is read here"
                    )
            elif item == self._count_item and step >= 0 and count < 0:
                count = self._whole("rows", COUNT, LARGEST_WHOLE)
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
        columns = self._columns(words[2:], where)
        (x0, x1), (y0, y1) = box
        return Frame(step, time, (x0, y0), (x1, y1), count, self.line + 1), columns

    def _columns(self, names: list[str], where: str) -> tuple[str, ...]:
        if twice := {name for name in names if names.count(name) > 1}:
            raise DumpError(f"{where}: column {' and '.join(sorted(twice))} occurs twice")
        if strange := [name for name in names if not name.isascii()]:
            raise DumpError(f"{where}: column {strange[0]!r} is not of ASCII letters")
        return tuple(names)

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
        bounds = [self._value(BOX).split() for _ in range(3)]
        if any(len(words) != 2 for words in bounds):
            raise DumpError(f"{where}: BOX BOUNDS: two numbers for each of x, y, z are needed")
        return [(self._number(a, "box"), self._number(b, "box")) for a, b in bounds][:2]

    def _whole(self, what: str, values: int, most: int) -> int:
        word = self._value(values)
        return whole_number(word, f"{self.path}, line {self.line}: {what}", least=0, most=most)

    def _number(self, word: str, what: str) -> float:
        if not NUMBER.fullmatch(word) or not abs(float(word)) <= LARGEST_LENGTH:
            raise DumpError(f"{self.path}, line {self.line}: {what}: {word[:40]!r} is not a number")
        return float(word)


# Bytes of a file that are read at once.
BLOCK = 1 << 17


def index_dump(path: Path, kind: str = "ATOMS") -> DumpIndex:
    """Find and check the frames of a dump (kind ATOMS; text, or binary as LAMMPS writes it) or a dump
    local (kind ENTRIES), plain or compressed.

    Raises DumpError for a missing or empty file, one that is not such a dump, one that ends in
    mid-frame, periodic or triclinic boxes, steps or times that do not grow, times in some frames
    only, and columns that change or occur twice."""
    try:
        with open_file(path) as file:
            binary = kind == "ATOMS" and _begins_binary(file)
            reader = BinaryFrames(path, file) if binary else _Frames(path, kind, file)
            frames = tuple(reader.all())
    except DAMAGED as error:
        raise DumpError(f"{path}: damaged: {error}") from None
    except UnreadableError as error:
        raise DumpError(str(error)) from None
    if not frames:
        raise DumpError(f"{path}: empty: no frame in it")
    _check_times(path, frames)
    return DumpIndex(path, frames, reader.columns, binary)


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
            f"{path}, step {after.step}: its time, {after.time:.6g} s, follows {before.time:.6g} s; "
            "times must grow; without them (`dump_modify ID time no`) frames go by their steps"
        )


def _begins_binary(file: IO[bytes]) -> bool:
    binary = is_binary(file.read(len(BEGIN)))
    file.seek(0)
    return binary


class _Text:
    """The bytes of an open file, of which a block is kept; it is read forwards only."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file: Any = file
        self.kept, self.at, self.before = b"", 0, 0

    def more(self) -> bool:
        """Read on; what is behind is dropped. False at the end of the file."""
        self.kept, self.before, self.at = self.kept[self.at :], self.before + self.at, 0
        # of a compressed file, what is unpacked at once
        read: bytes = self._file.read1(BLOCK)
        self.kept += read
        return bool(read)

    def readline(self, most: int) -> bytes:
        """Read a line, or `most` bytes of it, as a file does."""
        while (end := self.kept.find(b"\n", self.at, self.at + most) + 1) == 0:
            if len(self.kept) - self.at >= most or not self.more():
                end = min(len(self.kept), self.at + most)
                break
        line, self.at = self.kept[self.at : end], end
        return line


class _Frames:
    """The frames of a dump. A head that differs from the one before is read line by line."""

    def __init__(self, path: Path, kind: str, file: IO[bytes]) -> None:
        self.path = path
        self.columns: tuple[str, ...] = ()
        self._text = _Text(file)
        self._headers = Headers(path, kind, self._text)
        self._scan = _core.Scan()
        self._count = 0

    def all(self) -> Iterator[Frame]:
        """Read all frames, in order."""
        scan = self._scan
        while True:
            end = self._run()
            if end == _core.Scan.MORE and self._more():
                continue
            if scan.rows_left:
                if end == _core.Scan.STRANGE:
                    next_line(self._text, self.path, self._headers.line + 1)
                raise DumpError(
                    f"{self.path}: truncated: the file ends inside step {scan.last}, "
                    f"frame {self._count + len(scan)}"
                )
            yield from self._taken()
            if not self._read_head():
                return

    def _run(self) -> int:
        """Go on in the core, as far as that goes."""
        text, heads, scan = self._text, self._headers, self._scan
        scan.at, scan.lines = text.at, heads.line
        end = scan.run(text.kept, text.before, heads.form, len(self.columns))
        text.at, heads.line = scan.at, scan.lines
        return end

    def _more(self) -> bool:
        try:
            return self._text.more()
        except DAMAGED as error:
            line = self._headers.line + 1
            raise DumpError(f"{self.path}, line {line}: damaged: {error}") from None

    def _taken(self) -> Iterator[Frame]:
        """The frames that were found since."""
        self._count += len(self._scan)
        timed = bytes((MARK, TIME)) in self._headers.form
        whole, values = (array.tolist() for array in self._scan.taken())
        for (step, rows, *place), (time, x0, x1, y0, y1, *_) in zip(whole, values, strict=True):
            yield Frame(step, time if timed else None, (x0, y0), (x1, y1), rows, *place)

    def _read_head(self) -> bool:
        """Read a head line by line; False at the end of the file."""
        found = self._headers.next_frame()
        if found is None:
            return False
        frame, names = found
        if frame.step <= self._scan.last:
            raise DumpError(
                f"{self.path}, line {self._headers.step_line}: step {frame.step} follows step "
                f"{self._scan.last}; frames must be in order, each once"
            )
        if self.columns and names != self.columns:
            raise DumpError(
                f"{self.path}, line {frame.line - 1}: the columns change at step {frame.step}"
            )
        self.columns = names
        ends = [end for axis in zip(frame.low, frame.high, strict=True) for end in axis]
        self._scan.begin(
            frame.step,
            frame.rows,
            frame.line,
            self._text.before + self._text.at,
            np.array([frame.time or 0.0, *ends, 0.0, 0.0]),
        )
        return True
