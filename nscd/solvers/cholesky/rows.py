"""Up-looking block Cholesky factorisation, row by row: the fastest for small crowds. Blocks of 2 a
disk.

Elimination tree and row structure: Davis, Direct Methods for Sparse Linear Systems (SIAM 2006),
chapter 4."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.arrays import Index32, Indices
from nscd.compiling import inner


class Rows(NamedTuple):
    """Hold the structure of A = L Lᵀ in blocks of 2 × 2, and their storage.

    a_start, a_column: (n+1,) and lower blocks of A by rows
    pair_block: (k,) the block that contact c adds to, −1 for a wall
    start, row: (n+1,) and L by columns
    row_start, column, slot: L by rows; slot is where each block lies by columns
    matrix, matrix_diagonal: A
    block, diagonal: (nnz,4) and (n,4), L, its diagonal inverted
    work: (n,4), zero between calls"""

    a_start: Indices
    a_column: Index32
    pair_block: Indices
    start: Indices
    row: Index32
    row_start: Indices
    column: Index32
    slot: Indices
    matrix: Any
    matrix_diagonal: Any
    block: Any
    diagonal: Any
    work: Any


@inner
def _structure(start: Any, neighbour: Any, order: Any, place: Any) -> Any:
    """Blocks of L: a row's columns are the paths in the elimination tree from its neighbours up to
    it."""
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
        # sorted by insertion: paths are short
        for q in range(1, count):
            i, p = path[q], q
            while p > 0 and path[p - 1] > i:
                path[p] = path[p - 1]
                p -= 1
            path[p] = i
        for q in range(count):
            i = path[q]
            column[row_start[k] + q] = i
            slot[row_start[k] + q] = at[i]
            row[at[i]] = k
            at[i] += 1
    return column_start, row, row_start, column, slot


@inner
def rows_of(ordering: Any, first: Any, second: Any) -> Any:
    """Plan the rows of contacts between disks.

    first, second: (k,) disks, second −1 for a wall"""
    place, n = ordering.place, len(ordering.order)
    start, row, row_start, column, slot = _structure(
        ordering.start, ordering.neighbour, ordering.order, place
    )
    a_start = np.zeros(n + 1, np.int64)
    for c in range(len(first)):
        if second[c] >= 0:
            a_start[max(place[first[c]], place[second[c]]) + 1] += 1
    for k in range(n):
        a_start[k + 1] += a_start[k]
    a_column, at = np.empty(a_start[n], np.int32), a_start[:-1].copy()
    pair_block = np.full(len(first), -1, np.int64)
    for c in range(len(first)):
        if second[c] >= 0:
            a, b = place[first[c]], place[second[c]]
            later = max(a, b)
            pair_block[c] = at[later]
            a_column[at[later]] = min(a, b)
            at[later] += 1
    return Rows(
        a_start, a_column, pair_block, start, row, row_start, column, slot,
        np.empty((len(a_column), 4)), np.empty((n, 4)), np.empty((len(row), 4)),
        np.empty((n, 4)), np.zeros((n, 4)),
    )  # fmt: skip


@inner(fastmath=True)
def _assemble(system: Any, rows: Any, theta: Any) -> None:
    """Put M + Cᵀ(Θ + K)C into `matrix` and `matrix_diagonal`."""
    A, B = rows.matrix, rows.matrix_diagonal
    A[:] = 0.0
    for i in range(len(B)):
        B[i, 0], B[i, 1], B[i, 3] = system.mass[i, 0], 0.0, system.mass[i, 1]
    for c in range(len(theta)):
        i, j = system.first[c], system.second[c]
        nx, ny = system.normal_first[c, 0], system.normal_first[c, 1]
        t = theta[c] + system.normal_weight[c]
        xx, xy, yy = t * nx * nx, t * nx * ny, t * ny * ny
        B[i, 0] += xx
        B[i, 1] += xy
        B[i, 3] += yy
        if j >= 0:
            B[j, 0] += xx
            B[j, 1] += xy
            B[j, 3] += yy
            p = rows.pair_block[c]
            A[p, 0] -= xx
            A[p, 1] -= xy
            A[p, 2] -= xy
            A[p, 3] -= yy


@inner(fastmath=True)
def factorise_rows(system: Any, rows: Any, theta: Any) -> bool:
    """Factorise M + Cᵀ(Θ + K)C for theta (k,) kg; False where rounding left it indefinite."""
    _assemble(system, rows, theta)
    n = len(system.mass)
    L, D, x, A, B = rows.block, rows.diagonal, rows.work, rows.matrix, rows.matrix_diagonal
    row, start = rows.row, rows.start
    for k in range(n):
        for p in range(rows.a_start[k], rows.a_start[k + 1]):
            i = rows.a_column[p]
            x[i, 0] += A[p, 0]
            x[i, 1] += A[p, 1]
            x[i, 2] += A[p, 2]
            x[i, 3] += A[p, 3]
        d0, d1, d2 = B[k, 0], B[k, 1], B[k, 3]
        for q in range(rows.row_start[k], rows.row_start[k + 1]):
            i = rows.column[q]
            x0, x1, x2, x3 = x[i, 0], x[i, 1], x[i, 2], x[i, 3]
            x[i, 0] = x[i, 1] = x[i, 2] = x[i, 3] = 0.0
            a, b, c = D[i, 0], D[i, 2], D[i, 3]
            l0, l2 = x0 * a, x2 * a
            l1, l3 = (x1 - l0 * b) * c, (x3 - l2 * b) * c
            s = rows.slot[q]
            for p in range(start[i], s):
                r = row[p]
                m0, m1, m2, m3 = L[p, 0], L[p, 1], L[p, 2], L[p, 3]
                x[r, 0] -= l0 * m0 + l1 * m1
                x[r, 1] -= l0 * m2 + l1 * m3
                x[r, 2] -= l2 * m0 + l3 * m1
                x[r, 3] -= l2 * m2 + l3 * m3
            L[s, 0], L[s, 1], L[s, 2], L[s, 3] = l0, l1, l2, l3
            d0 -= l0 * l0 + l1 * l1
            d1 -= l0 * l2 + l1 * l3
            d2 -= l2 * l2 + l3 * l3
        if not d0 > 0.0:
            x[:] = 0.0
            return False
        g = np.sqrt(d0)
        b = d1 / g
        rest = d2 - b * b
        if not rest > 0.0:
            x[:] = 0.0
            return False
        D[k, 0], D[k, 2], D[k, 3] = 1.0 / g, b, 1.0 / np.sqrt(rest)
    return True


@inner(fastmath=True)
def solve_rows(rows: Any, b: Any) -> None:
    """Solve b ← (L Lᵀ)⁻¹ b in place, (n,2)."""
    n = len(b)
    L, D, start, row = rows.block, rows.diagonal, rows.start, rows.row
    for k in range(n):
        y0 = b[k, 0] * D[k, 0]
        y1 = (b[k, 1] - D[k, 2] * y0) * D[k, 3]
        b[k, 0], b[k, 1] = y0, y1
        for p in range(start[k], start[k + 1]):
            r = row[p]
            b[r, 0] -= L[p, 0] * y0 + L[p, 1] * y1
            b[r, 1] -= L[p, 2] * y0 + L[p, 3] * y1
    for k in range(n - 1, -1, -1):
        y0, y1 = b[k, 0], b[k, 1]
        for p in range(start[k], start[k + 1]):
            r = row[p]
            y0 -= L[p, 0] * b[r, 0] + L[p, 2] * b[r, 1]
            y1 -= L[p, 1] * b[r, 0] + L[p, 3] * b[r, 1]
        y1 *= D[k, 3]
        b[k, 0], b[k, 1] = (y0 - D[k, 2] * y1) * D[k, 0], y1
