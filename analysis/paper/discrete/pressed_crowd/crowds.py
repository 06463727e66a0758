"""Random crowds at an exit: gathered by an engine, at rest behind a blocked exit, or grown."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.compare.comparison import Comparison, compare_run
from analysis.engines.run import EngineRun
from analysis.paper.discrete.engine_runs import SeededRun, each, end_of, installed_engine
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
    def at_rest(self) -> bool:
        """Whether an arch stopped it, and it has come to rest."""
        fastest = np.hypot(*self.arch.answer.right_velocity[self.arch.inside()].T).max()
        return bool(fastest < AT_REST_M_PER_S and self.still)

    @property
    def still(self) -> bool:
        """Whether it has come to rest in the engine, whatever the percussions say."""
        return self.comparison.balance.unbalanced < AT_REST_SHARE

    @property
    def stiffness(self) -> float:
        """k of the engine's contacts (N/m)."""
        return self.comparison.scene.contact.stiffness_N_per_m


def gathered(run: EngineRun) -> Arch:
    """Solve the last frame of a run. Raises EngineError, DumpError."""
    return Arch.of(run.scene, end_of(run))


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


def blocked_runs(runs: Path) -> list[SeededRun]:
    """List the runs of `blocked`; none without an engine."""
    engine, folder = installed_engine(), runs / "jam_seeds"
    return [
        SeededRun(
            scene=make("jam", None, seed)
            .with_contact(stiffness_N_per_m=stiffness)
            .with_run(frames=1),
            engine=engine,
            folder=folder / f"{engine}_seed{seed}_k{stiffness:.0e}",
            seed=seed,
        )
        for stiffness in STIFFNESSES
        for seed in BLOCKED_SEEDS
        if engine is not None
    ]


def blocked(runs: Path, warnings: list[str], progress: Progress | None = None) -> list[Blocked]:
    """Solve the crowds of BLOCKED_SEEDS, at rest or not; one whose run fails is a warning."""
    wanted, done = blocked_runs(runs), 0

    def read(run: SeededRun) -> Blocked:
        nonlocal done
        done += 1
        if progress:
            progress("blocked exits", done / len(wanted))
        return Blocked(seed=run.seed, arch=gathered(run), comparison=compare_run(run.folder))

    return each(wanted, read, warnings)
