"""Multifrontal Cholesky factorisation over the separator tree: dense blocks, the fastest for large
crowds.

Each node of the tree eliminates its disks in a dense front of themselves and the later disks that
they reach; what is left (the Schur complement) goes to the parent's front. Duff & Reid, ACM Trans.
Math. Softw. 9 (1983) 302."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.arrays import Index32, Indices
from nscd.compiling import inner, kernel
from nscd.friction.cholesky.dissection import Ordering
from nscd.friction.cholesky.elimination import chunks, height_of, update_size
from nscd.friction.cholesky.tasks import Shared, Tasks, no_tasks, shared_by, tasks_of


class Fronts(NamedTuple):
    """Hold structure and storage of fronts, with d unknowns per disk.

    first, end: (m,) places that node s eliminates
    border_start, border: (m+1,) and later places in its front, increasing
    inner: their places in the parent's front
    child, sibling: (m,) the tree, −1 ends
    element_start, element: (m+1,) and contacts that are added to node s
    left, right: their local places, −1 for a wall
    panel_start: (m+1,) where the rows of Lᵀ begin in store
    update_start: (m,) where Schur complements do: two stacks, for even and odd depths, so that a
        node's is not where its children's are; each thread has its own; those of the roots of
        several tasks stand before the stacks and stay
    store: the numbers, as in `eliminate`
    work, run: overwritten, a piece for each thread
    stacks: how many numbers the stacks of a thread have
    tasks, shared: what can be done at the same time, and what those who do it share"""

    first: Index32
    end: Index32
    border_start: Indices
    border: Index32
    inner: Index32
    child: Index32
    sibling: Index32
    element_start: Indices
    element: Index32
    left: Index32
    right: Index32
    panel_start: Indices
    update_start: Indices
    store: Any
    work: Any
    run: Index32
    stacks: int
    tasks: Tasks
    shared: Shared


@inner
def no_fronts() -> Any:
    """Make the structure of nothing."""
    i, j, x = np.empty(0, np.int32), np.empty(0, np.int64), np.empty(0)
    return Fronts(i, i, j, i, i, i, i, j, i, i, i, j, j, x, x, i, 0, *no_tasks())


def fronts_of(
    ordering: Ordering,
    first: Index32,
    second: Index32,
    d: int,
    whole: bool = False,
    threads: int = 1,
) -> Fronts:
    """Plan the fronts of contacts between disks, with d unknowns per disk.

    first, second: (k,) disks, second −1 for a wall
    whole: one stack for all, with room for whole squares, not only for upper halves
    threads: how many have stacks of their own"""
    n = len(ordering.order)
    node_first, node_end, parent = ordering.node_first, ordering.node_end, ordering.node_parent
    child, sibling = _children(parent)
    border_start, border = _borders(ordering, child, sibling)
    inner = _inner(node_first, node_end, child, sibling, border_start, border, n)
    place = ordering.place
    a = place[first]
    b = np.where(second >= 0, place[second], np.int32(-1))
    element_start, element, left, right = _elements(
        a, b, node_first, node_end, border_start, border, n
    )
    tasks = tasks_of(ordering, (border_start, border), (child, sibling), whole)
    pivots = d * (node_end - node_first).astype(np.int64)
    panel_start, update_start, fixed, stacks, widest = _storage(
        pivots, d * np.diff(border_start), parent, child, sibling, whole, tasks.end
    )
    shared = shared_by(threads, tasks, len(first), n, d)
    each = shared.control[0]
    return Fronts(
        node_first, node_end, border_start, border, inner, child, sibling, element_start, element,
        left, right, panel_start, update_start, _aligned(fixed + each * stacks),
        _aligned(each * widest), np.empty(each * widest, dtype=np.int32), stacks, tasks, shared,
    )  # fmt: skip


def _aligned(size: int) -> Any:
    """Room for so many numbers and seven more, at an address that is a multiple of 64 bytes: a
    vector is then in one line of the cache."""
    room = np.empty(size + 14)
    return room[-(room.ctypes.data // 8) % 8 :]


@kernel
def _children(parent: Any) -> Any:
    child = np.full(len(parent), -1, np.int32)
    sibling = np.full(len(parent), -1, np.int32)
    for s in range(len(parent)):
        if parent[s] >= 0:
            sibling[s] = child[parent[s]]
            child[parent[s]] = s
    return child, sibling


@kernel
def _borders(ordering: Any, child: Any, sibling: Any) -> Any:
    n, m = len(ordering.order), len(child)
    mark = np.full(n, -1, np.int32)
    border_start = np.zeros(m + 1, np.int64)
    border = np.empty(8 * n + 64, np.int32)
    for s in range(m):
        count = border_start[s]
        if count + n > len(border):
            more = np.empty(2 * len(border) + n, np.int32)
            more[:count] = border[:count]
            border = more
        end = ordering.node_end[s]
        for k in range(ordering.node_first[s], end):
            disk = ordering.order[k]
            for e in range(ordering.start[disk], ordering.start[disk + 1]):
                i = ordering.place[ordering.neighbour[e]]
                if i >= end and mark[i] != s:
                    mark[i] = s
                    border[count] = i
                    count += 1
        c = child[s]
        while c >= 0:
            for q in range(border_start[c], border_start[c + 1]):
                i = border[q]
                if i >= end and mark[i] != s:
                    mark[i] = s
                    border[count] = i
                    count += 1
            c = sibling[c]
        border[border_start[s] : count].sort()
        border_start[s + 1] = count
    return border_start, border[: border_start[m]].copy()


@inner
def _local(s: int, first: Any, end: Any, border_start: Any, border: Any, local: Any) -> None:
    for k in range(first[s], end[s]):
        local[k] = k - first[s]
    width = end[s] - first[s] - border_start[s]
    for q in range(border_start[s], border_start[s + 1]):
        local[border[q]] = width + q


@kernel
def _inner(
    first: Any, end: Any, child: Any, sibling: Any, border_start: Any, border: Any, n: int
) -> Any:
    local = np.empty(n, np.int32)
    inner = np.empty(len(border), np.int32)
    for s in range(len(first)):
        if child[s] < 0:
            continue
        _local(s, first, end, border_start, border, local)
        c = child[s]
        while c >= 0:
            for q in range(border_start[c], border_start[c + 1]):
                inner[q] = local[border[q]]
            c = sibling[c]
    return inner


@kernel
def _elements(a: Any, b: Any, first: Any, end: Any, border_start: Any, border: Any, n: int) -> Any:
    m, k = len(first), len(a)
    node = np.empty(n, np.int32)
    for s in range(m):
        node[first[s] : end[s]] = s
    start = np.zeros(m + 1, np.int64)
    for c in range(k):
        start[node[min(a[c], b[c]) if b[c] >= 0 else a[c]] + 1] += 1
    for s in range(m):
        start[s + 1] += start[s]
    at = start[:-1].copy()
    element, left, right = np.empty(k, np.int32), np.empty(k, np.int32), np.empty(k, np.int32)
    for c in range(k):
        s = node[min(a[c], b[c]) if b[c] >= 0 else a[c]]
        element[at[s]] = c
        at[s] += 1
    local = np.empty(n, np.int32)
    for s in range(m):
        if start[s + 1] == start[s]:
            continue
        _local(s, first, end, border_start, border, local)
        for e in range(start[s], start[s + 1]):
            c = element[e]
            left[e] = local[a[c]]
            right[e] = local[b[c]] if b[c] >= 0 else -1
    return start, element, left, right


@kernel
def _storage(
    pivots: Any, rest: Any, parent: Any, child: Any, sibling: Any, whole: bool, ends: Any
) -> Any:
    m = len(pivots)
    odd, size, stays = np.zeros(m, np.int64), np.empty(m, np.int64), np.zeros(m, np.bool_)
    for s in range(m - 1, -1, -1):
        if parent[s] >= 0:
            odd[s] = 1 - odd[parent[s]]
    if len(ends) > 1:
        stays[ends - 1] = True
    panel_start, update_start = np.zeros(m + 1, np.int64), np.zeros(m, np.int64)
    top, most, fixed = np.zeros(2, np.int64), np.zeros(2, np.int64), 0
    widest = 8
    for s in range(m):
        columns = 8 * (chunks(pivots[s]) + chunks(rest[s]))
        panel_start[s + 1] = panel_start[s] + height_of(pivots[s]) * columns
        widest = max(widest, columns)
        size[s] = update_size(rest[s])
        if whole:
            size[s] = max(size[s], 8 * chunks(rest[s] * rest[s]))
        here = odd[s]
        if stays[s]:
            update_start[s] = fixed
            fixed += size[s]
        else:
            update_start[s] = top[here]
            top[here] += size[s]
            most[here] = max(most[here], top[here])
        c = child[s]
        while c >= 0:
            if not stays[c]:
                top[1 - here] -= size[c]
            c = sibling[c]
    for s in range(m):
        update_start[s] += panel_start[m]
        if not stays[s]:
            update_start[s] += fixed + odd[s] * most[0]
    return panel_start, update_start, panel_start[m] + fixed, most[0] + most[1], widest
