"""Walls as YADE's boxes of no thickness. Walls that meet are one body: a disk has one contact for
each nearest point of it, where boxes alone would give one each."""

import math

import numpy as np
from yade import Quaternion, Vector3, utils
from yade.wrapper import Omega

O = Omega()  # noqa: E741  (YADE's name)
HALF_HEIGHT_M = 1.0  # across the plane of the disks
SAME_POINT_M = 1e-9  # ends of walls that are nearer to each other than this are one point
ROUNDING_M = 1e-12  # over the joint of two walls in line, rounding would find both


class Joint:
    """An end of a wall where it meets others: the wall's own side and, where it is the first of
    them, the sides of the others (else None)."""

    def __init__(self, point, own, others):
        self.x, self.y = map(float, point)
        self.own = self._unit(own)
        self.others = None if others is None else [self._unit(other) for other in others]

    @staticmethod
    def _unit(way):
        return (float(way[0] / math.hypot(*way)), float(way[1] / math.hypot(*way)))

    def is_beyond(self, x, y, reach):
        """Whether a disk at a point is beyond the wall's end, or within a reach (m) of being so."""
        return (x - self.x) * self.own[0] + (y - self.y) * self.own[1] <= ROUNDING_M + reach

    def is_mine(self, x, y):
        """Whether the contact of a disk at a point (m) is the wall's own: its nearest point is
        within the wall, or it is the end, of which all others lead away too."""
        if not self.is_beyond(x, y, 0.0):
            return True
        dx, dy = x - self.x, y - self.y
        return self.others is not None and all(
            dx * other[0] + dy * other[1] <= ROUNDING_M for other in self.others
        )


def joints_of(walls):
    """The joints of each wall of a scene, by its number from 1: walls that meet are one body, and a
    disk has one contact for each nearest point of it."""
    ends = [[np.array(wall[key], float) for key in ("start_m", "end_m")] for wall in walls]
    found = {}
    for number, (start, end) in enumerate(ends):
        for point, far in ((start, end), (end, start)):
            others, first, inner = [], True, False
            for other, (low, high) in enumerate(ends):
                if other == number:
                    continue
                in_contact = [_distance(point, corner) <= SAME_POINT_M for corner in (low, high)]
                if any(in_contact):
                    others.append(high - low if in_contact[0] else low - high)
                    first = first and number < other
                elif _distance(point, _nearest(point, low, high)) <= SAME_POINT_M:
                    inner = True
            if others or inner:
                mine = others if first and not inner else None
                found.setdefault(number + 1, []).append(Joint(point, far - point, mine))
    return found


def _distance(one, other):
    return math.hypot(*(one - other))


def _nearest(point, low, high):
    along = high - low
    fraction = min(max((point - low) @ along / (along @ along), 0.0), 1.0)
    return low + fraction * along


class Giving:
    """A wall that gives, as a mass on a spring with a damper: s its way along its normal (m), speed half
    a step behind it (m/s), as those of YADE's disks are."""

    def __init__(self, wall, body):
        (x0, y0), (x1, y1) = wall["start_m"], wall["end_m"]
        length = math.hypot(x1 - x0, y1 - y0)
        self.name, self.body, self.state = wall["name"], body, O.bodies[body].state
        self.normal = np.array([(y0 - y1) / length, (x1 - x0) / length])
        self.mass, self.spring = wall["mass_kg"], wall.get("stiffness_N_per_m", 0.0)
        self.damper, self.s, self.speed = wall.get("damping_N_s_per_m", 0.0), 0.0, 0.0

    def change(self, force, time_step):
        """What a step (s) under a force (2,) N changes the speed by; the damper acts on the mean of the
        speeds before and after it."""
        inputs = force @ self.normal - self.spring * self.s - self.damper * self.speed
        return time_step * inputs / (self.mass + 0.5 * time_step * self.damper)

    def go(self, change, time_step):
        """Change the speed, with which YADE moves the box in this step."""
        self.speed, self.last = self.speed + change, change
        self.s += time_step * self.speed
        self.state.vel = Vector3(*map(float, self.speed * self.normal), 0.0)


class Walls:
    """The boxes of a scene's walls, their numbers from 1 by body, and the contacts that count."""

    def __init__(self, walls, material, states, collider):
        """states: of the disks, which are the first bodies; collider: it finds who is near."""
        self.collider, self.looked, self.near_ends = collider, 0, []
        self.material, self.states = O.materials.append(material), states
        self.ends = np.array([(wall["start_m"], wall["end_m"]) for wall in walls]).reshape(-1, 2, 2)
        self.numbers = {self._add(wall): number for number, wall in enumerate(walls, start=1)}
        bodies = {number: body for body, number in self.numbers.items()}
        self.giving = {
            number: Giving(wall, bodies[number])
            for number, wall in enumerate(walls, start=1)
            if "mass_kg" in wall
        }
        joints = joints_of(walls)
        self.joints = {body: joints[n] for body, n in self.numbers.items() if n in joints}
        self.double = set()

    def _add(self, wall):
        (x0, y0), (x1, y1) = wall["start_m"], wall["end_m"]
        half, turn = (0.5 * abs(x1 - x0), 0.5 * abs(y1 - y0)), 0.0
        if half[0] and half[1]:  # slanted; the others need no turn and so no rounding
            half, turn = (math.hypot(*half), 0.0), math.atan2(y1 - y0, x1 - x0)
        box = utils.box(
            (0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.0),
            (*half, HALF_HEIGHT_M),
            orientation=Quaternion(Vector3(0, 0, 1), turn),
            fixed=True,
            material=self.material,
        )
        return O.bodies.append(box)

    def give(self):
        """Called when the forces of a step are summed, before YADE moves what has a speed."""
        if O.dt > 0 and O.iter > 0:
            for one in self.giving.values():
                one.go(one.change(np.array(tuple(O.forces.f(one.body).xy())), O.dt), O.dt)

    def write(self, time_step):
        """Write where walls that give are in the step of a frame, from which YADE has moved them on."""
        for one in self.giving.values():
            now = one.s - time_step * one.speed, one.speed - 0.5 * one.last
            one.file.write(f"{O.iter} %.17g %.17g\n" % now)

    def moved(self):
        """How far (w,2) m each wall has given."""
        far = np.zeros((len(self.numbers), 2))
        for number, one in self.giving.items():
            far[number - 1] = one.s * one.normal
        return far

    def begin(self, time_step):
        """Make the first half step from rest, under the forces of the contacts that count."""
        for one in self.giving.values():
            force = np.zeros(2)
            for contact in O.interactions.withBody(one.body):
                if contact.isReal:
                    pressing = np.array(
                        tuple((contact.phys.normalForce + contact.phys.shearForce).xy())
                    )
                    force += pressing if contact.id2 == one.body else -pressing
            one.go(0.5 * one.change(force, time_step), time_step)
            one.state.pos = one.state.pos + time_step * one.state.vel

    def take_back(self):
        """Called when the forces of a step are summed: take those back that a wall gives at a point
        which another wall answers for."""
        self.double = set()
        if self.looked != self.collider.numAction:
            self._look_for_ends()
        for disk, wall in self.near_ends:
            interaction, position = O.interactions[disk, wall], self.states[disk].pos
            mine = all(joint.is_mine(position[0], position[1]) for joint in self.joints[wall])
            if interaction.isReal and not mine:
                self.double.add(frozenset((disk, wall)))
                # the law has given this to the second body, and the opposite to the first
                force = interaction.phys.normalForce + interaction.phys.shearForce
                force = -force if disk == interaction.id2 else force
                O.forces.addF(disk, force)
                O.forces.addT(disk, (interaction.geom.contactPoint - position).cross(force))

    def _look_for_ends(self):
        """Find the disks that may pass the end of a wall before the collider runs again: it runs
        before anybody has moved by its verletDist."""
        self.looked, self.near_ends = self.collider.numAction, []
        for wall, joints in self.joints.items():
            for interaction in O.interactions.withBodyAll(wall):
                disk = interaction.id1 if interaction.id2 == wall else interaction.id2
                if disk in self.numbers:
                    continue
                x, y = self.states[disk].pos.xy()
                if any(joint.is_beyond(x, y, 2 * self.collider.verletDist) for joint in joints):
                    self.near_ends.append((disk, wall))

    def wall_contacts(self):
        """The contacts, each once."""
        real = [interaction for interaction in O.interactions if interaction.isReal]
        if not self.double:
            return real
        return [one for one in real if frozenset((one.id1, one.id2)) not in self.double]
