"""The continuum by the same chart: its region, its solves, its ladder of meshes."""

from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely
from skfem import MeshTri1

from analysis.scene.scene import Drive, Scene
from analysis.studies.work_precision import window as windows
from analysis.studies.work_precision.point import PointStatus
from analysis.studies.work_precision.rigid_solves import STATUS, timed
from analysis.support.cache import cached, store
from nscd.arrays import Floats, Indices
from nscd.bodies import Snapshot
from nscd.continuum.collision import collide
from nscd.continuum.left_velocity import Field
from nscd.continuum.medium import table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.rivals.cells import Cells
from nscd.continuum.rivals.first_order import first_order_flow
from nscd.continuum.room import Border, Room, room_of_walls
from nscd.continuum.space import Space
from nscd.percussions import Status
from nscd.segments import nearest_on_segment

# In mean radii: a free border may run this far from the exact one, and so much wider the hall is
# taken for that long.
SIMPLER = 0.15
# Edges of a quarter of a circle.
ARC = 8
# Lengths below this share of the hall's extent are rounding.
ROUNDING = 1e-9


def crowd_room(scene: Scene) -> Room:
    """Draw the region: the hall, less every place where one more disk of mean radius would fit: the
    disks and what is beyond the walls, closed (in the sense of morphology) by a mean radius. Holes
    in the crowd are filled; pillars are not.

    Its edges are "exit" on the door, "wall" on a wall, and "free" elsewhere, drawn to 0.15 mean
    radii. Raises ValueError for a scene without a drive, whose walls and door enclose no hall,
    whose crowd is not in one piece or touches no wall."""
    if scene.drive is None:
        raise ValueError("it is for a crowd that a drive presses, and this is an impact")
    disks, drive = scene.snapshot, scene.drive
    if drive.goals:
        raise ValueError("it is for a crowd with one door, and this one has several")
    if drive.way:
        raise ValueError(
            "it is for a crowd that walks straight to its door, and this one has a way"
        )
    enclosed = room_of_walls(scene.wall_segments(), exits=[[drive.door_start_m, drive.door_end_m]])
    hall = shapely.Polygon(enclosed.outline, enclosed.pillars)
    radius = float(disks.radius.mean())
    margin = SIMPLER * radius
    # a little apart from the walls, so that where nobody stands no sliver is left on them
    wider = hall.buffer(margin, join_style="mitre")
    beyond = hall.buffer(4.0 * radius, join_style="mitre").difference(wider)
    bodies = shapely.buffer(shapely.points(disks.position), disks.radius, quad_segs=ARC)
    occupied = shapely.union_all([*bodies, beyond])
    closed = occupied.buffer(radius, quad_segs=ARC).buffer(-radius, quad_segs=ARC)
    parts = [
        part
        for part in shapely.get_parts(closed.simplify(margin).intersection(hall))
        if part.geom_type == "Polygon" and shapely.contains_xy(part, disks.position).any()
    ]
    if len(parts) != 1:
        raise ValueError(f"the crowd is in {len(parts)} pieces. One is needed")
    region = shapely.Polygon(parts[0].exterior).intersection(hall)
    if region.geom_type != "Polygon" or not shapely.contains_xy(region, disks.position).all():
        raise ValueError("the crowd is not in one piece")
    outline = np.array(region.exterior.coords)[:-1]
    return Room(
        outline=outline,
        border=_border(outline, enclosed),
        pillars=tuple(np.array(ring.coords)[:-1] for ring in region.interiors),
    )


def _border(outline: Floats, hall: Room) -> tuple[Border, ...]:
    """What each edge (v,) of the outline lies on."""
    near = ROUNDING * float(np.ptp(hall.outline, axis=0).max())
    middle = shapely.points(0.5 * (outline + np.roll(outline, -1, axis=0)))
    kinds: list[Border] = ["free"] * len(outline)
    for kind in ("wall", "exit"):
        lines = shapely.multilinestrings(list(hall.pieces(kind)))
        for edge in np.flatnonzero(shapely.distance(middle, lines) <= near):
            kinds[edge] = kind
    return tuple(kinds)


# Means over a disk, exact to degree 5: its centre and six points at √(2/3) of the radius (Stroud,
# S2: 5-1).
RING = np.arange(6) * np.pi / 3
PLACES = np.vstack([[[0.0, 0.0]], np.sqrt(2 / 3) * np.column_stack([np.cos(RING), np.sin(RING)])])
WEIGHTS = np.array([0.25, *[0.125] * 6])
COMPARED = (windows.DISK_FORCE, windows.WALL_FORCE, windows.DISPLACEMENT)
# Nearer to the door than this (m) nobody has a direction.
AT_THE_DOOR = 1e-9


class ContinuumModel(StrEnum):
    """deformable: problem (11) with the paper's Table 1; first_order: (20) in its complementarity
    form."""

    DEFORMABLE = "deformable"
    FIRST_ORDER = "first_order"


def solve_continuum(window: windows.Window, model: ContinuumModel, side_m: float) -> windows.MethodResult:
    """Solve a model on the crowd's region (see `crowd_room`) with P1 elements and a mesh graded to
    the jambs.

    The density is uniform, Σm/area; u⁻ is what the drive wants. A disk receives m times the mean of
    u⁺ − u⁻ over what of it is in the region; the walls get what the whole crowd loses, −∫ρ(u⁺ −
    u⁻), which is ∫(μn + k_s w) for (11) and ∫ρpn for (20). There are no contacts, and so no contact
    forces. Raises ValueError as `crowd_room` does; a mesh that cannot be made is a failed answer
    with its reason."""
    (solution,), seconds = timed(partial(solve_models, window, side_m, (model,)))
    return replace(solution, cpu_seconds=seconds)


def solve_models(
    window: windows.Window, side_m: float, models: Sequence[ContinuumModel] = tuple(ContinuumModel)
) -> tuple[windows.MethodResult, ...]:
    """Solve each model on the same mesh, without its time. Raises ValueError as `crowd_room`
    does."""
    room = crowd_room(window.scene)
    try:
        mesh = mesh_of(room, side_m)
    except ValueError as error:
        failed = side_m, None, PointStatus.FAILED, str(error)
        return tuple(answer_of(model, *failed) for model in models)
    return tuple(_solve(window, model, room, mesh, side_m) for model in models)


def _solve(
    window: windows.Window, model: ContinuumModel, room: Room, mesh: MeshTri1, side_m: float
) -> windows.MethodResult:
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
        solution = collide(space, table_1_medium(density / person, person=person), left)
        status, reason = solution.status, solution.reason
        # u⁺ − u⁻ = w − 2u⁻, with w linear in each cell
        total = (at.fraction[:, :, None] * solution.velocity_sum[mesh.t[:, at.cell]]).sum(0)
        change = at.means(total - 2.0 * left(at.point))
        momentum = solution.density_field * (solution.right_field - solution.left_field)
        impulse = -(momentum * space.basis.dx).sum((1, 2))
    if status == Status.FAILED:
        return answer_of(model, side_m, None, PointStatus.FAILED, reason)
    # as for the rigid model impulses over τ are constant forces
    tau = drive.relaxation_time_s
    values = {
        windows.DISK_FORCE: (disks.mass[:, None] * change).ravel() / tau,
        windows.WALL_FORCE: impulse / tau,
        windows.DISPLACEMENT: window.rigid_motion(window.left_velocity + change)
        .displacement[1]
        .ravel(),
    }
    return answer_of(model, side_m, values, STATUS[status], reason)


def answer_of(
    model: ContinuumModel,
    side_m: float,
    values: windows.Values | None,
    status: PointStatus = PointStatus.OK,
    reason: str = "",
) -> windows.MethodResult:
    """Make the answer of a model on a mesh with triangles of side_m; values of COMPARED, None where
    there are none."""
    return windows.MethodResult(
        method="continuum",
        law=str(model),
        mesh_side_m=side_m,
        cpu_seconds=None,
        values=values,
        lacks=(windows.CONTACT_FORCE,),
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
    fraction: Floats

    def means(self, values: Floats) -> Floats:
        """Average values (q,2) over each disk (n,2)."""
        total = np.bincount(self.disk, self.weight)
        return np.column_stack([np.bincount(self.disk, self.weight * v) / total for v in values.T])


def _samples(disks: Snapshot, room: Room, mesh: MeshTri1) -> _Samples:
    point = (disks.position[:, None] + disks.radius[:, None, None] * PLACES).reshape(-1, 2)
    inside = shapely.contains_xy(shapely.Polygon(room.outline, room.pillars), point)
    point = point[inside]
    corners = mesh.p.T[mesh.t.T]
    tree = shapely.STRtree(shapely.polygons(corners))
    found, cells = tree.query(shapely.points(point), "intersects")
    cell = np.empty(len(point), dtype=np.int64)
    cell[found] = cells
    a, b, c = corners[cell].swapaxes(0, 1)
    total = _cross(b - a, c - a)
    parts = [_cross(c - b, point - b), _cross(a - c, point - c), _cross(b - a, point - a)]
    fractions = np.stack(parts) / total
    disk = np.repeat(np.arange(len(disks)), len(PLACES))[inside]
    return _Samples(point, disk, np.tile(WEIGHTS, len(disks))[inside], cell, fractions)


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


# Sides of the triangles, in mean radii of the disks.
SIDES = (4.0, 2.0, 1.0)
COARSE = (4.0, 2.0)
# The reference has sides of the smallest times these: its change from the first to the second is
# its error bar.
FINER = (0.5, 0.25)
# Counts up whenever the reference comes to have other numbers.
EDITION = 2


def continuum_ladder(
    window: windows.Window, sides: Sequence[float], path: Path
) -> tuple[list[windows.MethodResult], str]:
    """Solve both models on meshes of these sides (in mean radii), finest last, each answer with its
    model, converged, and why there is none of all this; the references, which take long, are kept
    in `path`_*.npz."""
    if not sides:
        return [], "it was not asked for"
    radius = float(window.scene.snapshot.radius.mean())
    try:
        pairs = [(model, side * radius) for model in ContinuumModel for side in sides]
        solutions = [solve_continuum(window, *pair) for pair in pairs]
        coarse, fine = (_cached_solve(window, fraction * sides[-1] * radius, path) for fraction in FINER)
    except ValueError as error:
        return [], str(error)
    models = {two[0].law: converged(*two) for two in zip(coarse, fine, strict=True)}
    return [replace(solution, model=models[solution.law]) for solution in solutions], ""


def converged(coarse: windows.MethodResult, fine: windows.MethodResult) -> windows.Converged:
    """Make the converged model of its answers on meshes twice and four times as fine as the finest
    of a ladder."""
    sure = coarse.status == fine.status == PointStatus.OK
    return windows.Converged(
        own=fine.values if sure else None,
        looser=coarse.values if sure else None,
        why=f"the reference is {fine.status}: {fine.reason or coarse.reason}",
        wrong="the mesh is too coarse: wrong",
    )


def _cached_solve(window: windows.Window, side_m: float, path: Path) -> tuple[windows.MethodResult, ...]:
    """Both models from the file, or made and, if both are `ok`, kept there."""
    file = path.with_name(f"{path.name}_{side_m:.6g}m.npz")
    key = f"{window.scene.digest()} {EDITION}"
    if found := cached(file, key):
        values = {m: {q: found[f"{m}_{q.name}"] for q in COMPARED} for m in ContinuumModel}
        return tuple(answer_of(model, side_m, values[model]) for model in ContinuumModel)
    made = solve_models(window, side_m)
    if all(solution.status == PointStatus.OK for solution in made):
        arrays = {f"{a.law}_{q.name}": v for a in made for q, v in (a.values or {}).items()}
        store(file, key, arrays)
    return made
