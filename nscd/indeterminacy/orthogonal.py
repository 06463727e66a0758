"""Orthogonal factorisation of the contact matrix C, sparse and rank-revealing: self-stresses and
least squares."""

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import dgeqp3, dgeqrf, dormqr
from scipy.sparse import csr_array

from nscd.arrays import Floats, Indices, Mask
from nscd.contacts import Contacts

# A pivot below this, relative to the longest row of C (unit vectors), is rounding.
RANK_TOLERANCE = 1e-9
# An entry of a self-stress (of unit size) below this is rounding.
ZERO_ROW = 1e-7
PROBES = 8
LEAF_DISKS = 12
LAPACK_BLOCK = 32


@dataclass(frozen=True, slots=True, eq=False)
class _Front:
    """One dense step: the rows `slots` are turned so that the first `rank` of them alone know the
    pivot columns."""

    slots: Indices  # (m,)
    reflectors: Floats  # of the pivoted factorisation, (m, rank)
    factors: Floats
    rank: int
    triangle: Floats  # R₁₁ (rank, rank), of the pivot columns
    pivots: Indices  # (rank,) columns of C
    beyond: Floats  # (rank, b): the same rows in the columns eliminated later
    columns: Indices  # (b,)
    packing: Floats  # reflectors of the second factorisation, of rows `rank`…
    packing_factors: Floats

    def turn(self, values: Floats, transpose: bool) -> None:
        """Qᵀ (or Q) of this front on the rows of `values` (k, v), in place."""
        steps = [
            (self.slots, self.reflectors, self.factors),
            (self.slots[self.rank :], self.packing, self.packing_factors),
        ]
        for slots, reflectors, factors in steps if transpose else reversed(steps):
            values[slots] = _reflect(reflectors, factors, values[slots], transpose)


@dataclass(frozen=True, slots=True, eq=False)
class OrthogonalFactor:
    """Hold C = Q R for k contacts: a multifrontal QR on nested dissection of the contact graph.

    rank: of C
    null: (k,) the rows of QᵀC that vanish, k − rank of them: Q's columns there span the
        self-stresses"""

    rank: int
    null: Mask
    fronts: tuple[_Front, ...]
    width: int

    def self_stress(self, reaction: Floats) -> Floats:
        """Project reactions (k,) or (k,v) orthogonally onto those that load no disk, the null space
        of Cᵀ, by reflections only and so exactly to rounding."""
        values = np.array(reaction if reaction.ndim == 2 else reaction[:, None], dtype=np.float64)
        for front in self.fronts:
            front.turn(values, transpose=True)
        values[~self.null] = 0.0
        for front in reversed(self.fronts):
            front.turn(values, transpose=False)
        return values.reshape(reaction.shape)

    def least_squares(self, rows: Floats) -> Floats:
        """Find u (w·n,) with |C u − rows| least, 0 in the columns that have no pivot."""
        values = rows.reshape(-1, 1).astype(np.float64)
        for front in self.fronts:
            front.turn(values, transpose=True)
        velocity = np.zeros(self.width)
        for front in reversed(self.fronts):
            right = values[front.slots[: front.rank], 0] - front.beyond @ velocity[front.columns]
            velocity[front.pivots] = solve_triangular(front.triangle, right, check_finite=False)
        return velocity


def factorise(contacts: Contacts, n: int, matrix: csr_array | None = None) -> OrthogonalFactor:
    """Factorise C (k,2n) of contacts between n disks, or another matrix (k,w·n) whose row i has entries
    at the disks of contact i alone, w columns each."""
    k = len(contacts)
    matrix = contacts.normal_matrix(n) if matrix is None else matrix
    width = matrix.shape[1] // max(n, 1)
    nodes = _nested_dissection(contacts, n)
    node_of = np.full(n, len(nodes))
    for number, disks in enumerate(nodes):
        node_of[disks] = number
    pair = ~contacts.is_wall
    home = node_of[contacts.first]
    home[pair] = np.minimum(home[pair], node_of[contacts.second[pair]])
    by_home = np.argsort(home, kind="stable")
    begin = np.searchsorted(home[by_home], np.arange(len(nodes) + 1))
    tolerance = RANK_TOLERANCE * float(np.sqrt(matrix.power(2).sum(1).max())) if k else 0.0

    # slots, columns, entries
    waiting = defaultdict[int, list[tuple[Indices, Indices, Floats]]](list)
    fronts: list[_Front] = []
    null = np.ones(k, dtype=bool)
    position = np.zeros(matrix.shape[1], dtype=np.intp)
    for number, disks in enumerate(nodes):
        mine = by_home[begin[number] : begin[number + 1]]
        own = matrix[mine]
        parts = waiting.pop(number, [])
        slots = np.concatenate([mine, *(part[0] for part in parts)])
        if not len(slots):
            continue
        ending = np.repeat(width * disks, width) + np.tile(np.arange(width), len(disks))
        present = np.unique(np.concatenate([own.indices, *(part[1] for part in parts)]))
        later = present[node_of[present // width] > number]
        position[ending] = np.arange(len(ending))
        position[later] = len(ending) + np.arange(len(later))
        dense = np.zeros((len(slots), len(ending) + len(later)), order="F")
        row = np.repeat(np.arange(len(mine)), np.diff(own.indptr))
        dense[row, position[own.indices]] = own.data
        at = len(mine)
        for part in parts:
            dense[at : at + len(part[0]), position[part[1]]] = part[2]
            at += len(part[0])
        front, passed = _eliminate(dense, slots, ending, later, tolerance)
        null[slots[: front.rank]] = False
        fronts.append(front)
        if len(passed):
            up = front.slots[front.rank : front.rank + len(passed)]
            waiting[int(node_of[later // width].min())].append((up, later, passed))
    return OrthogonalFactor(int((~null).sum()), null, tuple(fronts), matrix.shape[1])


def self_stresses(factor: OrthogonalFactor) -> Floats:
    """Draw eight random self-stresses (k,8). Where all eight vanish, so do all (the chance that they
    do so at a contact which an orthonormal basis of the null space loads by 10⁻³ is below
    10⁻³⁰)."""
    if not factor.null.any():
        return np.zeros((len(factor.null), PROBES))
    return factor.self_stress(np.random.default_rng(0).normal(size=(len(factor.null), PROBES)))


def undetermined_rows(factor: OrthogonalFactor) -> Mask:
    """Find the contacts (k,) that some self-stress loads."""
    return np.asarray(np.abs(self_stresses(factor)).max(1) > ZERO_ROW)


def _eliminate(
    dense: Floats, slots: Indices, ending: Indices, later: Indices, tolerance: float
) -> tuple[_Front, Floats]:
    """Eliminate the leading columns `ending`; also the entries of the rows that go on to `later`
    ones."""
    e = len(ending)
    factored, order, factors, _, _ = dgeqp3(dense[:, :e], lwork=2 * e + (e + 1) * LAPACK_BLOCK)
    rank = int((np.abs(np.diagonal(factored)) > tolerance).sum())
    reflectors, factors = np.asfortranarray(factored[:, :rank]), factors[:rank]
    rest = _reflect(reflectors, factors, dense[:, e:], True)
    below = rest[rank:]
    packing, packing_factors = np.zeros((len(below), 0)), np.zeros(0)
    if len(below) > len(later) > 0:
        packing, packing_factors, _, _ = dgeqrf(below, lwork=len(later) * LAPACK_BLOCK)
        below = np.triu(packing[: len(later)])
    elif not len(later):
        below = below[:0]
    front = _Front(
        slots=slots,
        reflectors=reflectors,
        factors=factors,
        rank=rank,
        triangle=np.triu(factored[:rank, :rank]),
        pivots=ending[order[:rank] - 1],
        beyond=rest[:rank],
        columns=later,
        packing=packing,
        packing_factors=packing_factors,
    )
    return front, below


def _reflect(reflectors: Floats, factors: Floats, values: Floats, transpose: bool) -> Floats:
    if not len(factors) or not values.shape[1]:
        return values
    side = "T" if transpose else "N"
    work = values.shape[1] * LAPACK_BLOCK
    return np.asarray(dormqr("L", side, reflectors, factors, values, lwork=work)[0])


def _nested_dissection(contacts: Contacts, n: int) -> list[Indices]:
    """Sets of disks in the order of their elimination: halves before the disks that separate them.
    The place of a disk is the mean of its contact points, so that the order is as good as the
    packing is planar; any order is correct."""
    pair = ~contacts.is_wall
    i, j = contacts.first[pair], contacts.second[pair]
    at = np.concatenate([contacts.first, j])
    points = np.concatenate([contacts.point, contacts.point[pair]])
    count = np.bincount(at, minlength=n)
    sums = np.column_stack([np.bincount(at, points[:, axis], n) for axis in (0, 1)])
    position = sums / np.maximum(count, 1)[:, None]
    ends = (np.concatenate([i, j]), np.concatenate([j, i]))
    graph = csr_array((np.ones(2 * len(i)), ends), shape=(n, n))
    low = np.zeros(n)
    nodes: list[Indices] = []

    def divide(disks: Indices) -> None:
        if len(disks) <= LEAF_DISKS:
            nodes.append(disks)
            return
        axis = int(np.argmax(np.ptp(position[disks], axis=0)))
        ordered = disks[np.argsort(position[disks, axis], kind="stable")]
        half = len(disks) // 2
        low[ordered[:half]] = 1.0
        between = (graph[ordered[half:]] @ low) > 0
        low[ordered[:half]] = 0.0
        divide(ordered[:half])
        if not between.all():
            divide(ordered[half:][~between])
        nodes.append(ordered[half:][between])

    divide(np.flatnonzero(count))
    return nodes
