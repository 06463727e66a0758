"""The factorisation of Â + CᵀΘC: how fast one front is eliminated beside the BLAS; whole matrices
beside CHOLMOD and PARDISO; and orders of elimination, by the product's dissection, by minimum degree
and by METIS (where pymetis is installed).

    OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 python benchmarks/factors.py [CASE ...]

Cases are files that `benchmarks/percussions.py --cases FOLDER` left. Of an order, an entry is a block
of one disk and another; arithmetic is Σ c² over the columns of the factor, c its entries."""

import os
import sys
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sparse

from benchmarks.cases import Case, read_case
from benchmarks.machine import describe, head, in_turn, least, line, options, timed
from nscd import _core
from nscd._core import PANEL, eliminate

# Pivots and other rows.
FRONTS = (
    (4, 12), (8, 16), (10, 24), (16, 32), (24, 64), (40, 120), (80, 200), (120, 400), (250, 700), (500, 1000)
)  # fmt: skip
TURNS, FLOPS = 25, 1e7
NOTHING = np.empty(0)
# From this many disks on the product factorises by fronts, and parts of so many are not cut further:
# see nscd/core/factor.hpp.
MANY, LEAF = 1500, 8
# Θ of contacts that press and of such that open, kg per kg of a disk.
DECADES = 4.0
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def _height(pivots: int) -> int:
    return -(-pivots // 4) * 4 if pivots <= PANEL else -(-pivots // 8) * 8


def in_chunks(matrix: Any, pivots: int) -> Any:
    """A front as `eliminate` takes it, at an address that is a multiple of 64 bytes."""
    rest = len(matrix) - pivots
    wide, more, height = -(-pivots // 8), -(-rest // 8), _height(pivots)
    panel = np.zeros((height, 8 * (wide + more)))
    panel[:pivots, :pivots] = np.triu(matrix[:pivots, :pivots])
    panel[:pivots, 8 * wide : 8 * wide + rest] = matrix[:pivots, pivots:]
    others = np.zeros((8 * more, 8 * more))
    others[:rest, :rest] = matrix[pivots:, pivots:]
    parts = [panel.reshape(height, wide + more, 8).transpose(1, 0, 2).ravel()]
    parts += [others[: 8 * c + 8, 8 * c : 8 * c + 8].ravel() for c in range(more)]
    numbers = np.concatenate(parts)
    room = np.empty(len(numbers) + 7)
    front = room[-(room.ctypes.data // 8) % 8 :][: len(numbers)]
    front[:] = numbers
    return front


def from_chunks(front: Any, size: int, pivots: int) -> tuple[Any, Any]:
    """Lᵀ of the pivots (pivots, size), and the upper half of the Schur complement."""
    rest = size - pivots
    wide, more, height = -(-pivots // 8), -(-rest // 8), _height(pivots)
    at = 8 * (wide + more) * height
    rows = front[:at].reshape(wide + more, height, 8).transpose(1, 0, 2).reshape(height, -1)
    upper = np.triu(rows[:pivots, :pivots])
    np.fill_diagonal(upper, 1.0 / np.diag(upper))
    others = np.zeros((8 * more, 8 * more))
    for c in range(more):
        others[: 8 * c + 8, 8 * c : 8 * c + 8] = front[at : at + 64 * (c + 1)].reshape(-1, 8)
        at += 64 * (c + 1)
    beside = rows[:pivots, 8 * wide : 8 * wide + rest]
    return np.hstack([upper, beside]), np.triu(others[:rest, :rest])


FRONT_HEAD = head(
    "pivots + others", "kernel", "dgemm of as many rows", "share of dgemm", "LLᵀ against the matrix"
)


def front_row(pivots: int, rest: int) -> str:
    """A row of the table of fronts: rates (GFLOP/s) of the elimination and of a matrix product."""
    size = pivots + rest
    half = np.random.default_rng(size).normal(size=(size, size + 3))
    matrix = half @ half.T + np.eye(size)
    flops = float(sum((size - q) ** 2 for q in range(pivots)))
    given = in_chunks(matrix, pivots)
    front, product = np.empty_like(given), np.empty_like(matrix)
    count, products = max(1, int(FLOPS / flops)), max(1, int(FLOPS / (2 * size**3)))

    def eliminations(number: int, *sizes: int, to: Any = front) -> None:
        for _ in range(count):
            front[:] = given
            eliminate(to, *sizes)

    def dgemm() -> None:
        for _ in range(products):
            np.dot(matrix, matrix, product)

    calls = {
        "new": partial(eliminations, count, pivots, rest),
        # the same without its arithmetic: a front of no pivots is a call and a copy
        "copies": partial(eliminations, count, 0, 0, to=NOTHING),
        "dgemm": dgemm,
    }
    turns = in_turn({name: partial(timed, call) for name, call in calls.items()}, TURNS)
    seconds = {name: min(spent for spent, _ in found) for name, found in turns.items()}
    new = flops * count / (seconds["new"] - seconds["copies"])
    rate = 2 * size**3 * products / seconds["dgemm"]
    front[:] = given
    assert eliminate(front, pivots, rest)
    rows, _ = from_chunks(front, size, pivots)
    error = np.abs(rows[:, :pivots].T @ rows - matrix[:pivots]).max() / np.abs(matrix).max()
    rates = f"{new / 1e9:.1f}", f"{rate / 1e9:.1f}", f"{new / rate:.2f}"
    return line([f"{pivots} + {rest}", *rates, f"{error:.0e}"])


class Matrix(NamedTuple):
    """Â + CᵀΘC of a case, in the order that the case is given in: theta (k,) kg, the matrix (2n, 2n)
    and a right side (2n,)."""

    case: Case
    theta: Any
    whole: Any
    right: Any

    @classmethod
    def of(cls, case: Case) -> "Matrix":
        """Draw Θ over several decades."""
        draw, mass = np.random.default_rng(1), case.snapshot.mass
        rows = case.contacts.normal_matrix(len(mass))
        theta = 10.0 ** draw.uniform(-DECADES, DECADES, len(case.contacts)) * mass.mean()
        whole = sparse.diags_array(np.repeat(mass, 2)) + rows.T @ sparse.diags_array(theta) @ rows
        return cls(case, theta, sparse.csc_array(whole), draw.normal(size=2 * len(mass)))


class Run(NamedTuple):
    """The steps of a solver, in this order: analyse() gives what factorise takes, that gives what
    solve takes, and that gives the solution (2n,)."""

    analyse: Callable[[], Any]
    factorise: Callable[[Any], Any]
    solve: Callable[[Any], Any]


def factor_of(case: Case, mass: Any, fronts: bool) -> Any:
    """The product's plan of a factor: from contacts, with masses (n,2) kg."""
    contacts, none = case.contacts, np.zeros(len(case.contacts))
    given = *_ends(case), contacts.normal, np.zeros_like(contacts.normal), case.snapshot.position
    return _core.Factor(*given, mass, none, none, fronts)


def _ends(case: Case) -> tuple[Any, Any]:
    """The disks (k,) of each contact, −1 for a wall."""
    contacts = case.contacts
    second = np.where(contacts.is_wall, -1, contacts.second)
    return contacts.first.astype(np.int32), second.astype(np.int32)


def own(matrix: Matrix) -> Run:
    """This product: from contacts, so the matrix is made within."""
    mass = np.repeat(matrix.case.snapshot.mass[:, None], 2, axis=1)

    def factorised(factor: Any) -> Any:
        assert factor.factorise(matrix.theta)
        return factor

    def solve(factor: Any) -> Any:
        return factor.solve(matrix.right.reshape(-1, 2)).ravel()

    return Run(partial(factor_of, matrix.case, mass, len(mass) >= MANY), factorised, solve)


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
INSTALL = {"CHOLMOD": "pip install cvxopt", "PARDISO": "pip install pypardiso"}
MATRIX_HEAD = head(
    "crowd", "disks", "solver", "analyse", "factorise", "solve", "1 + 15 + 35 of them", "residual"
)


def matrix_rows(begin: list[str], case: Case) -> Iterator[str]:
    """A row of the table for each solver; the last column of times is one solution by 15
    factorisations and 35 solves."""
    matrix = Matrix.of(case)
    for name, make in SOLVERS.items():
        try:
            run = make(matrix)
        except ImportError:
            yield line([*begin, name, f"not installed: {INSTALL[name]}", *[""] * 4])
            continue
        one, plan = least(run.analyse)
        two, factor = least(partial(run.factorise, plan))
        three, x = least(partial(run.solve, factor))
        missed = np.abs(matrix.whole @ x - matrix.right).max()
        size = abs(matrix.whole).sum(axis=1).max() * np.abs(x).max() + np.abs(matrix.right).max()
        times = map(_milliseconds, (one, two, three, one + 15 * two + 35 * three))
        yield line([*begin, name, *times, f"{missed / size:.0e}"])


def _milliseconds(seconds: float) -> str:
    return (
        f"{float(f'{1e3 * seconds:.2g}'):,g} ms" if seconds < 0.0995 else f"{1e3 * seconds:,.0f} ms"
    )


ORDER_HEAD = head("crowd", "disks", "order", "found in", "entries", "longest column", "arithmetic")


def order_rows(begin: list[str], case: Case) -> Iterator[str]:
    """A row of the table for each order."""
    first, second = _ends(case)
    position, pair = case.snapshot.position, second >= 0
    joined = sparse.coo_array(
        (np.ones(pair.sum()), (first[pair], second[pair])), shape=[len(position)] * 2
    )
    graph = sparse.csr_array(joined + joined.T)
    orders: dict[str, Callable[[], Any]] = {
        "dissection": lambda: _core.dissect(position, first, second, LEAF)[0],
        "minimum degree, with structure": lambda: (
            factor_of(case, np.ones_like(position), False).order
        ),
    }
    try:
        import pymetis
    except ImportError:
        print("METIS is left out: pip install pymetis", file=sys.stderr)
    else:
        neighbours = pymetis.CSRAdjacency(graph.indptr, graph.indices)
        orders["METIS"] = lambda: pymetis.nested_dissection(neighbours)[0]
    for name, find in orders.items():
        seconds, order = least(find)
        column = columns(np.asarray(order), graph)
        sizes = f"{column.sum():,}", column.max(), f"{np.sum(column.astype(float) ** 2):.2g}"
        yield line([*begin, name, _milliseconds(seconds), *sizes])


def columns(order: Any, graph: Any) -> Any:
    """The entries (n,) of each column of the factor: what a disk touches when it is eliminated, all
    of which touch each other from then on."""
    n = len(order)
    place = np.empty(n, dtype=np.int64)
    place[order] = np.arange(n)
    later: list[set[int]] = [set() for _ in range(n)]
    count = np.ones(n, dtype=np.int64)
    for k, disk in enumerate(order):
        touched = graph.indices[graph.indptr[disk] : graph.indptr[disk + 1]]
        reach = later[k] | {int(p) for p in place[touched] if p > k}
        later[k] = set()
        count[k] += len(reach)
        if reach:
            parent = min(reach)
            later[parent] |= reach - {parent}
    return count


def main() -> None:
    """Print the tables as Markdown."""
    given = options(__doc__, "cases…")
    for name in ONE_THREAD:
        if os.environ.get(name) != "1":
            sys.exit(f"{name}: set it to 1, so that everyone has one thread")
    cases = [(path.name.partition("_")[0], read_case(path)) for path in given.cases]
    print(f"{describe()}\n\n{FRONT_HEAD}", flush=True)
    for pivots, rest in FRONTS:
        print(front_row(pivots, rest), flush=True)
    for names, rows in ((MATRIX_HEAD, matrix_rows), (ORDER_HEAD, order_rows)):
        print(f"\n{names}", flush=True)
        for family, case in cases:
            for row in rows([family, f"{len(case.snapshot):,}"], case):
                print(row, flush=True)


if __name__ == "__main__":
    main()
