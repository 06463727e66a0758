"""Convex quadratic programs, sparse: a primal–dual interior point method with Mehrotra's corrector,
SIAM J. Optim. 2 (1992) 575, regularised where equations are redundant."""

from typing import Any

import numpy as np
from scipy.sparse import block_array, csc_array, diags_array, eye_array
from scipy.sparse.linalg import splu

from nscd.arrays import Floats

MOST_STEPS = 100
# Residuals, and roots of gaps, relative to the terms that make them up, at which a step is the last.
EXACT = 1e-10
# After as many steps without a smaller residual only rounding is left.
IDLE = 8
# What the matrix is regularised by; the residuals are those of the program itself.
REGULAR = 1e-10
TO_BOUNDARY = 0.995


def minimise(
    quadratic: Any, linear: Floats, equal: tuple[Any, Floats], maximum: tuple[Any, Floats]
) -> tuple[Floats, float]:
    """Find x (u,) of least ½ xᵀP x + q·x with A x = b and G x ≤ h, and its error: the largest residual
    of optimality and feasibility, and the root of the gap of duality, which bounds the distance from
    the minimum, relative to the terms that make them up.

    quadratic, linear: P (u,u) sparse and positive semidefinite, q (u,)
    equal, maximum: A (r,u) and b, G (g,u) and h; rows of A may be redundant, none may be without sense"""
    (a, b), (g, h) = (csc_array(equal[0]), equal[1]), (csc_array(maximum[0]), maximum[1])
    p, u, r = csc_array(quadratic), len(linear), len(b)
    x, y = np.zeros(u), np.zeros(r)
    s, z = np.maximum(h - g @ x, 1.0), np.ones(len(h))
    best, minimum, reached = x, float("inf"), 0
    for step in range(MOST_STEPS):
        dual = p @ x + linear + a.T @ y + g.T @ z
        primal, over, gap = a @ x - b, g @ x + s - h, s * z
        error = max(
            _scaled_residual(dual, p @ x, linear, g.T @ z),
            _scaled_residual(primal, b),
            _scaled_residual(over, h, s),
            np.sqrt(float(gap.sum()) / (1.0 + abs(float(linear @ x)) + float(x @ (p @ x)))),
        )
        if error < minimum:
            best, minimum, reached = x, error, step
        if error < EXACT or not np.isfinite(error) or step > reached + IDLE:
            break
        weight = z / s
        inner = p + g.T @ diags_array(weight) @ g + REGULAR * eye_array(u)
        if r:
            inner = block_array([[inner, a.T], [a, -REGULAR * eye_array(r)]])
        try:
            solver = splu(csc_array(inner), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                          options={"SymmetricMode": True})  # fmt: skip
        except RuntimeError:  # singular: nothing more can be gained
            break
        target = gap
        for corrector in (False, True):
            right = np.concatenate([-dual - g.T @ ((z * over - target) / s), -primal])
            found = solver.solve(right)
            found += solver.solve(right - inner @ found)
            dx, dy = found[:u], found[u:]
            ds = -over - g @ dx
            dz = -(target + z * ds) / s
            length = min(_length(s, ds), _length(z, dz))
            if corrector:
                break
            after = float(((s + length * ds) * (z + length * dz)).mean())
            centre = (after / float(gap.mean())) ** 3 * float(gap.mean())
            target = gap + ds * dz - centre
        length = min(1.0, TO_BOUNDARY * length)
        x, y, s, z = x + length * dx, y + length * dy, s + length * ds, z + length * dz
    return best, minimum


def _scaled_residual(residual: Floats, *terms: Floats) -> float:
    size = 1.0 + max(float(np.abs(term).max(initial=0.0)) for term in terms)
    return float(np.abs(residual).max(initial=0.0)) / size


def _length(value: Floats, change: Floats) -> float:
    falling = change < 0
    return float((-value[falling] / change[falling]).min(initial=1e300))
