"""The dumps of a run, frame by frame, in the form of the LAMMPS decks."""

import numpy as np

CONTACT_ROW = "%d %d %d %.17g %.17g %.17g %.17g %.17g\n"
CONTACT_NAMES = "first second is_wall nx ny overlap fx fy"
IMPULSE_ROW = "%d %d %d %.17g %.17g\n"
IMPULSE_NAMES = "first second is_wall impulse_x impulse_y"


class Dumps:
    """Writes frames to two open files; `walls`: number of a wall, from 1, by its body."""

    def __init__(self, bodies, contacts, disks, walls):
        self.bodies, self.contacts, self.disks, self.walls = bodies, contacts, disks, walls
        self.ids = disks.ids.tolist()

    def write_bodies(self, step, position, velocity, spin, force, drive=None):
        """One frame of bodies.dump: arrays (n,2) m, m/s, (n,) rad/s, (n,2) N, and the drive (n,2) N
        where there is one."""
        disks, zero = self.disks, np.zeros(len(self.disks.ids))
        columns = [disks.ids, zero + 1, position, zero, disks.radius, disks.mass]
        columns += [velocity, zero, spin, force]
        names = "id type x y z radius mass vx vy vz omegaz fx fy"
        if disks.joined:
            bodies = disks.bodies
            columns += [values[bodies.of] for values in (bodies.ids, bodies.inertia)]
            names += " mol body_inertia"
        if drive is not None:
            columns, names = [*columns, drive], names + " drive_x drive_y"
        table = np.column_stack(columns)
        row = "%d %d" + " %.17g" * (table.shape[1] - 2) + "\n"
        self.head(self.bodies, step, len(table), "ATOMS", names)
        self.bodies.writelines(row % tuple(values) for values in table.tolist())

    def write_contacts(self, step, interactions):
        """One frame of contacts.dump: those that overlap, sorted."""
        rows = sorted(
            filter(None, map(self.contact, interactions)),
            key=lambda values: (values[2], *values[:2]),
        )
        self.head(self.contacts, step, len(rows), "ENTRIES", CONTACT_NAMES)
        self.contacts.writelines(CONTACT_ROW % values for values in rows)

    def head(self, file, step, count, kind, names):
        """The lines before the table of a frame."""
        box = "".join(self.disks.box)
        file.write(f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF {kind}\n{count}\n")
        file.write(f"ITEM: BOX BOUNDS ff ff pp\n{box}ITEM: {kind} {names}\n")

    def bodies_of(self, first, second):
        """Who touches whom: the index of the first disk, the second's id or the wall's number,
        whether it is a wall, and -1 where the two are swapped: the smaller one is first, a wall
        second."""
        wall, way = first in self.walls or second in self.walls, 1.0
        if first in self.walls or (not wall and first > second):
            first, second, way = second, first, -1.0
        return first, self.walls[second] if wall else self.ids[second], wall, way

    def contact(self, interaction):
        """A row: the first disk, the second disk or the wall, and what the first does to it."""
        geom, phys = interaction.geom, interaction.phys
        overlap = geom.penetrationDepth
        if overlap <= 0:
            return None
        normal, pressing, sliding = geom.normal, phys.normalForce, phys.shearForce
        first, other, wall, way = self.bodies_of(interaction.id1, interaction.id2)
        # + 0.0: no negative zeros
        along = [way * normal[axis] + 0.0 for axis in (0, 1)]
        force = [way * (pressing[axis] + sliding[axis]) + 0.0 for axis in (0, 1)]
        return (self.ids[first], other, wall, *along, overlap, *force)


class Impulses:
    """Sums the forces of every step, and writes frames to an open file. The force of a frame counts
    half before it and half after it, as in the step of the velocities, so that the impulses between
    two frames are the change of momentum. time_step: s"""

    def __init__(self, dumps, file, time_step):
        self.dumps, self.file, self.time_step = dumps, file, time_step
        self.sums = {}

    def add(self, interactions, pushes, fraction):
        """Add the forces of a step over a share of it; pushes: first, second, and what the first
        does to the second, x, y."""
        forces = [
            (one.id1, one.id2, *(one.phys.normalForce + one.phys.shearForce).xy())
            for one in interactions
        ]
        for first, second, x, y in (*forces, *pushes):
            if first > second:
                first, second, x, y = second, first, -x, -y
            had = self.sums.setdefault((first, second), [0.0, 0.0])
            had[0] += fraction * self.time_step * x
            had[1] += fraction * self.time_step * y

    def write(self, step):
        """One frame: the sums since the last one, the smaller id first, walls last."""
        rows = []
        for bodies, (x, y) in self.sums.items():
            first, other, wall, way = self.dumps.bodies_of(*bodies)
            if x or y:
                rows.append((wall, self.dumps.ids[first], other, way * x + 0.0, way * y + 0.0))
        self.dumps.head(self.file, step, len(rows), "ENTRIES", IMPULSE_NAMES)
        self.file.writelines(IMPULSE_ROW % (*row[1:3], row[0], *row[3:]) for row in sorted(rows))
        self.sums = {}
