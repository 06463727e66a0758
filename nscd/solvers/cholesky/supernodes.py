"""Which disks are eliminated together: neighbours in the elimination tree, where one dense front
takes less time than two.

Ashcraft & Grimes, ACM Trans. Math. Softw. 15 (1989) 291."""

from __future__ import annotations

from typing import Any

import numpy as np

from nscd.compiling import inner
from nscd.solvers.cholesky.dissection import Ordering
from nscd.solvers.cholesky.elimination import chunks, height_of, update_size
from nscd.solvers.cholesky.minimum_degree import elimination_tree

# Nanoseconds, found by measuring: of a front, of four of its rows, of a number in its panel and in
# its update, and of a product.
FRONT, FOUR_ROWS, PANEL_NUMBER, UPDATE_NUMBER, PRODUCT = 100.0, 25.0, 1.0, 0.4, 0.04


@inner
def _cost(pivots: int, rest: int, d: int) -> float:
    """Nanoseconds that a front of some disks takes in a factorisation and its solutions."""
    p, r = d * pivots, d * rest
    height, wide, more = height_of(p), chunks(p), chunks(r)
    products = 0.0
    for q in range(0, height, 4):
        products += 32.0 * q * (wide - (q >> 3) + more)
    products += 32.0 * p * more * (more + 1)
    cost: float = (
        FRONT
        + FOUR_ROWS * 0.25 * height
        + PANEL_NUMBER * height * 8 * (wide + more)
        + UPDATE_NUMBER * update_size(r)
        + PRODUCT * products
    )
    return cost


@inner
def _tree(order: Any, place: Any, start: Any, neighbour: Any) -> Any:
    """The parent (n,) of each place in the elimination tree, and how many later ones it reaches."""
    n = len(order)
    parent = elimination_tree(order, place, start, neighbour)
    mark, count = np.full(n, -1, np.int32), np.zeros(n, np.int32)
    for k in range(n):
        mark[k] = k
        for e in range(start[order[k]], start[order[k] + 1]):
            i = place[neighbour[e]]
            while i < k and mark[i] != k:
                mark[i] = k
                count[i] += 1
                i = parent[i]
    return parent, count


@inner
def _merge(parent: Any, rest: Any, d: int) -> Any:
    """The last place (n,) of the node of each place: children join their parents, the one that
    saves most first."""
    n = len(parent)
    pivots, node = np.ones(n, np.int32), np.arange(n).astype(np.int32)
    child, sibling = np.full(n, -1, np.int32), np.full(n, -1, np.int32)
    cost = np.empty(n)
    for s in range(n):
        cost[s] = _cost(1, rest[s], d)
        while True:
            most, best = 0.0, -1
            c = child[s]
            while c >= 0:
                if node[c] == c:
                    saved = cost[c] + cost[s] - _cost(pivots[c] + pivots[s], rest[s], d)
                    if saved > most:
                        most, best = saved, c
                c = sibling[c]
            if best < 0:
                break
            node[best] = s
            pivots[s] += pivots[best]
            cost[s] = _cost(pivots[s], rest[s], d)
        if parent[s] >= 0:
            sibling[s] = child[parent[s]]
            child[parent[s]] = s
    for s in range(n - 1, -1, -1):
        node[s] = node[node[s]]
    return node


@inner
def in_supernodes(ordering: Any, d: int) -> Any:
    """Put disks that are eliminated together next to each other, with d unknowns each: an order
    with the same fill but for what the larger fronts add, and its tree of nodes."""
    n = len(ordering.order)
    parent, rest = _tree(ordering.order, ordering.place, ordering.start, ordering.neighbour)
    node = _merge(parent, rest, d)
    members = np.zeros(n, np.int32)
    for s in range(n):
        members[node[s]] += 1
    # children before parents: nodes from the last place on, each before what it reaches
    child, sibling, roots = np.full(n, -1, np.int32), np.full(n, -1, np.int32), 0
    stack, count = np.empty(n, np.int32), 0
    for s in range(n):
        if members[s] > 0:
            count += 1
            if parent[s] >= 0:
                to = node[parent[s]]
                sibling[s] = child[to]
                child[to] = s
            else:
                stack[roots] = s
                roots += 1
    first, end = np.empty(count, np.int32), np.empty(count, np.int32)
    above, number = np.full(count, -1, np.int32), np.empty(n, np.int32)
    top, left = roots, n
    while top > 0:
        top -= 1
        s = stack[top]
        count -= 1
        end[count] = left
        left -= members[s]
        first[count], number[s] = left, count
        if parent[s] >= 0:
            above[count] = number[node[parent[s]]]
        c = child[s]
        while c >= 0:
            stack[top] = c
            top += 1
            c = sibling[c]
    order, place = np.empty_like(ordering.order), np.empty_like(ordering.place)
    at = first.copy()
    for s in range(n):
        q = number[node[s]]
        order[at[q]] = ordering.order[s]
        place[ordering.order[s]] = at[q]
        at[q] += 1
    return Ordering(order, place, ordering.start, ordering.neighbour, first, end, above)
