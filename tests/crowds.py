"""Crowds that tests begin with."""

import numpy as np

from nscd import Snapshot


def disks_at(position, velocity=(0.0, 0.0), radius=0.25, mass=75.0, **others):
    """Disks at (n,2) m; one velocity (m/s), radius (m) or mass (kg) is everybody's."""
    n = len(position)
    return Snapshot(
        position=position,
        velocity=np.broadcast_to(velocity, (n, 2)),
        radius=np.broadcast_to(radius, n),
        mass=np.broadcast_to(mass, n),
        **others,
    )
