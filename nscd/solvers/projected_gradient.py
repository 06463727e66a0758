"""Accelerated projected gradient on the dual, matrix-free: for large and well-conditioned crowds
without dissipation."""

from __future__ import annotations

from typing import Any

import numpy as np

from nscd.compiling import inner, kernel
from nscd.compiling.team import ALONE, alone
from nscd.solvers.cholesky.parts import Parts
from nscd.solvers.descent.sweeps import Descent, Scaled, approach_scaled, gather, sweep_down
from nscd.solvers.task import Answer, Task

# More make steps shorter and sweeps more: momentum is stable up to 4/3 of the right step, and after
# ten iterations the step is at most 1.1 of it (measured on crowds of 594 and 5,000).
POWER_ITERATIONS = 10
MOST_SWEEPS = 200_000
# The solver stops a little before the tolerance, so that rounding does not carry it beyond.
MARGIN = 0.9


def projected_gradient(task: Task) -> Answer:
    """Descend to the answer of a crowd without dissipation: natural-map residual ≤ tolerance.

    min ½ λᵀWλ − λᵀ(Cû − b), λ ≥ 0, in the variables λ√w (the Delassus operator then has unit
    diagonal), by Nesterov's method with the gradient restart of O'Donoghue & Candès, Found. Comput.
    Math. 15 (2015) 715."""
    task.refuse_dissipation("projected_gradient")
    tolerance = MARGIN * task.tolerance
    reaction, velocity, sweeps, _ = descend_task(task, tolerance, MOST_SWEEPS, -1, np.inf)
    return task.answer(reaction, velocity, sweeps)


def descend_task(task: Task, tolerance: float, most: int, steady: int, redundant: float) -> Any:
    """Do what `descend` does, with the threads of the task."""
    system, parts = task.system, task.factor.parts
    scaled, step, descent = _prepared(system, parts)
    limits = tolerance * system.scale, most, steady, 2 * len(system.mass) * redundant
    team = task.team if task.team.called else ALONE
    sweeps, settled = team.together(sweep_down, parts, scaled, step, descent, limits)
    reaction, velocity = _ended(system, scaled, descent.ahead)
    return reaction, velocity, sweeps, settled


@inner(fastmath=True)
def _norm(first: Any, second: Any, x: Any, y: Any, inverse: Any) -> float:
    """The largest eigenvalue of the scaled Delassus operator, by power iteration, with a margin of
    2 %."""
    v, ux, uy = np.empty(len(first)), np.empty(len(inverse)), np.empty(len(inverse))
    all_of_them = 0, len(first)
    for c in range(len(v)):
        v[c] = 1.0 + 0.37 * ((c * 7919) % 101) / 101.0
    size = 1.0
    for _ in range(POWER_ITERATIONS):
        v /= np.sqrt((v * v).sum())
        ux[:] = 0.0
        uy[:] = 0.0
        gather(all_of_them, first, second, x, y, v, ux, uy)
        ux *= inverse
        uy *= inverse
        approach_scaled(all_of_them, first, second, x, y, ux, uy, v)
        size = np.sqrt((v * v).sum())
    return 1.02 * size


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
    disk, contact = np.zeros(2, np.int64), np.zeros(2, np.int64)
    disk[1], contact[1] = len(system.mass), len(system.first)
    parts = Parts(disk, contact)
    scaled, step, descent = _prepared(system, parts)
    limits = tolerance * system.scale, most, steady, 2 * len(system.mass) * redundant
    sweeps, settled = sweep_down(alone(), 0, parts, scaled, step, descent, limits)
    reaction, velocity = _ended(system, scaled, descent.ahead)
    return reaction, velocity, sweeps, settled


@kernel
def _prepared(system: Any, parts: Any) -> Any:
    """The problem in scaled variables, the length of a step, and the start of the descent."""
    n, k, count = len(system.mass), len(system.first), len(parts.disk) - 1
    root, pull = np.sqrt(system.inverse_mass), np.empty(k)
    x, y = np.empty(k), np.empty(k)
    # unsigned places make the gathers vector instructions
    first, second = np.empty(k, np.uint32), np.empty(k, np.uint32)
    p = 0
    for c in range(k):
        while p < count - 1 and c >= parts.contact[p + 1]:
            p += 1
        x[c], y[c] = system.normal_first[c, 0] / root[c], system.normal_first[c, 1] / root[c]
        first[c] = system.first[c]
        second[c] = system.second[c] if system.second[c] >= 0 else n + p
    inverse, free = np.zeros(n + count), np.zeros((2, n + count))
    for i in range(n):
        inverse[i] = 1.0 / system.mass[i, 0]
        free[0, i], free[1, i] = system.free[i, 0], system.free[i, 1]
    approach_scaled((0, k), first, second, x, y, free[0], free[1], pull)
    pull -= system.offset / root
    step = 1.0 / _norm(first, second, x, y, inverse)
    now, ahead = np.empty(k), np.empty(k)
    for c in range(k):
        now[c] = max(pull[c], 0.0) * step
        ahead[c] = now[c]
    descent = Descent(
        now, ahead, np.empty(k), free[0], free[1], np.zeros(k, np.bool_), np.zeros((4, count, 8))
    )
    return Scaled(first, second, x, y, inverse, pull, root), step, descent


@kernel
def _ended(system: Any, scaled: Any, pushed: Any) -> Any:
    """Reactions λ ≥ 0 (k,) N·s and velocities (n,2) m/s."""
    n, k = len(system.mass), len(pushed)
    reaction = np.empty(k)
    for c in range(k):
        pushed[c] = max(pushed[c], 0.0)
        reaction[c] = pushed[c] / scaled.root[c]
    momentum, velocity = np.zeros((2, len(scaled.inverse))), np.empty((n, 2))
    ux, uy = momentum[0], momentum[1]
    gather((0, k), scaled.first, scaled.second, scaled.x, scaled.y, pushed, ux, uy)
    for i in range(n):
        for a in range(2):
            velocity[i, a] = system.free[i, a] - momentum[a, i] * scaled.inverse[i]
    return reaction, velocity
