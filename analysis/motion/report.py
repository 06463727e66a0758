"""The scenes of a report in motion: which runs they need, and what the report takes of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.compare.study import soft_models
from analysis.engines import PENALTY
from analysis.engines.run import EngineRun
from analysis.motion.headline import headline_numbers, headline_section
from analysis.motion.section import motion_numbers, motion_section
from analysis.motion.study import FEW, FRICTION, MANY, motion_runs, study_motion
from analysis.pages.report import InMotion
from analysis.scene.scene import Scene
from analysis.support.parallel import Progress


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chosen:
    """Name a scene of a report, and the stiffnesses (N/m) of the first engine with springs and of
    the further ones, which agree with it contact by contact."""

    scene: Scene
    stiffnesses: Sequence[float]
    further: Sequence[float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Moving:
    """Hold the runs of a scene in motion, by model; and, of fewer crowds, those of the same with
    the other friction."""

    scene: Scene
    other: Scene
    runs: Mapping[str, Sequence[EngineRun]]
    rough: Mapping[str, Sequence[EngineRun]]


def moves(scene: Scene) -> bool:
    """Tell whether a scene goes on: it is driven, and no impact, which is over at once."""
    return scene.drive is not None and scene.analysis.kind != "impact"


def motion_of(
    scene: Scene, engines: Sequence[str], stiffnesses: Sequence[float], crowds: int, out: Path
) -> Moving | None:
    """List the runs of a scene in motion by model; None of one that does not move, or of no
    replicates."""
    if not (moves(scene) and crowds):
        return None
    other = scene.with_contact(friction=0.0 if scene.contact.friction else FRICTION)
    fewer = crowds if crowds >= MANY else min(crowds, max(FEW, crowds // 2))
    soft = [known.NAME for known in PENALTY if known.NAME in engines]
    # further engines with springs would show once more that they agree
    some = [name for name in engines if name not in soft[1:]]
    return Moving(
        scene=scene,
        other=other,
        runs=motion_runs(scene, engines, stiffnesses, crowds, out),
        rough=motion_runs(other, some, stiffnesses[:1], fewer, out),
    )


def snapshot_runs(out: Path, motion: Moving | None) -> Path:
    """Return where the runs of a scene's snapshots are: those of crowd 0 of a scene in motion."""
    return out / "crowd_0" if motion else out


def runs_of(
    chosen: Sequence[Chosen], soft: Sequence[str], motions: Sequence[Moving | None], out: Path
) -> list[EngineRun]:
    """List every run that a report needs once: of its snapshots and of its crowds in motion."""
    every = []
    for one, motion in zip(chosen, motions, strict=True):
        scene = one.scene.with_run(impulses=True) if motion else one.scene
        every += [
            EngineRun.of(scene.with_contact(stiffness_N_per_m=k), name, snapshot_runs(out, motion))
            for name, k in soft_models(soft, one.stiffnesses, one.further)
        ]
        for models in (motion.runs, motion.rough) if motion else ():
            every += [run for runs in models.values() for run in runs]
    return list({run.folder: run for run in every}.values())


def in_motion(
    scene: Scene,
    moving: Moving | None,
    last_s: float,
    progress: Progress | None = None,
    limits: tuple[Path, ...] = (),
) -> InMotion | None:
    """Run and read a scene in motion; without replicates it has a first screen only, and None of
    one that does not move. limits: files of users' own."""
    if moving is None:
        if not moves(scene):
            return None
        return InMotion(first=headline_section(scene), sections=[], numbers={}, failures=[])
    study = study_motion(moving.scene, moving.runs, last_s, progress, limits)
    rough = study_motion(moving.other, moving.rough, last_s, progress, limits)
    numbers = motion_numbers(study) | {"exposure": headline_numbers(study)}
    return InMotion(
        first=headline_section(study.scene, study, rough),
        sections=[motion_section(study), motion_section(rough, study)],
        numbers=numbers | {"other_friction": motion_numbers(rough)},
        failures=[*study.failures, *rough.failures],
    )
