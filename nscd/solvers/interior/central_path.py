"""The central path of the percussions: Mehrotra's method with a block Cholesky factor, compiled."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.compiling import inner, kernel
from nscd.solvers.cholesky.factor import factorise, solve_factorised
from nscd.solvers.system import add_reactions, approach, inertia

MAXIMUM_ITERATIONS = 200
TINY = 1e-300
# Velocities (m/s) below this are taken as none.
NOTHING = 1e-140
# It has stalled after so many iterations that take away less than a tenth of the error: near the
# end of the path, and far from it.
NEAR_END, STALLED, LOST = 1e-6, 4, 60


class State(NamedTuple):
    """Hold a point of the path: slack s (k,) m/s, reaction λ (k,) N·s, velocity u (n,d) m/s."""

    slack: Any
    reaction: Any
    velocity: Any


class Work(NamedTuple):
    """Hold storage of an iteration.

    wanted: (k,) m/s, C u − b − ελ/κ
    theta: (k,) kg, Θ
    push, v: (k,)
    target: (k,) m/s, what the corrector takes from the slack, (ΔsΔλ − σμ)/λ
    dual: (n,d) N·s, Â(u − û) + Cᵀλ
    size: (n,) N·s"""

    wanted: Any
    theta: Any
    push: Any
    v: Any
    target: Any
    dual: Any
    size: Any


@kernel(apart=True)
def follow(
    system: Any, factor: Any, tolerance: float, compliance: Any, yields: float, start: Any
) -> Any:
    """Follow the central path of min ½(u−û)·Â(u−û) + ½ Σ cλ², C u + s = b + cλ, s ≥ 0.

    tolerance: of the natural map max|min(wλ, b − Cu + cλ)| and the imbalance, times ‖u⁻‖∞
    compliance: (k,) s/kg, c
    yields: 1; or 0, where c is in the matrix only: a proximal term, which does not change the
        answer
    start: a `State` with s, λ > 0, which is changed

    Returns λ (k,), u (n,d), the error there, the iterations, and Θ of the last factor (empty where
    it failed). One factorisation of Â + CᵀΘC an iteration, Θ = 1/(s/λ + c), and two solves. It
    ends within the tolerance, or where rounding stops it; what is no number ends it at once.
    Mehrotra, SIAM J. Optim. 2 (1992) 575."""
    slack, reaction, u = start
    n, d = system.mass.shape
    k = len(reaction)
    best_reaction, best_u, best, best_at = reaction.copy(), u.copy(), np.inf, 0
    if system.scale < NOTHING:  # their squares are no numbers any more
        return np.zeros(k), system.free.copy(), best, 0, np.empty(0)
    step = State(np.empty(k), np.empty(k), np.empty((n, d)))
    work = Work(
        np.empty(k), np.empty(k), np.empty(k), np.empty(k), np.empty(k), np.empty((n, d)), np.empty(n)
    )  # fmt: skip
    dissipative = system.normal_weight.any() or system.tangent_weight.any()
    stalled = iteration = 0
    made = False
    while True:
        error, mean, sound = _errors(system, compliance, yields, dissipative, start, work)
        if not sound:
            break
        stalled = 0 if error < 0.9 * best else stalled + 1
        if error < best:
            best, best_at = error, iteration
            best_reaction[:], best_u[:] = reaction, u
        enough = STALLED if best < NEAR_END else LOST
        if best <= tolerance or stalled > enough or iteration == MAXIMUM_ITERATIONS:
            break
        iteration += 1
        _weigh(slack, reaction, compliance, work.theta)
        made = factorise(system, factor, work.theta)
        if not made:
            break
        work.target[:] = 0.0
        _newton(system, factor, start, step, work)
        length = _to_boundary(start, step)
        _aim(start, step, length, mean, work.target)
        _newton(system, factor, start, step, work)
        length = _to_boundary(start, step) * min(max(0.995, 1.0 - 10.0 * error), 0.99999)
        for i in range(n):
            for a in range(d):
                u[i, a] += length * step.velocity[i, a]
        for c in range(k):
            slack[c] = max(slack[c] + length * step.slack[c], TINY)
            reaction[c] = max(reaction[c] + length * step.reaction[c], TINY)
    return best_reaction, best_u, best, best_at, work.theta if made else np.empty(0)


@inner(fastmath=True, error_model="numpy")
def _errors(
    system: Any, compliance: Any, yields: float, dissipative: Any, at: Any, work: Any
) -> Any:
    """The error at a point, the mean of sλ, and whether they are numbers; what the point misses goes
    into `work`."""
    slack, reaction, u = at
    n, d = u.shape
    k = len(reaction)
    first, second, normal, dual, size = (
        system.first, system.second, system.normal_first, work.dual, work.size,
    )  # fmt: skip
    if dissipative:
        inertia(system, u - system.free, dual)
    else:
        for i in range(n):
            for a in range(d):
                dual[i, a] = system.mass[i, a] * (u[i, a] - system.free[i, a])
    for i in range(n):
        size[i] = system.mass[i, 0] * system.scale
    for c in range(k):
        i, j, push = first[c], second[c], reaction[c]
        x, y = u[i, 0], u[i, 1]
        px, py = normal[c, 0] * push, normal[c, 1] * push
        dual[i, 0] += px
        dual[i, 1] += py
        size[i] += push
        if j >= 0:
            x -= u[j, 0]
            y -= u[j, 1]
            dual[j, 0] -= px
            dual[j, 1] -= py
            size[j] += push
        work.v[c] = normal[c, 0] * x + normal[c, 1] * y
    worst = error = total = 0.0
    for i in range(n):
        worst = max(worst, max(abs(dual[i, 0]), abs(dual[i, 1])) / size[i])
    for c in range(k):
        wanted = work.v[c] - system.offset[c] - yields * compliance[c] * reaction[c]
        error = max(error, abs(min(system.inverse_mass[c] * reaction[c], -wanted)))
        work.wanted[c] = wanted
        total += slack[c] * reaction[c]
    return max(worst, error / system.scale), total / k, _sound(dual, total)


@inner(fastmath={"reassoc", "nsz", "contract"})
def _sound(dual: Any, total: float) -> Any:
    """Whether everything is a finite number. A maximum hides what is none, a sum does not."""
    for i in range(len(dual)):
        for a in range(dual.shape[1]):
            total += abs(dual[i, a])
    return total <= HUGE


HUGE = float(np.finfo(float).max)


@inner(fastmath=True, error_model="numpy")
def _weigh(slack: Any, reaction: Any, compliance: Any, theta: Any) -> None:
    for c in range(len(theta)):
        theta[c] = reaction[c] / (slack[c] + compliance[c] * reaction[c])


@inner(fastmath=True, error_model="numpy")
def _newton(system: Any, factor: Any, at: Any, step: Any, work: Any) -> None:
    """The step that takes away what is missed, to first order; sλ goes to 0, or to what the corrector
    wants."""
    slack, reaction, _ = at
    theta, push, v, target = work.theta, work.push, work.v, work.target
    k = len(theta)
    for c in range(k):
        push[c] = theta[c] * (work.wanted[c] - target[c])
    for i in range(len(work.dual)):
        for a in range(work.dual.shape[1]):
            step.velocity[i, a] = -work.dual[i, a]
    add_reactions(system, push, -1.0, step.velocity)
    solve_factorised(factor, step.velocity)
    approach(system, step.velocity, v)
    for c in range(k):
        change = theta[c] * v[c] + push[c]
        step.reaction[c] = change
        step.slack[c] = -slack[c] - target[c] - slack[c] * change / reaction[c]


@inner(fastmath=True, error_model="numpy")
def _to_boundary(at: Any, step: Any) -> float:
    """How far a step goes until s or λ is 0, at most 1."""
    most = 1.0
    for c in range(len(at.slack)):
        most = max(most, max(-step.slack[c] / at.slack[c], -step.reaction[c] / at.reaction[c]))
    return 1.0 / most


@inner(fastmath=True, error_model="numpy")
def _aim(at: Any, step: Any, length: float, mean: float, target: Any) -> None:
    """Mehrotra's corrector: (ΔsΔλ − σμ)/λ (k,), σ from how far the predictor gets."""
    slack, reaction, _ = at
    k = len(slack)
    after = 0.0
    for c in range(k):
        after += (slack[c] + length * step.slack[c]) * (reaction[c] + length * step.reaction[c])
    centring = (after / (k * mean)) ** 3
    if length < 0.1:
        centring = max(centring, 0.3)
    aim = centring * mean
    for c in range(k):
        target[c] = (step.slack[c] * step.reaction[c] - aim) / reaction[c]


@inner
def cold_start(system: Any) -> State:
    """The start s = √w, λ = 1/√w (times one constant), which makes unequal masses harmless."""
    root, scale = np.sqrt(system.inverse_mass), system.scale
    least = root.min()
    return State(root * (scale / least), scale / (root * least), system.free.copy())


@inner(fastmath=True, error_model="numpy")
def away_from(system: Any, reaction: Any, u: Any, tolerance: float, away: float) -> State:
    """The point of the path that is as far from the end as λ (k,) and u (n,2) are: wλ − s is kept,
    √(wλ·s) = away · error."""
    w, k = system.inverse_mass, len(reaction)
    slack, pushed, error = np.empty(k), np.empty(k), tolerance * system.scale
    approach(system, u, slack)
    for c in range(k):
        slack[c] = system.offset[c] - slack[c]
        error = max(error, abs(min(w[c] * reaction[c], slack[c])))
    square = (away * error) ** 2
    for c in range(k):
        apart = w[c] * reaction[c] - slack[c]
        push = 0.5 * (apart + np.sqrt(apart**2 + 4.0 * square))
        slack[c] = max(push - apart, square / push)
        pushed[c] = square / slack[c] / w[c]
    return State(slack, pushed, u.copy())
