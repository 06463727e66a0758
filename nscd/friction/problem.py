"""An impact with Coulomb friction as arrays."""

from typing import Any, NamedTuple

import numpy as np

from nscd import _core
from nscd.arrays import Floats
from nscd.bodies import Snapshot
from nscd.contacts import Contacts
from nscd.laws import ContactLaw

# Velocities are measured in no less, m/s: squares of what is far below are no numbers.
SLOWEST = 1e-100


class FrictionProblem(NamedTuple):
    """Hold an impact with friction at k contacts of n disks.

    first, second: (k,) disks, second −1 for a wall
    normal: (k,2)
    lever: (k,2) m, distance of the contact from the centre of each disk, 0 for a wall
    friction: (k,) μ
    normal_weight, tangent_weight: (k,) kg, k_n and k_t
    offset: (k,) m/s, b, 0 for an impact
    mass: (n,3) kg, kg, kg m²
    left: (n,3) m/s, m/s, rad/s, u⁻
    normal_inverse, tangent_inverse: (k,) 1/kg, the diagonal of the Delassus operator, w_n and w_t
        (3 w_n for solid disks)
    island: (n,) number of the group of touching disks that each belongs to
    scale: m/s, the largest |u⁻|, spins times their radius included, which residuals are measured in

    M(u − u⁻) + Cᵀp_n + Tᵀp_t = 0 with p_n = k_n max(C(u + u⁻), 0) + λ, p_t = k_t T(u + u⁻) +
    τ, where 0 ≤ λ ⟂ b − C u ≥ 0 (Signorini), |τ| ≤ μ max(p_n, 0), and τ T u = μ max(p_n, 0) |T u|
    (Coulomb: maximum dissipation). C u: approach; T u: sliding of the first body along
    t = (−n_y, n_x) relative to the second, spins included."""

    first: Any
    second: Any
    normal: Any
    lever: Any
    friction: Any
    normal_weight: Any
    tangent_weight: Any
    offset: Any
    mass: Any
    left: Any
    normal_inverse: Any
    tangent_inverse: Any
    island: Any
    scale: float

    def in_core(self, position: Floats) -> _core.FrictionProblem:
        """Hand the problem of disks at position (n,2) m over to the native core."""
        return _core.FrictionProblem(
            self.first, self.second, self.normal, self.lever, self.friction, self.normal_weight,
            self.tangent_weight, self.offset, self.mass, self.left, position, self.scale,
        )  # fmt: skip


def problem_of(
    *,
    pairs: tuple[Any, Any],
    normal: Any,
    friction: Any,
    radius: Any,
    mass: Any,
    left: Any,
    weights: tuple[Any, Any] | None = None,
) -> FrictionProblem:
    """Set up the impact at k contacts of n disks from plain arrays, which are not checked.

    pairs: (k,) int32 each, first and second disks, second −1 for a wall
    normal: (k,2), first→second
    friction: (k,), μ
    radius: (n,) m
    mass: (n,3) kg, kg, kg m²
    left: (n,3) m/s, m/s, rad/s, u⁻
    weights: (k,) kg each, k_n and k_t; 0 where left out"""
    first, second = pairs
    k = len(first)
    wall = second < 0
    other = np.where(wall, 0, second)
    lever = np.column_stack([radius[first], np.where(wall, 0.0, radius[other])])
    inverse = 1.0 / mass
    normal_inverse = inverse[first, 0] + np.where(wall, 0.0, inverse[other, 0])
    spin_inverse = lever[:, 0] ** 2 * inverse[first, 2]
    spin_inverse += np.where(wall, 0.0, lever[:, 1] ** 2 * inverse[other, 2])
    moving = float(np.abs(left[:, :2]).max(initial=0.0))
    rim = float((np.abs(left[:, 2]) * radius).max(initial=0.0))
    none = np.zeros(k)
    along, across = (none, none.copy()) if weights is None else weights
    return FrictionProblem(
        first=first,
        second=second,
        normal=normal,
        lever=lever,
        friction=friction,
        normal_weight=along,
        tangent_weight=across,
        offset=none.copy(),
        mass=mass,
        left=left,
        normal_inverse=normal_inverse,
        tangent_inverse=normal_inverse + spin_inverse,
        island=_core.components(len(mass), first, second),
        scale=max(moving, rim, SLOWEST),
    )


def friction_problem(
    snapshot: Snapshot, contacts: Contacts, left_velocity: Floats, law: ContactLaw
) -> FrictionProblem:
    """Set up the problem of a snapshot with left velocities (n,2) m/s, its spins, and a law."""
    return problem_of(
        pairs=(
            contacts.first.astype(np.int32),
            np.where(contacts.is_wall, -1, contacts.second).astype(np.int32),
        ),
        normal=np.array(contacts.normal),
        friction=law.frictions(contacts.is_wall),
        radius=snapshot.radius,
        mass=np.column_stack([snapshot.mass, snapshot.mass, snapshot.inertia]),
        left=np.column_stack([left_velocity, snapshot.spin]),
        weights=law.acting(contacts, snapshot.mass, left_velocity),
    )
