"""Dissipation that pushes and never pulls: at which contacts k_n acts is found by Newton's method.

u⁺ minimises the convex Φ(u) = ½|u − u⁻|²_M + ½ Σ k_n max(C(u + u⁻), 0)² + ½ Σ k_t (T(u + u⁻))² over
C u ≤ 0, T u being the sliding. With the contacts fixed at which k_n acts it is a `ContactProblem`; each
round takes those at which it pushes at the velocities before. Φ falls from round to round, so that no
choice comes twice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nscd.arrays import Floats
from nscd.contacts import sum_at_disks
from nscd.problem import ROUNDING, ContactProblem
from nscd.solvers.dissipation import with_free_velocity
from nscd.solvers.ladder import climb
from nscd.solvers.task import Answer, Task

# Rounds: few are needed, 5 in a crowd of 1,000. Halvings of a step that would raise Φ.
ROUNDS, HALVINGS = 60, 40


def climb_one_sided(task: Task, solver: str = "auto") -> Answer:
    """Solve a task whose k_n act where they push, by the named solver or by the cheapest.

    The distance of the answer is a bound for the law, not only for the k_n that act."""
    law = task.problem
    linear = with_free_velocity(law)
    found = climb(replace(task, problem=linear), solver)
    if law.maintained or not law.normal_weight.any():
        return found
    velocity = found.velocity
    for _ in range(ROUNDS):
        acting = law.acting(velocity)
        if np.array_equal(acting.normal_weight, linear.normal_weight):
            break
        linear = with_free_velocity(acting)
        found = climb(replace(task, problem=linear), solver)
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

    |u₁ − u₂|_M ≤ |Cᵀr|_M⁻¹ by strong monotonicity, r: what the fixed k_n say wrongly of p_n at most."""
    closing = law.approach(found.velocity + law.left)
    speed = max(law.scale, float(np.abs(found.velocity).max(initial=0.0)))
    known = np.sqrt(law.inverse_mass) * found.distance + ROUNDING * speed
    acts = linear.normal_weight > 0
    wrong = np.maximum(np.where(acts, -closing, closing) + known, 0.0)
    percussion = law.normal_weight * wrong
    carried = sum_at_disks(law.first, law.second, percussion, percussion, len(law.mass))
    return float(np.sqrt((carried**2 / law.mass[:, 0]).sum()))
