"""Triangle meshes of a room, fine at the jambs, with the border named; made by Netgen."""

import math
from typing import Any

import numpy as np
from netgen.geom2d import SplineGeometry
from netgen.meshing import MeshingParameters, NgException
from skfem import MeshTri, MeshTri1

from nscd.arrays import Floats
from nscd.continuum.room import KINDS, Room

MOST_TRIANGLES = 2_000_000
# Sides below this share of the room's extent are too close to the generator's rounding: flat
# triangles.
SMALLEST_SIDE = 4e-6
# The wanted side is given at points that lie this many sides apart, and may change by STEEPEST for
# each metre between.
SPACING, STEEPEST = 0.5, 0.5


def mesh_of(
    room: Room, size: float, *, grading: float = 0.4, reach: float | None = None
) -> MeshTri1:
    """Fill the room with triangles; boundaries "wall", "exit" and "free", each present, if empty.

    size: m, the side of an equilateral triangle of about the area of one.
    grading: within reach of a jamb the side falls with the distance d as
        size·(d/reach)^(1−grading), down to reach·(size/reach)^(1/grading), but not below 4e-6 of
        the room's extent; 1 is uniform.
    reach: m; a quarter of √area by default.

    With the stress r^(−1/2) at a jamb the error in energy
    falls as N^(−s/2), s = min(order, 1/(2 grading)): below 1/2 restores the full order of P1
    elements and below 1/4 that of P2, of which 3/2 is left where a wall begins to hold the crowd
    (Grisvard, Elliptic Problems in Nonsmooth Domains, 1985, 8.4). The same arguments give the same
    mesh.

    Raises ValueError for a size, grading or reach that is not positive, one that asks for more than
    2 million triangles, or a room that the generator cannot fill."""
    radius = 0.25 * math.sqrt(room.area) if reach is None else reach
    for name, value, maximum in (
        ("size", size, math.inf),
        ("grading", grading, 1.0),
        ("reach", radius, math.inf),
    ):
        if not (0 < value <= maximum and np.isfinite(value)):
            up_to = " and up to 1" if maximum == 1.0 else ""
            raise ValueError(f"{name}: {value:g}. A number above 0{up_to} is needed")
    triangles = room.area / (math.sqrt(3) / 4 * size**2)
    sides = _sides(room, size, grading, radius) if triangles <= MOST_TRIANGLES else None
    if sides is None:
        fine = f"{size:g} m with grading {grading:g}"
        many = f"more than {MOST_TRIANGLES} triangles in {room.area:g} m²"
        raise ValueError(f"size: {fine} asks for {many}")
    wanted = MeshingParameters(maxh=size, grading=STEEPEST)
    for x, y, side in sides.tolist():
        wanted.RestrictH(x, y, 0.0, side)
    failed = (
        f"room: the mesh generator failed with triangles of {size:g} m. Are two of the "
        "room's edges almost one?"
    )
    try:
        built = _border_of(room).GenerateMesh(mp=wanted)
    except NgException as error:
        raise ValueError(failed) from error
    corners, facets = built.Elements2D().NumPy()["nodes"][:, :3], built.Elements1D().NumPy()
    mesh = MeshTri(
        np.ascontiguousarray(np.asarray(built.Coordinates())[:, :2].T),
        np.ascontiguousarray(corners.T.astype(np.int64) - 1),
    )
    # where two edges are a few rounding errors apart, the generator fills the gap without a word
    (ax, ay), (bx, by) = (mesh.p[:, mesh.t[k]] - mesh.p[:, mesh.t[0]] for k in (1, 2))
    if abs(0.5 * float(np.abs(ax * by - ay * bx).sum()) - room.area) > 1e-9 * room.area:
        raise ValueError(failed)
    kinds = np.array([KINDS.index(kind) for kind in room.kinds])
    return _named(mesh, facets["nodes"][:, :2].T.astype(np.int64) - 1, kinds[facets["index"] - 1])


def _border_of(room: Room) -> Any:
    """The room in the generator's terms; edge number i of room.segments is its border i + 1."""
    geometry = SplineGeometry()
    first = 0
    for loop in (room.outline, *room.pillars):
        points = [geometry.AppendPoint(x, y) for x, y in loop.tolist()]
        for i in range(len(loop)):
            ends = [points[i], points[(i + 1) % len(loop)]]
            geometry.Append(["line", *ends], leftdomain=1, rightdomain=0, bc=first + i + 1)
        first += len(loop)
    return geometry


def _sides(room: Room, size: float, grading: float, reach: float) -> Floats | None:
    """Points on rings around the jambs and the side wanted there (s,3) m; None where there are too
    many."""
    if grading == 1.0 or len(room.jambs) == 0:
        return np.zeros((0, 3))
    extent = float(np.ptp(room.outline, axis=0).max())
    minimum = max(reach * (size / reach) ** (1 / grading), SMALLEST_SIDE * extent)
    count, ring = 1, [np.array([[0.0, 0.0, minimum]])]
    distance = SPACING * minimum
    while distance < min(reach, 2 * extent):
        side = min(size, size * (max(distance, minimum) / reach) ** (1 - grading))
        n = math.ceil(2 * math.pi * distance / (SPACING * side))
        count += n
        if count > MOST_TRIANGLES:
            return None
        turn = 2 * np.pi * np.arange(n) / n
        x, y = distance * np.cos(turn), distance * np.sin(turn)
        ring.append(np.column_stack([x, y, np.full(n, side)]))
        distance += SPACING * side
    around = np.vstack(ring)
    return np.vstack([around + np.array([x, y, 0.0]) for x, y in room.jambs])


def _named(mesh: MeshTri1, facets: Any, kind: Any) -> MeshTri1:
    """The mesh with its boundary named: facets (2,b) by their vertices, kind (b,) their places in
    KINDS."""
    ends = np.sort(mesh.facets, 0), np.sort(facets, 0)
    code, wanted = (low * mesh.nvertices + high for low, high in ends)
    order = np.argsort(code)
    index = order[np.searchsorted(code[order], wanted)]
    return mesh.with_boundaries({name: index[kind == i] for i, name in enumerate(KINDS)})
