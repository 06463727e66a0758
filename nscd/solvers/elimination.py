"""Order and structure of a sparse Cholesky factor over the contact graph: found once, used at every iteration.

Unknowns are blocks, one a disk. The order is geometric nested dissection: cut the crowd in two at the median of its
longer side, eliminate the disks at the cut last, and so on in both halves. George, SIAM J. Numer. Anal. 10 (1973) 345;
elimination tree and row structure: Davis, Direct Methods for Sparse Linear Systems (SIAM 2006), chapter 4.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from nscd.bodies import Floats

LEAF = 6

Ints = NDArray[np.int32]
Longs = NDArray[np.int64]


class Elimination(NamedTuple):
    """Structure of A = L Lᵀ in blocks, rows and columns in elimination order.

    order (n,): disk eliminated at each place; place (n,): its inverse. Lower blocks of A by rows: a_start (n+1,), a_column.
    L by columns: start (n+1,), row; by rows: row_start (n+1,), column, and slot, where each block lies by columns.
    pair_block (k,): the block of A that contact c adds to, −1 for a wall.
    """

    order: Ints
    place: Ints
    a_start: Longs
    a_column: Ints
    start: Longs
    row: Ints
    row_start: Longs
    column: Ints
    slot: Longs
    pair_block: Longs


def eliminate(position: Floats, first: Ints, second: Ints) -> Elimination:
    """Order and structure for disks at position (n,2) m that touch: contacts first (k,), second (k,), −1 for a wall."""
    n = len(position)
    start, neighbour = _graph(n, first, second)
    order = _dissect(
        np.ascontiguousarray(position[:, 0]), np.ascontiguousarray(position[:, 1]), start, neighbour
    )
    place = _inverse(order)
    order = order[_postorder(_tree(start, neighbour, order, place))]
    place = _inverse(order)
    parent = _tree(start, neighbour, order, place)
    column_start, row, row_start, column, slot = _structure(start, neighbour, order, place, parent)

    pairs = np.flatnonzero(second >= 0)
    a, b = place[first[pairs]], place[second[pairs]]
    key = np.maximum(a, b).astype(np.int64) * n + np.minimum(a, b)
    blocks, which = np.unique(key, return_inverse=True)
    pair_block = np.full(len(first), -1, dtype=np.int64)
    pair_block[pairs] = which
    a_start = np.concatenate([[0], np.cumsum(np.bincount(blocks // n, minlength=n))]).astype(np.int64)
    a_column = (blocks % n).astype(np.int32)
    return Elimination(
        order, place, a_start, a_column, column_start, row, row_start, column, slot, pair_block
    )


def _inverse(order: Ints) -> Ints:
    place = np.empty_like(order)
    place[order] = np.arange(len(order), dtype=order.dtype)
    return place


@njit(cache=True)
def _graph(n: int, first: Any, second: Any) -> Any:
    start = np.zeros(n + 1, np.int64)
    for c in range(len(first)):
        if second[c] >= 0:
            start[first[c] + 1] += 1
            start[second[c] + 1] += 1
    for a in range(n):
        start[a + 1] += start[a]
    neighbour = np.empty(start[n], np.int32)
    at = start[:-1].copy()
    for c in range(len(first)):
        a, b = first[c], second[c]
        if b >= 0:
            neighbour[at[a]] = b
            neighbour[at[b]] = a
            at[a] += 1
            at[b] += 1
    return start, neighbour


@njit(cache=True)
def _divide(nodes: Any, key: Any, low: int, high: int, middle: int) -> None:
    """Hoare's selection: nodes[low:middle] have keys up to those of nodes[middle:high]."""
    while high - low > 1:
        a, b, c = key[nodes[low]], key[nodes[(low + high) // 2]], key[nodes[high - 1]]
        pivot = max(min(a, b), min(max(a, b), c))
        x, y = low, high - 1
        while x <= y:
            while key[nodes[x]] < pivot:
                x += 1
            while key[nodes[y]] > pivot:
                y -= 1
            if x <= y:
                nodes[x], nodes[y] = nodes[y], nodes[x]
                x += 1
                y -= 1
        if middle <= y:
            high = y + 1
        elif middle >= x:
            low = x
        else:
            return


@njit(cache=True)
def _at_cut(a: int, side: Any, other: int, start: Any, neighbour: Any) -> bool:
    for e in range(start[a], start[a + 1]):  # noqa: SIM110  (any() over a generator does not compile)
        if side[neighbour[e]] == other:
            return True
    return False


@njit(cache=True)
def _dissect(x: Any, y: Any, start: Any, neighbour: Any) -> Any:
    n = len(x)
    nodes = np.arange(n).astype(np.int32)
    side = np.zeros(n, np.int32)
    part = np.empty(n, np.int32)
    stack = [(0, n)]
    stamp = 0
    while len(stack) > 0:
        low, high = stack.pop()
        if high - low <= LEAF:
            continue
        some = nodes[low:high]
        middle = (low + high) // 2
        if x[some].max() - x[some].min() > y[some].max() - y[some].min():
            _divide(nodes, x, low, high, middle)
        else:
            _divide(nodes, y, low, high, middle)
        stamp += 2
        for q in range(low, high):
            side[nodes[q]] = stamp if q < middle else stamp + 1
        left_cut = right_cut = 0
        for q in range(low, high):
            other = stamp + 1 if q < middle else stamp
            if _at_cut(nodes[q], side, other, start, neighbour):
                if q < middle:
                    left_cut += 1
                else:
                    right_cut += 1
        # the separator is the shorter of the two rims
        rim, rest = (stamp, stamp + 1) if left_cut <= right_cut else (stamp + 1, stamp)
        count = 0
        for q in range(low, high):
            a = nodes[q]
            if side[a] == rim and not _at_cut(a, side, rest, start, neighbour):
                part[count] = a
                count += 1
        one = count
        for q in range(low, high):
            a = nodes[q]
            if side[a] == rest:
                part[count] = a
                count += 1
        two = count
        for q in range(low, high):
            a = nodes[q]
            if side[a] == rim and _at_cut(a, side, rest, start, neighbour):
                part[count] = a
                count += 1
        nodes[low:high] = part[:count]
        for q in range(low, high):
            side[nodes[q]] = 0
        stack.append((low, low + one))
        stack.append((low + one, low + two))
    return nodes


@njit(cache=True)
def _tree(start: Any, neighbour: Any, order: Any, place: Any) -> Any:
    """Parent of each place in the elimination tree, −1 at a root (Liu's algorithm)."""
    n = len(order)
    parent = np.full(n, -1, np.int32)
    ancestor = np.full(n, -1, np.int32)
    for k in range(n):
        for e in range(start[order[k]], start[order[k] + 1]):
            i = place[neighbour[e]]
            while i != -1 and i < k:
                following = ancestor[i]
                ancestor[i] = k
                if following == -1:
                    parent[i] = k
                i = following
    return parent


@njit(cache=True)
def _postorder(parent: Any) -> Any:
    n = len(parent)
    child = np.full(n, -1, np.int32)
    sibling = np.full(n, -1, np.int32)
    for k in range(n - 1, -1, -1):
        if parent[k] >= 0:
            sibling[k] = child[parent[k]]
            child[parent[k]] = k
    post = np.empty(n, np.int32)
    stack = np.empty(n, np.int32)
    count = 0
    for root in range(n):
        if parent[root] != -1:
            continue
        top = 0
        stack[0] = root
        while top >= 0:
            node = stack[top]
            if child[node] == -1:
                post[count] = node
                count += 1
                top -= 1
            else:
                top += 1
                stack[top] = child[node]
                child[node] = sibling[child[node]]
    return post


@njit(cache=True)
def _structure(start: Any, neighbour: Any, order: Any, place: Any, parent: Any) -> Any:
    """Blocks of L: a row's columns are the paths in the tree from its neighbours up to it."""
    n = len(order)
    mark = np.full(n, -1, np.int32)
    column_start = np.zeros(n + 1, np.int64)
    row_start = np.zeros(n + 1, np.int64)
    for k in range(n):
        mark[k] = k
        for e in range(start[order[k]], start[order[k] + 1]):
            i = place[neighbour[e]]
            while i < k and mark[i] != k:
                mark[i] = k
                column_start[i + 1] += 1
                row_start[k + 1] += 1
                i = parent[i]
    for k in range(n):
        column_start[k + 1] += column_start[k]
        row_start[k + 1] += row_start[k]
    row = np.empty(column_start[n], np.int32)
    column = np.empty(column_start[n], np.int32)
    slot = np.empty(column_start[n], np.int64)
    at = column_start[:-1].copy()
    path = np.empty(n, np.int32)
    mark[:] = -1
    for k in range(n):
        mark[k] = k
        count = 0
        for e in range(start[order[k]], start[order[k] + 1]):
            i = place[neighbour[e]]
            while i < k and mark[i] != k:
                mark[i] = k
                path[count] = i
                count += 1
                i = parent[i]
        path[:count].sort()
        for q in range(count):
            i = path[q]
            column[row_start[k] + q] = i
            slot[row_start[k] + q] = at[i]
            row[at[i]] = k
            at[i] += 1
    return column_start, row, row_start, column, slot
