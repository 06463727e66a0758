"""Linear programs over states x ≥ 0 in balance: the largest of a sum, and which unknowns carry
something in some state."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csc_array, hstack

from nscd.arrays import Floats, Indices, Mask

# Reactions below this share of the largest may be rounding of the solver.
NOTHING = 1e-7
FEASIBILITY = 1e-10  # the sharpest that HiGHS takes; everything it returns is checked


class ProgramError(RuntimeError):
    """Say that a linear program has no finite optimum, or that HiGHS did not solve it, and why."""


class Optimum(NamedTuple):
    """Hold the end of a linear program.

    point: where it is attained
    multiplier: of its equations"""

    point: Floats
    multiplier: Floats


def carrying(point: Floats, core: Indices, balance: csc_array) -> Mask:
    """Find the unknowns (u,) that are more than 0 in some x ≥ 0 with balance x_core = balance
    point_core.

    point: (u,), one such x, in units of its largest
    core: (c,) indices of the unknowns that the balance leaves open; the others are known
    balance: (r,c)

    Rounds of max Σ min(x_c, δ) over the c that carry nothing so far; the optimum 0 is the proof
    that the rest never carry. The mean of the optima is positive at all others."""
    carries = np.asarray(point > NOTHING)
    impulse, c = balance @ point[core], len(core)
    fraction = float(np.median(point[carries])) if carries.any() else 1.0
    while len(idle := np.flatnonzero(~carries[core])):
        upper = np.concatenate([np.full(c, np.inf), np.full(len(idle), fraction)])
        columns = csc_array(hstack([balance, balance[:, idle]]))
        weights = np.concatenate([np.zeros(c), np.ones(len(idle))])
        found = maximise(weights, columns, impulse, upper)
        gained = found.point[c:] + found.point[idle] > NOTHING
        if not gained.any():
            break
        carries[core[idle[gained]]] = True
    return carries


def maximise(
    weights: Floats, matrix: csc_array, right: Floats, upper: Floats | float = np.inf
) -> Optimum:
    """Maximise weights·x subject to matrix x = right and 0 ≤ x ≤ upper.

    Raises ProgramError naming the reason where that has no end or no solution."""
    bounds = np.column_stack([np.zeros(len(weights)), np.broadcast_to(upper, len(weights))])
    sides = ("primal", "dual")
    options = {f"{side}_feasibility_tolerance": FEASIBILITY for side in sides}
    # the interior point with crossover is several times faster on large packings, the simplex more
    # robust
    for method in ("highs-ipm", "highs-ds"):
        program = {"A_eq": matrix, "b_eq": right, "bounds": bounds, "options": options}
        found = linprog(-weights, method=method, **program)
        if found.status == 0:
            break
    else:
        raise ProgramError(f"linear program of {matrix.shape[1]} reactions: {found.message}")
    return Optimum(np.asarray(found.x), -np.asarray(found.eqlin.marginals))
