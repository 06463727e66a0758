"""Primal–dual interior point with a block Cholesky factor; lives with redundant, jammed and unequal
crowds."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.arrays import Floats
from nscd.compiling import inner, kernel
from nscd.solvers.active_set import close_set, gap, pressing
from nscd.solvers.cholesky.factor import factorise, solve_factorised
from nscd.solvers.system import add_reactions, approach, even, inertia, stiffness
from nscd.solvers.task import UNKNOWN, Answer, Held, Task
from nscd.solvers.thresholds import AT

MAXIMUM_ITERATIONS = 200
# Compliance of the contacts, relative to the Delassus diagonal: keeps redundant contacts definite
# and leads to the reactions of least energy. For rigid contacts it is a proximal term of the
# iteration only; 1e-10 would stall jammed ones.
SOFT, RIGID = 1e-8, 1e-14
TINY = 1e-300
# Velocities (m/s) below this are taken as none.
NOTHING = 1e-140
# A start is taken this many times its error away from the boundary.
AWAY = 10.0


class State(NamedTuple):
    """Hold a point of the path: slack s (k,) m/s, reaction λ (k,) N·s, velocity u (n,d) m/s."""

    slack: Any
    reaction: Any
    velocity: Any


class Step(NamedTuple):
    """Hold a step of the three of a `State`."""

    slack: Any
    reaction: Any
    velocity: Any


class Rest(NamedTuple):
    """Hold what a point misses.

    primal: (k,) m/s, C u + s − b − ελ/κ
    complementarity: (k,) J, sλ less its target
    dual: (n,d) N·s, Â(u − û) + Cᵀλ"""

    primal: Any
    complementarity: Any
    dual: Any


class Work(NamedTuple):
    """Hold storage: wanted, push, approach (k,); moved (n,d); size (n,)."""

    wanted: Any
    push: Any
    approach: Any
    moved: Any
    size: Any


def interior_point(task: Task) -> Answer:
    """Solve any problem: jammed, of unequal masses, dissipative.

    Where the reactions of least energy are wanted and one stiffness serves, contacts are slightly
    soft, so that the closed ones are those of these reactions, and the active set follows. Where
    any reactions will do, or that does not reach the tolerance, they are rigid, which takes about
    half as long."""
    system, start = task.system, None
    if task.start is not None:
        factor = task.factor
        start = task.start.reaction[factor.contact], task.start.velocity[factor.order]
    done = 0 if task.start is None else task.start.iterations
    spent = done
    if even(system.inverse_mass) and task.canonical:
        reaction, velocity, soft = follow_path(task, AT.soft_accuracy, SOFT, start)
        closed = pressing(system, reaction, velocity, SOFT)
        found, error = close_set(task, closed, done + soft, thorough=True)
        if error <= task.tolerance:
            return found
        spent = found.iterations
    reaction, velocity, rigid = follow_path(task, 0.5 * task.tolerance, RIGID, start)
    apart = np.minimum(system.inverse_mass * reaction, gap(system, velocity))
    error = float(np.abs(apart).max()) / system.scale
    if error > task.tolerance:
        closed = pressing(system, reaction, velocity)
        better, least = close_set(task, closed, done + rigid, thorough=True)
        if least < error:
            return better
    return task.answer(reaction, velocity, spent + rigid)


def follow_path(
    task: Task, tolerance: float, soft: float, start: tuple[Floats, Floats] | None
) -> tuple[Floats, Floats, int]:
    """Follow the central path to reactions λ > 0, velocities u and their iterations.

    tolerance: of the natural map max|min(wλ, b − Cu + ελ/κ)| and the imbalance, times ‖u⁻‖∞
    soft: ε, or 0 for RIGID
    start: (k,) N·s and (n,d) m/s that are nearly right

    Returns (k,) N·s, (n,d) m/s, all in elimination order. The path is that of min ½(u−û)·Â(u−û)
    + ½ε Σλ²/κ, C u + s = b + ελ/κ, s ≥ 0, with κ the `stiffness` and one factorisation of Â +
    CᵀΘC an iteration, Θ = 1/(s/λ + ε/κ); it ends within the tolerance, or where rounding stops
    it. Mehrotra, SIAM J. Optim. 2 (1992) 575, with one of Gondzio's correctors, Comput. Optim.
    Appl. 6 (1996) 137.

    Without a `start` from s = √w, λ = 1/√w (times one constant), which makes unequal masses
    harmless; from one, from the point of the path that is as far from the end as it is: wλ − s is
    kept, √(wλ·s) = AWAY · error."""
    system = task.system
    w, scale = system.inverse_mass, system.scale
    task.workspace.held = UNKNOWN
    if scale < NOTHING:  # their squares are no numbers any more
        return np.zeros(len(w)), system.free.copy(), 0
    compliance = soft / stiffness(system)
    if start is None:
        velocity = system.free
        slack, reaction = scale * np.sqrt(w / w.min()), scale / np.sqrt(w * w.min())
    else:
        velocity = start[1]
        opening, pushed = gap(system, velocity), w * start[0]
        away = max(float(np.abs(np.minimum(pushed, opening)).max()), tolerance * scale)
        square = (AWAY * away) ** 2
        apart = pushed - opening
        pushed = 0.5 * (apart + np.sqrt(apart**2 + 4.0 * square))
        slack = np.maximum(pushed - apart, square / pushed)
        reaction = square / slack / w
    at = State(slack, reaction, velocity.copy())
    reaction, velocity, iterations, theta = _follow(
        system, task.factor, tolerance, compliance, float(soft > RIGID), at, MAXIMUM_ITERATIONS
    )
    task.workspace.held = Held(theta, UNKNOWN.closed)
    return reaction, velocity, int(iterations)


@inner(fastmath=True)
def _to_boundary(slack: Any, slack_step: Any, reaction: Any, reaction_step: Any) -> float:
    length = 1.0
    for c in range(len(slack)):
        if slack_step[c] < 0.0:
            length = min(length, -slack[c] / slack_step[c])
        if reaction_step[c] < 0.0:
            length = min(length, -reaction[c] / reaction_step[c])
    return length


@inner
def _imbalance(system: Any, u: Any, reaction: Any, moved: Any, dual: Any, size: Any) -> float:
    """dual ← Â(u − û) + Cᵀλ; its largest entry relative to m ‖u⁻‖∞ + Σ|λ| of the disk."""
    n = len(u)
    moved[:] = u - system.free
    inertia(system, moved, dual)
    add_reactions(system, reaction, 1.0, dual)
    for i in range(n):
        size[i] = system.mass[i, 0] * system.scale
    for c in range(len(reaction)):
        size[system.first[c]] += reaction[c]
        if system.second[c] >= 0:
            size[system.second[c]] += reaction[c]
    worst = 0.0
    for i in range(n):
        for a in range(2):
            worst = max(worst, abs(dual[i, a]) / size[i])
    return worst


@kernel
def _follow(
    system: Any, factor: Any, tolerance: float, soft: Any, yields: float, at: Any, most: int
) -> Any:
    """Where it starts is `at`, which is changed. With `yields` 0 the compliance is only in the
    matrix: a proximal term, which does not change the answer."""
    slack, reaction, u = at
    n, d = system.mass.shape
    k = len(system.first)
    best_reaction, best_u, best, best_at = reaction.copy(), u.copy(), np.inf, 0
    step = Step(np.empty(k), np.empty(k), np.empty((n, d)))
    plain = Step(np.empty(k), np.empty(k), np.empty((n, d)))
    rest = Rest(np.empty(k), np.empty(k), np.empty((n, d)))
    work = Work(np.empty(k), np.empty(k), np.empty(k), np.empty((n, d)), np.empty(n))
    theta = np.empty(k)
    stalled = iteration = 0
    made = False
    while iteration < most:
        error, mu = _errors(system, soft, yields, at, rest, work)
        stalled = 0 if error < 0.9 * best else stalled + 1
        if error < best:
            best, best_at = error, iteration
            best_reaction[:], best_u[:] = reaction, u
        if best <= tolerance or stalled > (4 if best < 1e-6 else 60):
            break
        iteration += 1
        for c in range(k):
            theta[c] = 1.0 / (slack[c] / reaction[c] + soft[c])
            rest.complementarity[c] = slack[c] * reaction[c]
        made = factorise(system, factor, theta)
        if not made:
            break
        target = length = before = 0.0
        for stage in range(3):  # predictor, corrector, and Gondzio's where the step is short
            _newton(system, factor, theta, at, rest, step, work)
            length = _to_boundary(slack, step.slack, reaction, step.reaction)
            if stage == 0:
                target = _aim(at, rest, step, length, mu)
            elif stage == 1:
                if length > 0.9:
                    break
                before = length
                _copy(step, plain)
                _push_back(at, rest, step, min(1.0, 1.08 * length + 0.08), target)
            elif length < before:  # the corrector can do harm far from the path
                length = before
                _copy(plain, step)
        length *= min(max(0.995, 1.0 - 10.0 * error), 0.99999)
        for i in range(n):
            for a in range(d):
                u[i, a] += length * step.velocity[i, a]
        for c in range(k):
            slack[c] = max(slack[c] + length * step.slack[c], TINY)
            reaction[c] = max(reaction[c] + length * step.reaction[c], TINY)
    return best_reaction, best_u, best_at, theta if made else np.empty(0)


@inner
def _copy(a: Any, b: Any) -> None:
    b.slack[:], b.reaction[:], b.velocity[:] = a.slack, a.reaction, a.velocity


@inner
def _errors(system: Any, soft: Any, yields: float, at: Any, rest: Any, work: Any) -> Any:
    """The error at a point, what it misses, and the mean of sλ."""
    slack, reaction, u = at
    w, b, v = system.inverse_mass, system.offset, work.approach
    k = len(w)
    approach(system, u, v)
    error = _imbalance(system, u, reaction, work.moved, rest.dual, work.size)
    mu = 0.0
    for c in range(k):
        yielded = yields * soft[c] * reaction[c]
        error = max(error, abs(min(w[c] * reaction[c], b[c] - v[c] + yielded)) / system.scale)
        rest.primal[c] = v[c] + slack[c] - b[c] - yielded
        mu += slack[c] * reaction[c] / k
    return error, mu


@inner
def _newton(system: Any, factor: Any, theta: Any, at: Any, rest: Any, step: Any, work: Any) -> None:
    """The step that takes away what is missed, to first order."""
    slack, reaction, _ = at
    wanted, push, v = work.wanted, work.push, work.approach
    for c in range(len(wanted)):
        wanted[c] = rest.primal[c] - rest.complementarity[c] / reaction[c]
        push[c] = theta[c] * wanted[c]
    step.velocity[:] = -rest.dual
    add_reactions(system, push, -1.0, step.velocity)
    solve_factorised(factor, step.velocity)
    approach(system, step.velocity, v)
    for c in range(len(wanted)):
        step.reaction[c] = theta[c] * (v[c] + wanted[c])
        step.slack[c] = -(rest.complementarity[c] + slack[c] * step.reaction[c]) / reaction[c]


@inner
def _aim(at: Any, rest: Any, step: Any, length: float, mu: float) -> float:
    """Mehrotra's corrector: the sλ to go for from how far the predictor gets, which is returned."""
    slack, reaction, _ = at
    k = len(slack)
    after = 0.0
    for c in range(k):
        after += (slack[c] + length * step.slack[c]) * (reaction[c] + length * step.reaction[c]) / k
    centring = (after / mu) ** 3
    if length < 0.1:
        centring = max(centring, 0.3)
    target: float = centring * mu
    for c in range(k):
        rest.complementarity[c] = slack[c] * reaction[c] + step.slack[c] * step.reaction[c] - target
    return target


@inner
def _push_back(at: Any, rest: Any, step: Any, further: float, target: float) -> None:
    """Gondzio's corrector: the products sλ that a longer step would leave far from the target."""
    slack, reaction, _ = at
    for c in range(len(slack)):
        product = (slack[c] + further * step.slack[c]) * (reaction[c] + further * step.reaction[c])
        if product < 0.1 * target:
            rest.complementarity[c] -= 0.1 * target - product
        elif product > 10.0 * target:
            rest.complementarity[c] -= max(10.0 * target - product, -10.0 * target)
