"""The soft-contact model, written apart from any engine: the accelerations of the disks."""

from __future__ import annotations

from typing import Any

import numpy as np

from analysis.engines.penalty import damping_ratio_for
from analysis.scene.contact import AS_HERTZ, BODY, CHEST_N_PER_M, CHEST_N_PER_M2
from analysis.scene.scene import Scene
from nscd import Snapshot, Walls, find_contacts
from nscd.arrays import Floats, Indices
from nscd.compiling import kernel
from nscd.segments import connect, is_of_another, share_of

# Laws, as the kernel knows them.
_HOOKE, _HERTZ, _BODY = 0, 1, 2


class SoftModel:
    """The accelerations of a scene's disks: contact forces + m (u_d − v)/τ, over m, and g.

    A contact pushes with max(0, kδ + cδ′) (hooke) or max(0, K √R δ^1.5 + √5 ζ √(m_eff K √(Rδ)) δ′)
    (hertz), or with a chest's force + max(0, cδ′) (body), while δ > 0. The dashpots are those of
    `penalty_of`, derived again from the law's definition. The drive acts continuously. Contacts are
    looked for among those that are within `reach` (m) at the start.

    Raises ValueError for friction, which has a memory that this model does not keep."""

    def __init__(self, scene: Scene, reach: float) -> None:
        if scene.contact.friction:
            raise ValueError(
                f"contact.friction: {scene.contact.friction:g}; "
                "charts and advice are for frictionless contacts"
            )
        self._disks, walls = scene.snapshot, scene.wall_segments()
        pairs = find_contacts(scene.snapshot, tolerance=reach)
        # not the walls of `find_contacts`: which of those that meet answers for a point changes
        # with the motion
        disk, wall = _near(scene.snapshot, walls, reach)
        # a wall's number in `wall`, −1 for a pair
        self._contacts = (
            np.concatenate([pairs.first, disk]),
            np.concatenate([pairs.second, np.zeros_like(disk)]),
            np.concatenate([np.full(len(pairs), -1), wall]),
            connect(walls.start, walls.end),
        )
        self._law: tuple[Any, ...] = _law(scene)
        self._drive = _drive(scene)
        self._acceleration = np.array(scene.acceleration())
        self._ends = np.array(walls.start), np.array(walls.end)

    def accelerate(self, out: Floats, position: Floats, velocity: Floats) -> None:
        """Write the acceleration (n,2) m/s² at positions (n,2) m and velocities (n,2) m/s into
        `out`."""
        disks = self._disks
        _contact_forces(
            out, position, velocity, disks.radius, disks.mass, *self._contacts, *self._law
        )
        out /= disks.mass[:, None]
        out += self._acceleration
        if self._drive is not None:
            _add_drive(out, position, velocity, *self._drive)

    def passes_a_wall(self, before: Floats, after: Floats) -> bool:
        """Tell whether a centre that goes straight from `before` to `after` (n,2) m crosses a wall,
        whose force would then turn round."""
        return bool(_crosses(before, after, *self._ends))


@kernel
def _crosses(before: Any, after: Any, start: Any, end: Any) -> bool:
    """Whether any way (n,2) m crosses any wall (w,2) m: its ends are on both sides, and so are the
    wall's of the way."""
    for wall in range(len(start)):
        x, y = end[wall, 0] - start[wall, 0], end[wall, 1] - start[wall, 1]
        for disk in range(len(before)):
            vx, vy = after[disk, 0] - before[disk, 0], after[disk, 1] - before[disk, 1]
            sx, sy = before[disk, 0] - start[wall, 0], before[disk, 1] - start[wall, 1]
            ex, ey = before[disk, 0] - end[wall, 0], before[disk, 1] - end[wall, 1]
            side, other = x * sy - y * sx, x * (sy + vy) - y * (sx + vx)
            if side * other < 0.0 and (vy * sx - vx * sy) * (vy * ex - vx * ey) <= 0.0:
                return True
    return False


def _near(snapshot: Snapshot, walls: Walls, reach: float) -> tuple[Indices, Indices]:
    """Disks and walls with gaps up to the reach (m), by (disk, wall): two arrays (k,)."""
    disk, wall = (index.ravel() for index in np.indices((len(snapshot), len(walls))))
    to_wall = walls.nearest_point(snapshot.position[disk], wall) - snapshot.position[disk]
    near = np.hypot(*to_wall.T) - snapshot.radius[disk] <= reach
    return disk[near], wall[near]


def _drive(scene: Scene) -> tuple[float, float, Floats, Floats, Floats, Floats] | None:
    """Speed, τ, and of each disk target (start, end), a point of its door's line and where outward
    is, (n,2)."""
    drive = scene.drive
    if drive is None:
        return None
    ways = np.empty((4, len(scene.snapshot), 2))
    for exit_, mine in drive.exits(scene.snapshot.ids):
        for way, point in zip(
            ways, (*drive.target(exit_), exit_.door_start_m, exit_.outward), strict=True
        ):
            way[mine] = point
    start, end, door, outward = ways
    return drive.speed_m_per_s, drive.relaxation_time_s, start, end, door, outward


def _law(scene: Scene) -> tuple[int, float, float, float, float, float]:
    """Which law; k or K of pairs and of walls; ζ; dashpots of pairs and walls (N·s/m)."""
    contact, mass = scene.contact, scene.snapshot.mass
    body = contact.law == BODY
    ratio = damping_ratio_for(contact.restitution**2 if body else contact.restitution)
    k, wall_k = contact.stiffness_N_per_m, contact.at_walls
    heaviest = float(mass.max())
    if contact.law in ("hertz", AS_HERTZ):
        radius = float(scene.snapshot.radius.mean())
        return _HERTZ, *contact.hertz_constants(radius), ratio, 0.0, 0.0
    pair, wall = (
        2 * ratio * float(np.sqrt(a * m)) for a, m in ((k, heaviest / 2), (wall_k, heaviest))
    )
    return _BODY if body else _HOOKE, k, wall_k, ratio, pair, wall


@kernel
def _add_drive(
    acceleration: Any,
    x: Any,
    v: Any,
    speed: float,
    tau: float,
    start: Any,
    end: Any,
    door: Any,
    outward: Any,
) -> None:
    for i in range(len(x)):
        ax, ay = end[i, 0] - start[i, 0], end[i, 1] - start[i, 1]
        square = ax * ax + ay * ay
        px, py, s = x[i, 0] - start[i, 0], x[i, 1] - start[i, 1], 0.0
        if square > 0.0:
            s = min(1.0, max(0.0, (px * ax + py * ay) / square))
        dx, dy = start[i, 0] + s * ax - x[i, 0], start[i, 1] + s * ay - x[i, 1]
        distance = np.sqrt(dx * dx + dy * dy)
        beyond = (x[i, 0] - door[i, 0]) * outward[i, 0] + (x[i, 1] - door[i, 1]) * outward[i, 1]
        if beyond >= 0.0 or distance == 0.0:
            dx, dy, distance = outward[i, 0], outward[i, 1], 1.0
        acceleration[i, 0] += (speed * dx / distance - v[i, 0]) / tau
        acceleration[i, 1] += (speed * dy / distance - v[i, 1]) / tau


@kernel
def _contact_forces(
    force: Any,
    x: Any,
    v: Any,
    radius: Any,
    mass: Any,
    first: Any,
    second: Any,
    wall: Any,
    segments: Any,
    law: int,
    pair_stiffness: float,
    wall_stiffness: float,
    ratio: float,
    pair_dashpot: float,
    wall_dashpot: float,
) -> None:
    force[:] = 0.0
    for c in range(len(first)):
        i, j, w = first[c], second[c], wall[c]
        if w < 0:
            dx, dy = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1]
            sum_of_radii = radius[i] + radius[j]
            size = radius[i] * radius[j] / sum_of_radii
            m = mass[i] * mass[j] / (mass[i] + mass[j])
        else:
            s = share_of(segments, w, x[i, 0], x[i, 1])
            if is_of_another(segments, w, s, x[i, 0], x[i, 1]):
                continue
            dx = segments.start[w, 0] + s * segments.along[w, 0] - x[i, 0]
            dy = segments.start[w, 1] + s * segments.along[w, 1] - x[i, 1]
            sum_of_radii, size, m = radius[i], radius[i], mass[i]
        distance = np.sqrt(dx * dx + dy * dy)
        overlap = sum_of_radii - distance
        if overlap <= 0.0:
            continue
        nx, ny = dx / distance, dy / distance
        vx, vy = v[i, 0], v[i, 1]
        if w < 0:
            vx, vy = vx - v[j, 0], vy - v[j, 1]
        approach = vx * nx + vy * ny
        stiffness = pair_stiffness if w < 0 else wall_stiffness
        if law == _HERTZ:
            tangent = stiffness * np.sqrt(size * overlap)
            push = tangent * overlap + np.sqrt(5.0) * ratio * np.sqrt(m * tangent) * approach
        elif law == _BODY:
            depth = 0.5 * overlap if w < 0 else overlap
            push = CHEST_N_PER_M * depth + CHEST_N_PER_M2 * depth * depth
            push += max(0.0, (pair_dashpot if w < 0 else wall_dashpot) * approach)
        else:
            push = stiffness * overlap + (pair_dashpot if w < 0 else wall_dashpot) * approach
        if push <= 0.0:
            continue
        force[i, 0] -= push * nx
        force[i, 1] -= push * ny
        if w < 0:
            force[j, 0] += push * nx
            force[j, 1] += push * ny
