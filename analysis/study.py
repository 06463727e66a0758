"""A study: one scene run by several engines at several stiffnesses, each run compared with its percussions."""

from __future__ import annotations

import functools
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.compare import Comparison, compare_run
from analysis.engines import engine
from analysis.engines.guard import RunStoppedError
from analysis.engines.record import EngineError, RunRecord
from analysis.scene import Scene

log = logging.getLogger(__name__)
Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Study:
    """The comparisons of one scene, in order of engine and stiffness; the runs that their guard stopped or that failed; and
    what else a reader should know."""

    scene: Scene
    comparisons: list[Comparison]
    failures: list[str]
    warnings: list[str]


def run_folder(out: Path, scene: Scene, engine_name: str) -> Path:
    """Where a run of the scene lives: out/<scene>/<engine>_<law>_k<stiffness>."""
    return out / scene.name / f"{engine_name}_{scene.contact.law}_k{scene.contact.stiffness_N_per_m:.6g}"


def finished_run(scene: Scene, engine_name: str, folder: Path) -> RunRecord | None:
    """The finished run that is in the folder if scene, decks, engine and version are the same, else None.

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


def run_engine(scene: Scene, engine_name: str, folder: Path, progress: Progress | None = None) -> RunRecord:
    """Run the scene, or take the finished run that is in the folder if scene, decks, engine and version are the same.

    Raises EngineError.
    """
    chosen = engine(engine_name)
    if record := finished_run(scene, engine_name, folder):
        log.info("%s: unchanged, taken from %s", scene.name, folder)
        return record
    label = f"{scene.name}: {engine_name}, k = {scene.contact.stiffness_N_per_m:.3g} N/m"
    chosen.prepare(scene, folder)
    return chosen.run(folder, progress=(lambda share: progress(label, share)) if progress else None)


def study(
    scene: Scene,
    engines: Sequence[str],
    stiffnesses: Sequence[float],
    out: Path,
    progress: Progress | None = None,
) -> Study:
    """Run and compare. A run that is stopped or fails becomes a failure, a missing engine a warning; the rest goes on.

    Raises EngineError if no run was even tried.
    """
    comparisons: list[Comparison] = []
    failures: list[str] = []
    warnings = scene.check(scene.name)
    for name in engines:
        for stiffness in stiffnesses:
            variant = scene.with_contact(stiffness_N_per_m=stiffness)
            folder = run_folder(out, variant, name)
            try:
                run_engine(variant, name, folder, progress)
                comparisons.append(compare_run(folder))
            except EngineError as error:
                words = f"{name}, k = {stiffness:.3g} N/m: {error}"
                (failures if isinstance(error, RunStoppedError) else warnings).append(words)
    if not comparisons and not failures:
        raise EngineError(f"scene {scene.name}: no engine ran: " + "; ".join(warnings))
    for comparison in comparisons:
        if comparison.answer.status != "solved":
            warnings.append(
                f"percussions of {comparison.record.engine}'s snapshot: {comparison.answer.status}: {comparison.answer.reason}"
            )
        warnings.extend(comparison.answer.warnings)
    return Study(scene=scene, comparisons=comparisons, failures=failures, warnings=warnings)
