"""The contact law of a scene: how disks repel each other and walls."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, ValidationInfo, model_validator

from analysis.scene.values import Number, Part, Positive, means_of
from nscd.arrays import Flags, Floats

# The keys that may stand for the stiffness of hertz.
YOUNG, POISSON = "young_modulus_Pa", "poisson_ratio"
# The overlap, over the mean radius, at which hertz has the stiffness that is given.
HERTZ_OVERLAP = 0.01

# One chest between front and back, F = A D + B D² of its compression D (N and m), mean of living
# patients: Tsitlik et al., Crit. Care Med. 11 (1983) 685.
CHEST_N_PER_M, CHEST_N_PER_M2 = 5490.0, 108000.0
# Laws with the stiffness of a body: exactly, and as one Hertz contact of two people of mean radius,
# F = BODY_HERTZ δ^1.5 (N/m^1.5), which is within 8 % for overlaps δ of 0.05 to 0.3 m.
BODY, AS_HERTZ = "body", "body_hertz"
BODY_HERTZ = 18500.0
# Their nominal stiffness is the secant at this overlap (m).
BODY_OVERLAP_M = 0.1


def body_force(overlap: Floats, is_wall: Flags) -> Floats:
    """Compute the force (k,) N of the law `body` at overlaps (k,) m: one chest against a wall, D =
    δ; two in series between disks, D = δ/2 each."""
    depth = np.where(is_wall, overlap, 0.5 * overlap)
    return np.asarray(CHEST_N_PER_M * depth + CHEST_N_PER_M2 * depth**2)


def body_energy(overlap: Floats, is_wall: Flags) -> Floats:
    """Compute the energy (k,) J of such contacts: ½ A D² + ⅓ B D³ of each chest."""
    depth = np.where(is_wall, overlap, 0.5 * overlap)
    one = 0.5 * CHEST_N_PER_M * depth**2 + CHEST_N_PER_M2 / 3 * depth**3
    return np.asarray(np.where(is_wall, one, 2 * one))


def nominal_stiffness(is_wall: bool) -> float:
    """Compute the secant stiffness of a body (N/m) at an overlap of 0.1 m: 5,445 between people,
    16,290 at a wall."""
    force = body_force(np.array([BODY_OVERLAP_M]), np.array([is_wall]))
    return float(force[0]) / BODY_OVERLAP_M


def hertz_stiffness(young_modulus: float, poisson_ratio: float, mean_radius: float) -> float:
    """Compute the tangent stiffness (N/m) of two disks of mean radius r̄ (m) at an overlap of 1 %
    of it, for bodies of Young's modulus E (Pa) and Poisson's ratio ν.

    F = K √R δ^1.5 with K = ⁴⁄₃ E* = ⅔ E/(1 − ν²) and R = r̄/2 (Hertz; Johnson, Contact Mechanics,
    1985, 4.2), so k = ³⁄₂ K √(R δ)."""
    k = 2 / 3 * young_modulus / (1 - poisson_ratio**2)
    return k / hertz_constant(1.0, mean_radius)


def hertz_constant(stiffness: float, mean_radius: float) -> float:
    """Compute K (Pa) of a Hertz contact F = K √R δ^1.5 from the tangent stiffness k (N/m) of two
    disks of mean radius r̄ (m) at an overlap of 1 % of it: k = ³⁄₂ K √(½ r̄ 0.01 r̄)."""
    return stiffness / (1.5 * float(np.sqrt(0.5 * HERTZ_OVERLAP)) * mean_radius)


class ContactModel(Part):
    """Repel by k·overlap (hooke), K·overlap^1.5 (hertz) or as chests do (body, body_hertz), with a
    dashpot for the asked restitution and Coulomb friction.

    stiffness_N_per_m: N/m, k; of hertz the tangent stiffness at an overlap of 1 % of the mean
        radius; a file may give young_modulus_Pa and poisson_ratio instead
    wall_stiffness_N_per_m: N/m, the same of walls; that of the disks where left out
    restitution: 0 to 1, of two bodies
    friction: coefficient; 0 is none
    tangential_ratio: stiffness of the tangential spring over k
    """

    law: Literal["hooke", "hertz", "body", "body_hertz"] = "hooke"
    stiffness_N_per_m: Positive  # noqa: N815  (the unit is newton)
    wall_stiffness_N_per_m: Positive | None = None  # noqa: N815
    restitution: Annotated[Number, Field(ge=0, le=1)]
    friction: Annotated[Number, Field(ge=0, le=10)] = 0.0
    tangential_ratio: Annotated[Number, Field(gt=0, le=1)] = 2 / 7

    @property
    def at_walls(self) -> float:
        """Give the stiffness of walls (N/m)."""
        if self.of_bodies:
            return nominal_stiffness(True)
        return self.wall_stiffness_N_per_m or self.stiffness_N_per_m

    @property
    def of_bodies(self) -> bool:
        """Tell whether its stiffness is that of a body."""
        return self.law in (BODY, AS_HERTZ)

    def hertz_constants(self, mean_radius: float) -> tuple[float, float]:
        """Compute K (Pa) of disks and of walls, for disks of mean radius r̄ (m). A wall meets one
        body where disks are two in series: K √r̄ D^1.5 at D = δ/2 is half as deep, so twice K."""
        if self.law == AS_HERTZ:
            constant = BODY_HERTZ / float(np.sqrt(0.5 * mean_radius))
            return constant, 2 * constant
        return (
            hertz_constant(self.stiffness_N_per_m, mean_radius),
            hertz_constant(self.at_walls, mean_radius),
        )

    def stiffest(self, mean_radius: float) -> float:
        """Compute the stiffness (N/m) that time steps follow: the larger of disks and walls; of
        bodies the tangent at a wall at a depth of the mean radius (m)."""
        if self.law == BODY:
            return CHEST_N_PER_M + 2 * CHEST_N_PER_M2 * mean_radius
        if self.law == AS_HERTZ:
            return 1.5 * self.hertz_constants(mean_radius)[1] * mean_radius
        return max(self.at_walls, self.stiffness_N_per_m)

    @model_validator(mode="before")
    @classmethod
    def _of_bodies(cls, given: Any) -> Any:
        """Put the stiffness of a body where the law has it."""
        if not isinstance(given, dict) or given.get("law") not in (BODY, AS_HERTZ):
            return given
        nominal = nominal_stiffness(False)
        for key in ("stiffness_N_per_m", "wall_stiffness_N_per_m"):
            if given.get(key) not in (None, nominal):
                raise ValueError(f"{key}: law = {given['law']} has a stiffness of its own")
        if given["law"] == BODY and given.get("friction"):
            raise ValueError("friction: law = body has none; law = body_hertz has it")
        return given | {"stiffness_N_per_m": nominal, "wall_stiffness_N_per_m": None}

    @model_validator(mode="before")
    @classmethod
    def _of_material(cls, given: Any, info: ValidationInfo) -> Any:
        """Put the stiffness in the place of Young's modulus and Poisson's ratio."""
        if not isinstance(given, dict) or not {YOUNG, POISSON} & given.keys():
            return given
        rest = {key: value for key, value in given.items() if key not in (YOUNG, POISSON)}
        if "stiffness_N_per_m" in rest or rest.get("law") != "hertz":
            raise ValueError(f"{YOUNG}: only for law = hertz, and instead of stiffness_N_per_m")
        material = Material.model_validate({key: given.get(key) for key in (YOUNG, POISSON)})
        means = means_of(info)
        if means is None:
            raise ValueError(f"{YOUNG}: only where the radius of the disks is known")
        radius, _ = means
        stiffness = hertz_stiffness(material.young_modulus_Pa, material.poisson_ratio, radius)
        return rest | {"stiffness_N_per_m": stiffness}


class Material(Part):
    """What bodies are made of.

    young_modulus_Pa: Pa, E
    poisson_ratio: ν
    """

    young_modulus_Pa: Positive  # noqa: N815  (the unit is pascal)
    poisson_ratio: Annotated[Number, Field(gt=-1, le=0.5)]
