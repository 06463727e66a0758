"""A chain of people as a continuum against a wall, in closed form (paper (12)–(14), corrected)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from skfem import MeshLine

from nscd.arrays import Floats
from nscd.continuum.medium import Medium


def chain_mesh(length: float, cells: int) -> MeshLine:
    """Divide 0 ≤ x ≤ length (m) into equal cells, "wall" at the end, "free" at the start.

    Raises ValueError for a length that is not positive or fewer than one cell.
    """
    if not (length > 0 and np.isfinite(length)):
        raise ValueError(f"length: {length:g} m; a positive number is needed")
    if cells < 1:
        raise ValueError(f"cells: {cells}; at least 1 is needed")
    mesh = MeshLine(np.linspace(0.0, length, cells + 1))
    return mesh.with_boundaries({"wall": lambda x: x[0] == length, "free": lambda x: x[0] == 0.0})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chain:
    """Solve the collision of a uniform chain against a wall at x = l exactly.

    medium: ρ in kg/m, k_v in kg m, k_s in kg, as is right in one dimension.
    length: m, l.
    left_velocity: m/s, U, uniform.

    With h = √(k_v/ρ), κ = k_s h/k_v, L = l/h the crowd sticks where κ ≤ tanh L and rebounds
    otherwise with u⁺(l) = −eU, e = (κ − tanh L)/(κ + tanh L).

    Raises ValueError for a left velocity that leaves the wall or a density that is not one number.
    """

    medium: Medium
    length: float
    left_velocity: float

    def __post_init__(self) -> None:
        if np.ndim(self.medium.density):
            raise ValueError("density: the closed form needs one number")
        if not self.left_velocity >= 0:
            raise ValueError(f"left_velocity: {self.left_velocity:g} m/s leaves the wall")

    @property
    def kappa(self) -> float:
        """κ = k_s h/k_v, what the wall dissipates against the crowd."""
        return self.medium.k_s * self.medium.length / self.medium.k_v

    @property
    def sticks(self) -> bool:
        """Whether u⁺(l) = 0."""
        return self.kappa <= float(np.tanh(self.length / self.medium.length))

    @property
    def restitution(self) -> float:
        """e with u⁺(l) = −eU; 0 where the chain sticks."""
        tanh = float(np.tanh(self.length / self.medium.length))
        return max(0.0, (self.kappa - tanh) / (self.kappa + tanh))

    @property
    def wall_percussion(self) -> float:
        """kg m/s, μ = U(√(k_vρ) tanh L − k_s), 0 where the chain rebounds."""
        h = self.medium.length
        impedance = self.medium.k_v / h
        return max(
            0.0,
            self.left_velocity * (impedance * float(np.tanh(self.length / h)) - self.medium.k_s),
        )

    @property
    def _amplitude(self) -> float:
        """w = U·amplitude·cosh(x/h)/cosh L."""
        tanh = float(np.tanh(self.length / self.medium.length))
        return 1.0 if self.sticks else 2 * self.kappa / (tanh + self.kappa)

    def right_velocity(self, x: ArrayLike) -> Floats:
        """Compute u⁺ (m/s) at x (m): U[1 − cosh(x/h)/cosh L], or U[1 − 2κ cosh(x/h)/(sinh L + κ
        cosh L)] where it rebounds.
        """
        return self.left_velocity * (1.0 - self._amplitude * self._ratio(x, 1.0))

    def internal_percussion(self, x: ArrayLike) -> Floats:
        """Compute r_int = −σ = −k_v ∂w/∂x (kg m/s) at x (m), positive in compression: (14) with the
        k_v that it lacks.
        """
        slope: Floats = self.left_velocity * self._amplitude * self._ratio(x, -1.0)
        return self.medium.k_v / self.medium.length * slope

    def _ratio(self, x: ArrayLike, sign: float) -> Floats:
        """cosh(x/h)/cosh L (sign 1) or sinh(x/h)/cosh L (sign −1), without overflow."""
        h = self.medium.length
        s, end = np.asarray(x, dtype=np.float64) / h, self.length / h
        ratio: Floats = np.exp(s - end) * (1 + sign * np.exp(-2 * s)) / (1 + np.exp(-2 * end))
        return ratio
