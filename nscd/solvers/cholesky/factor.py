"""The Cholesky factor of Â + CᵀΘC, by rows for small crowds and by fronts for large ones."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from nscd.arrays import Index32
from nscd.compiling import kernel
from nscd.compiling.atomics import add_one, look
from nscd.compiling.team import ALONE, HOME, JOB, KIND, LEFT, THREADS, Team, wait_for
from nscd.problem import ContactProblem
from nscd.solvers.cholesky.dissection import dissect
from nscd.solvers.cholesky.fronts import Fronts, fronts_of, no_fronts
from nscd.solvers.cholesky.minimum_degree import minimum_degree
from nscd.solvers.cholesky.multifrontal import FACTORISE, factorise_fronts, factorise_tasks
from nscd.solvers.cholesky.parts import Parts, one_part, parts_of
from nscd.solvers.cholesky.rows import Rows, factorise_rows, rows_of, solve_rows
from nscd.solvers.cholesky.substitution import (
    BACK,
    FORWARD,
    back_tasks,
    forward_tasks,
    solve_fronts,
)

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
    parts: of disks and contacts, between which threads meet
    rows, fronts: the one that is not used is empty"""

    order: Index32
    place: Index32
    contact: Any
    many: bool
    parts: Parts
    rows: Rows
    fronts: Fronts


def factor_of(problem: ContactProblem, team: Team = ALONE) -> Factor:
    """Order the disks of a problem for elimination, and reserve storage for its factors, which a team
    is to make."""
    n, d = problem.mass.shape
    if n < MANY and d == 2:
        by_rows: Factor = factor_by_rows(n, problem.first, problem.second)
        return by_rows
    ordering = dissect(problem.position, problem.first, problem.second, LEAF, team)
    contact, parts = parts_of(ordering.place, problem.first, problem.second)
    first, second = problem.first[contact], problem.second[contact]
    fronts = fronts_of(ordering, first, second, d, threads=team.threads)
    return Factor(ordering.order, ordering.place, contact, True, parts, _no_rows(), fronts)


@kernel(apart=True)
def factor_by_rows(n: int, first: Any, second: Any) -> Any:
    """Order n disks for elimination, and reserve storage for the rows of their factor.

    first, second: (k,) disks, second −1 for a wall"""
    ordering = minimum_degree(n, first, second)
    order, place = ordering.order, ordering.place
    contact, parts = one_part(place, first)
    rows = rows_of(ordering, first[contact], second[contact])
    return Factor(order, place, contact, n < 0, parts, rows, no_fronts())


@cache
def _no_rows() -> Any:
    none = np.empty(0, dtype=np.int32)
    return factor_by_rows(0, none, none).rows


@kernel(apart=True, nogil=True)
def factorise(system: Any, factor: Any, theta: Any) -> bool:
    """Factorise Â + CᵀΘC for theta (k,) kg; False where rounding left it indefinite."""
    if factor.many:
        return factorise_fronts(system, factor.fronts, theta)
    return factorise_rows(system, factor.rows, theta)


@kernel(apart=True, nogil=True)
def solve_factorised(factor: Any, b: Any) -> None:
    """Solve b ← (L Lᵀ)⁻¹ b in place, (n,d)."""
    if factor.many:
        solve_fronts(factor.fronts, b)
    else:
        solve_rows(factor.rows, b)


def shared(factor: Factor) -> bool:
    """Tell whether there is work in a factor for several threads."""
    return factor.many and bool(factor.fronts.shared.control[THREADS] > 1)


@kernel(nogil=True)
def serve(me: int, system: Any, factor: Any) -> None:
    """Help with factorisations and solutions as thread `me` of a team, until it goes home."""
    fronts = factor.fronts
    control, jobs = fronts.shared.control, 0
    while True:
        jobs += 1
        wait_for(control, control, JOB, jobs)
        kind = look(control, KIND)
        if kind == HOME:
            return
        if kind == FACTORISE:
            factorise_tasks(system, fronts, me)
        elif kind == FORWARD:
            forward_tasks(fronts, system.mass.shape[1], me)
        elif kind == BACK:
            back_tasks(fronts, system.mass.shape[1], me)
        add_one(control, LEFT)
