"""Order of elimination by geometric nested dissection of the contact graph, with its tree of
separators.

Cut the crowd in two near the median of its longer side, through as few disks as possible, eliminate
these last, and so on in both halves: George, SIAM J. Numer. Anal. 10 (1973) 345."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from nscd.arrays import Floats, Index32, Indices
from nscd.compiling import inner, kernel
from nscd.compiling.team import ALONE, Team
from nscd.friction.cholesky.separators import (
    CUT,
    LEFT,
    RIGHT,
    STRIP,
    cut_strip,
    room_for_paths,
    touches,
)

# A cut is sought among this share of the disks of a part on either side of the median, or that of so
# many layers, in parts of at least SMALL disks: a wider strip has smaller cuts, but less equal halves.
STRIP_SHARE, LAYERS, SMALL = 0.15, 10.0, 30


# A crowd of at least SHARED disks is cut into so many pieces, which then are cut at the same time.
SHARED, PIECES = 10000, 8


class Crowd(NamedTuple):
    """Hold what is cut: coordinates x, y (n,) m, the contact graph, the disks (n,) in the order of
    their parts, and room (n,) for the sides of a cut and for the disks of a part."""

    x: Any
    y: Any
    start: Any
    neighbour: Any
    nodes: Any
    side: Any
    part: Any


class Ordering(NamedTuple):
    """Hold an order of elimination and its separator tree.

    order: (n,) disk eliminated at each place
    place: (n,) its inverse
    start, neighbour: (n+1,) and the contact graph: see `contact_graph`
    node_first, node_end, node_parent: (m,) the places that each node of the separator tree
        eliminates, children before parents, and its parent, −1 at the root"""

    order: Index32
    place: Index32
    start: Indices
    neighbour: Index32
    node_first: Index32
    node_end: Index32
    node_parent: Index32


def dissect(
    position: Floats, first: Index32, second: Index32, leaf: int, team: Team = ALONE
) -> Ordering:
    """Order disks that touch by nested dissection.

    position: (n,2) m
    first, second: (k,) contacts, second −1 for a wall
    leaf: parts of up to so many disks are not cut further
    team: whose threads cut the pieces of a large crowd"""
    n = len(position)
    start, neighbour = contact_graph(n, first, second)
    x, y = np.ascontiguousarray(position[:, 0]), np.ascontiguousarray(position[:, 1])
    order, (side, part) = np.arange(n, dtype=np.int32), np.zeros((2, n), dtype=np.int32)
    crowd = Crowd(x, y, start, neighbour, order, side, part)
    *nodes, left = _dissect(crowd, 0, n, leaf, PIECES if n >= SHARED else 0)
    pieces = team.each(_dissect, [(crowd, low, high, leaf, 0) for low, high, _ in left])
    node_first, node_end, node_parent = _joined(nodes, left, pieces)
    # children first: by the last place, and where a separator is empty the inner part first
    rank = np.lexsort((-np.arange(len(node_end)), node_end))
    new = np.empty(len(rank), dtype=np.int32)
    new[rank] = np.arange(len(rank), dtype=np.int32)
    parent = node_parent[rank]
    parent = np.where(parent >= 0, new[parent], np.int32(-1))
    place = np.empty_like(order)
    place[order] = np.arange(n, dtype=np.int32)
    return Ordering(order, place, start, neighbour, node_first[rank], node_end[rank], parent)


@kernel
def contact_graph(n: int, first: Any, second: Any) -> Any:
    """List the neighbours of each disk a: neighbour[start[a] : start[a + 1]]."""
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


@inner
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


def _joined(nodes: Any, left: Any, pieces: list[Any]) -> Any:
    """The nodes of the whole, and then those of each piece."""
    first, end, parent = [nodes[0]], [nodes[1]], [nodes[2]]
    count = len(nodes[0])
    for (_, _, above), found in zip(left, pieces, strict=True):
        first.append(found[0])
        end.append(found[1])
        inner = found[2] + np.int32(count)
        inner[0] = above
        parent.append(inner)
        count += len(found[0])
    return np.concatenate(first), np.concatenate(end), np.concatenate(parent)


@kernel(nogil=True)
def _dissect(crowd: Any, low: int, high: int, leaf: int, pieces: int) -> Any:
    """Cut part low … high of a crowd, into so many pieces only where that is not 0: first and end of
    its nodes, and their parents, −1 at the root; and the pieces that are left, with their parents."""
    x, y, start, neighbour, nodes, side, part = crowd
    paths, most = room_for_paths(len(x)), 2 * (high - low) + 2
    node_first, node_end = np.empty(most, np.int32), np.empty(most, np.int32)
    node_parent = np.empty(most, np.int32)
    count = 0
    stack = [(low, high, -1)]
    while len(stack) > 0 and (pieces == 0 or len(stack) < pieces):
        at = len(stack) - 1
        if pieces > 0:  # the largest one
            for q in range(at):
                if stack[q][1] - stack[q][0] > stack[at][1] - stack[at][0]:
                    at = q
        low, high, parent = stack.pop(at)
        me = count
        count += 1
        node_parent[me], node_first[me], node_end[me] = parent, low, high
        if high - low <= leaf:
            continue
        some = nodes[low:high]
        wide = x[some].max() - x[some].min() > y[some].max() - y[some].min()
        across, along = (x, y) if wide else (y, x)
        _cut(nodes, low, high, across, along, side, start, neighbour, paths)
        one, two = _arrange(some, along, side, part[low:high])
        node_first[me] = low + two
        if one > 0:
            stack.append((low, low + one, me))
        if two > one:
            stack.append((low + one, low + two, me))
    left = np.empty((len(stack), 3), np.int64)
    for q in range(len(stack)):
        left[q, 0], left[q, 1], left[q, 2] = stack[q]
    return node_first[:count].copy(), node_end[:count].copy(), node_parent[:count].copy(), left


@inner
def _cut(
    nodes: Any, low: int, high: int, across: Any, along: Any, side: Any, start: Any, neighbour: Any,
    paths: Any,
) -> None:  # fmt: skip
    """Tell for each disk of a part on which side of the cut it lies: the smallest cut in a strip
    around the median; in a small part, or where disks reach across the strip, the shorter rim of
    one half."""
    count, middle = high - low, (low + high) // 2
    if count >= SMALL:
        share = min(STRIP_SHARE, LAYERS / math.sqrt(count))
        one, two = low + int((0.5 - share) * count), low + int((0.5 + share) * count)
        _divide(nodes, across, low, high, one)
        _divide(nodes, across, one, high, two)
        for q in range(low, high):
            side[nodes[q]] = LEFT if q < one else STRIP if q < two else RIGHT
        reach = False
        for q in range(low, one):
            reach = reach or touches(nodes[q], RIGHT, side, start, neighbour)
        if not reach:
            cut_strip(nodes[one:two], across, along, side, start, neighbour, paths)
            return
    _divide(nodes, across, low, high, middle)
    for q in range(low, high):
        side[nodes[q]] = LEFT if q < middle else RIGHT
    left = right = 0
    for q in range(low, middle):
        left += touches(nodes[q], RIGHT, side, start, neighbour)
    for q in range(middle, high):
        right += touches(nodes[q], LEFT, side, start, neighbour)
    rim, rest = (LEFT, RIGHT) if left <= right else (RIGHT, LEFT)
    for q in range(low, high):
        if side[nodes[q]] == rim and touches(nodes[q], rest, side, start, neighbour):
            side[nodes[q]] = CUT


@inner
def _arrange(nodes: Any, along: Any, side: Any, part: Any) -> Any:
    """Reorder the disks of a part: left, right, cut; and where the second and the third begin."""
    size = one = two = 0
    for which in (LEFT, RIGHT, CUT):
        one, two = two, size
        for a in nodes:
            if side[a] == which:
                part[size] = a
                size += 1
    # along the cut, so that what a part leaves to its separators are whole runs of them
    cut = part[two:size].copy()
    part[two:size] = cut[np.argsort(along[cut])]
    nodes[:] = part[:size]
    for a in nodes:
        side[a] = 0
    return one, two
