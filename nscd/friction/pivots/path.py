"""Path following by pivots: from a problem whose answer is known to the one that is asked.

The contact velocities are perturbed, C u + t a and T u + t d, so that at the start t the answer is
known: the iterate of another method (t = 1), or all contacts open (t large: Lemke's ray). As t goes
to 0 the answer moves on a piecewise linear path, on which one contact at a time changes its state.
Lemke, Management Science 11 (1965) 681; Cottle, Pang & Stone, The Linear Complementarity Problem
(1992), section 4.4."""

from __future__ import annotations

from typing import Any

import numpy as np

from nscd.compiling import inner, kernel
from nscd.friction.elimination import put
from nscd.friction.pivots.rates import (
    LAM,
    TAU,
    S,
    V,
    add_start,
    find_rate,
    move,
    restart,
    take,
)
from nscd.friction.problem import contact_velocities
from nscd.friction.sets import BACKWARD, FORWARD, FREE, STICK
from nscd.friction.sweeps import velocities_of

# Farther than this from the start a path is given up.
FARTHEST = 20.0
# How a path ended.
ARRIVED, LOOP, AWAY, LONG, BROKEN = 0, 1, 2, 3, 4


@inner
def margins(problem: Any, path: Any, c: int, t: float) -> Any:
    """Two margins that must stay ≥ 0 in the contact's state and their derivatives by t."""
    x, dx = path.x, path.dx
    hold, mu = path.hold[c], problem.friction[c]
    if hold == FREE:
        w = path.compliance[0] * problem.normal_inverse[c]
        gap = -path.start[0, c] - x[V, c] - t * path.push[0, c] - w * path.held[0, c]
        return gap, -dx[V, c] - path.push[0, c], np.inf, 0.0
    lam = path.held[0, c] + x[LAM, c]
    if hold == STICK:
        tau = path.held[1, c] + x[TAU, c]
        one, two = mu * lam, mu * dx[LAM, c]
        return one - tau, two - dx[TAU, c], one + tau, two + dx[TAU, c]
    if mu == 0.0:
        return lam, dx[LAM, c], np.inf, 0.0
    way = 1.0 if hold == FORWARD else -1.0
    wt = path.compliance[0] * problem.tangent_inverse[c]
    slid = path.start[1, c] + x[S, c] + t * path.push[1, c] - wt * x[TAU, c]
    slides = dx[S, c] + path.push[1, c] - wt * dx[TAU, c]
    return lam, dx[LAM, c], way * slid, way * slides


@inner
def _next_event(problem: Any, path: Any, t: float, way: float) -> Any:
    """The nearest change of a state when t moves by way · step: step, contact, which margin."""
    best, contact, which = np.inf, -1, 0
    for c in range(len(path.hold)):
        g1, r1, g2, r2 = margins(problem, path, c, t)
        if way * r1 < 0.0:
            step = max(g1, 0.0) / -(way * r1)
            if step < best:
                best, contact, which = step, c, 0
        if way * r2 < 0.0 and g2 < np.inf:
            step = max(g2, 0.0) / -(way * r2)
            if step < best:
                best, contact, which = step, c, 1
    return best, contact, which


@inner
def switch(problem: Any, path: Any, c: int, which: int, t: float) -> int:
    """Change the state of contact c whose margin `which` is used up; the margin of the new state
    that has to grow."""
    hold = path.hold[c]
    if hold == FREE:
        slid = path.start[1, c] + path.x[S, c] + t * path.push[1, c]
        slid += path.compliance[0] * problem.tangent_inverse[c] * path.held[1, c]
        forward = slid >= 0.0 or problem.friction[c] == 0.0
        path.hold[c] = FORWARD if forward else BACKWARD
        return 0
    if hold == STICK:
        path.hold[c] = FORWARD if which == 0 else BACKWARD
        return 1
    if which == 0:
        path.hold[c] = FREE
        return 0
    path.hold[c] = STICK
    return 0 if hold == FORWARD else 1


@kernel
def follow(problem: Any, factor: Any, path: Any, t: float, way: float, most: int) -> Any:
    """Follow the path from t, in the direction `way` of t, to t = 0 with at most `most` pivots; the
    states at the end are left in `path.hold`, and where it arrived velocities and forces in `path`.
    How it ended and the pivots made."""
    seen = np.zeros(most + 1, np.uint64)
    farthest = max(FARTHEST, 2.0 * t)
    key = np.uint64(0)
    last, grows = -1, 0
    if not restart(problem, factor, path, t):
        return BROKEN, 0
    for pivot in range(most):
        find_rate(problem, path)
        if last >= 0:
            found = margins(problem, path, last, t)
            rate = found[1] if grows == 0 else found[3]
            way = 1.0 if rate > 0.0 else -1.0
            if not abs(rate) < np.inf:
                return BROKEN, pivot
        step, contact, which = _next_event(problem, path, t, way)
        if way < 0.0 and step >= t:
            move(path, -t)
            if not restart(problem, factor, path, 0.0):
                return BROKEN, pivot
            add_start(path)
            return ARRIVED, pivot
        if contact < 0 or t + way * step > farthest:
            return AWAY, pivot
        move(path, way * step)
        t += way * step
        before = path.hold[contact]
        grows = switch(problem, path, contact, which, t)
        last = contact
        key ^= _word(contact, before) ^ _word(contact, path.hold[contact])
        for a in range(pivot):
            if seen[a] == key:
                return LOOP, pivot
        seen[pivot] = key
        if path.slot[contact] < 0 and path.count[0] >= len(path.changed):
            if not restart(problem, factor, path, t):
                return BROKEN, pivot
        elif path.slot[contact] < 0:
            take(problem, factor, path, contact)
    return LONG, most


@inner
def _word(contact: int, hold: int) -> Any:
    """A 64-bit word of one contact's state; states of all are their exclusive or."""
    x = np.uint64(4 * contact + int(hold) + 1) * np.uint64(0x9E3779B97F4A7C15)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


@kernel
def clean(problem: Any, u: Any, lam: Any, tau: Any) -> None:
    """Put λ and τ of a nearly converged answer on the corners of their law: 0 where the contact
    opens by more than it presses, ±μλ where it slides by more than it may still hold."""
    k = len(lam)
    v, s = np.empty(k), np.empty(k)
    contact_velocities(problem, u, v, s)
    for c in range(k):
        mu = problem.friction[c]
        gap = problem.offset[c] - v[c]
        if problem.normal_inverse[c] * lam[c] <= gap or lam[c] <= 0.0:
            lam[c] = tau[c] = 0.0
        elif abs(s[c]) >= problem.tangent_inverse[c] * (mu * lam[c] - abs(tau[c])):
            tau[c] = mu * lam[c] if s[c] >= 0.0 else -mu * lam[c]


@kernel
def perturb(problem: Any, path: Any, lam: Any, tau: Any, noise: Any) -> None:
    """Perturbations a, d with which percussions lam, tau (k,), within their cones, and u⁻ + what
    they do are the answer at t = 1; contacts on the brink get `noise` (k,) m/s away from it."""
    path.u[:] = 0.0
    velocities_of(problem, lam, tau, path.origin)
    contact_velocities(problem, path.origin, path.start[0], path.start[1])
    for c in range(len(lam)):
        path.start[0, c] -= problem.offset[c]
        mu, gap, s = problem.friction[c], -path.start[0, c], path.start[1, c]
        d, hold = 0.0, FREE
        if lam[c] > 0.0:
            if abs(tau[c]) < (1.0 - 1e-12) * mu * lam[c]:
                hold, d = STICK, -s
            elif tau[c] > 0.0 or mu == 0.0:
                hold, d = FORWARD, max(0.0, noise[c] - s)
            else:
                hold, d = BACKWARD, min(0.0, -noise[c] - s)
            if mu == 0.0:
                d = 0.0
        a = gap if hold != FREE else min(0.0, gap - noise[c])
        path.hold[c] = hold
        path.push[0, c], path.push[1, c] = a, d
        path.held[0, c], path.held[1, c] = lam[c], tau[c]


@kernel
def open_all(problem: Any, path: Any, noise: Any) -> float:
    """Perturbations with which all contacts are open down to the returned t, where the first
    closes: contacts are moved apart by 1 + noise (k,), and across by a little of it."""
    path.u[:] = 0.0
    put(path.origin, problem.left)
    contact_velocities(problem, path.origin, path.start[0], path.start[1])
    t = 0.0
    for c in range(len(path.hold)):
        path.hold[c] = FREE
        path.start[0, c] -= problem.offset[c]
        path.held[0, c] = path.held[1, c] = 0.0
        path.push[0, c] = -(1.0 + noise[c])
        path.push[1, c] = 0.01 * (noise[c] - 0.5)
        t = max(t, path.start[0, c] / -path.push[0, c])
    return 1.01 * t
