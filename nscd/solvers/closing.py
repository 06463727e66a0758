"""Contacts known to be closed: C u = b on a set of them, to rounding."""

from __future__ import annotations

from typing import Any

import numpy as np

from nscd.compiling import kernel
from nscd.solvers.cholesky.factor import factorise, solve_factorised
from nscd.solvers.system import add_reactions, approach, inertia, stiffness
from nscd.solvers.task import Answer, Held, Task

# Weight of the equalities: large for speed, small enough to keep ten digits.
PENALTY = 1e7
# Gaps and openings are known to this share of ‖u⁻‖∞.
EXACT = 1e-14
# To this share of it they are closed, where nothing less is enough.
CLOSED = 1e-15
# For a nearly singular W whose contacts are all closed for certain; it blurs λ where contacts are
# redundant.
FIRM = 1e9
STEPS = 200


@kernel(apart=True, nogil=True)
def close_contacts(
    system: Any, factor: Any, closed: Any, theta: Any, reaction: Any, u: Any, v: Any, most: Any, enough: Any
) -> int:  # fmt: skip
    """Close contacts by the method of multipliers, λ ← λ + θ(Cu − b); return the steps taken.

    factor: of Â + CᵀΘC
    closed: (k,) the contacts
    reaction, u, v: (k,) λ, (n,d), (k,) C u, changed in place
    most: steps
    enough: to this share of ‖u⁻‖∞

    λ is kept for the open contacts as well (it presses nothing there). u is corrected by the
    momentum that is still out of balance, so that rounding does not grow with θ."""
    k = len(closed)
    push, change = np.empty(k), np.empty(k)
    moved, rest = np.empty_like(u), np.empty_like(u)
    before = np.inf
    steps = 0
    while steps < most:
        steps += 1
        for c in range(k):
            reaction[c] += theta[c] * (v[c] - system.offset[c])
            push[c] = reaction[c] if closed[c] else 0.0
        moved[:] = system.free - u
        inertia(system, moved, rest)
        add_reactions(system, push, -1.0, rest)
        solve_factorised(factor, rest)
        u += rest
        approach(system, rest, change)
        approach(system, u, v)
        open_by = 0.0
        for c in range(k):
            reaction[c] += theta[c] * change[c]
            if closed[c]:
                open_by = max(open_by, abs(v[c] - system.offset[c]))
        if open_by <= enough * system.scale or (steps > 2 and open_by > 0.8 * before):
            break
        before = open_by
    return steps


def maintained(task: Task) -> Answer:
    """Close all contacts: C u⁺ = b with any sign of λ (paper eqs. (2) and (8)).

    λ is of least norm where contacts are redundant, weighted by the masses where these differ much;
    iterations are steps of the method of multipliers."""
    system, factor = task.system, task.factor
    k = len(system.first)
    closed, steps = np.ones(k, dtype=np.bool_), 0
    reaction, velocity, v = np.zeros(k), system.free.copy(), np.empty(k)
    for penalty in (PENALTY, FIRM):
        theta = penalty * stiffness(system.inverse_mass)
        if not factorise(system, factor, theta):
            break
        task.workspace.held = Held(theta, closed)
        reaction, velocity = np.zeros(k), system.free.copy()
        approach(system, velocity, v)
        steps += close_contacts(system, factor, closed, theta, reaction, velocity, v, STEPS, CLOSED)
        if np.abs(v - system.offset).max() <= 100.0 * EXACT * system.scale:
            break
    return task.answer(reaction, velocity, steps, least=True)
