"""All percussions that the mechanics allows for one answer: a polytope, and which contacts carry
something in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csc_array, hstack

from nscd.arrays import Flags, Floats, Indices
from nscd.contacts import Contacts
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Admissible:
    """Hold the set {λ' ≥ 0, Cᵀλ' = Cᵀλ, λ' = 0 where the contact opens} of an answer λ, u⁺, λ being
    in it.

    contacts: k of them
    disks: how many there are
    reaction: (k,) N·s, λ with 0 at contacts that open
    closed: (k,) whether −v⁺ ≤ tolerance
    core: (c,) indices of the closed contacts that balance alone leaves open, all others being known
    factor, core_factor: of C on the closed contacts and on the core
    balance: (2n,c), Cᵀ on the core
    scale: N·s, the largest reaction

    The right velocity u⁺ is the same for all of them, whatever the (dissipative) law: only λ is
    open."""

    contacts: Contacts
    disks: int
    reaction: Floats
    closed: Flags
    core: Indices
    factor: OrthogonalFactor
    core_factor: OrthogonalFactor
    balance: csc_array
    scale: float

    @classmethod
    def of(cls, contacts: Contacts, answer: Percussions, opening: float = OPENING) -> Admissible:
        """Make the set of the given answer.

        opening: dimensionless; a contact opens if −v⁺ exceeds this share (or ten times the
            answer's residual, if that is more) of the larger of max |u⁺| and 2 |ΔE| / Σλ, the
            mean approach before the impact

        Raises ValueError if contacts and answer do not belong together, the answer has failed or
        has friction, or reactions pull (those of maintained contacts have no such set)."""
        if answer.friction is not None:
            raise ValueError(
                "answer: it has friction; its intervals are those of nscd.indeterminacy.cones"
            )
        reaction = answer.reaction
        n = len(answer.right_velocity)
        if reaction.shape != (len(contacts),):
            raise ValueError(
                f"answer: {len(reaction)} reactions where there are {len(contacts)} contacts"
            )
        contacts.check_disks(n)
        if answer.status == "failed":
            raise ValueError(
                f"answer: failed ({answer.reason}); there is nothing to take intervals of"
            )
        largest = float(reaction.max(initial=0.0))
        if reaction.min(initial=0.0) < -NOTHING * largest:
            worst = int(np.argmin(reaction))
            raise ValueError(
                f"answer: the reaction of contact {worst} pulls ({reaction[worst]:g} N·s); "
                "intervals are those of percussions that push"
            )
        speed = float(np.abs(answer.right_velocity).max(initial=0.0))
        if largest > 0:
            speed = max(speed, 2 * abs(answer.energy_change) / float(reaction.sum()))
        threshold = max(opening, 10 * answer.residual) * speed
        closed = contacts.approach_velocity(answer.right_velocity) >= -threshold
        known = np.where(closed, np.maximum(reaction, 0.0), 0.0)
        places = np.flatnonzero(closed)
        factor = factorise(contacts.select(places), n)
        core = places[undetermined_rows(factor)]
        chosen = contacts.select(core)
        return cls(
            contacts=contacts,
            disks=n,
            reaction=known,
            closed=closed,
            core=core,
            factor=factor,
            core_factor=factorise(chosen, n),
            balance=csc_array(chosen.normal_matrix(n).T),
            scale=largest or 1.0,
        )

    def carrying(self) -> Flags:
        """Find the contacts (k,) whose reaction is more than 0 in some admissible percussion.

        Rounds of max Σ min(λ'_c, δ) over the contacts c that carry nothing so far; the optimum 0 is
        the proof that the rest never carry. The mean of the optima is positive at all others.
        Raises ProgramError if a linear program has no usable answer."""
        carrying = self.closed & (self.reaction > NOTHING * self.scale)
        impulse = self.balance @ self.reaction[self.core] / self.scale
        c = len(self.core)
        while True:
            idle = np.flatnonzero(~carrying[self.core])
            if not len(idle):
                return carrying
            share = (
                float(np.median(self.reaction[carrying])) / self.scale if carrying.any() else 1.0
            )
            upper = np.concatenate([np.full(c, np.inf), np.full(len(idle), share)])
            columns = csc_array(hstack([self.balance, self.balance[:, idle]]))
            weights = np.concatenate([np.zeros(c), np.ones(len(idle))])
            found = maximise(weights, columns, impulse, upper)
            gained = found.point[c:] + found.point[idle] > NOTHING
            if not gained.any():
                return carrying
            carrying[self.core[idle[gained]]] = True


def maximise(
    weights: Floats, matrix: csc_array, right: Floats, upper: Floats | float = np.inf
) -> Optimum:
    """Maximise weights·x subject to matrix x = right and 0 ≤ x ≤ upper.

    Raises ProgramError naming the reason where that has no end or no solution."""
    bounds = np.column_stack([np.zeros(len(weights)), np.broadcast_to(upper, len(weights))])
    options = {
        "primal_feasibility_tolerance": FEASIBILITY,
        "dual_feasibility_tolerance": FEASIBILITY,
    }
    # the interior point with crossover is several times faster on large packings, the simplex more
    # robust
    for method in ("highs-ipm", "highs-ds"):
        found = linprog(
            -weights, A_eq=matrix, b_eq=right, bounds=bounds, method=method, options=options
        )
        if found.status == 0:
            break
    else:
        raise ProgramError(f"linear program of {matrix.shape[1]} reactions: {found.message}")
    return Optimum(np.asarray(found.x), -np.asarray(found.eqlin.marginals))
