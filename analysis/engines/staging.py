"""The folder in which an engine works, and its process: results appear whole, or the earlier ones stay."""

from __future__ import annotations

import contextlib
import dataclasses
import logging
import os
import re
import resource
import shutil
import signal
import subprocess
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from analysis.dumps import DumpError, index_dump
from analysis.engines.penalty import penalty_of
from analysis.engines.record import FINISHED, EngineError, RunRecord
from analysis.scene import Scene, read_scene

Progress = Callable[[float], None]
SCENE_FILE = "scene.toml"
LAST_LINES = 12
# Contacts only dissipate, so kinetic energy stays below the larger of its start and that of everybody at the desired speed.
ENERGY_MARGIN = 1.1
_STEP = re.compile(r"^\s*(\d+)\s+[\d.e+-]+\s+\d+\s")  # step, time, disks, …
_log = logging.getLogger(__name__)


def staging_folder(folder: Path) -> Path:
    """Where a run is prepared and works until it is whole: a hidden folder beside `folder`."""
    folder = folder.absolute()
    return folder.with_name(f".{folder.name}.next")


def stage(scene: Scene, folder: Path, engine: str, version: str) -> Path:
    """Write scene.toml, scene.data and the record of the run to come into a new staging folder; return it."""
    staging = staging_folder(folder)
    if staging.exists():
        shutil.rmtree(staging)
    staging.mkdir(parents=True)
    scene.model_copy(update={"name": "scene"}).write(staging)
    penalty = penalty_of(scene)
    if penalty.time_step > 1.000001 * penalty.safe_time_step:
        _log.warning(
            "%s: the time step %.3g s is longer than the safe one, %.3g s", scene.name, penalty.time_step, penalty.safe_time_step
        )
    RunRecord.prepared(engine, version, scene, penalty).write(staging)
    return staging


@contextlib.contextmanager
def staged(folder: Path, engine: str) -> Iterator[tuple[Path, RunRecord, Scene]]:
    """The prepared staging folder, its record and scene. When the block ends well the staging folder becomes `folder`;
    when it does not (an error, Ctrl-C), it is removed and `folder` stays as it was."""
    staging = staging_folder(folder)
    if not staging.is_dir():
        raise EngineError(f"{folder}: nothing is prepared there for {engine}; prepare a scene first")
    try:
        record = RunRecord.read(staging)
        if record.engine != engine:
            raise EngineError(f"{folder}: prepared for {record.engine}, not for {engine}")
        scene = read_scene(staging / SCENE_FILE).model_copy(update={"name": record.scene})
        yield staging, record, scene
        earlier = folder.absolute().with_name(f".{folder.name}.earlier")
        if folder.exists():
            folder.rename(earlier)
        staging.rename(folder)
        shutil.rmtree(earlier, ignore_errors=True)
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def run_process(
    command: Sequence[str], staging: Path, record: RunRecord, progress: Progress | None, environment: Mapping[str, str] | None = None
) -> RunRecord:
    """Run an engine in its staging folder and return the record with its cost.

    What the engine says goes to screen.log; lines of step, time and disks drive `progress`.
    Raises EngineError with the last lines for an exit status other than 0. The engine ends with this call, whatever
    ends it.
    """
    last: deque[str] = deque(maxlen=LAST_LINES)
    step = 0
    start, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    process = subprocess.Popen(
        command, cwd=staging, env={**os.environ, **(environment or {})}, stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", start_new_session=True,
    )
    try:
        assert process.stdout is not None
        with (staging / "screen.log").open("w", encoding="utf-8") as log:
            for line in process.stdout:
                log.write(line)
                if line.strip():
                    last.append(line.rstrip())
                if found := _STEP.match(line):
                    step = min(int(found[1]), record.steps)
                    if progress:
                        progress(step / max(record.steps, 1))
        status = process.wait()
    finally:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        assert process.stdout is not None
        process.stdout.close()
    if status != 0:
        raise EngineError(
            f"{record.engine} stopped with status {status} after step {step} (t = {step * record.time_step_s:.6g} s) "
            f"of {record.scene}. {_ADVICE}\n  " + "\n  ".join(last)
        )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return dataclasses.replace(
        record, wall_seconds=time.perf_counter() - start, cpu_seconds=cpu, exit_state=FINISHED
    )


_ADVICE = "If disks were lost or moved too fast, give a smaller time step (run.time_step_s), or none: then it follows from the stiffness."


def check_bodies(path: Path, record: RunRecord, scene: Scene) -> None:
    """Read the whole body dump and raise EngineError naming the time of the first frame that cannot be right: disks that
    are missing, values that are not finite, more kinetic energy than the start and the drive can give, missing frames."""
    snapshot = scene.snapshot
    speed = scene.drive.speed_m_per_s if scene.drive else 0.0
    kinetic = 0.5 * float(snapshot.mass @ (snapshot.velocity**2).sum(1))
    most = ENERGY_MARGIN * max(kinetic, 0.5 * speed**2 * float(snapshot.mass.sum()))
    try:
        index = index_dump(path)
        for frame, (step, count) in enumerate(zip(index.steps, index.counts, strict=True)):
            where = f"{record.engine}, {record.scene}, t = {step * record.time_step_s:.6g} s (step {step})"
            if count != record.disks:
                raise EngineError(f"{where}: {record.disks - count} of {record.disks} disks are lost. {_ADVICE}")
            table = index.table(frame)
            if not np.isfinite(table).all():
                raise EngineError(f"{where}: not a finite number in column {_first_bad(index.columns, table)}. {_ADVICE}")
            mass, vx, vy = (table[:, index.columns.index(name)] for name in ("mass", "vx", "vy"))
            energy = 0.5 * float(mass @ (vx * vx + vy * vy))
            if energy > most:
                raise EngineError(
                    f"{where}: kinetic energy {energy:.4g} J; the start and the drive can give {most / ENERGY_MARGIN:.4g} J. {_ADVICE}"
                )
    except DumpError as error:
        raise EngineError(f"{record.engine}, {record.scene}: {error}. {_ADVICE}") from None
    expected = tuple(range(0, record.steps + 1, record.frame_interval))
    if index.steps != expected:
        raise EngineError(f"{record.engine}, {record.scene}: {len(index.steps)} frames where {len(expected)} are due. {_ADVICE}")


def _first_bad(columns: Sequence[str], table: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> str:
    return columns[int(np.argmin(np.isfinite(table).all(0)))]
