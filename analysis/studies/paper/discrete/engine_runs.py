"""Engine runs that figures read: by which engine, how they end, and what those say that fail."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from analysis.dumps import DumpError, open_bodies, snapshot_of
from analysis.engines import PENALTY, EngineError
from analysis.engines.run import EngineRun
from analysis.scene.scene import Scene
from analysis.support.parallel import Progress
from nscd import Snapshot

Read = TypeVar("Read")
Run = TypeVar("Run", bound=EngineRun)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SeededRun(EngineRun):
    """The run of a random crowd."""

    seed: int


def installed_engine() -> str | None:
    """Name the first engine that is there; None without any."""
    return next((engine.NAME for engine in PENALTY if engine.find() is not None), None)


def end_of(run: EngineRun, progress: Progress | None = None) -> Snapshot:
    """Read the disks at the end of a run, made now or earlier. Raises EngineError, DumpError."""
    record = run.record(progress)
    bodies = run.folder / "bodies.dump"
    return snapshot_of(open_bodies(bodies, record.time_step_s).trajectory[-1], bodies)


def seeded_runs(crowds: Iterable[tuple[str, int, Scene]], folder: Path) -> list[SeededRun]:
    """List the runs of crowds (name, seed, scene) by the first engine that is there; none without."""
    if (engine := installed_engine()) is None:
        return []
    return [
        SeededRun(scene=scene, engine=engine, folder=folder / f"{engine}_{name}", seed=seed)
        for name, seed, scene in crowds
    ]


def each(runs: Iterable[Run], read: Callable[[Run], Read], warnings: list[str]) -> list[Read]:
    """Read every run; one that is missing, fails or cannot be read becomes a warning."""
    found = []
    for run in runs:
        try:
            found.append(read(run))
        except (EngineError, DumpError) as error:
            warnings.append(f"{run.scene.name}, {run.engine}: {error}")
    return found
