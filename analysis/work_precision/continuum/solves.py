"""The two continuum models on the crowd of a window: what each disk and the walls get from the
field, and its cost."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np
import shapely
from skfem import MeshTri1

from analysis.scene.scene import Drive
from analysis.work_precision.continuum.region import crowd_room
from analysis.work_precision.point import PointStatus
from analysis.work_precision.points_of import Answer
from analysis.work_precision.rigid_solves import STATUS, timed
from analysis.work_precision.window import (
    CONTACT_FORCE,
    DISK_FORCE,
    DISPLACEMENT,
    WALL_FORCE,
    Values,
    Window,
)
from nscd.arrays import Floats, Indices
from nscd.bodies import Snapshot
from nscd.continuum.collision import collide
from nscd.continuum.left_velocity import Field
from nscd.continuum.medium import table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.rivals.cells import Cells
from nscd.continuum.rivals.first_order import first_order_flow
from nscd.continuum.room import Room
from nscd.continuum.space import Space
from nscd.percussions import Status
from nscd.segments import nearest_on_segment

# Means over a disk, exact to degree 5: its centre and six points at √(2/3) of the radius (Stroud,
# S2: 5-1).
RING = np.arange(6) * np.pi / 3
PLACES = np.vstack([[[0.0, 0.0]], np.sqrt(2 / 3) * np.column_stack([np.cos(RING), np.sin(RING)])])
WEIGHTS = np.array([0.25, *[0.125] * 6])
COMPARED = (DISK_FORCE, WALL_FORCE, DISPLACEMENT)
# Nearer to the door than this (m) nobody has a direction.
AT_THE_DOOR = 1e-9


class ContinuumModel(StrEnum):
    """deformable: problem (11) with the paper's Table 1; first_order: (20) in its complementarity
    form."""

    DEFORMABLE = "deformable"
    FIRST_ORDER = "first_order"


def solve_continuum(window: Window, model: ContinuumModel, side_m: float) -> Answer:
    """Solve a model on the crowd's region (see `crowd_room`) with P1 elements and a mesh graded to
    the jambs.

    The density is uniform, Σm/area; u⁻ is what the drive wants. A disk receives m times the mean of
    u⁺ − u⁻ over what of it is in the region; the walls get what the whole crowd loses, −∫ρ(u⁺ −
    u⁻), which is ∫(μn + k_s w) for (11) and ∫ρpn for (20). There are no contacts, and so no contact
    forces. Raises ValueError as `crowd_room` does; a mesh that cannot be made is a failed answer
    with its reason."""
    crowd_room(window.scene)

    def call() -> Answer:
        room = crowd_room(window.scene)
        return _solve(window, model, room, mesh_of(room, side_m), side_m)

    try:
        answer, seconds = timed(call)
    except ValueError as error:
        return answer_of(model, side_m, None, PointStatus.FAILED, str(error))
    return replace(answer, cpu_seconds=seconds)


def solve_both(window: Window, side_m: float) -> tuple[Answer, ...]:
    """Solve each model on the same mesh, once and without its time. Raises ValueError as
    `crowd_room` does."""
    room = crowd_room(window.scene)
    try:
        mesh = mesh_of(room, side_m)
    except ValueError as error:
        return tuple(
            answer_of(model, side_m, None, PointStatus.FAILED, str(error))
            for model in ContinuumModel
        )
    return tuple(_solve(window, model, room, mesh, side_m) for model in ContinuumModel)


def _solve(
    window: Window, model: ContinuumModel, room: Room, mesh: MeshTri1, side_m: float
) -> Answer:
    disks, drive = window.scene.snapshot, window.scene.drive
    assert drive is not None
    left, at = _walking(drive), _samples(disks, room, mesh)
    density = float(disks.mass.sum()) / room.area
    if model is ContinuumModel.FIRST_ORDER:
        flow = first_order_flow(mesh, left)
        status, reason = flow.status, flow.reason
        # u⁺ − u_d = −∇p, one value per cell
        gained = flow.right_velocity - flow.desired_velocity
        change, impulse = at.means(gained[at.cell]), -density * Cells(mesh).measure @ gained
    else:
        person, space = float(disks.mass.mean()), Space(mesh)
        answer = collide(space, table_1_medium(density / person, person=person), left)
        status, reason = answer.status, answer.reason
        # u⁺ − u⁻ = w − 2u⁻, with w linear in each cell
        total = (at.share[:, :, None] * answer.velocity_sum[mesh.t[:, at.cell]]).sum(0)
        change = at.means(total - 2.0 * left(at.point))
        momentum = answer.density_field * (answer.right_field - answer.left_field)
        impulse = -(momentum * space.basis.dx).sum((1, 2))
    if status == Status.FAILED:
        return answer_of(model, side_m, None, PointStatus.FAILED, reason)
    # as for the rigid model impulses over τ are constant forces
    tau = drive.relaxation_time_s
    values = {
        DISK_FORCE: (disks.mass[:, None] * change).ravel() / tau,
        WALL_FORCE: impulse / tau,
        DISPLACEMENT: window.rigid_motion(window.left_velocity + change).displacement[1].ravel(),
    }
    return answer_of(model, side_m, values, STATUS[status], reason)


def answer_of(
    model: ContinuumModel,
    side_m: float,
    values: Values | None,
    status: PointStatus = PointStatus.OK,
    reason: str = "",
) -> Answer:
    """Make the answer of a model on a mesh with triangles of side_m; values of COMPARED, None where
    there are none."""
    return Answer(
        method="continuum",
        law=str(model),
        mesh_side_m=side_m,
        cpu_seconds=None,
        values=values,
        lacks=(CONTACT_FORCE,),
        status=status,
        reason=reason,
    )


def _walking(drive: Drive) -> Field:
    """u⁻ = speed·(P − x)/|P − x| with P(x) the nearest point of the door, or its centre; 0 there,
    as `toward_exit`. (Disks on the door's line have passed it; a wall in that line has not.)"""
    start, end = (np.array(point) for point in drive.target())

    def velocity(points: Floats) -> Floats:
        way = nearest_on_segment(points, start, end) - points
        distance = np.hypot(*way.T)[:, None]
        going = distance > AT_THE_DOOR
        directed: Floats = drive.speed_m_per_s * np.divide(
            way, distance, out=np.zeros_like(way), where=going
        )
        return directed

    return velocity


class _Samples(NamedTuple):
    """Points (q,2) m in disks: of which disk (q,), with what weight (q,), in which cell (q,) of the
    mesh, and the shares (3,q) of its vertices there."""

    point: Floats
    disk: Indices
    weight: Floats
    cell: Indices
    share: Floats

    def means(self, values: Floats) -> Floats:
        """Average values (q,2) over each disk (n,2)."""
        whole = np.bincount(self.disk, self.weight)
        return np.column_stack([np.bincount(self.disk, self.weight * v) / whole for v in values.T])


def _samples(disks: Snapshot, room: Room, mesh: MeshTri1) -> _Samples:
    point = (disks.position[:, None] + disks.radius[:, None, None] * PLACES).reshape(-1, 2)
    inside = shapely.contains_xy(shapely.Polygon(room.outline, room.pillars), point)
    point = point[inside]
    corners = mesh.p.T[mesh.t.T]
    found, cells = shapely.STRtree(shapely.polygons(corners)).query(
        shapely.points(point), "intersects"
    )
    cell = np.empty(len(point), dtype=np.int64)
    cell[found] = cells
    a, b, c = corners[cell].swapaxes(0, 1)
    whole = _cross(b - a, c - a)
    shares = (
        np.stack([_cross(c - b, point - b), _cross(a - c, point - c), _cross(b - a, point - a)])
        / whole
    )
    disk = np.repeat(np.arange(len(disks)), len(PLACES))[inside]
    return _Samples(point, disk, np.tile(WEIGHTS, len(disks))[inside], cell, shares)


def _cross(a: Floats, b: Floats) -> Floats:
    product: Floats = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return product
