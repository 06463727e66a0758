"""Impulses of contacts between frames, in the form of all engines: impulses.dump."""

ROW = "%d %d %d %.17g %.17g\n"
NAMES = "first second is_wall impulse_x impulse_y"


class Impulses:
    """Sums the forces of every step. That of a frame counts half before it and half after it, as in
    the step of the velocities, so that the impulses between two frames are the change of momentum.

    dumps: knows the disks, the walls and the heads of frames; file: open for writing; time_step:
        s"""

    def __init__(self, dumps, file, time_step):
        self.dumps, self.file, self.time_step = dumps, file, time_step
        self.sums = {}

    def add(self, interactions, share=1.0):
        """Add the forces of a step over a share of it."""
        sums, time = self.sums, share * self.time_step
        for interaction in interactions:
            phys = interaction.phys
            force = phys.normalForce + phys.shearForce
            key = interaction.id1, interaction.id2
            if key in sums:
                sums[key][0] += time * force[0]
                sums[key][1] += time * force[1]
            else:
                sums[key] = [time * force[0], time * force[1]]

    def write(self, step):
        """One frame: the sums since the last one, the smaller id first, walls last."""
        rows = []
        ids, walls = self.dumps.ids, self.dumps.walls
        for (first, second), (x, y) in self.sums.items():
            wall = first in walls or second in walls
            if first in walls or (not wall and first > second):
                first, second, x, y = second, first, -x, -y
            if x or y:
                other = walls[second] if wall else ids[second]
                rows.append((wall, ids[first], other, x + 0.0, y + 0.0))
        self.dumps.head(self.file, step, len(rows), "ENTRIES", NAMES)
        self.file.writelines(ROW % (row[1], row[2], row[0], *row[3:]) for row in sorted(rows))
        self.sums = {}
