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
from nscd.stress import Kernel, smear


def stress(answer: CollisionAnswer) -> Floats:
    """Compute σ = k_v D(w), the percussion stress, negative in compression.

    Returns (d,d,elements,q) N·s/m at the quadrature points."""
    gradient = np.asarray(answer.sum_field.grad)
    return np.asarray(0.5 * answer.medium.k_v * (gradient + gradient.swapaxes(0, 1)))


def pressure(answer: CollisionAnswer) -> Floats:
    """Compute p = −tr σ/d = −½k_v div w in the plane: (elements,q) N·s/m at the quadrature points.

    Its maximum is the mesh's, not the crowd's."""
    return np.asarray(-np.trace(stress(answer)) / answer.space.dimension)


def percussion_density(answer: CollisionAnswer) -> Floats:
    """Compute div σ = ρ(u⁺ − u⁻), the percussion per area; over δt a force per area.

    Returns (d,elements,q) N·s/m² at the quadrature points."""
    return np.asarray(answer.density_field * (answer.right_field - answer.left_field))


class BodyFields(NamedTuple):
    """Hold means over a body at m points.

    pressure: (m,) N·s/m.
    stress: (m,2,2) N·s/m.
    percussion_density: (m,2) N·s/m²."""

    pressure: Floats
    stress: Floats
    percussion_density: Floats


def body_fields(answer: CollisionAnswer, kernel: Kernel, at: ArrayLike) -> BodyFields:
    """Average pressure, stress and percussion density of a crowd in the plane over a body.

    kernel: of width r/2, the standard deviation of its area along an axis, for a disk of radius r.
    at: (m,2) m, the bodies' middles.

    The kernel is normalised by its part inside the room: a body at the wall counts with what of it
    is inside.

    Raises ValueError for a chain (no plane), wrong shapes, or points that are out of the room's
    reach."""
    if answer.space.dimension != 2:
        raise ValueError("answer: a chain has no fields in the plane")
    points = read_only(at, (-1, 2), "at")
    places, area = answer.space.points, answer.space.weights[:, None]
    sigma, density = stress(answer).reshape(4, -1).T, percussion_density(answer).reshape(2, -1).T
    sums, _ = smear(places, area * np.hstack([np.ones_like(area), sigma, density]), kernel, points)
    if (sums[:, 0] <= 0).any():
        x, y = points[int(np.argmin(sums[:, 0]))]
        why = "is out of reach of the room, or the mesh is coarser than the kernel"
        raise ValueError(f"at: ({x:g}, {y:g}) m {why}")
    mean = sums[:, 1:] / sums[:, :1]
    return BodyFields(-0.5 * (mean[:, 0] + mean[:, 3]), mean[:, :4].reshape(-1, 2, 2), mean[:, 4:])


def body_wall_percussion(answer: CollisionAnswer, width: float) -> Floats:
    """Average μ along its line of walls in the plane: (c,) N·s/m at space.wall.

    width: m, the standard deviation of a Gaussian.

    The nodal μ grows at the jambs as the pressure does. Raises ValueError for a width that is not
    positive."""
    positive(width=width)
    wall = answer.space.wall
    force, mean = answer.wall_force, np.empty_like(wall.weight)
    offset = (wall.point * wall.normal).sum(1)
    extent = float(np.ptp(wall.point, axis=0).max())
    todo = np.ones(len(force), dtype=bool)
    while todo.any():
        i = int(np.argmax(todo))
        same = wall.normal @ wall.normal[i] > 1 - 1e-9
        same &= np.abs(offset - offset[i]) <= 1e-9 * extent
        place = wall.point[same] @ np.array([-wall.normal[i, 1], wall.normal[i, 0]])
        share = np.exp(-0.5 * ((place[:, None] - place[None, :]) / width) ** 2)
        mean[same] = (share @ force[same]) / (share @ wall.weight[same])
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
        answer = collide(Space(mesh_of(room, size, grading=grading), order), medium, left_velocity)
        body = float(body_fields(answer, kernel, at).pressure.max())
        unknowns, raw = int(answer.space.basis.N), float(pressure(answer).max())
        rows.append(LargestPressure(size, unknowns, raw, body))
    return rows
