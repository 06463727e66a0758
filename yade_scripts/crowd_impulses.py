"""Impulses of contacts between frames, in the form of all engines: impulses.dump."""

ROW = "%d %d %d %.17g %.17g\n"
NAMES = "first second is_wall impulse_x impulse_y"
NONE = (0.0, 0.0)


class Impulses:
    """Sums contact forces over time by the trapezoidal rule, from one look to the next.

    dumps: what knows the rows of contacts and the heads of frames; file: open for writing"""

    def __init__(self, dumps, file):
        self.dumps, self.file = dumps, file
        self.time, self.before, self.sums = 0.0, {}, {}

    def look(self, time, interactions):
        """Add the time since the last look (s), at half the forces then and half those now."""
        half, now = 0.5 * (time - self.time), {}
        for row in filter(None, map(self.dumps.contact, interactions)):
            now[row[2], row[0], row[1]] = row[6], row[7]
        for key in self.before.keys() | now.keys():
            (x0, y0), (x1, y1) = self.before.get(key, NONE), now.get(key, NONE)
            x, y = self.sums.get(key, NONE)
            self.sums[key] = x + half * (x0 + x1), y + half * (y0 + y1)
        self.time, self.before = time, now

    def write(self, step):
        """One frame: the sums since the last one."""
        rows = sorted((key, sums) for key, sums in self.sums.items() if sums != NONE)
        self.dumps.head(self.file, step, len(rows), "ENTRIES", NAMES)
        self.file.writelines(
            ROW % (first, second, wall, *sums) for (wall, first, second), sums in rows
        )
        self.sums = {}
