"""The head of a frame, read line by line: whatever LAMMPS may write there, and what is wrong with
it."""

from __future__ import annotations

import re
from pathlib import Path

from analysis.dumps.frame import LARGEST_LENGTH, LARGEST_STEP, DumpError, Frame
from analysis.support.reading import LARGEST_WHOLE, NUMBER, Lines, next_line, whole_number

# In the form of a head a line of values is this mark, which no text has, and what is in the line.
# All other lines are in it as they are.
MARK = 0
STEP, TIME, COUNT, BOX = b"stcb"


class Heads:
    """Reads heads of frames at wherever the file is.

    line: number of lines that were read so far
    step_line: that of the last step
    form: of the last head: its lines, those of values being marked
    """

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
