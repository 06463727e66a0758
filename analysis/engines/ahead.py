"""The engine runs that a page needs, made ahead: several at once, the longest first."""

from __future__ import annotations

import logging
import multiprocessing
import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from analysis.engines import EngineError, RunRecord
from analysis.engines.penalty import penalty_of
from analysis.engines.run import finished_run, run_engine, run_folder
from analysis.scene.scene import Scene
from analysis.support.progress import Progress

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EngineRun:
    """A scene, the name of the engine that runs it, and the folder of its results."""

    scene: Scene
    engine: str
    folder: Path

    @classmethod
    def of(cls, scene: Scene, engine: str, runs: Path) -> EngineRun:
        """The run in the folder that `run_folder` gives it."""
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
    """What runs cost: how many were made now, taken as they were, failed; CPU seconds of those
    made."""

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


def make_ahead(
    runs: Sequence[EngineRun], progress: Progress | None = None, processes: int | None = None
) -> dict[Path, Cost]:
    """Make the runs in as many processes as there are cores; return what each folder cost.

    A run that fails is left to who needs it, who says so. In processes of their own, since the CPU
    time of an engine is measured as that of the children of its process."""
    costs: dict[Path, Cost] = {}
    wanted = []
    for run in sorted(
        {run.folder: run for run in runs}.values(), key=lambda run: -run.particle_steps
    ):
        if _is_there(run):
            costs[run.folder] = Cost(reused=1)
        else:
            wanted.append(run)
    if not wanted:
        return costs
    total, done = sum(run.particle_steps for run in wanted), 0
    if progress:
        progress("engine runs", 0.0)
    pool = ProcessPoolExecutor(
        min(processes or os.cpu_count() or 1, len(wanted)), multiprocessing.get_context("spawn")
    )
    try:
        pending = {pool.submit(_make, run): run for run in wanted}
        for future in as_completed(pending):
            run = pending[future]
            costs[run.folder] = future.result()
            done += run.particle_steps
            if progress:
                progress("engine runs", done / total)
    finally:
        # an interrupted build ends with the runs that are under way
        pool.shutdown(cancel_futures=True)
    return costs


def _is_there(run: EngineRun) -> bool:
    try:
        return finished_run(run.scene, run.engine, run.folder) is not None
    except EngineError:
        return False


def _make(run: EngineRun) -> Cost:
    try:
        return Cost(made=1, cpu_seconds=run.record().cpu_seconds)
    except EngineError as error:
        log.info("%s, %s: %s", run.scene.name, run.engine, error)
        return Cost(failed=1)
    except KeyboardInterrupt:
        # the pool would give this process the next run: its engine has been stopped, so no more of
        # them
        os._exit(1)
