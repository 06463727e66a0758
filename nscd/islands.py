"""Islands of the contact graph: groups of disks that touch; walls do not connect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscd import _core
from nscd.arrays import Flags, Floats, Index32
from nscd.bodies import Snapshot
from nscd.contacts import Contacts


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Islands:
    """Hold the m islands of a contact graph.

    label: (n,) island of each disk
    contacts, disks: (m,) how many it has
    pressed: (m,) whether one of its contacts would close"""

    label: Index32
    contacts: Index32
    disks: Index32
    pressed: Flags


def find_islands(snapshot: Snapshot, contacts: Contacts, left_velocity: Floats) -> Islands:
    """Find the islands of n disks with left velocities (n,2) m/s."""
    label, count, disks, pressed = _core.islands(
        contacts.first, contacts.second, contacts.is_wall, contacts.normal, snapshot.mass,
        np.ascontiguousarray(left_velocity),
    )  # fmt: skip
    return Islands(label=label, contacts=count, disks=disks, pressed=pressed)
