"""How much a contact, a disk or a wall can carry: proven intervals over all admissible
percussions."""

import enum
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_array, eye_array, hstack

from nscd.arrays import Floats, Indices, Mask, read_only
from nscd.contacts import Contacts
from nscd.indeterminacy.equilibrium import Equilibrium
from nscd.indeterminacy.linear import Optimum, ProgramError, maximise
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


def interval(contacts: Contacts, solution: Percussions, weights: ArrayLike) -> Interval:
    """Find the interval of Σ w_c λ_c for the answer of one problem; of many quantities:
    `Intervals`.

    weights: (k,), w; `weights_of_contacts`, `weights_of_disk`, `weights_of_wall` make the usual
        ones

    Raises ValueError for weights of the wrong shape and whatever `Equilibrium.of` does, ProgramError
    if a linear program has no usable answer."""
    return Intervals(Equilibrium.of(contacts, solution)).of(weights)


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
    in_contact = (contacts.first == disk) | (~contacts.is_wall & (contacts.second == disk))
    return np.asarray(in_contact, dtype=np.float64)


def weights_of_wall(contacts: Contacts, wall: int) -> Floats:
    """Weigh (k,) a wall's load: the sum of the reactions of all its contacts."""
    return np.asarray(contacts.is_wall & (contacts.second == wall), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class _Part:
    """Unknowns that only rows of their own hold, in units of the largest: columns (p,) of all; rows
    (r,) of the balance; balance (r,p); load (r,), and by how much at most it may be missed (r,)."""

    columns: Indices
    rows: Indices
    balance: csc_array
    load: Floats
    most: Floats

    def largest(self, weights: Floats) -> Optimum:
        """The state of the largest Σ w x, and the multipliers of the balances."""
        p, r = len(weights), len(self.load)
        if not self.most.any():
            return maximise(weights, self.balance, self.load)
        matrix = csc_array(hstack([self.balance, eye_array(r)]))
        upper = np.append(np.full(p, np.inf), 2 * self.most)
        found = maximise(np.append(weights, np.zeros(r)), matrix, self.load + self.most, upper)
        return Optimum(found.point[:p], found.multiplier)

    def stress(self, weights: Floats) -> Floats:
        """The self-stress (p,) of 0 to 1 that adds most to Σ w x."""
        return maximise(weights, self.balance, np.zeros(len(self.rows)), upper=1.0).point

    @cached_property
    def limits(self) -> tuple[Mask, float]:
        """(p,) what some self-stress r ≥ 0 loads (max Σ min(r_c, 1), attained with 1 at each), and a
        proven bound of Σ x over all others."""
        p, wedged = len(self.columns), np.zeros(len(self.columns), dtype=bool)
        try:
            v = self.largest(np.ones(p)).multiplier
        except ProgramError:
            upper = np.append(np.ones(p), np.full(p, np.inf))
            twice = csc_array(hstack([self.balance, self.balance]))
            weights = np.append(np.ones(p), np.zeros(p))
            wedged = maximise(weights, twice, np.zeros(len(self.rows)), upper).point[:p] > 0.5
            v = self.largest(np.where(wedged, 0.0, 1.0)).multiplier
        pressing = float((self.balance.T @ v)[~wedged].min(initial=1.0))  # 1 but for rounding
        return wedged, float(v @ self.load + np.abs(v) @ self.most) / pressing


class Intervals:
    """Find the intervals of any number of quantities for the percussions of an answer."""

    def __init__(self, equilibrium: Equilibrium) -> None:
        if equilibrium.point is None:
            raise ValueError("equilibrium: no state of it is known. Its bounds are those of WithinTolerance")
        self.equilibrium, self.scale = equilibrium, equilibrium.scale
        chosen = equilibrium.contacts.select(equilibrium.contact[equilibrium.core])
        self._part_of = chosen.islands(equilibrium.bodies)[chosen.first]
        self._parts: dict[int, _Part] = {}

    def of(self, weights: ArrayLike, *, tangential: bool = False) -> Interval:
        """Find the interval of Σ w_c λ_c, or of Σ w_c τ_c, for weights (k,). Raises as `interval` does,
        and ProgramError where no state is within a tolerance."""
        weights_of = self._weights_of(weights, tangential)
        (upper, above_gap, above), (lower, below_gap, below) = map(self._largest, (weights_of, -weights_of))
        gap, size = max(above_gap, below_gap), float(np.abs(weights_of).max(initial=0.0))
        finite = np.isfinite([lower, upper]).all()
        status = IntervalStatus.PROVEN if finite else IntervalStatus.UNBOUNDED
        return Interval(
            lower=-lower,
            upper=upper,
            gap=gap,
            status=IntervalStatus.UNPROVEN if gap > PROVEN * self.scale * size else status,
            lower_velocity=-below,
            upper_velocity=above,
        )

    def ends(self, weights: ArrayLike, *, tangential: bool = False) -> tuple[float, float]:
        """Find the ends that `of` finds, without what proves them, in half of the time."""
        inputs = self._weights_of(weights, tangential)
        upper, lower = (self._largest(one, proof=False)[0] for one in (inputs, -inputs))
        return -lower, upper

    def _weights_of(self, weights: ArrayLike, tangential: bool) -> Floats:
        equilibrium = self.equilibrium
        inputs = read_only(weights, (len(equilibrium.contacts),), "weights")[equilibrium.contact]
        return np.asarray(equilibrium.along * inputs if tangential else inputs)

    def _largest(self, weights: Floats, proof: bool = True) -> tuple[float, float, Floats]:
        """The upper end of Σ w x for weights (u,) of the unknowns, its gap, and the velocities that
        prove it, (n,2) or with spins (n,3); without `proof` only the end counts."""
        equilibrium = self.equilibrium
        on_core, start = weights[equilibrium.core], equilibrium.point[equilibrium.core]
        velocity = np.zeros(equilibrium.matrix.shape[1])
        attained = start.copy()
        total = 0.0
        for number in np.unique(self._part_of[on_core != 0]).tolist():
            part = self._part(number)
            wanted = on_core[part.columns]
            wedged, maximum = part.limits
            if wanted[wedged].any() and self._grows(part, wanted):
                return float("inf"), 0.0, np.zeros_like(velocity).reshape(equilibrium.bodies, -1)
            found = part.largest(wanted)
            velocity[part.rows] = found.multiplier
            attained[part.columns] = found.point * equilibrium.scale
            total += maximum * equilibrium.scale + WEDGE_MULTIPLE * float(equilibrium.point.sum()) * wedged.any()
        # on the core Σ w x ≤ velocity·E x + excess Σ x; the other unknowns are known
        pressing = equilibrium.balance.T @ velocity
        excess = float((on_core - pressing).max(initial=0.0))
        weighted_sum = float(weights @ equilibrium.point)
        bound = weighted_sum + float((pressing - on_core) @ start) + excess * total
        if not proof:
            return bound, 0.0, velocity
        moved = self.equilibrium.core_factor.self_stress(attained - start)  # balanced to rounding
        gap = max(bound - weighted_sum - float(on_core @ moved), 0.0)
        gap += max(-float((start + moved).min(initial=0.0)), 0.0)
        # what is known follows the impulses too: the velocity that closes it, and no unknown of the
        # core
        missing = weights - equilibrium.matrix @ velocity
        missing[equilibrium.core] = 0.0
        velocity += equilibrium.factor.least_squares(missing)
        return bound, gap, velocity.reshape(equilibrium.bodies, -1)

    def _part(self, number: int) -> _Part:
        if number not in self._parts:
            equilibrium = self.equilibrium
            columns = np.flatnonzero(self._part_of == number)
            balance = csc_array(equilibrium.balance[:, columns])
            rows = np.unique(balance.indices).astype(np.int64)
            balance = csc_array(balance.tocsr()[rows])
            impulse = balance @ equilibrium.point[equilibrium.core[columns]] / equilibrium.scale
            self._parts[number] = _Part(columns, rows, balance, impulse, 0 * impulse)
        return self._parts[number]

    def _grows(self, part: _Part, weights: Floats) -> bool:
        """Whether a self-stress that only pushes adds to Σ w λ."""
        stress = np.zeros(len(self.equilibrium.core))
        stress[part.columns] = part.stress(weights)
        stress = self.equilibrium.core_factor.self_stress(stress)[part.columns]
        return bool(weights @ stress > PROVEN * np.abs(weights).max() and stress.min() > -PROVEN)


class WithinTolerance(Intervals):
    """Find the intervals over all states x ≥ 0 whose balances are open by at most a tolerance:
    |load − E x| ≤ tolerance. Their certificates are those of weak duality: for any velocity v,
    w·x ≤ v·load + |v|·tolerance + max(w − Eᵀv, 0) Σ x.

    tolerance: N (N·s of percussions), see `equilibrium`"""

    def __init__(self, equilibrium: Equilibrium, tolerance: ArrayLike) -> None:
        self.equilibrium, maximum = equilibrium, equilibrium.rows(tolerance, "tolerance")
        self.scale = float(np.abs(equilibrium.load).max(initial=0.0)) or float(maximum.max(initial=1.0))
        rows, every = np.flatnonzero(np.isfinite(maximum)), np.arange(len(equilibrium.contact))
        balance, load = csc_array(equilibrium.matrix.T.tocsr()[rows]), equilibrium.load[rows] / self.scale
        self._complete = _Part(every, rows, balance, load, maximum[rows] / self.scale)

    def _largest(self, weights: Floats, proof: bool = True) -> tuple[float, float, Floats]:
        """The upper end, how far it is from one that is attained, and the velocity that proves it."""
        velocity, part = np.zeros(len(self.equilibrium.load)), self._complete
        shape = (self.equilibrium.bodies, -1)
        if weights @ part.stress(weights) > PROVEN * np.abs(weights).max(initial=0.0):
            return float("inf"), 0.0, velocity.reshape(shape)
        point, v = part.largest(weights)
        bound = float(v @ part.load + np.abs(v) @ part.most)
        if (excess := float((weights - part.balance.T @ v).max(initial=0.0))) > 0:
            wedged, maximum = part.limits
            bound += excess * (maximum + WEDGE_MULTIPLE * len(weights) * wedged.any())
        velocity[part.rows] = v
        gap = max(bound - float(weights @ point), 0.0) * self.scale
        return bound * self.scale, gap, velocity.reshape(shape)
