"""What dissipative contacts add: Â = M + DᵀKD, the velocities û and u⁺ that balance with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nscd.arrays import Floats
from nscd.problem import ContactProblem
from nscd.solvers.cholesky.factor import Factor, factorise, solve_factorised
from nscd.solvers.system import System, add_reactions, inertia, system_of
from nscd.solvers.task import UNKNOWN, Answer, Task


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
