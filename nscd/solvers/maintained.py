"""The equality form: every contact stays closed and may pull."""

from __future__ import annotations

import numpy as np

from nscd.solvers.cholesky.factor import factorise
from nscd.solvers.closing import EXACT, PENALTY, close_contacts
from nscd.solvers.system import approach, stiffness
from nscd.solvers.task import Answer, Held, Task

# For a nearly singular W whose contacts are all closed for certain; it blurs λ where contacts are
# redundant.
FIRM = 1e9
STEPS = 200


def maintained(task: Task) -> Answer:
    """Close all contacts: C u⁺ = b with any sign of λ (paper eqs. (2) and (8)).

    λ is of least norm where contacts are redundant, weighted by the masses where these differ much;
    iterations are steps of the method of multipliers."""
    system, factor = task.system, task.factor
    k = len(system.first)
    closed, steps = np.ones(k, dtype=np.bool_), 0
    reaction, velocity, v = np.zeros(k), system.free.copy(), np.empty(k)
    for penalty in (PENALTY, FIRM):
        theta = penalty * stiffness(system)
        if not factorise(system, factor, theta):
            break
        task.workspace.held = Held(theta, closed)
        reaction, velocity = np.zeros(k), system.free.copy()
        approach(system, velocity, v)
        steps += close_contacts(system, factor, closed, theta, reaction, velocity, v, STEPS)
        if np.abs(v - system.offset).max() <= 100.0 * EXACT * system.scale:
            break
    return task.answer(reaction, velocity, steps, least=True)
