"""Fig. 7: a crowd in a corner with walls, an exit and a free border, and norms that have limits."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.paper.answers import Answer
from analysis.paper.continuum.exit_room import BODY, ROOM, slopes
from nscd.arrays import Floats
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.left_velocity import Field, toward_exit
from nscd.continuum.medium import table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.pressure import body_fields
from nscd.continuum.room import Exit, Room, room_of_outline
from nscd.continuum.space import Space
from nscd.segments import nearest_on_segment

SPEED = 1.7  # m/s
PUSH = 500.0  # N·s for each metre of free border, inward
HALVINGS = 3
# U/r over a quarter of a circle at each of the two jambs: what a halving adds to ∫|∇u⁻|² in the end
FOREVER = float(np.pi * SPEED**2 * np.log(2))
CROWD = table_1_medium()


def crowd_in_a_corner() -> Room:
    """Make a crowd that fills a corner of a room with a 1 m exit and stands round a pillar; behind
    it nothing holds it."""
    outline = [[0.0, 0.0], [0.0, 6.0], [-3.0, 6.0], [-5.5, 4.8], [-6.5, 2.5], [-6.5, 0.0]]
    pillar = [[-2.6, 3.3], [-2.0, 3.3], [-2.0, 3.9], [-2.6, 3.9]]
    return room_of_outline(
        outline,
        exits=[Exit(0, 1.5, 2.5)],
        border=["wall", "free", "free", "free", "free", "wall"],
        pillars=[pillar],
    )


@dataclass(frozen=True, eq=False)
class Run:
    """The corner's crowd by (11).

    name: how it is pushed.
    shown: (n,2) m, where pressures are taken.
    """

    name: str
    answer: CollisionAnswer
    shown: Floats

    @cached_property
    def normal_speed(self) -> Floats:
        """(c,) m/s, u⁺·n at the wall points, n out of the room."""
        wall = self.answer.space.wall
        speed: Floats = (self.answer.right_velocity[wall.node] * wall.normal).sum(1)
        return speed

    @property
    def enters(self) -> float:
        """m/s, the largest u⁺·n, 0 where nobody enters a wall."""
        return max(float(self.normal_speed.max()), 0.0)

    @property
    def load(self) -> float:
        """N·s, what the walls give in all."""
        return float(self.answer.wall_force.sum())

    @property
    def apart(self) -> float:
        """Largest |μ (u⁺·n)| over the largest μ times the speed: 0 where the wall pushes only those
        who stay."""
        force = self.answer.wall_force
        return float(np.abs(force * self.normal_speed).max() / (force.max() * SPEED))

    @cached_property
    def pressure(self) -> Floats:
        """(n,) N·s/m over a body at the points shown."""
        return body_fields(self.answer, BODY, self.shown).pressure

    @property
    def peak(self) -> float:
        """N·s/m, the largest of them."""
        return float(self.pressure.max())


def runs(room: Room, mesh: float, shown: Floats) -> list[Run]:
    """Solve the crowd alone and pushed from behind."""
    space, left = Space(mesh_of(room, mesh)), toward_exit(room, SPEED)
    return [
        Run("no push", collide(space, CROWD, left), shown),
        Run(f"push of {PUSH:g} N·s/m", collide(space, CROWD, left, external=inward(room)), shown),
    ]


def inward(room: Room) -> Field:
    """Push along the inward normal of the free border: (m,2) m → (m,2) N·s/m."""
    pieces = np.array(room.pieces("free"))
    along = pieces[:, 1] - pieces[:, 0]
    normal = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]

    def push(points: Floats) -> Floats:
        away = [np.hypot(*(nearest_on_segment(points, *piece) - points).T) for piece in pieces]
        pressed: Floats = PUSH * normal[np.argmin(away, axis=0)]
        return pressed

    return push


@dataclass(frozen=True, slots=True, kw_only=True)
class Norms:
    """One uniform mesh of the square room.

    side: m.
    left, total: m²/s², ∫|∇u⁻|² and ∫|∇w|².
    """

    side: float
    answer: CollisionAnswer
    left: float
    total: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What becomes of the norms when the mesh is halved."""

    meshes: Sequence[Norms]

    @property
    def growth(self) -> Floats:
        """(HALVINGS,) m²/s², by how much ∫|∇u⁻|² grows."""
        return np.diff([mesh.left for mesh in self.meshes])

    @property
    def change(self) -> Floats:
        """(HALVINGS,) m²/s², by how much ∫|∇w|² changes."""
        return np.asarray(np.abs(np.diff([mesh.total for mesh in self.meshes])))

    @property
    def answers(self) -> list[tuple[str, Answer]]:
        """All answers, named."""
        return [(f"square room, side {mesh.side:g} m", mesh.answer) for mesh in self.meshes]


def limits(size: float) -> Limits:
    """Solve the square room on uniform meshes of the sides size, size/2, … (m)."""
    return Limits(meshes=[_norms(size / 2**k) for k in range(HALVINGS + 1)])


def _norms(side: float) -> Norms:
    left, space = toward_exit(ROOM, SPEED), Space(mesh_of(ROOM, side, grading=1.0))
    answer = collide(space, CROWD, left)
    squares = sum((slope**2).sum(1) for slope in slopes(left, space.points, 1e-7))
    gradient = np.asarray(answer.sum_field.grad)
    return Norms(
        side=side,
        answer=answer,
        left=float(squares @ space.weights),
        total=float((gradient**2).sum((0, 1)).ravel() @ space.weights),
    )
