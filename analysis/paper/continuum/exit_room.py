"""The room of the paper's section 3.2.2, its crowd with Table 1, and fields in it as means over a
body."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from skfem import MeshTri1

from nscd.arrays import Floats
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.left_velocity import Field
from nscd.continuum.medium import DENSITY as DENSITY
from nscd.continuum.medium import PERSON as PERSON
from nscd.continuum.medium import TABLE_1, Medium, table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.pressure import body_fields
from nscd.continuum.rivals.cells import Cells
from nscd.continuum.room import Room, square_room
from nscd.continuum.space import Space
from nscd.percussions import Status
from nscd.stress import Kernel, smear

VOLUME, SURFACE = TABLE_1.volume_dissipation, TABLE_1.surface_dissipation
TIME_STEP = TABLE_1.time_step
medium = table_1_medium
SIDE, EXIT = 10.0, 1.0  # m; the paper gives the exit only
MESH = 0.2  # m, the side of the triangles away from the jambs
MAP = 0.25  # m, between the points where body means are taken
BODY = Kernel(
    width=0.1
)  # a disk of radius 0.2 m: the largest that 7 people on a square metre have room for
ROOM = square_room(SIDE, EXIT)


class Map(NamedTuple):
    """Where body means are taken: the n vertices of a mesh, and the area (n,) m² that each stands
    for."""

    mesh: MeshTri1
    area: Floats

    @property
    def points(self) -> Floats:
        """(n,2) m."""
        return np.ascontiguousarray(self.mesh.p.T)


@cache
def map_of(room: Room = ROOM) -> Map:
    """Points every 0.25 m of the room, and closer at the jambs; the same for every mesh that is
    solved on."""
    mesh = mesh_of(room, MAP)
    return Map(mesh, Cells(mesh).integral(np.ones(mesh.nvertices)))


def solved(
    space: Space, crowd: Medium, left: Field, warnings: list[str], what: str
) -> CollisionAnswer:
    """The collision (11); adds to the warnings where it is not solved."""
    answer = collide(space, crowd, left)
    warn(warnings, what, answer.status, answer.reason)
    return answer


def warn(warnings: list[str], what: str, status: Status, reason: str) -> None:
    """Add to the warnings what is not solved, and why."""
    if status is not Status.SOLVED:
        warnings.append(f"{what}: {status}: {reason}")


def body_pressure(answer: CollisionAnswer, room: Room = ROOM) -> Floats:
    """p = −½ tr σ as means over a body at the points of the room's map (n,) N·s/m."""
    return body_fields(answer, BODY, map_of(room).points).pressure


def body_mean(space: Space, values: Floats, room: Room = ROOM) -> Floats:
    """Means over a body at the points of the room's map (n,…) of values (elements,q,…) at the
    quadrature points."""
    basis = space.basis
    places = np.ascontiguousarray(np.asarray(basis.global_coordinates()).reshape(2, -1).T)
    weight = np.asarray(basis.dx).reshape(-1, 1)
    columns = values.reshape(len(places), -1)
    sums, _ = smear(
        places, weight * np.hstack([np.ones_like(weight), columns]), BODY, map_of(room).points
    )
    mean: Floats = sums[:, 1:] / sums[:, :1]
    return mean[:, 0] if values.ndim == 2 else mean


def to_exit(points: Floats) -> Floats:
    """Distance (n,) m of points (n,2) m from the nearest point of the exit."""
    beyond = np.maximum(np.abs(points[:, 1]) - 0.5 * EXIT, 0.0)
    distance: Floats = np.hypot(points[:, 0], beyond)
    return distance


def place(point: Floats) -> str:
    """A point in words: its distance from the exit."""
    return f"{to_exit(point[None, :])[0]:.2f} m from the exit"
