"""Contacts known to be closed: C u = b on a set of them, to rounding; the finish of other solvers
and the equality form."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from nscd.solvers.system import (
    Factor,
    System,
    add_reactions,
    approach,
    factorise,
    inertia,
    solve_factorised,
    stiffness,
)

ROUNDS = 12
# Weight of the equalities: large for speed, small enough to keep ten digits.
PENALTY = 1e6
# For a nearly singular W whose contacts are all closed for certain; it blurs λ where contacts are
# redundant.
FIRM = 1e9
# Multiplier steps at most; the first shows which contacts pull, the others are for a set that is
# nearly right.
STEPS = 50
# So many contacts, and this share of all, may change without getting fewer from round to round.
HANDFUL, SHARE = 4, 1e-5
# Gaps and openings are known to this share of ‖u⁻‖∞.
EXACT = 1e-14
# Reactions below the rounding of PENALTY · C u have no sign.
ROUNDING = 4.0 * PENALTY * float(np.finfo(float).eps)


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
    """The equality form (paper eqs. (2) and (8)): every contact stays closed and may pull.
    Reactions λ (k,) N·s, of least norm where contacts are redundant (weighted by the masses where
    these differ much); velocities (n,d); steps."""
    k = len(system.first)
    closed, steps = np.ones(k, dtype=np.bool_), 0
    reaction, velocity, v = np.zeros(k), system.free.copy(), np.empty(k)
    for penalty in (PENALTY, FIRM):
        theta = penalty * stiffness(system)
        if not factorise(system, factor, theta):
            break
        reaction, velocity = np.zeros(k), system.free.copy()
        approach(system, velocity, v)
        steps += _close(system, factor, closed, theta, reaction, velocity, v, 200)
        if np.abs(v - system.offset).max() <= 100.0 * EXACT * system.scale:
            break
    return reaction, velocity, steps


def active_set(
    system: System, factor: Factor, closed: Any, thorough: bool = False
) -> tuple[Any, Any, int, float, bool]:
    """Percussions from a set of contacts (k,) that is nearly the set of closed ones: reaction (k,)
    N·s, velocity (n,d) m/s, rounds, the error max|min(wλ, b − Cu)| / ‖u⁻‖∞ with the pulls that had
    to be cut, and whether the set settled.

    A round closes the set from rest: λ is then the least-norm reaction on it (the first step is the
    penalty model of stiffness PENALTY, the others its stiff limit), and Σ θ(Cu − b) on the open
    ones says whether they would be pressed in that limit. Contacts that pull open, those that would
    be pressed close: the primal–dual active set method on the penalty model, one factorisation a
    round; a `thorough` one goes to the stiff limit every time. Once it settles, the reactions are
    those of least energy if the stiffness is the same for all contacts (see `stiffness`). It ends
    unsettled after ROUNDS, or when more contacts change than before."""
    theta = PENALTY * stiffness(system)
    reaction, velocity, done, error, settled = _rounds(
        system, factor, closed.copy(), theta, ROUNDS, thorough
    )
    return reaction, velocity, int(done), float(error), bool(settled)


@njit(cache=True)
def _rounds(system: Any, factor: Any, closed: Any, theta: Any, most: int, thorough: bool) -> Any:
    k = len(closed)
    w, b, scale = system.inverse_mass, system.offset, system.scale
    weight, reaction, v, pressed = np.empty(k), np.empty(k), np.empty(k), np.empty(k)
    u, best_u, best, best_error = system.free.copy(), system.free.copy(), np.zeros(k), np.inf
    wrong = np.empty(k, np.bool_)
    few = HANDFUL + int(SHARE * k)
    before, sparing = k, False
    done = 0
    while done < most:
        done += 1
        for c in range(k):
            weight[c] = theta[c] if closed[c] else 0.0
        if not factorise(system, factor, weight):
            break
        u[:] = system.free
        reaction[:] = 0.0
        approach(system, u, v)
        _close(system, factor, closed, theta, reaction, u, v, 1)
        changed = _find_wrong(w, b, scale, closed, reaction, v, wrong)
        if thorough or changed <= few or done == most:
            _close(system, factor, closed, theta, reaction, u, v, STEPS)
            changed = _find_wrong(w, b, scale, closed, reaction, v, wrong)
            error = 0.0
            for c in range(k):
                pressed[c] = max(reaction[c], 0.0) if closed[c] else 0.0
                error = max(error, abs(min(w[c] * pressed[c], b[c] - v[c])))
                if closed[c]:
                    error = max(error, -w[c] * reaction[c])
            if changed == 0:
                return pressed, u, done, error / scale, True
            if error / scale < best_error:
                best_error = error / scale
                best[:], best_u[:] = pressed, u
        if changed >= before and changed > few:
            break
        # a handful that does not shrink is a cycle between neighbours: one of them at a time breaks
        # it
        sparing = sparing or changed >= before
        before = changed
        _change(system.first, system.second, len(u), closed, wrong, sparing)
    return best, best_u, done, best_error, False


@njit(cache=True)
def _find_wrong(
    w: Any, offset: Any, scale: float, closed: Any, reaction: Any, v: Any, wrong: Any
) -> int:
    """Mark the closed contacts that pull, and the open ones without a gap that would be pressed, by
    more than rounding."""
    count = 0
    for c in range(len(closed)):
        least = ROUNDING * scale / w[c]
        if closed[c]:
            wrong[c] = reaction[c] <= -least
        else:
            wrong[c] = reaction[c] > least and offset[c] - v[c] <= EXACT * scale
        count += wrong[c]
    return count


@njit(cache=True)
def _change(first: Any, second: Any, disks: int, closed: Any, wrong: Any, sparing: bool) -> None:
    """Wrong contacts change sides; of those that share a disk only the first one where
    `sparing`."""
    taken = np.zeros(disks, np.bool_)
    for c in range(len(closed)):
        if wrong[c]:
            i, j = first[c], second[c]
            if sparing and (taken[i] or (j >= 0 and taken[j])):
                continue
            taken[i] = True
            if j >= 0:
                taken[j] = True
            closed[c] = not closed[c]


@njit(cache=True)
def _close(
    system: Any, factor: Any, closed: Any, theta: Any, reaction: Any, u: Any, v: Any, most: int
) -> int:
    """Method of multipliers on the closed contacts, with the factor of Â + CᵀΘC: λ ← λ + θ(Cu − b),
    and the steps taken.

    λ (k,) is kept for the open contacts as well (it presses nothing there); λ, u (n,d) and v = C u
    are changed in place. u is corrected by the momentum that is still out of balance, so that
    rounding does not grow with θ."""
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
        if open_by <= 1e-15 * system.scale or (steps > 2 and open_by > 0.8 * before):
            break
        before = open_by
    return steps
