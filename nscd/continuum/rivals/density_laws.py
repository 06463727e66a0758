"""Constitutive laws of a crowd: pressure and walking speed from the density.

Paper (16), M1, M2, L1, L2, with Table 1. Densities are in people/m². Pressures of the laws are in
people/s²: times the mass of a person (kg) they are in N/m, and then comparable with a percussion
per length (N·s/m) only after that is divided by the time it took."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from nscd.arrays import Floats, numbers, read_only
from nscd.continuum.medium import TABLE_1, positive
from nscd.stress import Kernel, coarse_grain


def _density(density: ArrayLike) -> Floats:
    rho = numbers(density, "density")
    if not np.isfinite(rho).all():
        raise ValueError("density: not a finite number")
    if rho.size and rho.min() <= 0:
        raise ValueError(f"density: {rho.min():g} people/m². A positive density is needed")
    return rho


@dataclass(frozen=True, slots=True, kw_only=True)
class TurbulencePressure:
    """Give the pressure of the crowd turbulence, (16).

    critical_density, yield_density, epsilon: people/m², ρ_c, ρ_y and ε.
    c1: √people·m/s².
    c2: people/s².

    g = 0 for ρ ≤ ρ_c; c₁ρ/√(ρ_y − ρ + ε) − c₂ for ρ_c < ρ < ρ_y; c₃ρ − c₂ from ρ_y on, c₃ = c₁/√ε.
    Table 1's c₂ = 1.5 lets g jump by 31.4 at ρ_c; `continuous()` has the c₂ that does not. Golas,
    Narain and Lin, Physical Review E 90 (2014) 042816.

    Raises ValueError for a constant that is not positive, or ρ_c ≥ ρ_y."""

    c1: float = TABLE_1.c1
    c2: float = TABLE_1.c2
    critical_density: float = TABLE_1.critical_density
    yield_density: float = TABLE_1.yield_density
    epsilon: float = TABLE_1.epsilon

    def __post_init__(self) -> None:
        positive(**asdict(self))
        if self.critical_density >= self.yield_density:
            order = f"{self.critical_density:g} is not below the yield density"
            raise ValueError(f"critical_density: {order} {self.yield_density:g} people/m²")

    @property
    def c3(self) -> float:
        """c₁/√ε, the slope from ρ_y on."""
        return self.c1 / math.sqrt(self.epsilon)

    def continuous(self) -> TurbulencePressure:
        """The same law with c₂ = c₁ρ_c/√(ρ_y − ρ_c + ε), without a jump."""
        span = self.yield_density - self.critical_density + self.epsilon
        return replace(self, c2=self.c1 * self.critical_density / math.sqrt(span))

    def pressure(self, density: ArrayLike) -> Floats:
        """Compute g(ρ), people/s², of ρ > 0, people/m², of any shape.

        Raises ValueError for another density."""
        rho = _density(density)
        room = np.maximum(self.yield_density - rho, 0.0) + self.epsilon
        high = np.where(rho < self.yield_density, self.c1 / np.sqrt(room), self.c3)
        return np.where(rho <= self.critical_density, 0.0, high * rho - self.c2)


def power_pressure(density: ArrayLike) -> Floats:
    """Compute (M2), p = p₀ρ^γ, people/s², with p₀ and γ of Table 1.

    density: ρ > 0, people/m², of any shape.

    Raises ValueError for another density."""
    powers = _density(density) ** TABLE_1.pressure_exponent
    return np.asarray(TABLE_1.pressure_coefficient * powers)


def exponential_speed(density: ArrayLike) -> Floats:
    """Compute (L1), u = u_max exp(−α(ρ/ρ_max)²), m/s, printed as ρ(u), with the constants of Table 1.

    density: ρ > 0, people/m²; the speed at ρ_max is not 0.

    Raises ValueError for another density."""
    fraction = _density(density) / TABLE_1.greatest_density
    return np.asarray(TABLE_1.free_speed * np.exp(-TABLE_1.speed_decay * fraction**2))


def kladek_speed(
    density: ArrayLike,
    *,
    free_speed: float = TABLE_1.free_speed,
    greatest_density: float = TABLE_1.greatest_density,
) -> Floats:
    """Compute (L2), u = u_max(1 − exp(−γ(1/ρ − 1/ρ_max))), m/s, printed as ρ(u); 0 above ρ_max.

    density, greatest_density: ρ > 0 and ρ_max, people/m²; Weidmann's own ρ_max is 5.4.
    free_speed: m/s, u_max; Weidmann's own is 1.34.

    γ = 1.913 people/m² is Weidmann's; Table 1's γ = 2 is the exponent of (M2).

    Raises ValueError for another density or a constant that is not positive."""
    positive(free_speed=free_speed, greatest_density=greatest_density)
    gap = np.maximum(1 / _density(density) - 1 / greatest_density, 0.0)
    return np.asarray(-free_speed * np.expm1(-1.913 * gap))


def measured_speed(
    position: ArrayLike,
    speed: ArrayLike,
    at: ArrayLike,
    *,
    people: ArrayLike | None = None,
    reach: float = TABLE_1.reach,
    printed: bool = False,
) -> Floats:
    """Measure V of (M1), m/s: Σ_i ‖u_i‖ f(d_i)/Σ_i f(d_i) with f(d) = exp(−d²/R²)/(πR²).

    position: (n,2) m, of people, or of points of a field.
    speed: (n,) m/s, ‖u_i⁺‖.
    at: (m,2) m, where it is measured.
    people: (n,), how many each point stands for, ρ times an area; one by default.
    reach: m, R; f is cut at 6/√2 reach, e⁻¹⁸ of its height.
    printed: whether to leave Σ_i ‖u_i‖ f(d_i), in 1/(m s), undivided, which follows the density.

    Helbing, Johansson, Al-Abideen, Physical Review E 75 (2007) 046109. Raises ValueError for wrong
    shapes, values that are not finite, negative people, or a place with nobody within reach."""
    points, where = read_only(at, (-1, 2), "at"), read_only(position, (-1, 2), "position")
    values = read_only(speed, (len(where),), "speed")
    count = read_only(np.ones(len(where)) if people is None else people, (len(where),), "people")
    if count.size and count.min() < 0:
        raise ValueError(f"people: {count.min():g}. A number of people cannot be negative")
    positive(reach=reach)
    kernel = Kernel(width=reach / math.sqrt(2))
    sums, _ = coarse_grain(where, np.column_stack([count * values, count]), kernel, points)
    if printed:
        return np.ascontiguousarray(sums[:, 0])
    if len(points) and sums[:, 1].min() <= 0:
        x, y = points[int(np.argmin(sums[:, 1]))]
        raise ValueError(f"at: nobody is within reach of ({x:g}, {y:g}) m")
    return np.asarray(sums[:, 0] / sums[:, 1])


def crowd_pressure(density: ArrayLike, measured: ArrayLike) -> Floats:
    """Compute (M1), p = ρ Var(V), people/s².

    density: people/m², ρ.
    measured: (s,) m/s, a sample V of `measured_speed`, over places or instants. With the printed V,
        in 1/(m s), it is no pressure: the unit is people/(m⁴ s²).

    Var is the mean square distance from the mean. Raises ValueError for a density that is not
    positive, an empty sample or one that is not finite."""
    sample = read_only(measured, (-1,), "measured")
    if len(sample) == 0:
        raise ValueError("measured: an empty sample has no variance")
    return np.asarray(_density(density) * sample.var())
