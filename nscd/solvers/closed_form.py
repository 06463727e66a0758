"""Contacts that need no solver: islands that nothing presses, and single contacts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscd.arrays import Flags
from nscd.islands import find_islands
from nscd.solvers.task import Answer, Task

ALONE, NOTHING = "each pressed contact is alone: closed form", "nothing presses"


class Rest(NamedTuple):
    """Hold what is left for a solver.

    contacts: (k,) which of them
    disks: (n,) which of them
    forest: whether these contacts form trees"""

    contacts: Flags
    disks: Flags
    forest: bool


def closed_form(task: Task) -> tuple[Answer, Rest]:
    """Answer what needs no solver, and tell what is left.

    λ = 0 where nothing presses, (Cû − b)/w of a contact that is alone in its island."""
    problem = task.problem
    islands = find_islands(problem)
    island = islands.label[problem.first]
    reaction, velocity = np.zeros(len(island)), problem.free.copy()
    single = islands.pressed & (islands.contacts == 1) & (not problem.dissipative)
    if single.any():
        at = single[island]
        closing = problem.approach(problem.free)[at] - problem.offset[at]
        reaction[at] = np.maximum(closing / problem.inverse_mass[at], 0.0)
        velocity -= problem.momentum(reaction) / problem.mass
    many = islands.pressed & ~single
    why = ALONE if single.any() else NOTHING
    answer = Answer(reaction, velocity, 0, least=True, solver="closed_form", why=why)
    forest = bool(islands.forest[many].all())
    return answer, Rest(many[island], many[islands.label], forest)
