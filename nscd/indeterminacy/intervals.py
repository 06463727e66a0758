"""How much a contact, a disk or a wall can carry: proven intervals over all admissible
percussions."""

import enum
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_array, hstack

from nscd import _core
from nscd.arrays import Flags, Floats, Indices, read_only
from nscd.contacts import Contacts
from nscd.indeterminacy.admissible import Admissible, ProgramError, maximise
from nscd.percussions import Percussions

# An interval is proven if certificates and attained values agree to this share of the largest
# reaction.
PROVEN = 1e-7
# A wedge carries any amount; ends are proven for percussions that load it up to this multiple of
# the answer's sum.
WEDGE_MULTIPLE = 1e3


class IntervalStatus(enum.StrEnum):
    """Say what an interval is worth.

    proven: both ends, to rounding
    unbounded: an end is infinite, shown by a self-stress that only pushes, and a finite one is
        proven
    unproven: the interval holds, but may be wider than the true one by `gap`"""

    PROVEN = "proven"
    UNBOUNDED = "unbounded"
    UNPROVEN = "unproven"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Interval:
    """Hold [lower, upper] of Σ w_c λ'_c over all admissible percussions λ'.

    lower, upper: N·s (if the weights have no unit), certificates of weak duality: nothing
        admissible lies beyond them
    gap: N·s, how far at most they are from values that an admissible percussion attains
    lower_velocity, upper_velocity: (n,2), with friction (n,3), the certificates; zero where the end is infinite

    They also say how the ends move with the impulses on the disks: every λ' ≥ 0 on the closed
    contacts whose impulses Cᵀλ' differ from the answer's by Δ (n,2) N·s has
    lower + Σ lower_velocity·Δ ≤ Σ w λ' ≤ upper + Σ upper_velocity·Δ."""

    lower: float
    upper: float
    gap: float
    status: IntervalStatus
    lower_velocity: Floats
    upper_velocity: Floats

    @property
    def width(self) -> float:
        """Compute upper − lower: 0 but for rounding where the mechanics determines the quantity."""
        return self.upper - self.lower


def interval(contacts: Contacts, answer: Percussions, weights: ArrayLike) -> Interval:
    """Find the interval of Σ w_c λ_c for the answer of one problem; of many quantities:
    `Intervals`.

    weights: (k,), w; `weights_of_contacts`, `weights_of_disk`, `weights_of_wall` make the usual
        ones

    Raises ValueError for weights of the wrong shape and whatever `Admissible.of` does, ProgramError
    if a linear program has no usable answer."""
    return Intervals(Admissible.of(contacts, answer)).of(weights)


def weights_of_contacts(contacts: Contacts, *indices: int) -> Floats:
    """Weigh (k,) the sum of the reactions of the contacts with these indices."""
    for index in indices:
        if not 0 <= index < len(contacts):
            raise ValueError(f"indices: contact {index} where there are {len(contacts)}")
    weights = np.zeros(len(contacts))
    weights[list(indices)] = 1.0
    return weights


def weights_of_disk(contacts: Contacts, disk: int) -> Floats:
    """Weigh (k,) a disk's total: the sum of the reactions of all its contacts."""
    touching = (contacts.first == disk) | (~contacts.is_wall & (contacts.second == disk))
    return np.asarray(touching, dtype=np.float64)


def weights_of_wall(contacts: Contacts, wall: int) -> Floats:
    """Weigh (k,) a wall's load: the sum of the reactions of all its contacts."""
    return np.asarray(contacts.is_wall & (contacts.second == wall), dtype=np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """A connected part of the core. columns (p,) of the core; rows (r,) of the balance; balance
    (r,p); impulse (r,); wedged (p,); total: a proven bound of the sum of reactions, all in units of
    the largest reaction."""

    columns: Indices
    rows: Indices
    balance: csc_array
    impulse: Floats
    wedged: Flags
    total: float


class Intervals:
    """Find the intervals of any number of quantities for one admissible set."""

    def __init__(self, admissible: Admissible) -> None:
        self.admissible = admissible
        chosen = admissible.contacts.select(admissible.contact[admissible.core])
        second = np.where(chosen.is_wall, -1, chosen.second)
        ends = (chosen.first.astype(np.int32), second.astype(np.int32))
        self._part_of = _core.components(admissible.disks, *ends)[chosen.first]
        self._core_factor = admissible.factor_of(admissible.core)
        self._parts: dict[int, _Part] = {}

    def of(self, weights: ArrayLike, *, tangential: bool = False) -> Interval:
        """Find the interval of Σ w_c λ_c, or of Σ w_c τ_c, for weights (k,). Raises as `interval`
        does."""
        held = self.admissible
        weights = read_only(weights, (len(held.contacts),), "weights")[held.contact]
        if tangential:
            weights = held.along * weights
        upper, gap_above, above = self._largest(weights)
        lower, gap_below, below = self._largest(-weights)
        gap, size = max(gap_above, gap_below), float(np.abs(weights).max(initial=0.0))
        finite = np.isfinite([lower, upper]).all()
        status = IntervalStatus.PROVEN if finite else IntervalStatus.UNBOUNDED
        if gap > PROVEN * held.scale * size:
            status = IntervalStatus.UNPROVEN
        return Interval(
            lower=-lower,
            upper=upper,
            gap=gap,
            status=status,
            lower_velocity=-below,
            upper_velocity=above,
        )

    def _largest(self, weights: Floats) -> tuple[float, float, Floats]:
        """The upper end of Σ w x for weights (u,) of the unknowns, its gap, and the velocities that
        prove it, (n,2) or with spins (n,3)."""
        held = self.admissible
        on_core, start = weights[held.core], held.point[held.core]
        velocity = np.zeros(held.matrix.shape[1])
        attained = start.copy()
        total = 0.0
        for number in np.unique(self._part_of[on_core != 0]).tolist():
            part = self._part(number)
            wanted = on_core[part.columns]
            if wanted[part.wedged].any() and self._grows(part, wanted):
                return float("inf"), 0.0, np.zeros_like(velocity).reshape(held.disks, -1)
            found = maximise(wanted, part.balance, part.impulse)
            velocity[part.rows] = found.multiplier
            attained[part.columns] = found.point * held.scale
            total += part.total * held.scale
        # on the core Σ w x ≤ velocity·E x + excess Σ x; the other unknowns are known
        pressing = held.balance.T @ velocity
        excess = float((on_core - pressing).max(initial=0.0))
        known = float(weights @ held.point)
        bound = known + float((pressing - on_core) @ start) + excess * total
        moved = self._core_factor.self_stress(attained - start)  # balanced to rounding
        gap = max(bound - known - float(on_core @ moved), 0.0)
        gap += max(-float((start + moved).min(initial=0.0)), 0.0)
        # what is known follows the impulses too: the velocity that closes it, and no unknown of the
        # core
        missing = weights - held.matrix @ velocity
        missing[held.core] = 0.0
        velocity += held.factor.least_squares(missing)
        return bound, gap, velocity.reshape(held.disks, -1)

    def _part(self, number: int) -> _Part:
        if number not in self._parts:
            held = self.admissible
            columns = np.flatnonzero(self._part_of == number)
            balance = csc_array(held.balance[:, columns])
            rows = np.unique(balance.indices).astype(np.int64)
            balance = csc_array(balance.tocsr()[rows])
            impulse = balance @ held.point[held.core[columns]] / held.scale
            wedged = np.zeros(len(columns), dtype=bool)
            try:
                most = maximise(np.ones(len(columns)), balance, impulse)
            except ProgramError:
                wedged = _wedged(balance)
                if not wedged.any():
                    raise
                most = maximise(np.where(wedged, 0.0, 1.0), balance, impulse)
            pressing = balance.T @ most.multiplier
            least = float(pressing[~wedged].min(initial=1.0))  # 1 but for rounding
            total = float(most.multiplier @ impulse) / least
            if wedged.any():
                total += WEDGE_MULTIPLE * float(held.point.sum()) / held.scale
            self._parts[number] = _Part(columns, rows, balance, impulse, wedged, total)
        return self._parts[number]

    def _grows(self, part: _Part, weights: Floats) -> bool:
        """Whether a self-stress that only pushes adds to Σ w λ."""
        found = maximise(weights, part.balance, np.zeros(len(part.rows)), upper=1.0)
        stress = np.zeros(len(self.admissible.core))
        stress[part.columns] = found.point
        stress = self._core_factor.self_stress(stress)[part.columns]
        return bool(weights @ stress > PROVEN * np.abs(weights).max() and stress.min() > -PROVEN)


def _wedged(balance: csc_array) -> Flags:
    """(p,): contacts that some self-stress r ≥ 0, Cᵀr = 0, loads: max Σ min(r_c, 1), attained with
    1 at each of them."""
    p = balance.shape[1]
    upper = np.concatenate([np.ones(p), np.full(p, np.inf)])
    weights = np.concatenate([np.ones(p), np.zeros(p)])
    columns = csc_array(hstack([balance, balance]))
    found = maximise(weights, columns, np.zeros(balance.shape[0]), upper)
    return np.asarray(found.point[:p] > 0.5)
