"""Primal–dual interior point with a block Cholesky factor; lives with redundant, jammed and unequal
crowds."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.compiling import inner, kernel
from nscd.solvers.active_set import ROUNDS, _rounds
from nscd.solvers.closing import CLOSED, PENALTY
from nscd.solvers.interior.central_path import away_from, cold_start, follow
from nscd.solvers.system import approach, evenly, stiffness
from nscd.solvers.task import Answer, Held, Task
from nscd.solvers.thresholds import AT

# Compliance of the contacts, relative to the Delassus diagonal: keeps redundant contacts definite
# and leads to the reactions of least energy. The softer, the fewer iterations; but the closed
# contacts are those of rigid ones only where the compliance is small beside the softest mode of the
# crowd, hence the fall with the size beyond MEDIUM disks. FIRMER times softer where that fails.
SOFT, SOFTEST, MEDIUM, FIRMER = 1e-8, 1e-5, 5000, 1e-2
# For rigid contacts it is a proximal term of the iteration only; 1e-10 would stall jammed ones.
RIGID = 1e-14
NEARLY = AT.soft_accuracy
# From where a descent ended the path begins this many times its error away from its end; from the
# answer of a crowd that was nearly the same, whose errors are few and large, this many times.
AFTER_DESCENT, AFTER_ANOTHER = 10.0, 1.0


class Begin(NamedTuple):
    """Say where the path begins.

    reaction, velocity: (k,) N·s and (n,d) m/s that are nearly right; without any (0,)
    away: so many times their error from its end
    soft: the largest compliance of contacts that is tried, relative as SOFTEST is"""

    reaction: Any
    velocity: Any
    away: float
    soft: float


class Found(NamedTuple):
    """Hold what the kernel found, in elimination order.

    reaction, velocity: (k,) N·s, (n,d) m/s
    iterations: of the path, and rounds of the closing
    least: whether these are known to be the reactions of least energy
    theta, closed: (k,) what the factor in storage is of, see `Held`"""

    reaction: Any
    velocity: Any
    iterations: int
    least: Any
    theta: Any
    closed: Any


def interior_point(task: Task) -> Answer:
    """Solve any problem: jammed, of unequal masses, dissipative.

    Where the reactions of least energy are wanted and one stiffness serves, contacts are slightly
    soft, so that the closed ones are those of these reactions, and the active set follows; where it
    does not settle they are firmer. Where any reactions will do, or that does not reach the
    tolerance, they are rigid, which takes about half as long."""
    system, factor, done = task.system, task.factor, 0
    reaction, velocity = np.empty(0), system.free
    if task.start is not None:
        done = task.start.iterations
        reaction = task.start.reaction[factor.contact]
        velocity = task.start.velocity[factor.order]
    begin = Begin(reaction, velocity, AFTER_DESCENT, SOFTEST)
    found = solve_by_path(system, factor, begin, task.tolerance, task.canonical)
    task.workspace.held = Held(found.theta, found.closed)
    return task.answer(
        found.reaction, found.velocity, done + int(found.iterations), least=bool(found.least)
    )


@kernel(apart=True, nogil=True)
def solve_by_path(system: Any, factor: Any, begin: Any, tolerance: float, least: Any) -> Any:
    """Solve a system by the interior point, as `interior_point` does.

    begin: a `Begin`
    least: whether the reactions of least energy are wanted"""
    k, w = len(system.first), system.inverse_mass
    kappa, closed, spent = stiffness(w), np.empty(k, np.bool_), 0
    none, unknown = np.empty(0), np.empty(0, np.bool_)
    if least and evenly(w):
        soft = max(SOFT, SOFTEST * min(1.0, (MEDIUM / len(system.free)) ** 3))
        soft, near, u, away = min(soft, begin.soft), begin.reaction, begin.velocity, begin.away
        while True:
            at = _start(system, near, u, NEARLY, away)
            near, u, _, done, _ = follow(system, factor, NEARLY, soft / kappa, 1.0, at)
            _press(system, near, u, soft / kappa, closed)
            pushed, right, rounds, error, settled = _close(system, factor, closed, kappa)
            spent += done + rounds
            if error <= tolerance and (settled or soft <= SOFT):
                theta = np.where(closed, PENALTY * kappa, 0.0) if settled else none
                return Found(pushed, right, spent, settled, theta, closed if settled else unknown)
            if soft <= SOFT:
                break
            soft, away = max(FIRMER * soft, SOFT), AFTER_DESCENT
    at = _start(system, begin.reaction, begin.velocity, 0.5 * tolerance, begin.away)
    near, u, _, done, theta = follow(system, factor, 0.5 * tolerance, RIGID / kappa, 0.0, at)
    spent += done
    missed = _press(system, near, u, np.zeros(k), closed)
    if missed > tolerance:
        pushed, right, rounds, error, settled = _close(system, factor, closed, kappa)
        spent += rounds
        if error < missed:
            held = np.where(closed, PENALTY * kappa, 0.0) if settled else none
            return Found(
                pushed, right, spent, settled and evenly(w), held, closed if settled else unknown
            )
        theta = none
    return Found(near, u, spent, False, theta, unknown)


@inner
def _start(system: Any, reaction: Any, velocity: Any, tolerance: float, away: float) -> Any:
    if len(reaction):
        return away_from(system, reaction, velocity, tolerance, away)
    return cold_start(system)


@inner
def _press(system: Any, reaction: Any, u: Any, compliance: Any, closed: Any) -> float:
    """closed ← the contacts that press more than they open, and than they yield; the residual."""
    v, error = np.empty(len(reaction)), 0.0
    approach(system, u, v)
    for c in range(len(reaction)):
        opening, push = system.offset[c] - v[c], system.inverse_mass[c] * reaction[c]
        closed[c] = push > opening + compliance[c] * reaction[c]
        error = max(error, abs(min(push, opening)))
    missed: float = error / system.scale
    return missed


@inner
def _close(system: Any, factor: Any, closed: Any, kappa: Any) -> Any:
    # numbers of NumPy: a literal would compile the kernel once more
    return _rounds(
        system, factor, closed, PENALTY * kappa, np.int64(ROUNDS), np.bool_(True), CLOSED
    )
