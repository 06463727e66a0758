"""Body dumps in MDAnalysis: every column in float64, id order, whatever the row order."""

from pathlib import Path
from typing import Any

import numpy as np
from MDAnalysis.coordinates.base import ReaderBase
from MDAnalysis.coordinates.timestep import Timestep

from analysis.dumps.bodies import Bodies, BodyColumns, FixedDisks, Stated
from analysis.dumps.find_frames import DumpError
from analysis.dumps.index import DumpIndex, index_dump
from analysis.dumps.last_digits import Digits
from analysis.dumps.unused_columns import look_at


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
        stated: Stated | None = None,
        foreign: bool = True,
        **kwargs: Any,
    ) -> None:
        super().__init__(str(filename), **kwargs)
        self._index = index or index_dump(Path(self.filename))
        self._columns = BodyColumns.of(self._index, stated)
        self.n_atoms = max(self._index.counts)
        if not self.n_atoms:
            raise DumpError(f"{self.filename}: no disk in any frame")
        self.ts = self._Timestep(self.n_atoms, **self._ts_kwargs)
        self._read_frame(next(k for k, rows in enumerate(self._index.counts) if rows))
        self.digits: Digits | None = self._columns.digits()
        if foreign:
            look_at(self._columns, self.ts.data)
        if self.ts.frame:
            self._read_frame(0)

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

    @property
    def columns(self) -> BodyColumns:
        """What its columns mean."""
        return self._columns

    @property
    def fixed_disks(self) -> FixedDisks | None:
        """The disks that are fixed, where some are."""
        return next(iter(self._columns.fixed_disks), None)

    def bodies(self, numbers: range, text: bytes, needs_velocity: bool) -> Bodies:
        """Read frames from their text, as `Bodies.read` does; the present frame stays."""
        return Bodies.read(self._columns, numbers, text, self.ts.dt, needs_velocity)

    def _read_frame(self, number: int) -> Timestep:
        frame = self._index.frames[number]
        data, (rows,) = self._columns.checked(range(number, number + 1), self._index.table(number))
        ts = self.ts
        ts.frame = number
        ts.data.update(data, step=frame.step)
        ts.data["time"] = frame.step * ts.dt if frame.time is None else frame.time
        positions = np.full((self.n_atoms, 3), np.nan)
        positions[:rows] = np.column_stack([data["x"], data["y"], data["z"]])
        ts.positions = positions
        return ts

    def _read_next_timestep(self, ts: Timestep | None = None) -> Timestep:
        if self.ts.frame + 1 >= self.n_frames:
            raise OSError("no next frame")
        return self._read_frame(self.ts.frame + 1)

    def _reopen(self) -> None:
        self.ts.frame = -1

    def close(self) -> None:
        """Close nothing: the file stays open until others have been read."""
