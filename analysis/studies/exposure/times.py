"""Times of a run: until somebody, or the last, is out, and the flow since people arrived."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from analysis.studies.exposure.loads import RunLoads
from nscd.arrays import Floats


class Flow(NamedTuple):
    """Count people who pass the door in a time."""

    people: int
    seconds: float

    @property
    def rate(self) -> float:
        """People per second."""
        return self.people / self.seconds if self.seconds > 0 else 0.0


def leaving(run: RunLoads) -> Floats:
    """Give when each who was inside at the start got out (s), rising; infinite for who did not."""
    return np.sort(run.out[~np.isnan(run.out)])


def time_until(run: RunLoads, count: int | None = None) -> float:
    """Give the time (s) until so many people are out, or all who were inside at the start; infinite
    where the run ends before. Raises ValueError for fewer than one, or more than were inside."""
    times = leaving(run)
    count = len(times) if count is None else count
    if not 1 <= count <= len(times):
        raise ValueError(f"count: {count}. {len(times)} people were inside at the start")
    return float(times[count - 1])


def flow_after_arrival(run: RunLoads) -> Flow:
    """Count who passes after the first one, from then to the last one, or to the end of the run where
    people are left inside: nobody in the whole run where nobody got out."""
    times = leaving(run)
    out = times[np.isfinite(times)]
    if not len(out):
        return Flow(0, float(run.time[-1]))
    end = out[-1] if len(out) == len(times) else run.time[-1]
    return Flow(len(out) - 1, float(max(end, out[-1]) - out[0]))
