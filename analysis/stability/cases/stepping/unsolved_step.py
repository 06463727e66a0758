"""A solver that does not converge in mid-run."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.crowds import MASS_KG, RADIUS_M, disks
from nscd import Walls
from nscd.stepping import Motion, Push, StepError

SPEED_M_PER_S, RELAXATION_S, STEP_S, STEPS = 2.0, 0.5, 0.005, 100
DISKS = 12
QUANTITIES = ("steps made", "largest residual", "largest overlap / radius")


@dataclass(frozen=True, slots=True)
class Tolerance:
    """A row: how exactly a step is solved; from 1e-6 on by accelerated gradient."""

    value: float

    def __str__(self) -> str:
        solver = "accelerated gradient" if self.value >= 1e-6 else "exact"
        return f"{self.value:g}, {solver}"


def attempt(ratio: float, row: Tolerance, folder: Path) -> Cell:
    """Press a line of disks, every other one so many times lighter, against a wall."""
    mass = np.where(np.arange(DISKS) % 2, MASS_KG / ratio, MASS_KG)
    places = np.column_stack([-(2.05 * np.arange(DISKS) + 1.05) * RADIUS_M, np.zeros(DISKS)])
    wish = np.tile([SPEED_M_PER_S, 0.0], (DISKS, 1))
    motion = Motion(
        disks(places, mass=mass),
        Walls(start=np.array([[0.0, -1.0]]), end=np.array([[0.0, 1.0]])),
        step=STEP_S,
        push=Push(desired=lambda position: wish, relaxation_time=RELAXATION_S),
        tolerance=row.value,
    )
    residual, made, why = 0.0, 0, ""
    try:
        while made < STEPS:
            residual = max(residual, motion.advance().residual)
            made += 1
    except StepError as error:
        why = str(error)
    numbers = (float(made), residual, motion.overlap / RADIUS_M)
    if why:
        return Cell(outcome=Outcome.NOT_CONVERGED, reason=why, said="3", numbers=numbers)
    reason = f"{STEPS} steps, residual at most {residual:.2g}"
    return Cell(outcome=Outcome.STABLE, reason=reason, said="0", numbers=numbers)


def case(quick: bool) -> Case:
    """Make the case."""
    ratios = (1.0, 1e4, 1e8) if quick else (1.0, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6, 1e8)
    return Case(
        name="unsolved_step",
        columns=Axis("mass ratio", ratios),
        rows=Axis("tolerance", (Tolerance(1e-4), Tolerance(1e-6), Tolerance(1e-8))),
        quantities=QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.NOT_CONVERGED,),
        values={"disks": DISKS, "steps": STEPS},
    )
