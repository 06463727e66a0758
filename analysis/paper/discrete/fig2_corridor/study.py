"""The push in a corridor: percussions, which act at a distance at once, and soft contacts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

import numpy as np

from analysis.compare.statistics import exponent
from analysis.engines.run import EngineRun
from analysis.pages.names import ENGINE_NAMES
from analysis.paper.answers import unsolved
from analysis.paper.discrete.engine_runs import each
from analysis.paper.discrete.fig2_corridor.columns import (
    Gaps,
    flux,
    gaps_of,
    local_contacts,
    long_wave_speed,
)
from analysis.paper.discrete.fig2_corridor.final import (
    Final,
    final_run,
    rigid_final,
    soft_final,
)
from analysis.paper.discrete.fig2_corridor.push import Push, push_scene, run_push
from analysis.percussions.snapshot import SnapshotPercussions, percussions_of
from analysis.scene.scene import Scene, read_scene
from analysis.support.progress import Progress
from nscd.arrays import Flags, Floats

INELASTIC, ELASTIC = 0.05, 1.0
# With e = 1 the push overlaps disks by two thirds of a radius at 1e4 N/m, which is no model of a
# body any more.
STIFFNESSES = (1e5, 1e6, 1e8)  # N/m
# Restitutions of damping ratios 1, 2, 5 and 10, at one stiffness: the inelastic limit.
DAMPED = (0.1353, INELASTIC, 0.01, 0.0024)
# Frames by restitution, so many that the impulses close the balance of momentum to a few per cent.
FRAMES = {0.1353: 300, INELASTIC: 300, 0.01: 1000, 0.0024: 2000}
DAMPED_STIFFNESS = 1e6  # N/m
# A percussion below this share of the largest is none.
CARRIES = 1e-6


def push_runs(runs: Path) -> list[EngineRun]:
    """List the push as soft contacts: elastic and inelastic at each stiffness by both engines, and
    with more damping."""
    cases = [
        (e, k, r) for e in ("lammps", "yade") for r in (INELASTIC, ELASTIC) for k in STIFFNESSES
    ]
    cases += [("lammps", DAMPED_STIFFNESS, r) for r in DAMPED if r != INELASTIC]
    scene, found = read_scene("corridor"), []
    for engine, k, restitution in cases:
        # the front needs 12 √(m/k) to the end; damped contacts let go later and jump at the start,
        # the more damped the faster
        periods, frames = (14, 140) if restitution == ELASTIC else (24, FRAMES[restitution])
        found.append(EngineRun.of(push_scene(scene, k, restitution, periods, frames), engine, runs))
    return found


def final_runs(runs: Path) -> list[EngineRun]:
    """List the longer run of each engine, to the final positions."""
    scene = read_scene("corridor")
    return [final_run(scene, engine, runs) for engine in ENGINE_NAMES if engine != "rigid"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Front:
    """The front of the push in one engine at one restitution, at two stiffnesses or more.

    power: a of speed ∝ kᵃ
    """

    engine: str
    restitution: float
    pushes: list[Push]
    power: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Corridor:
    """All that figure 2 shows: n disks, k contacts.

    found: the percussions
    pushes: the push by each engine, stiffness and damping
    finals: where everybody is a second later, by rigid disks first
    """

    scene: Scene
    found: SnapshotPercussions
    pushes: list[Push]
    finals: list[Final]
    warnings: list[str]

    @classmethod
    def of(cls, runs: Path, progress: Progress | None) -> Corridor:
        """Compute it; `runs` keeps the engine runs, and one that fails is a warning."""
        scene = read_scene("corridor")
        found = percussions_of(scene, scene.snapshot, tolerance=1e-10)
        warnings = unsolved([("percussions", found.answer)])
        pushes = each(push_runs(runs), partial(run_push, progress=progress), warnings)
        soft = each(final_runs(runs), partial(soft_final, progress=progress), warnings)
        finals = [rigid_final(scene), *soft]
        return cls(scene=scene, found=found, pushes=pushes, finals=finals, warnings=warnings)

    @cached_property
    def local(self) -> Flags:
        """Whether a pushing disk takes part in a contact, (k,)."""
        return local_contacts(self.scene, self.found.contacts)

    @cached_property
    def size(self) -> Floats:
        """|p| of each contact, (k,) N·s."""
        size: Floats = np.hypot(*self.found.answer.impulse.T)
        return size

    @cached_property
    def carries(self) -> Flags:
        """Whether a contact carries a percussion, (k,)."""
        carries: Flags = self.size > CARRIES * self.size.max()
        return carries

    @property
    def near(self) -> int:
        """How many contacts of a pushing disk carry a percussion."""
        return int((self.carries & self.local).sum())

    @property
    def far(self) -> int:
        """How many contacts without a pushing disk carry a percussion."""
        return int((self.carries & ~self.local).sum())

    @property
    def far_share(self) -> float:
        """Share of the sum of magnitudes that contacts without a pushing disk have."""
        return float(self.size[~self.local].sum() / self.size.sum())

    @cached_property
    def gaps(self) -> Gaps:
        """How the push goes from column to column."""
        return gaps_of(self.scene, self.found.contacts, self.found.answer)

    @property
    def distance(self) -> Floats:
        """From the pushing column, (n,) m."""
        x = self.scene.snapshot.position[:, 0]
        distance: Floats = x - x.min()
        return distance

    @property
    def reach(self) -> float:
        """Distance (m) of the furthest disk with a percussion."""
        return float(self.distance[self.found.contacts.first[self.carries]].max())

    @property
    def resting(self) -> Flags:
        """Who is at rest before, (n,)."""
        rests: Flags = np.hypot(*self.scene.snapshot.velocity.T) == 0
        return rests

    @property
    def pushing(self) -> int:
        """How many push."""
        return int((~self.resting).sum())

    @property
    def moved(self) -> Flags:
        """Who is at rest before and moves after, (n,)."""
        moved: Flags = self.resting & (np.hypot(*self.found.answer.right_velocity.T) > 1e-6)
        return moved

    @property
    def inelastic(self) -> list[Push]:
        """The pushes of one restitution at rising stiffness."""
        return [push for push in self.pushes if push.restitution == INELASTIC]

    @property
    def waves(self) -> list[Push]:
        """The pushes whose front is followed."""
        return [push for push in self.pushes if push.restitution in (INELASTIC, ELASTIC)]

    @property
    def stiffened(self) -> list[Push]:
        """Those of the first engine."""
        return [push for push in self.inelastic if push.engine == self.inelastic[0].engine]

    @property
    def damped(self) -> list[Push]:
        """The pushes at one stiffness with rising damping."""
        chosen = [
            push
            for push in self.pushes
            if push.engine == "lammps"
            and push.stiffness == DAMPED_STIFFNESS
            and push.restitution < ELASTIC
        ]
        return sorted(chosen, key=lambda push: -push.restitution)

    @property
    def damping_is_the_limit(self) -> bool:
        """Whether damping brings ∫f dt to the percussions and stiffness does not."""
        if len(self.stiffened) < 2 or len(self.damped) < 2:
            return False
        return self.damped[-1].difference < 0.5 * self.inelastic[-1].difference

    @cached_property
    def fronts(self) -> list[Front]:
        """The fronts, inelastic ones first, of each engine."""
        found = []
        for restitution in (INELASTIC, ELASTIC):
            for engine in dict.fromkeys(push.engine for push in self.waves):
                mine = [p for p in self.waves if (p.engine, p.restitution) == (engine, restitution)]
                speeds = np.array([p.speed for p in mine])
                power = exponent(np.array([p.stiffness for p in mine]), speeds)
                if np.isfinite(power):
                    name = ENGINE_NAMES[engine]
                    found.append(
                        Front(engine=name, restitution=restitution, pushes=mine, power=power)
                    )
        return found

    @cached_property
    def apart(self) -> float | None:
        """By how much of themselves the engines' speeds differ at most; None for one engine."""
        return max(
            (
                abs(a.speed / b.speed - 1)
                for a in self.waves
                for b in self.waves
                if a.engine < b.engine
                and (a.stiffness, a.restitution) == (b.stiffness, b.restitution)
            ),
            default=None,
        )

    def long_wave(self, stiffness: float) -> float:
        """Speed (m/s) of long waves in springs of that stiffness (N/m)."""
        scene = self.scene.with_contact(stiffness_N_per_m=stiffness)
        return long_wave_speed(scene, self.found.contacts)


def soft_flux(push: Push) -> Floats:
    """Sum the impulses along x (m,) N·s that soft contacts passed through each gap."""
    match = push.comparison.match
    return flux(push.comparison.snapshot.position[:, 0], match.contacts, match.penalty)
