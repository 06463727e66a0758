"""The guard: every few steps it asks whether the run can still be right, as lammps_inputs/guard.in
does.

What it asks, why and with which limits: docs/results/guard.md.
"""

import math

import numpy as np
from scene_file import acceleration, fastest, speed_most
from yade import utils

CENTRES_SHARE = 0.5  # of the smallest radius: no two centres are nearer
STEP_SHARE = 0.1  # of a disk's radius
ENERGY_SHARE = 0.05  # of the energy at the start and of everybody at the desired speed
MOMENTUM_SHARE = 1e-9  # of sqrt(2 M E)
STOPPED = 3  # exit status


def interval_of(scene, disks, penalty):
    """Steps between two looks: within 2 sqrt(m/k) of the lightest disk no contact begins and ends
    unseen, nobody at the fastest speed asked for passes half the smallest radius, and the drive
    changes little; at least ten looks a run. A driven run is looked at where its drive is
    evaluated, if that is often enough."""
    drive = scene.get("drive")
    span = min(
        2 * math.sqrt(disks.masses_met()[0] / penalty.stiffest),
        0.5 * disks.radius.min() / (speed_most(scene, disks) + 1e-300),
        0.05 * drive["relaxation_time_s"] if drive else math.inf,
    )
    steps = max(1, min(int(span / penalty.time_step), penalty.steps // 10))
    every = scene["run"].get("drive_interval_steps", 10) if drive else 1
    return steps - steps % every if steps > every else steps


class Guard:
    """What a sound run keeps to. `observe` gives the reason why it is not sound any more, or None."""

    def __init__(self, scene, disks, penalty, stored, centres_apart):
        """stored: the energy (J) of the overlaps at the start; centres_apart: a function for the
        smallest distance of two disks that touch (m)."""
        self.disks, self.penalty, self.centres_apart = disks, penalty, centres_apart
        self.interval = interval_of(scene, disks, penalty)
        drive = scene.get("drive")
        self.relaxation_time = drive["relaxation_time_s"] if drive else math.inf
        self.turns = disks.joined or scene["contact"].get("friction", 0.0) > 0 or disks.spin.any()
        self.desired = 0.5 * float(disks.mass.sum()) * fastest(drive) ** 2 if drive else 0.0
        of = disks.bodies
        moving, spinning = of.mass @ (of.velocity**2).sum(1), of.inertia @ of.spin**2
        self.start = 0.5 * float(moving + spinning) + stored
        self.energy_input, self.power = 0.0, self._power(0.5 * float(moving))
        self.margin = ENERGY_SHARE * (self.start + self.desired) + 1e-12
        self.weight = disks.mass[:, None] * acceleration(scene)
        walls = np.array([(wall["start_m"], wall["end_m"]) for wall in scene.get("walls", [])])
        self.walls = walls.reshape(-1, 2, 2)
        self.moved = lambda: np.zeros((len(self.walls), 2))  # what walls that give have (m)
        self.before = disks.position  # at the last look
        self.isolated = not drive and not len(self.walls) and not self.weight.any()
        self.momentum = disks.mass @ disks.velocity
        self.low, self.high = np.array(
            [[float(word) for word in line.split()] for line in disks.box[:2]]
        ).T

    def observe(self, position, velocity, centres):
        """The kind of what is broken and a sentence, or None. position and velocity (n,2) of disks and
        velocities (b,2) of bodies' centres are functions."""
        kinetic = utils.kineticEnergy()
        if not math.isfinite(kinetic):
            return "finite", "the kinetic energy is not a finite number"
        moving = 0.5 * self.disks.bodies.mass @ (centres() ** 2).sum(1) if self.turns else kinetic
        power = self._power(moving)
        self.energy_input += 0.5 * (self.power + power) * self.interval * self.penalty.time_step
        self.power = power
        return (
            self._lost(position)
            or self._overlap()
            or self._stride(kinetic, velocity)
            or (self._through_walls(position()) if len(self.walls) else None)
            or self._energy(kinetic, position)
            or (self._momentum(velocity()) if self.isolated else None)
        )

    def _power(self, kinetic):
        """The most that the drive can give at this kinetic energy of centres (W)."""
        return 2 * (math.sqrt(self.desired * kinetic) - kinetic) / self.relaxation_time

    def _energy(self, kinetic, position):
        maximum, margin = self.start + self.energy_input, self.margin
        if self.weight.any():
            fallen = float((self.weight * (position() - self.disks.position)).sum())
            maximum, margin = maximum + fallen, margin + ENERGY_SHARE * abs(fallen)
        if kinetic > maximum + margin:
            can = f"the start and what drives it can give {max(maximum, 0.0):.6g} J"
            return "energy", f"kinetic energy {kinetic:.6g} J, {can}"
        return None

    def _overlap(self):
        # the overlap of two disks over the harmonic mean of their radii; two centres nearer than
        # half the smallest radius have 1.5 at least
        if utils.maxOverlapRatio() <= 2 - CENTRES_SHARE:
            return None
        fraction = self.centres_apart() / self.disks.radius.min()
        if not fraction >= CENTRES_SHARE:
            return (
                "overlap",
                f"two centres are {fraction:.3g} of the smallest radius apart, at least "
                f"{CENTRES_SHARE:g} are needed",
            )
        return None

    def _lost(self, position):
        low, high = (
            np.array([corner[0], corner[1]])
            for corner in utils.aabbExtrema(cutoff=0.0, centers=True)
        )
        if (low >= self.low).all() and (high <= self.high).all():
            return None
        where = position()
        lost = int((~((where >= self.low) & (where <= self.high))).any(1).sum())
        return "lost", f"{lost} of {len(where)} disks are lost"

    def _through_walls(self, position):
        """Whether the straight way of a centre since the last look crosses a wall."""
        before, self.before = self.before, position
        passed = np.zeros(len(position), bool)
        for start, end in self.walls + self.moved()[:, None]:
            sides = [_turn(end - start, location - start) for location in (before, position)]
            ends = [_turn(position - before, corner - before) for corner in (start, end)]
            passed |= (sides[0] * sides[1] < 0) & (ends[0] * ends[1] <= 0)
        if passed.any():
            words = f"the centre of {passed.sum()} of {len(position)} disks has passed a wall"
            return "wall", words
        return None

    def _stride(self, kinetic, velocity):
        dt, disks = self.penalty.time_step, self.disks
        # nobody can be faster than this: then there is no need to look at each
        if math.sqrt(2 * kinetic / disks.masses_met()[0]) * dt <= STEP_SHARE * disks.radius.min():
            return None
        fraction = float((np.hypot(*velocity().T) / disks.radius).max()) * dt
        if not fraction <= STEP_SHARE:
            return (
                "speed",
                f"a disk moves {fraction:.3g} of its radius in a step, "
                f"at most {STEP_SHARE:g} are allowed",
            )
        return None

    def _momentum(self, velocity):
        scale = math.sqrt(2 * float(self.disks.mass.sum()) * self.start) + 1e-300
        now = self.disks.mass @ velocity
        drift = (abs(now[0] - self.momentum[0]) + abs(now[1] - self.momentum[1])) / scale
        if not drift <= MOMENTUM_SHARE:
            return (
                "momentum",
                f"momentum of an isolated crowd changed by {drift:.3g} of its scale, at most "
                f"{MOMENTUM_SHARE:g} are allowed",
            )
        return None


def _turn(one, other):
    """The cross product of vectors (n,2) or (2,)."""
    return one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]
