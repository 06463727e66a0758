"""Pressure that has a mesh limit: stress and percussions averaged over a body.

At a jamb σ ~ r^(−1/2), so the largest nodal pressure grows without limit under refinement
(`largest_pressures` shows it). What is published is the mean over a body: ∫_Ω p(y)φ(x − y)dy / ∫_Ω
φ(x − y)dy."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from nscd.arrays import Floats, read_only
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.left_velocity import Field
from nscd.continuum.medium import Medium, positive
from nscd.continuum.mesh import mesh_of
from nscd.continuum.room import Room
from nscd.continuum.space import Space
from nscd.stress import Kernel, coarse_grain


def stress(solution: CollisionAnswer) -> Floats:
    """Compute σ = k_v D(w), the percussion stress, negative in compression.

    Returns (d,d,elements,q) N·s/m at the quadrature points."""
    gradient = np.asarray(solution.sum_field.grad)
    return np.asarray(0.5 * solution.medium.k_v * (gradient + gradient.swapaxes(0, 1)))


def pressure(solution: CollisionAnswer) -> Floats:
    """Compute p = −tr σ/d = −½k_v div w in the plane: (elements,q) N·s/m at the quadrature points.

    Its maximum is the mesh's, not the crowd's."""
    return np.asarray(-np.trace(stress(solution)) / solution.space.dimension)


def percussion_density(solution: CollisionAnswer) -> Floats:
    """Compute div σ = ρ(u⁺ − u⁻), the percussion per area; over δt a force per area.

    Returns (d,elements,q) N·s/m² at the quadrature points."""
    return np.asarray(solution.density_field * (solution.right_field - solution.left_field))


class BodyFields(NamedTuple):
    """Hold means over a body at m points.

    pressure: (m,) N·s/m.
    stress: (m,2,2) N·s/m.
    percussion_density: (m,2) N·s/m²."""

    pressure: Floats
    stress: Floats
    percussion_density: Floats


def body_fields(solution: CollisionAnswer, kernel: Kernel, at: ArrayLike) -> BodyFields:
    """Average pressure, stress and percussion density of a crowd in the plane over a body.

    kernel: of width r/2, the standard deviation of its area along an axis, for a disk of radius r.
    at: (m,2) m, the bodies' middles.

    The kernel is normalised by its part inside the room: a body at the wall counts with what of it
    is inside.

    Raises ValueError for a chain (no plane), wrong shapes, or points that are out of the room's
    reach."""
    if solution.space.dimension != 2:
        raise ValueError("solution: a chain has no fields in the plane")
    points = read_only(at, (-1, 2), "at")
    positions, area = solution.space.points, solution.space.weights[:, None]
    sigma, density = stress(solution).reshape(4, -1).T, percussion_density(solution).reshape(2, -1).T
    sums, _ = coarse_grain(positions, area * np.hstack([np.ones_like(area), sigma, density]), kernel, points)
    if (sums[:, 0] <= 0).any():
        x, y = points[int(np.argmin(sums[:, 0]))]
        why = "is out of reach of the room, or the mesh is coarser than the kernel"
        raise ValueError(f"at: ({x:g}, {y:g}) m {why}")
    mean = sums[:, 1:] / sums[:, :1]
    return BodyFields(-0.5 * (mean[:, 0] + mean[:, 3]), mean[:, :4].reshape(-1, 2, 2), mean[:, 4:])


def body_wall_percussion(solution: CollisionAnswer, width: float) -> Floats:
    """Average μ along its line of walls in the plane: (c,) N·s/m at space.wall.

    width: m, the standard deviation of a Gaussian.

    The nodal μ grows at the jambs as the pressure does. Raises ValueError for a width that is not
    positive."""
    positive(width=width)
    wall = solution.space.wall
    force, mean = solution.wall_force, np.empty_like(wall.weight)
    offset = (wall.point * wall.normal).sum(1)
    extent = float(np.ptp(wall.point, axis=0).max())
    todo = np.ones(len(force), dtype=bool)
    while todo.any():
        i = int(np.argmax(todo))
        same = wall.normal @ wall.normal[i] > 1 - 1e-9
        same &= np.abs(offset - offset[i]) <= 1e-9 * extent
        position = wall.point[same] @ np.array([-wall.normal[i, 1], wall.normal[i, 0]])
        fraction = np.exp(-0.5 * ((position[:, None] - position[None, :]) / width) ** 2)
        mean[same] = (fraction @ force[same]) / (fraction @ wall.weight[same])
        todo &= ~same
    return mean


class LargestPressure(NamedTuple):
    """Hold the largest pressures on one mesh.

    size: m, the side of its triangles.
    unknowns: of the collision.
    raw, body: N·s/m, the largest p in any triangle and as a mean over a body."""

    size: float
    unknowns: int
    raw: float
    body: float


def largest_pressures(
    room: Room,
    medium: Medium,
    left_velocity: ArrayLike | Field,
    kernel: Kernel,
    sizes: Sequence[float],
    *,
    grading: float = 1.0,
    order: int = 1,
) -> list[LargestPressure]:
    """Take the largest pressure on meshes of these sizes (m).

    Raw it grows as size^(−1/2) on uniform meshes where the room has a jamb (as size^(−1/(2
    grading)) on graded ones); over a body it settles. Body means are taken at the same points for
    all: the vertices of a mesh graded to the jambs, of the largest size. Raises ValueError as
    `mesh_of` and `collide` do."""
    at = mesh_of(room, max(sizes)).p.T
    rows = []
    for size in sizes:
        solution = collide(Space(mesh_of(room, size, grading=grading), order), medium, left_velocity)
        body = float(body_fields(solution, kernel, at).pressure.max())
        unknowns, raw = int(solution.space.basis.N), float(pressure(solution).max())
        rows.append(LargestPressure(size, unknowns, raw, body))
    return rows
