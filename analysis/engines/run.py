"""Runs of engines: where they live, which are finished, and running those that are not, one by one
or several at once."""

from __future__ import annotations

import dataclasses
import logging
import os
import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.dumps import DumpError
from analysis.engines import PENALTY, engine, installed
from analysis.engines.dump_checks import check_bodies, check_contacts, damaged
from analysis.engines.guard import TIME, RunStoppedError, died, full_disk
from analysis.engines.joints import friction_at_joints
from analysis.engines.process import run_command
from analysis.engines.record import EngineError, RunRecord
from analysis.engines.softness import softness_warning
from analysis.engines.staging import locked, staged
from analysis.scene.scene import Scene, read_scene
from analysis.support.parallel import Task, do_all, workers
from analysis.support.progress import Progress

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
_RESUMED = re.compile(rf"^RESUMED at t = {TIME} s", re.ASCII)
log = logging.getLogger(__name__)
# Engines with springs.
SOFT = [known.NAME for known in PENALTY]


def run_folder(out: Path, scene: Scene, engine_name: str) -> Path:
    """Where a run of the scene lives: out/<scene>/<engine>_<setting>, such as
    lammps_hooke_k1e+06."""
    return out / scene.name / f"{engine_name}_{engine(engine_name).setting(scene)}"


def finished_run(scene: Scene, engine_name: str, folder: Path) -> RunRecord | None:
    """Return the finished run that is in the folder if scene, decks, engine and version are the
    same, else None."""
    try:
        chosen, record = engine(engine_name), RunRecord.read(folder)
        record.check_finished(folder, scene)
        same = record.deck_digest == chosen.deck_digest() and record.version == installed(
            engine_name
        )
    except EngineError:
        return None
    return record if same else None


def run_engine(
    scene: Scene,
    engine_name: str,
    folder: Path,
    progress: Progress | None = None,
    ranks: int = 1,
) -> RunRecord:
    """Run the scene, or take the finished run that is in the folder if scene, decks, engine and
    version are the same.

    ranks: of MPI that share the run, which changes it by rounding; LAMMPS only

    Raises EngineError."""
    if record := _taken(scene, engine_name, folder):
        return record
    check_before(scene, engine_name, folder)
    with locked(folder):
        # another process may have run it meanwhile
        return _taken(scene, engine_name, folder) or _simulate(
            scene, engine_name, folder, progress, ranks
        )


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
            f"disks would not end within a month; at most {MOST_STEPS:.3g} steps and "
            f"{MOST_DISK_STEPS:.0g} disks times steps are run. A softer contact, a longer time "
            "step or a shorter duration needs fewer"
        )
    there = next(parent for parent in folder.resolve().parents if parent.exists())
    needed, free = scene.run.frames * disks * ROW_BYTES, shutil.disk_usage(there).free
    if needed > free:
        raise EngineError(
            f"{scene.name}: run.frames: {scene.run.frames} frames of {disks} disks need about "
            f"{needed / 1e9:.3g} GB on the disk of {there}, where {free / 1e9:.3g} GB are free"
        )


def _taken(scene: Scene, engine_name: str, folder: Path) -> RunRecord | None:
    record = finished_run(scene, engine_name, folder)
    if record:
        log.info("%s: unchanged, taken from %s", scene.name, folder)
    return record


def _simulate(
    scene: Scene, engine_name: str, folder: Path, progress: Progress | None, ranks: int = 1
) -> RunRecord:
    chosen = engine(engine_name)
    on_ranks = getattr(chosen, "on_ranks", None)
    if ranks > 1 and on_ranks is None:
        raise EngineError(f"{scene.name}: ranks: {ranks}; {engine_name} runs on one core")
    timing = chosen.timing(scene)
    if timing.time_step > 1.000001 * timing.safe_time_step:
        log.warning(
            "%s: the time step %.3g s is longer than the safe one, %.3g s",
            scene.name,
            timing.time_step,
            timing.safe_time_step,
        )
    if engine_name in SOFT:
        for words in filter(None, (softness_warning(scene), friction_at_joints(scene))):
            log.warning("%s: %s", scene.name, words)
    record = RunRecord.prepared(
        engine_name, installed(engine_name), chosen.deck_digest(), scene, timing
    )
    label = f"{scene.name}: {engine_name}, {chosen.setting(scene)}"
    with staged(folder, resume=record if chosen.RESUMES else None) as staging:
        scene.model_copy(update={"name": "scene", "other_frames": None}).write(staging)
        chosen.write_input(scene, staging / DECKS)
        record.write(staging)
        step = 0

        def told(line: str) -> None:
            nonlocal step, record
            if found := _RESUMED.match(line):
                record = dataclasses.replace(record, resumed_at_s=float(found[1]))
                log.warning("%s: goes on from the interrupted run at %s s", scene.name, found[1])
            if found := _STEP.match(line):
                step = min(int(found[1]), record.steps)
                if progress:
                    progress(label, step / max(record.steps, 1))

        command = chosen.command(staging, record.time_step_s, decks=DECKS)
        if ranks > 1 and on_ranks:
            command = on_ranks(command, ranks, scene)
        ended = run_command(command, staging, told=told)
        record = dataclasses.replace(
            record, wall_seconds=ended.wall_seconds, cpu_seconds=ended.cpu_seconds
        )
        if ended.status != 0:
            raise died(record, ended.status, step, ended.last, staging)
        deepest = _check(scene.name, engine_name, staging, record)
        if deepest > DEEP_SHARE:
            log.warning("%s: bodies overlap by up to %.2g of a radius", scene.name, deepest)
        record = dataclasses.replace(record, overlap_largest=deepest)
        shutil.rmtree(staging / DECKS)
        record = record.finished(staging)
        record.write(staging)
    return record


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
        return check_contacts(staging / "contacts.dump", energies, record, scene)
    except RunStoppedError:
        if full := full_disk(staging):
            raise EngineError(f"{engine_name}, {name}: {full}") from None
        raise


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EngineRun:
    """A run that somebody needs.

    scene: what is run; engine: the name of the engine that runs it; folder: where its results are;
    ranks: of MPI that share it.
    """

    scene: Scene
    engine: str
    folder: Path
    ranks: int = 1

    @classmethod
    def of(cls, scene: Scene, engine: str, runs: Path) -> EngineRun:
        """Name the run in the folder that `run_folder` gives it."""
        return cls(scene=scene, engine=engine, folder=run_folder(runs, scene, engine))

    def is_finished(self) -> bool:
        """Tell whether it is there, unchanged."""
        return finished_run(self.scene, self.engine, self.folder) is not None

    def record(self, progress: Progress | None = None) -> RunRecord:
        """Run it, or take the finished run where it is unchanged. Raises EngineError."""
        return run_engine(self.scene, self.engine, self.folder, progress, self.ranks)

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
    those made.
    """

    made: int = 0
    reused: int = 0
    failed: int = 0
    cpu_seconds: float = 0.0

    def __add__(self, other: Cost) -> Cost:
        return Cost(
            made=self.made + other.made,
            reused=self.reused + other.reused,
            failed=self.failed + other.failed,
            cpu_seconds=self.cpu_seconds + other.cpu_seconds,
        )


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
    asked = list({run.folder: run for run in runs}.values())
    wanted = [run for run in asked if not run.is_finished()]
    costs = {run.folder: Cost(reused=1) for run in asked if run not in wanted}
    if not wanted:
        return costs
    tasks = [Task(call=_cost_of, arguments=(run,), work=run.particle_steps) for run in wanted]
    with workers(min(processes or os.cpu_count() or 1, len(wanted)), scheduler) as executor:
        made = do_all(tasks, executor, "engine runs", progress)
    return costs | {run.folder: cost for run, cost in zip(wanted, made, strict=True)}


def _cost_of(run: EngineRun) -> Cost:
    try:
        return Cost(made=1, cpu_seconds=run.record().cpu_seconds)
    except EngineError as error:
        log.info("%s, %s: %s", run.scene.name, run.engine, error)
        return Cost(failed=1)
