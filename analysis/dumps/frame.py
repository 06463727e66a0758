"""A frame of a dump, what its columns mean, and what is said of a dump that cannot be used."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from analysis.scene.lammps_data import SPHERE
from nscd.arrays import Floats

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


# Names of a place, best first, and whether they are shares of the box.
PLACES = ((("x", "y", "z"), False), (("xu", "yu", "zu"), False), (("xs", "ys", "zs"), True),
          (("xsu", "ysu", "zsu"), True))  # fmt: skip
# Lengths and velocities of a dump that is in another unit, and what 1 of it is in m.
LENGTHS = ("x", "y", "z", "radius", "diameter", "vx", "vy")
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
# Columns that say nothing alone.
PAIRS = (("vx", "vy"), ("fx", "fy"), ("drive_x", "drive_y"))
# Heights may differ by this share of the smallest radius: rounding, not a third dimension.
FLAT = 1e-6


@dataclass(frozen=True, slots=True)
class BodyColumns:
    """Find the columns that a body needs among those of a dump."""

    names: tuple[str, ...]  # all columns, in order
    place: tuple[str, str, str]  # names of x, y, z (z: may be missing)
    scaled: bool  # whether these are shares of the box
    unit: float = 1.0  # of lengths and of velocities per second, in m

    @classmethod
    def of(cls, path: Path, names: tuple[str, ...], unit: float = 1.0) -> BodyColumns:
        """Raise DumpError naming the columns that are missing."""
        has = set(names)
        place, scaled = next(
            ((place, scaled) for place, scaled in PLACES if {*place[:2]} <= has), PLACES[0]
        )
        missing = [name for name in ("id", *place[:2]) if name not in has]
        missing += [] if {"radius", "diameter"} & has else ["radius"]
        missing += [] if {"mass", "density"} & has else ["mass (or density)"]
        missing += [
            name for pair in PAIRS if len({*pair} & has) == 1 for name in pair if name not in has
        ]
        if missing:
            raise DumpError(
                f"{path}: missing columns: {', '.join(missing)}; it has: {' '.join(names)}"
            )
        return cls(names, place, scaled, unit)

    def quantities(self, table: Floats, frame: Frame) -> dict[str, Floats]:
        """Name the columns of a table (rows, columns), with x, y (m), z, radius (m), mass (kg)
        among them. A density is that of a sphere, as LAMMPS writes it."""
        data = dict(zip(self.names, table.T, strict=True))
        places = [data[name] for name in self.place[:2]]
        if self.scaled:
            with np.errstate(over="ignore"):  # the reader refuses what is too far
                places = [
                    low + share * (high - low)
                    for share, low, high in zip(places, frame.low, frame.high, strict=True)
                ]
        data["x"], data["y"] = places
        data["z"] = data.get(self.place[2], np.zeros(len(table)))
        data.setdefault("radius", 0.5 * data.get("diameter", np.empty(0)))
        if self.unit != 1.0:
            data |= {name: self.unit * data[name] for name in LENGTHS if name in data}
        if "mass" not in data:
            data["mass"] = data["density"] * SPHERE * data["radius"] ** 3
        return data
