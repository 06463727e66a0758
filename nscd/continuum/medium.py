"""What a crowd is as a material: how dense, and how much it dissipates; Table 1 of the paper."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from nscd.arrays import Floats, Frozen, number, read_only

PERSON = 75.0  # kg, section 2.2 of the paper
DENSITY = 7.0  # people/m², section 3.2.2 of the paper


def positive(**values: float) -> None:
    """Refuse, by its name, a value that is not a positive number: ValueError."""
    for name, value in values.items():
        if not number(value, name, "A positive number") > 0:
            raise ValueError(f"{name}: {value:g}. A positive number is needed")


@dataclass(frozen=True, slots=True, kw_only=True)
class Table1:
    """The paper's Table 1. What it prints in kilograms is per person: times `PERSON`.

    volume_dissipation: k_v, per person.
    surface_dissipation: k_s, per person, 1/m.
    free_speed: u_max, m/s.
    greatest_density: ρ_max, people/m².
    speed_decay: α of (L1).
    pressure_exponent: γ of (M2).
    pressure_coefficient: p₀ of (M2), people^(1−γ) m^(2γ)/s².
    reach: R of (M1), m.
    yield_density, critical_density: ρ_y and ρ_c of (16), people/m².
    epsilon: ε of (16), people/m².
    c1, c2: of (16), √people·m/s² and people/s².
    friction: β of (18).
    time_step: δt, s."""

    volume_dissipation: float = 9.0
    surface_dissipation: float = 1.0
    free_speed: float = 2.0
    greatest_density: float = 8.5
    speed_decay: float = 7.5
    pressure_exponent: float = 2.0
    pressure_coefficient: float = 0.005
    reach: float = 0.7
    yield_density: float = 5.5
    critical_density: float = 3.5
    epsilon: float = 0.01
    c1: float = 13.33
    c2: float = 1.5
    friction: float = 0.75
    time_step: float = 0.01


TABLE_1 = Table1()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Medium(Frozen):
    """Describe a crowd as a deformable solid.

    density: ρ, one number or (n,) one per vertex of the mesh, linear in between; kg/m², or
        people/m² with a mass_per_person.
    volume_dissipation: k_v, kg, or per person.
    surface_dissipation: k_s, kg/m, or per person and metre.
    mass_per_person: kg that density and dissipation count, or None for kilograms. The length
        h = √(k_v/ρ) does not depend on it; every percussion is proportional to it.

    Raises ValueError for ρ ≤ 0, k_v ≤ 0, k_s < 0, a mass that is not positive, or a number that is
    not finite."""

    density: float | Floats
    volume_dissipation: float
    surface_dissipation: float = 0.0
    mass_per_person: float | None = None

    def __post_init__(self) -> None:
        rho: ArrayLike = self.density
        values = read_only(rho, (-1,) if np.ndim(rho) else (), "density")
        if values.size == 0 or values.min() <= 0:
            minimum = "none" if values.size == 0 else f"{values.min():g}"
            raise ValueError(f"density: {minimum}. A crowd needs a positive density everywhere")
        object.__setattr__(self, "density", values if values.ndim else float(values))
        positive(volume_dissipation=self.volume_dissipation, mass_per_person=self.unit_mass)
        k_s = number(self.surface_dissipation, "surface_dissipation")
        if k_s < 0:
            raise ValueError(f"surface_dissipation: {k_s:g}. It cannot be negative")

    @property
    def unit_mass(self) -> float:
        """What the numbers of density and dissipation count, in kg."""
        return 1.0 if self.mass_per_person is None else self.mass_per_person

    @property
    def k_v(self) -> float:
        """Volume dissipation in kg."""
        return self.unit_mass * self.volume_dissipation

    @property
    def k_s(self) -> float:
        """Surface dissipation in kg/m."""
        return self.unit_mass * self.surface_dissipation

    @property
    def rho(self) -> float | Floats:
        """Density in kg/m², one number or (n,)."""
        scaled: float | Floats = self.unit_mass * self.density
        return scaled

    @property
    def length(self) -> float:
        """h = √(k_v/ρ) in m with the mean density: how far a wall is felt."""
        return float(np.sqrt(self.volume_dissipation / np.mean(self.density)))


def table_1_medium(
    density: float | Floats = DENSITY,
    volume: float = TABLE_1.volume_dissipation,
    surface: float = TABLE_1.surface_dissipation,
    *,
    person: float = PERSON,
) -> Medium:
    """Make the paper's crowd: 7 people/m² of 75 kg with k_v and k_s of Table 1, per person."""
    return Medium(
        density=density,
        volume_dissipation=volume,
        surface_dissipation=surface,
        mass_per_person=person,
    )
