"""Contacts whose state is known or guessed: open, stuck or sliding either way; Newton's method on
these sets."""

from __future__ import annotations

from typing import Any

import numpy as np

from nscd.compiling import inner, kernel
from nscd.friction.cholesky.multifrontal import factorise_fronts
from nscd.friction.cholesky.substitution import solve_fronts
from nscd.friction.edges import Weighted
from nscd.friction.elimination import add_to, put
from nscd.friction.factor import factorise, solve_factorised
from nscd.friction.measures import imbalance, measure
from nscd.friction.problem import add_impulses, contact_velocities

# Tangential states: nothing to hold on to, stuck, sliding forwards (τ = μ p_n) and backwards.
FREE, STICK, FORWARD, BACKWARD = 0, 1, 2, 3
# Weight of the equalities, relative to 1/w; steps of the method of multipliers with one factor.
PENALTY, STEPS = 1e8, 6
ROUNDS = 8


@inner
def slope(tangential: int, friction: float) -> float:
    """dτ/dp_n of a sliding contact, 0 otherwise."""
    if tangential == FORWARD:
        return friction
    return -friction if tangential == BACKWARD else 0.0


@kernel
def find_states(
    problem: Any, v_left: Any, v: Any, s: Any, lam: Any, tau: Any, closed: Any, hold: Any
) -> int:
    """The states (closed (k,) flags, hold (k,) tangential) that the natural map sees, and how many
    changed."""
    changed = 0
    for c in range(len(v)):
        pressed = lam[c] + (v[c] - problem.offset[c]) / problem.normal_inverse[c]
        along = problem.normal_weight[c] * (v[c] + v_left[c]) + max(pressed, 0.0)
        most = problem.friction[c] * max(along, 0.0)
        wanted = tau[c] + s[c] / problem.tangent_inverse[c]
        is_closed, state = pressed > 0.0, FREE
        if along > 0.0:
            if wanted > most:
                state = FORWARD
            elif wanted < -most:
                state = BACKWARD
            else:
                state = STICK
                if most == 0.0:
                    state = FORWARD
        if is_closed != closed[c] or state != hold[c]:
            changed += 1
        closed[c], hold[c] = is_closed, state
    return changed


@inner
def _slide(problem: Any, hold: Any, v: Any, v_left: Any, lam: Any, tau: Any) -> None:
    """τ ← ±μ p_n of the contacts that slide, 0 of those with nothing to hold on to."""
    for c in range(len(lam)):
        if hold[c] != STICK:
            pn = problem.normal_weight[c] * (v[c] + v_left[c]) + lam[c]
            tau[c] = slope(hold[c], problem.friction[c]) * pn


@inner(apart=True)
def _held(problem: Any, factor: Any, weight: Any) -> bool:
    """Factorise M + Σ α n nᵀ + β t tᵀ, weight (4,k): symmetric, since nothing slides, at half the
    cost."""
    k = weight.shape[1]
    first, second = np.empty((k, 3)), np.empty((k, 3))
    for c in range(k):
        nx, ny = problem.normal[c, 0], problem.normal[c, 1]
        first[c, 0], first[c, 1], first[c, 2] = -ny, nx, problem.lever[c, 0]
        second[c, 0], second[c, 1], second[c, 2] = ny, -nx, problem.lever[c, 1]
    system = Weighted(problem.mass, problem.normal, np.zeros(k), weight[1], first, second)
    return bool(factorise_fronts(system, factor.fronts, weight[0]))


@inner(apart=True)
def settle(
    problem: Any, factor: Any, closed: Any, hold: Any, penalty: float, steps: Any, lam: Any, tau: Any,
    u: Any,
) -> bool:  # fmt: skip
    """Solve with the states given: C u = b where closed, T u = 0 where stuck, τ = ±μ p_n where
    sliding. lam, tau (k,) and u (n,3) are the start and are changed in place: up to `steps`
    proximal steps with one factorisation. False where the factorisation fails."""
    n, k = len(u), len(lam)
    weight = np.zeros((4, k))
    v, s, dv, ds = np.empty(k), np.empty(k), np.empty(k), np.empty(k)
    along, across, work = np.empty(k), np.empty(k), np.empty((4, k))
    v_left, s_left, rest = np.empty(k), np.empty(k), np.empty((n, 3))
    contact_velocities(problem, problem.left, v_left, s_left)
    for c in range(k):
        weight[0, c] = problem.normal_weight[c]
        weight[1, c] = problem.tangent_weight[c]
        if closed[c]:
            weight[0, c] += penalty / problem.normal_inverse[c]
        else:
            lam[c] = 0.0
        if hold[c] == STICK:
            weight[1, c] += penalty / problem.tangent_inverse[c]
        weight[2, c] = slope(hold[c], problem.friction[c]) * weight[0, c]
    sliding = weight[2].any()
    if not (factorise(problem, factor, weight) if sliding else _held(problem, factor, weight)):
        return False
    before = np.inf
    for _ in range(steps):
        contact_velocities(problem, u, v, s)
        off = 0.0
        _slide(problem, hold, v, v_left, lam, tau)
        for c in range(k):
            along[c] = across[c] = 0.0
            if closed[c]:
                off = max(off, abs(v[c] - problem.offset[c]))
                along[c] = penalty / problem.normal_inverse[c] * (v[c] - problem.offset[c])
                across[c] = slope(hold[c], problem.friction[c]) * along[c]
            if hold[c] == STICK:
                off = max(off, abs(s[c]))
                across[c] = penalty / problem.tangent_inverse[c] * s[c]
        imbalance(problem, u, v, s, lam, tau, work, rest)
        for i in range(n):
            for a in range(3):
                off = max(off, abs(rest[i, a]) / problem.mass[i, a] * (1.0 if a < 2 else 0.0))
        if off <= 1e-15 * problem.scale or off > 0.5 * before:
            break
        before = off
        add_to(rest, -2.0, rest)
        add_impulses(problem, along, across, -1.0, rest)
        if sliding:
            solve_factorised(factor, rest)
        else:
            solve_fronts(factor.fronts, rest)
        contact_velocities(problem, rest, dv, ds)
        for c in range(k):
            if closed[c]:
                lam[c] += along[c] + penalty / problem.normal_inverse[c] * dv[c]
            if hold[c] == STICK:
                tau[c] += across[c] + penalty / problem.tangent_inverse[c] * ds[c]
        add_to(u, 1.0, rest)
    contact_velocities(problem, u, v, s)
    _slide(problem, hold, v, v_left, lam, tau)
    return True


@kernel
def newton(
    problem: Any, factor: Any, closed: Any, hold: Any, lam: Any, tau: Any, u: Any, tolerance: float,
    rounds: int, penalty: float,
) -> Any:  # fmt: skip
    """Newton's method on the sets from states and an answer, changed in place: up to `rounds`
    factorisations, ended by a set seen before. The best answer met is left, island by island;
    returns the errors of the islands and the rounds made."""
    k = len(lam)
    v_left, s_left, v, s = np.empty(k), np.empty(k), np.empty(k), np.empty(k)
    contact_velocities(problem, problem.left, v_left, s_left)
    best = measure(problem, u, lam, tau, v, s)
    best_lam, best_tau, best_u = lam.copy(), tau.copy(), u.copy()
    seen = np.zeros(rounds + 1, np.uint64)
    done = 0
    while done < rounds:
        key = states_key(closed, hold)
        again = False
        for a in range(done):
            again = again or seen[a] == key
        if again:
            break
        seen[done] = key
        done += 1
        if not settle(problem, factor, closed, hold, penalty, np.int64(STEPS), lam, tau, u):
            break
        error = measure(problem, u, lam, tau, v, s)
        for c in range(k):
            place = problem.island[problem.first[c]]
            if error[place] < best[place]:
                best_lam[c], best_tau[c] = lam[c], tau[c]
        for i in range(len(u)):
            if error[problem.island[i]] < best[problem.island[i]]:
                for a in range(3):
                    best_u[i, a] = u[i, a]
        worst, wild = 0.0, False
        for m in range(len(best)):
            best[m] = min(best[m], error[m])
            worst = max(worst, best[m])
            wild = wild or not error[m] < np.inf
        if worst <= tolerance or wild:
            break
        find_states(problem, v_left, v, s, lam, tau, closed, hold)
    put(lam, best_lam)
    put(tau, best_tau)
    put(u, best_u)
    return best, done


@inner
def states_key(closed: Any, hold: Any) -> Any:
    """A 64-bit hash of the states."""
    key = np.uint64(1469598103934665603)
    for c in range(len(closed)):
        key ^= np.uint64(4 * closed[c] + hold[c] + 1)
        key *= np.uint64(1099511628211)
        key ^= key >> np.uint64(29)
    return key
