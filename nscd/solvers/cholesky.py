"""Block Cholesky factorisation of Â + CᵀΘC over the contact graph, compiled; blocks of 2 (3 with spins) a disk."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from nscd.problem import ContactProblem
from nscd.solvers.elimination import Elimination, eliminate


class System(NamedTuple):
    """A ContactProblem with its disks in elimination order, as the kernels take it (d = 2, or 3 with spins).

    first, second (k,) places of the disks, −1 for a wall; normal_first, normal_second, tangent_first, tangent_second
    (k,d): rows of C and T; normal_weight k_n, tangent_weight k_t (k,) kg; mass (n,d); free û (n,d); offset b (k,);
    inverse_mass w (k,); scale ‖u⁻‖∞ (m/s).
    """

    first: Any
    second: Any
    normal_first: Any
    normal_second: Any
    tangent_first: Any
    tangent_second: Any
    normal_weight: Any
    tangent_weight: Any
    mass: Any
    free: Any
    offset: Any
    inverse_mass: Any
    scale: float


class Factor(NamedTuple):
    """Storage of a factorisation: block (nnz, d²) lower blocks by columns, diagonal (n, d²) their triangular
    diagonal blocks with inverted diagonal; work (n, d²), zero between calls; matrix, matrix_diagonal: A."""

    block: Any
    diagonal: Any
    work: Any
    matrix: Any
    matrix_diagonal: Any


def system_of(problem: ContactProblem) -> tuple[System, Elimination, Factor]:
    """The kernels' form of a problem, its elimination order and storage for its factors."""
    elimination = eliminate(problem.position, problem.first, problem.second)
    d = problem.mass.shape[1]
    order, place = elimination.order, elimination.place
    system = System(
        first=place[problem.first],
        second=np.where(problem.second >= 0, place[problem.second], np.int32(-1)),
        normal_first=problem.normal_first,
        normal_second=problem.normal_second,
        tangent_first=problem.tangent_first,
        tangent_second=problem.tangent_second,
        normal_weight=problem.normal_weight,
        tangent_weight=problem.tangent_weight,
        mass=problem.mass[order],
        free=problem.free[order],
        offset=problem.offset,
        inverse_mass=problem.inverse_mass,
        scale=problem.scale,
    )
    n = len(order)
    factor = Factor(
        block=np.empty((len(elimination.row), d * d)),
        diagonal=np.empty((n, d * d)),
        work=np.zeros((n, d * d)),
        matrix=np.empty((len(elimination.a_column), d * d)),
        matrix_diagonal=np.empty((n, d * d)),
    )
    return system, elimination, factor


@njit(cache=True, fastmath=True)
def approach(system: Any, u: Any, out: Any) -> None:
    """out = C u, (k,)."""
    d = u.shape[1]
    for c in range(len(out)):
        i, j = system.first[c], system.second[c]
        v = 0.0
        for a in range(d):
            v += system.normal_first[c, a] * u[i, a]
        if j >= 0:
            for a in range(d):
                v += system.normal_second[c, a] * u[j, a]
        out[c] = v


@njit(cache=True, fastmath=True)
def add_reactions(system: Any, reaction: Any, factor: float, out: Any) -> None:
    """out += factor · Cᵀ reaction, (n,d)."""
    d = out.shape[1]
    for c in range(len(reaction)):
        i, j = system.first[c], system.second[c]
        push = factor * reaction[c]
        for a in range(d):
            out[i, a] += system.normal_first[c, a] * push
        if j >= 0:
            for a in range(d):
                out[j, a] += system.normal_second[c, a] * push


@njit(cache=True, fastmath=True)
def inertia(system: Any, u: Any, out: Any) -> None:
    """out = Â u = (M + DᵀKD) u, (n,d)."""
    n, d = u.shape
    for i in range(n):
        for a in range(d):
            out[i, a] = system.mass[i, a] * u[i, a]
    for c in range(len(system.first)):
        if system.normal_weight[c] == 0.0 and system.tangent_weight[c] == 0.0:
            continue
        i, j = system.first[c], system.second[c]
        along = across = 0.0
        for a in range(d):
            along += system.normal_first[c, a] * u[i, a]
            across += system.tangent_first[c, a] * u[i, a]
            if j >= 0:
                along += system.normal_second[c, a] * u[j, a]
                across += system.tangent_second[c, a] * u[j, a]
        along *= system.normal_weight[c]
        across *= system.tangent_weight[c]
        for a in range(d):
            out[i, a] += along * system.normal_first[c, a] + across * system.tangent_first[c, a]
            if j >= 0:
                out[j, a] += along * system.normal_second[c, a] + across * system.tangent_second[c, a]


@njit(cache=True, fastmath=True)
def _assemble(system: Any, elimination: Any, factor: Any, theta: Any) -> None:
    n, d = system.mass.shape
    diagonal, matrix = factor.matrix_diagonal, factor.matrix
    diagonal[:] = 0.0
    matrix[:] = 0.0
    for i in range(n):
        for a in range(d):
            diagonal[i, a * d + a] = system.mass[i, a]
    for c in range(len(theta)):
        i, j = system.first[c], system.second[c]
        p = elimination.pair_block[c]
        t = theta[c] + system.normal_weight[c]
        for a in range(d):
            ni = t * system.normal_first[c, a]
            for e in range(d):
                diagonal[i, a * d + e] += ni * system.normal_first[c, e]
            if j >= 0:
                nj = t * system.normal_second[c, a]
                for e in range(d):
                    diagonal[j, a * d + e] += nj * system.normal_second[c, e]
                    # the row of the block is the disk that is eliminated later
                    if i > j:
                        matrix[p, a * d + e] += ni * system.normal_second[c, e]
                    else:
                        matrix[p, a * d + e] += nj * system.normal_first[c, e]
        s = system.tangent_weight[c]
        if s != 0.0:
            for a in range(d):
                ti = s * system.tangent_first[c, a]
                for e in range(d):
                    diagonal[i, a * d + e] += ti * system.tangent_first[c, e]
                if j >= 0:
                    tj = s * system.tangent_second[c, a]
                    for e in range(d):
                        diagonal[j, a * d + e] += tj * system.tangent_second[c, e]
                        if i > j:
                            matrix[p, a * d + e] += ti * system.tangent_second[c, e]
                        else:
                            matrix[p, a * d + e] += tj * system.tangent_first[c, e]


@njit(cache=True)
def factorise(system: Any, elimination: Any, factor: Any, theta: Any) -> bool:
    """Factorise Â + CᵀΘC for theta (k,) kg; False where rounding left it indefinite."""
    _assemble(system, elimination, factor, theta)
    if system.mass.shape[1] == 2:
        return _factorise_pairs(elimination, factor)
    return _factorise_blocks(elimination, factor, system.mass.shape[1])


@njit(cache=True, fastmath=True)
def _factorise_pairs(elimination: Any, factor: Any) -> bool:
    """Up-looking, row by row, blocks of 2 in registers."""
    L, D, x = factor.block, factor.diagonal, factor.work
    A, row, start = factor.matrix, elimination.row, elimination.start
    for k in range(len(D)):
        for p in range(elimination.a_start[k], elimination.a_start[k + 1]):
            i = elimination.a_column[p]
            x[i, 0], x[i, 1], x[i, 2], x[i, 3] = A[p, 0], A[p, 1], A[p, 2], A[p, 3]
        d0, d1, d2 = factor.matrix_diagonal[k, 0], factor.matrix_diagonal[k, 1], factor.matrix_diagonal[k, 3]
        for q in range(elimination.row_start[k], elimination.row_start[k + 1]):
            i = elimination.column[q]
            x0, x1, x2, x3 = x[i, 0], x[i, 1], x[i, 2], x[i, 3]
            x[i, 0] = x[i, 1] = x[i, 2] = x[i, 3] = 0.0
            a, b, c = D[i, 0], D[i, 2], D[i, 3]
            l0, l2 = x0 * a, x2 * a
            l1, l3 = (x1 - l0 * b) * c, (x3 - l2 * b) * c
            s = elimination.slot[q]
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
        D[k, 0], D[k, 1], D[k, 2], D[k, 3] = 1.0 / g, 0.0, b, 1.0 / np.sqrt(rest)
    return True


@njit(cache=True, fastmath=True)
def _factorise_blocks(elimination: Any, factor: Any, d: int) -> bool:
    """The same for blocks of any size."""
    L, D, x = factor.block, factor.diagonal, factor.work
    here, rest = np.empty(d * d), np.empty(d * d)
    for k in range(len(D)):
        for p in range(elimination.a_start[k], elimination.a_start[k + 1]):
            x[elimination.a_column[p], :] = factor.matrix[p, :]
        rest[:] = factor.matrix_diagonal[k, :]
        for q in range(elimination.row_start[k], elimination.row_start[k + 1]):
            i = elimination.column[q]
            for a in range(d):
                for e in range(d):
                    value = x[i, a * d + e]
                    for f in range(e):
                        value -= here[a * d + f] * D[i, e * d + f]
                    here[a * d + e] = value * D[i, e * d + e]
            x[i, :] = 0.0
            s = elimination.slot[q]
            for p in range(elimination.start[i], s):
                r = elimination.row[p]
                for a in range(d):
                    for e in range(d):
                        value = 0.0
                        for f in range(d):
                            value += here[a * d + f] * L[p, e * d + f]
                        x[r, a * d + e] -= value
            L[s, :] = here
            for a in range(d):
                for e in range(a + 1):
                    value = 0.0
                    for f in range(d):
                        value += here[a * d + f] * here[e * d + f]
                    rest[a * d + e] -= value
        for a in range(d):
            for e in range(a + 1):
                value = rest[a * d + e]
                for f in range(e):
                    value -= D[k, a * d + f] * D[k, e * d + f]
                if e < a:
                    D[k, a * d + e] = value * D[k, e * d + e]
                elif value > 0.0:
                    D[k, a * d + a] = 1.0 / np.sqrt(value)
                else:
                    x[:] = 0.0
                    return False
    return True


@njit(cache=True, fastmath=True)
def solve_factorised(elimination: Any, factor: Any, b: Any) -> None:
    """b ← (L Lᵀ)⁻¹ b in place, (n,d)."""
    n, d = b.shape
    L, D, start, row = factor.block, factor.diagonal, elimination.start, elimination.row
    for k in range(n):
        for a in range(d):
            value = b[k, a]
            for f in range(a):
                value -= D[k, a * d + f] * b[k, f]
            b[k, a] = value * D[k, a * d + a]
        for p in range(start[k], start[k + 1]):
            r = row[p]
            for a in range(d):
                value = 0.0
                for f in range(d):
                    value += L[p, a * d + f] * b[k, f]
                b[r, a] -= value
    for k in range(n - 1, -1, -1):
        for p in range(start[k], start[k + 1]):
            r = row[p]
            for f in range(d):
                value = 0.0
                for a in range(d):
                    value += L[p, a * d + f] * b[r, a]
                b[k, f] -= value
        for a in range(d - 1, -1, -1):
            value = b[k, a]
            for f in range(a + 1, d):
                value -= D[k, f * d + a] * b[k, f]
            b[k, a] = value * D[k, a * d + a]
