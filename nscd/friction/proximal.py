"""Proximal steps of Newton's method on the sets, each smoothed by sweeps of Gauss–Seidel.

A Newton step on the sets open, stuck and sliding moves whole chains of contacts at once, but the
sets that it leads to may be wrong in many places; sweeps put these right one by one, but need
thousands of sweeps for a chain. Together they do what neither does: the step is made with soft
contacts (proximal, weight PENALTY/w at first), put back into the cones and swept, and is taken where
the natural map does not grow by more than GROWTH; else a shorter one is tried. Soft contacts get
firmer by 2 where the whole step is taken and softer by 2 where not. As truncated non-smooth Newton
multigrid does for convex problems: Gräser & Kornhuber, J. Comput. Math. 27 (2009) 1."""

from __future__ import annotations

from typing import Any

import numpy as np

from nscd.compiling import inner, kernel
from nscd.friction.elimination import put
from nscd.friction.measures import natural_map
from nscd.friction.problem import contact_velocities
from nscd.friction.sets import find_states, settle
from nscd.friction.sweeps import sweep, velocities_of

# Weight of the equalities at first, its bounds, and proximal steps with one factor.
PENALTY, SOFTEST, FIRMEST, STEPS = 1e3, 1e1, 1e8, 2
# Pairs of sweeps after a step; lengths that are tried; growth of the natural map that is allowed.
PAIRS, LENGTHS, SHORTER, GROWTH = 20, 3, 0.3, 1.5


@inner
def _smooth(problem: Any, inverse: Any, lam: Any, tau: Any, u: Any, pairs: Any) -> None:
    """Pairs of sweeps from λ, τ (k,); u (n,3) ← the velocities that balance them."""
    none = np.empty(0)  # u⁻ at the contacts: for dissipation only
    velocities_of(problem, lam, tau, u)
    for _ in range(pairs):
        sweep(problem, inverse, none, none, lam, tau, u, np.bool_(False))
        sweep(problem, inverse, none, none, lam, tau, u, np.bool_(True))
    velocities_of(problem, lam, tau, u)


@inner
def _error(problem: Any, lam: Any, tau: Any, u: Any, v: Any, s: Any) -> Any:
    """The natural map over the scale: its largest entry and its Euclidean norm; v, s ← C u, T u."""
    contact_velocities(problem, u, v, s)
    worst = square = 0.0
    for c in range(len(v)):
        one, two = natural_map(problem, c, lam[c], lam[c], tau[c], v[c], s[c])
        worst = max(worst, abs(one), abs(two))
        square += one * one + two * two
        if not square < np.inf:
            return np.inf, np.inf
    return worst / problem.scale, np.sqrt(square) / problem.scale


@inner
def _between(problem: Any, old: Any, new: Any, length: float, out: Any) -> None:
    """out ← old + length (new − old), put back into the cones; each (λ, τ)."""
    for c in range(len(out[0])):
        along = max(old[0][c] + length * (new[0][c] - old[0][c]), 0.0)
        most = problem.friction[c] * along
        across = old[1][c] + length * (new[1][c] - old[1][c])
        out[0][c], out[1][c] = along, min(max(across, -most), most)


@kernel
def proximal_newton(
    problem: Any, factor: Any, lam: Any, tau: Any, u: Any, rounds: int, tolerance: float, weight: Any
) -> Any:  # fmt: skip
    """Make up to `rounds` rounds from λ, τ (k,), changed in place as is u (n,3), of a problem without
    dissipation. weight (1,): of soft contacts, kept for a later call. Returns the largest entry of
    the natural map, and the pairs of sweeps made."""
    k = len(lam)
    v, s, left = np.empty(k), np.empty(k), np.zeros(k)
    inverse = 1.0 / problem.mass
    closed, hold = np.zeros(k, np.bool_), np.zeros(k, np.int8)
    aim, end = (lam.copy(), tau.copy()), u.copy()
    tried, there = (lam.copy(), tau.copy()), u.copy()
    velocities_of(problem, lam, tau, u)
    worst, error = _error(problem, lam, tau, u, v, s)
    pairs = 0
    for _ in range(rounds):
        if worst <= tolerance or not worst < np.inf:
            break
        find_states(problem, left, v, s, lam, tau, closed, hold)
        put(aim[0], lam)
        put(aim[1], tau)
        put(end, u)
        taken, length = False, 1.0
        if settle(problem, factor, closed, hold, weight[0], np.int64(STEPS), aim[0], aim[1], end):
            for _try in range(LENGTHS):
                _between(problem, (lam, tau), aim, length, tried)
                _smooth(problem, inverse, tried[0], tried[1], there, np.int64(PAIRS))
                pairs += PAIRS
                one, two = _error(problem, tried[0], tried[1], there, v, s)
                if two < GROWTH * error:
                    taken = True
                    break
                length *= SHORTER
        if taken:
            put(lam, tried[0])
            put(tau, tried[1])
            put(u, there)
            worst, error = one, two
        else:
            _smooth(problem, inverse, lam, tau, u, np.int64(2 * PAIRS))
            pairs += 2 * PAIRS
            worst, error = _error(problem, lam, tau, u, v, s)
        firmer = 2.0 if taken and length == 1.0 else 0.5
        weight[0] = min(max(firmer * weight[0], SOFTEST), FIRMEST)
    return worst, pairs
