"""The frames of a dump, text or binary, found in one pass; what both refuse.

LAMMPS' `dump custom` writes a binary dump into a file whose name ends in .bin.
A frame is a head and, of each process that LAMMPS ran on, the number of its numbers (int32) and these
(float64, row by row). The head, without gaps, in the order of the machine that wrote it:

    int64      −10, the length of what follows
    10 bytes   DUMPCUSTOM
    int32      1, by which the order of bytes is known; int32 revision, 2
    int64      step; int64 rows; int32 whether the box is triclinic
    6 int32    boundaries, 0 for p: x low and high, y, z; 6 float64 m: the box
    int32      columns; int32 length and bytes of the units; int8 whether float64 s, the time, follows
    int32      length and bytes of the columns' names; int32 processes"""

import re
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from analysis.support import reading
from nscd import _core

LARGEST_STEP = 2**62
# Lengths (m) and times (s) beyond this are damage, and no places for MDAnalysis' float32.
LARGEST_LENGTH = 1e30


class DumpError(ValueError):
    """Refuse a dump that cannot be used; the message names the file and the line, step or
    column."""


class NoContactError(DumpError):
    """Nobody touches anybody."""


class Frame(NamedTuple):
    """Say where one frame of a dump is.

    low, high: (2,) m, the box in x and y
    offset, length: bytes of the table in the (decompressed) file"""

    step: int  # of the simulation
    time: float | None  # s, where the dump has ITEM: TIME
    low: tuple[float, float]
    high: tuple[float, float]
    rows: int  # of its table
    line: int  # number of the first row in the file, from 1; 0 where there are no lines
    offset: int = 0
    length: int = 0

    @property
    def end(self) -> int:
        """Give the place behind the table (bytes)."""
        return self.offset + self.length

    def where(self, row: int) -> str:
        """Say where a row of the table is in the file."""
        return f"line {self.line + row}" if self.line else f"step {self.step}, row {row + 1}"


class Frames:
    """What frames of one dump have in common; each check raises DumpError that begins with
    `where`."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.columns: tuple[str, ...] = ()  # known behind the first frame
        self.units = ""  # where it says them
        self.periodic = False  # along x
        self.sample: list[list[bytes]] = []  # words of some lines, of text

    def check_step(self, where: str, before: int, step: int) -> None:
        """Refuse steps that do not grow."""
        if not before < step <= LARGEST_STEP:
            raise DumpError(
                f"{where}: step {step} follows step {before}. Frames must be in order, each once"
            )

    def check_units(self, where: str, units: str) -> None:
        """Refuse units that have no metres here, and others than those of the frames before."""
        if units not in ("si", "cgs") or self.units not in ("", units):
            raise DumpError(f"{where}: units {units[:40]}. Only si or cgs throughout is read here")
        self.units = units

    def check_box(self, where: str, triclinic: bool, flags: Sequence[str]) -> None:
        """Refuse a box that is not along x and y, or periodic there, where contacts across its boundary
        would be missed: unless scene.toml beside it has the period along x."""
        if triclinic:
            raise DumpError(f"{where}: a triclinic box. Only boxes along x and y are read here")
        self.periodic = "p" in "".join(flags[:1])
        for axis, flag in zip("xy", flags, strict=False):
            if "p" in flag and not (axis == "x" and has_period(self.path)):
                raise DumpError(
                    f"{where}: the box is periodic in {axis} ({' '.join(flags)}): contacts across "
                    "its boundary would be missed. Write the dump with boundary f or s in x and y. Or "
                    "put a scene.toml with period_x_m beside it"
                )

    def check_columns(self, where: str, names: Sequence[str], step: int) -> None:
        """Take the names of columns, which are those of the frames before; refuse others."""
        if twice := {name for name in names if names.count(name) > 1}:
            raise DumpError(f"{where}: column {' and '.join(sorted(twice))} occurs twice")
        if strange := [name for name in names if not name.isascii()]:
            raise DumpError(f"{where}: column {strange[0]!r} is not of ASCII letters")
        if self.columns and tuple(names) != self.columns:
            raise DumpError(f"{where}: the columns change at step {step}")
        self.columns = tuple(names)


def has_period(dump: Path) -> bool:
    """Tell whether scene.toml beside a dump has a period along x."""
    beside = dump.parent / "scene.toml"
    return beside.is_file() and bool(
        re.search(r"^period_x_m\s*=", beside.read_text(encoding="utf-8"), re.MULTILINE)
    )


# Bytes of a file that are read at once.
BLOCK = 1 << 17
# In the form of a head a line of values is this mark, which no text has, and what is in the line.
# All other lines are in it as they are.
MARK = 0
STEP, TIME, COUNT, BOX = b"stcb"


class TextFrames(Frames):
    """The frames of an open file. A head that differs from the one before is read line by line, all
    that follows in the core.

    kind: of the items, ATOMS or ENTRIES"""

    def __init__(self, path: Path, file: IO[bytes], kind: str) -> None:
        super().__init__(path)
        self._file: Any = file
        self._kind = kind
        # a block of the file, and the bytes before it; the core knows the place in it and the line
        self._unread, self._before = b"", 0
        self._scan = _core.Scan()
        # of the last head: its lines, those of values being marked
        self._form = b""
        self._count = self._blocks = 0

    def all(self) -> Iterator[Frame]:
        """Read all frames, in order. Raises DumpError or UnreadableError naming the line."""
        scan = self._scan
        while True:
            end = scan.run(self._unread, self._before, self._form, len(self.columns))
            if end == _core.Scan.End.MORE and self._more():
                continue
            if scan.rows_left:
                if end == _core.Scan.End.STRANGE:
                    reading.next_line(self, self.path, scan.lines + 1)
                raise DumpError(
                    f"{self.path}: truncated: the file ends inside step {scan.last}, "
                    f"frame {self._count + len(scan)}"
                )
            self._count += len(scan)
            timed = bytes((MARK, TIME)) in self._form
            positions = scan.take()
            both = zip(positions.places.tolist(), positions.values.tolist(), strict=True)
            for (step, rows, *position), (time, x0, x1, y0, y1, *_) in both:
                when = time if timed else None
                yield Frame(step, when, (x0, y0), (x1, y1), rows, *position)
            if not self._read_head():
                return

    def _more(self) -> bool:
        """Read on; what is behind is dropped. False at the end of the file."""
        scan = self._scan
        self._unread, self._before, scan.at = self._unread[scan.at :], self._before + scan.at, 0
        try:
            # of a compressed file, what is unpacked at once
            read: bytes = self._file.read1(BLOCK)
        except reading.DAMAGED as error:
            raise reading.UnreadableError(
                f"{self.path}, line {scan.lines + 1}: damaged: {error}"
            ) from None
        self._unread += read
        self._look_at(read)
        return bool(read)

    def _look_at(self, read: bytes) -> None:
        """Keep the words of some lines of a block, in long files of ever fewer blocks."""
        self._blocks += 1
        if self._blocks & ((1 << max(0, self._blocks.bit_length() - 5)) - 1):
            return
        starts = range(0, len(read), 1 + len(read) // (256 if self._blocks == 1 else 8))
        for start in sorted({read.find(b"\n", at) + 1 for at in starts} - {0}):
            words = read[start : max(start, read.find(b"\n", start))].split()
            if words and words[0] != b"ITEM:":
                self.sample.append(words)

    def readline(self, maximum: int) -> bytes:
        """Read a line, or `maximum` bytes of it, as a file does."""
        scan = self._scan
        while (end := self._unread.find(b"\n", scan.at, scan.at + maximum) + 1) == 0:
            if len(self._unread) - scan.at >= maximum or not self._more():
                end = min(len(self._unread), scan.at + maximum)
                break
        line, scan.at = self._unread[scan.at : end], end
        return line

    @property
    def _where(self) -> str:
        return f"{self.path}, line {self._scan.lines}"

    def _line(self, mark: int | None = None) -> str:
        """The next line of a head, marked where it has values of a kind. Raises DumpError at the
        end of the file."""
        self._scan.lines += 1
        line = reading.next_line(self, self.path, self._scan.lines)
        if not line:
            raise DumpError(f"{self._where}: truncated: the file ends in a head")
        self._form += line if mark is None else bytes((MARK, mark)) + b"\n"
        return line.decode("utf-8", "replace").strip()

    def _read_head(self) -> bool:
        """Read a head line by line; False at the end of the file. Raises DumpError naming the
        line."""
        if self._scan.at == len(self._unread) and not self._more():
            return False
        step = count = -1
        time: float | None = None
        ends: list[float] = []
        self._form = b""
        while True:
            text = self._line()
            words = text.split()
            item = " ".join(words[1:]) if words[:1] == ["ITEM:"] else ""
            if item == "TIMESTEP" and step < 0:
                step = self._integer("step", STEP, LARGEST_STEP)
                self.check_step(self._where, self._scan.last, step)
            elif item == "TIME" and time is None:
                time = self._number(self._line(TIME), "time")
            elif item == "UNITS":
                units = self._line()
                self.check_units(self._where, units)
            elif item == f"NUMBER OF {self._kind}" and step >= 0 and count < 0:
                count = self._integer("rows", COUNT, reading.LARGEST_WHOLE)
            elif item.startswith("BOX BOUNDS") and count >= 0 and not ends:
                ends = self._box(words[3:])
            elif item.split()[:1] == [self._kind] and ends:
                break
            else:
                raise DumpError(
                    f"{self._where}: not the head of a frame of a LAMMPS dump with ITEM: "
                    f"{self._kind}: {text[:40]!r}"
                )
        self.check_columns(self._where, words[2:], step)
        scan, numbers = self._scan, np.array([time or 0.0, *ends])
        scan.begin(step, count, scan.lines + 1, self._before + scan.at, numbers)
        return True

    def _box(self, flags: list[str]) -> list[float]:
        """Lowest and highest x, y and z."""
        where = self._where
        triclinic = bool({"xy", "abc"} & set(flags))
        if strange := [flag for flag in flags if not re.fullmatch("[pfsm]{2}", flag)]:
            self.check_box(where, triclinic, ())
            raise DumpError(
                f"{where}: BOX BOUNDS: {strange[0][:40]!r} is not a boundary such as ff or pp"
            )
        self.check_box(where, triclinic, flags)
        bounds = [self._line(BOX).split() for _ in range(3)]
        if any(len(words) != 2 for words in bounds):
            raise DumpError(f"{where}: BOX BOUNDS: two numbers for each of x, y, z are needed")
        return [self._number(word, "box") for words in bounds for word in words]

    def _integer(self, what: str, mark: int, maximum: int) -> int:
        word = self._line(mark)
        return reading.whole_number(word, f"{self._where}: {what}", minimum=0, maximum=maximum)

    def _number(self, word: str, what: str) -> float:
        if not reading.NUMBER.fullmatch(word) or not abs(float(word)) <= LARGEST_LENGTH:
            raise DumpError(f"{self._where}: {what}: {word[:40]!r} is not a number")
        return float(word)


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
            not 0 <= rows <= reading.LARGEST_WHOLE
            or not np.abs([x0, x1, y0, y1, *z]).max() <= LARGEST_LENGTH
        ):
            raise DumpError(f"{where}: damaged: {rows} rows, a box of {[x0, x1, y0, y1, *z]}")
        self._step = step
        pairs = zip(boundaries[::2], boundaries[1::2], strict=True)
        self.check_box(where, triclinic, ["p" if 0 in pair else "f" for pair in pairs])
        if units := " ".join(self._words(where)):
            self.check_units(where, units)
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
