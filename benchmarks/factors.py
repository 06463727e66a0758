"""The factorisation of Â + CᵀΘC: whole matrices beside CHOLMOD and PARDISO.

    OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 python benchmarks/factors.py [CASE ...]

Cases are files that `benchmarks/percussions.py --cases FOLDER` left."""

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sparse

from benchmarks.cases import Case, read_case
from benchmarks.machine import least, options, show
from nscd import _core

# From this many disks on the product factorises by fronts: see nscd/core/factor.hpp.
MANY = 1500
# Θ of contacts that press and of such that open, kg per kg of a disk.
DECADES = 4.0
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


# The steps of a solver, in this order: analyse() gives what factorise takes, that gives what solve
# takes, and that gives the solution (2n,).
Steps = tuple[Callable[[], Any], Callable[[Any], Any], Callable[[Any], Any]]


def own(case: Case, theta: Any, _: Any, right: Any) -> Steps:
    """This product: from contacts, so the matrix is made within."""
    contacts, crowd = case.contacts, case.snapshot
    second, none = np.where(contacts.is_wall, -1, contacts.second), np.zeros(len(contacts))
    ends = contacts.first.astype(np.int32), second.astype(np.int32)
    pairs = *ends, contacts.normal, crowd.position, crowd.radius, crowd.mass

    def plan() -> Any:
        return _core.Factor(pairs, none, none, False, len(crowd) >= MANY)

    def factorised(factor: Any) -> Any:
        assert factor.factorise(theta)
        return factor

    return plan, factorised, lambda factor: factor.solve(right.reshape(-1, 2)).ravel()


def cholmod(_: Case, theta: Any, whole: Any, right: Any) -> Steps:
    """CHOLMOD as cvxopt has it: approximate minimum degree, supernodes where it finds them."""
    from cvxopt import cholmod as library
    from cvxopt import matrix, spmatrix

    lower = sparse.coo_array(sparse.tril(whole))
    given = spmatrix(lower.data, lower.row.tolist(), lower.col.tolist(), lower.shape)

    def factorised(plan: Any) -> Any:
        library.numeric(given, plan)
        return plan

    def solve(factor: Any) -> Any:
        x = matrix(right)
        library.solve(factor, x)
        return np.array(x).ravel()

    return lambda: library.symbolic(given), factorised, solve


def pardiso(_: Case, theta: Any, whole: Any, right: Any) -> Steps:
    """PARDISO of MKL: nested dissection by METIS, symmetric and positive definite."""
    from pypardiso import PyPardisoSolver

    upper = sparse.csr_matrix(sparse.triu(whole))
    upper.sort_indices()
    solver = PyPardisoSolver(mtype=2)

    def run(phase: int) -> Any:
        solver.set_phase(phase)
        return solver._call_pardiso(upper, np.asfortranarray(right))

    return lambda: run(11), lambda _: run(22), lambda _: run(33)


SOLVERS = {"own": own, "CHOLMOD": cholmod, "PARDISO": pardiso}
INSTALL = {"CHOLMOD": "pip install cvxopt", "PARDISO": "pip install pypardiso"}
NAMES = (
    "crowd", "disks", "solver", "analyse", "factorise", "solve", "1 + 15 + 35 of them", "residual",
)  # fmt: skip


def rows(paths: Sequence[Path]) -> Iterator[list[str]]:
    """A row of the table for each case and solver, with Θ over several decades; the last column of
    times is one solution by 15 factorisations and 35 solves."""
    for path in paths:
        case = read_case(path)
        draw, mass = np.random.default_rng(1), case.snapshot.mass
        normals = case.contacts.normal_matrix(len(mass))
        theta = 10.0 ** draw.uniform(-DECADES, DECADES, len(case.contacts)) * mass.mean()
        whole = sparse.csc_array(
            sparse.diags_array(np.repeat(mass, 2)) + normals.T @ sparse.diags_array(theta) @ normals
        )
        right = draw.normal(size=2 * len(mass))
        for name, make in SOLVERS.items():
            begin = [path.name.partition("_")[0], f"{len(mass):,}", name]
            try:
                analyse, factorise, solve = make(case, theta, whole, right)
            except ImportError:
                yield [*begin, f"not installed: {INSTALL[name]}", *[""] * 4]
                continue
            one, plan = least(analyse)
            two, factor = least(partial(factorise, plan))
            three, x = least(partial(solve, factor))
            missed = np.abs(whole @ x - right).max()
            size = abs(whole).sum(axis=1).max() * np.abs(x).max() + np.abs(right).max()
            times = map(_milliseconds, (one, two, three, one + 15 * two + 35 * three))
            yield [*begin, *times, f"{missed / size:.0e}"]


def _milliseconds(seconds: float) -> str:
    return (
        f"{float(f'{1e3 * seconds:.2g}'):,g} ms" if seconds < 0.0995 else f"{1e3 * seconds:,.0f} ms"
    )


if __name__ == "__main__":
    for variable in ONE_THREAD:
        if os.environ.get(variable) != "1":
            sys.exit(f"{variable}: set it to 1, so that everyone has one thread")
    show(NAMES, rows(options(__doc__, "cases…").cases))
