"""The room of the paper's section 3.2.2, fields in it as means over a body."""

from functools import cache
from typing import NamedTuple

import numpy as np
from skfem import MeshTri1

from nscd.arrays import Floats
from nscd.continuum.collision import CollisionAnswer
from nscd.continuum.left_velocity import Field
from nscd.continuum.mesh import mesh_of
from nscd.continuum.pressure import body_fields
from nscd.continuum.rivals.cells import Cells
from nscd.continuum.room import Room, square_room
from nscd.continuum.space import Space
from nscd.stress import Kernel, coarse_grain

SIDE, EXIT = 10.0, 1.0  # m; the paper gives the exit only
MESH = 0.2  # m, the side of the triangles away from the jambs
MAP = 0.25  # m, between the points where body means are taken
# a disk of radius 0.2 m: the largest that 7 people on a square metre have room for
BODY = Kernel(width=0.1)
ROOM = square_room(SIDE, EXIT)


class Map(NamedTuple):
    """Where body means are taken."""

    mesh: MeshTri1  # its n vertices
    area: Floats  # (n,) m², what each of them stands for

    @property
    def points(self) -> Floats:
        """(n,2) m."""
        return np.ascontiguousarray(self.mesh.p.T)


@cache
def map_of(room: Room = ROOM) -> Map:
    """Place points every 0.25 m in the room, and closer at the jambs, for every mesh the same."""
    mesh = mesh_of(room, MAP)
    return Map(mesh, Cells(mesh).integral(np.ones(mesh.nvertices)))


def body_pressure(solution: CollisionAnswer, room: Room = ROOM) -> Floats:
    """Average p = −½ tr σ over a body: (n,) N·s/m at the points of the room's map."""
    return body_fields(solution, BODY, map_of(room).points).pressure


def body_mean(space: Space, values: Floats, room: Room = ROOM) -> Floats:
    """Average values (elements,q,…) at the quadrature points over a body: (n,…) at the map's."""
    columns = values.reshape(len(space.weights), -1)
    mean = mean_over(BODY, space.points, space.weights, columns, map_of(room).points)
    return mean[:, 0] if values.ndim == 2 else mean


def mean_over(kernel: Kernel, where: Floats, weight: Floats, values: Floats, at: Floats) -> Floats:
    """Average values (n,c) at points (n,2) m that stand for weights (n,), over a kernel at points
    (m,2) m: (m,c)."""
    weighted = weight[:, None] * np.column_stack([np.ones_like(weight), values])
    sums, _ = coarse_grain(where, weighted, kernel, at)
    return np.asarray(sums[:, 1:] / sums[:, :1])


def slopes(field: Field, points: Floats, step: float) -> list[Floats]:
    """Take ∂u/∂x and ∂u/∂y, (m,2) 1/s each, at points (m,2) m by central differences of a step
    (m)."""
    shifts = step * np.eye(2)
    return [(field(points + shift) - field(points - shift)) / (2 * step) for shift in shifts]


def to_exit(points: Floats) -> Floats:
    """Measure the distance (n,) m of points (n,2) m from the nearest point of the exit."""
    beyond = np.maximum(np.abs(points[:, 1]) - 0.5 * EXIT, 0.0)
    return np.asarray(np.hypot(points[:, 0], beyond))


def from_exit(values: Floats) -> float:
    """Measure the distance (m) of the largest of the values (n,) at the map's points from the
    exit."""
    return float(to_exit(map_of().points[[values.argmax()]])[0])
