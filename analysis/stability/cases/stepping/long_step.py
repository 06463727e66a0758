"""A step too long: people who pass each other are held back as if they touched."""

import functools
from pathlib import Path

import numpy as np
from scipy.optimize import minimize_scalar

from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.crowds import RADIUS_M, disks
from nscd.stepping import Motion

SPEED_M_PER_S = 2.0
# By so much of its velocity a disk that touches nobody may differ from free flight.
SAME = 1e-6
QUANTITIES = ("change of velocity / speed", "largest overlap / radius", "residual")


@functools.cache
def worst(clearance: float) -> tuple[float, float]:
    """Find the distance along the way (m), and the length of a step (m) from which on it is wrong.

    Two disks pass with a clearance (m). From d before the nearest point the linearised gap allows
    v h d/ρ ≤ ρ − 2r with ρ² = d² + (2r + clearance)²; d is where the least v h reaches that."""
    beside = 2 * RADIUS_M + clearance

    def reach(ahead: float) -> float:
        apart = float(np.hypot(ahead, beside))
        return apart * (apart - 2 * RADIUS_M) / ahead

    found = minimize_scalar(reach, bounds=(1e-3 * RADIUS_M, 20 * RADIUS_M), method="bounded")
    return float(found.x), float(found.fun)


def attempt(way: float, clearance: float, folder: Path) -> Cell:
    """Let a disk pass another in steps of so much of its radius, the first from the worst place."""
    ahead, _ = worst(clearance)
    snapshot = disks(
        [[-ahead, 2 * RADIUS_M + clearance], [0.0, 0.0]], [[SPEED_M_PER_S, 0.0], [0.0, 0.0]]
    )
    motion = Motion(snapshot, step=way * RADIUS_M / SPEED_M_PER_S, tolerance=1e-10)
    residual = overlap = 0.0
    while motion.position[0, 0] < ahead:
        residual = max(residual, motion.advance().residual)
        overlap = max(overlap, motion.overlap / RADIUS_M)
        if motion.velocity[0, 0] < 0.1 * SPEED_M_PER_S:
            break
    changed = float(np.hypot(*(motion.velocity[0] - snapshot.velocity[0])) / SPEED_M_PER_S)
    outcome = Outcome.STABLE if changed <= SAME else Outcome.INACCURATE
    reason = f"it touches nobody and its velocity changes by {changed:.2g} of its speed"
    return Cell(outcome=outcome, reason=reason, said="0", numbers=(changed, overlap, residual))


def edge(clearance: float) -> float:
    """Give the shortest way in a step, over the radius, that is wrong."""
    return worst(clearance)[1] / RADIUS_M


def case(quick: bool) -> Case:
    """Make the case."""
    ways = (0.01, 0.06, 0.25, 1.0) if quick else (0.01, 0.02, 0.06, 0.12, 0.25, 0.5, 1.0, 2.0)
    return Case(
        name="long_step",
        columns=Axis("way in a step / radius", ways),
        rows=Axis("clearance (m)", (0.001, 0.01)),
        quantities=QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.INACCURATE,),
        theory=edge,
    )
