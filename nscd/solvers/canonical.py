"""The canonical reactions: of all that give the same velocities, those of least elastic energy.

Their check, by another method, is `nscd.indeterminacy.least_energy`."""

from __future__ import annotations

from typing import Any

import numpy as np

from nscd.compiling import inner, kernel
from nscd.solvers.cholesky.factor import factorise, solve_factorised
from nscd.solvers.system import System, add_reactions, approach
from nscd.solvers.task import UNKNOWN, Answer, Task
from nscd.solvers.thresholds import AT

# Weight of the contacts against the inertia that keeps the Newton matrix definite.
STIFF = 1e8
STEPS = 60
# Differences of the dual value below this share of it are rounding.
ROUNDING = 1e-14
UNIQUE = AT.unique


def canonical(task: Task, answer: Answer) -> Answer:
    """Put the reactions of least energy into an answer, unless it is none or its accuracy would
    suffer."""
    if answer.least or not task.error(answer) <= task.tolerance:
        return answer
    system, factor = task.system, task.factor
    task.workspace.held = UNKNOWN
    reaction = np.empty_like(answer.reaction)
    reaction[factor.contact] = least_energy(
        system,
        factor,
        answer.reaction[factor.contact],
        answer.velocity[factor.order],
        task.tolerance,
    )
    better = answer._replace(reaction=reaction, least=True)
    if task.error(better) <= task.tolerance:
        return better
    # the given ones serve where they are the same but for rounding
    apart = float(np.abs(reaction - answer.reaction).max())
    return answer._replace(least=apart <= AT.unique * float(reaction.max()))


@inner
def settle_energy(system: Any, factor: Any, reaction: Any, u: Any, tolerance: float) -> Any:
    """Do the same in kernels: the reactions (k,), and whether they are those of least energy."""
    better = least_energy(system, factor, reaction, u, tolerance)
    if accuracy(system, better, u) <= tolerance:
        return better, True
    return reaction, np.abs(better - reaction).max() <= UNIQUE * better.max()


@inner
def accuracy(system: Any, reaction: Any, u: Any) -> float:
    """Measure an answer without dissipation: the larger of its residual and its momentum error."""
    v, size = np.empty(len(reaction)), system.scale * system.mass[:, 0]
    approach(system, u, v)
    momentum, worst = system.mass * (u - system.free), 0.0
    add_reactions(system, reaction, 1.0, momentum)
    for c in range(len(v)):
        error = abs(min(system.inverse_mass[c] * reaction[c], system.offset[c] - v[c]))
        worst = larger(worst, error / system.scale)
        size[system.first[c]] += abs(reaction[c])
        if system.second[c] >= 0:
            size[system.second[c]] += abs(reaction[c])
    for i in range(len(size)):
        for a in range(2):
            worst = larger(worst, abs(momentum[i, a]) / size[i])
    return worst


@inner
def larger(a: float, b: float) -> float:
    """The larger of two, or the one that is no number."""
    return a if a >= b or a != a else b


@kernel(apart=True, nogil=True)
def least_energy(system: Any, factor: Any, reaction: Any, u: Any, tolerance: float) -> Any:
    """Compute reactions λ (k,) N·s of least Σλ² with the same momentum Cᵀλ as given ones, λ ≥ 0,
    and λ = 0 where the contact opens by more than tolerance · ‖u⁻‖∞.

    reaction, u: (k,) N·s, (n,d) m/s, in elimination order

    The dual is smooth: λ = max(0, C y) with y from min ½ Σ max(0, C y)² − y·Cᵀλ₀, by a semismooth
    Newton method with line search. It is the limit of a penalty packing of equal stiffness, loaded
    from rest, as the stiffness grows."""
    k = len(reaction)
    may, start, v, none = np.empty(k, np.bool_), np.zeros(k), np.empty(k), np.zeros(k)
    approach(system, u, v)
    for c in range(k):
        may[c] = system.offset[c] - v[c] <= tolerance * system.scale
        if may[c]:
            start[c] = reaction[c]
    bare = System(
        system.first, system.second, system.normal_first, system.normal_second, system.tangent_first,
        system.tangent_second, none, none, system.mass, system.free, system.offset,
        system.inverse_mass, system.scale,
    )  # fmt: skip
    found, _, _ = _newton(bare, factor, start, may)
    return found


@inner
def _value(system: Any, may: Any, y: Any, v: Any, momentum: Any) -> float:
    """½ Σ max(0, C y)² − y·momentum; v ← C y."""
    approach(system, y, v)
    value = 0.0
    for c in range(len(v)):
        if may[c] and v[c] > 0.0:
            value += 0.5 * v[c] * v[c]
    for i in range(len(y)):
        value -= y[i, 0] * momentum[i, 0] + y[i, 1] * momentum[i, 1]
    return value


@inner
def _largest(values: Any) -> float:
    """The largest magnitude, or what is no number."""
    largest = 0.0
    for i in range(len(values)):
        for a in range(values.shape[1]):
            size = abs(values[i, a])
            if size > largest or size != size:
                largest = size
    return largest


@inner
def _newton(system: Any, factor: Any, start: Any, may: Any) -> Any:
    n, d = system.mass.shape
    k = len(start)
    momentum = np.zeros((n, d))
    add_reactions(system, start, 1.0, momentum)
    size = max(_largest(momentum), 1e-300)
    stiff = STIFF * system.mass[:, 0].max()
    y, rest, trial = np.zeros((n, d)), np.empty((n, d)), np.empty((n, d))
    theta, v, reaction = np.empty(k), np.zeros(k), start.copy()
    pressed, before = may.copy(), np.zeros(k, np.bool_)
    best, best_error = start.copy(), np.inf
    value = 0.0
    for step in range(STEPS):
        if step:
            for c in range(k):
                pressed[c] = may[c] and v[c] > 0.0
                reaction[c] = v[c] if pressed[c] else 0.0
        else:
            reaction[:] = 0.0
        for i in range(n):
            for a in range(d):
                rest[i, a] = momentum[i, a]
        add_reactions(system, reaction, -1.0, rest)
        error = _largest(rest) / size
        if step and error < best_error:
            best[:], best_error = reaction, error
        if step and (
            error < 1e-13
            or (error < 1e-10 and error > 0.5 * best_error and (pressed == before).all())
        ):
            return best, best_error, step
        if step == 0 or not (pressed == before).all():
            for c in range(k):
                theta[c] = stiff if pressed[c] else 0.0
            if not factorise(system, factor, theta):
                return best, best_error, step
        before[:] = pressed
        for i in range(n):
            for a in range(d):
                rest[i, a] *= stiff
        solve_factorised(factor, rest)
        slope = 0.0
        for i in range(n):
            slope += rest[i, 0] * momentum[i, 0] + rest[i, 1] * momentum[i, 1]
        approach(system, rest, theta)
        for c in range(k):
            if may[c] and v[c] > 0.0:
                slope -= v[c] * theta[c]
        length = 1.0
        while True:
            for i in range(n):
                for a in range(d):
                    trial[i, a] = y[i, a] + length * rest[i, a]
            new = _value(system, may, trial, v, momentum)
            if new <= value - 1e-4 * length * slope + ROUNDING * abs(value) or length < 1e-6:
                break
            length *= 0.5
        y, trial = trial, y
        value = new
    return best, best_error, STEPS
