"""Runs of engines: where they live, which are finished, and making those that are not."""

from __future__ import annotations

import functools
import logging
from pathlib import Path

from analysis.engines import engine
from analysis.engines.record import EngineError, RunRecord
from analysis.scene.scene import Scene
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
