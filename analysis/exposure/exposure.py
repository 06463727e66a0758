"""How long people, walls and the crowd of a run are above each limit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.dumps import DumpError
from analysis.dumps.windows import RunWindows, joined
from analysis.engines.record import RunRecord
from analysis.exposure.limits import QUANTITIES, Limit
from analysis.exposure.loads import Loads, loads_of
from analysis.scene.scene import Scene, read_scene
from nscd.arrays import Floats, Indices

# The shortest window (s): below it a quantile of forces depends on the step.
SHORTEST_S = 0.1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Exposure:
    """Hold the loads of a run, window by window.

    scene: with the name that the run has
    ids: (n,) of its people
    windows: in order of time, each follows the one before
    """

    scene: Scene
    ids: Indices
    windows: Sequence[Loads]

    @property
    def window_s(self) -> float:
        """Give the length of a window (s)."""
        return self.windows[0].duration

    def time_above(self, limit: Limit) -> tuple[Floats, Floats]:
        """Sum for each person or wall, or the crowd, the time above a limit (s), and find its
        longest stretch without a break (s)."""
        total = longest = running = np.zeros(len(self.windows[0].above(limit)))
        for loads in self.windows:
            above = loads.above(limit)
            total = total + np.where(above, loads.duration, 0.0)
            running = np.where(above, running + loads.duration, 0.0)
            longest = np.maximum(longest, running)
        return total, longest

    def largest(self, limit: Limit) -> float:
        """Find the largest value of the limit's quantity, in its unit; NaN where there is none."""
        of = QUANTITIES[limit.quantity].of
        if of == "crowd":
            values = [w.crowd[limit.quantity] for w in self.windows if limit.quantity in w.crowd]
            return max(values, default=math.nan)
        rows = [(w.person if of == "person" else w.wall)[limit.quantity] for w in self.windows]
        return float(np.max(rows)) if rows[0].size else math.nan


def read_exposure(folder: Path, window_s: float = SHORTEST_S) -> Exposure:
    """Read the loads of a finished run over windows of at least so many seconds, from the impulses
    of every step.

    Raises EngineError and DumpError for a folder that does not hold one finished run with impulses,
    or one that is shorter than a window."""
    record = RunRecord.read(folder)
    scene = read_scene(folder / "scene.toml").model_copy(update={"name": record.scene})
    record.check_finished(folder, scene)
    run = RunWindows(folder, record.time_step_s)
    frames = list(run.between_frames())
    together = max(1, math.ceil(window_s / frames[0].duration - 1e-9))
    parts = [frames[n - together : n] for n in range(together, len(run.times), together)]
    if not parts:
        raise DumpError(f"{folder}: the run of {run.times[-1]:g} s is shorter than {window_s:g} s")
    windows = [loads_of(scene, joined(part)) for part in parts]
    return Exposure(scene=scene, ids=frames[0].now.ids, windows=windows)
