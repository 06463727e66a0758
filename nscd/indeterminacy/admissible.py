"""All percussions that the mechanics allows for one answer: a polytope, and which contacts carry
something in it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csc_array, csr_array, hstack

from nscd.arrays import Flags, Floats, Indices
from nscd.bodies import Snapshot
from nscd.contacts import Contacts, levers, of_bodies
from nscd.indeterminacy.orthogonal import OrthogonalFactor, factorise, undetermined_rows
from nscd.percussions import Percussions

# A contact opens if it does so faster than this share of the velocities at hand.
OPENING = 1e-6
# Reactions below this share of the largest may be rounding of the solver.
NOTHING = 1e-7
FEASIBILITY = 1e-10  # the sharpest that HiGHS takes; everything it returns is checked


class ProgramError(RuntimeError):
    """Say that a linear program has no finite optimum, or that HiGHS did not solve it, and why."""


class Optimum(NamedTuple):
    """Hold the end of a linear program.

    point: where it is attained
    multiplier: of its equations"""

    point: Floats
    multiplier: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class Admissible:
    """Hold the set {x ≥ 0, E x = E x₀} of percussions that go with the u⁺ of an answer, x₀ being its
    own.

    Without friction the unknowns are the reactions λ of contacts that do not open. With friction one
    that slides has λ, with τ = ±μλ against the sliding; one that sticks has two, the edges of its
    cone: λ = x₁ + x₂, τ = μ(x₁ − x₂).

    contacts: k of them; between bodies where disks are joined to such
    disks: how many disks, or bodies, there are
    contact: (u,) whose unknown it is
    along: (u,) ±μ, so that λ = Σ x and τ = Σ along · x; 0 without friction
    point: (u,) N·s, x₀
    matrix: (u,2n), Eᵀ; with friction, or of bodies, (u,3n), spins by inertia over lever
    scale: N·s, the largest reaction

    The right velocity u⁺ is the same for all of them, whatever the (dissipative) law: only λ and τ
    are open."""

    contacts: Contacts
    disks: int
    contact: Indices
    along: Floats
    point: Floats
    matrix: csr_array
    scale: float

    @classmethod
    def of(cls, contacts: Contacts, answer: Percussions, opening: float = OPENING) -> Admissible:
        """Make the set of an answer without friction.

        opening: dimensionless; a contact opens if −v⁺ exceeds the `opening_speed`

        Raises ValueError if contacts and answer do not belong together, the answer has failed or
        has friction, or reactions pull (those of maintained contacts have no such set)."""
        if answer.friction is not None:
            raise ValueError("answer: it has friction. Its set is Admissible.with_friction")
        largest = _largest(contacts, answer)
        closed = np.flatnonzero(_closed(contacts, answer, opening_speed(answer, opening)))
        wide, along = answer.snapshot.wide, np.zeros(len(closed))
        n = len(answer.right_velocity if wide is None else wide)
        some = contacts.select(closed)
        return cls(
            contacts=contacts if wide is None else of_bodies(wide, contacts),
            disks=n,
            contact=closed,
            along=along,
            point=np.maximum(answer.reaction[closed], 0.0),
            matrix=some.normal_matrix(n) if wide is None else edges(answer.snapshot, some, along),
            scale=largest or 1.0,
        )

    @classmethod
    def with_friction(cls, contacts: Contacts, answer: Percussions) -> Admissible:
        """Make the set of an answer with friction and without dissipation k. Raises ValueError for
        others and for a failed answer."""
        part, reaction = answer.friction, answer.reaction
        if part is None:
            raise ValueError("answer: one with friction is needed")
        largest = _largest(contacts, answer)
        if np.abs((answer.impulse * contacts.normal).sum(1) - reaction).max(
            initial=0.0
        ) > NOTHING * (largest or 1.0):
            raise ValueError("answer: intervals with friction are for laws without dissipation k")
        small, mu = opening_speed(answer), part.coefficient
        closed, slides = _closed(contacts, answer, small), _sliding(contacts, answer)
        both = closed & (np.abs(slides) <= small) & (mu > 0)
        one, two = np.flatnonzero(closed & ~both), np.flatnonzero(both)
        share = part.tangential[two] / mu[two]
        halves = 0.5 * (reaction[two] + share), 0.5 * (reaction[two] - share)
        contact = np.concatenate([one, two, two])
        along = np.concatenate([np.sign(slides[one]) * mu[one], mu[two], -mu[two]])
        wide = answer.snapshot.wide
        return cls(
            contacts=contacts if wide is None else of_bodies(wide, contacts),
            disks=len(answer.right_velocity if wide is None else wide),
            contact=contact,
            along=along,
            point=np.maximum(np.concatenate([reaction[one], *halves]), 0.0),
            matrix=edges(answer.snapshot, contacts.select(contact), along),
            scale=largest or 1.0,
        )

    @property
    def closed(self) -> Flags:
        """Tell (k,) which contacts do not open."""
        return np.isin(np.arange(len(self.contacts)), self.contact)

    @property
    def reaction(self) -> Floats:
        """Sum λ (k,) N·s, with 0 at contacts that open."""
        return np.asarray(
            np.bincount(self.contact, self.point, len(self.contacts)), dtype=np.float64
        )

    @cached_property
    def factor(self) -> OrthogonalFactor:
        """Factor of Eᵀ."""
        return self.factor_of(np.arange(len(self.contact)))

    @cached_property
    def core(self) -> Indices:
        """Find (c,) the unknowns that balance alone leaves open, all others being known."""
        return np.flatnonzero(undetermined_rows(self.factor))

    @cached_property
    def balance(self) -> csc_array:
        """Select (2n,c) or (3n,c), E on the core."""
        return csc_array(self.matrix[self.core].T)

    def factor_of(self, unknowns: Indices) -> OrthogonalFactor:
        """Factorise the rows of Eᵀ that belong to some unknowns."""
        some = self.contacts.select(self.contact[unknowns])
        return factorise(some, self.disks, csr_array(self.matrix[unknowns]))

    def carrying(self) -> Indices:
        """Find the unknowns that are more than 0 in some admissible percussion. Raises ProgramError
        if a linear program has no usable answer."""
        return np.flatnonzero(carrying(self.point / self.scale, self.core, self.balance))


def _largest(contacts: Contacts, answer: Percussions) -> float:
    """The largest reaction of an answer that has a set."""
    reaction = answer.reaction
    if reaction.shape != (len(contacts),):
        there = f"{len(reaction)} reactions where there are {len(contacts)} contacts"
        raise ValueError(f"answer: {there}")
    contacts.check_disks(len(answer.right_velocity))
    if answer.status == "failed":
        raise ValueError(f"answer: failed ({answer.reason}). It has no intervals")
    largest = float(reaction.max(initial=0.0))
    if reaction.min(initial=0.0) < -NOTHING * largest:
        worst = int(np.argmin(reaction))
        pulls = f"the reaction of contact {worst} pulls ({reaction[worst]:g} N·s)"
        raise ValueError(f"answer: {pulls}. Intervals are those of percussions that push")
    return largest


def _closed(contacts: Contacts, answer: Percussions, slow: float) -> Flags:
    return np.asarray(contacts.approach_velocity(answer.right_velocity) >= -slow)


def _sliding(contacts: Contacts, answer: Percussions) -> Floats:
    """T u⁺ (k,) m/s."""
    tangent = np.column_stack([-contacts.normal[:, 1], contacts.normal[:, 0]])
    rim = answer.snapshot.radius * answer.right_spin
    other = np.where(contacts.is_wall, 0, contacts.second)
    turning = rim[contacts.first] + np.where(contacts.is_wall, 0.0, rim[other])
    between = contacts.deformation_velocity(answer.right_velocity)
    return np.asarray((tangent * between).sum(1) + turning)


def edges(snapshot: Snapshot, contacts: Contacts, along: Floats) -> csr_array:
    """Assemble Eᵀ (u,3n): the impulse n + along · t of each unknown (u,) on its disks, spins over
    radius; or on the bodies, spins over √(I/m)."""
    wide, turn = snapshot.wide, np.column_stack([along, along])
    n = len(snapshot if wide is None else wide)
    if wide is not None:
        normal, across = levers(snapshot, contacts)
        contacts, arm = of_bodies(wide, contacts), np.sqrt(wide.inertia / wide.mass)
        other = np.where(contacts.is_wall, 0, contacts.second)
        turn = (normal + turn * across) / np.column_stack([arm[contacts.first], arm[other]])
    tangent = np.column_stack([-contacts.normal[:, 1], contacts.normal[:, 0]])
    push = contacts.normal + along[:, None] * tangent
    pair = np.flatnonzero(~contacts.is_wall)
    first, second = 3 * contacts.first, 3 * contacts.second[pair]
    columns = [first, first + 1, first + 2, second, second + 1, second + 2]
    data = [push[:, 0], push[:, 1], turn[:, 0], -push[pair, 0], -push[pair, 1], turn[pair, 1]]
    rows = [np.arange(len(along))] * 3 + [pair] * 3
    places = np.concatenate(rows), np.concatenate(columns)
    return csr_array((np.concatenate(data), places), shape=(len(along), 3 * n))


def opening_speed(answer: Percussions, opening: float = OPENING) -> float:
    """Compute the speed (m/s) that counts as opening or sliding: a share `opening` (or ten times
    the residual, if that is more) of the larger of max |u⁺| and 2 |ΔE| / Σλ, the mean approach
    before the impact."""
    speed = float(np.abs(answer.right_velocity).max(initial=0.0))
    if (total := float(answer.reaction.sum())) > 0:
        speed = max(speed, 2 * abs(answer.energy_change) / total)
    return max(opening, 10 * answer.residual) * speed


def carrying(point: Floats, core: Indices, balance: csc_array) -> Flags:
    """Find the unknowns (u,) that are more than 0 in some x ≥ 0 with balance x_core = balance
    point_core.

    point: (u,), one such x, in units of its largest
    core: (c,) indices of the unknowns that the balance leaves open; the others are known
    balance: (r,c)

    Rounds of max Σ min(x_c, δ) over the c that carry nothing so far; the optimum 0 is the proof
    that the rest never carry. The mean of the optima is positive at all others."""
    carries = np.asarray(point > NOTHING)
    impulse, c = balance @ point[core], len(core)
    while len(idle := np.flatnonzero(~carries[core])):
        share = float(np.median(point[carries])) if carries.any() else 1.0
        upper = np.concatenate([np.full(c, np.inf), np.full(len(idle), share)])
        columns = csc_array(hstack([balance, balance[:, idle]]))
        weights = np.concatenate([np.zeros(c), np.ones(len(idle))])
        found = maximise(weights, columns, impulse, upper)
        gained = found.point[c:] + found.point[idle] > NOTHING
        if not gained.any():
            break
        carries[core[idle[gained]]] = True
    return carries


def maximise(
    weights: Floats, matrix: csc_array, right: Floats, upper: Floats | float = np.inf
) -> Optimum:
    """Maximise weights·x subject to matrix x = right and 0 ≤ x ≤ upper.

    Raises ProgramError naming the reason where that has no end or no solution."""
    bounds = np.column_stack([np.zeros(len(weights)), np.broadcast_to(upper, len(weights))])
    sides = ("primal", "dual")
    options = {f"{side}_feasibility_tolerance": FEASIBILITY for side in sides}
    # the interior point with crossover is several times faster on large packings, the simplex more
    # robust
    for method in ("highs-ipm", "highs-ds"):
        given = {"A_eq": matrix, "b_eq": right, "bounds": bounds, "options": options}
        found = linprog(-weights, method=method, **given)
        if found.status == 0:
            break
    else:
        raise ProgramError(f"linear program of {matrix.shape[1]} reactions: {found.message}")
    return Optimum(np.asarray(found.x), -np.asarray(found.eqlin.marginals))
