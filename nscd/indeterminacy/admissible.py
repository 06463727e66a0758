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

        opening: dimensionless; a contact opens if −v⁺ exceeds the `opening_speed`

        Raises ValueError if contacts and answer do not belong together, the answer has failed or
        has friction, or reactions pull (those of maintained contacts have no such set)."""
        if answer.friction is not None:
            other = "its intervals are those of nscd.indeterminacy.cones"
            raise ValueError(f"answer: it has friction; {other}")
        reaction = answer.reaction
        n = len(answer.right_velocity)
        if reaction.shape != (len(contacts),):
            there = f"{len(reaction)} reactions where there are {len(contacts)} contacts"
            raise ValueError(f"answer: {there}")
        contacts.check_disks(n)
        if answer.status == "failed":
            raise ValueError(f"answer: failed ({answer.reason}); it has no intervals")
        largest = float(reaction.max(initial=0.0))
        if reaction.min(initial=0.0) < -NOTHING * largest:
            worst = int(np.argmin(reaction))
            pulls = f"the reaction of contact {worst} pulls ({reaction[worst]:g} N·s)"
            raise ValueError(f"answer: {pulls}; intervals are those of percussions that push")
        slow = opening_speed(answer, opening)
        closed = contacts.approach_velocity(answer.right_velocity) >= -slow
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
        """Find the contacts (k,) whose reaction is more than 0 in some admissible percussion. Raises
        ProgramError if a linear program has no usable answer."""
        return carrying(self.reaction / self.scale, self.core, self.balance)


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
