"""The disks of many frames at once, from their text."""

from dataclasses import dataclass

import numpy as np

from analysis.dumps.frame import LARGEST_LENGTH, BodyColumns
from analysis.dumps.index import WORDS, DumpIndex
from nscd import Snapshot
from nscd.arrays import LARGEST, Floats, Indices

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
