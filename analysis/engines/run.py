"""Runs of engines: where they live, which are finished, and running those that are not, one by one
or several at once."""

from __future__ import annotations

import functools
import logging
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.engines import engine
from analysis.engines.penalty import penalty_of
from analysis.engines.record import EngineError, RunRecord
from analysis.scene.scene import Scene
from analysis.support.parallel import Task, do_all, workers
from analysis.support.progress import Progress

log = logging.getLogger(__name__)


def run_folder(out: Path, scene: Scene, engine_name: str) -> Path:
    """Where a run of the scene lives: out/<scene>/<engine>_<law>_k<stiffness>."""
    return (
        out
        / scene.name
        / f"{engine_name}_{scene.contact.law}_k{scene.contact.stiffness_N_per_m:.6g}"
    )


def finished_run(scene: Scene, engine_name: str, folder: Path) -> RunRecord | None:
    """The finished run that is in the folder if scene, decks, engine and version are the same, else
    None.

    Raises EngineError for an unknown engine.
    """
    chosen = engine(engine_name)
    command = chosen.find()
    try:
        record = RunRecord.read(folder)
    except EngineError:
        return None
    same = (
        record.exit_state == "finished"
        and record.scene_digest == scene.digest()
        and record.deck_digest == chosen.deck_digest()
    )
    return record if same and command and record.version == _version(engine_name, command) else None


@functools.cache
def _version(engine_name: str, command: Path) -> str | None:
    """Asked once: a study has many runs, and asking starts the engine."""
    return engine(engine_name).version()


def run_engine(
    scene: Scene, engine_name: str, folder: Path, progress: Progress | None = None
) -> RunRecord:
    """Run the scene, or take the finished run that is in the folder if scene, decks, engine and
    version are the same.

    Raises EngineError.
    """
    chosen = engine(engine_name)
    if record := finished_run(scene, engine_name, folder):
        log.info("%s: unchanged, taken from %s", scene.name, folder)
        return record
    label = f"{scene.name}: {engine_name}, k = {scene.contact.stiffness_N_per_m:.3g} N/m"
    chosen.prepare(scene, folder)
    return chosen.run(folder, progress=(lambda share: progress(label, share)) if progress else None)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EngineRun:
    """A run that somebody needs.

    scene: what is run; engine: the name of the engine that runs it; folder: where its results are.
    """

    scene: Scene
    engine: str
    folder: Path

    @classmethod
    def of(cls, scene: Scene, engine: str, runs: Path) -> EngineRun:
        """Name the run in the folder that `run_folder` gives it."""
        return cls(scene=scene, engine=engine, folder=run_folder(runs, scene, engine))

    def record(self, progress: Progress | None = None) -> RunRecord:
        """Run it, or take the finished run where it is unchanged. Raises EngineError."""
        return run_engine(self.scene, self.engine, self.folder, progress)

    @property
    def particle_steps(self) -> int:
        """Disks times steps: what its cost grows with."""
        return len(self.scene.snapshot) * penalty_of(self.scene).steps


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
    runs: Sequence[EngineRun], progress: Progress | None = None, processes: int | None = None
) -> dict[Path, Cost]:
    """Run what is not finished, in as many processes as there are cores; return what each folder
    cost.

    A run that fails is left to who needs it, who says so. In processes of their own, since the CPU
    time of an engine is measured as that of the children of its process."""
    asked = list({run.folder: run for run in runs}.values())
    wanted = [run for run in asked if not _is_there(run)]
    costs = {run.folder: Cost(reused=1) for run in asked if run not in wanted}
    if not wanted:
        return costs
    tasks = [Task(call=_cost_of, arguments=(run,), work=run.particle_steps) for run in wanted]
    with workers(min(processes or os.cpu_count() or 1, len(wanted))) as executor:
        made = do_all(tasks, executor, "engine runs", progress)
    return costs | {run.folder: cost for run, cost in zip(wanted, made, strict=True)}


def _is_there(run: EngineRun) -> bool:
    try:
        return finished_run(run.scene, run.engine, run.folder) is not None
    except EngineError:
        return False


def _cost_of(run: EngineRun) -> Cost:
    try:
        return Cost(made=1, cpu_seconds=run.record().cpu_seconds)
    except EngineError as error:
        log.info("%s, %s: %s", run.scene.name, run.engine, error)
        return Cost(failed=1)
