"""Non-smooth Gauss–Seidel with the exact law of each contact, plain and accelerated."""

from __future__ import annotations

from typing import Any

import numpy as np

from nscd.compiling import inner, kernel
from nscd.friction.elimination import add_to, put, solve_dense
from nscd.friction.measures import natural_map
from nscd.friction.problem import add_impulses, contact_velocities

# Answers that Anderson's method combines; a step that grows by more than this is rejected.
MEMORY, GROWTH = 10, 2.0
# Pairs of sweeps between two looks at the natural map.
CHECK = 50


@kernel
def velocities_of(problem: Any, pn: Any, pt: Any, u: Any) -> None:
    """u ← u⁻ − M⁻¹(Cᵀp_n + Tᵀp_t), (n,3)."""
    u[:] = 0.0
    add_impulses(problem, pn, pt, -1.0, u)
    for i in range(len(u)):
        for a in range(3):
            u[i, a] = problem.left[i, a] + u[i, a] / problem.mass[i, a]


@inner(fastmath=True, apart=True)
def sweep(
    problem: Any, inverse: Any, v_left: Any, s_left: Any, pn: Any, pt: Any, u: Any, backward: Any
) -> None:
    """Solve the law of each contact in turn, all others given: whole percussions pn, pt (k,) N·s
    and velocities u (n,3) are changed in place; inverse (n,3): 1/M. Exact: n and t of one contact
    of disks do not couple."""
    k = len(pn)
    for a in range(k):
        c = k - 1 - a if backward else a
        i, j = problem.first[c], problem.second[c]
        nx, ny = problem.normal[c, 0], problem.normal[c, 1]
        li, lj = problem.lever[c, 0], problem.lever[c, 1]
        w, wt = problem.normal_inverse[c], problem.tangent_inverse[c]
        kn, kt = problem.normal_weight[c], problem.tangent_weight[c]
        x, y = u[i, 0], u[i, 1]
        turn = li * u[i, 2]
        if j >= 0:
            x -= u[j, 0]
            y -= u[j, 1]
            turn += lj * u[j, 2]
        v = nx * x + ny * y + w * pn[c]  # without this contact's percussion
        s = nx * y - ny * x + turn + wt * pt[c]
        if kn == 0.0 and kt == 0.0:
            along = max((v - problem.offset[c]) / w, 0.0)
            most = problem.friction[c] * along
            across = min(max(s / wt, -most), most)
        else:
            v = (v - w * kn * v_left[c]) / (1.0 + w * kn)
            s = (s - wt * kt * s_left[c]) / (1.0 + wt * kt)
            lam = max((v - problem.offset[c]) * (1.0 + w * kn) / w, 0.0)
            along = kn * (min(v, problem.offset[c]) + v_left[c]) + lam
            most = problem.friction[c] * max(along, 0.0)
            tau = min(max(s * (1.0 + wt * kt) / wt, -most), most)
            across = kt * (s - wt * tau / (1.0 + wt * kt) + s_left[c]) + tau
        a1, a2 = along - pn[c], across - pt[c]
        pn[c], pt[c] = along, across
        dx, dy = nx * a1 - ny * a2, ny * a1 + nx * a2
        u[i, 0] -= dx * inverse[i, 0]
        u[i, 1] -= dy * inverse[i, 1]
        u[i, 2] -= li * a2 * inverse[i, 2]
        if j >= 0:
            u[j, 0] += dx * inverse[j, 0]
            u[j, 1] += dy * inverse[j, 1]
            u[j, 2] -= lj * a2 * inverse[j, 2]


@inner
def off_by(problem: Any, v_left: Any, s_left: Any, pn: Any, pt: Any, u: Any, v: Any, s: Any) -> Any:
    """The largest natural map of whole percussions pn, pt (k,) and velocities u (n,3), over the
    scale; v, s ← C u, T u."""
    contact_velocities(problem, u, v, s)
    worst = 0.0
    for c in range(len(v)):
        lam = pn[c] - problem.normal_weight[c] * (v[c] + v_left[c])
        tau = pt[c] - problem.tangent_weight[c] * (s[c] + s_left[c])
        one, two = natural_map(problem, c, pn[c], lam, tau, v[c], s[c])
        worst = max(worst, abs(one), abs(two))
        if not worst < np.inf:
            return np.inf
    return worst / problem.scale


@kernel
def gauss_seidel(problem: Any, pn: Any, pt: Any, u: Any, pairs: int, tolerance: float) -> Any:
    """Up to `pairs` pairs of sweeps, forward and back, from percussions pn, pt (k,), changed in
    place as is u: a natural map within the tolerance ends it. Returns it, and the pairs made."""
    k = len(pn)
    v_left, s_left, v, s = np.empty(k), np.empty(k), np.empty(k), np.empty(k)
    contact_velocities(problem, problem.left, v_left, s_left)
    inverse = 1.0 / problem.mass
    error, done = np.inf, 0
    while done < pairs:
        velocities_of(problem, pn, pt, u)
        for _ in range(min(CHECK, pairs - done)):
            sweep(problem, inverse, v_left, s_left, pn, pt, u, np.bool_(False))
            sweep(problem, inverse, v_left, s_left, pn, pt, u, np.bool_(True))
            done += 1
        velocities_of(problem, pn, pt, u)
        error = off_by(problem, v_left, s_left, pn, pt, u, v, s)
        if error <= tolerance:
            break
    return error, done


@inner
def _difference(out: Any, new: Any, old: Any) -> None:
    for c in range(len(out)):
        out[c] = new[c] - old[c]


@kernel
def anderson(
    problem: Any, pn: Any, pt: Any, u: Any, blocks: int, pairs: int, tolerance: float
) -> Any:
    """Up to `blocks` blocks of `pairs` pairs of sweeps, the starts of blocks combined by Anderson's
    method from the last MEMORY ones. pn, pt, u become the best answer met. Returns its natural map
    and the pairs made. Walker & Ni, SIAM J. Numer. Anal. 49 (2011) 1715."""
    k = len(pn)
    v_left, s_left, v, s = np.empty(k), np.empty(k), np.empty(k), np.empty(k)
    contact_velocities(problem, problem.left, v_left, s_left)
    inverse = 1.0 / problem.mass
    root = np.empty(2 * k)
    x, step, old_end, old_step = np.empty(2 * k), np.empty(2 * k), np.empty(2 * k), np.empty(2 * k)
    for c in range(k):
        root[c] = np.sqrt(problem.normal_inverse[c])
        root[k + c] = np.sqrt(problem.tangent_inverse[c])
        x[c], x[k + c] = pn[c] * root[c], pt[c] * root[k + c]
    ends, steps = np.empty((MEMORY, 2 * k)), np.empty((MEMORY, 2 * k))
    best_n, best_t, best = pn.copy(), pt.copy(), np.inf
    held = done = 0
    size = before = np.inf
    for _ in range(blocks):
        for c in range(k):
            pn[c], pt[c] = x[c] / root[c], x[k + c] / root[k + c]
        velocities_of(problem, pn, pt, u)
        for _pair in range(pairs):
            sweep(problem, inverse, v_left, s_left, pn, pt, u, np.bool_(False))
            sweep(problem, inverse, v_left, s_left, pn, pt, u, np.bool_(True))
        done += pairs
        velocities_of(problem, pn, pt, u)
        error = off_by(problem, v_left, s_left, pn, pt, u, v, s)
        if error < best:
            best = error
            put(best_n, pn)
            put(best_t, pt)
        if best <= tolerance or not error < np.inf:
            break
        size = 0.0
        for c in range(k):
            step[c] = pn[c] * root[c] - x[c]
            step[k + c] = pt[c] * root[k + c] - x[k + c]
            size += step[c] ** 2 + step[k + c] ** 2
        if size > GROWTH**2 * before and held > 0:  # the combination did harm
            held, before = 0, np.inf
            put(x, old_end)
            continue
        if before < np.inf:
            _difference(steps[held % MEMORY], step, old_step)
            _difference(ends[held % MEMORY], x + step, old_end)
            held += 1
        before = size
        put(old_step, step)
        put(old_end, x)
        add_to(old_end, 1.0, step)
        put(x, old_end)
        m = min(held, MEMORY)
        if m > 0:
            _combine(steps, step, ends, x, m)
    put(pn, best_n)
    put(pt, best_t)
    velocities_of(problem, pn, pt, u)
    return best, done


@inner
def _combine(steps: Any, step: Any, ends: Any, x: Any, m: int) -> None:
    """x −= Σ share · ends, with the shares of the m differences `steps` (m,2k) that are nearest to
    `step` (2k,)."""
    gram, share = np.zeros(m * m), np.zeros(m)
    trace = 0.0
    for a in range(m):
        for b in range(a, m):
            gram[a * m + b] = gram[b * m + a] = product(steps[a], steps[b])
        share[a] = product(steps[a], step)
        trace += gram[a * m + a]
    for a in range(m):
        gram[a * m + a] += 1e-14 * trace + 1e-300
    if solve_dense(gram, share):
        for a in range(m):
            add_to(x, -share[a], ends[a])


@inner(fastmath=True)
def product(one: Any, two: Any) -> float:
    """The inner product of two vectors."""
    value = 0.0
    for c in range(len(one)):
        value += one[c] * two[c]
    return value
