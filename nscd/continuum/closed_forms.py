"""Answers in closed form: a chain against a wall (paper (12)–(14), corrected), half an annulus of
people pressed to its middle, and a crowd that walks to one point of a long wall."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import quad
from scipy.special import iv, ivp, kv, kvp, modstruve
from skfem import Mesh, MeshLine, MeshTri, MeshTri2

from nscd.arrays import Floats, number
from nscd.continuum.medium import Medium, positive


def chain_mesh(length: float, cells: int) -> MeshLine:
    """Divide 0 ≤ x ≤ length (m) into equal cells, "wall" at the end, "free" at the start.

    Raises ValueError for a length that is not positive or fewer than one cell."""
    positive(length=length)
    if cells < 1:
        raise ValueError(f"cells: {cells}. At least 1 is needed")
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
        positive(length=self.length)
        if not number(self.left_velocity, "left_velocity") >= 0:
            raise ValueError(f"left_velocity: {self.left_velocity:g} m/s leaves the wall")

    @property
    def kappa(self) -> float:
        """κ = k_s h/k_v, what the wall dissipates against the crowd."""
        return self.medium.k_s * self.medium.length / self.medium.k_v

    @property
    def _tanh(self) -> float:
        return float(np.tanh(self.length / self.medium.length))

    @property
    def sticks(self) -> bool:
        """Whether u⁺(l) = 0."""
        return self.kappa <= self._tanh

    @property
    def restitution(self) -> float:
        """e with u⁺(l) = −eU; 0 where the chain sticks."""
        return max(0.0, (self.kappa - self._tanh) / (self.kappa + self._tanh))

    @property
    def wall_percussion(self) -> float:
        """kg m/s, μ = U(√(k_vρ) tanh L − k_s), 0 where the chain rebounds."""
        impedance = self.medium.k_v / self.medium.length
        return max(0.0, self.left_velocity * (impedance * self._tanh - self.medium.k_s))

    @property
    def _amplitude(self) -> float:
        """w = U·amplitude·cosh(x/h)/cosh L."""
        return 1.0 if self.sticks else 2 * self.kappa / (self._tanh + self.kappa)

    def right_velocity(self, x: ArrayLike) -> Floats:
        """Compute u⁺ (m/s) at x (m): U[1 − cosh(x/h)/cosh L], or U[1 − 2κ cosh(x/h)/(sinh L + κ
        cosh L)] where it rebounds."""
        return self.left_velocity * (1.0 - self._amplitude * self._ratio(x, 1.0))

    def internal_percussion(self, x: ArrayLike) -> Floats:
        """Compute r_int = −σ = −k_v ∂w/∂x (kg m/s) at x (m), positive in compression: (14) with the
        k_v that it lacks."""
        slope: Floats = self.left_velocity * self._amplitude * self._ratio(x, -1.0)
        return self.medium.k_v / self.medium.length * slope

    def _ratio(self, x: ArrayLike, sign: float) -> Floats:
        """cosh(x/h)/cosh L (sign 1) or sinh(x/h)/cosh L (sign −1), without overflow."""
        h = self.medium.length
        s, end = np.asarray(x, dtype=np.float64) / h, self.length / h
        return np.asarray(np.exp(s - end) * (1 + sign * np.exp(-2 * s)) / (1 + np.exp(-2 * end)))


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
    dissipation, or a wall that would not press everywhere."""

    medium: Medium
    inner: float
    outer: float
    speed: float
    push: float = 0.0

    def __post_init__(self) -> None:
        if not 0 < self.inner < self.outer < np.inf:
            radii = f"{self.inner:g}, {self.outer:g} m"
            raise ValueError(f"inner, outer: {radii}. 0 < inner < outer is needed")
        if np.ndim(self.medium.density):
            raise ValueError("density: the closed form needs one number")
        if self.medium.k_s > 0:
            raise ValueError("surface_dissipation: the closed form needs none")
        if self.radial(np.linspace(self.inner, self.outer, 100)).max() >= 0:
            raise ValueError("speed, push: the crowd leaves the wall. It must be pressed")

    @cached_property
    def _coefficients(self) -> Floats:
        """A, B."""
        h, struve = self.medium.length, np.pi * self.speed
        a, R = self.inner / h, self.outer / h
        matrix = np.array([[ivp(1, a), kvp(1, a)], [ivp(1, R), kvp(1, R)]])
        pushed = h * self.push / self.medium.k_v
        right = [-struve * _struve_slope(a), pushed - struve * _struve_slope(R)]
        return np.asarray(np.linalg.solve(matrix, right))

    def radial(self, r: ArrayLike) -> Floats:
        """Compute f(r), the velocity sum w along r̂, m/s."""
        z, (a, b) = np.asarray(r) / self.medium.length, self._coefficients
        return np.asarray(np.pi * self.speed * modstruve(1, z) + a * iv(1, z) + b * kv(1, z))

    def slope(self, r: ArrayLike) -> Floats:
        """Compute f′(r), 1/s."""
        h, (a, b) = self.medium.length, self._coefficients
        z = np.asarray(r) / h
        struve = np.pi * self.speed * _struve_slope(z)
        return np.asarray((struve + a * ivp(1, z) + b * kvp(1, z)) / h)

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
        fraction = quad(lambda s: float(self.radial(s)) / s, self.inner, self.outer, epsabs=1e-13)
        return -2 * self.medium.k_v * float(fraction[0])

    def left_velocity(self, points: Floats) -> Floats:
        """Compute u⁻ = −U r̂, (m,2) m/s, at points (m,2) m."""
        return np.asarray(-self.speed * points / np.hypot(*points.T)[:, None])

    def external(self, points: Floats) -> Floats:
        """Compute r_ext r̂, (m,2) N·s/m, at points (m,2) m."""
        return np.asarray(self.push * points / np.hypot(*points.T)[:, None])

    def mesh(self, cells: int, *, curved: bool) -> Mesh:
        """Divide the radius into `cells` and the angle into twice as many.

        curved: whether triangles are quadratic (isoparametric). Raises ValueError for fewer than
            one cell."""
        if cells < 1:
            raise ValueError(f"cells: {cells}. At least 1 is needed")
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


def point_sink(r: ArrayLike, speed: float, density: float, volume: float) -> Floats:
    """Compute p(r), N·s/m, of (11) where everybody walks to one point of a long smooth wall.

    r: m.
    speed: m/s, U.
    density: kg/m², ρ.
    volume: kg, k_v.

    w = f(r) r̂ with s = r/h, h = √(k_v/ρ), f = πU(L₁(s) − I₁(s)) (modified Struve and Bessel),
    p = −½k_v(f′ + f/r); (π/2)U√(k_vρ) at r = 0, k_v U/r far away."""
    s = np.maximum(np.asarray(r, dtype=np.float64) * np.sqrt(density / volume), 1e-9)
    # d(sL₁)/ds = sL₀ and d(sI₁)/ds = sI₀, so that f′ + f/r = πU(L₀ − I₀)/h
    rate = np.pi * speed * np.sqrt(density / volume) * (modstruve(0, s) - iv(0, s))
    return np.asarray(-0.5 * volume * rate)
