"""The contact law of the collision: what a contact dissipates and gives back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscd.arrays import Flags, Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactLaw:
    """Frémond's law p = k D(u⁺ + u⁻) + λ n (paper eq. (1)).

    dissipation k_n (kg) acts along the normal, tangential_dissipation k_t (kg) across it. k_t left
    out is the paper's single coefficient (k_t = k_n), or 0 where `restitution` is given.
    restitution e instead of k_n sets k_n = m_eff (1+e)/(1−e) contact by contact, 1/m_eff = 1/m_i +
    1/m_j: exact for two disks, *not* Newton's e for simultaneous contacts. maintained=True keeps
    every contact closed (C u⁺ = 0, paper eq. (2)); reactions may then pull. The default is the
    purely inelastic, frictionless complementarity 0 ≤ λ ⟂ −C u⁺ ≥ 0.

    friction μ: Coulomb friction, exact: |τ| ≤ μ max(p_n, 0) beside k_t D_t, against the sliding of u⁺,
    with p_n the whole normal percussion, k_n included; wall_friction: μ of contacts with walls, the
    same where left out.

    Raises ValueError for negative or non-finite coefficients, e outside [0, 1), both k_n and e
    given, and friction of maintained contacts, which may pull."""

    dissipation: float = 0.0
    restitution: float | None = None
    tangential_dissipation: float | None = None
    friction: float = 0.0
    wall_friction: float | None = None
    maintained: bool = False

    def __post_init__(self) -> None:
        for name in ("dissipation", "tangential_dissipation", "friction", "wall_friction"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value >= 0):
                raise ValueError(f"{name}: {value}; a finite number ≥ 0 is needed")
        if self.restitution is not None:
            if not 0 <= self.restitution < 1:
                raise ValueError(f"restitution: {self.restitution}; 0 ≤ e < 1 is needed")
            if self.dissipation:
                raise ValueError("restitution: give either dissipation or restitution")
        if self.frictional and self.maintained:
            raise ValueError(
                "friction: maintained contacts may pull, and friction of a pull has no meaning"
            )

    @property
    def frictional(self) -> bool:
        """Whether any kind of contact has friction."""
        return bool(self.friction or self.wall_friction)

    def frictions(self, is_wall: Flags) -> Floats:
        """μ of contacts (k,), with walls where is_wall (k,)."""
        at_walls = self.friction if self.wall_friction is None else self.wall_friction
        return np.where(is_wall, at_walls, self.friction)

    def coefficients(self, inverse_mass: Floats) -> tuple[Floats, Floats]:
        """k_n and k_t of contacts with inverse effective mass w (k,) 1/kg; each (k,), kg."""
        if self.restitution is not None:
            normal = (1 + self.restitution) / (1 - self.restitution) / inverse_mass
            tangential = 0.0 if self.tangential_dissipation is None else self.tangential_dissipation
            return normal, np.full_like(normal, tangential)
        tangential = (
            self.dissipation if self.tangential_dissipation is None else self.tangential_dissipation
        )
        return np.full_like(inverse_mass, self.dissipation), np.full_like(inverse_mass, tangential)
