"""Percussions of a dump file, written as a table."""

from __future__ import annotations

import dataclasses
import functools
import math
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from analysis.dumps import DumpError, open_bodies, snapshot_of
from analysis.engines.record import FILE, RunRecord
from analysis.percussions.rows import Rows, is_parquet, rows_of, table_file
from analysis.percussions.snapshot import Setting, SnapshotPercussions, percussions_of
from analysis.percussions.table import COLUMNS, Openness, columns_of
from analysis.scene.scene import read_room
from analysis.support.progress import Progress
from nscd import ContactLaw

# Frames are solved in blocks that take about so long, but no more than MOST of them.
BLOCK_SECONDS, MOST = 2.0, 64
# Blocks under way for each worker: the answers need not fit in memory.
AHEAD = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class DumpToSolve:
    """What is to be solved, and how.

    path: of the dump
    time_step: s, of the simulation; see `open_bodies`
    setting: walls, drive, left velocity
    law: of the contacts; inelastic where left out
    tolerance: residual up to which a frame counts as solved
    openness: what is said of reactions that the mechanics may leave open
    parquet: whether rows are made for Parquet, not for CSV
    """

    path: Path
    time_step: float | None = None
    setting: Setting
    law: ContactLaw | None = None
    tolerance: float = 1e-8
    openness: Openness = "determined"
    parquet: bool = False

    def solve(self, numbers: range) -> list[SolvedFrame]:
        """Solve some frames, one after the other. Raises DumpError naming file and step."""
        trajectory = _trajectory(self.path, self.time_step)
        solved: list[SolvedFrame] = []
        before: SnapshotPercussions | None = None
        for number in numbers:
            ts = trajectory[number]
            step, seconds = int(ts.data["step"]), float(ts.time)
            snapshot = snapshot_of(ts, self.path, needs_velocity=self.setting.moves)
            try:
                found = percussions_of(
                    self.setting, snapshot, self.law, tolerance=self.tolerance, before=before
                )
            except ValueError as error:
                raise DumpError(f"{self.path}, step {step}: {error}") from None
            before = found
            known = None if math.isnan(seconds) else seconds
            cells = columns_of(found, self.openness, time=known, step=step)
            when = f"step {step}" if known is None else f"{known:g} s"
            answer = found.answer
            why = f"{self.path}, {when}: {answer.status}: {answer.reason}"
            solved.append(
                SolvedFrame(
                    columns=[name for name in COLUMNS if name in cells],
                    rows=rows_of(cells, self.parquet),
                    contacts=len(found.contacts),
                    largest=found.largest,
                    unit=found.unit,
                    when=when,
                    residual=answer.residual,
                    unsolved="" if answer.status == "solved" else why,
                )
            )
        return solved


@dataclass(frozen=True, slots=True, kw_only=True)
class SolvedFrame:
    """One solved frame: columns and rows of the table, number of contacts, the largest that a
    contact carries (in `unit`), when, residual, and why it is not solved."""

    columns: list[str]
    rows: Rows
    contacts: int
    largest: float
    unit: str
    when: str
    residual: float
    unsolved: str


@dataclass(slots=True, kw_only=True)
class SolvedDump:
    """The whole dump in numbers: as of one frame; `when` is that of the largest; `unsolved` has a
    line per frame that is not solved."""

    frames: int = 0
    contacts: int = 0
    largest: float = 0.0
    unit: str = ""
    when: str = ""
    residual: float = 0.0
    unsolved: list[str]

    def add(self, frame: SolvedFrame) -> None:
        """Count a frame."""
        self.join(
            SolvedDump(
                frames=1,
                contacts=frame.contacts,
                largest=frame.largest,
                unit=frame.unit,
                when=frame.when,
                residual=frame.residual,
                unsolved=[frame.unsolved] if frame.unsolved else [],
            )
        )

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
    frames: int = _trajectory(dump.path, dump.time_step).n_frames
    return frames


def solve_dump(
    dump: DumpToSolve,
    out: Path,
    *,
    executor: Executor | None = None,
    workers: int = 1,
    progress: Progress | None = None,
    expected: Callable[[float], None] | None = None,
) -> SolvedDump:
    """Solve every frame and write `out`, one row per contact (columns: docs/columns.md): CSV, or
    Parquet where its name ends in .parquet.

    executor: with `workers` processes; this process where left out
    expected: called with the seconds that all this will take, once they are known

    Neither the dump nor the answers need to fit in memory. Raises DumpError for a damaged dump and
    one without any contact; then `out` stays as it was."""
    dump = dataclasses.replace(dump, parquet=is_parquet(out))
    frames = frames_in(dump)
    whole = SolvedDump(unsolved=[])
    with table_file(out) as add:
        for frame in _frames(dump, frames, executor, workers, expected):
            if frame.contacts:
                add(frame.columns, frame.rows)
            whole.add(frame)
            if progress:
                progress(f"percussions of {dump.path}", whole.frames / frames)
        if not whole.contacts:
            raise DumpError(
                f"{dump.path}: no contact in any frame (gap ≤ "
                f"{dump.setting.contact_tolerance:g} m); nothing was written"
            )
    return whole


def _frames(
    dump: DumpToSolve,
    frames: int,
    executor: Executor | None,
    workers: int,
    expected: Callable[[float], None] | None,
) -> Iterator[SolvedFrame]:
    """All frames in order. The first one loads what is compiled; the second says how long one
    takes."""
    first = min(2, frames)
    seconds = 0.0
    for number in range(first):
        began = time.perf_counter()
        yield from dump.solve(range(number, number + 1))
        seconds = time.perf_counter() - began
    if expected:
        expected(seconds * (frames - first) / workers)
    size = max(1, min(MOST, int(BLOCK_SECONDS / max(seconds, 1e-6))))
    blocks = [range(start, min(start + size, frames)) for start in range(first, frames, size)]
    if executor is None:
        for block in blocks:
            yield from dump.solve(block)
        return
    under_way: deque[Any] = deque()
    for block in blocks:
        under_way.append(executor.submit(dump.solve, block))
        if len(under_way) >= AHEAD * workers:
            yield from under_way.popleft().result()
    while under_way:
        yield from under_way.popleft().result()


def setting_beside(dump: Path, room: Path | None = None, **given: Any) -> Setting:
    """Take walls and drive from a room or scene file, or from scene.toml beside the dump.

    given: fields of `Setting` that are used instead

    Raises EngineError where run.json beside the dump says that the run did not end well, SceneError
    for the file, and ValueError for a field."""
    if (dump.parent / FILE).exists():
        RunRecord.read(dump.parent)
    beside = dump.parent / "scene.toml"
    chosen = room if room is not None else beside if beside.exists() else None
    return Setting(**given) if chosen is None else Setting.in_room(read_room(chosen)[0], **given)


def _trajectory(path: Path, time_step: float | None) -> Any:
    """The dump, indexed once in each process, as long as it does not change."""
    try:
        changed = path.stat().st_mtime_ns
    except OSError:
        changed = 0
    return _opened(path, time_step, changed)


@functools.lru_cache(maxsize=1)
def _opened(path: Path, time_step: float | None, _changed: int) -> Any:
    return open_bodies(path, time_step).trajectory
