"""Contacts that a step does not look for."""

from pathlib import Path

import numpy as np

from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.crowds import RADIUS_M, disks
from nscd.stepping import Motion
from nscd.stepping.search import neighbours, segments_of

SPEED_M_PER_S = 2.0
GAPS = 40
# Overlaps (m) that a step with all its contacts does not leave.
NONE_M = 1e-9
QUANTITIES = ("largest overlap / way in a step", "gaps missed", "gaps tried")


def attempt(margin: float, step_s: float, folder: Path) -> Cell:
    """Let two disks run into each other from many gaps, where a step looks as far as so many ways
    of one disk; what it does not see passes freely."""
    way = SPEED_M_PER_S * step_s
    missed, deepest = 0, 0.0
    for gap in np.linspace(0.0, 2 * way, GAPS + 2)[1:-1]:
        start = disks(
            [[-RADIUS_M - gap / 2, 0.0], [RADIUS_M + gap / 2, 0.0]],
            [[SPEED_M_PER_S, 0.0], [-SPEED_M_PER_S, 0.0]],
        )
        motion = Motion(start, step=step_s)
        seen = len(neighbours(motion.position, motion.radius, segments_of(None), margin * way).gap)
        if seen:
            motion.advance()
        else:
            motion.position = motion.position + step_s * motion.velocity
        missed += not seen
        deepest = max(deepest, motion.overlap)
    outcome = Outcome.STABLE if deepest <= NONE_M else Outcome.INACCURATE
    reason = f"{missed} of {GAPS} gaps not seen; overlap {deepest:.2g} m after one step"
    numbers = (deepest / way, float(missed), float(GAPS))
    return Cell(outcome=outcome, reason=reason, said="0", numbers=numbers)


def edge(step_s: float) -> float:
    """Give the widest gap tried that closes within a step, over the way of one disk."""
    return 2.0 * GAPS / (GAPS + 1)


def case(quick: bool) -> Case:
    """Make the case."""
    margins = (0.5, 1.0, 3.0) if quick else (0.25, 0.5, 1.0, 1.5, 2.5, 4.0)
    return Case(
        name="missed_contacts",
        columns=Axis("margin of the search / way in a step", margins),
        rows=Axis("step (s)", (0.005, 0.02)),
        quantities=QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.INACCURATE,),
        theory=edge,
        values={"gaps": GAPS},
    )
