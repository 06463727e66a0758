"""The equality form: every contact stays closed, reactions may pull (paper eqs. (2) and (8))."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from nscd.bodies import Floats
from nscd.problem import ContactProblem


def maintained(problem: ContactProblem, tolerance: float) -> tuple[Floats, int]:
    """Reactions λ (k,) N·s with C u = b, of least weighted norm where contacts are redundant; iterations.

    Method of multipliers: λ ← λ + θ (C u − b) with u from (Â + Cᵀ θ C) u = Â û − Cᵀ(λ − θ b), one factorisation.
    """
    theta = 1e6 / problem.inverse_mass
    C, A = problem.normal, problem.inertia
    factor = splu(csc_array(A + C.T @ diags_array(theta) @ C))
    reaction = np.zeros(len(theta))
    best, best_residual = reaction, np.inf
    for iteration in range(1, 51):
        u = factor.solve(A @ problem.free - C.T @ (reaction - theta * problem.offset))
        reaction = reaction + theta * (C @ u - problem.offset)
        residual = problem.residual(reaction, problem.velocity(reaction))
        if residual >= 0.5 * best_residual and iteration > 2:
            break
        best, best_residual = reaction, residual
        if residual <= max(1e-3 * tolerance, 1e-15):
            break
    return best, iteration
