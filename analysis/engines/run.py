"""Runs of engines: where they live, which are finished, and running those that are not, one by one or
side by side. Whether what they wrote can be right: `check_run`."""

from __future__ import annotations

import contextlib
import dataclasses
import fcntl
import logging
import os
import re
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from analysis.dumps import DumpError
from analysis.engines import LAMMPS, PENALTY, engine, guard, installed
from analysis.engines.check_run import check_bodies, check_contacts, damaged
from analysis.engines.energy import write_energy
from analysis.engines.penalty import friction_at_joints
from analysis.engines.price import expected_seconds
from analysis.engines.process import Ended, run_command
from analysis.engines.record import FAILED, STOPPED, EngineError, RunRecord
from analysis.engines.softness import softness_warning
from analysis.scene.scene import Scene, read_scene
from analysis.support.machine import cores
from analysis.support.parallel import Progress, Task, do_all, workers
from analysis.support.reading import UnreadableError, read_text

log = logging.getLogger(__name__)
# MPI may hang at its start, its ranks at full load: one that has started writes within so many s.
MPI_STARTS_S = 60.0


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Be the only one who runs into this folder; wait for another process that does."""
    folder = folder.resolve()
    folder.parent.mkdir(parents=True, exist_ok=True)
    path = folder.with_name(f".{folder.name}.lock")
    while True:
        file = path.open("w")
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            log.warning("%s: another process runs into this folder. Waiting for it", folder)
            fcntl.flock(file, fcntl.LOCK_EX)
        # who had it before has taken the file away
        if path.exists() and os.path.samestat(os.fstat(file.fileno()), path.stat()):
            break
        file.close()
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        file.close()


@contextlib.contextmanager
def staged(folder: Path, resume: RunRecord | None = None) -> Iterator[Path]:
    """Make an empty hidden folder beside `folder` for the block to work in.

    When the block ends well it becomes `folder`; when it does not (an error, Ctrl-C), it is removed
    and `folder` stays as it was. A run that was stopped or failed becomes `folder` too, with the
    reason in its record, where no finished run is there. To be used while the folder is locked.

    resume: the record of a run that can go on where it was interrupted: the hidden folder then
        stays when the block is interrupted, and is taken again for the same record"""
    folder = folder.resolve()  # a link to a folder stays
    staging = folder.with_name(f".{folder.name}.next")
    earlier = folder.with_name(f".{folder.name}.earlier")
    if earlier.exists() and not folder.exists():
        earlier.rename(folder)  # a process was killed between the two renames of `_publish`
    if resume is None or _record_in(staging) != resume:
        shutil.rmtree(staging, ignore_errors=True)
    staging.mkdir(parents=True, exist_ok=True)
    interrupted = False
    try:
        try:
            yield staging
        except guard.RunStoppedError as end:
            # another stopped run is all that one may replace
            record = _record_in(folder, even_stopped=True)
            if record.exit_state in (STOPPED, FAILED) if record else not folder.exists():
                end.record.write(staging)
                _publish(staging, folder)
            raise
        _publish(staging, folder)
    except OSError as error:
        if str(staging) in str(error.filename):  # a name that will be gone
            error.filename = str(error.filename).replace(str(staging), str(folder))
        raise
    except KeyboardInterrupt:
        interrupted = True
        raise
    finally:
        if not (interrupted and resume is not None):
            shutil.rmtree(staging, ignore_errors=True)


def _record_in(folder: Path, *, even_stopped: bool = False) -> RunRecord | None:
    try:
        return RunRecord.read(folder, even_stopped=even_stopped)
    except EngineError:
        return None


def _publish(staging: Path, folder: Path) -> None:
    earlier = folder.with_name(f".{folder.name}.earlier")
    shutil.rmtree(earlier, ignore_errors=True)
    if folder.exists():
        folder.rename(earlier)
    staging.rename(folder)
    shutil.rmtree(earlier, ignore_errors=True)


DECKS = "decks"
# LAMMPS counts no further in one run.
MOST_STEPS = 2**31 - 1
# A month of an engine that moves four million disks a second by a step.
MOST_DISK_STEPS = 1e13
# Of a disk in a frame of bodies.dump; contacts are about as much again.
ROW_BYTES = 500
# Overlaps beyond this share of a radius are said after a run: it is sound, its people are deep in
# each other.
DEEP_SHARE = 0.5
_STEP = re.compile(r"^\s*(\d{1,12})\s+[\d.e+-]+\s+\d+\s", re.ASCII)  # step, time, disks, …
_RESUMED = re.compile(rf"^RESUMED at t = {guard.TIME} s", re.ASCII)
# Engines with springs.
SOFT = [each.NAME for each in PENALTY]


def run_folder(out: Path, scene: Scene, engine_name: str) -> Path:
    """Where a run of the scene lives: out/<scene>/<engine>_<setting>, such as
    lammps_hooke_k1e+06."""
    return out / scene.name / f"{engine_name}_{engine(engine_name).setting(scene)}"


def finished_run(scene: Scene, engine_name: str, folder: Path) -> RunRecord | None:
    """Return the finished run that is in the folder if scene, way, decks, engine and version are the
    same, else None."""
    try:
        chosen, record = engine(engine_name), RunRecord.read(folder)
        record.check_finished(folder, scene)
        same = record.deck_digest == chosen.deck_digest() and record.version == installed(
            engine_name
        )
        if scene.drive and scene.drive.way:  # another search may find another one
            way = scene.drive.way.to_json(scene.wall_segments())
            same = same and read_text(folder / "scene.way") == way
    except (EngineError, UnreadableError):
        return None
    return record if same else None


def run_engine(
    scene: Scene, engine_name: str, folder: Path, progress: Progress | None = None, ranks: int = 1,
    expected: Callable[[float], None] | None = None,
) -> RunRecord:  # fmt: skip
    """Run the scene, or take the finished run that is in the folder if scene, decks, engine and
    version are the same.

    ranks: of MPI that share the run, which changes it by rounding; of the rigid engine threads,
        which do not
    expected: called with the CPU seconds that a run will take, before it

    Raises EngineError."""
    record = finished_run(scene, engine_name, folder)
    if record is None:
        check_before(scene, engine_name, folder)
        if expected:
            expected(expected_seconds(scene, engine_name))
        with locked(folder):
            # another process may have run it meanwhile
            record = finished_run(scene, engine_name, folder)
            if record is None:
                return _simulate(scene, engine_name, folder, progress, ranks)
    log.info("%s: unchanged, taken from %s", scene.name, folder)
    return record


def simulate(
    scene: Scene, engine_name: str, folder: Path, progress: Progress | None = None
) -> RunRecord:
    """Run the scene; then the folder holds scene.toml, scene.data, bodies.dump, contacts.dump, logs
    and run.json.

    Raises EngineError for an engine that is missing, dies, or gives what cannot be right; then, and
    when interrupted, what was in the folder stays as it was."""
    check_before(scene, engine_name, folder)
    with locked(folder):
        return _simulate(scene, engine_name, folder, progress)


def check_before(scene: Scene, engine_name: str, folder: Path) -> None:
    """Raise EngineError for a run that cannot be, or would never end."""
    engine(engine_name).check(scene)
    installed(engine_name)
    timing, disks = engine(engine_name).timing(scene), len(scene.snapshot)
    if timing.steps > MOST_STEPS or timing.steps * disks > MOST_DISK_STEPS:
        raise EngineError(
            f"{scene.name}: {timing.steps:.3g} steps of {timing.time_step:.3g} s for {disks} "
            f"disks would not end within a month. At most {MOST_STEPS:.3g} steps and "
            f"{MOST_DISK_STEPS:.0g} disks times steps are run. A softer contact, a longer time "
            "step or a shorter duration needs fewer"
        )
    there = next(parent for parent in folder.resolve().parents if parent.exists())
    needed, free = scene.run.frames * disks * ROW_BYTES, shutil.disk_usage(there).free
    if needed > free:
        raise EngineError(
            f"{scene.name}: run.frames: {scene.run.frames} frames of {disks} disks need about "
            f"{needed / 1e9:.3g} GB. The disk of {there} has {free / 1e9:.3g} GB free"
        )


def _simulate(
    scene: Scene, engine_name: str, folder: Path, progress: Progress | None, ranks: int = 1
) -> RunRecord:
    chosen = engine(engine_name)
    if ranks > 1 and not hasattr(chosen, "on_ranks"):
        raise EngineError(f"{scene.name}: ranks: {ranks}, but {engine_name} runs on one core")
    timing = chosen.timing(scene)
    if timing.time_step > 1.000001 * timing.safe_time_step:
        log.warning(
            "%s: the time step %.3g s is longer than the safe one, %.3g s",
            scene.name, timing.time_step, timing.safe_time_step,
        )
    if engine_name in SOFT:
        for words in filter(None, (softness_warning(scene), friction_at_joints(scene))):
            log.warning("%s: %s", scene.name, words)
    record = RunRecord.prepared(engine_name, installed(engine_name), chosen.deck_digest(), scene, timing)
    label = f"{scene.name}: {engine_name}, {chosen.setting(scene)}"
    with staged(folder, resume=record if chosen.RESUMES else None) as staging:
        scene.model_copy(update={"name": "scene", "other_frames": None}).write(staging)
        chosen.write_input(scene, staging / DECKS)
        record.write(staging)
        step = 0

        def on_line(line: str) -> None:
            nonlocal step, record
            if found := _RESUMED.match(line):
                record = dataclasses.replace(record, resumed_at_s=float(found[1]))
                log.warning("%s: goes on from the interrupted run at %s s", scene.name, found[1])
            if found := _STEP.match(line):
                step = min(int(found[1]), record.steps)
                if progress:
                    progress(label, step / max(record.steps, 1))

        ended = _ended(chosen, scene, staging, record.time_step_s, ranks, on_line)
        record = dataclasses.replace(
            record, wall_seconds=ended.wall_seconds, cpu_seconds=ended.cpu_seconds
        )
        if ended.status != 0:
            raise guard.died(record, ended.status, step, ended.last, staging)
        deepest = _check(scene.name, engine_name, staging, record)
        if deepest > DEEP_SHARE:
            log.warning("%s: bodies overlap by up to %.2g of a radius", folder, deepest)
        record = dataclasses.replace(record, overlap_largest=deepest)
        shutil.rmtree(staging / DECKS)
        record = record.finished(staging)
        record.write(staging)
    return record


def _ended(
    chosen: Any,
    scene: Scene,
    staging: Path,
    time_step_s: float,
    ranks: int,
    on_line: Callable[[str], None],
) -> Ended:
    """How the engine ended. Raises EngineError for ranks of MPI that did not start."""
    command = chosen.command(staging, time_step_s, decks=DECKS)
    if ranks == 1:
        return run_command(command, staging, on_line=on_line)
    command = chosen.on_ranks(command, ranks, scene)
    starts_s = MPI_STARTS_S if chosen is LAMMPS else None
    ended = run_command(command, staging, silent_s=starts_s, on_line=on_line)
    if ended.status is None:
        raise EngineError(
            f"{scene.name}: ranks: {ranks} of MPI wrote nothing in their first {MPI_STARTS_S:g} s and "
            "were ended. Run it once more, or on one rank"
        )
    return ended


def _check(name: str, engine_name: str, staging: Path, record: RunRecord) -> float:
    """Raise EngineError where what an engine left in the folder cannot be right; return the largest
    overlap as a share of the smaller radius."""
    # as the engine read it
    scene = read_scene(staging / "scene.toml").model_copy(update={"name": name})
    try:
        energies = check_bodies(staging / "bodies.dump", record, scene)
        try:
            engine(engine_name).collect(scene, staging)
        except DumpError as error:
            raise damaged(record, error, staging) from None
        deepest = check_contacts(staging / "contacts.dump", energies, record, scene)
        if engine_name in SOFT:
            write_energy(scene, staging, record)
        return deepest
    except guard.RunStoppedError:
        if full := guard.full_disk(staging):
            raise EngineError(f"{engine_name}, {name}: {full}") from None
        raise


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EngineRun:
    """A run that somebody needs."""

    scene: Scene
    engine: str  # its name
    folder: Path  # where its results are
    ranks: int = 1  # of MPI that share it

    @classmethod
    def of(cls, scene: Scene, engine: str, runs: Path) -> EngineRun:
        """Name the run in the folder that `run_folder` gives it."""
        return cls(scene=scene, engine=engine, folder=run_folder(runs, scene, engine))

    def is_finished(self) -> bool:
        """Tell whether it is there, unchanged."""
        return finished_run(self.scene, self.engine, self.folder) is not None

    def record(
        self, progress: Progress | None = None, expected: Callable[[float], None] | None = None
    ) -> RunRecord:
        """Run it, or take the finished run where it is unchanged, see `run_engine`."""
        return run_engine(self.scene, self.engine, self.folder, progress, self.ranks, expected)

    @property
    def particle_steps(self) -> int:
        """Disks times steps, which its cost grows with; 0 of a run that cannot begin."""
        try:
            return len(self.scene.snapshot) * engine(self.engine).timing(self.scene).steps
        except EngineError:
            return 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Cost:
    """What runs cost.

    made, reused, failed: number of runs made now, taken as they were, failed; cpu_seconds: s, of
    those made."""

    made: int = 0
    reused: int = 0
    failed: int = 0
    cpu_seconds: float = 0.0

    def __add__(self, other: Cost) -> Cost:
        mine, others = dataclasses.asdict(self), dataclasses.asdict(other)
        return Cost(**{name: mine[name] + others[name] for name in mine})


def run_ahead(
    runs: Sequence[EngineRun],
    progress: Progress | None = None,
    processes: int | None = None,
    scheduler: str | None = None,
) -> dict[Path, Cost]:
    """Run what is not finished, in as many processes as there are cores, or on the Dask cluster of a
    scheduler; return what each folder cost.

    A run that fails is left to who needs it, who says so. In processes of their own, since the CPU
    time of an engine is measured as that of the children of its process."""
    requested = list({run.folder: run for run in runs}.values())
    wanted = [run for run in requested if not run.is_finished()]
    costs = {run.folder: Cost(reused=1) for run in requested if run not in wanted}
    if not wanted:
        return costs
    tasks = [Task(call=_cost_of, arguments=(run,), work=run.particle_steps) for run in wanted]
    with workers(min(processes or cores(), len(wanted)), scheduler) as them:
        made = do_all(tasks, them, "engine runs", progress)
    return costs | {run.folder: cost for run, cost in zip(wanted, made, strict=True)}


def _cost_of(run: EngineRun) -> Cost:
    try:
        return Cost(made=1, cpu_seconds=run.record().cpu_seconds)
    except EngineError as error:
        log.info("%s, %s: %s", run.scene.name, run.engine, error)
        return Cost(failed=1)
