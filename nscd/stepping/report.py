"""What a step of a rigid crowd did, or that it has no answer."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from nscd.arrays import Floats
from nscd.stepping.search import Neighbours


class StepError(RuntimeError):
    """Say that a step has no answer within the tolerance, at what time, with what residual."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepReport:
    """Say what a step did.

    neighbours: the k candidates for contact; of both halves of a step that was made in halves
    reaction: (k,) N·s, their percussions along the normal
    friction: (k,) N·s, along t = (−n_y, n_x)
    residual: dimensionless, recomputed
    iterations: of the solver
    repeats: how often contacts were missed
    solver: its name"""

    neighbours: Neighbours
    reaction: Floats
    friction: Floats
    residual: float
    iterations: int
    repeats: int
    solver: str


def both(one: StepReport, other: StepReport) -> StepReport:
    """Two steps as one: all their contacts, the worse of their residuals."""
    pairs: Any = zip(one.neighbours, other.neighbours, strict=True)
    return StepReport(
        neighbours=Neighbours(*(np.concatenate(pair) for pair in pairs)),
        reaction=np.concatenate([one.reaction, other.reaction]),
        friction=np.concatenate([one.friction, other.friction]),
        residual=max(one.residual, other.residual),
        iterations=one.iterations + other.iterations,
        repeats=one.repeats + other.repeats,
        solver=other.solver,
    )
