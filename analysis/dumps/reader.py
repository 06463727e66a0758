"""Body dumps: opened as an MDAnalysis Universe, the disks of a frame, and those of many frames at once."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from analysis.dumps.frame import LARGEST_LENGTH, UNITS, BodyColumns, DumpError
from analysis.dumps.index import WORDS, DumpIndex, index_dump
from analysis.support.reading import UnreadableError, read_text
from nscd import Snapshot
from nscd.arrays import LARGEST, Floats, Indices

if TYPE_CHECKING:
    from MDAnalysis import Universe
    from MDAnalysis.coordinates.timestep import Timestep


POSITIVE, ANY = ("radius", "mass"), ("vx", "vy", "drive_x", "drive_y")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bodies:
    """Hold the n disks of f frames, one frame behind the other.

    start: (f+1,) the first disk of each frame, and the end
    steps: (f,) of the simulation
    times: (f,) s, NaN where they are not known
    ids: (n,) rising in each frame
    position, velocity: (n,2) m, m/s; velocities are 0 where the dump has none
    radius, mass: (n,) m, kg
    drive: (n,2) N, where the dump has it"""

    start: Indices
    steps: tuple[int, ...]
    times: Floats
    ids: Indices
    position: Floats
    velocity: Floats
    radius: Floats
    mass: Floats
    drive: Floats | None

    def __len__(self) -> int:
        return len(self.steps)

    def snapshot(self, number: int) -> Snapshot:
        """Take one frame, as `snapshot_of` does but for spins."""
        those = slice(*self.start[number : number + 2].tolist())
        time = float(self.times[number])
        return Snapshot(
            position=self.position[those],
            velocity=self.velocity[those],
            radius=self.radius[those],
            mass=self.mass[those],
            ids=self.ids[those],
            time=time if np.isfinite(time) else 0.0,
            drive=None if self.drive is None else self.drive[those],
        )


def bodies_of(
    columns: BodyColumns,
    index: DumpIndex,
    numbers: range,
    text: bytes,
    time_step: float,
    needs_velocity: bool,
) -> Bodies | None:
    """Read frames that follow each other from their text, see `DumpIndex.text`.

    time_step: s, of the simulation; NaN where it is not known

    None where anything is not as usual: the reader of single frames reads it, or says what is
    wrong."""
    frames = index.frames[numbers.start :][: len(numbers)]
    if columns.scaled or WORDS & set(index.columns):
        return None
    table = index.numbers(numbers, text)
    if table is None or not np.isfinite(table).all():
        return None
    start = np.concatenate([[0], np.cumsum([frame.rows for frame in frames])])
    ids = table[:, columns.names.index("id")]
    if not ((ids >= 1) & (ids < 2**31) & (ids == np.floor(ids))).all():
        return None
    within = np.ones(len(ids), bool)
    within[start[:-1][np.diff(start) > 0]] = False
    if (np.diff(ids) <= 0)[within[1:]].any():
        order = np.lexsort((ids, np.repeat(np.arange(len(frames)), np.diff(start))))
        table, ids = table[order], ids[order]
        if (np.diff(ids) == 0)[within[1:]].any():
            return None
    data = columns.quantities(table, frames[0])
    if ("vx" not in data and needs_velocity) or not _usual(data):
        return None
    known = [time_step * frame.step if frame.time is None else frame.time for frame in frames]
    pair = {
        name: np.column_stack([data[x], data[y]])
        for name, x, y in (
            ("position", "x", "y"),
            ("velocity", "vx", "vy"),
            ("drive", "drive_x", "drive_y"),
        )
        if x in data
    }
    return Bodies(
        start=start,
        steps=tuple(frame.step for frame in frames),
        times=np.array(known),
        ids=ids.astype(np.int64),
        position=pair["position"],
        velocity=pair.get("velocity", np.zeros((len(ids), 2))),
        radius=np.ascontiguousarray(data["radius"]),
        mass=np.ascontiguousarray(data["mass"]),
        drive=pair.get("drive"),
    )


def _usual(data: dict[str, Floats]) -> bool:
    """Whether numbers are ones that can be computed with, in one plane."""
    far = max(np.abs(data[name]).max(initial=0.0) for name in "xyz")
    least = min(data[name].min(initial=1.0) for name in POSITIVE)
    most = max(np.abs(data[name]).max(initial=0.0) for name in (*POSITIVE, *ANY) if name in data)
    flat = bool(np.ptp(data["z"]) == 0.0) if len(data["z"]) else True
    return bool(far <= LARGEST_LENGTH and least >= 1 / LARGEST and most <= LARGEST and flat)


RECORD = "run.json"


def open_bodies(
    path: str | Path, time_step: float | None = None, unit: str | None = None
) -> Universe:
    """Open a body dump as an MDAnalysis Universe.

    time_step: s, of the simulation; that of run.json beside the dump where left out. Without
        either, and without ITEM: TIME in the dump, times are NaN
    unit: of lengths, and of velocities per second: m, cm or mm; m where left out, and then radii of
        which half are above 2 m are refused, but in a run of an engine here. Masses are kg

    Raises DumpError naming the file and the line, step, column or key.

    >>> universe = open_bodies("out/gate/lammps_hooke_k1e+06/bodies.dump")
    >>> universe.atoms.n_atoms, round(universe.trajectory[-1].time, 6)  # s
    (55, 2.0)
    """
    # imported when first needed: an engine that only writes dumps starts a third of a second sooner
    from MDAnalysis import Universe

    from analysis.dumps.bodies_reader import BodiesReader

    path = Path(path)
    if time_step is None:
        time_step = _recorded_time_step(path)
    elif not 0 < time_step <= LARGEST:
        raise DumpError(
            f"time_step: {time_step} s; a finite time above 0, at most {LARGEST:g}, is needed"
        )
    if unit not in (None, *UNITS):
        raise DumpError(f"unit: {unit!r}; there are: {', '.join(UNITS)}")
    if (path.parent / RECORD).exists():
        unit = unit or "m"
    index = index_dump(path)
    universe = Universe.empty(max(1, *index.counts), trajectory=False)
    universe.load_new(str(path), format=BodiesReader, dt=time_step, index=index, unit=unit)
    return universe


def _recorded_time_step(dump: Path) -> float:
    """The time step (s) in run.json beside a dump, NaN where there is none."""
    record = dump.parent / RECORD
    if not record.exists():
        return math.nan
    try:
        content = json.loads(read_text(record))
        step = content["time_step_s"]
    except UnreadableError as error:
        raise DumpError(str(error)) from None
    except (ValueError, KeyError, TypeError, RecursionError):
        raise DumpError(f"{record}: time_step_s: missing; not the record of a run") from None
    if isinstance(step, bool) or not isinstance(step, int | float) or not 0 < step < math.inf:
        raise DumpError(f"{record}: time_step_s: {step!r}; a finite time above 0 s is needed")
    return float(step)


def snapshot_of(ts: Timestep, path: str | Path = "", *, needs_velocity: bool = True) -> Snapshot:
    """Take the disks of the current frame, ids in increasing order.

    needs_velocity: whether a dump without vx, vy is refused; else they are 0

    Spins are 0 and drives None where the dump has none; the time is 0 where it is not known. Raises
    DumpError naming the step and the field."""
    data = ts.data
    if "radius" not in data or "mass" not in data or "id" not in data:
        raise DumpError(
            f"{path or 'this trajectory'}: no float64 columns id, x, y, radius, mass: open the "
            "dump with analysis.dumps.open_bodies(path) and give that universe"
        )
    if needs_velocity and "vx" not in data:
        raise DumpError(f"{path}: missing columns: vx, vy; the velocities at this instant count")
    none = np.zeros(len(data["id"]))
    drive = np.column_stack([data["drive_x"], data["drive_y"]]) if "drive_x" in data else None
    try:
        return Snapshot(
            position=np.column_stack([data["x"], data["y"]]),
            velocity=np.column_stack([data.get("vx", none), data.get("vy", none)]),
            radius=data["radius"],
            mass=data["mass"],
            ids=data["id"].astype(np.int64),
            spin=data.get("omegaz", none),
            time=float(ts.time) if math.isfinite(ts.time) else 0.0,
            drive=drive,
        )
    except ValueError as error:
        raise DumpError(f"{path}, step {data['step']}: {error}") from None


def frame_at(times: Sequence[float] | Floats, wanted: float) -> int:
    """Find the frame nearest to a time (s)."""
    return int(np.argmin(np.abs(np.asarray(times) - wanted)))
