"""Who would faint: people under a sum of forces above a limit for its time, as stops of a scene."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.exposure.limits import QUANTITIES, Limit, LimitError
from analysis.exposure.loads import RunLoads
from analysis.scene.drive import Stop

ENDING = "_stops"


def stops_of(run: RunLoads, limit: Limit) -> tuple[Stop, ...]:
    """List who bears a sum of contact forces (N) above the number of a limit for its time without a
    break, and when that time is over, to a window; in the order of time.

    An assumption, no medicine: most limits are of one force, and none is about fainting. Raises
    LimitError for a limit that is not of a force on a person."""
    if QUANTITIES[limit.quantity].of != "person" or limit.unit != "N":
        raise LimitError(f"--stops {limit.name}: a limit of a force (N) on a person is needed")
    above, running = run.loads["contact_sum"] > limit.number, np.zeros(len(run.ids))
    when = np.full(len(run.ids), np.inf)
    for now, end, duration in zip(above, run.time, run.duration, strict=True):
        running = np.where(now, running + duration, 0.0)
        over = now & (running >= (limit.duration_s or 0.0) - 1e-9)
        when = np.where(over, np.minimum(when, end), when)
    found = sorted((float(t), one) for t, one in zip(when, run.ids, strict=True) if t < np.inf)
    return tuple(Stop(people=(one, one), time_s=round(time, 9)) for time, one in found)


def write_stops(run: RunLoads, limit: Limit, folder: Path) -> tuple[int, Path]:
    """Write the scene of a run in which those stop (`stops_of`), and no others, into a folder, as
    `<name>_stops`; return how many stop, and its path. Raises LimitError where nobody is driven."""
    drive = run.scene.drive
    if drive is None:
        raise LimitError("--stops: nobody is driven")
    name = f"{run.scene.name.removesuffix(ENDING)}{ENDING}"
    stopped = drive.model_copy(update={"stops": stops_of(run, limit)})
    scene = run.scene.model_copy(update={"name": name, "drive": stopped})
    return len(stopped.stops), scene.write(folder)
