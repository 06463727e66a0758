"""Half an annulus of people pressed to its middle: the exact case in the plane."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import quad
from scipy.special import iv, ivp, kv, kvp, modstruve
from skfem import Mesh, MeshTri, MeshTri2

from nscd.arrays import Floats
from nscd.continuum.medium import Medium


@dataclass(frozen=True, kw_only=True, eq=False)
class HalfAnnulus:
    """Solve the collision of a crowd on a ≤ r ≤ R, x ≤ 0 that walks to the middle exactly.

    medium: with k_s = 0.
    inner, outer: m, a and R: the inner arc is the exit, the outer one a free border.
    speed: m/s, U, u⁻ = −U r̂ along a straight wall on x = 0.
    push: N·s/m, r_ext, along r̂ on the free border.

    w = f(r) r̂ with f″ + f′/r − f/r² − f/h² = 2U/h², f′(a) = 0, k_v f′(R) = r_ext, so that f = πU
    L₁(r/h) + A I₁(r/h) + B K₁(r/h) with the modified Struve and Bessel functions. It holds where
    the wall presses everywhere, f < 0.

    Raises ValueError for radii that are not 0 < a < R, a density that is not one number, surface
    dissipation, or a wall that would not press everywhere.
    """

    medium: Medium
    inner: float
    outer: float
    speed: float
    push: float = 0.0

    def __post_init__(self) -> None:
        if not 0 < self.inner < self.outer < np.inf:
            raise ValueError(
                f"inner, outer: {self.inner:g}, {self.outer:g} m; 0 < inner < outer is needed"
            )
        if np.ndim(self.medium.density):
            raise ValueError("density: the closed form needs one number")
        if self.medium.k_s > 0:
            raise ValueError("surface_dissipation: the closed form needs none")
        if self.radial(np.linspace(self.inner, self.outer, 100)).max() >= 0:
            raise ValueError(
                "speed, push: the crowd leaves the wall; the closed form needs it pressed"
            )

    @cached_property
    def _coefficients(self) -> Floats:
        """A, B."""
        h, struve = self.medium.length, np.pi * self.speed
        a, R = self.inner / h, self.outer / h
        matrix = np.array([[ivp(1, a), kvp(1, a)], [ivp(1, R), kvp(1, R)]])
        right = [
            -struve * _struve_slope(a),
            h * self.push / self.medium.k_v - struve * _struve_slope(R),
        ]
        return np.asarray(np.linalg.solve(matrix, right))

    def radial(self, r: ArrayLike) -> Floats:
        """Compute f(r), the velocity sum w along r̂, m/s."""
        z, (a, b) = np.asarray(r) / self.medium.length, self._coefficients
        return np.asarray(np.pi * self.speed * modstruve(1, z) + a * iv(1, z) + b * kv(1, z))

    def slope(self, r: ArrayLike) -> Floats:
        """Compute f′(r), 1/s."""
        h, (a, b) = self.medium.length, self._coefficients
        z = np.asarray(r) / h
        return np.asarray(
            (np.pi * self.speed * _struve_slope(z) + a * ivp(1, z) + b * kvp(1, z)) / h
        )

    def velocity_sum(self, x: Floats) -> Floats:
        """Compute w = f r̂, (2,…) m/s, at the points (2,…) m."""
        r = np.hypot(*x)
        return np.asarray(self.radial(r) * x / r)

    def strain(self, x: Floats) -> Floats:
        """Compute D(w) = f′ r̂⊗r̂ + (f/r)(1 − r̂⊗r̂), (2,2,…) 1/s."""
        r = np.hypot(*x)
        along = (x / r)[:, None] * (x / r)[None]
        one = np.eye(2).reshape(2, 2, *(1,) * r.ndim)
        return np.asarray(self.slope(r) * along + self.radial(r) / r * (one - along))

    def pressure(self, x: Floats) -> Floats:
        """Compute p = −½k_v(f′ + f/r), N·s/m."""
        r = np.hypot(*x)
        return np.asarray(-0.5 * self.medium.k_v * (self.slope(r) + self.radial(r) / r))

    @property
    def wall_force(self) -> float:
        """N·s, ∫μ = −2k_v∫f/r dr over both halves of the wall."""
        integral = quad(lambda s: float(self.radial(s)) / s, self.inner, self.outer, epsabs=1e-13)[
            0
        ]
        return -2 * self.medium.k_v * float(integral)

    def left_velocity(self, points: Floats) -> Floats:
        """Compute u⁻ = −U r̂, (m,2) m/s, at points (m,2) m."""
        return np.asarray(-self.speed * points / np.hypot(*points.T)[:, None])

    def external(self, points: Floats) -> Floats:
        """Compute r_ext r̂, (m,2) N·s/m, at points (m,2) m."""
        return np.asarray(self.push * points / np.hypot(*points.T)[:, None])

    def mesh(self, cells: int, *, curved: bool) -> Mesh:
        """Divide the radius into `cells` and the angle into twice as many.

        curved: whether triangles are quadratic (isoparametric). Raises ValueError for fewer than
            one cell.
        """
        if cells < 1:
            raise ValueError(f"cells: {cells}; at least 1 is needed")
        r = np.linspace(self.inner, self.outer, cells + 1)
        angle = np.linspace(0.5 * np.pi, 1.5 * np.pi, 2 * cells + 1)
        flat = MeshTri.init_tensor(r, angle).with_boundaries(
            {
                "wall": lambda x: (x[1] == angle[0]) | (x[1] == angle[-1]),
                "exit": lambda x: x[0] == r[0],
                "free": lambda x: x[0] == r[-1],
            }
        )
        mesh = MeshTri2.from_mesh(flat) if curved else flat
        radius, turn = mesh.doflocs
        bent = np.stack([radius * np.cos(turn), radius * np.sin(turn)])
        # exactly on the wall, which cos only nearly is
        bent[0, (turn == angle[0]) | (turn == angle[-1])] = 0.0
        return type(mesh)(bent, mesh.t, _boundaries=flat.boundaries)


def _struve_slope(z: ArrayLike) -> Floats:
    """L₁′ = L₀ − L₁/z (DLMF 11.4.25)."""
    at = np.asarray(z)
    return np.asarray(modstruve(0, at) - modstruve(1, at) / at)
