"""What of a factorisation can be done at the same time: subtrees of the tree of fronts, and the
fronts above them one by one.

The tree is cut in the same way for any number of threads, so that they get the same bits."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.arrays import Index32, Indices
from nscd.compiling import inner, kernel
from nscd.compiling.team import control_of, wait_for
from nscd.friction.cholesky.dissection import SHARED
from nscd.friction.cholesky.elimination import chunks, height_of

# A crowd of at least SHARED disks is cut into so many subtrees, unless the largest cannot be cut.
SUBTREES = 8


class Tasks(NamedTuple):
    """Hold t tasks, each a run of nodes of which the last one is the root.

    end: (t,) the node before which it ends
    parent: (t,) the task whose node is the parent of its root, −1 where there is none
    order: (t,) in which they are taken: subtrees first
    carry: (t+1,) where what it leaves to those above begins, one place for each disk in the border
        of its root
    onward: (carry[t],) where that is added: a place among the n disks, or n and a place in what the
        next one leaves
    target: for each disk in the border of a node, the same"""

    end: Indices
    parent: Indices
    order: Indices
    carry: Indices
    onward: Index32
    target: Index32


class Shared(NamedTuple):
    """Hold what threads share.

    control: the numbers of the team
    done: (t,) the last job in which a task was done
    theta, along, across: (k,) kg, the weights of the job; empty where nobody shares them
    solution: room for what is solved for and for what tasks leave to others; empty for one task"""

    control: Any
    done: Any
    theta: Any
    along: Any
    across: Any
    solution: Any


@inner
def wait_for_those_below(tasks: Any, shared: Any, t: int, job: int) -> None:
    """Wait until a job is done in the tasks whose parent is t."""
    for below in range(t):
        if tasks.parent[below] == t:
            wait_for(shared.control, shared.done, below, job)


@inner
def no_tasks() -> Any:
    """Make those of nothing."""
    i, j, x = np.empty(0, np.int32), np.empty(0, np.int64), np.empty(0)
    return Tasks(j, j, j, j, i, i), Shared(j, j, x, x, x, x)


def tasks_of(ordering: Any, borders: tuple[Any, Any], tree: tuple[Any, Any], whole: bool) -> Tasks:
    """Plan the tasks of nodes with such borders and such a tree (child, sibling).

    whole: one task, which all are"""
    n, (start, border) = len(ordering.order), borders
    if whole or n < SHARED:
        m, none = len(ordering.node_end), np.zeros(1, dtype=np.int64)
        return Tasks(none + m, none - 1, none, np.zeros(2, np.int64), border[:0], border)
    parent = ordering.node_parent
    end, above, order = _cut(ordering.node_first, ordering.node_end, parent, start, *tree, SUBTREES)
    carry, onward, target = _ways(end, above, ordering.node_end, start, border)
    return Tasks(end, above, order, carry, onward, target)


def shared_by(threads: int, tasks: Tasks, contacts: int, n: int, d: int) -> Shared:
    """Make what threads share."""
    cut = len(tasks.end) > 1
    theta, along, across = np.empty((3, contacts if cut and threads > 1 else 0))
    solution = np.empty(d * (n + int(tasks.carry[-1])) if cut else 0)
    done = np.zeros(len(tasks.end), dtype=np.int64)
    return Shared(control_of(threads if cut else 1), done, theta, along, across, solution)


@kernel
def _cut(
    first: Any, end: Any, parent: Any, start: Any, child: Any, sibling: Any, subtrees: int
) -> Any:
    m = len(end)
    work, begin = np.zeros(m), np.arange(m)
    for s in range(m):
        height, rest = height_of(end[s] - first[s]), start[s + 1] - start[s]
        wide = 8.0 * (chunks(height) + chunks(rest))
        work[s] += height * wide * wide + 1.0
        if parent[s] >= 0:
            work[parent[s]] += work[s]
            begin[parent[s]] = min(begin[parent[s]], begin[s])
    # 1 where a subtree is a task, 2 where a node is
    kind, count = np.zeros(m, np.int8), 0
    for s in range(m):
        if parent[s] < 0:
            kind[s] = 1
            count += 1
    while count < subtrees:
        most = -1
        for s in range(m):
            if kind[s] == 1 and (most < 0 or work[s] > work[most]):
                most = s
        if most < 0 or child[most] < 0:
            break
        kind[most] = 2
        count -= 1
        c = child[most]
        while c >= 0:
            kind[c] = 1
            count += 1
            c = sibling[c]
    root = np.nonzero(kind)[0]
    task = np.full(m, -1, np.int64)
    ends, above = root + 1, np.full(len(root), -1, np.int64)
    order, at = np.empty(len(root), np.int64), 0
    for t in range(len(root)):
        task[root[t]] = t
        if kind[root[t]] == 1:
            order[at] = t
            at += 1
    for t in range(len(root)):
        if parent[root[t]] >= 0:
            above[t] = task[parent[root[t]]]
        if kind[root[t]] == 2:
            order[at] = t
            at += 1
    return ends, above, order


@inner
def _way(place: int, end: int, border: Any, beyond: int) -> int:
    """The place itself before the end of a task, else where in its border it is."""
    if place < end:
        return place
    after: Any = np.searchsorted(border, place)
    found: int = beyond + after
    return found


@kernel
def _ways(ends: Any, above: Any, end: Any, start: Any, border: Any) -> Any:
    n, count = end[-1], len(ends)
    carry = np.zeros(count + 1, np.int64)
    for t in range(count):
        carry[t + 1] = carry[t] + start[ends[t]] - start[ends[t] - 1]
    target, onward = np.empty(len(border), np.int32), np.empty(carry[count], np.int32)
    s = 0
    for t in range(count):
        root = ends[t] - 1
        own = border[start[root] : start[root + 1]]
        while s < ends[t]:
            for q in range(start[s], start[s + 1]):
                target[q] = _way(border[q], end[root], own, n + carry[t])
            s += 1
        for u in range(t):
            if above[u] == t:
                for q in range(carry[u], carry[u + 1]):
                    place = border[start[ends[u] - 1] + q - carry[u]]
                    onward[q] = _way(place, end[root], own, n + carry[t])
    return carry, onward, target
