"""Arms: a soft layer around people, through which they push each other before their bodies touch."""

import numpy as np
from yade.wrapper import Omega

O = Omega()  # noqa: E741  (YADE's name)


class Arms:
    """Pushes F min(1, max(0, (a - gap)/a)) of each pair of disks, and of each nearest point of walls.

    contact: the scene's, with a = arm_reach_m and F = arm_force_N, without arms where both are 0"""

    def __init__(self, contact, radius, motion, walls):
        self.reach, self.force = (contact.get(f"arm_{key}", 0.0) for key in ("reach_m", "force_N"))
        self.radius, self.motion, self.walls = radius, motion, walls
        self.looked, self.near, self.pushes = -1, np.empty((0, 2), int), []

    def observe(self):
        """Find who is near whom (k,2), bodies, as the collider has; a disk is before a wall."""
        self.looked, n = self.walls.collider.numAction, len(self.radius)
        neighbours = np.array([(one.id1, one.id2) for one in O.interactions.all(onlyReal=False)], int)
        neighbours = np.sort(neighbours.reshape(-1, 2), axis=1)
        self.near = neighbours[neighbours[:, 0] < n]

    def reached(self):
        """The bodies (k,2) within reach, the gap (k,) m and unit vectors (k,2) from the first to the
        second."""
        if self.looked != self.walls.collider.numAction:
            self.observe()
        position, n = self.motion.position(), len(self.radius)
        first, second = self.near.T
        wall, where = second >= n, np.empty((len(first), 2))
        where[~wall] = position[second[~wall]]
        start, end = self.walls.ends[second[wall] - n].swapaxes(0, 1)
        along = end - start
        fraction = ((position[first[wall]] - start) * along).sum(1) / (along**2).sum(1)
        where[wall] = start + np.clip(fraction, 0.0, 1.0)[:, None] * along
        way = where - position[first]
        distance = np.hypot(*way.T)
        gap = (
            distance - self.radius[first] - np.where(wall, 0.0, self.radius[np.where(wall, 0, second)])
        )
        some = gap < self.reach
        some[wall & some] = [
            all(joint.is_mine(*position[disk]) for joint in self.walls.joints.get(body, ()))
            for disk, body in self.near[wall & some]
        ]
        return self.near[some], gap[some], way[some] / distance[some, None]

    def press(self):
        """Called when YADE has evaluated its contacts: push."""
        pairs, gap, normal = self.reached()
        push = (self.force * np.clip(1 - gap / self.reach, 0.0, 1.0))[:, None] * normal
        self.pushes = list(zip(*pairs.T.tolist(), *push.T.tolist(), strict=True))
        for first, second, x, y in self.pushes:
            O.forces.addF(first, (-x, -y, 0.0))
            O.forces.addF(second, (x, y, 0.0))

    def energy(self):
        """What it took to come so near (J)."""
        gap = self.reached()[1] if self.reach else np.empty(0)
        within, beyond = self.reach - gap, np.maximum(-gap, 0.0)
        return 0.5 * self.force / (self.reach or 1.0) * float((within**2 - beyond**2).sum())
