"""What balance and the cones of friction leave open: rank, determined parts, admissible
intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigvalsh
from scipy.sparse import csc_array, csr_array, eye_array
from scipy.sparse.linalg import splu

from nscd.arrays import Flags, Floats, Indices
from nscd.bodies import Snapshot
from nscd.contacts import Contacts
from nscd.indeterminacy.admissible import (
    NOTHING,
    ProgramError,
    carrying,
    maximise,
    opening_speed,
)
from nscd.percussions import Percussions, Status

# An entry of a self-stress (of unit size) below this is rounding.
ZERO = 1e-7
# The projection onto self-stresses: δ, and how often it is repeated.
RIDGE, PASSES, PROBES = 1e-12, 4, 8
# Singular values of E below this, over the largest, are rounding; the most disks that they are
# found of.
RANK, MOST = 1e-6, 2000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrictionDeterminacy:
    """What is known of percussions with friction, all that go with one u⁺ considered.

    rank: of the balance on the edges of the cones that can carry
    redundant: the dimension of the set of percussions
    normal, tangential: (k,) whether λ and τ are the same in all of them"""

    rank: int
    redundant: int
    normal: Flags
    tangential: Flags


@dataclass(frozen=True, slots=True, eq=False)
class Cones:
    """The percussions that go with the velocities u⁺ of an answer: {x ≥ 0, E x = E x₀}, a polytope.

    A contact that sticks has two unknowns x, its cone's edges: λ = x₁ + x₂, τ = μ(x₁ − x₂); one
    that slides has one, λ, with τ = ±μλ against the sliding; one that opens none.

    matrix: E (3n,c), spins by inertia over lever; point: x₀ (c,), in units of `scale` N·s; contact
    (c,): whose unknown; along (c,): ±μ, so that λ = Σ x and τ = Σ along · x; core (d,): unknowns
    that balance alone leaves open; k: contacts."""

    matrix: csc_array
    point: Floats
    contact: Indices
    along: Floats
    core: Indices
    scale: float
    k: int

    @classmethod
    def of(cls, snapshot: Snapshot, contacts: Contacts, answer: Percussions) -> Cones:
        """The set of an answer with friction and without dissipation k. Raises ValueError for
        others and for a failed answer."""
        part = answer.friction
        if part is None or answer.status == Status.FAILED:
            raise ValueError("answer: one with friction that did not fail is needed")
        normal_part = (answer.impulse * contacts.normal).sum(1)
        largest = float(answer.reaction.max(initial=0.0)) or 1.0
        if np.abs(normal_part - answer.reaction).max(initial=0.0) > NOTHING * largest:
            raise ValueError("answer: intervals with friction are for laws without dissipation k")
        v, s = _velocities(snapshot, contacts, answer)
        small, mu = opening_speed(answer), part.coefficient
        closed = v >= -small
        both = closed & (np.abs(s) <= small) & (mu > 0)
        one, two = np.flatnonzero(closed & ~both), np.flatnonzero(both)
        share = np.divide(part.tangential[two], mu[two])
        contact = np.concatenate([one, two, two])
        along = np.concatenate([np.sign(s[one]) * mu[one], mu[two], -mu[two]])
        halves = 0.5 * (answer.reaction[two] + share), 0.5 * (answer.reaction[two] - share)
        point = np.maximum(np.concatenate([answer.reaction[one], *halves]), 0.0) / largest
        matrix = _balance(snapshot, contacts, contact, along)
        loose = np.abs(_self_stresses(matrix)).max(axis=1, initial=0.0) > ZERO
        core = np.flatnonzero(loose)
        return cls(matrix, point, contact, along, core, largest, len(contacts))

    def determined(self) -> tuple[Flags, Flags]:
        """Tell whether λ, and τ, of each contact (k,) are the same in all of the set. Raises
        ProgramError where a linear program has no usable answer."""
        some = self._carrying()
        loose = _self_stresses(csc_array(self.matrix[:, some]))
        sums = np.zeros((2, self.k, PROBES))
        np.add.at(sums[0], self.contact[some], loose)
        np.add.at(sums[1], self.contact[some], self.along[some, None] * loose)
        known = np.abs(sums).max(axis=2) <= ZERO
        return known[0], known[1]

    def determinacy(self) -> FrictionDeterminacy:
        """Find the dimension of the set too. Raises as `determined` does, and ValueError for more
        than 2000 disks: the eigenvalues of E Eᵀ are those of a dense matrix."""
        if self.matrix.shape[0] > 3 * MOST:
            raise ValueError(f"answer: {self.matrix.shape[0] // 3} disks; {MOST} is the most")
        normal, tangential = self.determined()
        some = self._carrying()
        chosen = csr_array(self.matrix[:, some])
        values = eigvalsh((chosen @ chosen.T).toarray())
        rank = int((values > RANK**2 * values.max(initial=0.0)).sum())
        free = len(some) - rank
        return FrictionDeterminacy(rank=rank, redundant=free, normal=normal, tangential=tangential)

    def interval(self, contact: int, *, tangential: bool = False) -> tuple[float, float]:
        """The least and the largest λ (or τ) of a contact, N·s; infinite where the contact is part
        of a wedge that carries any amount. Raises ProgramError as `determined` does."""
        mine = self.contact == contact
        weights = np.where(mine, self.along if tangential else 1.0, 0.0)
        known = np.ones(len(weights), dtype=bool)
        known[self.core] = False
        fixed = float(weights[known] @ self.point[known])
        wanted = weights[self.core]
        if not wanted.any():
            return fixed * self.scale, fixed * self.scale
        lower = fixed - self._largest(-wanted)
        return lower * self.scale, (fixed + self._largest(wanted)) * self.scale

    def _largest(self, weights: Floats) -> float:
        matrix = csc_array(self.matrix[:, self.core])
        impulse = matrix @ self.point[self.core]
        try:
            found = maximise(weights, matrix, impulse)
        except ProgramError:
            ray = maximise(weights, matrix, np.zeros(len(impulse)), upper=1.0)
            if weights @ ray.point > ZERO:
                return float("inf")
            raise
        return float(weights @ found.point)

    def _carrying(self) -> Indices:
        """Unknowns that are more than 0 in some percussion."""
        balance = csc_array(self.matrix[:, self.core])
        return np.flatnonzero(carrying(self.point, self.core, balance))


def _velocities(
    snapshot: Snapshot, contacts: Contacts, answer: Percussions
) -> tuple[Floats, Floats]:
    """C u⁺ and T u⁺, (k,) m/s."""
    tangent = np.column_stack([-contacts.normal[:, 1], contacts.normal[:, 0]])
    between = contacts.deformation_velocity(answer.right_velocity)
    rim = snapshot.radius * answer.right_spin
    other = np.where(contacts.is_wall, 0, contacts.second)
    turning = rim[contacts.first] + np.where(contacts.is_wall, 0.0, rim[other])
    v: Floats = (contacts.normal * between).sum(1)
    s: Floats = (tangent * between).sum(1) + turning
    return v, s


def _balance(snapshot: Snapshot, contacts: Contacts, contact: Indices, along: Floats) -> csc_array:
    """E: the impulse n + along · t of each unknown on its disks, spins over radius."""
    n, c = len(snapshot), len(contact)
    normal = contacts.normal[contact]
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
    push = normal + along[:, None] * tangent
    pair = np.flatnonzero(~contacts.is_wall[contact])
    first, second = contacts.first[contact], contacts.second[contact][pair]
    rows = [3 * first, 3 * first + 1, 3 * first + 2, 3 * second, 3 * second + 1, 3 * second + 2]
    data = [push[:, 0], push[:, 1], along, -push[pair, 0], -push[pair, 1], along[pair]]
    columns = [np.arange(c)] * 3 + [pair] * 3
    places = np.concatenate(rows), np.concatenate(columns)
    return csc_array((np.concatenate(data), places), shape=(3 * n, c))


def _self_stresses(matrix: csc_array) -> Floats:
    """Random vectors (c,8) of the null space of E (r,c): repeated projections x ← x − Eᵀ(E Eᵀ +
    δ)⁻¹E x. Where all eight vanish, so do all of it but for a chance below 10⁻³⁰."""
    rows = csr_array(matrix)
    factor = splu(csc_array(rows @ rows.T + RIDGE * eye_array(matrix.shape[0])))
    x = np.random.default_rng(0).normal(size=(matrix.shape[1], PROBES))
    for _ in range(PASSES):
        x -= matrix.T @ factor.solve(np.asarray(rows @ x))
    return np.asarray(x)
