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
PENALTY = 1e4
# Multiplier steps of a round whose set of closed contacts is still changing, and the share of changes that is called so.
FEW, SETTLED = 2, 1e-3
# The answer is taken to this share of the tolerance, which costs a step or two more.
STRICT = 1e-3


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


def maintained(system: System, factor: Factor) -> tuple[Any, Any, int]:
    """The equality form (paper eqs. (2) and (8)): every contact stays closed and may pull. Reactions λ (k,) N·s, of least
    weighted norm where contacts are redundant; velocities (n,d); steps."""
    closed = np.ones(len(system.first), dtype=np.bool_)
    reaction, velocity = np.zeros(len(closed)), system.free.copy()
    steps = 0
    if _factorise_closed(system, factor, closed):
        steps = _close(system, factor, closed, reaction, velocity, 200)
    return reaction, velocity, int(steps)


def active_set(
    system: System,
    factor: Factor,
    reaction: Any,
    velocity: Any,
    tolerance: float,
    rounds: int = ROUNDS,
    steps: int = 8,
    closed: Any = None,
) -> tuple[Any, Any, int, float]:
    """Improve an answer whose closed contacts are nearly known: reaction (k,), velocity (n,d), rounds, and the error.

    Contacts with wλ > b − Cu (or those of `closed` (k,) at first) are taken as closed, the others as free; then closed ones
    that pull are opened and free ones that would overlap are closed, and so on: the primal–dual active set method, one
    factorisation a round. It ends when the error, max|min(wλ, b − Cu)| / ‖u⁻‖∞ with the pulls that had to be cut, is within
    the tolerance, when the set no longer changes, or when it changes more than before. At most `steps` multiplier steps a
    round.
    """
    v = np.empty(len(reaction))
    w, scale = system.inverse_mass, system.scale
    if closed is None:
        approach(system, velocity, v)
        closed = w * reaction > system.offset - v
    best, best_error, changes = (reaction, velocity), np.inf, [len(reaction)]
    done = 0
    while done < rounds:
        done += 1
        reaction, velocity = np.where(closed, reaction, 0.0), system.free.copy()
        if not _factorise_closed(system, factor, closed):
            break
        # two steps show which contacts pull; the rest is for the last round, with the same factor
        steps_now = FEW
        for _ in range(2):
            _close(system, factor, closed, reaction, velocity, steps_now)
            approach(system, velocity, v)
            gap = system.offset - v
            admissible = np.maximum(reaction, 0.0)
            error = (
                max(np.abs(np.minimum(w * admissible, gap)).max(), (w * (admissible - reaction)).max())
                / scale
            )
            if error < best_error:
                best, best_error = (admissible, velocity.copy()), float(error)
            new = w * reaction > gap
            if (new != closed).sum() > SETTLED * len(new) or best_error <= STRICT * tolerance:
                break
            steps_now = steps
        before, closed = closed, new
        changes.append(int((closed != before).sum()))
        if best_error <= tolerance or not changes[-1] or min(changes[-3:]) >= changes[-4:][0]:
            break
    return *best, done, best_error


@njit(cache=True)
def _factorise_closed(system: Any, factor: Any, closed: Any) -> bool:
    """Factorise Â + CᵀΘC with Θ = PENALTY/w on the closed contacts, 0 on the others."""
    theta = np.zeros(len(closed))
    for c in range(len(closed)):
        if closed[c]:
            theta[c] = PENALTY / system.inverse_mass[c]
    return factorise(system, factor, theta)


@njit(cache=True)
def _close(system: Any, factor: Any, closed: Any, reaction: Any, u: Any, most: int) -> int:
    """Method of multipliers: λ ← λ + θ(C u − b) with (Â + CᵀΘC) u = Â û − Cᵀ(λ − θ b), θ = 0 off the set; steps taken.

    With the factor of `_factorise_closed`; u (n,d) is corrected by the momentum that is still out of balance, so that rounding
    does not grow with θ. λ (k,) and u are changed in place; λ moves as little as it can where contacts are redundant.
    """
    k = len(closed)
    v, push = np.empty(k), np.empty(k)
    moved, rest = np.empty_like(u), np.empty_like(u)
    before = np.inf
    iteration = 0
    approach(system, u, v)
    while iteration < most:
        iteration += 1
        for c in range(k):
            theta = PENALTY / system.inverse_mass[c] if closed[c] else 0.0
            push[c] = reaction[c] + theta * (v[c] - system.offset[c])
        moved[:] = system.free - u
        inertia(system, moved, rest)
        add_reactions(system, push, -1.0, rest)
        solve_factorised(factor, rest)
        u += rest
        approach(system, u, v)
        change = 0.0
        for c in range(k):
            if closed[c]:
                step = PENALTY * (v[c] - system.offset[c])
                reaction[c] += step / system.inverse_mass[c]
                change = max(change, abs(step))
        if change <= 1e-15 * system.scale or (iteration > 2 and change > 0.5 * before):
            break
        before = change
    return iteration
