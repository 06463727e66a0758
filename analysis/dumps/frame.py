"""A frame of a dump, what every reader of frames refuses, and what is said of a dump that cannot be
used."""

import re
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

LARGEST_STEP = 2**62
# Lengths (m) and times (s) beyond this are damage, and no places for MDAnalysis' float32.
LARGEST_LENGTH = 1e30


class DumpError(ValueError):
    """Refuse a dump that cannot be used; the message names the file and the line, step or
    column."""


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

    def check_step(self, where: str, before: int, step: int) -> None:
        """Refuse steps that do not grow."""
        if not before < step <= LARGEST_STEP:
            raise DumpError(
                f"{where}: step {step} follows step {before}. Frames must be in order, each once"
            )

    def check_units(self, where: str, units: str) -> None:
        """Refuse units that are not si."""
        if units != "si":
            raise DumpError(f"{where}: units {units[:40]}. Only si is read here")

    def check_box(self, where: str, triclinic: bool, flags: Sequence[str]) -> None:
        """Refuse a box that is not along x and y, or periodic there, where contacts across its boundary
        would be missed: unless scene.toml beside it has the period along x."""
        if triclinic:
            raise DumpError(f"{where}: a triclinic box. Only boxes along x and y are read here")
        for axis, flag in zip("xy", flags, strict=False):
            if "p" in flag and not (axis == "x" and self.has_period):
                raise DumpError(
                    f"{where}: the box is periodic in {axis} ({' '.join(flags)}): contacts across "
                    "its boundary would be missed. Write the dump with boundary f or s in x and y. Or "
                    "put a scene.toml with period_x_m beside it"
                )

    @cached_property
    def has_period(self) -> bool:
        """Whether scene.toml beside the dump has a period along x."""
        beside = self.path.parent / "scene.toml"
        return beside.is_file() and bool(
            re.search(r"^period_x_m\s*=", beside.read_text(encoding="utf-8"), re.MULTILINE)
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
