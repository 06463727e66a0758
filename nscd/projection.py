"""The nearest velocities, or displacements, that satisfy the constraints of contacts."""

import numpy as np

from nscd import _core
from nscd.arrays import Floats
from nscd.bodies import Snapshot
from nscd.contacts import Contacts


def project(
    snapshot: Snapshot,
    contacts: Contacts,
    free: Floats,
    offset: Floats,
    *,
    scale: float,
    tolerance: float,
) -> tuple[Floats, float]:
    """Compute u (n,2) of min ½ Σ m |u − free|² subject to C u ≤ offset, and its recomputed error.

    free: (n,2) m or m/s; (b,3) of bodies of several disks, as is u
    offset: (k,) in the same unit
    scale: in the same unit, at least what the error is measured in, as a share of it
    tolerance: share, of that error"""
    wide, motion = snapshot.wide, np.ascontiguousarray(free)
    bodies, left = None, motion
    if wide is not None:
        bodies = wide.number, wide.centre, wide.mass, wide.inertia, motion
        left = np.zeros_like(snapshot.position)
    said = _core.solve_impact(
        contacts.first, contacts.second, contacts.is_wall, contacts.normal, snapshot.position,
        snapshot.radius, snapshot.mass, left, offset=offset, least_scale=scale,
        tolerance=tolerance, least=False, bounded=False, bodies=bodies,
    )  # fmt: skip
    assert said is not None, "contacts of disks that there are, and finite numbers"
    found, finite = said[:2]
    error = max(found["residual"], found["momentum_error"])
    moved = found["right_velocity"]
    if wide is not None:
        moved = np.column_stack([moved, found["right_spin"]])
    return moved, error if finite else np.inf
