"""Solvers of the frictionless percussions: this product's, others, each in the formulation and with
the settings that served it best, and those that qpsolvers lists, as they come through it, on the
primal.

A solver is a function that brings the problem (see `scaled`) into its own matrices and returns the
function that is timed, so that conversions are not counted against it.

That function takes the accuracy to ask for. Interior points are asked for a number of iterations
instead, and for more until our residual is reached: what they stop at themselves bounds ours badly,
and beyond it some go on for hundreds in vain."""

import json
import subprocess
import tempfile
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sparse

from benchmarks.cases import Scaled, Solver, SolverResult
from benchmarks.problems.families import Case, heap
from nscd import solve
from nscd.solve import SOLVERS

SYSTEM_PYTHON = Path("/usr/bin/python3")  # python3-siconos lives with the system's own interpreter
SICONOS = Path(__file__).parents[1] / "processes" / "by_siconos.py"
INSTALL_SICONOS = "apt-get install python3-siconos"
# How the words begin that say how to get a solver.
MISSING = "not installed"
TINY = 1e-15
ITERATIONS = (6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30, 33, 36, 40, 45, 50, 60, 80, 120)
TIGHT = (1e-10, 1e-11, 1e-12, 1e-13, 1e-14, 1e-15)
LOOSE = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10)  # for a method that polishes what it found
NEAR = (1e-8, 1e-9, 1e-10, 1e-11, 1e-12)  # for methods that stop at a residual much like ours
# `auto` with the choice among the reactions of redundant contacts that `solve` makes by default and
# peers do not make
CANONICAL = "auto, canonical"


class Peer(NamedTuple):
    """Variants by name, what to ask for (loosest first: tolerances, or iterations) and the command
    that installs it."""

    variants: dict[str, Callable[[Scaled], Solver]]
    requested: tuple[float, ...]
    install: str = ""

    @property
    def by_iterations(self) -> bool:
        """Whether it is asked for a number of iterations rather than for a tolerance."""
        return self.requested[0] >= 1


def own(problem: Scaled, name: str) -> Solver:
    """This product's solver of that name, with its kernels loaded, from the snapshot and its
    contacts on."""
    canonical = name == CANONICAL
    way = {"solver": "auto" if canonical else name, "canonical": canonical}

    def solved(case: Case, tolerance: float) -> SolverResult:
        left = case.left_velocity
        found = solve(case.snapshot, case.contacts, left_velocity=left, tolerance=tolerance, **way)
        return SolverResult(found.reaction, found.right_velocity.ravel(), None, found.iterations)

    solved(heap(100), 1e-8)
    return partial(solved, problem.case)


def piqp(problem: Scaled, step: float, dual: bool) -> Solver:
    """PIQP on the primal with the inequalities eliminated from its KKT matrix (I + GᵀΘG), or on the
    dual. `step` is the share of the way to the boundary that an iteration goes."""
    import piqp as package

    matrix, linear, rows, low, high = problem.program(dual)

    def solve(iterations: float) -> SolverResult:
        solver = package.SparseSolver()
        settings = solver.settings
        settings.eps_abs, settings.eps_rel, settings.max_iter = TINY, 0.0, int(iterations)
        settings.check_duality_gap, settings.tau = False, step
        if dual:
            solver.setup(matrix, linear, None, None, None, None, None, low, high)
        else:
            settings.kkt_solver = package.KKTSolver.sparse_ldlt_ineq_cond
            solver.setup(matrix, linear, None, None, rows, None, high)
        solver.solve()
        return problem.of(dual, solver.result.x, solver.result.z_u)

    return solve


def clarabel(problem: Scaled, regularisation: float | None = None, step: float = 0.99) -> Solver:
    """Clarabel on the primal; `step` as for PIQP."""
    import clarabel as package

    matrix, linear, rows, _, high = problem.program(dual=False)
    cones = [package.NonnegativeConeT(len(high))]

    def solve(iterations: float) -> SolverResult:
        settings = package.DefaultSettings()
        settings.verbose, settings.presolve_enable, settings.max_threads = False, False, 1
        settings.tol_feas = settings.tol_gap_abs = settings.tol_gap_rel = TINY
        settings.max_iter, settings.max_step_fraction = int(iterations), step
        if regularisation is not None:
            settings.static_regularization_constant = regularisation
            settings.static_regularization_proportional = 0.0
        found = package.DefaultSolver(matrix, linear, rows, high, cones, settings).solve()
        return problem.solution(found.z, found.x)

    return solve


def osqp(problem: Scaled, step: float, dual: bool) -> Solver:
    """OSQP with polishing: the identified active set is solved for at the end, so that a loose
    tolerance may do."""
    import osqp as package

    matrix, *inputs = problem.program(dual)
    upper = sparse.triu(matrix, format="csc")
    settings = {"eps_rel": 0.0, "rho": step, "max_iter": 200_000, "verbose": False}
    settings |= {"polishing": True, "polish_refine_iter": 10}

    def solve(tolerance: float) -> SolverResult:
        solver = package.OSQP()
        solver.setup(upper, *inputs, eps_abs=tolerance, **settings)
        found = solver.solve(raise_error=False)
        return problem.of(dual, found.x, found.y)

    return solve


def cvxopt(problem: Scaled, dual: bool) -> Solver:
    """cvxopt's coneqp with its own choice of KKT solver."""
    import cvxopt as package
    from cvxopt import solvers

    def converted(matrix: Any) -> Any:
        a = sparse.coo_array(matrix)
        return package.spmatrix(a.data, a.coords[0].astype(int), a.coords[1].astype(int), a.shape)

    matrix, linear, rows, *_ = problem.program(dual)
    inputs = converted(matrix), package.matrix(linear), converted(-rows if dual else rows)
    none = package.matrix(0.0, (rows.shape[0], 1))

    def solve(iterations: float) -> SolverResult:
        ends = dict.fromkeys(("abstol", "reltol", "feastol"), TINY)
        solvers.options.update(show_progress=False, maxiters=int(iterations), **ends)
        found = solvers.qp(*inputs, none)
        return problem.of(dual, *(np.array(found[name]).ravel() for name in ("x", "z")))

    return solve


def qpalm(problem: Scaled, penalty: float) -> Solver:
    """QPALM on the primal."""
    import qpalm as package

    data = package.Data(*problem.rows.shape[::-1])
    data.Q, data.q, data.A, data.bmin, data.bmax = problem.program(dual=False)

    def solve(tolerance: float) -> SolverResult:
        settings = package.Settings()
        settings.eps_abs, settings.eps_rel, settings.sigma_init = tolerance, 0.0, penalty
        settings.max_iter, settings.verbose, settings.nonconvex = 20_000, False, False
        solver = package.Solver(data, settings)
        solver.solve()
        return problem.solution(solver.solution.y, solver.solution.x)

    return solve


def qoco(problem: Scaled) -> Solver:
    """QOCO on the primal; by tolerance, since it has no answer when it runs out of iterations."""
    import qoco as package

    k, n = problem.rows.shape
    matrix, linear, rows, _, high = problem.program(dual=False)
    inputs = (n, k, 0, matrix, linear, None, None, rows, high, k, 0)

    def solve(tolerance: float) -> SolverResult:
        solver = package.QOCO()
        ends = {"abstol": tolerance, "reltol": tolerance}
        solver.setup(*inputs, np.zeros(0, dtype=np.int32), **ends, verbose=0)
        found = solver.solve()
        return problem.solution(found.z, found.x)

    return solve


def proxqp(problem: Scaled) -> Solver:
    """ProxQP on the dual with its sparse factorisation, faster here than on the primal or without
    matrices."""
    from proxsuite import proxqp as package

    matrix, linear, identity, low, _ = problem.program(dual=True)
    values = matrix, linear, None, None, identity, low, np.full_like(low, 1e20)

    def solve(tolerance: float) -> SolverResult:
        solver = package.sparse.QP(len(low), 0, len(low))
        solver.settings.eps_abs, solver.settings.eps_rel = tolerance, 0.0
        solver.settings.sparse_backend = package.SparseBackend.SparseCholesky
        solver.init(*values)
        solver.solve()
        return problem.solution(solver.results.x)

    return solve


@cache
def has_siconos() -> bool:
    """Whether the system's Python has Siconos."""
    probe = [str(SYSTEM_PYTHON), "-c", "import siconos.numerics"]
    run = subprocess.run
    return SYSTEM_PYTHON.exists() and not run(probe, capture_output=True, check=False).returncode


def siconos(
    matrix: Any, free: Any, solver: str, tolerance: float, iterations: int, friction: Any = ()
) -> tuple[Any, float]:
    """The reactions that a solver of Siconos (see processes/by_siconos.py) finds in the system's Python,
    and its CPU seconds. Raises ImportError where it is missing."""
    if not has_siconos():
        raise ImportError("siconos")
    parts = {name: getattr(matrix, name) for name in ("data", "indices", "indptr")}
    with tempfile.TemporaryDirectory() as folder:
        input_file, found = Path(folder) / "given.npz", Path(folder) / "found.npy"
        np.savez(input_file, free=free, friction=friction, **parts)
        words = [SYSTEM_PYTHON, SICONOS, input_file, solver, tolerance, iterations, found]
        output = subprocess.run([str(w) for w in words], capture_output=True, text=True, check=True)
        return np.load(found), float(json.loads(output.stdout.splitlines()[-1])["seconds"])


def projected_gauss_seidel(problem: Scaled) -> Solver:
    """Siconos' projected Gauss–Seidel on the complementarity problem with a sparse matrix."""
    if not has_siconos():
        raise ImportError("siconos")
    matrix, free, *_ = problem.program(dual=True)

    def solve(tolerance: float) -> SolverResult:
        found, seconds = siconos(matrix, free, "PGS", tolerance, 10_000_000)
        return problem.solution(found, None, seconds)

    return solve


# Those of qpsolvers that take dense matrices are not asked beyond so many unknowns: their time grows
# with the cube.
MOST_DENSE = 2000
# How each is told what to reach; others do as they do.
TOLERANCES: dict[str, Callable[[float], dict[str, Any]]] = {
    "daqp": lambda t: {"primal_tol": t, "dual_tol": t},
    "ecos": lambda t: {"feastol": t, "abstol": t, "reltol": t},
    "highs": lambda t: {"primal_feasibility_tolerance": t, "dual_feasibility_tolerance": t},
    "scs": lambda t: {"eps_abs": t, "eps_rel": 0.0},
}
NAMES = ("daqp", "ecos", "gurobi", "highs", "hpipm", "kvxopt", "mosek", "qpoases", "qpswift",
         "quadprog", "scs")  # fmt: skip


def listed(problem: Scaled, name: str) -> Solver:
    """The solver of this name. Raises ImportError where qpsolvers, or what it calls, is missing."""
    import qpsolvers as package

    if name not in package.available_solvers:
        raise ImportError(name)
    matrix, linear, rows, _, high = problem.program(dual=False)
    if name in package.dense_solvers:
        if len(linear) > MOST_DENSE:
            raise MemoryError(f"dense matrices of {len(linear)} unknowns")
        matrix, rows = matrix.toarray(), rows.toarray()
    inputs = package.Problem(matrix, linear, rows, high)
    settings = TOLERANCES.get(name, lambda _: {})

    def solve(tolerance: float) -> SolverResult:
        found = package.solve_problem(inputs, name, **settings(tolerance))
        return problem.solution(found.z, found.x)

    return solve


VARIANTS: dict[str, dict[str, Callable[[Scaled], Solver]]] = {
    "piqp": {
        "primal": partial(piqp, step=0.99, dual=False),
        "primal, step 0.999": partial(piqp, step=0.999, dual=False),
        "dual": partial(piqp, step=0.99, dual=True),
        "dual, step 0.999": partial(piqp, step=0.999, dual=True),
    },
    "clarabel": {
        "default": clarabel,
        "regularisation 1e-13": partial(clarabel, regularisation=1e-13),
        "regularisation 1e-13, step 0.999": partial(clarabel, regularisation=1e-13, step=0.999),
    },
    "osqp": {
        "dual, rho 0.3": partial(osqp, step=0.3, dual=True),
        "primal, rho 100": partial(osqp, step=100.0, dual=False),
        "primal, rho 10": partial(osqp, step=10.0, dual=False),
    },
    "qoco": {"default": qoco},
    "cvxopt": {"primal": partial(cvxopt, dual=False), "dual": partial(cvxopt, dual=True)},
    "qpalm": {"sigma 20": partial(qpalm, penalty=20.0), "sigma 200": partial(qpalm, penalty=200.0)},
    "proxqp": {"dual": proxqp},
    "siconos": {"projected Gauss–Seidel": projected_gauss_seidel},
}
ASKED = {"osqp": LOOSE, "qoco": TIGHT} | dict.fromkeys(("qpalm", "proxqp", "siconos"), NEAR)
INSTALL = {"proxqp": "pip install proxsuite", "siconos": INSTALL_SICONOS}
OWN = {n: Peer({"": partial(own, name=n)}, (1e-10, 1e-11, 1e-12)) for n in (*SOLVERS, CANONICAL)}
PEERS = {
    n: Peer(some, ASKED.get(n, ITERATIONS), INSTALL.get(n, f"pip install {n}"))
    for n, some in VARIANTS.items()
}
LISTED = {
    f"qpsolvers {n}": Peer({"": partial(listed, name=n)}, NEAR, f"pip install qpsolvers[{n}]")
    for n in NAMES
}
EVERYONE = OWN | PEERS | LISTED
