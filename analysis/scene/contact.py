"""The contact law of a scene: how disks repel each other and walls."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, ValidationInfo, model_validator

from analysis.scene.values import Number, Part, Positive, means_of

# The keys that may stand for the stiffness of hertz.
YOUNG, POISSON = "young_modulus_Pa", "poisson_ratio"
# The overlap, over the mean radius, at which hertz has the stiffness that is given.
HERTZ_OVERLAP = 0.01


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
    """Repel by k·overlap (hooke) or K·overlap^1.5 (hertz), with a dashpot for the asked restitution
    and Coulomb friction.

    stiffness_N_per_m: N/m, k; of hertz the tangent stiffness at an overlap of 1 % of the mean
        radius; a file may give young_modulus_Pa and poisson_ratio instead
    wall_stiffness_N_per_m: N/m, the same of walls; that of the disks where left out
    restitution: 0 to 1, of two bodies
    friction: coefficient; 0 is none
    tangential_ratio: stiffness of the tangential spring over k
    """

    law: Literal["hooke", "hertz"] = "hooke"
    stiffness_N_per_m: Positive  # noqa: N815  (the unit is newton)
    wall_stiffness_N_per_m: Positive | None = None  # noqa: N815
    restitution: Annotated[Number, Field(ge=0, le=1)]
    friction: Annotated[Number, Field(ge=0)] = 0.0
    tangential_ratio: Positive = 2 / 7

    @property
    def at_walls(self) -> float:
        """Give the stiffness of walls (N/m)."""
        return self.wall_stiffness_N_per_m or self.stiffness_N_per_m

    @property
    def stiffest(self) -> float:
        """Give the larger stiffness of the two (N/m), which time steps follow."""
        return max(self.at_walls, self.stiffness_N_per_m)

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
