"""Contacts that form trees (pairs, chains, branches; the walls as one body): exact, in linear
time."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.compiling import kernel
from nscd.solvers.system import approach, in_given_order
from nscd.solvers.task import Answer, Task

ROUNDS = 50


class Given(NamedTuple):
    """Hold what a pass needs of the problem.

    first: (k,) disk
    normal: (k,2) unit vector
    mass: (n,) kg
    free: (n,2) m/s
    offset: (k,) m/s"""

    first: Any
    normal: Any
    mass: Any
    free: Any
    offset: Any


def tree(task: Task) -> Answer:
    """Close contacts without dissipation that form trees, from the leaves.

    With its contacts closed, everything behind a disk acts on it as a mass along one normal: m_c =
    1/(n·A_c⁻¹n) with A_a = m_a I + Σ m_c n nᵀ over the branches behind. One pass from the leaves
    gives these, one pass back the reactions (paper eqs. (5), (6) for a straight chain). Contacts
    that pull are then opened and open ones that would overlap closed, until none is left."""
    problem = task.problem
    branches = branches_of(len(problem.mass), problem.first, problem.second)
    task.workspace.branches = branches
    reaction, u, done = close_branches(in_given_order(problem), branches)
    return Answer(reaction, u, int(done), least=True)


@kernel
def close_branches(system: Any, branches: Any) -> Any:
    """Find the closed ones of contacts that form trees: λ (k,), u⁺ (n,2) and the rounds."""
    k = len(system.first)
    given = Given(
        system.first, system.normal_first, system.mass[:, 0].copy(), system.free, system.offset
    )
    closed, v = np.ones(k, np.bool_), np.empty(k)
    reaction, u, done, changed = np.zeros(k), system.free, 0, True
    while changed and done < ROUNDS:
        done += 1
        reaction, u = close_tree(branches, closed, given)
        approach(system, u, v)
        changed = False
        for c in range(k):
            # a closed contact stays so unless it pulls: its own velocity is rounding
            new = system.inverse_mass[c] * reaction[c] > system.offset[c] - v[c]
            if closed[c]:
                new = reaction[c] >= 0.0
            changed = changed or new != closed[c]
            closed[c] = new
    return np.maximum(reaction, 0.0), u, done


@kernel
def branches_of(n: int, first: Any, second: Any) -> Any:
    """Order disks from the roots outward.

    Returns the order (n,), the parent of each disk (−1: a root, or the wall) and the contact that
    links them (−1: none)."""
    start = np.zeros(n + 1, np.int64)
    for c in range(len(first)):
        if second[c] >= 0:
            start[first[c] + 1] += 1
            start[second[c] + 1] += 1
    for a in range(n):
        start[a + 1] += start[a]
    contact = np.empty(start[n], np.int64)
    at = start[:-1].copy()
    order, parent, link = np.empty(n, np.int64), np.full(n, -1, np.int64), np.full(n, -1, np.int64)
    seen = np.zeros(n, np.bool_)
    for c in range(len(first)):
        if second[c] >= 0:
            contact[at[first[c]]] = c
            contact[at[second[c]]] = c
            at[first[c]] += 1
            at[second[c]] += 1
        else:
            link[first[c]] = c
    count = 0
    for walls in (True, False):  # a tree with a wall contact grows from there
        for root in range(n):
            if seen[root] or (walls and link[root] < 0):
                continue
            seen[root] = True
            order[count] = root
            head = count
            count += 1
            while head < count:
                a = order[head]
                head += 1
                for e in range(start[a], start[a + 1]):
                    c = contact[e]
                    b = second[c] if first[c] == a else first[c]
                    if not seen[b]:
                        seen[b] = True
                        parent[b], link[b] = a, c
                        order[count] = b
                        count += 1
    return order, parent, link


@kernel
def close_tree(branches: Any, closed: Any, given: Any) -> Any:
    """Compute reactions (k,) and velocities (n,2) with the `closed` contacts (k,) at C u = b.

    The others have no reaction."""
    order, parent, link = branches
    first, normal, mass, free, offset = given
    n = len(order)
    A, r = np.empty((n, 3)), np.empty((n, 2))
    for a in range(n):
        A[a, 0], A[a, 1], A[a, 2] = mass[a], 0.0, mass[a]
        r[a, 0], r[a, 1] = mass[a] * free[a, 0], mass[a] * free[a, 1]
    along, own, back = np.zeros(n), np.empty((n, 2)), np.empty((n, 2))
    for q in range(n - 1, -1, -1):
        a = order[q]
        determinant = A[a, 0] * A[a, 2] - A[a, 1] * A[a, 1]
        own[a, 0] = (A[a, 2] * r[a, 0] - A[a, 1] * r[a, 1]) / determinant
        own[a, 1] = (A[a, 0] * r[a, 1] - A[a, 1] * r[a, 0]) / determinant
        c = link[a]
        if c < 0 or not closed[c]:
            continue
        x, y = normal[c, 0], normal[c, 1]
        back[a, 0] = (A[a, 2] * x - A[a, 1] * y) / determinant
        back[a, 1] = (A[a, 0] * y - A[a, 1] * x) / determinant
        along[a] = 1.0 / (x * back[a, 0] + y * back[a, 1])
        p = parent[a]
        if p >= 0:
            sign = 1.0 if first[c] == a else -1.0
            pull = along[a] * (x * own[a, 0] + y * own[a, 1] - sign * offset[c])
            A[p, 0] += along[a] * x * x
            A[p, 1] += along[a] * x * y
            A[p, 2] += along[a] * y * y
            r[p, 0] += pull * x
            r[p, 1] += pull * y
    u, reaction = np.empty((n, 2)), np.zeros(len(first))
    for q in range(n):
        a = order[q]
        u[a, 0], u[a, 1] = own[a, 0], own[a, 1]
        c = link[a]
        if c < 0 or not closed[c]:
            continue
        x, y = normal[c, 0], normal[c, 1]
        sign = 1.0 if first[c] == a else -1.0
        wanted = sign * offset[c]
        p = parent[a]
        if p >= 0:
            wanted += x * u[p, 0] + y * u[p, 1]
        reaction[c] = sign * along[a] * (x * own[a, 0] + y * own[a, 1] - wanted)
        u[a, 0] -= sign * reaction[c] * back[a, 0]
        u[a, 1] -= sign * reaction[c] * back[a, 1]
    return reaction, u
