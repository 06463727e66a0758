"""Body dumps in MDAnalysis: every column in float64, id order, whatever the row order."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from MDAnalysis.coordinates.base import ReaderBase
from MDAnalysis.coordinates.timestep import Timestep

from analysis.dumps.bodies import Bodies, bodies_of
from analysis.dumps.frame import FLAT, LARGEST_LENGTH, UNITS, BodyColumns, DumpError, Frame
from analysis.dumps.index import WORDS, DumpIndex, index_dump
from nscd.arrays import Floats

# What begins so are columns of a user's own computes, fixes and variables.
COMPUTED = ("c_", "f_", "v_")
# Where half of the disks have a larger radius (m), the dump may be in another unit.
LARGEST_PERSON = 2.0


class BodiesReader(ReaderBase):  # type: ignore[misc]
    """Read body dumps for MDAnalysis: every column in float64 and id order in `ts.data`.

    MDAnalysis' own reader of this format rounds positions to float32, shifts them by the box corner
    and needs z. Its `dt` is the time between steps (the LAMMPS time step); times are step · dt, or
    those of ITEM: TIME where the dump has them. The number of disks may change from frame to frame:
    `ts.data` holds those that are there, `n_atoms` is the largest number and surplus `positions`
    are NaN."""

    format = "CROWD_BODIES"
    units = {"time": None, "length": None, "velocity": None}  # noqa: RUF012  (MDAnalysis' protocol)

    def __init__(
        self,
        filename: Any,
        *,
        index: DumpIndex | None = None,
        unit: str | None = None,
        **kwargs: Any,
    ) -> None:
        super().__init__(str(filename), **kwargs)
        self._index = index or index_dump(Path(self.filename))
        length = UNITS[unit or "m"]
        self._columns = BodyColumns.of(self._index.path, self._index.columns, length)
        self.n_atoms = max(self._index.counts)
        if not self.n_atoms:
            raise DumpError(f"{self.filename}: no disk in any frame")
        self.ts = self._Timestep(self.n_atoms, **self._ts_kwargs)
        self._read_frame(0)
        middle = float(np.median(self.ts.data["radius"])) if len(self.ts.data["radius"]) else 0.0
        if unit is None and middle > LARGEST_PERSON:
            raise DumpError(
                f"{self.filename}: radius: {middle:g} m in the middle, which is no person; say the "
                "unit of its lengths: m, cm or mm (--unit)"
            )

    @property
    def steps(self) -> tuple[int, ...]:
        """The step of each frame."""
        return self._index.steps

    @property
    def n_frames(self) -> int:
        """The number of frames."""
        return len(self._index.frames)

    @property
    def index(self) -> DumpIndex:
        """Where the frames are."""
        return self._index

    def bodies(self, numbers: range, text: bytes, needs_velocity: bool) -> Bodies | None:
        """Read frames from their text, as `bodies_of` does; the present frame stays."""
        return bodies_of(self._columns, self._index, numbers, text, self.ts.dt, needs_velocity)

    def _read_frame(self, number: int) -> Timestep:
        frame = self._index.frames[number]
        table = self._index.table(number)
        ids = self._index.ids(number, table[:, self._columns.names.index("id")])
        order = np.argsort(ids, kind="stable")
        if (twice := np.flatnonzero(np.diff(ids[order]) == 0)).size:
            raise DumpError(
                f"{self.filename}, {frame.where(order[twice[0] + 1])}: "
                f"id {ids[order[twice[0]]]} occurs twice at step {frame.step}"
            )
        ts, data = self.ts, self._columns.quantities(table[order], frame)
        for name in ("x", "y", "z"):
            if not (far := np.abs(data[name]) <= LARGEST_LENGTH).all():
                row = int(np.argmin(far))
                raise DumpError(
                    f"{self.filename}, {frame.where(order[row])}: {name}: "
                    f"{data[name][row]:g} m: a finite place is needed"
                )
        self._refuse_damage(table, frame)
        z, smallest = data["z"], float(np.abs(data["radius"]).min(initial=math.inf))
        height = float(np.ptp(z)) if len(z) else 0.0
        if height != 0 and not height <= FLAT * smallest:
            highest = order[int(np.argmax(z))]
            raise DumpError(
                f"{self.filename}, {frame.where(highest)}: z from {z.min():g} to {z.max():g}: "
                "disks in three dimensions; only crowds in one plane are read here"
            )
        ts.frame = number
        ts.data.update(data, step=frame.step)
        ts.data["time"] = frame.step * ts.dt if frame.time is None else frame.time
        places = np.full((self.n_atoms, 3), np.nan)
        places[: len(ids)] = np.column_stack([data["x"], data["y"], z])
        ts.positions = places
        return ts

    def _refuse_damage(self, table: Floats, frame: Frame) -> None:
        """Refuse what is no number in columns of LAMMPS; those that a user computes may have
        none."""
        for row, column in np.argwhere(~np.isfinite(table)):
            name = self._columns.names[column]
            if name not in WORDS and not name.startswith(COMPUTED):
                raise DumpError(
                    f"{self.filename}, {frame.where(row)}: {name}: {table[row, column]:g}: "
                    "a finite number is needed"
                )

    def _read_next_timestep(self, ts: Timestep | None = None) -> Timestep:
        if self.ts.frame + 1 >= self.n_frames:
            raise OSError("no next frame")
        return self._read_frame(self.ts.frame + 1)

    def _reopen(self) -> None:
        self.ts.frame = -1

    def close(self) -> None:
        """Close nothing: the file stays open until others have been read."""
