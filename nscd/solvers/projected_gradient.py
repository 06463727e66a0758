"""Accelerated projected gradient on the dual, matrix-free: for large and well-conditioned crowds without dissipation."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from nscd.solvers.cholesky import System

POWER_ITERATIONS = 20
CHECK = 25


def projected_gradient(system: System, tolerance: float, most: int = 200_000) -> tuple[Any, Any, int]:
    """Reactions λ ≥ 0 (k,) N·s, velocities (n,2) in elimination order, and sweeps, to natural-map residual ≤ tolerance.

    min ½ λᵀWλ − λᵀ(Cû − b), λ ≥ 0, in the variables λ√w (the Delassus operator then has unit diagonal), by Nesterov's
    method with the gradient restart of O'Donoghue & Candès, Found. Comput. Math. 15 (2015) 715.
    """
    reaction, velocity, sweeps, _ = descend(system, tolerance, most, -1.0)
    return reaction, velocity, sweeps


def descend(system: System, tolerance: float, most: int, steady: float) -> tuple[Any, Any, int, bool]:
    """The same, ended early once the set of closed contacts changes by no more than the share `steady` (negative: never) within
    25 sweeps; the last value says whether one of both was reached."""
    root = np.sqrt(system.inverse_mass)
    x, y = system.normal_first[:, 0] / root, system.normal_first[:, 1] / root
    inverse = 1.0 / system.mass[:, 0]
    pull = _approach(system.first, system.second, x, y, system.free) - system.offset / root
    step = 1.0 / _norm(system.first, system.second, x, y, inverse)
    weighted = tolerance * system.scale
    scaled, sweeps, reached = _descend(
        system.first, system.second, x, y, inverse, pull, root, step, weighted, most, steady * len(root)
    )
    reaction = scaled / root
    velocity = (
        system.free - _momentum(system.first, system.second, x, y, scaled, len(inverse)) * inverse[:, None]
    )
    return reaction, velocity, int(sweeps), bool(reached)


@njit(cache=True, fastmath=True)
def _momentum(first: Any, second: Any, x: Any, y: Any, reaction: Any, n: int) -> Any:
    momentum = np.zeros((n, 2))
    for c in range(len(reaction)):
        i, j = first[c], second[c]
        px, py = x[c] * reaction[c], y[c] * reaction[c]
        momentum[i, 0] += px
        momentum[i, 1] += py
        if j >= 0:
            momentum[j, 0] -= px
            momentum[j, 1] -= py
    return momentum


@njit(cache=True, fastmath=True)
def _approach(first: Any, second: Any, x: Any, y: Any, u: Any) -> Any:
    v = np.empty(len(first))
    for c in range(len(first)):
        i, j = first[c], second[c]
        v[c] = x[c] * u[i, 0] + y[c] * u[i, 1]
        if j >= 0:
            v[c] -= x[c] * u[j, 0] + y[c] * u[j, 1]
    return v


@njit(cache=True, fastmath=True)
def _norm(first: Any, second: Any, x: Any, y: Any, inverse: Any) -> float:
    """The largest eigenvalue of the scaled Delassus operator, by power iteration, with a margin of 2 %."""
    v = np.empty(len(first))
    for c in range(len(v)):
        v[c] = 1.0 + 0.37 * ((c * 7919) % 101) / 101.0
    size = 1.0
    for _ in range(POWER_ITERATIONS):
        v /= np.sqrt((v * v).sum())
        u = _momentum(first, second, x, y, v, len(inverse))
        for i in range(len(inverse)):
            u[i, 0] *= inverse[i]
            u[i, 1] *= inverse[i]
        v = _approach(first, second, x, y, u)
        size = np.sqrt((v * v).sum())
    return 1.02 * size


@njit(cache=True, fastmath=True)
def _descend(
    first: Any, second: Any, x: Any, y: Any, inverse: Any, pull: Any, root: Any, step: float, tolerance: float, most: int,
    steady: float,
) -> Any:  # fmt: skip
    k, n = len(first), len(inverse)
    now, ahead, u = np.zeros(k), np.zeros(k), np.zeros((n, 2))
    for c in range(k):
        now[c] = max(pull[c], 0.0) * step
        ahead[c] = now[c]
    closed = np.zeros(k, np.bool_)
    momentum = 1.0
    for sweep in range(most):
        for i in range(n):
            u[i, 0] = u[i, 1] = 0.0
        for c in range(k):
            i, j = first[c], second[c]
            px, py = x[c] * ahead[c], y[c] * ahead[c]
            u[i, 0] += px
            u[i, 1] += py
            if j >= 0:
                u[j, 0] -= px
                u[j, 1] -= py
        for i in range(n):
            u[i, 0] *= inverse[i]
            u[i, 1] *= inverse[i]
        further = 0.5 * (1.0 + np.sqrt(1.0 + 4.0 * momentum * momentum))
        beta = (momentum - 1.0) / further
        uphill = error = 0.0
        changed = 0
        check = sweep % CHECK == CHECK - 1
        for c in range(k):
            i, j = first[c], second[c]
            v = x[c] * u[i, 0] + y[c] * u[i, 1]
            if j >= 0:
                v -= x[c] * u[j, 0] + y[c] * u[j, 1]
            gradient = v - pull[c]
            if check:
                error = max(error, abs(min(ahead[c], gradient)) * root[c])
                touching = ahead[c] > gradient
                if touching != closed[c]:
                    changed += 1
                    closed[c] = touching
            new = max(ahead[c] - step * gradient, 0.0)
            move = new - now[c]
            uphill += gradient * move
            now[c] = new
            ahead[c] = new + beta * move
        momentum = further
        if uphill > 0.0:
            momentum = 1.0
            ahead[:] = now
        if check and (error <= tolerance or changed <= steady):
            return now, sweep + 1, True
    return now, most, False
