"""Whether two runs are of one crowd in one room: only then are they compared contact by contact."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.dumps import DumpError
from analysis.scene.scene import Scene

# Of the crowds: the field of a snapshot, and how it is called.
FIELDS = {
    "ids": "id",
    "mass": "mass (kg)",
    "radius": "radius (m)",
    "position": "place (m)",
    "velocity": "velocity (m/s)",
    "spin": "spin (1/s)",
}
ROOM = {"walls": "walls", "drive": "drive", "body_force": "body force"}


def check_same_crowd(first: tuple[Path, Scene], second: tuple[Path, Scene]) -> None:
    """Raise DumpError naming what is different, of two runs (folder, scene); contact laws, steps
    and durations may be."""
    (folder, one), (other_folder, other) = first, second
    where = f"{other_folder}: not the crowd of {folder}: "
    crowd, other_crowd = one.snapshot, other.snapshot
    if len(crowd) != len(other_crowd):
        raise DumpError(f"{where}{len(other_crowd)} people, not {len(crowd)}")
    for field, name in FIELDS.items():
        mine, theirs = getattr(crowd, field), getattr(other_crowd, field)
        unlike = (mine != theirs).reshape(len(crowd), -1).any(1)
        if unlike.any():
            row = int(np.argmax(unlike))
            raise DumpError(
                f"{where}{name} of disk {crowd.ids[row]}: {theirs[row]}, not {mine[row]}"
            )
    for field, name in ROOM.items():
        if getattr(one, field) != getattr(other, field):
            raise DumpError(f"{where}other {name}")
