"""The factorisation of Â + CᵀΘC: the rate of one front beside the BLAS, and whole matrices beside
CHOLMOD and PARDISO.

    OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 python -m benchmarks.factors.factorisation \\
        [CASE ...]

Cases are files that `benchmarks/percussions.py --cases FOLDER` left."""

import os
import sys
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sparse

from benchmarks.cases import Case, read_case
from benchmarks.factors import fronts
from benchmarks.machine import describe, head, line, options
from nscd import _core

# From this many disks on the product factorises by fronts: see nscd/core/factor.hpp.
MANY = 1500
# Θ of contacts that press and of such that open, kg per kg of a disk.
DECADES = 4.0
# How often the fastest is looked for, by seconds that one takes.
TIMES, SECONDS = 40, 2.0


class Matrix(NamedTuple):
    """Â + CᵀΘC of a case, in the order that the case is given in: theta (k,) kg, the matrix (2n, 2n)
    and a right side (2n,)."""

    case: Case
    theta: Any
    whole: Any
    right: Any


def matrix_of(case: Case) -> Matrix:
    """The matrix of a case with Θ drawn over several decades."""
    draw = np.random.default_rng(1)
    mass = case.snapshot.mass
    rows = case.contacts.normal_matrix(len(mass))
    theta = 10.0 ** draw.uniform(-DECADES, DECADES, len(case.contacts)) * mass.mean()
    whole = sparse.diags_array(np.repeat(mass, 2)) + rows.T @ sparse.diags_array(theta) @ rows
    return Matrix(case, theta, sparse.csc_array(whole), draw.normal(size=2 * len(mass)))


class Run(NamedTuple):
    """The steps of a solver, in this order: analyse() gives what factorise takes, that gives what
    solve takes, and that gives the solution (2n,)."""

    analyse: Callable[[], Any]
    factorise: Callable[[Any], Any]
    solve: Callable[[Any], Any]


def own(matrix: Matrix) -> Run:
    """This product: from contacts, so the matrix is made within."""
    crowd, contacts = matrix.case.snapshot, matrix.case.contacts
    first, wall = contacts.first.astype(np.int32), contacts.is_wall
    second = np.where(wall, -1, contacts.second).astype(np.int32)
    mass, none = np.repeat(crowd.mass[:, None], 2, axis=1), np.zeros(len(contacts))
    fronts = len(crowd) >= MANY

    def analyse() -> Any:
        return _core.Factor(
            first, second, contacts.normal, np.zeros_like(contacts.normal), crowd.position, mass, none,
            none, fronts,
        )  # fmt: skip

    def factorised(factor: Any) -> Any:
        assert factor.factorise(matrix.theta)
        return factor

    def solve(factor: Any) -> Any:
        return factor.solve(matrix.right.reshape(-1, 2)).ravel()

    return Run(analyse, factorised, solve)


def cholmod(matrix: Matrix) -> Run:
    """CHOLMOD as cvxopt has it: approximate minimum degree, supernodes where it finds them."""
    from cvxopt import cholmod as library
    from cvxopt import matrix as dense
    from cvxopt import spmatrix

    lower = sparse.coo_array(sparse.tril(matrix.whole))
    given = spmatrix(lower.data, lower.row.tolist(), lower.col.tolist(), lower.shape)

    def factorised(plan: Any) -> Any:
        library.numeric(given, plan)
        return plan

    def solve(factor: Any) -> Any:
        x = dense(matrix.right)
        library.solve(factor, x)
        return np.array(x).ravel()

    return Run(lambda: library.symbolic(given), factorised, solve)


def pardiso(matrix: Matrix) -> Run:
    """PARDISO of MKL: nested dissection by METIS, symmetric and positive definite."""
    from pypardiso import PyPardisoSolver

    upper = sparse.csr_matrix(sparse.triu(matrix.whole))
    upper.sort_indices()
    right = np.asfortranarray(matrix.right)
    solver = PyPardisoSolver(mtype=2)

    def run(phase: int) -> Any:
        solver.set_phase(phase)
        return solver._call_pardiso(upper, right)

    return Run(lambda: run(11), lambda _: run(22), lambda _: run(33))


SOLVERS = {"own": own, "CHOLMOD": cholmod, "PARDISO": pardiso}
INSTALL = {"own": "", "CHOLMOD": "pip install cvxopt", "PARDISO": "pip install pypardiso"}
HEADING = head(
    "crowd", "disks", "solver", "analyse", "factorise", "solve", "1 + 15 + 35 of them", "residual"
)


def rows(case: Case, family: str) -> list[str]:
    """A row of the table for each solver; the last column of times is one solution by 15
    factorisations and 35 solves."""
    matrix, lines = matrix_of(case), []
    for name, make in SOLVERS.items():
        begin = [family, f"{len(case.snapshot):,}", name]
        try:
            run = make(matrix)
        except ImportError:
            lines.append(line([*begin, f"not installed: {INSTALL[name]}", *[""] * 4]))
            continue
        one, plan = _fastest(run.analyse)
        two, factor = _fastest(lambda run=run, plan=plan: run.factorise(plan))
        three, x = _fastest(lambda run=run, factor=factor: run.solve(factor))
        missed = np.abs(matrix.whole @ x - matrix.right).max()
        size = abs(matrix.whole).sum(axis=1).max() * np.abs(x).max() + np.abs(matrix.right).max()
        times = (one, two, three, one + 15 * two + 35 * three)
        lines.append(
            line([*begin, *(f"{_said(1e3 * t)} ms" for t in times), f"{missed / size:.0e}"])
        )
    return lines


def _said(milliseconds: float) -> str:
    return f"{milliseconds:.2g}" if milliseconds < 99.5 else f"{milliseconds:,.0f}"


def _fastest(call: Callable[[], Any]) -> tuple[float, Any]:
    """CPU seconds of the fastest of several calls, and what the last one gave."""
    least, started = np.inf, time.process_time()
    for _ in range(TIMES):
        before = time.process_time()
        found = call()
        least = min(least, time.process_time() - before)
        if time.process_time() - started > SECONDS:
            break
    return least, found


ONE_THREAD = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def main() -> None:
    """Print both tables as Markdown."""
    given = options(__doc__, "cases…")
    for name in ONE_THREAD:
        if os.environ.get(name) != "1":
            sys.exit(f"{name}: set it to 1, so that everyone has one thread")
    for path in given.cases:
        if not path.is_file():
            sys.exit(f"{path}: no such file")
    print(describe(), end="\n\n")
    print(fronts.HEADING)
    print("\n".join(fronts.rows()), flush=True)
    print(f"\n{HEADING}")
    for path in given.cases:
        print("\n".join(rows(read_case(path), path.name.partition("_")[0])), flush=True)


if __name__ == "__main__":
    main()
