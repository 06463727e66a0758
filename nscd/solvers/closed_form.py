"""Contacts that need no solver: islands that nothing presses, and single contacts."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.arrays import Flags
from nscd.compiling import inner
from nscd.islands import components, find_islands
from nscd.solvers.system import approach
from nscd.solvers.task import Answer, Task
from nscd.solvers.velocity_error import _rounding

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


class Chosen(NamedTuple):
    """Hold what is left for a solver: contacts (m,), disks (l,), and number (n,) of a disk there."""

    contact: Any
    disk: Any
    number: Any


@inner(apart=True)
def answer_at_once(system: Any, reaction: Any, velocity: Any, bounded: bool) -> Any:
    """λ = (Cu⁻ − b)/w of pressed contacts that are alone; the bound of these answers, what is left, and
    whether it forms trees."""
    k, n = len(reaction), len(velocity)
    label, count = components(n, system.first, system.second)
    many, disks, walls = np.zeros((3, count), np.int64)
    pressed, closing = np.zeros(count, np.bool_), np.empty(k)
    approach(system, system.free, closing)
    closing -= system.offset
    for i in range(n):
        disks[label[i]] += 1
    for c in range(k):
        island = label[system.first[c]]
        many[island] += 1
        walls[island] += system.second[c] < 0
        if closing[c] > 0.0:
            pressed[island] = True
    forest, left, single = True, 0, False
    for island in range(count):
        if pressed[island] and many[island] > 1:
            left += many[island]
            forest = forest and many[island] < disks[island] + (walls[island] > 0)
    contact, disk, number = np.empty(left, np.int64), np.empty(n, np.int64), np.empty(n, np.int32)
    left = 0
    for c in range(k):
        i, j = system.first[c], system.second[c]
        if pressed[label[i]] and many[label[i]] > 1:
            contact[left] = c
            left += 1
        elif pressed[label[i]]:
            single = True
            reaction[c] = max(closing[c] / system.inverse_mass[c], 0.0)
            for a in range(2):
                velocity[i, a] -= reaction[c] * system.normal_first[c, a] / system.mass[i, a]
                if j >= 0:
                    velocity[j, a] += reaction[c] * system.normal_first[c, a] / system.mass[j, a]
    inside = 0
    for i in range(n):
        if pressed[label[i]] and many[label[i]] > 1:
            disk[inside], number[i] = i, inside
            inside += 1
    bound = 0.0
    if single and bounded:
        bound = _rounding(system, np.empty((0, 2)), reaction, velocity)
    return bound, Chosen(contact, disk[:inside].copy(), number), forest
