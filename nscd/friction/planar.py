"""Contact problems in the plane that are given by their matrix alone, whatever the bodies are."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from nscd import _core
from nscd.arrays import Floats

# Gauss–Seidel sweeps between two looks at the residual, and at most.
SWEEPS, MOST_SWEEPS = 50, 100_000
# The linear system of the contacts' states is solved densely up to so many rows.
MOST_ROWS = 2000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlanarAnswer:
    """Hold the answer of a planar problem.

    reaction, velocity: (k,2), r and u, each along the normal and across
    residual: dimensionless, the natural map over max |q|
    sweeps: how many it took"""

    reaction: Floats
    velocity: Floats
    residual: float
    sweeps: int


def solve_planar(
    matrix: csr_array, free: Floats, friction: Floats, tolerance: float = 1e-8
) -> PlanarAnswer:
    """Solve u = W r + q, 0 ≤ r_n ⟂ u_n ≥ 0, |r_t| ≤ μ r_n, r_t u_t = −μ r_n |u_t|.

    matrix: W (2k,2k), positive semi-definite, rows in the order normal, tangent of each contact
    free: q (2k,); friction: μ (k,)

    Gauss–Seidel over contacts in the native core, each solved exactly; in between the linear system of the contacts'
    states (open, stuck, sliding) is tried. Raises ValueError for a contact without a diagonal entry
    of its normal. Source: Jean, Comput. Methods Appl. Mech. Eng. 177 (1999) 235.

    >>> alone = solve_planar(csr_array(np.eye(2)), np.array([-1.0, 2.0]), np.array([0.5]))
    >>> alone.reaction.tolist()  # slides: the tangent has half of the normal
    [[1.0, -0.5]]"""
    w = csr_array(matrix)
    diagonal = w.diagonal()
    if (diagonal[::2] <= 0).any():
        row = int(np.argmin(diagonal[::2]))
        raise ValueError(f"W: contact {row + 1}: its diagonal entry is not positive")
    scale = float(np.abs(free).max(initial=0.0)) or 1.0
    rows = w.indptr.astype(np.int32), w.indices.astype(np.int32), w.data
    free, friction = (np.ascontiguousarray(one, dtype=float) for one in (free, friction))
    r = np.zeros(len(free))
    best, smallest, sweeps = r, _residual(w, free, friction, diagonal, r) / scale, 0
    while smallest > tolerance and sweeps < MOST_SWEEPS:
        _core.planar_sweeps(*rows, free, friction, r, SWEEPS)
        sweeps += SWEEPS
        tries = [r.copy()]
        if len(free) <= MOST_ROWS and (sweeps // SWEEPS) & (sweeps // SWEEPS - 1) == 0:
            tries.append(_by_states(w, free, friction, diagonal, r))
        for one in tries:
            error = _residual(w, free, friction, diagonal, one) / scale
            if error < smallest:
                best, smallest = one, error
    velocity = w @ best + free
    return PlanarAnswer(
        reaction=best.reshape(-1, 2),
        velocity=velocity.reshape(-1, 2),
        residual=smallest,
        sweeps=sweeps,
    )


def natural_map(matrix: csr_array, free: Floats, friction: Floats, reaction: Floats) -> float:
    """Recompute how far reactions r (2k,) are from an answer of `solve_planar`'s problem: the
    largest |min(W_nn r_n, u_n)| and W_tt |r_t − Π(r_t − u_t/W_tt)| over max |q|, Π onto |r_t| ≤
    μ r_n. It is 0 for an answer and nothing else; infinite where r is not finite."""
    if not np.isfinite(reaction).all():
        return math.inf
    scale = float(np.abs(free).max(initial=0.0)) or 1.0
    return _residual(matrix, free, friction, matrix.diagonal(), reaction) / scale


def _residual(w: Any, q: Floats, friction: Floats, diagonal: Floats, r: Floats) -> float:
    """The largest |min(W_nn r_n, u_n)| and W_tt |r_t − Π(r_t − u_t/W_tt)|, Π: onto |r_t| ≤ μ
    r_n."""
    u = w @ r + q
    limit = friction * np.maximum(r[::2], 0.0)
    weight = np.where(diagonal[1::2] > 0, diagonal[1::2], diagonal[::2])
    wanted = np.clip(r[1::2] - u[1::2] / weight, -limit, limit)
    errors = [np.minimum(diagonal[::2] * r[::2], u[::2]), weight * (r[1::2] - wanted)]
    return max(float(np.abs(error).max(initial=0.0)) for error in errors)


def _by_states(w: Any, q: Floats, friction: Floats, diagonal: Floats, r: Floats) -> Floats:
    """The reactions nearest to r that solve the linear system of its contacts' states."""
    u = w @ r + q
    closed = r[::2] - u[::2] / diagonal[::2] > 0
    weight = np.where(diagonal[1::2] > 0, diagonal[1::2], diagonal[::2])
    wanted, limit = r[1::2] - u[1::2] / weight, friction * np.maximum(r[::2], 0.0)
    sliding = closed & (np.abs(wanted) >= limit)
    active = np.repeat(closed, 2)
    system, right = w.toarray(), -u
    rows = np.flatnonzero(sliding)
    across = 2 * rows + 1
    system[across] = 0.0
    system[across, across] = 1.0
    fraction = np.sign(wanted[rows]) * friction[rows]
    system[across, 2 * rows] = -fraction
    right[across] = fraction * r[2 * rows] - r[across]
    best = np.where(active, r, 0.0)
    # what opens gives its part of the velocity back
    right[active] += (system[active][:, ~active] @ r[~active]) if not closed.all() else 0.0
    step = np.linalg.lstsq(system[np.ix_(active, active)], right[active], rcond=1e-12)[0]
    best[active] += step
    return best
