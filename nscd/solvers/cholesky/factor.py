"""The Cholesky factor of Â + CᵀΘC, by rows for small crowds and by fronts for large ones."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from nscd.arrays import Index32
from nscd.compiling import kernel
from nscd.problem import ContactProblem
from nscd.solvers.cholesky.dissection import dissect
from nscd.solvers.cholesky.fronts import Fronts, fronts_of, no_fronts
from nscd.solvers.cholesky.minimum_degree import minimum_degree
from nscd.solvers.cholesky.multifrontal import factorise_fronts
from nscd.solvers.cholesky.rows import Rows, factorise_rows, rows_of, solve_rows
from nscd.solvers.cholesky.substitution import solve_fronts

# From this many disks the multifrontal factorisation is the faster one (see benchmarks).
MANY = 1500
# Parts of the crowd up to this many disks are not cut further.
LEAF = 8


class Factor(NamedTuple):
    """Hold structure and storage of the factor of one problem.

    order: (n,) the disk at each place
    place: (n,) its inverse
    contact: (k,) the contact at each row, neighbours in memory as in the crowd
    many: by fronts, otherwise by rows
    rows, fronts: the one that is not used is empty"""

    order: Index32
    place: Index32
    contact: Any
    many: bool
    rows: Rows
    fronts: Fronts


def factor_of(problem: ContactProblem) -> Factor:
    """Order the disks of a problem for elimination, and reserve storage for its factors."""
    n, d = problem.mass.shape
    if n < MANY and d == 2:
        by_rows: Factor = factor_by_rows(n, problem.first, problem.second)
        return by_rows
    ordering = dissect(problem.position, problem.first, problem.second, LEAF)
    contact = np.argsort(ordering.place[problem.first], kind="stable")
    first, second = problem.first[contact], problem.second[contact]
    fronts = fronts_of(ordering, first, second, d)
    return Factor(ordering.order, ordering.place, contact, True, _no_rows(), fronts)


@kernel(apart=True)
def factor_by_rows(n: int, first: Any, second: Any) -> Any:
    """Order n disks for elimination, and reserve storage for the rows of their factor.

    first, second: (k,) disks, second −1 for a wall"""
    ordering = minimum_degree(n, first, second)
    order, place = ordering.order, ordering.place
    begin = np.zeros(n + 1, np.int64)
    for i in first:
        begin[place[i] + 1] += 1
    for i in range(n):
        begin[i + 1] += begin[i]
    contact = np.empty(len(first), np.int64)
    for c in range(len(first)):
        i = place[first[c]]
        contact[begin[i]] = c
        begin[i] += 1
    rows = rows_of(ordering, first[contact], second[contact])
    return Factor(order, place, contact, n < 0, rows, no_fronts())


@cache
def _no_rows() -> Any:
    none = np.empty(0, dtype=np.int32)
    return factor_by_rows(0, none, none).rows


@kernel(apart=True)
def factorise(system: Any, factor: Any, theta: Any) -> bool:
    """Factorise Â + CᵀΘC for theta (k,) kg; False where rounding left it indefinite."""
    if factor.many:
        return factorise_fronts(system, factor.fronts, theta)
    return factorise_rows(system, factor.rows, theta)


@kernel(apart=True)
def solve_factorised(factor: Any, b: Any) -> None:
    """Solve b ← (L Lᵀ)⁻¹ b in place, (n,d)."""
    if factor.many:
        solve_fronts(factor.fronts, b)
    else:
        solve_rows(factor.rows, b)
