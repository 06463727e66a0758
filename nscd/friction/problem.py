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
    mass: (n,3) kg, kg, kg m²
    left: (n,3) m/s, m/s, rad/s, u⁻
    normal_inverse, tangent_inverse: (k,) 1/kg, the diagonal of the Delassus operator, w_n and w_t
        (3 w_n for solid disks)
    scale: m/s, the largest |u⁻|, spins times their radius included, which residuals are measured in

    M(u − u⁻) + Cᵀp_n + Tᵀp_t = 0 with p_n = k_n max(C(u + u⁻), 0) + λ, p_t = k_t T(u + u⁻) +
    τ, where 0 ≤ λ ⟂ −C u ≥ 0 (Signorini), |τ| ≤ μ max(p_n, 0), and τ T u = μ max(p_n, 0) |T u|
    (Coulomb: maximum dissipation). C u: approach; T u: sliding of the first body along
    t = (−n_y, n_x) relative to the second, spins included."""

    first: Any
    second: Any
    normal: Any
    lever: Any
    friction: Any
    normal_weight: Any
    tangent_weight: Any
    mass: Any
    left: Any
    normal_inverse: Any
    tangent_inverse: Any
    scale: float

    def in_core(self, snapshot: Snapshot) -> _core.FrictionProblem:
        """Hand the problem of a snapshot over to the native core."""
        disks = snapshot.position, snapshot.radius, snapshot.mass
        return _core.FrictionProblem(
            (self.first, self.second, self.normal, *disks), self.left[:, :2].copy(), snapshot.spin,
            self.friction, self.normal_weight, self.tangent_weight,
        )  # fmt: skip


def friction_problem(
    snapshot: Snapshot, contacts: Contacts, left_velocity: Floats, law: ContactLaw
) -> FrictionProblem:
    """Write out the problem of a snapshot with left velocities (n,2) m/s, its spins, and a law.

    Raises ValueError for bodies of several disks: `solve` has those."""
    snapshot.need_disks("friction_problem")
    wall, first = contacts.is_wall, contacts.first
    other = np.where(wall, 0, contacts.second)
    radius, mass = snapshot.radius, snapshot.mass
    normal_inverse = contacts.inverse_mass(mass)
    spin_inverse = radius**2 / snapshot.inertia
    normal, tangential = law.active_dissipation(contacts, normal_inverse, left_velocity)
    speed = float(np.abs(left_velocity).max(initial=0.0))
    rim_speed = float(np.abs(snapshot.spin * radius).max(initial=0.0))
    return FrictionProblem(
        first=first.astype(np.int32),
        second=np.where(wall, -1, contacts.second).astype(np.int32),
        normal=np.array(contacts.normal),
        lever=np.column_stack([radius[first], np.where(wall, 0.0, radius[other])]),
        friction=law.frictions(wall),
        normal_weight=normal,
        tangent_weight=tangential,
        mass=np.column_stack([mass, mass, snapshot.inertia]),
        left=np.column_stack([left_velocity, snapshot.spin]),
        normal_inverse=normal_inverse,
        tangent_inverse=normal_inverse
        + spin_inverse[first]
        + np.where(wall, 0.0, spin_inverse[other]),
        scale=max(speed, rim_speed, SLOWEST),
    )
