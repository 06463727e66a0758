"""One impact as a convex problem that any solver takes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from nscd.arrays import Flags, Floats, Index32
from nscd.bodies import Snapshot
from nscd.contacts import Contacts, sum_at_disks
from nscd.laws import ContactLaw

# Units in the last place that approach velocities are known to.
ROUNDING = 16 * float(np.finfo(float).eps)


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactProblem:
    """State min ½ (u − û)·Â (u − û) subject to C u ≤ b (or C u = b where `maintained`).

    first, second: (k,) disks, second −1 for a wall
    normal_first, normal_second, tangent_first, tangent_second: (k,d), rows of C and of the
        tangential part of D
    normal_weight, tangent_weight: (k,) kg, k_n and k_t
    mass: (n,d) kg, kg m²
    left, free: (n,d) m/s, u⁻ and û
    offset: (k,) m/s, b; 0 for an impact
    inverse_mass: (k,) 1/kg, w
    position: (n,2) m
    least_scale: m/s, for problems whose u⁻ is 0 and whose offset is not

    With the collision law, Â = M + DᵀKD and Â û = (M − DᵀKD) u⁻: eq. (1) with u = u⁺, K of the
    contacts that `acting` gives. Each disk has d unknowns: its velocity, and its spin only where
    tangential dissipation needs it (d = 3). λ is the multiplier: Â (u − û) + Cᵀλ = 0."""

    first: Index32
    second: Index32
    normal_first: Floats
    normal_second: Floats
    tangent_first: Floats
    tangent_second: Floats
    normal_weight: Floats
    tangent_weight: Floats
    mass: Floats
    left: Floats
    free: Floats
    offset: Floats
    inverse_mass: Floats
    position: Floats
    maintained: bool
    least_scale: float = 0.0

    @cached_property
    def scale(self) -> float:
        """Compute ‖u⁻‖∞ (m/s), the velocity that residuals are measured in.

        At least `least_scale`; tiny where nothing moves."""
        moving = float(np.abs(self.left[:, :2]).max(initial=0.0))
        return max(moving, self.least_scale, float(np.finfo(float).tiny))

    @cached_property
    def dissipative(self) -> bool:
        """Tell whether any contact has k_n or k_t."""
        return bool(self.normal_weight.any() or self.tangent_weight.any())

    @cached_property
    def given(self) -> Floats:
        """Compute (M − DᵀKD) u⁻ = Â û, (n,d) kg m/s."""
        momentum: Floats = 2 * self.mass * self.left - self.inertia(self.left)
        return momentum

    def approach(self, velocity: Floats) -> Floats:
        """Compute C u, (k,) m/s, of velocities (n,d)."""
        return self._rows(self.normal_first, self.normal_second, velocity)

    def sliding(self, velocity: Floats) -> Floats:
        """Compute the tangential part of D u, (k,) m/s, spins included, of velocities (n,d)."""
        return self._rows(self.tangent_first, self.tangent_second, velocity)

    def momentum(self, reaction: Floats, across: Floats | None = None) -> Floats:
        """Compute Cᵀλ (n,d) N·s of reactions (k,), plus the same of tangential ones."""
        first = self.normal_first * reaction[:, None]
        second = self.normal_second * reaction[:, None]
        if across is not None:
            first = first + self.tangent_first * across[:, None]
            second = second + self.tangent_second * across[:, None]
        return sum_at_disks(self.first, self.second, first, second, len(self.mass))

    def inertia(self, velocity: Floats) -> Floats:
        """Compute Â u, (n,d), of velocities (n,d)."""
        momentum = self.mass * velocity
        if self.dissipative:
            along, across = (
                self.normal_weight * self.approach(velocity),
                self.tangent_weight * self.sliding(velocity),
            )
            momentum = momentum + self.momentum(along, across)
        return momentum

    def residual(self, reaction: Floats, velocity: Floats) -> float:
        """Measure max |min(wλ, b − Cu)| / ‖u⁻‖∞ (|Cu − b| where maintained) of an answer.

        It is dimensionless, and 0 for an exact answer."""
        slack = self.offset - self.approach(velocity)
        error = slack if self.maintained else np.minimum(self.inverse_mass * reaction, slack)
        return float(np.abs(error).max(initial=0.0)) / self.scale

    def balance_error(self, reaction: Floats, velocity: Floats) -> float:
        """Measure how far the momentum of any disk is from balance, relative to what it has and
        receives.

        max |M(u − u⁻) + Dᵀp| / (m ‖u⁻‖∞ + Σ|p|) over disks, p = kD(u + u⁻) + λ n, spins by
        inertia over radius. Rounding alone leaves about 1e-16, and k/m times that where contacts
        dissipate."""
        return self.imbalance(velocity, *self.impulses(reaction, velocity))

    def impulses(self, reaction: Floats, velocity: Floats) -> tuple[Floats, Floats | None]:
        """Compute p = k D(u + u⁻) + λ n (k,) N·s, along the normal and across; None: nothing
        across."""
        if not self.dissipative:
            return reaction, None
        total = velocity + self.left
        along = reaction + self.normal_weight * self.approach(total)
        return along, self.tangent_weight * self.sliding(total)

    def imbalance(self, velocity: Floats, along: Floats, across: Floats | None) -> float:
        """Measure the `balance_error` of velocities (n,d) with given `impulses` (k,)."""
        balance = self.mass * (velocity - self.left) + self.momentum(along, across)
        size = np.abs(along) + (0.0 if across is None else np.abs(across))
        received = sum_at_disks(self.first, self.second, size, size, len(self.mass))
        error = np.abs(balance[:, :2]).max(1)
        return float((error / (self.mass[:, 0] * self.scale + received)).max(initial=0.0))

    def acting(self, velocity: Floats) -> ContactProblem:
        """Take the problem in which k_n acts where it pushes for right velocities (n,d), not where
        it would pull: p_n = k_n max(C(u + u⁻), 0) + λ. All k_n act at contacts that are
        maintained."""
        if self.maintained or not self.normal_weight.any():
            return self
        pushes = self.approach(velocity + self.left) >= -ROUNDING * self.scale
        return replace(self, normal_weight=np.where(pushes, self.normal_weight, 0.0))

    def restricted(self, contacts: Flags, disks: Flags) -> ContactProblem:
        """Take the problem of some contacts (k,) and of the disks (n,) that they are between."""
        number = np.cumsum(disks, dtype=np.int32) - np.int32(1)
        second = self.second[contacts]
        by_contact = (
            "normal_first", "normal_second", "tangent_first", "tangent_second", "normal_weight",
            "tangent_weight",
            "offset", "inverse_mass",
        )  # fmt: skip
        return replace(
            self,
            first=number[self.first[contacts]],
            second=np.where(second >= 0, number[second], np.int32(-1)),
            **{name: getattr(self, name)[contacts] for name in by_contact},
            **{name: getattr(self, name)[disks] for name in ("mass", "left", "free", "position")},
        )

    def _rows(self, first: Floats, second: Floats, velocity: Floats) -> Floats:
        rows: Floats = np.einsum("kd,kd->k", first, velocity[self.first])
        other = np.einsum("kd,kd->k", second, velocity[self.second])
        rows += np.where(self.second >= 0, other, 0.0)
        return rows


def impact_problem(
    snapshot: Snapshot,
    contacts: Contacts,
    left_velocity: Floats,
    law: ContactLaw,
    offset: Floats | None = None,
) -> ContactProblem:
    """State the collision problem of a snapshot.

    left_velocity: (n,2) m/s, u⁻
    offset: (k,) m/s, b; 0 where left out

    `free` is û = u⁻ without dissipation; with it the caller has to solve Â û = (M − DᵀKD) u⁻ (see
    `solve`)."""
    k = len(contacts)
    inverse_mass = contacts.inverse_mass(snapshot.mass)
    k_normal, k_tangential = law.acting(contacts, snapshot.mass, left_velocity)
    normal = np.array(contacts.normal)
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
    mass = np.repeat(snapshot.mass[:, None], 2, axis=1)
    left = np.array(left_velocity, order="C")
    rows = [normal, -normal, tangent, -tangent]
    if k_tangential.any():
        none = np.zeros(k)
        lever_first = snapshot.radius[contacts.first]
        lever_second = np.where(
            contacts.is_wall, 0.0, snapshot.radius[np.where(contacts.is_wall, 0, contacts.second)]
        )
        levers = (none, none, lever_first, lever_second)
        rows = [np.column_stack([row, lever]) for row, lever in zip(rows, levers, strict=True)]
        mass = np.column_stack([mass, snapshot.inertia])
        left = np.column_stack([left, snapshot.spin])
    return ContactProblem(
        first=contacts.first.astype(np.int32),
        second=np.where(contacts.is_wall, -1, contacts.second).astype(np.int32),
        normal_first=rows[0],
        normal_second=rows[1],
        tangent_first=rows[2],
        tangent_second=rows[3],
        normal_weight=k_normal,
        tangent_weight=k_tangential,
        mass=mass,
        left=left,
        free=left,
        offset=np.zeros(k) if offset is None else offset,
        inverse_mass=inverse_mass,
        position=snapshot.position,
        maintained=law.maintained,
    )
