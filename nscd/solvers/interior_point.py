"""Primal–dual interior point (Mehrotra) for the complementarity form; lives with redundant contacts."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from nscd.bodies import Floats
from nscd.problem import ContactProblem

PROXIMAL = 1e-14
MAXIMUM_ITERATIONS = 200


def interior_point(problem: ContactProblem, tolerance: float) -> tuple[Floats, int]:
    """Reactions λ ≥ 0 (k,) N·s with natural-map residual ≤ tolerance, or the best that rounding allows; iterations.

    Follows the central path of min ½(u−û)·Â(u−û), C u + s = b, s ≥ 0 with one factorisation of Â + CᵀΘC an
    iteration, Θ = λ/s. Rows are scaled by 1/√w, so that unequal masses do not spoil the conditioning, and
    velocities by ‖u⁻‖∞. Mehrotra, SIAM J. Optim. 2 (1992) 575.
    """
    root = np.sqrt(problem.inverse_mass)
    scale = problem.scale
    C = csc_array(diags_array(1.0 / root) @ problem.normal)
    A = problem.inertia
    b = problem.offset / root / scale
    free = problem.free / scale
    target = max(0.1 * tolerance, 1e-14)
    u = free.copy()
    start = max(1.0 / root.min(), 1e-300)
    slack, reaction = np.full(len(b), start), np.full(len(b), start)
    best, best_residual, stalled = reaction * 0.0, np.inf, 0
    for iteration in range(1, MAXIMUM_ITERATIONS + 1):
        physical = np.maximum(reaction / root * scale, 0.0)
        residual = problem.residual(physical, problem.velocity(physical))
        if residual < 0.9 * best_residual:
            stalled = 0
        else:
            stalled += 1
        if residual < best_residual:
            best, best_residual = physical, residual
        if best_residual <= target or stalled > 12:
            break
        dual = A @ (u - free) + C.T @ reaction
        primal = C @ u + slack - b
        mu = float(slack @ reaction) / len(b)
        theta = 1.0 / (slack / reaction + PROXIMAL)
        factor = splu(csc_array(A + C.T @ diags_array(theta) @ C), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})

        def step(complementarity: Floats) -> tuple[Floats, Floats, Floats]:
            wanted = primal - complementarity / reaction  # noqa: B023
            du = factor.solve(-dual - C.T @ (theta * wanted))  # noqa: B023
            change = theta * (C @ du + wanted)  # noqa: B023
            return du, -primal - C @ du, change  # noqa: B023

        _, ds, dr = step(slack * reaction)
        length = min(_to_boundary(slack, ds), _to_boundary(reaction, dr))
        centred = float((slack + length * ds) @ (reaction + length * dr)) / len(b)
        sigma = (centred / mu) ** 3
        du, ds, dr = step(slack * reaction + ds * dr - sigma * mu)
        length = 0.995 * min(_to_boundary(slack, ds), _to_boundary(reaction, dr))
        u, slack, reaction = u + length * du, slack + length * ds, reaction + length * dr
        floor = 1e-300
        slack, reaction = np.maximum(slack, floor), np.maximum(reaction, floor)
    return best, iteration


def _to_boundary(values: Floats, change: Floats) -> float:
    falling = change < 0
    return float(min(1.0, (-values[falling] / change[falling]).min(initial=1.0)))
