"""The disks of a dump: what its columns mean, and the bodies of many frames at once, checked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.dumps.find_frames import LARGEST_LENGTH, DumpError
from analysis.dumps.index import DumpIndex
from analysis.dumps.last_digits import LEAST_PLACE, Digits, LastDigit, largest_of
from analysis.scene.lammps_data import volumes
from analysis.support.reading import LARGEST_WHOLE
from nscd import Snapshot
from nscd.arrays import LARGEST, Floats, Indices

# Names of a place, best first, and whether they are shares of the box.
PLACES = ((("x", "y", "z"), False), (("xu", "yu", "zu"), False), (("xs", "ys", "zs"), True),
          (("xsu", "ysu", "zsu"), True))  # fmt: skip
# Lengths and velocities of a dump that is in another unit, and what 1 of it is in m.
LENGTHS = ("x", "y", "z", "radius", "diameter", "vx", "vy", "shapex", "shapey")
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
# What masses are in, and what 1 of these and of a density beside them is in kg and kg/m³: g/cm³, as
# LAMMPS has it with g.
MASS_UNITS = {"kg": (1.0, 1.0), "g": (1e-3, 1e3)}
# Lengths and masses of the units of LAMMPS that are read, and what 1 of a force in cgs is in N.
SYSTEMS: dict[str, tuple[str, str]] = {"si": ("m", "kg"), "cgs": ("cm", "g")}
DYNE = 1e-5
# Columns that say nothing alone.
PAIRS = (("vx", "vy"), ("fx", "fy"), ("drive_x", "drive_y"))
# Columns of disks that are joined to bodies: its number, and its inertia (kg m²).
JOINED = ("mol", "body_inertia")
# Columns that leave the plane, and what of them is rounding; diameters.
OUT_OF_PLANE, IN_PLANE = ("vz", "omegax", "omegay"), 1e-9
DIAMETERS = ("diameter", "shapex", "shapey")
# Columns that are used where they are there, beside those of places.
USED = {"id", "radius", "mass", "density", "vx", "vy", "omegaz", "drive_x", "drive_y",
        *OUT_OF_PLANE, *DIAMETERS}  # fmt: skip
# Two columns that state one fact may differ by this share, or by this share of the box: rounding.
SAME, SAME_PLACE = 1e-3, 1e-4
# Heights may differ by this share of the smallest radius: rounding, not a third dimension.
FLAT = 1e-6
# Disks that are fixed may move by this share of their radius: rounding.
STILL = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Stated:
    """Hold what a user says of a dump, and the dump of itself; see `open_bodies`."""

    unit: str | None = None
    mass_unit: str | None = None
    fixed_type: tuple[int, ...] = ()
    mol: str | None = None

    def within(self, index: DumpIndex) -> Stated:
        """Add what the dump says of itself. Raises DumpError where it contradicts, or lacks a column."""
        own = SYSTEMS.get(index.units, (None, None))
        for name, message, inputs in zip(
            ("unit", "mass_unit"), own, (self.unit, self.mass_unit), strict=True
        ):
            if message and inputs not in (None, message):
                raise DumpError(
                    f"{index.path}: {name} {inputs}, and its own units are {index.units}"
                )
        unit, mass_unit = self.unit or own[0], self.mass_unit or own[1]
        if mass_unit is None and unit == "cm" and "mass" not in index.columns:
            mass_unit = "g"  # beside cm a density is in g/cm³
        for column, wanted in (("type", bool(self.fixed_type)), ("mol", self.mol == "rigid")):
            if wanted and column not in index.columns:
                raise DumpError(f"{index.path}: missing columns: {column}")
        return replace(self, unit=unit, mass_unit=mass_unit)


@dataclass(frozen=True, slots=True, eq=False)
class FixedDisks:
    """Hold disks that do not move: ids (m,), position (m,2) m, radius (m,) m."""

    ids: Indices
    position: Floats
    radius: Floats

    def __len__(self) -> int:
        return len(self.ids)

    def stays(self, now: FixedDisks) -> bool:
        """Tell whether these are the same disks at the same places."""
        if not np.array_equal(self.ids, now.ids):
            return False
        off = np.abs(self.position - now.position).max(axis=1, initial=0.0)
        return bool((off <= STILL * self.radius).all())

    def behind(self, snapshot: Snapshot) -> Snapshot:
        """Make a snapshot of the disks of another one and these, of 1 kg, behind them; all at rest."""
        parts: dict[str, Any] = {"mass": np.concatenate([snapshot.mass, np.ones(len(self))])}
        for name in ("ids", "position", "radius"):
            parts[name] = np.concatenate([getattr(snapshot, name), getattr(self, name)])
        return Snapshot(**parts)


@dataclass(frozen=True, slots=True)
class BodyColumns:
    """Find the columns that a body needs among those of a dump.

    fixed_disks: as the first frame has them that was read"""

    index: DumpIndex
    place: tuple[str, str, str]  # names of x, y, z (z: may be missing)
    scaled: bool  # whether these are shares of the box
    stated: Stated
    fixed_disks: list[FixedDisks] = field(default_factory=list)

    @classmethod
    def of(cls, index: DumpIndex, stated: Stated | None = None) -> BodyColumns:
        """Raise DumpError naming the columns that are missing."""
        has = set(index.columns)
        position, scaled = next(
            ((location, scaled) for location, scaled in PLACES if {*location[:2]} <= has), PLACES[0]
        )
        missing = [name for name in ("id", *position[:2]) if name not in has]
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
        return cls(index, position, scaled, (stated or Stated()).within(index))

    @property
    def unit(self) -> float:
        """Give the unit of lengths, and of velocities per second, in m."""
        return UNITS[self.stated.unit or "m"]

    @property
    def used(self) -> set[str]:
        """Name the columns that change what is read, or may refuse it."""
        stated, joined = self.stated, {*JOINED} <= {*self.index.columns}
        names = USED.union(*(position for position, _ in PLACES), {"type"} if stated.fixed_type else ())
        rigid = stated.mol == "rigid" or (joined and stated.mol is None)
        return names | {*JOINED} if rigid else names

    def digits(self) -> Digits | None:
        """Say how exact the text of places and radii is. None where it is exact, or binary."""
        words = dict(zip(self.index.columns, zip(*self.index.sample, strict=True), strict=False))
        sizes = next((words[name] for name in ("radius", "diameter") if name in words), ())
        position = LastDigit.of([word for name in self.place[:2] for word in words.get(name, ())])
        if position is None:
            return None
        ends = [(*one.low, *one.high) for one in self.index.frames] if self.scaled else []
        box = max((self.unit * max(x1 - x0, y1 - y0) for x0, y0, x1, y1 in ends), default=None)
        # radii that are exact by themselves were written with as many digits as places
        alone = LastDigit(position.digits, LEAST_PLACE, largest_of(sizes))
        return Digits(position, LastDigit.of(sizes) or alone, self.unit, box)

    def checked(self, numbers: range, table: Floats) -> tuple[dict[str, Floats], Indices]:
        """Name the columns of the tables of some frames, one below the other, with x, y (m), z,
        radius (m), mass (kg) among them; ids rise in each frame. Fixed disks are left out. Beside it,
        how many rows each frame has.

        Raises DumpError naming the first row with an id that is none or occurs twice, a place or a
        number that is used and not finite, facts that contradict, what is no disk in one plane, and
        fixed disks that move."""
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
        if not np.isfinite(table).all():
            for name in [name for name in names if name in self.used]:
                bad = ~np.isfinite(data[name])
                index.refuse(numbers, bad, f"{name}: ", data[name], ": a finite number is needed")
        # heights of each frame, where there are any
        for frame in range(len(frames)) if len(ids) and np.ptp(data["z"]) != 0 else ():
            mine = frame_of == frame
            z, size = data["z"][mine], np.abs(data["radius"][mine]).min(initial=math.inf)
            if len(z) and not np.ptp(z) <= FLAT * size:
                where = f"z from {z.min():g} to {z.max():g}: disks in three dimensions"
                high = mine & (data["z"] == z.max())
                index.refuse(numbers, high, f"{where}. Only crowds in one plane are read here")
        self._refuse_others(numbers, data)
        counts = np.array([frame.rows for frame in frames])
        if self.stated.fixed_type:
            order, counts = self._moving(numbers, data, order, frame_of)
        return {name: column[order] for name, column in data.items()}, counts

    def _moving(
        self, numbers: range, data: Mapping[str, Floats], order: Indices, frame_of: Indices
    ) -> tuple[Indices, Indices]:
        """Take those rows of an order that are not fixed, and count them in each frame. Raises DumpError
        where the others are not those of the first frame."""
        fixed = np.isin(data["type"], self.stated.fixed_type)
        moves = fixed & ((data.get("vx", fixed * 0.0) != 0) | (data.get("vy", fixed * 0.0) != 0))
        self.index.refuse(numbers, moves, "a disk of a fixed type has a velocity")
        for frame in range(len(numbers)):
            rows = order[fixed[order] & (frame_of[order] == frame)]
            position = np.column_stack([data["x"][rows], data["y"][rows]])
            now = FixedDisks(data["id"][rows].astype(np.int64), position, data["radius"][rows])
            if not self.fixed_disks:
                if not set(self.stated.fixed_type) <= set(data["type"]):
                    raise DumpError(f"{self.index.path}: type: no disk of a fixed type is there")
                self.fixed_disks.append(now)
            if not self.fixed_disks[0].stays(now):
                where = f"{self.index.path}, step {self.index.steps[numbers[frame]]}"
                raise DumpError(
                    f"{where}: disks of a fixed type are others, or elsewhere, than before"
                )
        free = order[~fixed[order]]
        return free, np.bincount(frame_of[free], minlength=len(numbers))

    def _refuse_others(self, numbers: range, data: Mapping[str, Floats]) -> None:
        """Raise DumpError naming the row of a diameter that is not twice the radius, and of what is out of
        the plane."""
        for name in (name for name in DIAMETERS if name in data):
            bad = ~(np.abs(data[name] - 2 * data["radius"]) <= SAME * data[name])
            bad &= data[name] != 0  # as LAMMPS writes the shape of what has none
            message = ", which is not twice its radius. Disks are read here"
            self.index.refuse(numbers, bad, f"{name}: ", data[name], message)
        for name in (name for name in OUT_OF_PLANE if name in data):
            out = ": motion out of the plane. Only crowds in it are read here"
            bad = np.abs(data[name]) > IN_PLANE
            self.index.refuse(numbers, bad, f"{name}: ", data[name], out)

    def _quantities(self, numbers: range, table: Floats, frame_of: Indices) -> dict[str, Floats]:
        """All columns of tables; a density is that of a sphere, as LAMMPS writes it."""
        data = dict(zip(self.index.columns, table.T, strict=True))
        data["x"], data["y"] = self._positions(numbers, data, frame_of)
        data["z"] = data.get(self.place[2], np.zeros(len(table)))
        data.setdefault("radius", 0.5 * data.get("diameter", np.empty(0)))
        if self.unit != 1.0:
            data |= {name: self.unit * data[name] for name in LENGTHS if name in data}
        kg, kg_per_m3 = MASS_UNITS[self.stated.mass_unit or "kg"]
        stated = kg * data["mass"] if "mass" in data else None
        if "density" in data:
            data["mass"] = kg_per_m3 * data["density"] * volumes(data["radius"])
        if stated is not None:
            other, data["mass"] = data.get("mass", stated) if "density" in data else stated, stated
            bad = np.abs(stated - other) > SAME * stated
            self.index.refuse(numbers, bad, "mass: ", stated, " kg contradicts density beside it")
        if self.index.units == "cgs":
            data |= {name: DYNE * data[name] for name in PAIRS[2] if name in data}
        if self.stated.mol == "single":
            data.pop("body_inertia", None)
        elif self.stated.mol == "rigid" and "body_inertia" not in data:
            data["mol"] = np.where(data["mol"] > 0, data["mol"], LARGEST_WHOLE + data["id"])
            data["body_inertia"] = np.full(len(table), np.nan)
        return data

    def _positions(
        self, numbers: range, data: Mapping[str, Floats], frame_of: Indices
    ) -> list[Floats]:
        """Give x and y, in the unit of the dump. Raises DumpError naming the row where two columns of
        them contradict, but for periods."""
        every = [(names, scaled) for names, scaled in PLACES if {*names[:2]} <= {*data}]
        if len(every) == 1 and not self.scaled:
            return [data[name] for name in self.place[:2]]
        frames = self.index.frames[numbers.start : numbers.stop]
        box = np.array([(*frame.low, *frame.high) for frame in frames])[frame_of].T
        found: list[Floats] = []
        for names, scaled in every:
            for axis, name in enumerate(names[:2]):
                low, side = box[axis], box[axis + 2] - box[axis]
                with np.errstate(over="ignore", invalid="ignore"):  # what is too far is refused
                    position = low + data[name] * side if scaled else data[name]
                    if len(found) < 2:
                        found.append(position)
                        continue
                    off = position - found[axis]
                    if axis == 0 and self.index.periodic:
                        off = off - side * np.round(off / side)
                message = f" contradicts {self.place[axis]} beside it"
                bad = ~(np.abs(off) <= SAME_PLACE * side)
                self.index.refuse(numbers, bad, f"{name}: ", data[name], message)
        return found


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

    joined: (n,2) the number of the body that each disk is joined to, and its inertia (kg m²), NaN
        where it is that of its disks"""
    try:
        snapshot = Snapshot(**state, time=time if math.isfinite(time) else 0.0)
        if joined is None:
            return snapshot
        _, first = np.unique(joined[:, 0], return_index=True)
        inertia = joined[first, 1]
        values = None if np.isnan(inertia).any() else inertia
        return snapshot.joined(joined[:, 0].astype(np.int64), inertia=values)
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
        data, counts = columns.checked(numbers, index.numbers(numbers, text))
        found = cls(
            path=index.path,
            start=np.cumsum([0, *counts]),
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
