"""An arch as the engines gathered it, and what its percussions say in words."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from analysis.compare.study import Study, study
from analysis.engines import ENGINES
from analysis.engines.run import EngineRun
from analysis.pages.section import Section
from analysis.paper.discrete.fig4_fig5_arches.pressed_crowd import Arch, carried_interval
from analysis.paper.discrete.fig4_fig5_arches.tables import engine_name
from analysis.scene.scene import Scene
from analysis.support.progress import Progress
from nscd.indeterminacy.determinacy import admissible_determinacy, determinacy

EVERY: Sequence[str] = [engine.NAME for engine in ENGINES]


def arch_runs(scene: Scene, runs: Path) -> list[EngineRun]:
    """The scene by every engine."""
    return [EngineRun.of(scene, engine, runs) for engine in EVERY]


def arch_study(scene: Scene, runs: Path, progress: Progress | None) -> Study:
    """The scene by every engine, each compared with its percussions. Raises EngineError if no
    engine ran."""
    return study(scene, EVERY, [scene.contact.stiffness_N_per_m], runs, progress)


def without_crowd(number: str, title: str, reason: str) -> Section:
    """What is left of a section where no engine gathered its crowd."""
    return Section(
        number=number, title=title, words=(), pictures=(), tables=(), differs=(), warnings=(reason,)
    )


def snapshot_words(arch: Arch, found: Study) -> list[str]:
    inside, distance = arch.inside(), arch.distance()
    near = inside & (distance <= 3.0)
    known = determinacy(arch.contacts, len(arch.snapshot))
    allowed = admissible_determinacy(arch.contacts, arch.answer)
    carried, resultant = arch.carried(), arch.resultants()
    most, most_vector = arch.largest(carried), arch.largest(resultant)
    lower, upper = carried_interval(arch, most)
    drive = arch.snapshot.mass * np.hypot(*arch.left_velocity.T) / arch.window
    back = found.comparisons[0]
    sure = int(allowed.determined.sum())
    where, where_vector = f"{distance[most]:.2f} m", f"{distance[most_vector]:.2f} m"
    fixed = "determined" if upper - lower < 1e-6 * upper else "not determined"
    return [
        f"{inside.sum()} of {len(inside)} people are still inside after {found.scene.analysis.time_s:g} s, "
        f"{near.sum() / (4.5 * np.pi):.1f} per m² within 3 m of the exit. Gathered by {engine_name(back)}; "
        f"{back.balance.unbalanced:.0%} of the drive still accelerates people.",
        "The vector sum at a person is m |u⁺ − u⁻|/τ, whatever the pressing: for people at rest it is the drive, "
        f"{drive.mean():.0f} N on average. Inside, its mean is {resultant[inside].mean():.0f} N, its maximum "
        f"{resultant[most_vector]:.0f} N at {where_vector} from the middle of the exit.",
        f"The sum of magnitudes shows the pressing: its mean is {carried[inside].mean():.0f} N, its maximum "
        f"{carried[most]:.0f} N at {where}, {arch.angle_degrees()[most]:.0f}° from the axis of the exit. The maximum lies in "
        f"the proven interval [{lower:.1f}, {upper:.1f}] N: it is {fixed}. Vector sums always are determined.",
        f"{len(arch.contacts)} contacts, rank {known.rank}: {known.redundant} redundant. Balance alone determines "
        f"{known.determined.sum()} forces, balance of forces that only push {sure}; the other {len(arch.contacts) - sure} "
        "are those of least elastic energy.",
    ]


def own_warnings(arch: Arch) -> list[str]:
    found = arch.answer
    return (
        []
        if found.status == "solved"
        else [f"percussions of the snapshot: {found.status}: {found.reason}"]
    )
