"""The scenes of a report in motion: which runs they need, and what the report takes of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from analysis.engines.run import EngineRun
from analysis.motion.headline.section import headline_numbers, headline_section
from analysis.motion.section import motion_numbers, motion_section
from analysis.motion.study import motion_runs, study_motion
from analysis.pages.report import InMotion
from analysis.scene.scene import Scene
from analysis.support.progress import Progress

Chosen = Sequence[tuple[Scene, Sequence[float]]]
Runs = Mapping[str, Sequence[EngineRun]]


def motion_of(
    scene: Scene, engines: Sequence[str], stiffnesses: Sequence[float], crowds: int, out: Path
) -> Runs:
    """List the runs of a scene in motion by model; none of an impact, which is over at once."""
    if scene.drive is None or scene.analysis.kind == "impact" or not crowds:
        return {}
    return motion_runs(scene, engines, stiffnesses, crowds, out)


def runs_of(
    chosen: Chosen, soft: Sequence[str], motions: Sequence[Runs], out: Path
) -> list[EngineRun]:
    """List every run that a report needs once: of its snapshots and of its crowds in motion."""
    every = [
        EngineRun.of(scene.with_contact(stiffness_N_per_m=k), name, out)
        for scene, stiffnesses in chosen
        for k in stiffnesses
        for name in soft
    ]
    every += [run for motion in motions for runs in motion.values() for run in runs]
    return list({run.folder: run for run in every}.values())


def in_motion(
    scene: Scene, runs: Runs, last_s: float, progress: Progress | None = None
) -> InMotion | None:
    """Run and read a scene in motion; None where there are no runs of it."""
    if not runs:
        return None
    study = study_motion(scene, runs, last_s, progress)
    return InMotion(
        first=headline_section(study),
        section=motion_section(study),
        numbers=motion_numbers(study) | {"exposure": headline_numbers(study)},
        failures=study.failures,
    )
