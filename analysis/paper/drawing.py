"""Disks and contacts as shapes to draw."""

from __future__ import annotations

import numpy as np
from matplotlib.patches import Circle

from nscd import Contacts, Snapshot
from nscd.arrays import Flags, Floats


def circles(snapshot: Snapshot, chosen: Flags | None = None) -> list[Circle]:
    """The disks, or the chosen ones (n,)."""
    shown = np.ones(len(snapshot), dtype=bool) if chosen is None else chosen
    places = zip(snapshot.position[shown], snapshot.radius[shown], strict=True)
    return [Circle((x, y), r) for (x, y), r in places]


def contact_lines(snapshot: Snapshot, contacts: Contacts) -> Floats:
    """From the first disk's centre to the second's, or to the wall, (k,2,2) m."""
    end = contacts.point.copy()
    pairs = ~contacts.is_wall
    end[pairs] = snapshot.position[contacts.second[pairs]]
    return np.stack([snapshot.position[contacts.first], end], axis=1)
