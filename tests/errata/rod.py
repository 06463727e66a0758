"""The crowd of paper eq. (12) in one dimension, by linear finite elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import diags_array
from scipy.sparse.linalg import spsolve


@dataclass(frozen=True, kw_only=True)
class Rod:
    """A chain of people on 0 < x < l as a continuum: density ρ, k_v, k_s; a wall at l unless the
    chain is free.

    w = u⁺ + u⁻ solves ∫ρ w v + k_v ∫w'v' + s (k_s w(l) + μ) v(l) = 2 ∫ρ u⁻ v, where s = +1 is the
    wall condition +k_v w'(l) + k_s w(l) + μ = 0 and s = −1 the printed −k_v w'(l) + k_s w(l) + μ =
    0."""

    length: float = 10.0
    density: float = 7.0
    k_v: float = 9.0
    k_s: float = 1.0
    elements: int = 4000

    @property
    def x(self):
        return np.linspace(0.0, self.length, self.elements + 1)

    @property
    def mass(self):
        """Consistent mass matrix, ρ included."""
        step = self.length / self.elements
        diagonal = np.full(self.elements + 1, 2 / 3)
        diagonal[[0, -1]] = 1 / 3
        side = np.full(self.elements, 1 / 6)
        return self.density * step * diags_array([side, diagonal, side], offsets=[-1, 0, 1]).tocsc()

    @property
    def operator(self):
        """∫ρ w v + k_v ∫w'v'."""
        step = self.length / self.elements
        diagonal = np.full(self.elements + 1, 2.0)
        diagonal[[0, -1]] = 1.0
        side = np.full(self.elements, -1.0)
        stiffness = diags_array([side, diagonal, side], offsets=[-1, 0, 1]) / step
        return (self.mass + self.k_v * stiffness).tocsc()

    def free(self, left):
        """u⁺ of the chain without a wall."""
        return spsolve(self.operator, 2 * self.mass @ left) - left

    def leaving(self, left, sign=1):
        """u⁺ where the wall does not react (μ = 0)."""
        operator = self.operator.tolil()
        operator[-1, -1] += sign * self.k_s
        return spsolve(operator.tocsc(), 2 * self.mass @ left) - left

    def sticking(self, left, sign=1):
        """u⁺ with u⁺(l) = 0, and the reaction μ that this takes (positive where the wall
        pushes)."""
        operator, load = self.operator, 2 * self.mass @ left
        w = np.empty_like(left)
        w[-1] = left[-1]
        inner = operator[:-1, :-1]
        w[:-1] = spsolve(inner.tocsc(), load[:-1] - operator[:-1, [-1]].toarray().ravel() * w[-1])
        at_wall = float(load[-1] - (operator[[-1], :] @ w)[0])
        return w - left, sign * at_wall - self.k_s * w[-1]

    def solutions(self, left, sign=1):
        """Every admissible answer: stuck with μ ≥ 0, or leaving with u⁺(l) ≤ 0."""
        stuck, reaction = self.sticking(left, sign)
        away = self.leaving(left, sign)
        return [
            right
            for right, admissible in ((stuck, reaction >= 0), (away, away[-1] <= 0))
            if admissible
        ]

    def energy(self, velocity):
        """½ ∫ρ u² (J for each metre of width)."""
        return 0.5 * float(velocity @ (self.mass @ velocity))
