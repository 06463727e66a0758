"""What dissipative contacts add: Â = M + DᵀKD, the velocities û and u⁺ that balance with it, and at
which contacts k_n acts, since dissipation pushes and never pulls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from nscd.arrays import Floats
from nscd.contacts import sum_at_disks
from nscd.problem import ROUNDING, ContactProblem
from nscd.solvers.cholesky.factor import Factor, factorise, solve_factorised
from nscd.solvers.system import System, add_reactions, inertia, system_of
from nscd.solvers.task import UNKNOWN, Answer, Task

# Rounds: few are needed, 5 in a crowd of 1,000. Halvings of a step that would raise Φ.
ROUNDS, HALVINGS = 60, 40


def with_free_velocity(problem: ContactProblem) -> ContactProblem:
    """Find û of a problem from Â û = (M − DᵀKD) u⁻; it is u⁻ without dissipation."""
    if not problem.dissipative:
        return problem
    system, factor = system_of(problem)
    free = np.empty_like(problem.left)
    free[factor.order] = _velocity_of(system, factor, problem.given[factor.order])
    return replace(problem, free=free)


def balanced(task: Task, answer: Answer) -> Answer:
    """Recompute the velocities from the reactions, Â u⁺ = Â û − Cᵀλ, where that is more accurate.

    k/m times a rounding error of u is momentum out of balance."""
    problem = task.problem
    if not problem.dissipative:
        return answer
    system, factor = task.system, task.factor
    task.workspace.held = UNKNOWN
    momentum = problem.given[factor.order]
    add_reactions(system, answer.reaction[factor.contact], -1.0, momentum)
    velocity = np.empty_like(answer.velocity)
    velocity[factor.order] = _velocity_of(system, factor, momentum)
    moved = float(np.sqrt((problem.mass * (velocity - answer.velocity) ** 2).sum()))
    better = answer._replace(velocity=velocity, distance=answer.distance + moved)
    return min(answer, better, key=task.error)


def _velocity_of(system: System, factor: Factor, momentum: Floats) -> Floats:
    """u from Â u = momentum (n,d), with one refinement; all in elimination order."""
    factorise(system, factor, np.zeros(len(system.first)))
    velocity = momentum.copy()
    solve_factorised(factor, velocity)
    rest = np.empty_like(velocity)
    inertia(system, velocity, rest)
    rest = momentum - rest
    solve_factorised(factor, rest)
    refined: Floats = velocity + rest
    return refined


def solve_one_sided(task: Task, solve: Callable[[Task], Answer]) -> Answer:
    """Solve a task whose k_n act where they push, with `solve` for tasks whose k_n act anywhere.

    u⁺ minimises the convex Φ(u) = ½|u − u⁻|²_M + ½ Σ k_n max(C(u + u⁻), 0)² + ½ Σ k_t (T(u + u⁻))²
    over C u ≤ 0, T u being the sliding: Newton's method. With the contacts fixed at which k_n acts
    it is a `ContactProblem`; each round takes those at which it pushes at the velocities before. Φ
    falls from round to round, so that no choice comes twice.

    The distance of the answer is a bound for the law, not only for the k_n that act."""
    law = task.problem
    linear = with_free_velocity(law)
    found = solve(replace(task, problem=linear))
    if law.maintained or not law.normal_weight.any():
        return found
    velocity = found.velocity
    for _ in range(ROUNDS):
        acting = law.acting(velocity)
        changed = acting.normal_weight != linear.normal_weight
        closing, known = _closing(law, found)
        # those nearer to 0 than the velocities are known would change sides for ever
        if not (changed & ((np.abs(closing) > known) | (velocity is not found.velocity))).any():
            break
        linear = with_free_velocity(acting)
        found = solve(replace(task, problem=linear))
        velocity = _descended(law, velocity, found.velocity)
    return found._replace(distance=found.distance + _astray(law, linear, found))


def _potential(law: ContactProblem, velocity: Floats) -> float:
    total = velocity + law.left
    pushed = np.maximum(law.approach(total), 0.0)
    energy = float((law.mass * (velocity - law.left) ** 2).sum())
    energy += float(law.normal_weight @ pushed**2)
    if law.tangent_weight.any():
        energy += float(law.tangent_weight @ law.sliding(total) ** 2)
    return energy


def _descended(law: ContactProblem, start: Floats, end: Floats) -> Floats:
    """The first velocities with a lower Φ on the way back from the end to the start."""
    before, share = _potential(law, start), 1.0
    for _ in range(HALVINGS):
        velocity: Floats = start + share * (end - start)
        if _potential(law, velocity) < before:
            return velocity
        share *= 0.5
    return end


def _astray(law: ContactProblem, linear: ContactProblem, found: Answer) -> float:
    """How far (√kg m/s) the exact u⁺ of the law is from that of the problem with fixed k_n: nothing
    unless some C(u⁺ + u⁻) is so near to 0 that its sign is not known.

    |u₁ − u₂|_M ≤ |Cᵀr|_M⁻¹ by strong monotonicity, r: what the fixed k_n say wrongly of p_n at
    most."""
    closing, known = _closing(law, found)
    acts = linear.normal_weight > 0
    wrong = np.maximum(np.where(acts, -closing, closing) + known, 0.0)
    percussion = law.normal_weight * wrong
    carried = sum_at_disks(law.first, law.second, percussion, percussion, len(law.mass))
    return float(np.sqrt((carried**2 / law.mass[:, 0]).sum()))


def _closing(law: ContactProblem, found: Answer) -> tuple[Floats, Floats]:
    """C(u⁺ + u⁻) (k,) m/s, and how exactly it is known."""
    closing = law.approach(found.velocity + law.left)
    speed = max(law.scale, float(np.abs(found.velocity).max(initial=0.0)))
    return closing, np.sqrt(law.inverse_mass) * found.distance + ROUNDING * speed
