"""Where YADE's disks are, how fast they move and what acts on them, as arrays.

A body asked for by itself costs Python more than YADE's step of it, so each is asked for once."""

from operator import itemgetter

import numpy as np
from yade import utils
from yade.wrapper import Omega

O = Omega()  # noqa: E741  (YADE's name)


class Motion:
    """The disks, which are the first bodies; `states`: their states."""

    def __init__(self, states):
        # YADE gives its own vectors, not copies of them: they go on with the run
        self.velocities = [state.vel for state in states]
        self.bodies = range(len(states))

    def position(self):
        """Centres, (n,2) m."""
        x, y = (utils.coordsAndDisplacements(axis)[0] for axis in (0, 1))
        return self._columns(x[: len(self.bodies)], y[: len(self.bodies)])

    def velocity(self):
        """Velocities, half a step behind the centres, (n,2) m/s."""
        return self._in_plane(self.velocities)

    def force(self):
        """Forces of the last step, (n,2) N."""
        return self._in_plane(list(map(O.forces.f, self.bodies)))

    def _in_plane(self, vectors):
        return self._columns(*(map(itemgetter(axis), vectors) for axis in (0, 1)))

    def _columns(self, x, y):
        n = len(self.bodies)
        return np.stack([np.fromiter(values, float, n) for values in (x, y)], axis=1)

    def hold(self, forces):
        """Set the forces (n,2) N that act on the disks until the next call."""
        setter = O.forces.setPermF
        for body, x, y in zip(self.bodies, *forces.T.tolist(), strict=True):
            setter(body, (x, y, 0.0))
