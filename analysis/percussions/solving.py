"""A dump to solve: some of its frames, as rows of a table."""

from __future__ import annotations

import functools
import math
import threading
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from analysis.dumps import DumpError, open_bodies, snapshot_of
from analysis.percussions.at_once import FramesAtOnce, solve_at_once
from analysis.percussions.csv_lines import Column
from analysis.percussions.rows import Rows, rows_of
from analysis.percussions.snapshot import (
    FORCE,
    IMPULSE,
    Setting,
    SnapshotPercussions,
    percussions_of,
)
from analysis.percussions.table import COLUMNS, Openness, columns_of
from nscd import ContactLaw, Snapshot, _core

# Frames are solved in blocks of about so many bytes of the dump, but no more than MOST of them.
BLOCK, MOST = 1 << 22, 64
# The reader of single frames is one for all threads.
_READING = threading.Lock()


@dataclass(frozen=True, slots=True, kw_only=True)
class DumpToSolve:
    """What is to be solved, and how.

    path: of the dump
    time_step: s, of the simulation; see `open_bodies`
    unit: of lengths; see `open_bodies`
    setting: walls, drive, left velocity
    law: of the contacts; inelastic, with the friction of the setting, where left out
    tolerance: residual up to which a frame counts as solved
    openness: what is said of reactions that the mechanics may leave open
    threads: of each large frame
    parquet: whether rows are made for Parquet, not for CSV
    """

    path: Path
    time_step: float | None = None
    unit: str | None = None
    setting: Setting
    law: ContactLaw | None = None
    tolerance: float = 1e-8
    openness: Openness = "determined"
    threads: int = 1
    parquet: bool = False

    @property
    def at_once(self) -> bool:
        """Whether many frames are solved in one compiled call, beside which threads go on."""
        law = self.setting.law if self.law is None else self.law
        small = max(_trajectory(self).index.counts) < _core.SHARED
        return small and law.plain and self.openness == "none"

    def blocks(self, numbers: range) -> list[range]:
        """Cut frames into those that are solved together: the same ones however many work on
        them."""
        frames = _trajectory(self).index.frames
        size = max(1, min(MOST, BLOCK * len(frames) // max(1, frames[-1].end)))
        return [numbers[start : start + size] for start in range(0, len(numbers), size)]

    def read(self, numbers: range) -> bytes | None:
        """Read what `solve` needs of frames that are solved at once."""
        text: bytes | None = _trajectory(self).index.text(numbers) if self.at_once else None
        return text

    def solve(self, numbers: range, text: bytes | None = None) -> list[SolvedRows]:
        """Solve some frames, those of one block.

        text: as `read` gives it; it is read where left out

        Raises DumpError naming file and step."""
        trajectory = _trajectory(self)
        text = self.read(numbers) if text is None else text
        moves = self.setting.moves
        bodies = None if text is None else trajectory.bodies(numbers, text, moves)
        found = None
        if bodies is not None:
            try:
                found = solve_at_once(bodies, self.setting, self.tolerance)
            except ValueError as error:
                raise DumpError(f"{self.path}, step {bodies.steps[0]}: {error}") from None
        if bodies is None or found is None:
            with _READING:
                snapshots = (
                    (
                        int(ts.data["step"]),
                        float(ts.time),
                        snapshot_of(ts, self.path, needs_velocity=moves),
                    )
                    for ts in map(trajectory.__getitem__, numbers)
                )
                return list(self._one_by_one(snapshots))
        solved: list[SolvedRows] = []
        answered = found.found.answered
        first = 0
        while first < len(bodies):
            end = first + 1
            while answered[first] and end < len(bodies) and answered[end]:
                end += 1
            if answered[first]:
                solved.append(self._together(found, first, end))
            else:
                alone = bodies.steps[first], float(bodies.times[first]), bodies.snapshot(first)
                solved += self._one_by_one([alone])
            first = end
        return solved

    def _together(self, found: FramesAtOnce, first: int, end: int) -> SolvedRows:
        """The rows of frames that are answered."""
        said = SolvedDump(unsolved=[])
        for number in range(first, end):
            said.join(
                SolvedDump(
                    frames=1,
                    contacts=int(np.diff(found.found.start[number : number + 2])[0]),
                    largest=found.largest(number),
                    unit=IMPULSE if found.window is None else FORCE,
                    when=_when(found.bodies.steps[number], float(found.bodies.times[number])),
                    residual=float(found.found.residual[number]),
                    unsolved=[],
                )
            )
        return SolvedRows.of(found.columns(first, end), said, self.parquet)

    def _one_by_one(self, snapshots: Iterable[tuple[int, float, Snapshot]]) -> Iterator[SolvedRows]:
        """Solve frames, with their steps and times, one after the other."""
        before: SnapshotPercussions | None = None
        for step, seconds, snapshot in snapshots:
            try:
                found = percussions_of(
                    self.setting,
                    snapshot,
                    self.law,
                    tolerance=self.tolerance,
                    before=before,
                    threads=self.threads,
                )
            except ValueError as error:
                raise DumpError(f"{self.path}, step {step}: {error}") from None
            before, answer = found, found.answer
            known = None if math.isnan(seconds) else seconds
            when = _when(step, seconds)
            why = f"{self.path}, {when}: {answer.status}: {answer.reason}"
            said = SolvedDump(
                frames=1,
                contacts=len(found.contacts),
                largest=found.largest,
                unit=found.unit,
                when=when,
                residual=answer.residual,
                unsolved=[] if answer.status == "solved" else [why],
            )
            cells = columns_of(found, self.openness, time=known, step=step)
            yield SolvedRows.of(cells, said, self.parquet)


def _when(step: int, seconds: float) -> str:
    return f"step {step}" if math.isnan(seconds) else f"{seconds:g} s"


@dataclass(frozen=True, slots=True, kw_only=True)
class SolvedRows:
    """Some solved frames: columns and rows of the table, and what is said of them."""

    columns: list[str]
    rows: Rows
    said: SolvedDump

    @classmethod
    def of(cls, cells: Mapping[str, Column], said: SolvedDump, parquet: bool) -> SolvedRows:
        """Make rows of the columns of all contacts."""
        names = [name for name in COLUMNS if name in cells]
        return cls(columns=names, rows=rows_of(cells, parquet), said=said)


@dataclass(slots=True, kw_only=True)
class SolvedDump:
    """Frames in numbers: how many, their contacts, the largest that a contact carries (in `unit`) and
    when, the worst residual, and a line per frame that is not solved."""

    frames: int = 0
    contacts: int = 0
    largest: float = 0.0
    unit: str = ""
    when: str = ""
    residual: float = 0.0
    unsolved: list[str]

    def join(self, later: SolvedDump) -> None:
        """Count later frames."""
        self.frames += later.frames
        self.contacts += later.contacts
        self.residual = max(self.residual, later.residual)
        if not self.when or later.largest > self.largest:
            self.largest, self.unit, self.when = later.largest, later.unit, later.when
        self.unsolved += later.unsolved


def frames_in(dump: DumpToSolve) -> int:
    """Count the frames of the dump."""
    frames: int = _trajectory(dump).n_frames
    return frames


def _trajectory(dump: DumpToSolve) -> Any:
    """The dump, indexed once in each process, as long as it does not change."""
    try:
        changed = dump.path.stat().st_mtime_ns
    except OSError:
        changed = 0
    return _opened(dump.path, dump.time_step, dump.unit, changed)


@functools.lru_cache(maxsize=1)
def _opened(path: Path, time_step: float | None, unit: str | None, _changed: int) -> Any:
    return open_bodies(path, time_step, unit).trajectory
