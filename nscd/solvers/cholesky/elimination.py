"""Dense elimination of the first rows of a symmetric matrix, in blocks: the arithmetic of a
front."""

from __future__ import annotations

from typing import Any

import numpy as np

from nscd.compiling import inner, kernel

# Fronts of this many rows no longer fit into a cache: PANEL rows are eliminated before the others
# are updated, by BLAS.
LARGE, PANEL, CHUNK = 600, 64, 64
# Work that this takes, in columns of the largest front.
COLUMNS = PANEL + CHUNK


@kernel(fastmath=True, apart=True)
def eliminate(P: Any, S: Any, work: Any, size: int, pivots: int) -> bool:
    """Eliminate the rows P (pivots, size) of a symmetric matrix whose other rows are S (upper
    halves).

    Lᵀ is left in P, the Schur complement in S; work (COLUMNS · size) is overwritten. Returns False
    where a pivot is not positive."""
    if size < LARGE:
        return bool(_eliminate_rows(P, S, size, np.int64(0), pivots, pivots, size))
    for first in range(0, pivots, PANEL):
        last = min(first + PANEL, pivots)
        if not _eliminate_rows(P, S, size, first, last, pivots, last):
            return False
        _update_by_many(P, S, work, size, pivots, first, last)
    return True


@inner(fastmath=True)
def _eliminate_rows(
    P: Any, S: Any, size: int, first: Any, last: int, pivots: int, end: int
) -> bool:
    """Eliminate rows first … last and update those up to `end`."""
    rest = size - pivots
    done = first
    while done < last:
        left = last - done
        block = 8 if left >= 8 else (4 if left >= 4 else (2 if left >= 2 else 1))
        if not _eliminate_block(P, size, done, block):
            return False
        U = P[done * size : (done + block) * size]
        done += block
        within = min(end, pivots)
        if block == 8:
            _update_by_eight(P, size, 0, U, size, done, within)
            _update_by_eight(S, rest, pivots, U, size, pivots, end)
        elif block == 4:
            _update_by_four(P, size, 0, U, size, done, within)
            _update_by_four(S, rest, pivots, U, size, pivots, end)
        else:
            _update_by_few(P, size, 0, U, block, size, done, within)
            _update_by_few(S, rest, pivots, U, block, size, pivots, end)
    return True


@inner(fastmath=True)
def _update_by_many(
    P: Any, S: Any, work: Any, size: int, pivots: int, first: int, last: int
) -> None:
    """Subtract what rows first … last leave to all later ones, CHUNK rows at a time."""
    count, after, rest = last - first, size - last, size - pivots
    columns = work[: after * count].reshape(after, count)
    for q in range(count):
        row = P[(first + q) * size + last : (first + q + 1) * size]
        for j in range(after):
            columns[j, q] = row[j]
    products = work[after * count :]
    for start in range(0, after, CHUNK):
        end = min(start + CHUNK, after)
        width = after - start
        product = products[: (end - start) * width].reshape(end - start, width)
        np.dot(columns[start:end], columns[start:].T, product)
        for i in range(start, end):
            t = last + i
            row = (
                P[t * size + t : (t + 1) * size]
                if t < pivots
                else S[(t - pivots) * (rest + 1) : (t - pivots + 1) * rest]
            )
            other = product[i - start, i - start :]
            for j in range(after - i):
                row[j] -= other[j]


@inner(fastmath=True)
def _eliminate_block(P: Any, size: int, done: int, block: int) -> bool:
    """Eliminate `block` (8, 4, 2 or 1) rows of P among themselves: halves, so that rows are passed
    less often."""
    if block == 1:
        value = P[done * size + done]
        if not value > 0.0:
            return False
        row = P[done * size + done : (done + 1) * size]
        inverse = 1.0 / np.sqrt(value)
        for j in range(size - done):
            row[j] *= inverse
        return True
    half = block // 2
    middle, end = done + half, done + block
    if half == 4:
        if not _eliminate_block_of_four(P, size, done):
            return False
        _update_by_four(P, size, 0, P[done * size : middle * size], size, middle, end)
        return bool(_eliminate_block_of_four(P, size, middle))
    if half == 2:
        return bool(_eliminate_block_of_four(P, size, done))
    return bool(_eliminate_pair(P, size, done))


@inner(fastmath=True)
def _eliminate_block_of_four(P: Any, size: int, done: int) -> bool:
    if not _eliminate_pair(P, size, done):
        return False
    _update_by_few(P, size, 0, P[done * size : (done + 2) * size], 2, size, done + 2, done + 4)
    return bool(_eliminate_pair(P, size, done + 2))


@inner(fastmath=True)
def _eliminate_pair(P: Any, size: int, q: int) -> bool:
    a, b, c = P[q * size + q], P[q * size + q + 1], P[(q + 1) * size + q + 1]
    if not a > 0.0:
        return False
    u = 1.0 / np.sqrt(a)
    e = b * u
    c -= e * e
    if not c > 0.0:
        return False
    v = 1.0 / np.sqrt(c)
    P[q * size + q] = a * u
    one, two = P[q * size + q + 1 : (q + 1) * size], P[(q + 1) * size + q + 1 : (q + 2) * size]
    for j in range(size - q - 1):
        x = one[j] * u
        one[j] = x
        two[j] = (two[j] - e * x) * v
    return True


# Slices, not indices: with them the inner loops become vector instructions (3 times faster). Two
# rows at a time halve the loads. F holds the rows from `shift` on, of which rows start … end are
# updated.
@inner(fastmath=True)
def _update_by_eight(F: Any, stride: int, shift: int, U: Any, m: int, start: int, end: int) -> None:
    t = start
    while t + 1 < end:
        a0, a1, a2, a3 = U[t], U[m + t], U[2 * m + t], U[3 * m + t]
        a4, a5, a6, a7 = U[4 * m + t], U[5 * m + t], U[6 * m + t], U[7 * m + t]
        s = t + 1
        b0, b1, b2, b3 = U[s], U[m + s], U[2 * m + s], U[3 * m + s]
        b4, b5, b6, b7 = U[4 * m + s], U[5 * m + s], U[6 * m + s], U[7 * m + s]
        at = (t - shift) * (stride + 1)
        F[at] -= a0 * a0 + a1 * a1 + a2 * a2 + a3 * a3 + a4 * a4 + a5 * a5 + a6 * a6 + a7 * a7
        one, two = F[at + 1 : at + m - t], F[at + stride + 1 : at + stride + m - t]
        u0, u1, u2, u3 = U[s:m], U[m + s : 2 * m], U[2 * m + s : 3 * m], U[3 * m + s : 4 * m]
        u4, u5, u6, u7 = (
            U[4 * m + s : 5 * m],
            U[5 * m + s : 6 * m],
            U[6 * m + s : 7 * m],
            U[7 * m + s : 8 * m],
        )
        for j in range(m - s):
            x0, x1, x2, x3, x4, x5, x6, x7 = u0[j], u1[j], u2[j], u3[j], u4[j], u5[j], u6[j], u7[j]
            one[j] -= (a0 * x0 + a1 * x1 + a2 * x2 + a3 * x3) + (
                a4 * x4 + a5 * x5 + a6 * x6 + a7 * x7
            )
            two[j] -= (b0 * x0 + b1 * x1 + b2 * x2 + b3 * x3) + (
                b4 * x4 + b5 * x5 + b6 * x6 + b7 * x7
            )
        t += 2
    if t < end:
        for q in range(8):
            factor, u = U[q * m + t], U[q * m + t : (q + 1) * m]
            at = (t - shift) * (stride + 1)
            row = F[at : at + m - t]
            for j in range(m - t):
                row[j] -= factor * u[j]


@inner(fastmath=True)
def _update_by_four(F: Any, stride: int, shift: int, U: Any, m: int, start: int, end: int) -> None:
    for t in range(start, end):
        a0, a1, a2, a3 = U[t], U[m + t], U[2 * m + t], U[3 * m + t]
        at = (t - shift) * (stride + 1)
        row = F[at : at + m - t]
        u0, u1, u2, u3 = U[t:m], U[m + t : 2 * m], U[2 * m + t : 3 * m], U[3 * m + t : 4 * m]
        for j in range(m - t):
            row[j] -= (a0 * u0[j] + a1 * u1[j]) + (a2 * u2[j] + a3 * u3[j])


@inner(fastmath=True)
def _update_by_few(
    F: Any, stride: int, shift: int, U: Any, count: int, m: int, start: int, end: int
) -> None:
    for t in range(start, end):
        at = (t - shift) * (stride + 1)
        row = F[at : at + m - t]
        if count == 2:
            a, b = U[t], U[m + t]
            u, v = U[t:m], U[m + t : 2 * m]
            for j in range(m - t):
                row[j] -= a * u[j] + b * v[j]
        else:
            a, u = U[t], U[t:m]
            for j in range(m - t):
                row[j] -= a * u[j]
