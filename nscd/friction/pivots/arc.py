"""The answer followed as the dilation itself changes, past the folds where steps of it fail.

At ψ = 1 the answer is that of the convex programme and unique, so the curve that begins there comes
to ψ = 0 or leads to percussions without bound; on its way ψ may rise again. Between two changes of
a state the answer is a smooth function of ψ; a change is found by Newton's method along the
curve."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from nscd.friction.elimination import add_to, put
from nscd.friction.factor import solve_factorised
from nscd.friction.pivots.path import ARRIVED, AWAY, BROKEN, LONG, margins, switch
from nscd.friction.pivots.rates import LAM, TAU, S, V, restart
from nscd.friction.problem import add_impulses, contact_velocities
from nscd.friction.sets import FREE, STICK, slope

# The longest step of ψ; a change of state is met within this; margins below −SLACK (of the scale,
# in velocities) say that one was overrun.
LONGEST, MET, SLACK = 0.05, 1e-7, 1e-6


@njit(cache=True)
def _find_rate(problem: Any, factor: Any, path: Any, firming: bool) -> None:
    """Derivatives by ψ, or by ln ε where `firming`, with the matrix factorised for the states, ψ
    and ε of now."""
    x, dx = path.x, path.dx
    for c in range(len(path.hold)):
        dx[LAM, c] = dx[TAU, c] = 0.0
        across = slope(path.hold[c], problem.friction[c])
        if firming:
            if path.hold[c] != FREE:
                dx[LAM, c] = path.held[0, c] - x[LAM, c]
                dx[TAU, c] = across * dx[LAM, c]
            if path.hold[c] == STICK:
                dx[TAU, c] = path.held[1, c] - x[TAU, c]
        elif path.hold[c] != FREE and path.hold[c] != STICK and across != 0.0:
            w = path.compliance[0] * problem.normal_inverse[c]
            wt = path.compliance[0] * problem.tangent_inverse[c]
            slid = x[S, c] + path.push[1, c] + wt * (path.held[1, c] - x[TAU, c])
            dx[LAM, c] = across * slid / (w + path.dilation[0] * across * across * wt)
            dx[TAU, c] = across * dx[LAM, c]
    path.rate[:] = 0.0
    add_impulses(problem, dx[LAM], dx[TAU], -1.0, path.rate)
    solve_factorised(factor, path.rate)
    contact_velocities(problem, path.rate, dx[V], dx[S])
    for c in range(len(path.hold)):
        hold = path.hold[c]
        if hold == FREE:
            continue
        w = path.compliance[0] * problem.normal_inverse[c]
        wt = path.compliance[0] * problem.tangent_inverse[c]
        if hold == STICK:
            dx[LAM, c] += dx[V, c] / w
            dx[TAU, c] += dx[S, c] / wt
        else:
            across = slope(hold, problem.friction[c])
            opens = path.dilation[0] * across
            dx[LAM, c] += (dx[V, c] + opens * dx[S, c]) / (w + opens * across * wt)
            dx[TAU, c] = across * dx[LAM, c]


@njit(cache=True)
def _margins(problem: Any, path: Any, c: int, firming: bool) -> Any:
    """The margins of a contact and their derivatives by ψ, or by ln ε where `firming` (ψ = 0)."""
    g1, r1, g2, r2 = margins(problem, path, c, 1.0)
    hold, mu = path.hold[c], problem.friction[c]
    if firming:
        if hold == FREE:
            w = path.compliance[0] * problem.normal_inverse[c]
            return g1, r1 + path.push[0, c] - w * path.held[0, c], np.inf, 0.0
        if hold != STICK and mu > 0.0:
            way = 1.0 if slope(hold, mu) > 0.0 else -1.0
            wt = path.compliance[0] * problem.tangent_inverse[c]
            r2 += way * (wt * (path.held[1, c] - path.x[TAU, c]) - path.push[1, c])
        return g1, r1, g2, r2
    if hold == FREE:  # take out what moves with t, add what moves with ψ
        a, d = path.push[0, c], path.push[1, c]
        wt = path.compliance[0] * problem.tangent_inverse[c]
        slid = path.x[S, c] + d + wt * path.held[1, c]
        opens = path.dilation[0] * mu
        if mu == 0.0:
            return g1, r1 + a, np.inf, 0.0
        if opens == 0.0:
            return g1, r1 + a - mu * slid, g1, r1 + a + mu * slid
        return g1, r1 + a + opens * d - mu * slid, g2, r2 + a - opens * d + mu * slid
    if hold != STICK and mu > 0.0:
        way = 1.0 if g2 < np.inf and slope(hold, mu) > 0.0 else -1.0
        return g1, r1, g2, r2 - way * path.push[1, c]
    return g1, r1, g2, r2


@njit(cache=True)
def _next_event(problem: Any, path: Any, way: float, last: int, grows: int, firming: bool) -> Any:
    """The signed step of ψ to the first change of a state (negative where it was overrun), contact,
    which margin, and whether a margin is overrun that no step explains."""
    best, contact, which, lost = np.inf, -1, 0, False
    for c in range(len(path.hold)):
        g1, r1, g2, r2 = _margins(problem, path, c, firming)
        size = problem.scale
        if path.hold[c] != FREE:
            size = size / problem.normal_inverse[c]
        for b in range(2):
            g, r = (g1, way * r1) if b == 0 else (g2, way * r2)
            slid = b == 1 and path.hold[c] != FREE and path.hold[c] != STICK
            low = -SLACK * (problem.scale if slid else size)
            if c == last and b == grows:
                if g < low:
                    lost = True
                if g < 0.0 or r > 0.0:
                    continue
            if not g < np.inf:
                continue
            if r < 0.0:
                step = g / -r
                if step < best:
                    best, contact, which = step, c, b
            elif g < low:
                lost = True
    return best, contact, which, lost


@njit(cache=True)
def _parameter(path: Any, firming: bool) -> Any:
    return np.log(path.compliance[0]) if firming else path.dilation[0]


@njit(cache=True)
def _set_parameter(path: Any, firming: bool, value: float) -> None:
    if firming:
        path.compliance[0] = np.exp(value)
    else:
        path.dilation[0] = value


@njit(cache=True)
def trace(problem: Any, factor: Any, path: Any, target: float, most: int, firming: bool) -> Any:
    """Follow the curve from ψ = path.dilation to ψ ≤ target with at most `most` factorisations: how
    it ended, factorisations, and changes of states. Perturbations in `path` are kept."""
    way, last, grows, pivots = -1.0, -1, 0, 0
    good_u, good = path.u.copy(), _parameter(path, firming)
    start, longest = good, LONGEST * (10.0 if firming else 1.0)
    if not restart(problem, factor, path, 1.0):
        return BROKEN, 1, 0
    fresh = True
    for made in range(1, most):
        _find_rate(problem, factor, path, firming)
        if fresh and last >= 0:
            found = _margins(problem, path, last, firming)
            rate = found[1] if grows == 0 else found[3]
            if not abs(rate) < np.inf:
                return BROKEN, made, pivots
            way = 1.0 if rate > 0.0 else -1.0
        step, contact, which, lost = _next_event(problem, path, way, last, grows, firming)
        psi = _parameter(path, firming)
        if lost and not fresh:  # a change was overrun: half the way back
            _set_parameter(path, firming, 0.5 * (psi + good))
            put(path.u, good_u)
            if abs(psi - good) < MET:
                return BROKEN, made, pivots
        elif contact >= 0 and abs(step) <= MET:
            grows = switch(problem, path, contact, which, 1.0)
            last = contact
            pivots += 1
            fresh = True
            put(good_u, path.u)
            good = psi
            if not restart(problem, factor, path, 1.0):
                return BROKEN, made, pivots
            continue
        else:
            if psi <= target and step > 0.0:
                return ARRIVED, made, pivots
            if psi > start + (6.0 if firming else 1.0):
                return AWAY, made, pivots
            if step > 0.0 or fresh:
                put(good_u, path.u)
                good = psi
            step = min(max(step, -longest), longest)
            if way < 0.0 and psi + way * step < target:
                step = psi - target
            _set_parameter(path, firming, psi + way * step)
            add_to(path.u, way * step, path.rate)
        fresh = False
        if not restart(problem, factor, path, 1.0):
            return BROKEN, made, pivots
    return LONG, most, pivots
