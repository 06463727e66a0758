"""Contacts of bodies under loads, wherever these come from: measured forces, another program, an
answer.

    eq = Equilibrium.of_disks(position, radius, pairs, load, friction=0.3)   # m, m, (k,2), (n,3) N, N, N·m
    near = nearest(eq, force, sigma, tolerance)        # nearest.py: the state nearest to given forces
    soft = least_energy_within(eq, spread)             # nearest.py: least energy, balance open by `spread`
    some = ensemble(eq, eq.virial, spread, seed=1)   # ensemble.py: mean, sd, quantiles, R-hat
    span = WithinTolerance(eq, tolerance).of(weights)  # intervals.py: bounds

`tolerance` and `spread` (N) say how far the balance of a body may be open, or is by its standard
deviation: one number, one for each body (n,), or for each and x, y, torque over arm (n,3). 0 is exact,
infinite is a body whose balance does not count, as at a boundary whose loads are not known. Forces:
f_n ≥ 0 pushes, f_t is along t = (−n_y, n_x); first gives f_n n + f_t t to second and takes the opposite,
and −r f_t is the torque of a contact on both."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_array, csr_array

from nscd.arrays import Floats, Indices, Mask, numbers, read_only, whole_numbers
from nscd.bodies import Snapshot
from nscd.contacts import Contacts, levers, of_bodies
from nscd.indeterminacy.linear import NOTHING, carrying
from nscd.indeterminacy.orthogonal import OrthogonalFactor, factorise, undetermined_rows
from nscd.percussions import Percussions

# A contact opens if it does so faster than this share of the velocities at hand.
OPENING = 1e-6


@dataclass(frozen=True, kw_only=True, eq=False)
class Equilibrium:
    """Hold the forces {x ≥ 0} of k contacts of n bodies, within Coulomb's cones, and their balance
    E x = load.

    Of an answer: the percussions that go with its u⁺, whatever the (dissipative) law. Contacts that
    open have no unknown, one that slides has f_n alone, with f_t = ±μ f_n against the sliding.

    contacts: between bodies where disks are joined to such
    contact: (u,) whose unknown: the edges of its cone, f_n = Σ x, f_t = Σ along · x; one without
        friction
    along: (u,) ±μ, or 0
    matrix: (u,w·n) Eᵀ, w 2 without friction or 3: x, y, torque over arm
    load: (w·n,) N, and N of torque over arm; N·s of percussions
    point: (u,) a state in balance, where known: of an answer its own
    complete: whether each unknown is known to be more than 0 in some such state
    virial: −Σ load·x / Σ d (N), the mean f_n of states in balance, weighed by the distance d of the
        centres: the scale of a mean field; NaN with walls, whose forces are not among the loads"""

    contacts: Contacts
    bodies: int
    contact: Indices
    along: Floats
    matrix: csr_array
    load: Floats
    point: Any = None
    complete: bool = False
    virial: float = float("nan")

    @classmethod
    def of_disks(
        cls,
        position: ArrayLike,
        radius: ArrayLike,
        pairs: ArrayLike,
        load: ArrayLike,
        *,
        friction: ArrayLike = 0.0,
        normal: ArrayLike | None = None,
    ) -> Equilibrium:
        """Make the balance of n disks.

        position: (n,2) m; radius: (n,) m
        pairs: (k,2) disks that touch; the second is −1 for a wall, whose `normal` must be given
        load: (n,3) N, N, N·m, or (n,2): forces and torques that are not of these contacts
        friction: μ, of all or (k,)
        normal: (k,2) from first to second; between the centres where left out

        Raises ValueError naming the field for a wrong shape, no finite number, a disk that does not
        exist and a negative μ."""
        points = read_only(position, (-1, 2), "position")
        n, pairs_of = len(points), whole_numbers(pairs, (-1, 2), "pairs")
        first, second = pairs_of.T
        k, wall = len(first), second < 0
        if k and (first.min() < 0 or second.min() < -1 or pairs_of.max() >= n):
            raise ValueError(f"pairs: a disk that does not exist, where there are {n}")
        mu = np.broadcast_to(numbers(friction, "friction"), (k,))
        if not (np.isfinite(mu) & (mu >= 0)).all():
            raise ValueError("friction: μ ≥ 0 is needed")
        size = read_only(radius, (n,), "radius")
        snapshot = Snapshot(position=points, radius=size, mass=np.ones(n))
        branch = points[np.where(wall, 0, second)] - points[first]
        if normal is None:
            if wall.any():
                raise ValueError("normal: that of a wall is needed")
            normal = branch / np.hypot(*branch.T)[:, None]
        unit: Any = normal
        contacts = Contacts(
            first=first, second=np.where(wall, 0, second), is_wall=wall, normal=unit,
            gap=np.zeros(k), point=points[first] + size[first, None] * np.asarray(unit),
        )  # fmt: skip
        loads = numbers(load, "load")
        columns = loads.shape[1] if loads.ndim == 2 and loads.shape[1] in (2, 3) else 3
        loads = np.pad(read_only(load, (n, columns), "load"), ((0, 0), (0, 3 - columns)))
        two = np.flatnonzero(mu > 0)
        contact = np.concatenate([np.arange(k), two])
        along = np.concatenate([mu, -mu[two]])
        matrix = edges(snapshot, contacts.select(contact), along)
        shifted = loads[:, :2] - loads[:, :2].mean(0) if n else loads[:, :2]
        length = float(np.hypot(*branch.T).sum())
        return cls(
            contacts=contacts,
            bodies=n,
            contact=contact,
            along=along,
            matrix=csr_array(matrix),
            load=(loads / np.column_stack([np.ones((n, 2)), size])).ravel(),
            virial=float("nan") if wall.any() or not k else -float((shifted * points).sum()) / length,
        )

    @classmethod
    def of(cls, contacts: Contacts, solution: Percussions) -> Equilibrium:
        """Make that of an answer without friction.

        Raises ValueError if contacts and answer do not belong together, the answer has failed or
        has friction, or reactions pull (those of maintained contacts have no such set)."""
        if solution.friction is not None:
            raise ValueError("solution: it has friction. Its set is Equilibrium.with_friction")
        return cls._answered(contacts, solution)

    @classmethod
    def with_friction(cls, contacts: Contacts, solution: Percussions) -> Equilibrium:
        """Make that of an answer with friction and without dissipation k. Raises ValueError for
        others and for a failed answer."""
        if solution.friction is None:
            raise ValueError("solution: one with friction is needed")
        return cls._answered(contacts, solution)

    @classmethod
    def _answered(cls, contacts: Contacts, solution: Percussions) -> Equilibrium:
        part, reaction = solution.friction, solution.reaction
        minimum = NOTHING * (_largest(contacts, solution) or 1.0)
        mu = tangential = np.zeros(len(contacts))
        if part is not None:
            mu, tangential = part.coefficient, part.tangential
            dissipative = (solution.impulse * contacts.normal).sum(1) - reaction
            if np.abs(dissipative).max(initial=0.0) > minimum:
                raise ValueError("solution: intervals with friction are for laws without dissipation k")
        small, slides = opening_speed(solution), _sliding(contacts, solution)
        closed = contacts.approach_velocity(solution.right_velocity) >= -small
        both = closed & (np.abs(slides) <= small) & (mu > 0)
        one, two = np.flatnonzero(closed & ~both), np.flatnonzero(both)
        fraction = tangential[two] / mu[two]
        halves = 0.5 * (reaction[two] + fraction), 0.5 * (reaction[two] - fraction)
        contact = np.concatenate([one, two, two])
        along = np.concatenate([np.sign(slides[one]) * mu[one], mu[two], -mu[two]])
        point = np.maximum(np.concatenate([reaction[one], *halves]), 0.0)
        compound, some = solution.snapshot.compound, contacts.select(contact)
        n = len(solution.right_velocity if compound is None else compound)
        flat = part is None and compound is None
        matrix = some.normal_matrix(n) if flat else edges(solution.snapshot, some, along)
        return cls(
            contacts=of_bodies(compound, contacts), bodies=n, contact=contact, along=along, matrix=matrix,
            load=matrix.T @ point, point=point,
        )  # fmt: skip

    @classmethod
    def of_answer(cls, contacts: Contacts, solution: Percussions) -> Equilibrium:
        """Make that of an answer, with the unknowns that carry something in some of its percussions.
        Raises as `of`, `with_friction` and `carrying` do."""
        constrained = cls._answered(contacts, solution)
        chosen = constrained.carrying()
        matrix, point = csr_array(constrained.matrix[chosen]), constrained.point[chosen]
        return replace(
            constrained, contact=constrained.contact[chosen], along=constrained.along[chosen], matrix=matrix,
            load=matrix.T @ point, point=point, complete=True,
        )  # fmt: skip

    @property
    def closed(self) -> Mask:
        """Tell (k,) which contacts have unknowns: of an answer those that do not open."""
        return np.isin(np.arange(len(self.contacts)), self.contact)

    @property
    def reaction(self) -> Floats:
        """Sum f_n (k,) of the known state."""
        return np.asarray(np.bincount(self.contact, self.point, len(self.contacts)), np.float64)

    @cached_property
    def scale(self) -> float:
        """Find the largest reaction; 1 where all are 0."""
        return float(self.reaction.max(initial=0.0)) or 1.0

    @cached_property
    def factor(self) -> OrthogonalFactor:
        """Factor of Eᵀ."""
        return self.factor_of(np.arange(len(self.contact)))

    @cached_property
    def core(self) -> Indices:
        """Find (c,) the unknowns that balance alone leaves open, all others being known."""
        return np.flatnonzero(undetermined_rows(self.factor))

    @cached_property
    def core_factor(self) -> OrthogonalFactor:
        """Factor of the rows of Eᵀ on the core."""
        return self.factor_of(self.core)

    @cached_property
    def balance(self) -> csc_array:
        """Select (w·n,c), E on the core."""
        return csc_array(self.matrix[self.core].T)

    def factor_of(self, unknowns: Indices) -> OrthogonalFactor:
        """Factorise the rows of Eᵀ that belong to some unknowns."""
        some = self.contacts.select(self.contact[unknowns])
        return factorise(some, self.bodies, csr_array(self.matrix[unknowns]))

    def carrying(self) -> Indices:
        """Find the unknowns that are more than 0 in some state. Raises ProgramError if a linear
        program has no usable answer."""
        return np.flatnonzero(carrying(self.point / self.scale, self.core, self.balance))

    def rows(self, value: ArrayLike, name: str) -> Floats:
        """Give a number ≥ 0 to each row (w·n,), of one for all, of each body's, or of each row's."""
        width = self.matrix.shape[1] // max(self.bodies, 1)
        array = numbers(value, name)
        if array.ndim == 1:
            array = array.reshape(-1, width if len(array) == len(self.load) else 1)
        try:
            every = np.broadcast_to(array, (self.bodies, width)).ravel()
        except ValueError:
            there = f"{np.shape(value)} where there are {self.bodies} bodies"
            raise ValueError(f"{name}: shape {there}") from None
        if not (every >= 0).all():
            raise ValueError(f"{name}: numbers ≥ 0 are needed")
        return np.array(every)

    @property
    def sums(self) -> csr_array:
        """(2k,u) sparse: f_n and, below, f_t of the unknowns."""
        k, u = len(self.contacts), len(self.contact)
        rows = np.concatenate([self.contact, k + self.contact])
        data = np.concatenate([np.ones(u), self.along])
        return csr_array((data, (rows, np.tile(np.arange(u), 2))), shape=(2 * k, u))

    def net(self, normal: Floats, tangential: Floats) -> Floats:
        """Compute (n,w) N, what balances are open by under forces (k,)."""
        both = np.bincount(self.contact)[self.contact] > 1
        fraction = tangential[self.contact] / np.where(both, self.along, np.inf)
        x = (normal[self.contact] + fraction) * np.where(both, 0.5, 1.0)
        return np.asarray((self.load - self.matrix.T @ x).reshape(self.bodies, -1))


def _largest(contacts: Contacts, solution: Percussions) -> float:
    """The largest reaction of an answer that has a set."""
    reaction = solution.reaction
    if reaction.shape != (len(contacts),):
        there = f"{len(reaction)} reactions where there are {len(contacts)} contacts"
        raise ValueError(f"solution: {there}")
    contacts.check_disks(len(solution.right_velocity))
    if solution.status == "failed":
        raise ValueError(f"solution: failed ({solution.reason}). It has no intervals")
    largest = float(reaction.max(initial=0.0))
    if reaction.min(initial=0.0) < -NOTHING * largest:
        worst = int(np.argmin(reaction))
        pulls = f"the reaction of contact {worst} pulls ({reaction[worst]:g} N·s)"
        raise ValueError(f"solution: {pulls}. Intervals are those of percussions that push")
    return largest


def _sliding(contacts: Contacts, solution: Percussions) -> Floats:
    """T u⁺ (k,) m/s."""
    rim = solution.snapshot.radius * solution.right_spin
    other = np.where(contacts.is_wall, 0, contacts.second)
    turning = rim[contacts.first] + np.where(contacts.is_wall, 0.0, rim[other])
    between = contacts.deformation_velocity(solution.right_velocity)
    return np.asarray((contacts.tangent * between).sum(1) + turning)


def edges(snapshot: Snapshot, contacts: Contacts, along: Floats) -> csr_array:
    """Assemble Eᵀ (u,3n): the impulse n + along · t of each unknown (u,) on its disks, spins over
    radius; or on the bodies, spins over √(I/m)."""
    compound, turn = snapshot.compound, np.column_stack([along, along])
    n = len(snapshot if compound is None else compound)
    if compound is not None:
        normal, across = levers(snapshot, contacts)
        contacts, arm = of_bodies(compound, contacts), np.sqrt(compound.inertia / compound.mass)
        other = np.where(contacts.is_wall, 0, contacts.second)
        turn = (normal + turn * across) / np.column_stack([arm[contacts.first], arm[other]])
    push = contacts.normal + along[:, None] * contacts.tangent
    return contacts.rows(np.c_[push, turn[:, 0]], np.c_[-push, turn[:, 1]], n)


def opening_speed(solution: Percussions) -> float:
    """Compute the speed (m/s) that counts as opening or sliding: a share OPENING (or ten times
    the residual, if that is more) of the larger of max |u⁺| and 2 |ΔE| / Σλ, the mean approach
    before the impact."""
    speed = float(np.abs(solution.right_velocity).max(initial=0.0))
    if (total := float(solution.reaction.sum())) > 0:
        speed = max(speed, 2 * abs(solution.energy_change) / total)
    return max(OPENING, 10 * solution.residual) * speed
