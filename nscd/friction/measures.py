"""How far percussions and velocities are from the law and from balance, island by island."""

from __future__ import annotations

from typing import Any

import numpy as np

from nscd.compiling import inner, kernel
from nscd.friction.problem import add_impulses, contact_velocities


@inner
def imbalance(
    problem: Any, u: Any, v: Any, s: Any, lam: Any, tau: Any, work: Any, out: Any
) -> None:
    """out ← M(u − u⁻) + DᵀK D(u + u⁻) + Cᵀλ + Tᵀτ, (n,3) N·s; v, s = C u, T u; work (4,k): C u⁻, T
    u⁻, p_n, p_t."""
    k = len(v)
    contact_velocities(problem, problem.left, work[0], work[1])
    for c in range(k):
        work[2, c] = problem.normal_weight[c] * (v[c] + work[0, c]) + lam[c]
        work[3, c] = problem.tangent_weight[c] * (s[c] + work[1, c]) + tau[c]
    for i in range(len(u)):
        for a in range(3):
            out[i, a] = problem.mass[i, a] * (u[i, a] - problem.left[i, a])
    add_impulses(problem, work[2], work[3], 1.0, out)


@inner
def natural_map(problem: Any, c: int, pn: float, lam: float, tau: float, v: float, s: float) -> Any:
    """min(wλ, b − v) and w_t (τ − Π(τ + s/w_t)) of contact c, m/s; Π: onto |τ| ≤ μ max(p_n, 0)."""
    most = problem.friction[c] * max(pn, 0.0)
    wanted = min(max(tau + s / problem.tangent_inverse[c], -most), most)
    normal = min(problem.normal_inverse[c] * lam, problem.offset[c] - v)
    return normal, problem.tangent_inverse[c] * (tau - wanted)


@kernel(apart=True)
def measure(problem: Any, u: Any, lam: Any, tau: Any, v: Any, s: Any) -> Any:
    """The larger of natural map and momentum error of each island; v, s (k,) ← C u, T u.

    The first over the scale of velocities; the second: the largest |M(u − u⁻) + Dᵀp| of a disk over
    m · scale + Σ|p|, spins by inertia over lever. No number counts as infinite."""
    n, k = len(u), len(lam)
    work, rest = np.empty((4, k)), np.empty((n, 3))
    contact_velocities(problem, u, v, s)
    imbalance(problem, u, v, s, lam, tau, work, rest)
    error = np.zeros(problem.island.max() + 1)
    size, lever = np.empty(n), np.zeros(n)
    for i in range(n):
        size[i] = problem.mass[i, 0] * problem.scale
    for c in range(k):
        i, j = problem.first[c], problem.second[c]
        one, two = natural_map(problem, c, work[2, c], lam[c], tau[c], v[c], s[c])
        off = max(abs(one), abs(two)) / problem.scale
        place = problem.island[i]
        if not off < np.inf:
            off = np.inf
        error[place] = max(error[place], off)
        push = abs(work[2, c]) + abs(work[3, c])
        size[i] += push
        lever[i] = max(lever[i], problem.lever[c, 0])
        if j >= 0:
            size[j] += push
            lever[j] = max(lever[j], problem.lever[c, 1])
    for i in range(n):
        off = max(abs(rest[i, 0]), abs(rest[i, 1]))
        if lever[i] > 0.0:
            off = max(off, abs(rest[i, 2]) / lever[i])
        off /= size[i]
        if not off < np.inf:
            off = np.inf
        place = problem.island[i]
        error[place] = max(error[place], off)
    return error
