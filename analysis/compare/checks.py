"""Whether what is asked of a run is in it: contacts of its disks, an instant of it."""

import numpy as np

from analysis.dumps import DumpError, DumpIndex, EngineContacts
from analysis.scene.scene import Scene
from nscd import Snapshot

# Steps times the time step are the end of a run to rounding.
SAME = 1e-9


def check_contacts(
    index: DumpIndex, number: int, contacts: EngineContacts, snapshot: Snapshot, scene: Scene
) -> None:
    """Refuse contacts of disks or walls that do not exist.

    Raises DumpError naming the line."""
    wall, walls = contacts.is_wall, scene.wall_segments()
    known = np.isin(contacts.first, snapshot.ids)
    known &= np.where(wall, contacts.second <= len(walls), np.isin(contacts.second, snapshot.ids))
    line = index.frames[number].line
    if not known.all():
        row = int(np.argmin(known))
        raise DumpError(
            f"{index.path}, line {line + row}: a contact of {contacts.first[row]} and "
            f"{'wall ' if wall[row] else ''}{contacts.second[row]}, which the scene has not"
        )


def frame_of(steps: tuple[int, ...], time_step: float, time: float | None, default: float) -> int:
    """Find the frame of an instant `time` (s), or the one nearest to the scene's where none is
    asked.

    Raises DumpError for an instant that is not within the run."""
    times = np.array(steps) * time_step
    if time is not None and not times[0] <= time <= times[-1] * (1 + SAME):
        raise DumpError(f"time: {time:g} s; the run is from {times[0]:g} to {times[-1]:g} s")
    return int(np.argmin(np.abs(times - (default if time is None else time))))
