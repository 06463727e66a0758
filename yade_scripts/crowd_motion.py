"""Where YADE's disks are, how fast they move and what acts on them, as arrays.

A body asked for by itself costs Python more than YADE's step of it, so each is asked for once."""

import numpy as np
from yade import Quaternion, Vector3, utils
from yade.wrapper import Omega

O = Omega()  # noqa: E741  (YADE's name)


class Motion:
    """The disks, which are YADE's first bodies, and what moves: disks alone, or clumps of them."""

    def __init__(self, disks, material):
        self.disks, self.bodies, self.of = disks, disks.bodies, disks.bodies.of
        rows = zip(
            disks.radius, disks.mass, disks.position, disks.velocity, disks.spin, strict=True
        )
        self.states = [self._add(*row) for row in rows]
        order = np.argsort(self.of, kind="stable")
        members = np.split(order, np.cumsum(np.bincount(self.of))[:-1])
        self.who = [self._join(number, some.tolist()) for number, some in enumerate(members)]
        for number in range(len(self.of)):
            O.bodies[number].mat = O.materials[material]
        self.movers = [O.bodies[one].state for one in self.who]
        # YADE gives its own vectors, not copies of them: they go on with the run
        self.velocities, self.moves = (
            [state.vel for state in states] for states in (self.states, self.movers)
        )

    def _add(self, radius, mass, position, velocity, spin):
        # YADE takes the centre of a clump by densities, those of its disks' own materials
        own = utils.FrictMat(density=mass / (4 / 3 * np.pi * radius**3))
        body = utils.sphere((*map(float, position), 0.0), float(radius), material=own)
        body.state.mass = float(mass)
        self._send(body.state, velocity, spin)
        return O.bodies[O.bodies.append(body)].state

    @staticmethod
    def _send(state, velocity, spin):
        state.blockedDOFs = "zXY"
        state.vel = Vector3(*map(float, velocity), 0.0)
        state.angVel = Vector3(0.0, 0.0, float(spin))

    def _join(self, number, members):
        """The body of a number: its only disk, or a clump about the centre of mass of several."""
        who = O.bodies.clump(members, discretization=0) if len(members) > 1 else members[0]
        O.bodies[who].aspherical = False  # in the plane there is one inertia
        state, bodies = O.bodies[who].state, self.bodies
        for each in (state, *(self.states[one] for one in members)):
            # members too: damping in proportion to masses is by those of bodies, as in LAMMPS
            each.mass = float(bodies.mass[number])
            each.inertia = Vector3.Ones * float(bodies.inertia[number])
        self._send(state, bodies.velocity[number], bodies.spin[number])
        return who

    def position(self):
        """Centres of disks, (n,2) m."""
        return self._everybody()[: len(self.states)]

    def velocity(self):
        """Velocities of disks, half a step behind the centres, (n,2) m/s."""
        return self._in_plane(self.velocities)

    def force(self, who=None):
        """Forces of the last step on disks, (n,2) N, or on some of YADE's bodies."""
        return self._in_plane(list(map(O.forces.f, who or range(len(self.states)))))

    def instant(self, time_step):
        """Of the step (s) from which YADE has moved all on to the next one: centres (b,2) m and
        velocities (b,2) m/s of bodies, and centres (n,2) m of disks."""
        everybody, later = self._everybody(), self._in_plane(self.moves)
        now = everybody[self.who]
        centre = now - time_step * later
        velocity = later - 0.5 * time_step * self.force(self.who) / self.bodies.mass[:, None]
        if not self.disks.joined:
            return centre, velocity, centre
        angle = -time_step * self._spins()
        return (
            centre,
            velocity,
            self._placed(centre, everybody[: len(self.of)] - now[self.of], angle),
        )

    def of_disks(self, time_step, centre, velocity, position):
        """Velocities (n,2) m/s and spins (n,) rad/s of disks in the same step."""
        torque = np.array([O.forces.t(who)[2] for who in self.who])
        spin = self._spins() - 0.5 * time_step * torque / self.bodies.inertia
        if not self.disks.joined:
            return velocity, spin
        return self._carried(velocity, spin, position - centre[self.of]), spin[self.of]

    def first_half_step(self, time_step, force):
        """Make half a step (s) under forces (n,2) N on disks, and move all on to the first."""
        half, of, bodies = 0.5 * time_step, self.of, self.bodies
        off = self.disks.position - bodies.centre[of]
        torque = np.array([O.forces.t(disk)[2] for disk in range(len(of))])
        torque = np.bincount(of, torque + off[:, 0] * force[:, 1] - off[:, 1] * force[:, 0])
        force = np.column_stack([np.bincount(of, part) for part in force.T])
        for state, inputs, turning in zip(self.movers, force.tolist(), torque.tolist(), strict=True):
            state.vel = state.vel + half / state.mass * Vector3(*inputs, 0.0)
            state.angVel = state.angVel + half / state.inertia[2] * Vector3(0.0, 0.0, turning)
            state.pos = state.pos + time_step * state.vel
            state.ori = Quaternion(Vector3(0, 0, 1), time_step * state.angVel[2]) * state.ori
        if self.disks.joined:
            spin = self._spins()
            centre = np.array([tuple(state.pos.xy()) for state in self.movers])
            position = self._placed(centre, off, time_step * spin)
            moves = self._carried(self._in_plane(self.moves), spin, position - centre[of])
            for row in zip(self.states, position.tolist(), moves, spin[of], strict=True):
                row[0].pos = Vector3(*row[1], 0.0)
                self._send(row[0], *row[2:])

    def _spins(self):
        return np.array([state.angVel[2] for state in self.movers])

    def _placed(self, centre, off, angle):
        """Where (n,2) disks are whose bodies, from places `off` their centres, turn by angles (b,)."""
        cos, sin = np.cos(angle)[self.of], np.sin(angle)[self.of]
        x, y = off.T
        return centre[self.of] + np.column_stack([cos * x - sin * y, sin * x + cos * y])

    def _carried(self, velocity, spin, off):
        """Velocities (n,2) of disks at places `off` the centres of bodies that move so."""
        return velocity[self.of] + spin[self.of, None] * np.column_stack([-off[:, 1], off[:, 0]])

    def _everybody(self):
        return self._columns(*(utils.coordsAndDisplacements(axis)[0] for axis in (0, 1)))

    def _in_plane(self, vectors):
        return self._columns(*([vector[axis] for vector in vectors] for axis in (0, 1)))

    def _columns(self, x, y):
        return np.stack([np.fromiter(values, float, len(values)) for values in (x, y)], axis=1)

    def apply_forces(self, forces):
        """Set the forces (n,2) N that act on the disks until the next call."""
        setter = O.forces.setPermF
        for body, (x, y) in enumerate(forces.tolist()):
            setter(body, (x, y, 0.0))
