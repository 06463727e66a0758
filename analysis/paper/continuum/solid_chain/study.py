"""Section 3.2.1: chains as deformable rods against a wall, by elements and in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.paper.continuum.exit_room import Answer
from nscd.arrays import Floats
from nscd.continuum.closed_forms.chain import Chain, chain_mesh
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.medium import DENSITY, TABLE_1, table_1_medium
from nscd.continuum.space import Space

LENGTH, SPEED = 10.0, 1.7  # m, m/s
VOLUME = TABLE_1.volume_dissipation
# where κ = k_s h/k_v = tanh(l/h)
THRESHOLD = float(np.sqrt(DENSITY * VOLUME) * np.tanh(LENGTH * np.sqrt(DENSITY / VOLUME)))
SURFACES = {
    "sticks, k_s = 0": 0.0,
    "sticks, Table 1": TABLE_1.surface_dissipation,
    "at the threshold": THRESHOLD,
    "rebounds, k_s = 20": 20.0,
}
DENSITIES = (1.0, 2.0, 4.0, 7.0, 14.0)
AT = (0.0, 0.5, 1.0, 2.0, 4.0)  # m from the wall
PER_METRE = 20  # cells, for a mesh of 0.2 m in the room
STIFF = 1e3  # times the k_v of Table 1: a chain that is as good as rigid


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial:
    """A chain by P2 elements and in closed form.

    x: (n,) m, the nodes.
    """

    name: str
    chain: Chain
    answer: CollisionAnswer
    x: Floats

    @cached_property
    def right(self) -> Floats:
        """(n,) m/s, u⁺ by elements."""
        velocity: Floats = self.answer.right_velocity[np.argsort(self.answer.space.nodes[:, 0]), 0]
        return velocity

    @property
    def error(self) -> float:
        """Largest |u⁺ − closed form| over U."""
        return float(np.abs(self.right - self.chain.right_velocity(self.x)).max() / SPEED)

    @property
    def at_wall(self) -> float:
        """m/s, u⁺ at the wall by elements, 0 where the chain stays."""
        return 0.0 if abs(self.right[-1]) < 1e-9 * SPEED else float(self.right[-1])

    @property
    def inner(self) -> list[float]:
        """N·s per kg of a person, −σ = −k_v ∂w/∂x by elements at AT from the wall."""
        slope = np.gradient(self.right + SPEED, self.x, edge_order=2)
        return [float(np.interp(LENGTH - at, self.x, -VOLUME * slope)) for at in AT]

    @property
    def closing(self) -> float:
        """1/s, how fast people still close up at most."""
        return float(-np.gradient(self.right, self.x, edge_order=2).min())

    @property
    def printed(self) -> bool:
        """(13) as it stands: k_s/k_v ≥ (e^(−2l/h) − 1)/(e^(−2l/h) + 1)."""
        medium = self.chain.medium
        decay = float(np.exp(-2 * self.chain.length / medium.length))
        return medium.k_s / medium.k_v >= (decay - 1) / (decay + 1)


def trial(name: str, surface: float, density: float, mesh: float) -> Trial:
    """Solve a chain with k_s and ρ (people/m), with cells in proportion to a mesh (m)."""
    medium = table_1_medium(density, surface=surface, person=1.0)
    answer = collide(_space(mesh), medium, [SPEED])
    chain = Chain(medium=medium, length=LENGTH, left_velocity=SPEED)
    return Trial(name=name, chain=chain, answer=answer, x=np.sort(answer.space.nodes[:, 0]))


def _space(mesh: float) -> Space:
    return Space(chain_mesh(LENGTH, round(LENGTH * PER_METRE * 0.2 / mesh)), 2)


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeChain:
    """A chain that nothing holds, with a k_v a thousand times that of Table 1.

    from_rigid, from_elastic: how far u⁺ is from that of the rigid chain (all at the mean ū) and
        from the elastic exchange 2ū − u⁻, as shares of the largest left velocity.
    """

    answer: CollisionAnswer
    from_rigid: float
    from_elastic: float


def free_chain(mesh: float) -> FreeChain:
    """Solve a free chain with falling left velocity."""
    space = _space(mesh)
    # the wall is behind the last one, who walks away from it: nothing holds the chain
    left = -SPEED * space.mesh.p[0] / LENGTH
    medium = table_1_medium(volume=STIFF * VOLUME, surface=0.0, person=1.0)
    answer = collide(space, medium, left[:, None])
    u, before, mean = answer.right_velocity[:, 0], answer.left_velocity[:, 0], -0.5 * SPEED
    return FreeChain(
        answer=answer,
        from_rigid=float(np.abs(u - mean).max() / SPEED),
        from_elastic=float(np.abs(u - (2 * mean - before)).max() / SPEED),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Chains:
    """All chains of the section.

    trials: one per name of SURFACES.
    dense: one per density of DENSITIES, with k_s of Table 1.
    """

    trials: Sequence[Trial]
    dense: Sequence[Trial]
    free: FreeChain

    @property
    def table_1(self) -> Trial:
        """The chain with k_s of Table 1."""
        return self.trials[1]

    @property
    def factor(self) -> float:
        """The internal percussion by elements 0.5 m from the wall, over (14) as printed."""
        chain = self.table_1.chain
        corrected = float(chain.internal_percussion(np.array([LENGTH - 0.5]))[0])
        return self.table_1.inner[1] / (corrected / VOLUME)

    @property
    def growing(self) -> list[float]:
        """m, the distances of AT from the wall at which it grows with every density."""
        steps = np.diff([trial.inner for trial in self.dense], axis=0)
        return [at for at, least in zip(AT, steps.min(0), strict=True) if least > 0]

    @property
    def answers(self) -> list[tuple[str, Answer]]:
        """All answers, named."""
        chains = [(f"chain, {trial.name}", trial.answer) for trial in (*self.trials, *self.dense)]
        return [*chains, ("free chain", self.free.answer)]


def chains(mesh: float) -> Chains:
    """Solve all chains."""
    return Chains(
        trials=[trial(name, surface, DENSITY, mesh) for name, surface in SURFACES.items()],
        dense=[trial(f"ρ = {rho:g}", TABLE_1.surface_dissipation, rho, mesh) for rho in DENSITIES],
        free=free_chain(mesh),
    )
