"""The frames of a text dump, found in one pass."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np

from analysis.dumps.frame import LARGEST_LENGTH, LARGEST_STEP, DumpError, Frame, Frames
from analysis.support.reading import (
    DAMAGED,
    LARGEST_WHOLE,
    NUMBER,
    UnreadableError,
    next_line,
    whole_number,
)
from nscd import _core

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
        self._kept, self._before = b"", 0
        self._scan = _core.Scan()
        # of the last head: its lines, those of values being marked
        self._form = b""
        self._count = 0

    def all(self) -> Iterator[Frame]:
        """Read all frames, in order. Raises DumpError or UnreadableError naming the line."""
        scan = self._scan
        while True:
            end = scan.run(self._kept, self._before, self._form, len(self.columns))
            if end == _core.Scan.MORE and self._more():
                continue
            if scan.rows_left:
                if end == _core.Scan.STRANGE:
                    next_line(self, self.path, scan.lines + 1)
                raise DumpError(
                    f"{self.path}: truncated: the file ends inside step {scan.last}, "
                    f"frame {self._count + len(scan)}"
                )
            yield from self._taken()
            if not self._read_head():
                return

    def _taken(self) -> Iterator[Frame]:
        """The frames that were found since."""
        self._count += len(self._scan)
        timed = bytes((MARK, TIME)) in self._form
        whole, values = (array.tolist() for array in self._scan.taken())
        for (step, rows, *place), (time, x0, x1, y0, y1, *_) in zip(whole, values, strict=True):
            yield Frame(step, time if timed else None, (x0, y0), (x1, y1), rows, *place)

    def _more(self) -> bool:
        """Read on; what is behind is dropped. False at the end of the file."""
        scan = self._scan
        self._kept, self._before, scan.at = self._kept[scan.at :], self._before + scan.at, 0
        try:
            # of a compressed file, what is unpacked at once
            read: bytes = self._file.read1(BLOCK)
        except DAMAGED as error:
            raise UnreadableError(f"{self.path}, line {scan.lines + 1}: damaged: {error}") from None
        self._kept += read
        return bool(read)

    def readline(self, most: int) -> bytes:
        """Read a line, or `most` bytes of it, as a file does."""
        scan = self._scan
        while (end := self._kept.find(b"\n", scan.at, scan.at + most) + 1) == 0:
            if len(self._kept) - scan.at >= most or not self._more():
                end = min(len(self._kept), scan.at + most)
                break
        line, scan.at = self._kept[scan.at : end], end
        return line

    @property
    def _where(self) -> str:
        return f"{self.path}, line {self._scan.lines}"

    def _line(self, mark: int | None = None) -> str:
        """The next line of a head, marked where it has values of a kind. Raises DumpError at the
        end of the file."""
        self._scan.lines += 1
        line = next_line(self, self.path, self._scan.lines)
        if not line:
            raise DumpError(f"{self._where}: truncated: the file ends in a head")
        self._form += line if mark is None else bytes((MARK, mark)) + b"\n"
        return line.decode("utf-8", "replace").strip()

    def _read_head(self) -> bool:
        """Read a head line by line; False at the end of the file. Raises DumpError naming the
        line."""
        if self._scan.at == len(self._kept) and not self._more():
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
                step = self._whole("step", STEP, LARGEST_STEP)
                self.check_step(self._where, self._scan.last, step)
            elif item == "TIME" and time is None:
                time = self._number(self._line(TIME), "time")
            elif item == "UNITS":
                units = self._line()
                self.check_units(self._where, units)
            elif item == f"NUMBER OF {self._kind}" and step >= 0 and count < 0:
                count = self._whole("rows", COUNT, LARGEST_WHOLE)
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

    def _whole(self, what: str, mark: int, most: int) -> int:
        word = self._line(mark)
        return whole_number(word, f"{self._where}: {what}", least=0, most=most)

    def _number(self, word: str, what: str) -> float:
        if not NUMBER.fullmatch(word) or not abs(float(word)) <= LARGEST_LENGTH:
            raise DumpError(f"{self._where}: {what}: {word[:40]!r} is not a number")
        return float(word)
