"""The folder in which an engine works, and its process: results appear whole, or the earlier ones
stay."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import logging
import os
import re
import resource
import shutil
import signal
import subprocess
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from analysis.engines.guard import STOPPED_STATUS, RunStoppedError, Verdict, died, stopped
from analysis.engines.penalty import penalty_of
from analysis.engines.record import FAILED, FINISHED, STOPPED, EngineError, RunRecord
from analysis.scene.scene import Scene, read_scene

Progress = Callable[[float], None]
SCENE_FILE = "scene.toml"
LAST_LINES = 12
_STEP = re.compile(r"^\s*(\d+)\s+[\d.e+-]+\s+\d+\s")  # step, time, disks, …
_log = logging.getLogger(__name__)


def staging_folder(folder: Path) -> Path:
    """Where a run is prepared and works until it is whole: a hidden folder beside `folder`."""
    folder = folder.absolute()
    return folder.with_name(f".{folder.name}.next")


def digest_of(files: Iterable[Path]) -> str:
    """SHA-256 of the names and contents of files."""
    content = hashlib.sha256()
    for path in sorted(files):
        content.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return content.hexdigest()


def stage(scene: Scene, folder: Path, engine: str, version: str, deck_digest: str) -> Path:
    """Write scene.toml, scene.data and the record of the run to come into a new staging folder;
    return it."""
    staging = staging_folder(folder)
    if staging.exists():
        shutil.rmtree(staging)
    staging.mkdir(parents=True)
    scene.model_copy(update={"name": "scene"}).write(staging)
    penalty = penalty_of(scene)
    if penalty.time_step > 1.000001 * penalty.safe_time_step:
        _log.warning(
            "%s: the time step %.3g s is longer than the safe one, %.3g s",
            scene.name,
            penalty.time_step,
            penalty.safe_time_step,
        )
    RunRecord.prepared(engine, version, deck_digest, scene, penalty).write(staging)
    return staging


@contextlib.contextmanager
def staged(folder: Path, engine: str) -> Iterator[tuple[Path, RunRecord, Scene]]:
    """The prepared staging folder, its record and scene. When the block ends well the staging
    folder becomes `folder`; when it does not (an error, Ctrl-C), it is removed and `folder` stays
    as it was. A run that was stopped or failed becomes `folder` too, with the reason in its record,
    where no finished run is there."""
    staging = staging_folder(folder)
    if not staging.is_dir():
        raise EngineError(
            f"{folder}: nothing is prepared there for {engine}; prepare a scene first"
        )
    try:
        record = RunRecord.read(staging)
        if record.engine != engine:
            raise EngineError(f"{folder}: prepared for {record.engine}, not for {engine}")
        scene = read_scene(staging / SCENE_FILE).model_copy(update={"name": record.scene})
        try:
            yield staging, record, scene
        except RunStoppedError as end:
            if not _holds_results(folder):
                end.record.write(staging)
                _publish(staging, folder)
            raise
        _publish(staging, folder)
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _publish(staging: Path, folder: Path) -> None:
    earlier = folder.absolute().with_name(f".{folder.name}.earlier")
    if folder.exists():
        folder.rename(earlier)
    staging.rename(folder)
    shutil.rmtree(earlier, ignore_errors=True)


def _holds_results(folder: Path) -> bool:
    """Whether there is anything that a stopped run must not replace: all but another stopped
    run."""
    try:
        return RunRecord.read(folder, even_stopped=True).exit_state not in (STOPPED, FAILED)
    except EngineError:
        return folder.exists()


def run_process(
    command: Sequence[str],
    staging: Path,
    record: RunRecord,
    progress: Progress | None,
    environment: Mapping[str, str] | None = None,
) -> RunRecord:
    """Run an engine in its staging folder and return the record with its cost.

    What the engine says goes to screen.log; lines of step, time and disks drive `progress`. Raises
    RunStoppedError: with what the guard said, or the last lines, for an exit status other than 0.
    The engine ends with this call, whatever ends it."""
    last: deque[str] = deque(maxlen=LAST_LINES)
    step = 0
    start, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    process = subprocess.Popen(
        command,
        cwd=staging,
        env={**os.environ, **(environment or {})},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,
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
        if process.poll() is None:
            # the whole group: `lmp` of a Python environment starts the real one
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        assert process.stdout is not None
        process.stdout.close()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    record = dataclasses.replace(record, wall_seconds=time.perf_counter() - start, cpu_seconds=cpu)
    verdict = Verdict.of(last) if status == STOPPED_STATUS else None
    if verdict:
        raise stopped(record, verdict)
    if status != 0:
        raise died(record, status, step, last)
    return dataclasses.replace(record, exit_state=FINISHED)
