"""How far the right velocities of an answer are from the exact ones: a bound by weak duality.

With the dual function at λ' ≥ 0, which u' = û − Â⁻¹Cᵀλ' attains, and any feasible u (C u ≤ b), the
duality gap of min ½|u − û|², |u|² = u·Âu, is ½|u − u'|² + λ'·(b − C u); both points are as near to
the exact u⁺ as |u' − u⁺|² + |u − u⁺|² ≤ 2 gap. Take λ' = λ on the contacts that press and 0
elsewhere, and u = ũ − t, the answer ũ corrected by the least t that closes these contacts exactly
and leaves no other one overlapping. Then λ'·(b − C u) = 0 and

    |ũ − u⁺|² ≤ |t|² + |ũ − u'|²,   |ũ − u'| ≤ √(Σ r²/m),  r = Âũ − Âû + Cᵀλ' (N·s),

first order in what the answer misses, and never less than the error. What cannot be closed exactly
adds λ'·|b − C u|.

Rounding: gaps b − C u up to 32 ε‖u‖∞ (ROUNDING·CLOSED) count as closed. So the bound is that of a
    problem whose
offsets b differ by so much from those given, which is what normals in double precision leave open;
what errors of that size do to u⁺ is in the bound: the length of the t that closes ± ROUNDING·ε‖u‖∞
in random order."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nscd.compiling import inner, kernel
from nscd.problem import ContactProblem
from nscd.solvers.cholesky.factor import factorise, solve_factorised
from nscd.solvers.system import EVEN, add_reactions, approach, in_given_order, inertia
from nscd.solvers.task import Answer, Task
from nscd.solvers.tree import Given, close_tree

EPSILON = float(np.finfo(float).eps)
# Gaps and imbalances are computed to so many units in the last place of what they are made of.
ROUNDING = 4.0
# Gaps after the correction count as closed up to so many times that.
CLOSED = 8.0
# Rounds in which contacts that the correction would press together are closed as well; steps of a
# correction, and the share of what a step must take away for another one.
ROUNDS, STEPS, GAIN = 8, 40, 0.1
# Weight of the closed contacts in a factorisation of its own: few steps, and their rounding is
# corrected by the next one.
FIRM = 1e9


def velocity_bound(task: Task, answer: Answer) -> float:
    """Bound √(Σ m |ũ − u⁺|²) (√kg m/s, spins included) of an answer ũ, u⁺ being exact.

    Reuses the factor that the solver left in the task's workspace, where it is of use."""
    problem, workspace = task.problem, task.workspace
    if problem.offset.any():
        return np.inf
    if workspace.branches is not None:
        square = _by_tree(
            in_given_order(problem), workspace.branches, answer.reaction, answer.velocity
        )
        return float(np.sqrt(square))
    system, factor = task.system, task.factor
    reaction, velocity = answer.reaction[factor.contact], answer.velocity[factor.order]
    given = np.empty((0, velocity.shape[1]))
    if problem.dissipative:
        given = problem.given[factor.order]
    square = _by_factor(
        system, factor, given, reaction, velocity, workspace.held, problem.maintained
    )
    return float(np.sqrt(square))


def rounding_bound(problem: ContactProblem, answer: Answer) -> float:
    """Bound the same of an answer in closed form, which is exact but for rounding."""
    if problem.offset.any():
        return np.inf
    if not answer.reaction.any() and not problem.dissipative:
        return 0.0
    system, velocity = in_given_order(problem), answer.velocity
    given = problem.given if problem.dissipative else np.empty((0, velocity.shape[1]))
    return float(_rounding(system, given, answer.reaction, velocity))


@kernel
def _rounding(system: Any, given: Any, reaction: Any, u: Any) -> float:
    k = len(reaction)
    gap, kept, closed = np.empty(k), np.empty(k), np.ones(k, np.bool_)
    rounding, square = _missed(system, given, reaction, u, np.bool_(False), closed, gap, kept)
    for c in range(k):
        if reaction[c] > 0.0:
            away = abs(gap[c]) + rounding
            square += away * away / system.inverse_mass[c]
    return math.sqrt(square)


@kernel(apart=True, nogil=True)
def _by_factor(
    system: Any, factor: Any, given: Any, reaction: Any, u: Any, held: Any, equal: Any
) -> Any:
    """The square of the bound; for `held` see `Workspace`. With `equal` contacts are maintained."""
    n, d = u.shape
    k = len(reaction)
    gap, kept, v = np.empty(k), np.empty(k), np.empty(k)
    closed, theta, ready = np.ones(k, np.bool_), np.empty(k), len(held.theta) == k
    known = len(held.closed) == k
    if known:
        closed[:] = held.closed
    if ready:
        theta[:] = held.theta
    rounding, square = _missed(system, given, reaction, u, not (known or equal), closed, gap, kept)
    t, rest = np.empty((n, d)), np.empty((n, d))
    lightest = system.inverse_mass.max()
    alike = lightest <= EVEN * system.inverse_mass.min()
    for _ in range(ROUNDS):
        if not ready:
            for c in range(k):
                stiff = 1.0 / (lightest if alike else system.inverse_mass[c])
                theta[c] = FIRM * stiff if closed[c] else 0.0
            if not factorise(system, factor, theta):
                break
        own, ready = not ready, False
        t[:] = 0.0
        v[:] = 0.0
        if _beyond(gap, closed, rounding):
            _correct(system, factor, closed, theta, -gap, np.int64(STEPS), 0.1 * rounding, t, v)
        more, slack, whole = _judge(gap, v, kept, closed, CLOSED * rounding, equal)
        if whole:
            inertia(system, t, rest)
            length = math.sqrt((t * rest).sum())
            _correct(system, factor, closed, theta, _noise(k, rounding), np.int64(1), 0.0, t, v)
            inertia(system, t, rest)
            length += math.sqrt((t * rest).sum())
            return square + length * length + 2.0 * slack
        if more == 0 and own:
            break
    # no motion of the whole is feasible, as offsets are 0
    inertia(system, u, rest)
    return square + (u * rest).sum()


@inner
def _correct(
    system: Any, factor: Any, closed: Any, theta: Any, target: Any, most: Any, enough: float,
    t: Any, v: Any,
) -> None:  # fmt: skip
    """The least t (n,d) with v = C t = target (k,) on the closed contacts, by the method of
    multipliers: at most so many steps, until all are within `enough` (m/s)."""
    k = len(closed)
    multiplier, change, rest = np.zeros(k), np.empty(k), np.zeros_like(t)
    t[:] = 0.0
    v[:] = 0.0
    before = np.inf
    for step in range(most):
        for c in range(k):
            if closed[c]:
                multiplier[c] += theta[c] * (v[c] - target[c])
        if step:
            inertia(system, t, rest)
            rest *= -1.0
        add_reactions(system, multiplier, -1.0, rest)
        solve_factorised(factor, rest)
        t += rest
        approach(system, rest, change)
        left = 0.0
        for c in range(k):
            v[c] += change[c]
            if closed[c]:
                multiplier[c] += theta[c] * change[c]
                left = max(left, abs(v[c] - target[c]))
        if left <= enough or (step and left > (1.0 - GAIN) * before):
            break
        before = left


@inner
def _beyond(gap: Any, closed: Any, rounding: float) -> bool:
    """Whether a closed contact is open, or any overlaps, by more than rounding."""
    beyond = False
    for c in range(len(gap)):
        beyond = beyond or gap[c] < -rounding or (closed[c] and gap[c] > rounding)
    return beyond


@inner
def _noise(k: int, rounding: float) -> Any:
    """± rounding (k,), as rounding is: without a pattern, and the same each time."""
    noise = np.empty(k)
    for c in range(k):
        noise[c] = rounding if ((c * 40503) >> 7) & 1 else -rounding
    return noise


@kernel
def _by_tree(system: Any, branches: Any, reaction: Any, u: Any) -> Any:
    """The square of the bound for contacts without dissipation that form trees, in linear time."""
    n, d = u.shape
    k = len(reaction)
    gap, kept, v, target = np.empty(k), np.empty(k), np.empty(k), np.empty(k)
    closed, still, none = np.ones(k, np.bool_), np.zeros((n, d)), np.empty((0, d))
    rounding, square = _missed(system, none, reaction, u, np.bool_(True), closed, gap, kept)
    for c in range(k):
        target[c] = -gap[c] - (rounding if gap[c] >= 0.0 else -rounding)
    given = Given(system.first, system.normal_first, system.mass[:, 0].copy(), still, target)
    for _ in range(ROUNDS):
        _, t = close_tree(branches, closed, given)
        approach(system, t, v)
        more, slack, whole = _judge(gap, v, kept, closed, CLOSED * rounding, np.bool_(False))
        if whole:
            return square + (system.mass * t * t).sum() + 2.0 * slack
        if more == 0:
            break
    return square + (system.mass * u * u).sum()


@inner
def _missed(
    system: Any, given: Any, reaction: Any, u: Any, pressing: Any, closed: Any, gap: Any, kept: Any
) -> tuple[float, float]:
    """gap ← b − C u; closed ← contacts that press more than they open, where `pressing`; kept ← λ
    of the closed ones, and 0. What gaps are known to (m/s), and Σ r²/m with rounding."""
    n, d = u.shape
    speed = max(system.scale, np.abs(u).max())
    rounding = ROUNDING * EPSILON * speed
    approach(system, u, gap)
    for c in range(len(gap)):
        gap[c] = system.offset[c] - gap[c]
        if pressing:
            closed[c] = system.inverse_mass[c] * reaction[c] > gap[c]
        kept[c] = reaction[c] if closed[c] else 0.0
    missed, size = np.empty((n, d)), np.empty(n)
    if len(given):
        inertia(system, u, missed)
        missed -= given
    else:
        for i in range(n):
            for a in range(d):
                missed[i, a] = system.mass[i, a] * (u[i, a] - system.free[i, a])
    add_reactions(system, kept, 1.0, missed)
    for i in range(n):
        size[i] = system.mass[i, 0] * speed
    for c in range(len(kept)):
        carried = abs(kept[c])
        if len(given):
            carried += 4.0 * (system.normal_weight[c] + system.tangent_weight[c]) * speed
        size[system.first[c]] += carried
        if system.second[c] >= 0:
            size[system.second[c]] += carried
    square = 0.0
    for i in range(n):
        known = ROUNDING * EPSILON * size[i]
        heavy = 1.0 / system.mass[i, 0]
        for a in range(2):
            amount = abs(missed[i, a]) + known
            square += amount * amount * heavy
        if d == 3:  # the moment of a push is that times the radius, √(2 I/m)
            amount = abs(missed[i, 2]) + known * math.sqrt(2.0 * system.mass[i, 2] * heavy)
            square += amount * amount / system.mass[i, 2]
    return rounding, square


@inner
def _judge(
    gap: Any, moved: Any, kept: Any, closed: Any, rounding: float, equal: Any
) -> tuple[int, float, bool]:
    """After the correction, C t = moved: how many open contacts overlap (they are closed for the
    next round), λ'·|b − C u| beyond rounding, and whether the corrected velocities are feasible."""
    more, slack, whole = 0, 0.0, True
    for c in range(len(gap)):
        after = gap[c] + moved[c]
        beyond = after - rounding
        if after < -rounding or (equal and beyond > 0.0):
            whole = False
            if not closed[c]:
                closed[c] = True
                more += 1
        elif beyond > 0.0:
            slack += kept[c] * beyond
    return more, slack, whole
