"""Random crowds at an exit: gathered by an engine, at rest behind a blocked exit, or grown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.compare.comparison import Comparison, compare_run
from analysis.dumps import open_bodies, snapshot_of
from analysis.engines import PENALTY, EngineError
from analysis.engines.run import EngineRun
from analysis.paper.discrete.pressed_crowd.arch import Arch
from analysis.scene.packing import heap
from analysis.scene.shipped_scenes import MASS_KG, make
from analysis.support.progress import Progress
from nscd import Snapshot

# The scene `jam`: disks too large for the exit, so that an arch really blocks it.
BLOCKED_SEEDS: Sequence[int] = range(1, 6)
STIFFNESSES = (1e6, 1e7)  # N/m, of the blocked crowds
# At rest nobody inside has a larger right velocity, and no larger share of the drive accelerates.
AT_REST_M_PER_S, AT_REST_SHARE = 0.01, 1e-3
MEAN_RADIUS_M = 0.17  # of the scene `arch`


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Blocked:
    """A crowd at rest behind an exit that an arch blocks: its percussions, and beside the engine's
    forces."""

    seed: int
    arch: Arch
    comparison: Comparison

    @property
    def stiffness(self) -> float:
        """k of the engine's contacts (N/m)."""
        return self.comparison.scene.contact.stiffness_N_per_m


def installed_engine() -> str:
    """Name the first engine that is there. Raises EngineError if none is."""
    name = next((engine.NAME for engine in PENALTY if engine.find() is not None), None)
    if name is None:
        raise EngineError("no engine is installed to gather a crowd")
    return name


def gathered(run: EngineRun) -> Arch:
    """Solve the last frame of a run. Raises EngineError."""
    record = run.record()
    bodies = run.folder / "bodies.dump"
    last = open_bodies(bodies, record.time_step_s).trajectory[-1]
    return Arch.of(run.scene, snapshot_of(last, bodies))


def grown(people: int, seed: int) -> Arch:
    """Solve a heap grown disk by disk at the shut exit, at the instant when it opens.

    Its disks are those of the scene `arch` in size, they touch without overlap and just carry one
    another: an arch as it forms, before anybody has moved."""
    scene = make("arch", people, seed)
    assert scene.drive is not None
    ends = np.array([scene.drive.door_start_m, scene.drive.door_end_m])
    half = 0.5 * float(np.hypot(*(ends[1] - ends[0])))
    position, radius = heap(people, seed, MEAN_RADIUS_M, half)
    still, mass = np.zeros_like(position), np.full(people, MASS_KG)
    return Arch.of(scene, Snapshot(position=position, velocity=still, radius=radius, mass=mass))


def blocked_runs(runs: Path) -> list[EngineRun]:
    """List the runs of `blocked`. Raises EngineError."""
    engine, folder = installed_engine(), runs / "jam_seeds"
    return [
        EngineRun(
            scene=make("jam", None, seed)
            .with_contact(stiffness_N_per_m=stiffness)
            .with_run(frames=1),
            engine=engine,
            folder=folder / f"{engine}_seed{seed}_k{stiffness:.0e}",
        )
        for stiffness in STIFFNESSES
        for seed in BLOCKED_SEEDS
    ]


def blocked(runs: Path, progress: Progress | None = None) -> list[Blocked]:
    """Find the crowds of BLOCKED_SEEDS that an arch stopped, and that have come to rest.

    Raises EngineError."""
    found, wanted = [], blocked_runs(runs)
    seeds = [*BLOCKED_SEEDS] * len(STIFFNESSES)
    for done, (seed, run) in enumerate(zip(seeds, wanted, strict=True), start=1):
        arch, comparison = gathered(run), compare_run(run.folder)
        stopped = np.hypot(*arch.answer.right_velocity[arch.inside()].T).max() < AT_REST_M_PER_S
        if stopped and comparison.balance.unbalanced < AT_REST_SHARE:
            found.append(Blocked(seed=seed, arch=arch, comparison=comparison))
        if progress:
            progress("blocked exits", done / len(wanted))
    return found
