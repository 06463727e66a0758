"""Bound-constrained quadratic problems by a primal-dual active set, and what a residual allows to
say of an answer."""

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

from nscd.arrays import Floats, Indices, Mask
from nscd.percussions import Status


def judged(residual: float, tolerance: float, what: str, unsettled: str) -> tuple[Status, str]:
    """Judge an answer by its residual.

    residual, tolerance: dimensionless; solved where the residual is within the tolerance.
    what: what is computed, for the reason of a failure ("the pressure").
    unsettled: what to add to the reason of an inaccurate answer, empty if there is nothing."""
    if not np.isfinite(residual):
        return Status.FAILED, f"{what}: not a finite number"
    if residual > tolerance:
        return Status.INACCURATE, f"residual {residual:.1e} above {tolerance:.1e}{unsettled}"
    return Status.SOLVED, ""


class Bounded(NamedTuple):
    """Hold a minimum under bounds.

    z: (n,), the minimum.
    multiplier: (c,) ≥ 0, of the bounds.
    active: (c,), whether a bound holds.
    iterations, settled: of the active set, and whether it came to rest."""

    z: Floats
    multiplier: Floats
    active: Mask
    iterations: int
    settled: bool

    @property
    def unsettled(self) -> str:
        """What to say of a set that did not come to rest; empty if it did."""
        if self.settled:
            return ""
        return f". The active set did not settle in {self.iterations} iterations"


def bounded_minimum(
    matrix: sparse.csc_array,
    load: Floats,
    index: Indices,
    bound: Floats,
    *,
    start: Mask | None = None,
    max_rounds: int = 60,
) -> Bounded:
    """Minimise ½z·Az − b·z subject to z[place] ≤ bound.

    matrix: (n,n), A, symmetric positive definite.
    load: (n,), b.
    index, bound: (c,), which unknowns have a bound g, and which.
    start: (c,), the bounds that are held first; all by default.
    max_rounds: iterations at most.

    A primal-dual active set, a Newton method of a few sparse factorisations: a bound holds next
    where r + A_ii(z − g) > 0. It need not converge for every A; where a set comes back, only the
    bound with the largest violation changes from then on. Hintermüller, Ito, Kunisch, SIAM J.
    Optim. 13 (2003) 865–888."""
    diagonal = matrix.diagonal()[index]
    active = np.ones(len(index), dtype=bool) if start is None else start.copy()
    visited: set[bytes] = set()
    careful = False
    for iteration in range(1, max_rounds + 1):
        z = _minimum(matrix, load, index[active], bound[active])
        multiplier = (load - matrix @ z)[index]
        multiplier[~active] = 0.0
        wanted = multiplier + diagonal * (z[index] - bound) > 0
        # a bound that is held has z = g: it is left when its multiplier is not positive
        changes = np.flatnonzero(wanted != active)
        if len(changes) == 0:
            return Bounded(z, multiplier, active, iteration, True)
        visited.add(active.tobytes())
        careful = careful or wanted.tobytes() in visited
        if careful:
            size = np.abs(multiplier + diagonal * (z[index] - bound))[changes]
            wanted = active.copy()
            wanted[changes[np.argmax(size)]] ^= True
        active = wanted
    return Bounded(z, multiplier, active, max_rounds, False)


def factorised(matrix: sparse.csc_array) -> Any:
    """Factorise a symmetric positive definite matrix, with minimum degree on its own pattern: the
    fill of that on AᵀA (COLAMD) is twice as large."""
    symmetric = {"SymmetricMode": True}
    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=symmetric)


def _minimum(matrix: sparse.csc_array, load: Floats, fixed: Indices, value: Floats) -> Floats:
    """The z (n,) of least ½z·Az − b·z with z[fixed] = value."""
    z = np.zeros(len(load))
    z[fixed] = value
    free = np.setdiff1d(np.arange(len(load)), fixed)
    if len(free):
        inner = sparse.csc_array(matrix[free][:, free])
        z[free] = factorised(inner).solve((load - matrix @ z)[free])
    return z
