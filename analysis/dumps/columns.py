"""What the columns of a body dump mean, whatever they are called."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.dumps.frame import DumpError, Frame
from analysis.scene.lammps_data import SPHERE
from nscd.arrays import Floats

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
    """Find the columns that a body needs among those of a dump.

    names: all columns, in order
    place: names of x, y, z (z: may be missing)
    scaled: whether these are shares of the box
    unit: of lengths and of velocities per second, in m
    """

    names: tuple[str, ...]
    place: tuple[str, str, str]
    scaled: bool
    unit: float = 1.0

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
