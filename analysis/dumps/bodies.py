"""The disks of a dump: what its columns mean, and the bodies of many frames at once, checked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from analysis.dumps.frames import LARGEST_LENGTH, DumpError
from analysis.dumps.index import WORDS, DumpIndex
from analysis.scene.lammps_data import volumes
from nscd import Snapshot
from nscd.arrays import LARGEST, Floats, Indices

# Names of a place, best first, and whether they are shares of the box.
PLACES = ((("x", "y", "z"), False), (("xu", "yu", "zu"), False), (("xs", "ys", "zs"), True),
          (("xsu", "ysu", "zsu"), True))  # fmt: skip
# Lengths and velocities of a dump that is in another unit, and what 1 of it is in m.
LENGTHS = ("x", "y", "z", "radius", "diameter", "vx", "vy")
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
# Columns that say nothing alone.
PAIRS = (("vx", "vy"), ("fx", "fy"), ("drive_x", "drive_y"))
# Columns of disks that are joined to bodies: its number, and its inertia (kg m²).
JOINED = ("mol", "body_inertia")
# What begins so are columns of a user's own computes, fixes and variables.
COMPUTED = ("c_", "f_", "v_")
# Heights may differ by this share of the smallest radius: rounding, not a third dimension.
FLAT = 1e-6


@dataclass(frozen=True, slots=True)
class BodyColumns:
    """Find the columns that a body needs among those of a dump."""

    index: DumpIndex
    place: tuple[str, str, str]  # names of x, y, z (z: may be missing)
    scaled: bool  # whether these are shares of the box
    unit: float = 1.0  # of lengths and of velocities per second, in m

    @classmethod
    def of(cls, index: DumpIndex, unit: float = 1.0) -> BodyColumns:
        """Raise DumpError naming the columns that are missing."""
        has = set(index.columns)
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
                f"{index.path}: missing columns: {', '.join(missing)}. It has: "
                f"{' '.join(index.columns)}"
            )
        return cls(index, place, scaled, unit)

    def checked(self, numbers: range, table: Floats) -> dict[str, Floats]:
        """Name the columns of the tables of some frames, one below the other, with x, y (m), z,
        radius (m), mass (kg) among them; ids rise in each frame.

        Raises DumpError naming the first row with an id that is none or occurs twice, a place or a
        number that is not finite, and disks that are not in one plane."""
        index, names = self.index, self.index.columns
        frames = index.frames[numbers.start : numbers.stop]
        frame_of = np.repeat(np.arange(len(frames)), [frame.rows for frame in frames])
        ids = index.ids(numbers, table[:, names.index("id")])
        order = np.lexsort((ids, frame_of))
        again = np.zeros(len(ids), dtype=bool)
        again[order[1:]] = (np.diff(ids[order]) == 0) & (np.diff(frame_of) == 0)
        if again.any():
            step = frames[frame_of[np.argmax(again)]].step
            index.refuse(numbers, again, "id ", ids, f" occurs twice at step {step}")
        data = self._quantities(numbers, table, frame_of)
        for name in ("x", "y", "z"):
            far = ~(np.abs(data[name]) <= LARGEST_LENGTH)
            index.refuse(numbers, far, f"{name}: ", data[name], " m: a finite place is needed")
        for name, column in () if np.isfinite(table).all() else zip(names, table.T, strict=True):
            # columns that a user computes may have what is no number
            if name not in WORDS and not name.startswith(COMPUTED):
                bad = ~np.isfinite(column)
                index.refuse(numbers, bad, f"{name}: ", column, ": a finite number is needed")
        # heights of each frame, where there are any
        for frame in range(len(frames)) if len(ids) and np.ptp(data["z"]) != 0 else ():
            mine = frame_of == frame
            z, size = data["z"][mine], np.abs(data["radius"][mine]).min(initial=math.inf)
            if len(z) and not np.ptp(z) <= FLAT * size:
                where = f"z from {z.min():g} to {z.max():g}: disks in three dimensions"
                high = mine & (data["z"] == z.max())
                index.refuse(numbers, high, f"{where}. Only crowds in one plane are read here")
        return {name: column[order] for name, column in data.items()}

    def _quantities(self, numbers: range, table: Floats, frame_of: Indices) -> dict[str, Floats]:
        """All columns of tables; a density is that of a sphere, as LAMMPS writes it."""
        data = dict(zip(self.index.columns, table.T, strict=True))
        places = [data[name] for name in self.place[:2]]
        if self.scaled:
            frames = self.index.frames[numbers.start : numbers.stop]
            box = np.array([(*frame.low, *frame.high) for frame in frames])[frame_of].T
            with np.errstate(over="ignore"):  # what is too far is refused
                places = [
                    low + share * (high - low)
                    for share, low, high in zip(places, box[:2], box[2:], strict=True)
                ]
        data["x"], data["y"] = places
        data["z"] = data.get(self.place[2], np.zeros(len(table)))
        data.setdefault("radius", 0.5 * data.get("diameter", np.empty(0)))
        if self.unit != 1.0:
            data |= {name: self.unit * data[name] for name in LENGTHS if name in data}
        if "mass" not in data:
            data["mass"] = data["density"] * volumes(data["radius"])
        return data


def state_of(data: Mapping[str, Any], path: str | Path, needs_velocity: bool) -> dict[str, Any]:
    """Name the arrays of a `Snapshot` of columns; velocities and spins are 0 and drives None where
    there are none. Raises DumpError for missing columns."""
    if needs_velocity and "vx" not in data:
        raise DumpError(f"{path}: missing columns: vx, vy. Velocities now are needed")
    none = np.zeros(len(data["id"]))
    return {
        "ids": data["id"].astype(np.int64),
        "position": np.column_stack([data["x"], data["y"]]),
        "velocity": np.column_stack([data.get("vx", none), data.get("vy", none)]),
        "spin": data.get("omegaz", none),
        "radius": data["radius"],
        "mass": data["mass"],
        "drive": (
            np.column_stack([data["drive_x"], data["drive_y"]]) if "drive_x" in data else None
        ),
    }


def joined_of(data: Mapping[str, Any]) -> Floats | None:
    """Give number and inertia (n,2) of the body of each disk, of columns that have both."""
    return np.column_stack([data[name] for name in JOINED]) if {*JOINED} <= {*data} else None


def snapshot_at(
    state: Mapping[str, Any], time: float, where: str, joined: Floats | None = None
) -> Snapshot:
    """Make a snapshot of arrays at a time (s), 0 where it is NaN. Raises DumpError that begins with
    `where`.

    joined: (n,2) the number and the inertia (kg m²) of the body that each disk is joined to"""
    try:
        snapshot = Snapshot(**state, time=time if math.isfinite(time) else 0.0)
        if joined is None:
            return snapshot
        _, first = np.unique(joined[:, 0], return_index=True)
        return snapshot.joined(joined[:, 0].astype(np.int64), inertia=joined[first, 1])
    except ValueError as error:
        raise DumpError(f"{where}: {error}") from None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bodies:
    """Hold the n disks of f frames, one frame behind the other.

    start: (f+1,) the first disk of each frame, and the end
    steps: (f,) of the simulation
    times: (f,) s, NaN where they are not known
    ids: (n,) rising in each frame
    position, velocity: (n,2) m, m/s; velocities are 0 where the dump has none
    spin: (n,) rad/s, 0 where the dump has none
    radius, mass: (n,) m, kg
    drive: (n,2) N, where the dump has it
    joined: (n,2) see `snapshot_at`, where the dump has it"""

    path: Path
    start: Indices
    steps: tuple[int, ...]
    times: Floats
    ids: Indices
    position: Floats
    velocity: Floats
    spin: Floats
    radius: Floats
    mass: Floats
    drive: Floats | None
    joined: Floats | None

    def __len__(self) -> int:
        return len(self.steps)

    @property
    def time_of_rows(self) -> Floats:
        """Give the time (n,) s of each disk of each frame."""
        return np.repeat(self.times, np.diff(self.start))

    def snapshot(self, number: int) -> Snapshot:
        """Take one frame, as `snapshot_of` does."""
        those = slice(*self.start[number : number + 2].tolist())
        names = ("ids", "position", "velocity", "spin", "radius", "mass")
        state = {name: getattr(self, name)[those] for name in names}
        state["drive"] = None if self.drive is None else self.drive[those]
        where = f"{self.path}, step {self.steps[number]}"
        joined = None if self.joined is None else self.joined[those]
        return snapshot_at(state, float(self.times[number]), where, joined)

    @classmethod
    def read(
        cls,
        columns: BodyColumns,
        numbers: range,
        text: bytes,
        time_step: float,
        needs_velocity: bool = True,
    ) -> Bodies:
        """Read frames that follow each other from their text, see `DumpIndex.text`.

        time_step: s, of the simulation; NaN where it is not known
        needs_velocity: whether a dump without vx, vy is refused

        Raises DumpError naming the line or the step."""
        index = columns.index
        frames = index.frames[numbers.start : numbers.stop]
        data = columns.checked(numbers, index.numbers(numbers, text))
        found = cls(
            path=index.path,
            start=np.cumsum([0, *(frame.rows for frame in frames)]),
            steps=tuple(frame.step for frame in frames),
            times=np.array(
                [time_step * frame.step if frame.time is None else frame.time for frame in frames]
            ),
            **state_of(data, index.path, needs_velocity),
            joined=joined_of(data),
        )
        sizes = np.concatenate([found.radius, found.mass])
        moves = [array for array in (found.velocity, found.drive) if array is not None]
        largest = max(np.abs(array).max(initial=0.0) for array in (sizes, *moves))
        if not (sizes.min(initial=1.0) >= 1 / LARGEST and largest <= LARGEST):
            for number in range(len(found)):  # one of them says what is wrong
                found.snapshot(number)
        return found
