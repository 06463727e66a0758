"""The numbers of the multifrontal factorisation: assemble fronts, eliminate, substitute."""

from __future__ import annotations

from typing import Any

from nscd.compiling import inner
from nscd.solvers.cholesky.elimination import eliminate

# A front (panel, update, size, pivots) is made where its results belong: row t of front s begins in
# `store` at panel_start + t·size where it is eliminated here, else at update_start + (t −
# pivots)·rest. Only the upper half is kept.


@inner(fastmath=True, apart=True)
def factorise_fronts(system: Any, fronts: Any, theta: Any) -> bool:
    """Factorise Â + CᵀΘC for theta (k,) kg, d unknowns per disk.

    Returns False where rounding left it indefinite."""
    d = system.mass.shape[1]
    F = fronts.store
    for s in range(len(fronts.first)):
        pivots = d * (fronts.end[s] - fronts.first[s])
        rest = d * (fronts.border_start[s + 1] - fronts.border_start[s])
        size, panel, update = pivots + rest, fronts.panel_start[s], fronts.update_start[s]
        front = (panel, update, size, pivots)
        F[panel : panel + pivots * size] = 0.0
        for i in range(rest):
            F[update + i * rest + i : update + (i + 1) * rest] = 0.0
        for k in range(fronts.end[s] - fronts.first[s]):
            for a in range(d):
                F[panel + (k * d + a) * (size + 1)] = system.mass[fronts.first[s] + k, a]
        for e in range(fronts.element_start[s], fronts.element_start[s + 1]):
            c = fronts.element[e]
            i, j = fronts.left[e] * d, fronts.right[e] * d
            weight = theta[c] + system.normal_weight[c]
            x, y = system.normal_first[c, 0], system.normal_first[c, 1]
            _add_normal(F, front, i, j, weight * x * x, weight * x * y, weight * y * y)
            if system.tangent_weight[c] != 0.0:
                first, second = system.tangent_first[c], system.tangent_second[c]
                _add_tangent(F, front, i, j, system.tangent_weight[c], first, second)
        c = fronts.child[s]
        while c >= 0:
            inner = fronts.inner[fronts.border_start[c] : fronts.border_start[c + 1]]
            _add_child(F, front, fronts.update_start[c], inner, fronts.run, d)
            c = fronts.sibling[c]
        rows, others = F[panel : panel + pivots * size], F[update : update + rest * rest]
        if not eliminate(rows, others, fronts.work, size, pivots):
            return False
    return True


@inner(fastmath=True)
def _add_normal(
    F: Any,
    front: Any,
    i: int,
    j: int,
    xx: float,
    xy: float,
    yy: float,
) -> None:
    """The upper half of (n, −n)ᵀ(n, −n) = (xx, xy; xy, yy) at rows i and j (negative: a wall)."""
    panel, update, size, pivots = front
    at, stride = panel + i * (size + 1), size
    if i >= pivots:
        at, stride = update + (i - pivots) * (size - pivots + 1), size - pivots
    F[at] += xx
    F[at + 1] += xy
    F[at + stride + 1] += yy
    if j < 0:
        return
    at, stride = panel + j * (size + 1), size
    if j >= pivots:
        at, stride = update + (j - pivots) * (size - pivots + 1), size - pivots
    F[at] += xx
    F[at + 1] += xy
    F[at + stride + 1] += yy
    # one of the two disks is eliminated here: the upper row is in the panel
    at = panel + min(i, j) * size + max(i, j)
    F[at] -= xx
    F[at + 1] -= xy
    F[at + size] -= xy
    F[at + size + 1] -= yy


@inner(fastmath=True)
def _add_tangent(
    F: Any,
    front: Any,
    i: int,
    j: int,
    weight: float,
    first: Any,
    second: Any,
) -> None:
    """The upper half of weight · (first, second)ᵀ(first, second) at rows i and j (negative: a
    wall)."""
    panel, update, size, pivots = front
    d = len(first)
    for a in range(d):
        for b in range(d):
            if b >= a:
                at = panel + (i + a) * size + i + b
                if i >= pivots:
                    at = update + (i - pivots + a) * (size - pivots) + i - pivots + b
                F[at] += weight * first[a] * first[b]
            if b >= a and j >= 0:
                at = panel + (j + a) * size + j + b
                if j >= pivots:
                    at = update + (j - pivots + a) * (size - pivots) + j - pivots + b
                F[at] += weight * second[a] * second[b]
            if j >= 0:
                at = panel + (i + a) * size + j + b if i < j else panel + (j + b) * size + i + a
                F[at] += weight * first[a] * second[b]


@inner(fastmath=True)
def _add_child(
    F: Any,
    front: Any,
    child: int,
    inner: Any,
    run: Any,
    d: int,
) -> None:
    """Add a child's Schur complement at the places `inner` of its disks, neighbouring places
    together."""
    panel, update, size, pivots = front
    count, rest, rows = len(inner), size - pivots, d * len(inner)
    for i in range(count - 1, -1, -1):
        run[i] = run[i + 1] if i + 1 < count and inner[i + 1] == inner[i] + 1 else i + 1
    for i in range(count):
        to = inner[i] * d
        for a in range(d):
            source = child + (i * d + a) * rows
            target = (
                panel + (to + a) * size
                if to < pivots
                else update + (to + a - pivots) * rest - pivots
            )
            j = i
            while j < count:
                end = run[j]
                at, length = target + inner[j] * d, (end - j) * d
                part, other = F[at : at + length], F[source + j * d : source + end * d]
                for x in range(length):
                    part[x] += other[x]
                j = end


@inner(fastmath=True, apart=True)
def solve_fronts(fronts: Any, b: Any) -> None:
    """Solve b ← (L Lᵀ)⁻¹ b in place, (n,d)."""
    d = b.shape[1]
    flat = b.reshape(-1)
    work = fronts.work
    P = fronts.store
    for s in range(len(fronts.first)):
        width, base = d * (fronts.end[s] - fronts.first[s]), d * fronts.first[s]
        q0 = fronts.border_start[s]
        count = fronts.border_start[s + 1] - q0
        size, start = width + d * count, fronts.panel_start[s]
        work[:width] = flat[base : base + width]
        work[width:size] = 0.0
        for q in range(width):
            row = P[start + q * size + q : start + (q + 1) * size]
            value = work[q] / row[0]
            work[q] = value
            rest = work[q:size]
            for j in range(1, size - q):
                rest[j] -= row[j] * value
        flat[base : base + width] = work[:width]
        for q in range(count):
            to = fronts.border[q0 + q] * d
            for a in range(d):
                flat[to + a] += work[width + q * d + a]
    for s in range(len(fronts.first) - 1, -1, -1):
        width, base = d * (fronts.end[s] - fronts.first[s]), d * fronts.first[s]
        q0 = fronts.border_start[s]
        count = fronts.border_start[s + 1] - q0
        size, start = width + d * count, fronts.panel_start[s]
        for q in range(count):
            to = fronts.border[q0 + q] * d
            for a in range(d):
                work[width + q * d + a] = flat[to + a]
        for q in range(width - 1, -1, -1):
            row, rest = P[start + q * size + q : start + (q + 1) * size], work[q:size]
            value = flat[base + q]
            for j in range(1, size - q):
                value -= row[j] * rest[j]
            work[q] = value / row[0]
            flat[base + q] = work[q]
