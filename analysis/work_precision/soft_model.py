"""The soft-contact model, written apart from any engine: the accelerations of the disks."""

from __future__ import annotations

import numpy as np

from analysis.engines.penalty import damping_ratio_for
from analysis.scene.contact import AS_HERTZ, BODY, CHEST_N_PER_M, CHEST_N_PER_M2
from analysis.scene.scene import Scene
from nscd import Snapshot, Walls, _core, find_contacts
from nscd.arrays import Floats, Indices
from nscd.contacts import connected

# Laws, by their numbers in the core.
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
            connected(walls),
        )
        law, *constants = _law(scene)
        self._law = law, np.array([*constants, CHEST_N_PER_M, CHEST_N_PER_M2])
        self._drive = _drive(scene)
        self._acceleration = np.array(scene.acceleration())
        self._ends = np.array(walls.start), np.array(walls.end)

    def accelerate(self, out: Floats, position: Floats, velocity: Floats) -> None:
        """Write the acceleration (n,2) m/s² at positions (n,2) m and velocities (n,2) m/s into
        `out`."""
        disks = self._disks
        _core.soft_forces(
            out, position, velocity, disks.radius, disks.mass, *self._contacts, *self._law
        )
        out /= disks.mass[:, None]
        out += self._acceleration
        if self._drive is not None:
            _core.soft_drive(out, position, velocity, *self._drive)

    def passes_a_wall(self, before: Floats, after: Floats) -> bool:
        """Tell whether a centre that goes straight from `before` to `after` (n,2) m crosses a wall,
        whose force would then turn round."""
        return _core.crosses(before, after, *self._ends)


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
