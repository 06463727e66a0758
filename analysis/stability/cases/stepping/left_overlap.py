"""Overlap that a tolerant solver leaves, step after step."""

from pathlib import Path

import numpy as np

from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.crowds import RADIUS_M
from nscd import Snapshot, Walls
from nscd.stepping import Motion, Push, StepError

SPEED_M_PER_S, RELAXATION_S, STEP_S = 2.0, 0.5, 0.005
DISKS, SECONDS = 30, 3.0
# The overlap (m) that a rigid run may have.
ALLOWED_M = 1e-6
QUANTITIES = ("largest overlap (m)", "overlap of the last third / of the middle one", "residual")


def crowd() -> tuple[Snapshot, Walls]:
    """Make people in a row of three who press into a closed corner."""
    random = np.random.default_rng(5)
    radius = RADIUS_M * random.uniform(0.8, 1.0, DISKS)
    column, row = np.divmod(np.arange(DISKS), 3)
    position = np.column_stack([-(column + 1.0), row + 1.0]) * 2.2 * RADIUS_M
    wall = Walls(
        start=np.array([[0.0, -1.0], [-30.0, 0.0], [-30.0, 7.7 * RADIUS_M]]),
        end=np.array([[0.0, 10.0], [1.0, 0.0], [1.0, 7.7 * RADIUS_M]]),
    )
    still = np.zeros((DISKS, 2))
    return Snapshot(
        position=position, velocity=still, radius=radius, mass=np.full(DISKS, 75.0)
    ), wall


def attempt(tolerance: float, seconds: float, folder: Path) -> Cell:
    """Press them for so many seconds with so tolerant a solver."""
    snapshot, walls = crowd()
    wish = np.tile([SPEED_M_PER_S, 0.0], (DISKS, 1))
    motion = Motion(
        snapshot,
        walls,
        step=STEP_S,
        push=Push(desired=lambda position: wish, relaxation_time=RELAXATION_S),
        tolerance=tolerance,
    )
    overlaps, residual = [], 0.0
    try:
        for _ in range(round(seconds / STEP_S)):
            residual = max(residual, motion.advance().residual)
            overlaps.append(motion.overlap)
    except StepError as error:
        nothing = (float("nan"),) * 3
        reason, outcome = str(error), Outcome.NOT_CONVERGED
        return Cell(outcome=outcome, reason=reason, said="3", numbers=nothing)
    third = len(overlaps) // 3
    largest, middle, last = max(overlaps), max(overlaps[third:-third]), max(overlaps[-third:])
    outcome = Outcome.STABLE if largest <= ALLOWED_M else Outcome.INACCURATE
    reason = f"overlap of {largest:.2g} m at most, {last:.2g} m in the last third"
    grows = last / middle if middle else 0.0
    return Cell(outcome=outcome, reason=reason, said="0", numbers=(largest, grows, residual))


def case(quick: bool) -> Case:
    """Make the case."""
    tolerances = (1e-8, 1e-4, 1e-1) if quick else (1e-10, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
    return Case(
        name="left_overlap",
        columns=Axis("tolerance of a step", tolerances),
        rows=Axis("time pressed (s)", (SECONDS,) if quick else (SECONDS, 4 * SECONDS)),
        quantities=QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.INACCURATE, Outcome.NOT_CONVERGED),
        values={"disks": DISKS},
    )
