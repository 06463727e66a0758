"""The equality form: every contact stays closed, reactions may pull (paper eqs. (2) and (8))."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from nscd.bodies import Floats
from nscd.problem import ContactProblem


def maintained(problem: ContactProblem, tolerance: float) -> tuple[Floats, Floats, int]:
    """Reactions λ (k,) N·s with C u = b, of least weighted norm where contacts are redundant; velocities u (d,) m/s;
    iterations.

    Method of multipliers: λ ← λ + θ (C u − b) with u from (Â + Cᵀ θ C) u = Â û − Cᵀ(λ − θ b), one factorisation.
    """
    theta = 1e6 / problem.inverse_mass
    C, A = problem.normal, problem.inertia
    factor = splu(csc_array(A + C.T @ diags_array(theta) @ C))
    reaction = np.zeros(len(theta))
    best, best_error = (reaction, problem.free, 0), np.inf
    for iteration in range(1, 51):
        u = factor.solve(A @ problem.free - C.T @ (reaction - theta * problem.offset))
        reaction = reaction + theta * (C @ u - problem.offset)
        error = max(problem.residual(reaction, u), problem.balance_error(reaction, u))
        if error >= 0.5 * best_error and iteration > 2:
            break
        best, best_error = (reaction, u, iteration), error
        if error <= max(1e-3 * tolerance, 1e-15):
            break
    return best
