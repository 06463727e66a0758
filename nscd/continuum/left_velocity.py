"""Left velocities u⁻ of a continuous crowd: toward the exit, random."""

from collections.abc import Callable
from typing import Any

import numpy as np
from skfem import Mesh

from nscd.arrays import Floats, number, read_only
from nscd.continuum.medium import positive
from nscd.continuum.room import Room
from nscd.segments import nearest_on_segment

Field = Callable[[Floats], Floats]
"""From points (m,d) m to velocities (m,d) m/s."""


def toward_exit(room: Room, speed: float) -> Field:
    """Walk to the nearest point of the exits: (m,2) m → (m,2) m/s.

    u⁻ = speed·(P − x)/|P − x| with P(x) that point; 0 on the exits. At a jamb this takes u⁻·n = 0
    from the wall's side. (The paper, section 3.2.2, prints the opposite sign.) In L² but not in H¹.

    Raises ValueError for a room without an exit or a speed that is not finite."""
    exits = room.pieces("exit")
    if len(exits) == 0:
        raise ValueError("room: it has no exit to walk to")
    if not np.isfinite(speed):
        raise ValueError(f"speed: {speed} m/s")
    extent = float(np.ptp(room.outline, axis=0).max())

    def velocity(points: Floats) -> Floats:
        away, nearest = np.full(len(points), np.inf), np.zeros((len(points), 2))
        for start, end in exits:
            way = nearest_on_segment(points, start, end) - points
            distance = np.hypot(*way.T)
            closer = distance < away
            away[closer], nearest[closer] = distance[closer], way[closer]
        at_exit = away <= 1e-12 * extent
        direction = nearest / np.where(at_exit, 1.0, away)[:, None]
        return np.asarray(speed * np.where(at_exit[:, None], 0.0, direction))

    return velocity


def random_speeds(
    room: Room, direction: Field, *, mean: float, deviation: float, seed: int, cell: float
) -> Field:
    """Walk at random speeds: (m,2) m → (m,2) m/s.

    direction: a field of length 1.
    mean, deviation: m/s, of a normal distribution; a negative draw walks away.
    cell: m, the side of a square with one speed, the place of a person (1/√density); independent
        of the mesh.

    Raises ValueError for a mean that is not finite, a negative deviation or a cell that is not
    positive."""
    positive(cell=cell)
    number(mean, "mean")
    if number(deviation, "deviation") < 0:
        raise ValueError(f"deviation: {deviation:g}")
    low = room.outline.min(0)
    count = np.ceil(np.ptp(room.outline, axis=0) / cell).astype(int) + 1
    speed = np.random.default_rng(seed).normal(mean, deviation, count)

    def velocity(points: Floats) -> Floats:
        # a point of the border may lie outside by rounding
        column, row = np.clip(((points - low) / cell).astype(int), 0, count - 1).T
        return np.asarray(speed[column, row][:, None] * direction(points))

    return velocity


def checked(value: Any, mesh: Mesh, name: str = "left_velocity") -> Field | Floats:
    """Check a vector field and return it, or values (n,d) at the mesh's vertices.

    value: a function of points, (n,d) one per vertex, or (d,) uniform.
    Raises ValueError, with this name, for any other shape or a value that is not finite."""
    if callable(value):
        field: Field = value
        return field
    d, n = int(mesh.dim()), int(mesh.nvertices)
    shape = np.shape(value)
    if shape == (d,):
        return np.tile(read_only(value, (d,), name), (n, 1))
    if shape != (n, d):
        wanted = f"({d},), ({n}, {d}) (one per vertex) or a function"
        raise ValueError(f"{name}: shape {shape} where {wanted} is needed")
    return read_only(value, (n, d), name)
