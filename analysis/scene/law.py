"""The contact laws: what pushes two disks, or a disk and a wall, apart.

A law is F = k δ + K √R δ^1.5 + q δ² while the overlap δ > 0, where R is the effective radius, and a
dashpot. Time steps, energies, merged dumps and the reference of the charts follow from its entry in
LAWS; the decks of LAMMPS and YADE have it again, so that they run alone (docs/how_to/law.md)."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from nscd.arrays import Floats, Mask

# The overlap, over the mean radius, at which hertz has the stiffness that is given.
HERTZ_OVERLAP = 0.01
# One chest between front and back, F = A D + B D² of its compression D (N and m), mean of living
# patients: Tsitlik et al., Crit. Care Med. 11 (1983) 685. Two disks are two in series, D = δ/2
# each; a wall meets one, D = δ.
CHEST_N_PER_M, CHEST_N_PER_M2 = 5490.0, 108000.0
# Laws with the stiffness of a body: exactly, and as one Hertz contact of two people of mean radius,
# F = BODY_HERTZ δ^1.5 (N/m^1.5), which is within 8 % for overlaps δ of 0.05 to 0.3 m.
BODY, AS_HERTZ = "body", "body_hertz"
BODY_HERTZ = 18500.0
# Their nominal stiffness is the secant of `body` at this overlap (m).
BODY_OVERLAP_M = 0.1


class Springs(NamedTuple):
    """Hold the coefficients of a spring: k (N/m), K (Pa), q (N/m²)."""

    linear: float = 0.0
    hertz: float = 0.0
    square: float = 0.0

    def tangent(self, overlap: float, radius: float) -> float:
        """Compute dF/dδ (N/m) at an overlap and an effective radius (m)."""
        hertz = 1.5 * self.hertz * float(np.sqrt(radius * overlap))
        return self.linear + hertz + 2 * self.square * overlap


class Elastic(NamedTuple):
    """Hold the springs of pairs and of walls."""

    pair: Springs
    wall: Springs

    def force(self, overlap: Floats, radius: Floats, is_wall: Mask) -> Floats:
        """Compute F (k,) N at overlaps (k,) m, effective radii (k,) m, with disks or walls."""
        deep, (k, hertz, square) = np.maximum(overlap, 0.0), self._each(is_wall)
        return np.asarray(k * deep + hertz * np.sqrt(radius) * deep**1.5 + square * deep**2)

    def energy(self, overlap: Floats, radius: Floats, is_wall: Mask) -> Floats:
        """Compute the energy (k,) J of such contacts: ½ k δ² + ⅖ K √R δ^2.5 + ⅓ q δ³."""
        deep, (k, hertz, square) = np.maximum(overlap, 0.0), self._each(is_wall)
        curved = 0.4 * hertz * np.sqrt(radius) * deep**2.5 + square / 3 * deep**3
        return np.asarray(0.5 * k * deep**2 + curved)

    def _each(self, is_wall: Mask) -> list[Floats]:
        return [np.where(is_wall, *ends) for ends in zip(self.wall, self.pair, strict=True)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Law:
    """Describe a contact law.

    springs: from the stiffness of disks and of walls (N/m) and the mean radius (m)
    dashpot: clipped: max(0, F + c δ′), one c of pairs and one of walls; apart: F + max(0, c δ′)
        with the same; tangent: max(0, F + √5 ζ √(m_eff K √(Rδ)) δ′)
    own_stiffness: whether it brings its stiffness; nominal is then that of `body`
    friction: the engines that run it with friction"""

    springs: Callable[[float, float, float], Elastic]
    dashpot: Literal["clipped", "apart", "tangent"]
    own_stiffness: bool = False
    friction: tuple[str, ...] = ()


def hertz_constant(stiffness: float, mean_radius: float) -> float:
    """Compute K (Pa) of a Hertz contact F = K √R δ^1.5 from the tangent stiffness k (N/m) of two
    disks of mean radius r̄ (m) at an overlap of 1 % of it: k = ³⁄₂ K √(½ r̄ 0.01 r̄)."""
    return stiffness / (1.5 * float(np.sqrt(0.5 * HERTZ_OVERLAP)) * mean_radius)


def hertz_stiffness(young_modulus: float, poisson_ratio: float, mean_radius: float) -> float:
    """Compute the tangent stiffness (N/m) of two disks of mean radius r̄ (m) at an overlap of 1 %
    of it, for bodies of Young's modulus E (Pa) and Poisson's ratio ν.

    F = K √R δ^1.5 with K = ⁴⁄₃ E* = ⅔ E/(1 − ν²) and R = r̄/2 (Hertz; Johnson, Contact Mechanics,
    1985, 4.2), so k = ³⁄₂ K √(R δ)."""
    return 2 / 3 * young_modulus / (1 - poisson_ratio**2) / hertz_constant(1.0, mean_radius)


def _hooke(disks: float, walls: float, mean_radius: float) -> Elastic:
    return Elastic(Springs(linear=disks), Springs(linear=walls))


def _hertz(disks: float, walls: float, mean_radius: float) -> Elastic:
    pair, wall = (hertz_constant(k, mean_radius) for k in (disks, walls))
    return Elastic(Springs(hertz=pair), Springs(hertz=wall))


def _body(disks: float, walls: float, mean_radius: float) -> Elastic:
    chest = Springs(linear=CHEST_N_PER_M, square=CHEST_N_PER_M2)
    return Elastic(Springs(linear=chest.linear / 2, square=chest.square / 4), chest)


def _body_hertz(disks: float, walls: float, mean_radius: float) -> Elastic:
    # a wall meets one body: K √r̄ D^1.5 at D = δ/2 is half as deep, so twice K
    constant = BODY_HERTZ / float(np.sqrt(0.5 * mean_radius))
    return Elastic(Springs(hertz=constant), Springs(hertz=2 * constant))


LAWS: dict[str, Law] = {
    "hooke": Law(springs=_hooke, dashpot="clipped", friction=("lammps", "yade")),
    "hertz": Law(springs=_hertz, dashpot="tangent", friction=("lammps",)),
    BODY: Law(springs=_body, dashpot="apart", own_stiffness=True),
    AS_HERTZ: Law(springs=_body_hertz, dashpot="tangent", own_stiffness=True, friction=("lammps",)),
}
_secant = _body(0.0, 0.0, 0.0).force(np.full(2, BODY_OVERLAP_M), np.ones(2), np.arange(2) > 0)
# Nominal stiffness of a body between people and at a wall (N/m): 5,445 and 16,290.
NOMINAL: tuple[float, float] = tuple((_secant / BODY_OVERLAP_M).tolist())
