"""Impulses over windows of time: what each pair and each wall of a run received, and the crowd
then."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.dumps.find_frames import DumpError
from analysis.dumps.index import DumpIndex, index_dump
from analysis.dumps.open_dump import open_bodies, snapshot_of
from analysis.scene.rigid_bodies import people_of
from analysis.support.write_frames import IMPULSE_COLUMNS
from nscd import Snapshot
from nscd.arrays import Floats, Indices, Mask

HOW = "Run the scene again with --impulses"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Window:
    """Hold what a window of a run passed on.

    keys: (k,3) id of a disk; id of the other, or number of the wall from 1; 1 for a wall, else 0;
        rising, each once
    disks: of a window of people that of the disks of their bodies"""

    start: float  # s
    end: float  # s
    now: Snapshot  # the crowd at its end
    keys: Indices
    impulse: Floats  # (k,2) N·s, of the first on the second
    disks: Window | None = None

    @property
    def duration(self) -> float:
        """Give the length of the window (s)."""
        return self.end - self.start

    @property
    def is_wall(self) -> Mask:
        """(k,): whether the second is a wall."""
        wall: Mask = self.keys[:, 2] == 1
        return wall

    @property
    def force(self) -> Floats:
        """(k,) N: the magnitude of each impulse over the time."""
        return np.asarray(np.hypot(*self.impulse.T) / self.duration)

    def of_people(self) -> Window:
        """Give the window of people, two of whom may have several keys: those of their disks."""
        people, of = people_of(self.now)
        if people is self.now:
            return self
        wall, who = self.is_wall, people.ids[of]
        rank = np.searchsorted(
            self.now.ids, np.where(wall[:, None], self.keys[:, :1], self.keys[:, :2])
        )
        first, second = who[rank].T
        turned = ~wall & (first > second)
        keys = np.column_stack(
            [
                np.where(turned, second, first),
                np.where(wall, self.keys[:, 1], np.where(turned, first, second)),
                wall,
            ]
        )
        impulse = np.where(turned[:, None], -self.impulse, self.impulse)
        return replace(self, now=people, keys=keys, impulse=impulse, disks=self)

    def of_pairs(self) -> Window:
        """Give the window without walls."""
        pairs = ~self.is_wall
        return replace(self, keys=self.keys[pairs], impulse=self.impulse[pairs])

    def summed(self) -> Window:
        """Give the window with each key once."""
        keys, impulse = _summed(self.keys, self.impulse)
        return replace(self, keys=keys, impulse=impulse)


class RunWindows:
    """Give the windows of a run between any two of its frames, each frame being read once."""

    def __init__(self, folder: Path, time_step_s: float) -> None:
        """Open bodies.dump and impulses.dump of a folder. Raises DumpError where either is missing
        or they do not fit each other."""
        path = folder / "impulses.dump"
        if not path.exists():
            raise DumpError(f"{path}: no such file. {HOW}")
        self._index: DumpIndex = index_dump(path, "ENTRIES")
        if self._index.columns != IMPULSE_COLUMNS:
            raise DumpError(f"{path}: columns {' '.join(self._index.columns)}")
        self._bodies: Any = open_bodies(folder / "bodies.dump", time_step_s).trajectory
        if self._bodies.steps != self._index.steps:
            raise DumpError(f"{path}: its steps are not those of bodies.dump beside it")
        if len(self._index.steps) < 2:
            raise DumpError(f"{path}: one frame only. A window is between two")
        self.times: Floats = np.array(self._index.steps) * time_step_s

    def between_frames(self) -> Iterator[Window]:
        """Read the windows from each frame to the next."""
        for number in range(1, len(self.times)):
            yield self.window(number - 1, number)

    def at(self, frame: int) -> Snapshot:
        """Read the crowd at a frame."""
        return snapshot_of(self._bodies[frame])

    def window(self, first: int, last: int) -> Window:
        """Read the window from one frame to a later one."""
        table = np.concatenate([self._index.table(n) for n in range(first + 1, last + 1)])
        keys, impulse = _summed(table[:, :3].astype(np.int64), table[:, 3:5])
        now = self.at(last)
        wall = keys[:, 2] == 1
        if not (np.isin(keys[:, 0], now.ids) & (wall | np.isin(keys[:, 1], now.ids))).all():
            step = self._index.steps[last]
            raise DumpError(
                f"{self._index.path}, step {step}: an impulse of a disk that is not there"
            )
        start, end = float(self.times[first]), float(self.times[last])
        return Window(start=start, end=end, now=now, keys=keys, impulse=impulse)


def joined(parts: Sequence[Window]) -> Window:
    """Join windows that follow each other."""
    keys, impulse = (np.concatenate([getattr(p, n) for p in parts]) for n in ("keys", "impulse"))
    return replace(parts[-1], start=parts[0].start, keys=keys, impulse=impulse).summed()


def _summed(keys: Indices, impulse: Floats) -> tuple[Indices, Floats]:
    """Each key once, rising, with the sum of its impulses."""
    once, index = np.unique(keys, axis=0, return_inverse=True)
    total = np.zeros((len(once), 2))
    np.add.at(total, index.ravel(), impulse)
    return once, total
