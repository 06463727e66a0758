"""Accelerated projected gradient on the dual, matrix-free: for large and well-conditioned crowds
without dissipation."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.compiling import inner, kernel
from nscd.solvers.task import Answer, Task
from nscd.solvers.thresholds import AT

# More make steps shorter and sweeps more: momentum is stable up to 4/3 of the right step, and after
# ten iterations the step is at most 1.1 of it (measured on crowds of 594 and 5,000).
POWER_ITERATIONS = 10
# Sweeps from a look at the closed contacts to the next; in a crowd of FEW contacts, where a
# factorisation costs less than that many sweeps.
CHECK, OFTEN, FEW = 25, 10, 200
MOST_SWEEPS = 200_000
# The solver stops a little before the tolerance, so that rounding does not carry it beyond.
MARGIN = 0.9
# After so many sweeps it is clear that more contacts than unknowns will stay closed: where they are
# REDUNDANT times as many, and where they are just more.
EARLY, LATE, REDUNDANT = 100, 200, AT.redundant / AT.isostatic


class Scaled(NamedTuple):
    """Hold the problem in the variables λ√w, where the Delassus operator has unit diagonal.

    first, second: (k,) disks, n for a wall
    x, y: (k,) the normal over √w
    inverse: (n+1,) 1/kg
    pull: (k,) (Cû − b)/√w
    root: (k,) √w"""

    first: Any
    second: Any
    x: Any
    y: Any
    inverse: Any
    pull: Any
    root: Any


def projected_gradient(task: Task) -> Answer:
    """Descend to the answer of a crowd without dissipation: natural-map residual ≤ tolerance.

    min ½ λᵀWλ − λᵀ(Cû − b), λ ≥ 0, in the variables λ√w (the Delassus operator then has unit
    diagonal), by Nesterov's method with the gradient restart of O'Donoghue & Candès, Found. Comput.
    Math. 15 (2015) 715."""
    task.refuse_dissipation("projected_gradient")
    tolerance = MARGIN * task.tolerance
    reaction, velocity, sweeps, _ = descend(task.system, tolerance, MOST_SWEEPS, -1, np.inf)
    return task.answer(reaction, velocity, sweeps)


@inner(fastmath=True)
def _gather(first: Any, second: Any, x: Any, y: Any, reaction: Any, ux: Any, uy: Any) -> None:
    """u = Cᵀ λ (momentum)."""
    ux[:] = 0.0
    uy[:] = 0.0
    for c in range(len(reaction)):
        i, j = first[c], second[c]
        px, py = x[c] * reaction[c], y[c] * reaction[c]
        ux[i] += px
        uy[i] += py
        ux[j] -= px
        uy[j] -= py


@inner(fastmath=True)
def _approach(first: Any, second: Any, x: Any, y: Any, ux: Any, uy: Any, v: Any) -> None:
    """v = C u."""
    for c in range(len(v)):
        i, j = first[c], second[c]
        v[c] = x[c] * (ux[i] - ux[j]) + y[c] * (uy[i] - uy[j])


@inner(fastmath=True)
def _norm(first: Any, second: Any, x: Any, y: Any, inverse: Any) -> float:
    """The largest eigenvalue of the scaled Delassus operator, by power iteration, with a margin of
    2 %."""
    v, ux, uy = np.empty(len(first)), np.empty(len(inverse)), np.empty(len(inverse))
    for c in range(len(v)):
        v[c] = 1.0 + 0.37 * ((c * 7919) % 101) / 101.0
    size = 1.0
    for _ in range(POWER_ITERATIONS):
        v /= np.sqrt((v * v).sum())
        _gather(first, second, x, y, v, ux, uy)
        ux *= inverse
        uy *= inverse
        _approach(first, second, x, y, ux, uy, v)
        size = np.sqrt((v * v).sum())
    return 1.02 * size


@inner(fastmath=True)
def _descend(
    scaled: Any, step: float, tolerance: float, most: int, steady: int, redundant: float
) -> Any:
    first, second, x, y, inverse, pull, root = scaled
    k, n = len(first), len(inverse)
    now, ahead, v, ux, uy = np.empty(k), np.empty(k), np.empty(k), np.empty(n), np.empty(n)
    for c in range(k):
        now[c] = max(pull[c], 0.0) * step
        ahead[c] = now[c]
    closed, check = np.zeros(k, np.bool_), OFTEN if k < FEW else CHECK
    since = 0.0  # sweeps since the last restart
    for sweep in range(most):
        _gather(first, second, x, y, ahead, ux, uy)
        for i in range(n):
            ux[i] *= inverse[i]
            uy[i] *= inverse[i]
        if sweep % check == check - 1:
            _approach(first, second, x, y, ux, uy, v)
            error, changed, pressed = 0.0, 0, 0
            for c in range(k):
                gradient = v[c] - pull[c]
                error = max(error, abs(min(ahead[c], gradient)) * root[c])
                touching = ahead[c] > gradient
                if touching != closed[c]:
                    changed += 1
                    closed[c] = touching
                pressed += touching
            if error <= tolerance or changed <= steady:
                return np.maximum(ahead, 0.0), sweep + 1, True
            least = redundant if sweep + 1 >= LATE else REDUNDANT * redundant
            if sweep + 1 >= EARLY and pressed > least:
                return np.maximum(ahead, 0.0), sweep + 1, False
        beta = since / (since + 2.0)
        since += 1.0
        uphill = 0.0
        for c in range(k):
            i, j = first[c], second[c]
            gradient = x[c] * (ux[i] - ux[j]) + y[c] * (uy[i] - uy[j]) - pull[c]
            new = max(ahead[c] - step * gradient, 0.0)
            move = new - now[c]
            uphill += gradient * move
            now[c] = new
            ahead[c] = new + beta * move
        if uphill > 0.0:
            since = 0.0
            ahead[:] = now
    return now, most, False


@kernel(apart=True)
def descend(system: Any, tolerance: float, most: Any, steady: Any, redundant: float) -> Any:
    """Descend to the tolerance, or for a number of sweeps.

    most: sweeps
    steady: end once no more than so many contacts (negative: never) close or open within 25
        sweeps
    redundant: end after EARLY sweeps where more contacts change than this times the number of
        unknowns: they then cannot all be told from the reactions, which are not unique

    Returns reactions λ ≥ 0 (k,) N·s, velocities (n,2) m/s in elimination order, sweeps, and whether
    it ended because it had found the closed contacts. Spins and dissipation are left out."""
    n, k = len(system.mass), len(system.first)
    root, pull = np.sqrt(system.inverse_mass), np.empty(k)
    x, y = np.empty(k), np.empty(k)
    # a wall is the disk n, which never moves; unsigned places make the gathers vector instructions
    first, second = np.empty(k, np.uint32), np.empty(k, np.uint32)
    for c in range(k):
        x[c], y[c] = system.normal_first[c, 0] / root[c], system.normal_first[c, 1] / root[c]
        first[c] = system.first[c]
        second[c] = system.second[c] if system.second[c] >= 0 else n
    inverse, free = np.zeros(n + 1), np.zeros((2, n + 1))
    for i in range(n):
        inverse[i] = 1.0 / system.mass[i, 0]
        free[0, i], free[1, i] = system.free[i, 0], system.free[i, 1]
    _approach(first, second, x, y, free[0], free[1], pull)
    pull -= system.offset / root
    step = 1.0 / _norm(first, second, x, y, inverse)
    scaled = Scaled(first, second, x, y, inverse, pull, root)
    pushed, sweeps, settled = _descend(
        scaled, step, tolerance * system.scale, most, steady, 2 * n * redundant
    )
    momentum, velocity = np.empty((2, n + 1)), np.empty((n, 2))
    _gather(first, second, x, y, pushed, momentum[0], momentum[1])
    for i in range(n):
        for a in range(2):
            velocity[i, a] = free[a, i] - momentum[a, i] * inverse[i]
    return pushed / root, velocity, sweeps, settled
