"""Fig. 11: the collision (11) for left velocities that are uniform and random."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from analysis.paper.answers import Answer
from analysis.paper.continuum.exit_room import (
    ROOM,
    body_mean,
    body_pressure,
    from_exit,
    map_of,
    slopes,
    to_exit,
)
from nscd.arrays import Floats
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.left_velocity import Field, random_speeds, toward_exit
from nscd.continuum.medium import DENSITY, TABLE_1, Medium, table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.space import Space

MEAN, DEVIATION = 1.34, 0.26  # m/s
SEEDS = (1, 2, 3)
OUTFLOWS = (1.0, 2.0, 4.0, 6.0, 8.0, 9.0, 12.0)  # k_v for which the flow through the exit is asked
NEAR = 1.0  # m
ROUNDING = 1e-9  # m/s


class OnWalls(NamedTuple):
    """What people do at the walls.

    largest: m/s, of u⁺·n, n out of the room.
    normal, along: m/s, root mean squares of u⁺·n and u⁺·t.
    holding: share of the walls that hold somebody.
    """

    largest: float
    normal: float
    along: float
    holding: float


@dataclass(frozen=True, eq=False)
class Run:
    """One left velocity and the answer of (11)."""

    name: str
    left_velocity: Field
    answer: CollisionAnswer

    @cached_property
    def left(self) -> Floats:
        """(n,2) m/s, u⁻ over a body."""
        return body_mean(self.answer.space, np.moveaxis(self.answer.left_field, 0, -1))

    @cached_property
    def right(self) -> Floats:
        """(n,2) m/s, u⁺ over a body."""
        return body_mean(self.answer.space, np.moveaxis(self.answer.right_field, 0, -1))

    @cached_property
    def pressure(self) -> Floats:
        """(n,) N·s/m, p over a body."""
        return body_pressure(self.answer)

    @property
    def largest_from_exit(self) -> float:
        """m, the distance of the largest pressure from the exit."""
        return from_exit(self.pressure)

    @property
    def near_and_far(self) -> list[float]:
        """N·s/m, mean pressure within NEAR of the exit and beyond."""
        near, area = to_exit(map_of().points) <= NEAR, map_of().area
        return [float(np.average(self.pressure[c], weights=area[c])) for c in (near, ~near)]

    @cached_property
    def walls(self) -> OnWalls:
        """What people do at the walls."""
        wall, w = self.answer.space.wall, self.answer.right_velocity
        right = w[wall.node]
        normal = (right * wall.normal).sum(1)
        along = right[:, 1] * wall.normal[:, 0] - right[:, 0] * wall.normal[:, 1]
        share = wall.weight / wall.weight.sum()
        return OnWalls(
            largest=float(normal.max()) if normal.max() > ROUNDING else 0.0,
            normal=float(np.sqrt(share @ normal**2)),
            along=float(np.sqrt(share @ along**2)),
            holding=float(share[self.answer.active].sum()),
        )

    @property
    def cosine(self) -> float:
        """∫u⁺·u⁻/(‖u⁺‖‖u⁻‖) of the means over a body: ±1 for fields of one form."""
        area = map_of().area
        both, one, two = (
            float(area @ (a * b).sum(1))
            for a, b in ((self.left, self.right), (self.left, self.left), (self.right, self.right))
        )
        return both / float(np.sqrt(one * two))

    @property
    def kept(self) -> float:
        """Share of the kinetic energy that is left."""
        return 1 + self.answer.energy.change / self.answer.energy.before

    @cached_property
    def outflow(self) -> float:
        """m/s, mean u⁺·n on the exit, with u⁻ as it is just inside."""
        edge = self.answer.space.border("exit")
        assert edge is not None
        w, normals = np.asarray(edge.interpolate(self.answer.unknowns)), np.asarray(edge.normals)
        inside = np.asarray(edge.global_coordinates()) - 1e-9 * normals
        left = self.left_velocity(inside.reshape(2, -1).T).T.reshape(inside.shape)
        return float((((w - left) * normals).sum(0) * edge.dx).sum() / edge.dx.sum())

    @cached_property
    def compressed(self) -> float:
        """Share of the room where div u⁺ = div w − div u⁻ < 0; for a u⁻ that is smooth away from
        the exit."""
        space, gradient = self.answer.space, np.asarray(self.answer.sum_field.grad)
        along_x, along_y = slopes(self.left_velocity, space.points, 1e-5)
        divergence = (gradient[0, 0] + gradient[1, 1]).ravel() - along_x[:, 0] - along_y[:, 1]
        return float(space.weights[divergence < 0].sum() / space.weights.sum())


class Echo(NamedTuple):
    """What becomes of the random part of a left velocity.

    share: ∫δu⁺·δu⁻/∫|δu⁻|², δu⁻ = u⁻ − u⁻_uniform.
    correlation: ∫δu⁺·δu⁻/(‖δu⁺‖‖δu⁻‖).
    """

    share: float
    correlation: float


def echo(even: Run, run: Run) -> Echo:
    """Compare a random run with the uniform one on the same mesh."""
    weight = run.answer.space.basis.dx
    before = run.answer.left_field - even.answer.left_field
    after = run.answer.right_field - even.answer.right_field
    both, one, two = (
        float(((a * b).sum(0) * weight).sum())
        for a, b in ((before, after), (before, before), (after, after))
    )
    return Echo(both / one, both / np.sqrt(one * two))


@dataclass(frozen=True, eq=False)
class LeftVelocities:
    """All runs.

    even: everybody wants MEAN toward the exit.
    drawn: one speed, MEAN ± DEVIATION, for each person's place, one run per seed.
    flows: uniform, for the k_v of OUTFLOWS.
    smooth: uniform, without k_s.
    """

    even: Run
    drawn: Sequence[Run]
    flows: Mapping[float, Run]
    smooth: Run

    @property
    def runs(self) -> list[Run]:
        """Uniform, then random."""
        return [self.even, *self.drawn]

    @cached_property
    def echoes(self) -> list[Echo]:
        """One per random run."""
        return [echo(self.even, run) for run in self.drawn]

    @property
    def echo(self) -> Echo:
        """Their mean."""
        return Echo(*np.mean(self.echoes, axis=0).tolist())

    @property
    def answers(self) -> list[tuple[str, Answer]]:
        """All answers, named."""
        flows = [(f"uniform, k_v = {k:g}", run.answer) for k, run in self.flows.items()]
        others = [(run.name, run.answer) for run in (*self.runs, self.smooth)]
        return [*others, *flows]


def left_velocities(mesh: float) -> LeftVelocities:
    """Solve (11) for all left velocities, on a mesh of side `mesh` (m)."""
    space, way = Space(mesh_of(ROOM, mesh)), toward_exit(ROOM, 1.0)

    def run(name: str, left: Field, medium: Medium) -> Run:
        return Run(name, left, collide(space, medium, left))

    def even(volume: float = TABLE_1.volume_dissipation, surface: float | None = None) -> Run:
        k_s = TABLE_1.surface_dissipation if surface is None else surface
        return run("uniform", toward_exit(ROOM, MEAN), table_1_medium(volume=volume, surface=k_s))

    def drawn(seed: int) -> Run:
        left = random_speeds(
            ROOM, way, mean=MEAN, deviation=DEVIATION, seed=seed, cell=DENSITY**-0.5
        )
        return run(f"random, draw {seed}", left, table_1_medium())

    return LeftVelocities(
        even(), [drawn(seed) for seed in SEEDS], {k: even(k) for k in OUTFLOWS}, even(surface=0.0)
    )
