"""Primal–dual interior point (Mehrotra) for the complementarity form; lives with redundant contacts."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from nscd.bodies import Floats
from nscd.problem import ContactProblem

PROXIMAL = 1e-12
MAXIMUM_ITERATIONS = 200
TINY = 1e-300


def interior_point(problem: ContactProblem, tolerance: float) -> tuple[Floats, Floats, int]:
    """Reactions λ ≥ 0 (k,) N·s, velocities u (d,) m/s and iterations, to natural-map residual ≤ tolerance or the best
    that rounding allows.

    Follows the central path of min ½(u−û)·Â(u−û), C u + s = b, s ≥ 0 with one factorisation of Â + CᵀΘC an iteration,
    Θ = λ/s. Rows are scaled by 1/√w and columns by 1/√Âᵢᵢ, so that unequal masses do not spoil the conditioning, and
    velocities by ‖u⁻‖∞. Mehrotra, SIAM J. Optim. 2 (1992) 575.
    """
    root, scale = np.sqrt(problem.inverse_mass), problem.scale
    weight = np.sqrt(problem.inertia.diagonal())
    C = csc_array(diags_array(1.0 / root) @ problem.normal @ diags_array(1.0 / weight))
    A = csc_array(diags_array(1.0 / weight) @ problem.inertia @ diags_array(1.0 / weight))
    b, free = problem.offset / root / scale, problem.free * weight / scale
    u = free.copy()
    start = 1.0 / root.min()
    slack, reaction = np.full(len(b), start), np.full(len(b), start)
    best = (np.zeros(len(b)), problem.free, 0)
    best_error, stalled, iteration = np.inf, 0, 0
    while iteration < MAXIMUM_ITERATIONS:
        physical, velocity = reaction / root * scale, u / weight * scale
        error = max(problem.residual(physical, velocity), problem.balance_error(physical, velocity))
        stalled = 0 if error < 0.9 * best_error else stalled + 1
        if error < best_error:
            best, best_error = (physical, velocity, iteration), error
        if best_error <= max(0.1 * tolerance, 1e-15) or stalled > (5 if best_error < 1e-6 else 60):
            break
        iteration += 1
        dual = A @ (u - free) + C.T @ reaction
        primal = C @ u + slack - b
        mu = float(slack @ reaction) / len(b)
        theta = 1.0 / (slack / reaction + PROXIMAL)
        factor = splu(csc_array(A + C.T @ diags_array(theta) @ C), permc_spec="MMD_AT_PLUS_A")

        def step(complementarity: Floats) -> tuple[Floats, Floats, Floats]:
            wanted = primal - complementarity / reaction  # noqa: B023
            du = factor.solve(-dual - C.T @ (theta * wanted))  # noqa: B023
            return du, -primal - C @ du, theta * (C @ du + wanted)  # noqa: B023

        _, ds, dr = step(slack * reaction)
        length = min(_to_boundary(slack, ds), _to_boundary(reaction, dr))
        centred = float((slack + length * ds) @ (reaction + length * dr)) / len(b)
        du, ds, dr = step(slack * reaction + ds * dr - (centred / mu) ** 3 * mu)
        length = 0.995 * min(_to_boundary(slack, ds), _to_boundary(reaction, dr))
        u = u + length * du
        slack, reaction = np.maximum(slack + length * ds, TINY), np.maximum(reaction + length * dr, TINY)
    return best


def _to_boundary(values: Floats, change: Floats) -> float:
    falling = change < 0
    return float(min(1.0, (-values[falling] / change[falling]).min(initial=1.0)))
