"""The finish: solve the identified active set as equalities, to rounding."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from nscd.bodies import Floats
from nscd.problem import ContactProblem

ROUNDS = 8
# Weight of the equalities against the inertia: large for speed, small enough to keep half of the digits.
PENALTY = 1e6


def polish(problem: ContactProblem, reaction: Floats, velocity: Floats, tolerance: float) -> tuple[Floats, Floats, int]:
    """Improve an answer (reaction (k,) N·s, velocity (d,) m/s) whose active contacts are nearly known; rounds used.

    Contacts with wλ > b − Cu are taken as closed, C u = b, the others as free, λ = 0; then closed ones that pull are
    opened and free ones that would overlap are closed, a few times. Closed sets are solved by the method of
    multipliers, which lives with redundant contacts and moves λ as little as it can. Interior-point answers need this
    where contacts are degenerate (neither pressed nor open): there they are only accurate to the root of theirs.
    """
    w, C, A, b = problem.inverse_mass, problem.normal, problem.inertia, problem.offset
    best, best_error = (reaction, velocity, 0), _error(problem, reaction, velocity)
    for round_ in range(1, ROUNDS + 1):
        if best_error <= tolerance:
            break
        closed = np.flatnonzero(w * reaction > b - C @ velocity)
        active, theta = C[closed], PENALTY / w[closed]
        factor = splu(csc_array(A + active.T @ diags_array(theta) @ active))
        pressed = reaction[closed]
        for _ in range(6):
            velocity = factor.solve(A @ problem.free - active.T @ (pressed - theta * b[closed]))
            change = theta * (active @ velocity - b[closed])
            pressed = pressed + change
            if np.abs(w[closed] * change).max(initial=0.0) < 1e-15 * problem.scale:
                break
        reaction = np.zeros_like(reaction)
        reaction[closed] = pressed
        admissible = np.maximum(reaction, 0.0)
        error = _error(problem, admissible, velocity)
        if error < best_error:
            best, best_error = (admissible, velocity, round_), error
    return best


def _error(problem: ContactProblem, reaction: Floats, velocity: Floats) -> float:
    return max(problem.residual(reaction, velocity), problem.balance_error(reaction, velocity))
