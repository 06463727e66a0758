"""The percussions without dissipation as a quadratic problem in scaled variables, as solvers want
it.

Primal: min ½|y|² − y⁻·y subject to G y ≤ 0, with y = √m u / (√m̄ ‖u⁻‖∞), G = C M^(−1/2) with rows
divided by √w, and multipliers z = √w λ / (√m̄ ‖u⁻‖∞). Dual: min ½ z·GGᵀz − z·Gy⁻ subject to z ≥ 0.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sparse
from families import Case


class Scaled(NamedTuple):
    """The problem in scaled variables; `reaction` (k,) and `velocity` (2n,) turn z and y into N·s
    and m/s."""

    left: Any  # y⁻ (2n,)
    rows: Any  # G (k, 2n)
    reaction: Any
    velocity: Any

    @property
    def identity(self) -> Any:
        return sparse.identity(len(self.left), format="csc")

    @property
    def delassus(self) -> Any:
        """GGᵀ (k, k), with ones on its diagonal."""
        return sparse.csc_matrix(self.rows @ self.rows.T)

    @property
    def approach(self) -> Any:
        """G y⁻ (k,)."""
        return self.rows @ self.left


class Answer(NamedTuple):
    """z (k,), y (2n,) if the solver has one, and its CPU seconds if it had to run in another
    process."""

    multiplier: Any
    velocity: Any | None = None
    seconds: float | None = None


Solver = Callable[[float], Answer]


def scaled(case: Case) -> Scaled:
    """The problem of a case in scaled variables."""
    n = len(case.snapshot)
    mass = np.repeat(case.snapshot.mass, 2)
    weight = np.sqrt(case.contacts.inverse_mass(case.snapshot.mass))
    left = case.left_velocity.ravel()
    size = np.sqrt(mass.mean()) * np.abs(left).max()
    rows = (
        sparse.diags_array(1 / weight)
        @ case.contacts.normal_matrix(n)
        @ sparse.diags_array(mass**-0.5)
    )
    return Scaled(
        left * np.sqrt(mass) / size, sparse.csc_matrix(rows), size / weight, size / np.sqrt(mass)
    )
