"""Order of elimination by minimum degree: less fill than dissection in small crowds."""

from __future__ import annotations

from typing import Any

import numpy as np

from nscd.compiling import inner
from nscd.solvers.cholesky.dissection import Ordering, contact_graph


@inner
def _ones(x: Any) -> Any:
    """How many bits of a word are set."""
    x = x - ((x >> np.uint64(1)) & np.uint64(0x5555555555555555))
    x = (x & np.uint64(0x3333333333333333)) + ((x >> np.uint64(2)) & np.uint64(0x3333333333333333))
    x = (x + (x >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((x * np.uint64(0x0101010101010101)) >> np.uint64(56))


@inner
def _neighbours(start: Any, neighbour: Any) -> Any:
    """The neighbours of each disk as bits (n, n/64), and how many there are (n,)."""
    n = len(start) - 1
    bits, degree = np.zeros((n, (n + 63) // 64), np.uint64), np.zeros(n, np.int64)
    for a in range(n):
        for e in range(start[a], start[a + 1]):
            b = neighbour[e]
            bits[a, b >> 6] |= np.uint64(1) << np.uint64(b & 63)
        for w in range(bits.shape[1]):
            degree[a] += _ones(bits[a, w])
    return bits, degree


@inner
def _eliminate(start: Any, neighbour: Any) -> Any:
    bits, degree = _neighbours(start, neighbour)
    n, words = bits.shape
    one = np.uint64(1)
    # disks of each degree, as doubly linked lists
    head = np.full(n + 1, -1, np.int32)
    after, before = np.full(n, -1, np.int32), np.full(n, -1, np.int32)
    for a in range(n - 1, -1, -1):
        after[a] = head[degree[a]]
        if after[a] >= 0:
            before[after[a]] = a
        head[degree[a]] = a
    order, reach = np.empty(n, np.int32), np.empty(n, np.int32)
    lowest = 0
    for k in range(n):
        while head[lowest] < 0:
            lowest += 1
        v = head[lowest]
        head[lowest] = after[v]
        if after[v] >= 0:
            before[after[v]] = -1
        order[k] = v
        count = 0
        for w in range(words):
            x = bits[v, w]
            while x != np.uint64(0):
                bit = x & (~x + one)
                reach[count] = w * 64 + _ones(bit - one)
                count += 1
                x ^= bit
        for q in range(count):
            u = reach[q]
            if before[u] >= 0:
                after[before[u]] = after[u]
            else:
                head[degree[u]] = after[u]
            if after[u] >= 0:
                before[after[u]] = before[u]
            bits[u, v >> 6] &= ~(one << np.uint64(v & 63))
            new = 0
            for w in range(words):
                x = bits[u, w] | bits[v, w]
                if w == u >> 6:
                    x &= ~(one << np.uint64(u & 63))
                bits[u, w] = x
                new += _ones(x)
            degree[u] = new
            after[u], before[u] = head[new], -1
            if head[new] >= 0:
                before[head[new]] = u
            head[new] = u
            lowest = min(lowest, new)
    return order


@inner
def minimum_degree(n: int, first: Any, second: Any) -> Any:
    """Eliminate a disk with the fewest neighbours, which become neighbours of each other, and so
    on.

    first, second: (k,) contacts of n disks, second −1 for a wall

    Neighbours are kept as bits, n²/8 bytes: for crowds of up to some thousands. George & Liu, SIAM
    Review 31 (1989) 1. The separator tree is left empty."""
    start, neighbour = contact_graph(n, first, second)
    order = _eliminate(start, neighbour)
    place = np.empty_like(order)
    for k in range(n):
        place[order[k]] = k
    none = np.empty(0, np.int32)
    return Ordering(order, place, start, neighbour, none, none, none)
