"""Contacts known to be closed: C u = b on a set of them, to rounding; the finish of other solvers and the equality form."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from nscd.solvers.cholesky import (
    Factor,
    System,
    add_reactions,
    approach,
    factorise,
    inertia,
    solve_factorised,
)

ROUNDS = 8
# Weight of the equalities against 1/w: large for speed, small enough to keep half of the digits.
PENALTY = 1e6


def free_velocity(system: System, factor: Factor, momentum: Any) -> Any:
    """û from Â û = momentum (n,d), with one refinement; all in elimination order."""
    factorise(system, factor, np.zeros(len(system.first)))
    velocity = momentum.copy()
    solve_factorised(factor, velocity)
    rest = np.empty_like(velocity)
    inertia(system, velocity, rest)
    rest = momentum - rest
    solve_factorised(factor, rest)
    return velocity + rest


def maintained(
    system: System, factor: Factor, tolerance: float
) -> tuple[Any, Any, int]:
    """The equality form (paper eqs. (2) and (8)): every contact stays closed and may pull. Reactions λ (k,) N·s, of least
    weighted norm where contacts are redundant; velocities (n,d); iterations."""
    k = len(system.first)
    reaction = np.zeros(k)
    velocity, iterations = _close(system, factor, np.ones(k, dtype=np.bool_), reaction, 50)
    return reaction, velocity, int(iterations)


def polish(
    system: System, factor: Factor, reaction: Any, velocity: Any, tolerance: float
) -> tuple[Any, Any, int]:
    """Improve an answer whose closed contacts are nearly known; reaction (k,), velocity (n,d), rounds used.

    Contacts with wλ > b − Cu are taken as closed, the others as free; then closed ones that pull are opened and free ones
    that would overlap are closed, a few times. Interior-point answers need this where contacts are degenerate (neither
    pressed nor open): there they are accurate to the root of their tolerance only.
    """
    v = np.empty(len(reaction))
    best = (reaction, velocity, 0)
    best_error = np.inf
    for round_ in range(1, ROUNDS + 1):
        approach(system, velocity, v)
        gap = system.offset - v
        if round_ == 1:
            best_error = float(np.abs(np.minimum(system.inverse_mass * reaction, gap)).max()) / system.scale
        closed = system.inverse_mass * reaction > gap
        reaction = np.where(closed, reaction, 0.0)
        velocity, _ = _close(system, factor, closed, reaction, 8)
        approach(system, velocity, v)
        admissible = np.maximum(reaction, 0.0)
        error = (
            float(np.abs(np.minimum(system.inverse_mass * admissible, system.offset - v)).max())
            / system.scale
        )
        error = max(error, float((system.inverse_mass * (admissible - reaction)).max()) / system.scale)
        if error < best_error:
            best, best_error = (admissible, velocity, round_), error
        if best_error <= tolerance:
            break
    return best


@njit(cache=True)
def _close(system: Any, factor: Any, closed: Any, reaction: Any, most: int) -> Any:
    """Method of multipliers: λ ← λ + θ(C u − b) with (Â + CᵀθC) u = Â û − Cᵀ(λ − θ b), θ = 0 off the set.

    One factorisation; λ (k,), changed in place, moves as little as it can where contacts are redundant.
    """
    n, d = system.mass.shape
    k = len(closed)
    theta, v, push = np.zeros(k), np.empty(k), np.empty(k)
    for c in range(k):
        if closed[c]:
            theta[c] = PENALTY / system.inverse_mass[c]
    momentum, u = np.empty((n, d)), system.free.copy()
    if not factorise(system, factor, theta):
        return u, 0
    inertia(system, system.free, momentum)
    before = np.inf
    iteration = 0
    while iteration < most:
        iteration += 1
        for c in range(k):
            push[c] = reaction[c] - theta[c] * system.offset[c]
        u[:] = momentum
        add_reactions(system, push, -1.0, u)
        solve_factorised(factor, u)
        approach(system, u, v)
        change = 0.0
        for c in range(k):
            step = theta[c] * (v[c] - system.offset[c])
            reaction[c] += step
            change = max(change, abs(step) * system.inverse_mass[c])
        if change <= 1e-15 * system.scale or (iteration > 2 and change > 0.5 * before):
            break
        before = change
    return u, iteration
