"""Section 3.2.1: chains as deformable rods against a wall, by elements and in closed form."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.paper.answers import Answer
from nscd.arrays import Floats
from nscd.continuum.closed_forms.chain import Chain, chain_mesh
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.medium import DENSITY, TABLE_1, table_1_medium
from nscd.continuum.pressure import pressure
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
# people/m at the free end and at the wall; of one mean
PROFILES = ((1.5 * DENSITY, 0.5 * DENSITY), (DENSITY, DENSITY), (0.5 * DENSITY, 1.5 * DENSITY))
AT = (0.0, 0.5, 1.0, 2.0, 4.0)  # m from the wall
PER_METRE = 20  # cells, for a mesh of 0.2 m in the room
STIFF = 1e3  # times the k_v of Table 1: a chain that is as good as rigid


@dataclass(frozen=True, kw_only=True, eq=False)
class Rod:
    """A chain by P2 elements."""

    name: str
    answer: CollisionAnswer

    @property
    def x(self) -> Floats:
        """(n,) m, the nodes."""
        return np.sort(self.answer.space.nodes[:, 0])

    @cached_property
    def right(self) -> Floats:
        """(n,) m/s, u⁺ by elements."""
        velocity: Floats = self.answer.right_velocity[np.argsort(self.answer.space.nodes[:, 0]), 0]
        return velocity

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


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial(Rod):
    """A chain of uniform density, also in closed form."""

    chain: Chain

    @property
    def error(self) -> float:
        """Largest |u⁺ − closed form| over U."""
        return float(np.abs(self.right - self.chain.right_velocity(self.x)).max() / SPEED)

    def formula_error(self, h: float) -> float:
        """Largest |u⁺ − U(1 − cosh(x/h)/cosh(l/h))| over U, for a length h (m)."""
        formula = SPEED * (1 - np.cosh(self.x / h) / np.cosh(LENGTH / h))
        return float(np.abs(self.right - formula).max() / SPEED)

    @property
    def printed_length(self) -> float:
        """m, the h that is printed beside the solution, √((k_s/k_v)/ρ)."""
        medium = self.chain.medium
        return float(np.sqrt(medium.k_s / medium.k_v / np.mean(medium.rho)))

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
    return Trial(name=name, chain=chain, answer=answer)


def _space(mesh: float) -> Space:
    return Space(chain_mesh(LENGTH, round(LENGTH * PER_METRE * 0.2 / mesh)), 2)


@dataclass(frozen=True, kw_only=True, eq=False)
class Varied(Rod):
    """A chain whose density changes linearly.

    ends: people/m, the density at the free end and at the wall.
    """

    ends: tuple[float, float]

    @property
    def rigid(self) -> list[float]:
        """N·s per kg of a person, at AT from the wall for rigid disks of the same masses: the
        momentum of all who stand behind."""
        first, last = self.ends
        behind = [LENGTH - at for at in AT]
        return [SPEED * (first * x + 0.5 * (last - first) * x**2 / LENGTH) for x in behind]


def varied(first: float, last: float, mesh: float) -> Varied:
    """Solve a chain with k_s of Table 1 whose density goes from `first` to `last` (people/m)."""
    space = _space(mesh)
    density = first + (last - first) * space.mesh.p[0] / LENGTH
    answer = collide(space, table_1_medium(density, person=1.0), [SPEED])
    name = f"{first:g}" if first == last else f"{first:g} to {last:g}"
    return Varied(name=name, answer=answer, ends=(first, last))


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeChain(Rod):
    """A chain that nothing holds: its wall is behind the last one, who walks away from it."""

    @property
    def from_rigid(self) -> float:
        """How far u⁺ is from that of the rigid chain, all at the mean ū, over U."""
        return float(np.abs(self.answer.right_velocity - self._mean).max() / SPEED)

    @property
    def from_elastic(self) -> float:
        """How far u⁺ is from the elastic exchange 2ū − u⁻, over U."""
        exchanged = 2 * self._mean - self.answer.left_velocity
        return float(np.abs(self.answer.right_velocity - exchanged).max() / SPEED)

    @property
    def pressure(self) -> float:
        """N·s per kg of a person, the largest |σ|."""
        return float(np.abs(pressure(self.answer)).max())

    @property
    def _mean(self) -> float:
        field, space = self.answer.left_field, self.answer.space
        return float(field.ravel() @ space.weights / space.weights.sum())


def free_chain(name: str, ends: tuple[float, float], volume: float, mesh: float) -> FreeChain:
    """Solve a free chain whose left velocity goes from one end of `ends` (m/s) to the other."""
    space = _space(mesh)
    left = ends[0] + (ends[1] - ends[0]) * space.mesh.p[0] / LENGTH
    medium = table_1_medium(volume=volume, surface=0.0, person=1.0)
    return FreeChain(name=name, answer=collide(space, medium, left[:, None]))


@dataclass(frozen=True, kw_only=True, eq=False)
class Chains:
    """All chains of the section.

    trials: one per name of SURFACES.
    dense: one per density of DENSITIES, with k_s of Table 1.
    varied: one per profile of PROFILES: falling, uniform and rising toward the wall.
    free, constant: free chains, of falling left velocity with STIFF k_v, and of a constant one.
    """

    trials: Sequence[Trial]
    dense: Sequence[Trial]
    varied: Sequence[Varied]
    free: FreeChain
    constant: FreeChain

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
    def rigid_factor(self) -> float:
        """How many times as large the percussion of rigid disks is, 0.5 m from the wall, at
        most."""
        return max(rod.rigid[1] / rod.inner[1] for rod in self.varied)

    @property
    def growing(self) -> list[float]:
        """m, the distances of AT from the wall at which it grows with every density."""
        steps = np.diff([trial.inner for trial in self.dense], axis=0)
        return [at for at, least in zip(AT, steps.min(0), strict=True) if least > 0]

    @property
    def answers(self) -> list[tuple[str, Answer]]:
        """All answers, named."""
        every = (*self.trials, *self.dense, *self.varied, self.free, self.constant)
        return [(f"chain, {rod.name}", rod.answer) for rod in every]


def chains(mesh: float) -> Chains:
    """Solve all chains."""
    return Chains(
        trials=[trial(name, surface, DENSITY, mesh) for name, surface in SURFACES.items()],
        dense=[trial(f"ρ = {rho:g}", TABLE_1.surface_dissipation, rho, mesh) for rho in DENSITIES],
        varied=[varied(*ends, mesh) for ends in PROFILES],
        free=free_chain("free, falling", (0.0, -SPEED), STIFF * VOLUME, mesh),
        constant=free_chain("free, constant", (-SPEED, -SPEED), VOLUME, mesh),
    )
