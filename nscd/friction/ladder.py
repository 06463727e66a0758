"""Percussions with Coulomb friction: the ladder from what is free to what is hard."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from nscd.friction.edges import Edges, solve_edges, start_edges
from nscd.friction.factor import Factor, factor_of
from nscd.friction.measures import measure
from nscd.friction.pivots.island import ROUNDS, Search
from nscd.friction.problem import FrictionProblem, chosen, contact_velocities
from nscd.friction.sets import PENALTY, find_states, newton

# Accuracy of the convex programme and Newton's steps after it: a first look at the sets, which is
# enough where all contacts hold, and an answer that paths begin from.
LOOKS = (3e-2, 2), (1e-9, ROUNDS)
# An approach of no more than this, of the scale of velocities, presses nothing: what underflows.
NOTHING = 1e-20
# In the order of their cost: the solver of an answer is the last one that an island needed.
ROUTES = ("closed_form", "sets", "proximal", "proximal_point", "sweeps", "path", "ray", "none")


class FrictionAnswer(NamedTuple):
    """reaction λ, friction τ (k,) N·s; velocity (n,3) m/s, rad/s; solver: the last method that an
    island needed; start: where the search began; pairs of sweeps and pivots made."""

    reaction: Any
    friction: Any
    velocity: Any
    solver: str
    start: str
    pairs: int
    pivots: int


class Part(NamedTuple):
    """Some disks and contacts (indices in the whole, in elimination order), their problem and
    storage for its factors."""

    disks: Any
    contacts: Any
    problem: FrictionProblem
    factor: Factor


def climb(
    problem: FrictionProblem,
    position: Any,
    tolerance: float,
    seed: int = 0,
    *,
    patient: bool = True,
    known: Sequence[Any] = (),
) -> FrictionAnswer:
    """Solve a problem of disks at position (n,2) m.

    An island that nothing presses keeps u⁻. The others: the convex programme of the cone's edges
    and Newton's method on the sets of open, stuck and sliding contacts, all together; each island
    that this does not solve by the methods of `Search`. With a `seed` ≥ 1 every island is searched
    for an answer other than the `known` velocities (n,3), from random states and percussions, also
    where nothing presses: u⁻ need not be the only answer there. `patient` or only as far as is
    quick. The residual decides; the best answer met is given."""
    k = len(problem.first)
    disks, contacts = pressed(problem, everything=bool(seed))
    if not len(contacts):
        none = np.zeros(k), np.zeros(k), problem.left.copy()
        return FrictionAnswer(*none, "closed_form", "rest", 0, 0)
    joint = part_of(problem, position, disks, contacts)
    part = joint.problem
    edges = start_edges(part)
    if seed:
        lam, tau, u = np.zeros(len(contacts)), np.zeros(len(contacts)), part.left.copy()
        errors = np.full(int(part.island.max()) + 1, np.inf)
    else:
        lam, tau, u, errors = _together(joint, edges, tolerance)
    pairs = pivots = 0
    solver = "sets"
    for island in np.flatnonzero(errors > tolerance):
        here = np.flatnonzero(part.island == island)
        there = np.flatnonzero(part.island[part.first] == island)
        one = part_of(part, position[joint.disks], here, there)
        search = Search(one.problem, one.factor, tolerance)
        if seed:
            search.run_from(seed, [velocity[joint.disks][one.disks] for velocity in known])
        else:
            search.offer(lam[one.contacts], tau[one.contacts], u[one.disks], "none")
            at, on = one.contacts, one.disks
            near = edges.along[at].copy(), edges.across[at].copy(), edges.best[on].copy()
            search.run(*near, patient=patient)
        lam[one.contacts], tau[one.contacts] = search.reaction, search.friction
        u[one.disks] = search.velocity
        pairs, pivots = pairs + search.pairs, pivots + search.pivots
        route = search.route if search.solved else "none"
        solver = max(solver, route, key=ROUTES.index)
    reaction, friction, velocity = np.zeros(k), np.zeros(k), problem.left.copy()
    reaction[joint.contacts], friction[joint.contacts], velocity[joint.disks] = lam, tau, u
    start = f"random states {seed}" if seed else "convex programme"
    return FrictionAnswer(reaction, friction, velocity, solver, start, pairs, pivots)


def pressed(problem: FrictionProblem, *, everything: bool = False) -> tuple[Any, Any]:
    """Find disks and contacts of the islands that something presses: some C u⁻ > b, or dissipation;
    or of all islands that have contacts."""
    v, s = np.empty((2, len(problem.first)))
    contact_velocities(problem, problem.left, v, s)
    island = problem.island[problem.first]
    closing = v > problem.offset + NOTHING * problem.scale
    closing |= (problem.normal_weight > 0) | (problem.tangent_weight > 0) | everything
    pressed = np.zeros(int(problem.island.max(initial=0)) + 1, dtype=np.bool_)
    pressed[island[closing]] = True
    return np.flatnonzero(pressed[problem.island]), np.flatnonzero(pressed[island])


def part_of(problem: FrictionProblem, position: Any, disks: Any, contacts: Any) -> Part:
    """Take some disks and contacts (indices) out of a problem, with storage for their factors."""
    some = chosen(problem, disks, contacts)
    order, contact, factor = factor_of(np.array(position[disks]), some.first, some.second)
    disks, contacts = disks[order], contacts[contact]
    return Part(disks, contacts, chosen(problem, disks, contacts), factor)


def _together(part: Part, edges: Edges, tolerance: float) -> tuple[Any, Any, Any, Any]:
    """λ, τ, velocities and the errors of the islands by the convex programme and Newton's
    method."""
    problem, k = part.problem, len(part.contacts)
    v, s, v_left, s_left = np.empty((4, k))
    contact_velocities(problem, problem.left, v_left, s_left)
    best: tuple[Any, ...] = ()
    for accuracy, rounds in LOOKS:
        solve_edges(problem, part.factor, edges, accuracy)
        lam, tau, u = edges.along.copy(), edges.across.copy(), edges.best.copy()
        closed, hold = np.zeros(k, dtype=np.bool_), np.zeros(k, dtype=np.int8)
        contact_velocities(problem, u, v, s)
        find_states(problem, v_left, v, s, lam, tau, closed, hold)
        errors, _ = newton(
            problem, part.factor, closed, hold, lam, tau, u, tolerance, rounds, PENALTY
        )
        if best:
            worse = errors > best[3]
            at, on = worse[problem.island[problem.first]], worse[problem.island]
            lam[at], tau[at], u[on] = best[0][at], best[1][at], best[2][on]
        best = lam, tau, u, measure(problem, u, lam, tau, v, s)
        if best[3].max() <= tolerance:
            break
    return best
