"""Rival contact forces on the same snapshot: the first-order model, the social force and Löhner's
law."""

import enum
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from nscd.arrays import Floats, number, numbers, read_only
from nscd.bodies import Snapshot
from nscd.contacts import Contacts
from nscd.laws import ContactLaw
from nscd.percussions import Status
from nscd.solve import solve


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FirstOrderAnswer:
    """Hold what the first-order model gives.

    multiplier: (k,) m/s, λ, a velocity (an impulse per unit mass of a crowd in which everybody
        has the same mass), not a force and not a percussion: λ·m is the percussion in N·s where
        all masses are m, and nothing where they differ
    right_velocity: (n,2) m/s, u⁺
    residual, status, reason: as of `Percussions`"""

    multiplier: Floats
    right_velocity: Floats
    residual: float
    status: Status
    reason: str


def first_order(
    snapshot: Snapshot,
    contacts: Contacts,
    *,
    left_velocity: ArrayLike | None = None,
    maintained: bool = False,
) -> FirstOrderAnswer:
    """Solve the first-order model of Maury and Venel on a snapshot.

    left_velocity: (n,2) m/s, u⁻; the snapshot's own where left out
    maintained: the printed equality CCᵀλ = C u⁻, whose λ may pull

    0 ≤ λ ⟂ CCᵀλ − C u⁻ ≥ 0, u⁺ = u⁻ − Cᵀλ, masses ignored (paper eq. (4)): u⁺ is the right velocity
    nearest to u⁻ in the sum of squares; λ is the one of least Σλ² where contacts are redundant.
    Raises ValueError as `solve` does, and for bodies of several disks."""
    snapshot.need_disks("first_order")
    unit = replace(snapshot, mass=np.ones(len(snapshot)))
    solution = solve(
        unit,
        contacts,
        left_velocity=left_velocity,
        law=ContactLaw(maintained=maintained),
        tolerance=1e-10,
    )
    return FirstOrderAnswer(
        multiplier=solution.reaction,
        right_velocity=solution.right_velocity,
        residual=solution.residual,
        status=solution.status,
        reason=solution.reason,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class SocialForceLaw:
    """Set the social force of Helbing, Farkas and Vicsek.

    strength: N, A
    decay: m, B
    body_stiffness: kg/s², ϱ
    sliding_friction: kg/(m s), ς

    Normal A exp(−g/B) + ϱ max(−g, 0) with the gap g = d_ij − r_ij, sliding friction ς max(−g, 0)
    times the tangential relative velocity. Nature 407 (2000) 487–490 (paper eq. (9)). Raises
    ValueError for a coefficient that is negative or not finite, or a decay of 0."""

    strength: float = 2000.0
    decay: float = 0.08
    body_stiffness: float = 1.2e5
    sliding_friction: float = 2.4e5

    def __post_init__(self) -> None:
        for name in ("strength", "decay", "body_stiffness", "sliding_friction"):
            value = getattr(self, name)
            if number(value, name, "A finite number ≥ 0") < 0:
                raise ValueError(f"{name}: {value}. A finite number ≥ 0 is needed")
        if self.decay == 0:
            raise ValueError("decay: 0 m. A length > 0 is needed")

    def repulsion(self, gap: Floats) -> Floats:
        """Compute A exp(−g/B) in N of gaps in m: acts at any distance."""
        return np.asarray(self.strength * np.exp(-np.asarray(gap) / self.decay))

    def body(self, gap: Floats) -> Floats:
        """Compute ϱ max(−g, 0) in N of gaps in m: acts where disks overlap."""
        return np.asarray(self.body_stiffness * np.maximum(-np.asarray(gap), 0.0))

    def reach(self, left_out: float) -> float:
        """Compute the gap B ln(A/left_out) (m) beyond which one pair gives less than `left_out` N.

        A search up to there leaves out less than (n − 1 + walls) · left_out of the sum at any of n
        disks. Raises ValueError unless 0 < left_out ≤ A."""
        if not 0 < left_out <= self.strength:
            raise ValueError(
                f"left_out: {left_out} N. More than 0 and at most {self.strength:g} N is needed"
            )
        return self.decay * float(np.log(self.strength / left_out))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SocialForces:
    """Hold the social forces of k pairs.

    pairs: the contacts they belong to
    disks: how many there are
    repulsion, body: (k,) N along the normal, both pushing
    sliding: (k,2) N, what the first gives to the second across the normal"""

    pairs: Contacts
    disks: int
    repulsion: Floats
    body: Floats
    sliding: Floats

    @property
    def normal(self) -> Floats:
        """Compute (k,) N, repulsion plus body force."""
        return self.repulsion + self.body

    @property
    def force(self) -> Floats:
        """Compute (k,2) N, the whole force that the first gives to the second."""
        return self.normal[:, None] * self.pairs.normal + self.sliding

    def resultant(self) -> Floats:
        """Sum (n,2) N, what each disk receives, as vectors."""
        return self.pairs.momentum_change(self.force, self.disks)

    def magnitude_sum(self) -> Floats:
        """Sum (n,) N, the normal magnitudes at each disk."""
        return self.pairs.sum_at_disks(self.normal, self.disks)


def social_force(
    snapshot: Snapshot, pairs: Contacts, law: SocialForceLaw | None = None
) -> SocialForces:
    """Compute the social forces of the given pairs of disks and of disks and walls.

    pairs: the touching contacts only, or `find_contacts(snapshot, walls,
        tolerance=law.reach(left_out))` for all that matter

    Friction is that of the original, which opposes sliding: disk i receives
    ς max(−g, 0) ((v_j − v_i)·t) t (the paper prints Δv_ij without saying whose velocity is
    subtracted); a wall is at rest and acts by its nearest point (paper eq. (9)). Raises ValueError
    for pairs that name disks beyond the snapshot's."""
    law = SocialForceLaw() if law is None else law
    pairs.check_disks(len(snapshot))
    slip = (pairs.tangent * pairs.deformation_velocity(snapshot.velocity)).sum(1)
    sliding = law.sliding_friction * np.maximum(-pairs.gap, 0.0) * slip
    return SocialForces(
        pairs=pairs,
        disks=len(snapshot),
        repulsion=law.repulsion(pairs.gap),
        body=law.body(pairs.gap),
        sliding=sliding[:, None] * pairs.tangent,
    )


class LoehnerReading(enum.StrEnum):
    """Choose how eq. (10) is read.

    printed: f_max/(1 + d²) where d_ij ≤ r_ij, twice that beyond
    text: with the two cases exchanged, as a contact force would have it

    Either way the force jumps by a factor 2 at touch."""

    PRINTED = "printed"
    TEXT = "text"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoehnerForces:
    """Hold Löhner's forces of k pairs.

    pairs: the contacts they belong to
    disks: how many there are
    on_first: (k,) N, pushes the first disk along −normal
    on_second: (k,) N, pushes the second along +normal; 0 where that is a wall. They differ in
        general"""

    pairs: Contacts
    disks: int
    on_first: Floats
    on_second: Floats

    def resultant(self) -> Floats:
        """Sum (n,2) N, what each disk receives, as vectors.

        The sum over the disks of a crowd without walls is not 0."""
        normal = self.pairs.normal
        return self.pairs.sum_at_disks(
            -self.on_first[:, None] * normal, self.disks, on_second=self.on_second[:, None] * normal
        )

    def magnitude_sum(self) -> Floats:
        """Sum (n,) N, the magnitudes at each disk."""
        return self.pairs.sum_at_disks(self.on_first, self.disks, on_second=self.on_second)


def loehner_force(
    snapshot: Snapshot,
    pairs: Contacts,
    maximum_force: ArrayLike,
    reading: LoehnerReading,
    *,
    tolerance: float = 0.0,
) -> LoehnerForces:
    """Compute Löhner's force of the given pairs, repulsive along the normal.

    maximum_force: N, f_max, one number or (n,), by receiver
    reading: which of the two cases is in contact
    tolerance: m; in contact means gap ≤ tolerance, so that rounding does not decide at touch

    On i from j: c f_max,i / (1 + d_i²), d_i = d_ij / r_i, with c = 1 in contact and 2 beyond
    (`printed`) or the reverse (`text`): Applied Mathematical Modelling 34 (2010) 366–382; paper
    eq. (10). The law has no direction of its own; the pairs' normals supply it. d_i counts the
    distance between the centres in radii of the receiver, so that it is 2 at touch for equal radii
    (f_max/5 or 2 f_max/5, never f_max), and a large disk receives more from a small one than it
    gives: f_ij ≠ −f_ji unless radii and f_max are equal. The law names no walls: one acts as a
    neighbour without radius at its nearest point.

    Raises ValueError for a maximum force that is negative, not finite or of another shape, a
    tolerance that is negative or not finite, pairs that name disks beyond the snapshot's, or an
    unknown reading."""
    n = len(snapshot)
    pairs.check_disks(n)
    limit = numbers(maximum_force, "maximum_force")
    limit = read_only(np.full(n, limit) if limit.ndim == 0 else limit, (n,), "maximum_force")
    if (limit < 0).any():
        raise ValueError(f"maximum_force: {limit.min():g} N. A force ≥ 0 is needed")
    if number(tolerance, "tolerance", "A length ≥ 0 m") < 0:
        raise ValueError(f"tolerance: {tolerance} m. A length ≥ 0 is needed")
    if reading not in list(LoehnerReading):
        raise ValueError(f"reading: unknown {reading!r}. There are: {', '.join(LoehnerReading)}")
    in_contact = pairs.gap <= tolerance
    stronger = in_contact if reading == LoehnerReading.TEXT else ~in_contact
    case = np.where(stronger, 2.0, 1.0)
    first, second = pairs.first, np.where(pairs.is_wall, 0, pairs.second)
    radius_first, radius_second = snapshot.radius[first], snapshot.radius[second]
    distance = pairs.gap + radius_first + np.where(pairs.is_wall, 0.0, radius_second)
    on_second = case * limit[second] / (1 + (distance / radius_second) ** 2)
    return LoehnerForces(
        pairs=pairs,
        disks=n,
        on_first=case * limit[first] / (1 + (distance / radius_first) ** 2),
        on_second=np.where(pairs.is_wall, 0.0, on_second),
    )
