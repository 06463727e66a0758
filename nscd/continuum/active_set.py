"""Bound-constrained quadratic problems by a primal-dual active set, and what a residual allows to
say of an answer."""

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

from nscd.arrays import Flags, Floats, Indices
from nscd.percussions import Status

# Up to this many changed bounds, solving with the last factorisation is cheaper than a new one
# (measured from 25,000 unknowns).
MOST_CHANGES = 20


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
    active: Flags
    iterations: int
    settled: bool

    @property
    def unsettled(self) -> str:
        """What to say of a set that did not come to rest; empty if it did."""
        if self.settled:
            return ""
        return f"; the active set did not settle in {self.iterations} iterations"


def bounded_minimum(
    matrix: sparse.csc_array,
    load: Floats,
    place: Indices,
    bound: Floats,
    *,
    start: Flags | None = None,
    most: int = 60,
) -> Bounded:
    """Minimise ½z·Az − b·z subject to z[place] ≤ bound.

    matrix: (n,n), A, symmetric positive definite.
    load: (n,), b.
    place, bound: (c,), which unknowns have a bound g, and which.
    start: (c,), the bounds that are held first; all by default.
    most: iterations at most.

    A primal-dual active set, a Newton method of a few sparse factorisations: a bound holds next
    where r + A_ii(z − g) > 0. It need not converge for every A; where a set comes back, only the
    bound with the largest violation changes from then on. Hintermüller, Ito, Kunisch, SIAM J.
    Optim. 13 (2003) 865–888."""
    diagonal = matrix.diagonal()[place]
    active = np.ones(len(place), dtype=bool) if start is None else start.copy()
    problem = _Factored(matrix, load)
    seen: set[bytes] = set()
    careful = False
    for iteration in range(1, most + 1):
        z = problem.minimum(place[active], bound[active])
        multiplier = (load - matrix @ z)[place]
        multiplier[~active] = 0.0
        wanted = multiplier + diagonal * (z[place] - bound) > 0
        # a bound that is held has z = g: it is left when its multiplier is not positive
        changes = np.flatnonzero(wanted != active)
        if len(changes) == 0:
            return Bounded(z, multiplier, active, iteration, True)
        seen.add(active.tobytes())
        careful = careful or wanted.tobytes() in seen
        if careful:
            size = np.abs(multiplier + diagonal * (z[place] - bound))[changes]
            wanted = active.copy()
            wanted[changes[np.argmax(size)]] ^= True
        active = wanted
    return Bounded(z, multiplier, active, most, False)


def factorised(matrix: sparse.csc_array) -> Any:
    """Factorise a symmetric positive definite matrix, with minimum degree on its own pattern: the
    fill of that on AᵀA (COLAMD) is twice as large."""
    symmetric = {"SymmetricMode": True}
    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=symmetric)


class _Factored:
    """Minima of ½z·Az − b·z with some z fixed: a factorisation, kept while few fixed values
    change."""

    def __init__(self, matrix: sparse.csc_array, load: Floats) -> None:
        self.matrix, self.load = matrix, load
        self.free: Flags = np.zeros(0, dtype=bool)
        self.factor: Any = None

    def minimum(self, fixed: Indices, value: Floats) -> Floats:
        """z (n,) with z[fixed] = value."""
        free = np.ones(len(self.load), dtype=bool)
        free[fixed] = False
        z = np.zeros(len(self.load))
        z[fixed] = value
        if not free.any():
            return z
        if self.factor is None or (free != self.free).sum() > MOST_CHANGES:
            self.factor = factorised(self.matrix[free][:, free].tocsc())
            self.free = free
        released, caught = np.flatnonzero(free & ~self.free), np.flatnonzero(self.free & ~free)
        pinned = z[caught]
        z[caught] = 0.0
        right = self.load - self.matrix @ z
        if len(released) + len(caught) == 0:
            z[free] = self.factor.solve(right[free])
            return z
        # the factored block bordered by what was released, and by multipliers that hold what was
        # caught
        old, r = np.flatnonzero(self.free), len(released)
        border = np.zeros((len(old), r + len(caught)))
        border[:, :r] = self.matrix[:, released].toarray()[old]
        border[np.searchsorted(old, caught), r + np.arange(len(caught))] = 1.0
        corner = np.zeros((border.shape[1],) * 2)
        corner[:r, :r] = self.matrix[:, released].toarray()[released]
        inner = self.factor.solve(right[old])
        schur = corner - border.T @ self.factor.solve(border)
        outer = np.linalg.solve(schur, np.concatenate([right[released], pinned]) - border.T @ inner)
        z[old] = self.factor.solve(right[old] - border @ outer)
        z[released], z[caught] = outer[:r], pinned
        return z
