"""When an engine steps and writes, and the restitution that comes out: the same numbers of all
engines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.scene.scene import Run

# More steps between two frames than this are nobody's intention.
UNCOUNTABLE = 1e200
# By this share a quotient of two times may miss the whole number that it is.
ROUNDING = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """Say when an engine steps and writes, and what restitution two bodies have.

    time_step, safe_time_step: s
    steps: of the whole run
    frame_interval: steps between written frames
    damping_ratio: of the heaviest disks; 0 of an engine without dashpots
    restitution_least, restitution_most: what is obtained over the masses
    stiffness, wall_stiffness: N/m, of disks and of walls; None of an engine without springs
    """

    time_step: float
    safe_time_step: float
    steps: int
    frame_interval: int
    damping_ratio: float
    restitution_least: float
    restitution_most: float
    stiffness: float | None = None
    wall_stiffness: float | None = None


def divided(run: Run, longest_s: float) -> tuple[float, int]:
    """Return the time step (s) and the steps between two frames: a step of at most longest_s,
    shortened a little so that frames fall on the same instants whatever it is.

    Raises OverflowError where there are too many steps to count."""
    between_frames = run.duration_s / run.frames
    if not between_frames / longest_s < UNCOUNTABLE:
        raise OverflowError("too many steps to count")
    interval = max(1, int(np.ceil(between_frames / longest_s * (1 - ROUNDING))))
    step = between_frames / interval
    return (longest_s if abs(step - longest_s) <= ROUNDING * longest_s else step), interval
