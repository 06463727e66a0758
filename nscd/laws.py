"""The contact law of the collision: what a contact dissipates and gives back."""

from dataclasses import dataclass

import numpy as np

from nscd.arrays import Floats, Mask, flag, number
from nscd.contacts import Contacts

# A contact opens if it does so faster than this share of ‖u⁻‖∞: else it is at rest, or rounding.
AT_REST = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactLaw:
    """Set Frémond's law of all contacts, p = k D(u⁺ + u⁻) + λ n + τ t with 0 ≤ λ ⟂ −C u⁺ ≥ 0.

    Dissipation pushes and never pulls: along the normal it is k_n max(C(u⁺ + u⁻), 0), which is
    nothing where a contact opens faster than it approached, so also where it was opening already.
    Such a contact has no k_t either. (Contacts that are `maintained` have both everywhere.)

    dissipation: kg, k_n along the normal
    restitution: e in [0, 1) in place of k_n: k_n = m_eff (1+e)/(1−e) per contact, 1/m_eff = 1/m_i +
        1/m_j; exact for two disks, *not* Newton's e for simultaneous contacts
    tangential_dissipation: kg, k_t across the normal; where left out k_n (the paper's single
        coefficient), or 0 where `restitution` is given
    friction: μ of Coulomb's law, exact: |τ| ≤ μ max(p_n, 0) beside k_t D_t, against the sliding of
        u⁺, with p_n the whole normal percussion, k_n included
    wall_friction: μ of contacts with walls; the same where left out
    maintained: every contact stays closed, C u⁺ = 0, and may pull (paper eq. (2))

    The default is purely inelastic and frictionless. Frémond, Non-Smooth Thermomechanics (2002);
    paper eq. (1).

    Raises ValueError naming the field for negative or non-finite coefficients, e outside [0, 1),
    both k_n and e given, and friction of maintained contacts, which may pull.

    >>> ContactLaw(restitution=1.5)
    Traceback (most recent call last):
    ValueError: restitution: 1.5. 0 ≤ e < 1 is needed"""

    dissipation: float = 0.0
    restitution: float | None = None
    tangential_dissipation: float | None = None
    friction: float = 0.0
    wall_friction: float | None = None
    maintained: bool = False

    def __post_init__(self) -> None:
        need = "A finite number ≥ 0"
        for name in ("dissipation", "tangential_dissipation", "friction", "wall_friction"):
            value, may_be_none = getattr(self, name), name not in ("dissipation", "friction")
            if not (value is None and may_be_none) and number(value, name, need) < 0:
                raise ValueError(f"{name}: {value}. {need} is needed")
        if self.restitution is not None:
            need = "0 ≤ e < 1"
            if not 0 <= number(self.restitution, "restitution", need) < 1:
                raise ValueError(f"restitution: {self.restitution}. {need} is needed")
            if self.dissipation:
                raise ValueError("restitution: give either dissipation or restitution")
        flag(self.maintained, "maintained")
        if self.frictional and self.maintained:
            raise ValueError(
                "friction: maintained contacts may pull, and friction of a pull has no meaning"
            )

    @property
    def frictional(self) -> bool:
        """Tell whether any kind of contact has friction."""
        return bool(self.friction or self.wall_friction)

    @property
    def plain(self) -> bool:
        """Tell whether contacts only push: no dissipation, no friction, no upkeep."""
        dissipates = self.dissipation or self.tangential_dissipation or self.restitution is not None
        return not (dissipates or self.frictional or self.maintained)

    def frictions(self, is_wall: Mask) -> Floats:
        """Choose μ (k,) of contacts, with walls where is_wall (k,)."""
        at_walls = self.friction if self.wall_friction is None else self.wall_friction
        return np.where(is_wall, float(at_walls), float(self.friction))

    def coefficients(self, inverse_mass: Floats) -> tuple[Floats, Floats]:
        """Compute k_n and k_t (k,) kg of contacts with inverse effective mass w (k,) 1/kg."""
        if self.restitution is not None:
            normal = (1 + self.restitution) / (1 - self.restitution) / inverse_mass
            tangential = 0.0 if self.tangential_dissipation is None else self.tangential_dissipation
            return normal, np.full_like(normal, tangential)
        tangential = (
            self.dissipation if self.tangential_dissipation is None else self.tangential_dissipation
        )
        return np.full_like(inverse_mass, self.dissipation), np.full_like(inverse_mass, tangential)

    def active_dissipation(
        self, contacts: Contacts, inverse_mass: Floats, left: Floats
    ) -> tuple[Floats, Floats]:
        """Compute the k_n and k_t (k,) kg that act in a collision: none where C u⁻ < 0, unless the
        contacts are maintained.

        inverse_mass: (k,) 1/kg, w; left: (n,2) m/s, u⁻"""
        normal, tangential = self.coefficients(inverse_mass)
        if self.maintained or not (normal.any() or tangential.any()):
            return normal, tangential
        minimum = -AT_REST * float(np.abs(left).max(initial=0.0))
        opens = contacts.approach_velocity(left) < minimum
        return np.where(opens, 0.0, normal), np.where(opens, 0.0, tangential)
