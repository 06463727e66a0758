"""Dense elimination of the first rows of an unsymmetric matrix, with pivots from among these rows:
the arithmetic of a front."""

from __future__ import annotations

from typing import Any

import numpy as np

from nscd.compiling import inner

BLOCK = 8


@inner(fastmath=True, apart=True)
def eliminate(F: Any, swaps: Any, size: int, pivots: int) -> bool:
    """P A = L U on the first `pivots` rows and columns of F (size · size), in place: U and the
    strict lower L (unit diagonal), the Schur complement behind them. swaps (pivots,): the row that
    each pivot row was exchanged with. False where a pivot is zero or no number."""
    done = 0
    while done < pivots:
        block = min(BLOCK, pivots - done)
        end = done + block
        for q in range(done, end):
            at, largest = q, abs(F[q * size + q])
            for r in range(q + 1, pivots):
                value = abs(F[r * size + q])
                if value > largest:
                    at, largest = r, value
            if not (largest > 0.0 and largest < np.inf):
                return False
            swaps[q] = at
            if at != q:
                one, other = F[q * size : (q + 1) * size], F[at * size : (at + 1) * size]
                for j in range(size):
                    one[j], other[j] = other[j], one[j]
            inverse = 1.0 / F[q * size + q]
            for r in range(q + 1, size):
                factor = F[r * size + q] * inverse
                F[r * size + q] = factor
                if factor != 0.0:
                    for j in range(q + 1, end):
                        F[r * size + j] -= factor * F[q * size + j]
        for q in range(done + 1, end):
            row = F[q * size + end : (q + 1) * size]
            for p in range(done, q):
                factor, other = F[q * size + p], F[p * size + end : (p + 1) * size]
                for j in range(size - end):
                    row[j] -= factor * other[j]
        if block == BLOCK:
            _update_by_eight(F, size, done, end)
        else:
            _update_by_few(F, size, done, end)
        done = end
    return True


@inner(fastmath=True)
def _update_by_eight(F: Any, m: int, q: int, end: int) -> None:
    """Subtract from all later rows what the eight rows from q on leave to them, two at a time."""
    u0, u1 = F[q * m + end : (q + 1) * m], F[(q + 1) * m + end : (q + 2) * m]
    u2, u3 = F[(q + 2) * m + end : (q + 3) * m], F[(q + 3) * m + end : (q + 4) * m]
    u4, u5 = F[(q + 4) * m + end : (q + 5) * m], F[(q + 5) * m + end : (q + 6) * m]
    u6, u7 = F[(q + 6) * m + end : (q + 7) * m], F[(q + 7) * m + end : (q + 8) * m]
    r = end
    while r < m:
        pair = r + 1 < m
        a, b = r * m + q, (r + 1) * m + q
        a0, a1, a2, a3 = F[a], F[a + 1], F[a + 2], F[a + 3]
        a4, a5, a6, a7 = F[a + 4], F[a + 5], F[a + 6], F[a + 7]
        one = F[r * m + end : (r + 1) * m]
        if pair:
            b0, b1, b2, b3 = F[b], F[b + 1], F[b + 2], F[b + 3]
            b4, b5, b6, b7 = F[b + 4], F[b + 5], F[b + 6], F[b + 7]
            two = F[(r + 1) * m + end : (r + 2) * m]
            for j in range(m - end):
                x0, x1, x2, x3 = u0[j], u1[j], u2[j], u3[j]
                x4, x5, x6, x7 = u4[j], u5[j], u6[j], u7[j]
                one[j] -= (a0 * x0 + a1 * x1 + a2 * x2 + a3 * x3) + (
                    a4 * x4 + a5 * x5 + a6 * x6 + a7 * x7
                )
                two[j] -= (b0 * x0 + b1 * x1 + b2 * x2 + b3 * x3) + (
                    b4 * x4 + b5 * x5 + b6 * x6 + b7 * x7
                )
        else:
            for j in range(m - end):
                one[j] -= (a0 * u0[j] + a1 * u1[j] + a2 * u2[j] + a3 * u3[j]) + (
                    a4 * u4[j] + a5 * u5[j] + a6 * u6[j] + a7 * u7[j]
                )
        r += 2


@inner(fastmath=True)
def _update_by_few(F: Any, size: int, start: int, end: int) -> None:
    for r in range(end, size):
        row = F[r * size + end : (r + 1) * size]
        for q in range(start, end):
            factor, other = F[r * size + q], F[q * size + end : (q + 1) * size]
            for j in range(size - end):
                row[j] -= factor * other[j]


@inner(apart=True)
def solve_dense(A: Any, b: Any) -> bool:
    """b ← A⁻¹ b in place for a small matrix A (m · m), overwritten, whose rows may be of different
    size; False where it is singular."""
    m = len(b)
    for q in range(m):
        largest = 0.0
        for p in range(m):
            largest = max(largest, abs(A[q * m + p]))
        if not (largest > 0.0 and largest < np.inf):
            return False
        for p in range(m):
            A[q * m + p] /= largest
        b[q] /= largest
    swaps = np.empty(m, np.int32)
    if not eliminate(A, swaps, m, m):
        return False
    for q in range(m):
        other = swaps[q]
        b[q], b[other] = b[other], b[q]
    for q in range(m):
        for p in range(q):
            b[q] -= A[q * m + p] * b[p]
    for q in range(m - 1, -1, -1):
        for p in range(q + 1, m):
            b[q] -= A[q * m + p] * b[p]
        b[q] /= A[q * m + q]
    return True


@inner(fastmath=True)
def add_to(out: Any, factor: float, other: Any) -> None:
    """out += factor · other, of one shape."""
    one, two = out.reshape(-1), other.reshape(-1)
    for a in range(len(one)):
        one[a] += factor * two[a]


@inner
def put(out: Any, other: Any) -> None:
    """out ← other, of one shape."""
    one, two = out.reshape(-1), other.reshape(-1)
    for a in range(len(one)):
        one[a] = two[a]
