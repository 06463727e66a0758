"""The Cholesky factor of Â + CᵀΘC, by rows for small crowds and by fronts for large ones."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from nscd.arrays import Index32
from nscd.problem import ContactProblem
from nscd.solvers.cholesky.dissection import dissect
from nscd.solvers.cholesky.fronts import Fronts, fronts_of
from nscd.solvers.cholesky.minimum_degree import minimum_degree
from nscd.solvers.cholesky.multifrontal import factorise_fronts, solve_fronts
from nscd.solvers.cholesky.rows import Rows, factorise_rows, rows_of, solve_rows

# From this many disks the multifrontal factorisation is the faster one (see benchmarks).
MANY = 3000
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
    many = bool(n >= MANY or d == 3)
    if many:
        ordering = dissect(problem.position, problem.first, problem.second, LEAF)
    else:
        ordering = minimum_degree(n, problem.first, problem.second)
    contact = np.argsort(ordering.place[problem.first], kind="stable")
    first, second = problem.first[contact], problem.second[contact]
    rows = _nothing()[0] if many else rows_of(ordering, first, second)
    fronts = fronts_of(ordering, first, second, d) if many else _nothing()[1]
    return Factor(ordering.order, ordering.place, contact, many, rows, fronts)


@cache
def _nothing() -> tuple[Rows, Fronts]:
    none = np.empty(0, dtype=np.int32)
    empty = dissect(np.empty((0, 2)), none, none, 1)
    return rows_of(empty, none, none), fronts_of(empty, none, none, 2)


@njit(cache=True)
def factorise(system: Any, factor: Any, theta: Any) -> bool:
    """Factorise Â + CᵀΘC for theta (k,) kg; False where rounding left it indefinite."""
    if factor.many:
        return factorise_fronts(system, factor.fronts, theta)
    return factorise_rows(system, factor.rows, theta)


@njit(cache=True)
def solve_factorised(factor: Any, b: Any) -> None:
    """Solve b ← (L Lᵀ)⁻¹ b in place, (n,d)."""
    if factor.many:
        solve_fronts(factor.fronts, b)
    else:
        solve_rows(factor.rows, b)
