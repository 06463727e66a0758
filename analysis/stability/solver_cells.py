"""A cell of a solver of percussions, judged against another road to the same answer."""

from __future__ import annotations

import numpy as np

from analysis.stability.case import Cell, Outcome, Value
from nscd import Percussions, Status
from nscd.arrays import Floats

SOLVERS = ("auto", "interior_point", "active_set", "projected_gradient", "gauss_seidel")
TOLERANCE = 1e-8
# An answer with a residual of TOLERANCE may be further from the truth than that; this far is wrong.
WRONG = 1e-5
QUANTITIES = ("error of u⁺ / |u⁻|", "residual", "iterations")


def solver_cell(
    column: Value,
    row: Value,
    answer: Percussions,
    reference: Floats,
    scale: float,
    wrong: float = WRONG,
) -> Cell:
    """A cell with the QUANTITIES: not converged where the residual says so, inaccurate where u⁺
    differs from the reference (n,2) m/s by more than `wrong` of `scale`, the largest |u⁻| (m/s)."""
    error = float(np.abs(answer.right_velocity - reference).max()) / (scale or 1.0)
    if answer.status is not Status.SOLVED:
        outcome, reason = Outcome.NOT_CONVERGED, answer.reason
    elif not error <= wrong:
        outcome, reason = Outcome.INACCURATE, f"u⁺ is wrong by {error:.2g}"
    else:
        outcome, reason = Outcome.STABLE, f"u⁺ is right to {error:.2g}"
    return Cell(
        column=column,
        row=row,
        outcome=outcome,
        reason=reason,
        said=str(answer.status),
        numbers=(error, answer.residual, float(answer.iterations)),
    )
