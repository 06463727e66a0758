"""A dump to solve: some of its frames, many in one compiled call, as rows of a table, or as a folder of
Parquet files of which what is finished is kept."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import hashlib
import itertools
import json
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from analysis.dumps import Bodies, DumpError, open_bodies
from analysis.dumps.listed_contacts import ListedContacts
from analysis.percussions import contact_rows
from analysis.percussions.listed_contacts import listed_in
from analysis.percussions.setting import FORCE, IMPULSE, Setting
from analysis.percussions.snapshot import NOT_CONVERGED, SnapshotPercussions, percussions_of
from analysis.support.extras import load
from analysis.support.files import plain, write_json
from analysis.support.parallel import Progress, Task, finished
from analysis.support.parallel import workers as processes
from analysis.support.reading import read_text
from nscd import ContactLaw, _core
from nscd.arrays import LARGEST
from nscd.percussions import Status
from nscd.show import arrays
from nscd.solve_frames import Disks, FrameOptions, FrameSolutions, solve_frames

# Frames are read in blocks of about so many bytes, at most MOST frames; a part (a file) has some blocks.
BLOCK, MOST = 1 << 22, 64
# Blocks under way for each worker: the answers need not fit in memory.
AHEAD = 2
# What is stated of a dump, as `open_bodies` calls it.
STATED = ("time_step", "unit", "mass_unit", "fixed_type", "mol")
# The file that is read is one for all threads.
_READING = threading.Lock()


@dataclass(slots=True, kw_only=True)
class SolvedDump:
    """Frames in numbers, under the names that the metadata of parts have.

    largest, when: what a contact carries at most, in `unit`; residual: the worst; unsolved: a line per frame
    standing: the largest sum on disks that do not move, in `unit`
    apart, missing: how many listed contacts do not touch; how many touch and are not listed"""

    frames: int = 0
    contacts: int = 0
    largest: float = 0.0
    unit: str = ""
    when: str = ""
    residual: float = 0.0
    standing: float = 0.0
    apart: int = 0
    missing: int = 0
    unsolved: list[str] = dataclasses.field(default_factory=list)

    def join(self, later: SolvedDump) -> None:
        """Count later frames."""
        self.frames += later.frames
        self.contacts += later.contacts
        self.apart += later.apart
        self.missing += later.missing
        self.residual = max(self.residual, later.residual)
        self.standing = max(self.standing, later.standing)
        if not self.when or later.largest > self.largest:
            self.largest, self.unit, self.when = later.largest, later.unit, later.when
        self.unsolved += later.unsolved


class SolvedRows(NamedTuple):
    """Some solved frames: columns and rows of the table, and what is said of them."""

    columns: list[str]
    rows: contact_rows.Rows
    summary: SolvedDump


# The cells of some frames by columns, and what is said of them.
Cells = tuple[dict[str, contact_rows.Column], SolvedDump]


@dataclass(frozen=True, slots=True, kw_only=True)
class DumpToSolve:
    """What is to be solved, and how.

    law: of the contacts; that of the setting where left out
    listed_contacts: those that came with the dump, which are taken in place of those that are found"""

    path: Path  # of the dump
    time_step: float | None = None  # s, of the simulation; see `open_bodies`
    unit: str | None = None  # of lengths; see `open_bodies`, also of those that follow
    mass_unit: str | None = None
    fixed_type: tuple[int, ...] = ()
    mol: str | None = None
    setting: Setting  # walls, drive, left velocity
    law: ContactLaw | None = None
    tolerance: float = 1e-8  # residual up to which a frame counts as solved
    indeterminacy: contact_rows.Indeterminacy = "determined"  # of reactions that mechanics may leave open
    threads: int = 1  # of each large frame
    listed_contacts: ListedContacts | None = None
    parquet: bool = False  # whether rows are made for Parquet, not for CSV

    @property
    def trajectory(self) -> Any:
        """The dump, indexed once in each process, as long as it does not change."""
        changed = self.path.stat().st_mtime_ns if self.path.exists() else 0
        return _opened(self.path, tuple((name, getattr(self, name)) for name in STATED), changed)

    @property
    def in_batches(self) -> bool:
        """Whether many frames are solved in one compiled call, beside which threads go on."""
        law = self.setting.law if self.law is None else self.law
        small = max(self.trajectory.index.counts) < _core.SHARED
        return small and law.plain and self.indeterminacy == "none" and self.listed_contacts is None

    def blocks(self, numbers: range) -> list[range]:
        """Cut frames into those that are solved together: the same ones however many work on
        them."""
        frames = self.trajectory.index.frames
        block_size = max(1, min(MOST, BLOCK * len(frames) // max(1, frames[-1].end)))
        return [numbers[start : start + block_size] for start in range(0, len(numbers), block_size)]

    def solve(self, numbers: range, text: bytes | None = None) -> list[SolvedRows]:
        """Solve some frames, those of one block, and make their rows.

        text: of them, see `DumpIndex.text`; it is read where left out

        Raises DumpError naming file and step."""
        trajectory, found = self.trajectory, None
        if text is None:
            with _READING:
                text = trajectory.index.text(numbers)
        bodies: Bodies = trajectory.bodies(numbers, text, self.setting.moves)
        if self.in_batches:
            try:
                found = solve_batch(bodies, self.setting, self.tolerance)
            except ValueError as error:
                raise DumpError(f"{self.path}, step {bodies.steps[0]}: {error}") from None
        answered = [False] * len(bodies) if found is None else found.answered
        solved: list[SolvedRows] = []
        for _, group in itertools.groupby(range(len(bodies)), answered.__getitem__):
            frames = list(group)
            if found and answered[frames[0]]:
                cells = iter([self._cells_of_batch(bodies, found, frames)])
            else:
                cells = self._one_by_one(bodies, frames, numbers)
            solved += [SolvedRows(list(one), contact_rows.rows_of(one, self.parquet), summary) for one, summary in cells]
        return solved

    def _cells_of_batch(self, bodies: Bodies, found: FrameSolutions, frames: list[int]) -> Cells:
        """Frames that are answered and follow each other."""
        _, window = self.setting.left(bodies)
        start = found.start[frames[0] : frames[-1] + 2]
        those = slice(start[0], start[-1])
        names = ("first", "second", "is_wall", "normal", "gap", "reaction", "impulse")
        some = found._replace(**{name: getattr(found, name)[those] for name in names})
        frame_of_contact, force = np.repeat(frames, np.diff(start)), np.hypot(*(some.impulse / (window or 1.0)).T)
        number = int(frame_of_contact[force.argmax()]) if len(force) else frames[0]
        summary = SolvedDump(
            frames=len(frames),
            contacts=len(force),
            largest=float(force.max(initial=0.0)),
            unit=IMPULSE if window is None else FORCE,
            when=_when(bodies, number),
            residual=float(found.residual[frames].max()),
        )
        times = None if np.isnan(bodies.times).any() else bodies.times[frame_of_contact]
        cells = contact_rows.table_columns(
            arrays(bodies.ids, some, some.reaction, some.impulse, window),
            self.setting,
            some,
            (times, np.array(bodies.steps)[frame_of_contact]),
            (str(Status.SOLVED), found.residual[frame_of_contact], found.velocity_error[frame_of_contact]),
        )
        return cells, summary

    def _one_by_one(self, bodies: Bodies, frames: Iterable[int], numbers: range) -> Iterator[Cells]:
        """Some of the frames, one after the other; numbers: of all in the dump, for own contacts."""
        before: SnapshotPercussions | None = None
        setting, listed = self.setting, None
        for number in frames:
            snapshot, seconds = bodies.snapshot(number), float(bodies.times[number])
            try:
                if self.listed_contacts:
                    listed = listed_in(self.listed_contacts, self.trajectory[numbers[number]], snapshot, setting)
                    setting = dataclasses.replace(self.setting, listed=listed.contacts)
                found = before = percussions_of(
                    setting, snapshot, self.law, tolerance=self.tolerance, before=before, threads=self.threads
                )
            except ValueError as error:
                raise DumpError(f"{self.path}, step {bodies.steps[number]}: {error}") from None
            solution, when = found.solution, _when(bodies, number)
            summary = SolvedDump(
                frames=1,
                contacts=len(found.contacts),
                largest=found.largest,
                unit=found.unit,
                when=when,
                residual=solution.residual,
                standing=found.on_standing,
            )
            cells = found.columns(
                self.indeterminacy,
                time=None if math.isnan(seconds) else seconds,
                step=bodies.steps[number],
                own=listed and listed.force,
            )
            if listed:
                summary.apart, summary.missing = listed.apart, listed.missing
            if solution.status != Status.SOLVED:
                summary.unsolved.append(f"{self.path}, {when}: {solution.status}: {solution.reason}")
            if bad := list(cells.get("sampling", ())).count(NOT_CONVERGED):
                summary.unsolved.append(f"{self.path}, {when}: sampling of {bad} contacts {NOT_CONVERGED}")
            yield cells, summary


def solve_batch(bodies: Bodies, setting: Setting, tolerance: float) -> FrameSolutions | None:
    """Solve frames without friction and dissipation; those that are not `answered` are left to
    `percussions_of`, and all of them where this gives None.

    Raises ValueError where the left velocity lacks a drive or a window."""
    left_velocity, _ = setting.left(bodies)
    only_free_disks = bodies.joined is None and not setting.fixed_disks
    frames = [slice(*ends) for ends in itertools.pairwise(bodies.start.tolist())]
    contact_gaps = {setting.touch(bodies.position[one], bodies.radius[one]) for one in frames}
    if (
        not only_free_disks
        or {coarse for _, coarse in contact_gaps} != {False}
        or len(contact_gaps) > 1
        or not np.abs(left_velocity).max(initial=0.0) <= LARGEST
    ):
        return None
    disks = Disks(bodies.start, bodies.ids, bodies.position, left_velocity, bodies.radius, bodies.mass)
    options = FrameOptions(contact_gaps.pop()[0], setting.largest_overlap, tolerance)
    return solve_frames(disks, setting.walls, options)


def _when(bodies: Bodies, number: int) -> str:
    seconds = float(bodies.times[number])
    return f"step {bodies.steps[number]}" if math.isnan(seconds) else f"{seconds:g} s"


@functools.lru_cache(maxsize=1)
def _opened(path: Path, stated: tuple[tuple[str, Any], ...], _changed: int) -> Any:
    return open_bodies(path, **dict(stated)).trajectory


@contextlib.contextmanager
def _open_job(
    dump: DumpToSolve, parquet: bool, workers: int, scheduler: str | None
) -> Iterator[tuple[DumpToSolve, int, Executor | None]]:
    """The dump with what its setting takes from it, its frames, and who solves them: threads where these
    serve, else processes, or a Dask cluster; None for one worker."""
    setting = dump.setting.of_dump(dump.trajectory)
    fitted = dataclasses.replace(dump, setting=setting, parquet=parquet)
    if scheduler is None and workers <= 1:
        pool: Any = contextlib.nullcontext()
    elif scheduler is None and fitted.in_batches:
        pool = ThreadPoolExecutor(workers)
    else:
        pool = processes(workers, scheduler)
    with pool as executor:
        yield fitted, fitted.trajectory.n_frames, executor


def _refuse_none(dump: DumpToSolve, total: SolvedDump, end: str = "") -> SolvedDump:
    if not total.contacts:
        gap = dump.setting.usual_touch
        raise DumpError(f"{dump.path}: no contact in any frame (gap ≤ {gap:g} m){end}")
    return total


def solve_dump(
    dump: DumpToSolve,
    out: Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
    expected: Callable[[float], None] | None = None,
) -> SolvedDump:
    """Solve every frame and write `out`, one row per contact (columns: docs/columns.md): CSV, or
    Parquet where its name ends in .parquet.

    workers: how many; scheduler: address of a Dask cluster in their place
    expected: called with the seconds that all this will take, once they are known

    Neither the dump nor the answers need to fit in memory. Raises DumpError for a damaged dump and
    one without any contact; then `out` stays as it was."""
    total = SolvedDump()
    opened = _open_job(dump, contact_rows.is_parquet(out), workers, scheduler)
    with opened as (dump, frames, executor), contact_rows.table_file(out) as add:
        for columns, rows, summary in _solved(dump, frames, executor, workers, expected):
            if summary.contacts:
                add(columns, rows)
            total.join(summary)
            if progress:
                progress(f"percussions of {dump.path}", total.frames / frames)
        return _refuse_none(dump, total, ". Nothing was written")


def _solved(
    dump: DumpToSolve,
    frames: int,
    executor: Executor | None,
    workers: int,
    expected: Callable[[float], None] | None,
) -> Iterator[SolvedRows]:
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
    blocks = dump.blocks(range(first, frames))
    if executor is None:
        for block in blocks:
            yield from dump.solve(block)
        return
    # of threads this one reads, forwards; processes read what they solve
    reads = isinstance(executor, ThreadPoolExecutor)
    under_way: deque[Any] = deque()
    try:
        for block in blocks:
            text = dump.trajectory.index.text(block) if reads else None
            under_way.append(executor.submit(dump.solve, block, text))
            if len(under_way) >= AHEAD * workers:
                yield from under_way.popleft().result()
        while under_way:
            yield from under_way.popleft().result()
    finally:
        for future in under_way:
            future.cancel()


# Readers of partitioned Parquet leave files out that begin so.
JOB = "_job.json"
# Under these names a part has, in its metadata, what `SolvedDump` says of it, and a digest of that
# and of what it is a part of.
SUMMARY, SEAL = b"percussions", b"percussions_seal"


def solve_in_chunks(
    dump: DumpToSolve,
    folder: Path,
    frames: int,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> SolvedDump:
    """Solve a dump into a folder of Parquet files of so many frames each. Parts that are there, of
    the same dump and settings, are not computed again.

    workers, scheduler: as of `solve_dump`; those of a Dask cluster see the same folders, and a part of
        one that is lost is computed anew by another

    Raises ValueError for a folder that has something else, DumpError as `solve_dump` does; then the
    parts that are finished stay."""
    total = SolvedDump()
    with _open_job(dump, True, workers, scheduler) as (dump, count, executor):
        job = _claim(folder, dump, frames, count)
        starts = range(0, count, frames)
        parts = [_Part(range(one, min(one + frames, count)), folder, job) for one in starts]
        if others := set(folder.glob("*.parquet")) - {part.path for part in parts}:
            raise ValueError(f"--out: {min(others)}: no part of this dump. Remove it")
        found = {part: summary for part in parts if (summary := part.summary()) is not None}
        todo = [part for part in parts if part not in found]
        tasks = [Task(call=part.solve, arguments=(dump,), work=len(part.numbers)) for part in todo]
        for number, summary in finished(tasks, executor):
            found[todo[number]] = summary
            if progress:
                progress(f"percussions of {dump.path}", len(found) / len(parts))
    for leftover in folder.glob(".frames_*.part"):  # by workers that were lost
        leftover.unlink(missing_ok=True)
    for part in parts:
        total.join(found[part])
    return _refuse_none(dump, total)


@dataclasses.dataclass(frozen=True, slots=True)
class _Part:
    """Some frames, the folder that they are written into, and what they are of, as JSON."""

    numbers: range
    folder: Path
    job: str

    @property
    def path(self) -> Path:
        return self.folder / f"frames_{self.numbers[0]:08d}_{self.numbers[-1]:08d}.parquet"

    def solve(self, dump: DumpToSolve) -> SolvedDump:
        """Solve the frames and write them; what comes back is small."""
        summary = SolvedDump()

        def about() -> dict[bytes, str]:
            content = json.dumps(dataclasses.asdict(summary))
            return {SUMMARY: content, SEAL: self._seal(content)}

        with contact_rows.table_file(self.path, about) as add:
            first_block = None
            for block in dump.blocks(self.numbers):
                for columns, rows, block_summary in dump.solve(block):
                    if block_summary.contacts:
                        add(columns, rows)
                    first_block = first_block or (columns, rows)
                    summary.join(block_summary)
            if not summary.contacts and first_block:
                add(*first_block)
        return summary

    def _seal(self, content: str) -> str:
        """What only a part of this job, that says this, has."""
        return hashlib.sha256(f"{self.job}\n{self.numbers}\n{content}".encode()).hexdigest()

    def summary(self) -> SolvedDump | None:
        """What a finished part says of itself; None where there is none. Raises ValueError for a
        part of something else."""
        if not self.path.exists():
            return None
        arrow, parquet = load("pyarrow"), load("pyarrow.parquet")
        try:
            with parquet.ParquetFile(self.path, page_checksum_verification=True) as file:
                about = file.metadata.metadata or {}
                rows = sum(len(batch) for batch in file.iter_batches())
        except (arrow.ArrowException, OSError):
            return None  # cut off or damaged, as by a full disk: it is computed again
        content = about.get(SUMMARY, b"").decode("utf-8", "replace")
        if about.get(SEAL, b"") != self._seal(content).encode():
            raise ValueError(f"--out: {self.path}: no part of this dump and these settings. Remove it")
        found = SolvedDump(**json.loads(content))
        return found if rows == found.contacts else None


def _claim(folder: Path, dump: DumpToSolve, frames: int, count: int) -> str:
    """Say in a folder what its parts are of, and return it. Raises ValueError where it has
    others."""
    job = _job_of(dump, frames, count)
    job_file = folder / JOB
    if not job_file.exists():
        if folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
            raise ValueError(f"--out: {folder}: it is there, and no folder of parts. Give another name")
        write_json(job_file, job)
        return json.dumps(job)
    try:
        recorded = json.loads(read_text(job_file))
        other = [name for name in job if recorded.get(name) != job[name]]
    except (ValueError, AttributeError):
        raise ValueError(f"{job_file}: not what is written there. Give another --out") from None
    if other:
        raise ValueError(
            f"--out: {folder}: its parts are of another {other[0]} ({_short(recorded.get(other[0]))} "
            f"where this is {_short(job[other[0]])}). Give another name, or remove it"
        )
    return json.dumps(job)


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else f"{text[:57]}…"


def _file_of(path: Path) -> dict[str, Any]:
    about = path.stat()
    return {"name": path.name, "bytes": about.st_size, "changed_ns": about.st_mtime_ns}


def _job_of(dump: DumpToSolve, frames: int, count: int) -> dict[str, Any]:
    """Everything that the answers depend on, as JSON has it."""
    job: dict[str, Any] = {
        "dump": _file_of(dump.path),
        "frames": count,
        "frames per part": frames,
        "version": version("crowd-percussions"),
        **{name.replace("_", " "): getattr(dump, name) for name in STATED},
        "tolerance": dump.tolerance,
        "openness": dump.indeterminacy,
        "law": dump.law,
        "setting": dump.setting,
        "contacts": dump.listed_contacts and _file_of(dump.listed_contacts.index.path) | {"factor": dump.listed_contacts.stated},
    }
    return {name: plain(value) for name, value in job.items()}
