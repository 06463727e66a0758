"""Multifrontal LU factorisation of the matrix of contacts that stick and slide: three unknowns a
disk.

Fronts and order are those of the frictionless crowd (`nscd.friction.cholesky`); a sliding contact
presses along n ± μt but resists only along n, so the matrix is not symmetric, and pivots are
taken from within a front. Duff & Reid, SIAM J. Sci. Stat. Comput. 5 (1984) 633."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.compiling import inner, kernel
from nscd.friction.cholesky.dissection import dissect
from nscd.friction.cholesky.fronts import Fronts, fronts_of
from nscd.friction.elimination import eliminate

LEAF = 8


class Factor(NamedTuple):
    """fronts: structure, and storage of the symmetric factor; store: from upper_start (m+1,) on the
    rows of U with L among them, then L of the border by rows; stack: Schur complements, as in
    `Fronts`; front: the front at work; swaps (3n,): the row each pivot row was exchanged with."""

    fronts: Fronts
    upper_start: Any
    store: Any
    stack: Any
    front: Any
    swaps: Any


def factor_of(position: Any, first: Any, second: Any) -> tuple[Any, Any, Factor]:
    """The order of elimination (n,) of disks at position (n,2) m with contacts first, second (k,),
    an order of the contacts (k,) that goes with it, and storage for factors in these orders."""
    ordering = dissect(position, first, second, LEAF)
    contact = np.argsort(ordering.place[first], kind="stable")
    fronts = fronts_of(ordering, first[contact], second[contact], 3, whole=True)
    pivots = 3 * (fronts.end - fronts.first).astype(np.int64)
    rest = 3 * np.diff(fronts.border_start)
    upper_start = np.concatenate([[0], np.cumsum(pivots * (pivots + 2 * rest))]).astype(np.int64)
    widest = int((pivots + rest).max(initial=1))
    factor = Factor(
        fronts=fronts,
        upper_start=upper_start,
        store=np.empty(int(upper_start[-1])),
        stack=np.empty(len(fronts.store) - int(fronts.panel_start[len(fronts.first)])),
        front=np.empty(widest * widest),
        swaps=np.empty(3 * len(position), dtype=np.int32),
    )
    return ordering.order, contact, factor


@kernel(fastmath=True, apart=True)
def factorise(problem: Any, factor: Any, weight: Any) -> bool:
    """Factorise M + Σ α n nᵀ + β t tᵀ + γ t nᵀ + δ n tᵀ, weight = (α, β, γ, δ) (4,k) kg, rows n and
    t of C and T; False where rounding left it singular. Contacts as when the factor was made."""
    fronts, F, stack = factor.fronts, factor.front, factor.stack
    base = fronts.panel_start[len(fronts.first)]
    for node in range(len(fronts.first)):
        first, end = fronts.first[node], fronts.end[node]
        b0, b1 = fronts.border_start[node], fronts.border_start[node + 1]
        pivots, rest = 3 * (end - first), 3 * (b1 - b0)
        size = pivots + rest
        F[: size * size] = 0.0
        for k in range(end - first):
            for a in range(3):
                F[(3 * k + a) * (size + 1)] = problem.mass[first + k, a]
        for e in range(fronts.element_start[node], fronts.element_start[node + 1]):
            c = fronts.element[e]
            if weight[0, c] != 0.0 or weight[1, c] != 0.0:
                i, j = 3 * fronts.left[e], 3 * fronts.right[e]
                _add_contact(problem, c, weight, F, size, i, j)
        child = fronts.child[node]
        while child >= 0:
            inner = fronts.inner[fronts.border_start[child] : fronts.border_start[child + 1]]
            _add_child(F, size, stack, fronts.update_start[child] - base, inner, fronts.run)
            child = fronts.sibling[child]
        if not eliminate(F, factor.swaps[3 * first :], size, pivots):
            return False
        at = factor.upper_start[node]
        factor.store[at : at + pivots * size] = F[: pivots * size]
        at += pivots * size
        update = fronts.update_start[node] - base
        for r in range(rest):
            row = (pivots + r) * size
            factor.store[at + r * pivots : at + (r + 1) * pivots] = F[row : row + pivots]
            stack[update + r * rest : update + (r + 1) * rest] = F[row + pivots : row + size]
    return True


@inner(fastmath=True)
def _add_contact(problem: Any, c: int, weight: Any, F: Any, size: int, i: int, j: int) -> None:
    """Add the blocks of a contact at rows i and j (negative: a wall)."""
    alpha, beta, gamma, delta = weight[0, c], weight[1, c], weight[2, c], weight[3, c]
    nx, ny = problem.normal[c, 0], problem.normal[c, 1]
    for p in range(2):
        row, sign_row = (i, 1.0) if p == 0 else (j, -1.0)
        if row < 0:
            continue
        lever_row = problem.lever[c, p]
        for q in range(2):
            column, sign = (i, 1.0) if q == 0 else (j, -1.0)
            if column < 0:
                continue
            lever = problem.lever[c, q]
            mx, my = sign * nx, sign * ny  # the row n of the column's disk
            tx, ty = -my, mx
            ax, ay = alpha * mx + delta * tx, alpha * my + delta * ty  # along n of the row's disk
            az = delta * lever
            bx = beta * tx + gamma * mx  # along t of the row's disk
            by = beta * ty + gamma * my
            bz = beta * lever
            ux, uy = sign_row * nx, sign_row * ny
            at = row * size + column
            F[at] += ux * ax - uy * bx
            F[at + 1] += ux * ay - uy * by
            F[at + 2] += ux * az - uy * bz
            at += size
            F[at] += uy * ax + ux * bx
            F[at + 1] += uy * ay + ux * by
            F[at + 2] += uy * az + ux * bz
            at += size
            F[at] += lever_row * bx
            F[at + 1] += lever_row * by
            F[at + 2] += lever_row * bz


@inner(fastmath=True)
def _add_child(F: Any, size: int, stack: Any, source: int, inner: Any, run: Any) -> None:
    """Add a child's Schur complement at the places `inner` of its disks, neighbouring places
    together."""
    count = len(inner)
    rows = 3 * count
    for i in range(count - 1, -1, -1):
        run[i] = run[i + 1] if i + 1 < count and inner[i + 1] == inner[i] + 1 else i + 1
    for i in range(count):
        for a in range(3):
            row = (inner[i] * 3 + a) * size
            given = source + (i * 3 + a) * rows
            j = 0
            while j < count:
                end = run[j]
                length = 3 * (end - j)
                at = row + 3 * inner[j]
                part, other = F[at : at + length], stack[given + 3 * j : given + 3 * end]
                for x in range(length):
                    part[x] += other[x]
                j = end


@kernel
def solve_factorised(factor: Any, b: Any) -> None:
    """b ← A⁻¹ b in place, (n,3)."""
    solve_two(factor, b, np.zeros_like(b))  # reading the factor takes the time: a tenth more


@kernel(fastmath=True, apart=True)
def solve_two(factor: Any, one: Any, two: Any) -> None:
    """one ← A⁻¹ one and two ← A⁻¹ two in place, (n,3) each: what is read of the factor is read once
    for both."""
    a, b = one.reshape(-1), two.reshape(-1)
    _forward_two(factor, a, b)
    _back_two(factor, a, b)


@inner(fastmath=True)
def _forward_two(factor: Any, a: Any, b: Any) -> None:
    """Both ← L⁻¹ P both, (3n,) each."""
    fronts, store = factor.fronts, factor.store
    for node in range(len(fronts.first)):
        base, b0 = 3 * fronts.first[node], fronts.border_start[node]
        pivots = 3 * fronts.end[node] - base
        count = fronts.border_start[node + 1] - b0
        size = pivots + 3 * count
        at = factor.upper_start[node]
        x, y = a[base : base + pivots], b[base : base + pivots]
        idle = True
        for q in range(pivots):
            if x[q] != 0.0 or y[q] != 0.0:
                idle = False
                break
        if idle:
            continue
        for q in range(pivots):
            p = factor.swaps[base + q]
            if p != q:
                x[q], x[p] = x[p], x[q]
                y[q], y[p] = y[p], y[q]
        for q in range(1, pivots):
            row = store[at + q * size : at + q * size + q]
            value = other = 0.0
            for j in range(q):
                value += row[j] * x[j]
                other += row[j] * y[j]
            x[q] -= value
            y[q] -= other
        at += pivots * size
        for r in range(count):
            to = 3 * fronts.border[b0 + r]
            for c in range(3):
                row = store[at : at + pivots]
                value = other = 0.0
                for j in range(pivots):
                    value += row[j] * x[j]
                    other += row[j] * y[j]
                a[to + c] -= value
                b[to + c] -= other
                at += pivots


@inner(fastmath=True)
def _back_two(factor: Any, a: Any, b: Any) -> None:
    """Both ← U⁻¹ both, (3n,) each."""
    fronts, store = factor.fronts, factor.store
    half = len(factor.front) // 2
    work, other_work = factor.front[:half], factor.front[half:]
    for node in range(len(fronts.first) - 1, -1, -1):
        base, b0 = 3 * fronts.first[node], fronts.border_start[node]
        pivots = 3 * fronts.end[node] - base
        count = fronts.border_start[node + 1] - b0
        size = pivots + 3 * count
        at = factor.upper_start[node]
        for r in range(count):
            to = 3 * fronts.border[b0 + r]
            for c in range(3):
                work[pivots + 3 * r + c] = a[to + c]
                other_work[pivots + 3 * r + c] = b[to + c]
        for q in range(pivots):
            work[q], other_work[q] = a[base + q], b[base + q]
        for q in range(pivots - 1, -1, -1):
            row = store[at + q * size + q : at + (q + 1) * size]
            x, y = work[q:size], other_work[q:size]
            value = other = 0.0
            for j in range(1, size - q):
                value += row[j] * x[j]
                other += row[j] * y[j]
            work[q] = (work[q] - value) / row[0]
            other_work[q] = (other_work[q] - other) / row[0]
            a[base + q], b[base + q] = work[q], other_work[q]
