"""Statuses of answers: what a recomputed residual allows to say."""

from __future__ import annotations

import numpy as np

from nscd.percussions import Status


def judged(residual: float, tolerance: float, what: str, unsettled: str) -> tuple[Status, str]:
    """Judge an answer by its residual.

    residual, tolerance: dimensionless; solved where the residual is within the tolerance.
    what: what is computed, for the reason of a failure ("the pressure").
    unsettled: what to add to the reason of an inaccurate answer, empty if there is nothing.
    """
    if not np.isfinite(residual):
        return Status.FAILED, f"{what}: not a finite number"
    if residual > tolerance:
        return Status.INACCURATE, f"residual {residual:.1e} above {tolerance:.1e}{unsettled}"
    return Status.SOLVED, ""
