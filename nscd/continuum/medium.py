"""What a crowd is as a material: how dense, and how much it dissipates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from nscd.arrays import Floats, read_only


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Medium:
    """A crowd as a deformable solid (paper Table 1).

    Without mass_per_person: density ρ in kg/m², volume dissipation k_v in kg, surface dissipation
    k_s in kg/m. With it (kg): ρ in people/m², and k_v and k_s count the same mass, so that the
    length h = √(k_v/ρ) stays and every percussion is mass_per_person times as large. ρ is one
    number or one value a vertex of the mesh (n,), linear in between.

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
            least = "none" if values.size == 0 else f"{values.min():g}"
            raise ValueError(f"density: {least}; a crowd needs a positive density everywhere")
        object.__setattr__(self, "density", values if values.ndim else float(values))
        for name, least_allowed in (("volume_dissipation", 0.0), ("mass_per_person", 0.0)):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > least_allowed):
                raise ValueError(f"{name}: {value:g}; a positive number is needed")
        if not (np.isfinite(self.surface_dissipation) and self.surface_dissipation >= 0):
            raise ValueError(
                f"surface_dissipation: {self.surface_dissipation:g}; it cannot be negative"
            )

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
