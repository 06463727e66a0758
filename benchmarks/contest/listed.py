"""Solvers that qpsolvers lists and that have no adapter of their own (`contest/peers.py`), as they
come through it, on the primal."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from cases import Answer, Scaled, Solver
from contest.peers import NEAR, Peer

# Those that take dense matrices are not asked beyond so many unknowns: their time grows with the
# cube.
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
    k, n = problem.rows.shape
    matrices = problem.identity, -problem.left, problem.rows, np.zeros(k)
    if name in package.dense_solvers:
        if n > MOST_DENSE:
            raise MemoryError(f"dense matrices of {n} unknowns")
        matrices = matrices[0].toarray(), matrices[1], matrices[2].toarray(), matrices[3]
    given = package.Problem(*matrices)
    settings = TOLERANCES.get(name, lambda _: {})

    def solve(tolerance: float) -> Answer:
        found = package.solve_problem(given, name, **settings(tolerance))
        return Answer(np.asarray(found.z), np.asarray(found.x))

    return solve


LISTED = tuple(
    Peer(
        f"qpsolvers {name}",
        {"": partial(listed, name=name)},
        NEAR,
        f"pip install qpsolvers[{name}]",
    )
    for name in NAMES
)
