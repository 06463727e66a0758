"""The ladder of solvers: the cheapest that serves, and why."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from nscd.arrays import Flags, Floats
from nscd.problem import ContactProblem
from nscd.solvers.active_set import active_set, free_velocity, maintained
from nscd.solvers.gauss_seidel import gauss_seidel
from nscd.solvers.interior_point import SOFT, interior_point
from nscd.solvers.islands import find_islands
from nscd.solvers.least_energy import least_energy
from nscd.solvers.projected_gradient import descend, projected_gradient
from nscd.solvers.system import Factor, System, add_reactions, approach, even, stiffness, system_of
from nscd.solvers.tree import tree

SOLVERS = ("auto", "interior_point", "active_set", "projected_gradient", "gauss_seidel")
# Sweeps of a descent before the active set is tried, and how many contacts may still change within
# 25 of them: a few and a share of all.
SWEEPS, STEADY, SHARE = 1600, 2, 1e-6
# In a small crowd factorisations are cheap: from this size on all these sweeps are made, below it
# few.
LARGE, FEW_SWEEPS = 2000, 200
# Closed contacts per unknown where a packing is marginal: nearly isostatic, with soft modes, so
# that active sets cycle.
MARGINAL = 1.0, 1.2
# To which accuracy soft contacts are solved before their active set is closed.
NEARLY = 1e-9
# A reaction above this share of the largest is one of a closed contact.
PRESSED = 1e-9
# Reactions that differ by less than this share of the largest are the same.
UNIQUE = 1e-8


class Found(NamedTuple):
    """What a method found, in elimination order: reaction (k,), velocity (n,d), iterations, its own
    error, and whether the reactions are those of least energy."""

    reaction: Floats
    velocity: Floats
    iterations: int
    error: float
    least: bool


class Outcome(NamedTuple):
    """Which solver and why; reactions (k,) N·s, velocities (n,d) m/s and iterations; canonical:
    whether the reactions are those of least energy (unique ones are)."""

    solver: str
    choice: str
    reaction: Floats
    velocity: Floats
    iterations: int
    canonical: bool


def with_free_velocity(problem: ContactProblem) -> ContactProblem:
    """The problem with û from Â û = (M − DᵀKD) u⁻, which is u⁻ without dissipation."""
    if not problem.dissipative:
        return problem
    system, factor = system_of(problem)
    free = np.empty_like(problem.left)
    free[factor.order] = free_velocity(system, factor, _given_momentum(problem)[factor.order])
    return replace(problem, free=free)


def _given_momentum(problem: ContactProblem) -> Floats:
    """(M − DᵀKD) u⁻ = Â û, (n,d) kg m/s."""
    momentum: Floats = 2 * problem.mass * problem.left - problem.inertia(problem.left)
    return momentum


def climb(
    problem: ContactProblem,
    tolerance: float,
    solver: str = "auto",
    guess: Floats | None = None,
    canonical: bool = True,
) -> Outcome:
    """Solve a problem with k ≥ 1 contacts by the named solver, or by the cheapest one that serves.

    Islands that nothing presses and single contacts are answered at once; trees by closing all
    their contacts; a crowd with a `guess` of its reactions (k,) by correcting it; even masses
    without dissipation by descent and an active set; the rest, and where that does not settle, by
    the interior point.

    Where reactions are not unique, `canonical` ones have the least elastic energy (see
    `least_energy`)."""
    if solver != "auto" or problem.maintained:
        return _whole(
            problem,
            tolerance,
            "maintained" if problem.maintained else solver,
            "asked for",
            guess,
            canonical,
        )
    islands = find_islands(problem)
    island = islands.label[problem.first]
    reaction, velocity = np.zeros(len(island)), problem.free.copy()
    single = islands.pressed & (islands.contacts == 1) & (not problem.dissipative)
    if single.any():
        at = single[island]
        reaction[at] = np.maximum(
            (problem.approach(problem.free)[at] - problem.offset[at]) / problem.inverse_mass[at],
            0.0,
        )
        velocity -= problem.momentum(reaction) / problem.mass
    many = islands.pressed & ~single
    if not many.any():
        why = (
            "nothing presses" if not single.any() else "each pressed contact is alone: closed form"
        )
        return Outcome("closed_form", why, reaction, velocity, 0, True)
    at, disks = many[island], many[islands.label]
    part = problem if at.all() and disks.all() else problem.restricted(at, disks)
    some = None if guess is None else guess[at]
    outcome = _choose(part, tolerance, bool(islands.forest[many].all()), some, canonical)
    reaction[at], velocity[disks] = outcome.reaction, outcome.velocity
    return outcome._replace(reaction=reaction, velocity=velocity)


def _choose(
    problem: ContactProblem, tolerance: float, forest: bool, guess: Floats | None, canonical: bool
) -> Outcome:
    n = len(problem.mass)
    if forest and not problem.dissipative:
        found = Outcome(
            "tree", f"the contacts of {n} disks form trees: linear time", *tree(problem), True
        )
        if _error(problem, found) <= tolerance:
            return found
    if guess is not None:
        found = _whole(problem, tolerance, "active_set", "corrects the guess", guess, canonical)
        if _error(problem, found) <= tolerance:
            return found
    return _whole(problem, tolerance, "auto", "", None, canonical)


def _error(problem: ContactProblem, outcome: Outcome) -> float:
    residual = problem.residual(outcome.reaction, outcome.velocity)
    return max(residual, problem.balance_error(outcome.reaction, outcome.velocity))


def _whole(
    problem: ContactProblem,
    tolerance: float,
    solver: str,
    why: str,
    guess: Floats | None,
    canonical: bool,
) -> Outcome:
    system, factor = system_of(problem)
    n = len(problem.mass)
    if problem.dissipative and solver in ("projected_gradient", "gauss_seidel"):
        raise ValueError(f"solver: {solver} is for contacts without dissipation")
    if solver == "maintained":
        found = Found(*maintained(system, factor), 0.0, True)
    elif solver == "projected_gradient":
        found = Found(*projected_gradient(system, 0.9 * tolerance), 0.0, False)
    elif solver == "gauss_seidel":
        found = Found(*gauss_seidel(system, 0.9 * tolerance), 0.0, False)
    elif guess is not None:
        found = _close(system, factor, guess[factor.contact] > PRESSED * guess.max(initial=0.0), 0)
    elif solver == "active_set":
        reaction, velocity, sweeps, _ = descend(system, tolerance, SWEEPS, _steady(system))
        found = _close(system, factor, _closed(system, reaction, velocity), sweeps)
    elif solver == "interior_point":
        found = _interior_point(system, factor, tolerance, None, canonical)
    elif problem.dissipative or not even(system):
        reason = "dissipative contacts" if problem.dissipative else "masses far apart"
        solver, why = "interior_point", f"{n} disks, {reason}"
        found = _interior_point(system, factor, tolerance, None, canonical)
    else:
        found, solver, why = _even(system, factor, tolerance, canonical)
    right, unordered = np.empty_like(found.velocity), np.empty_like(found.reaction)
    right[factor.order], unordered[factor.contact] = found.velocity, found.reaction
    outcome = Outcome(solver, why, unordered, right, found.iterations, found.least)
    if problem.dissipative:
        # k/m times a rounding error of u is momentum out of balance
        momentum = _given_momentum(problem)[factor.order]
        add_reactions(system, found.reaction, -1.0, momentum)
        balanced = np.empty_like(right)
        balanced[factor.order] = free_velocity(system, factor, momentum)
        outcome = min(
            outcome, outcome._replace(velocity=balanced), key=lambda o: _error(problem, o)
        )
    if canonical and not outcome.canonical:
        outcome = _canonical(problem, system, factor, outcome, found.velocity, tolerance)
    return outcome


def _canonical(
    problem: ContactProblem,
    system: System,
    factor: Factor,
    outcome: Outcome,
    velocity: Floats,
    tolerance: float,
) -> Outcome:
    """The outcome with the reactions of least energy, unless it is no answer or its accuracy would
    suffer."""
    if not _error(problem, outcome) <= tolerance:
        return outcome
    least = np.empty_like(outcome.reaction)
    least[factor.contact] = least_energy(
        system, factor, outcome.reaction[factor.contact], velocity, tolerance
    )[0]
    better = outcome._replace(reaction=least, canonical=True)
    if _error(problem, better) <= tolerance:
        return better
    # the given ones serve where they are the same but for rounding
    same = float(np.abs(least - outcome.reaction).max()) <= UNIQUE * float(least.max())
    return outcome._replace(canonical=same)


def _close(
    system: System, factor: Factor, closed: Flags, before: int, thorough: bool = False
) -> Found:
    """The active set from a guess of it; `before` iterations were made already."""
    reaction, velocity, rounds, error, settled = active_set(system, factor, closed, thorough)
    return Found(reaction, velocity, before + rounds, error, settled and even(system))


def _even(
    system: System, factor: Factor, tolerance: float, canonical: bool
) -> tuple[Found, str, str]:
    """Even masses without dissipation: descent, then its active set, or the interior point where
    that would not settle."""
    n = len(system.mass)
    steady = _steady(system)
    most = SWEEPS if n >= LARGE else FEW_SWEEPS
    reaction, velocity, sweeps, settled = descend(system, tolerance, most, steady, MARGINAL[0])
    closed = _closed(system, reaction, velocity)
    share = int(closed.sum()) / (2 * n)
    if (settled or n >= LARGE or share >= MARGINAL[1]) and not MARGINAL[0] < share < MARGINAL[1]:
        found = _close(system, factor, closed, sweeps)
        if found.error <= tolerance and found.least:
            return (
                found,
                "active_set",
                f"{n} disks of even masses: descent found the closed contacts",
            )
        sweeps = found.iterations
    rest = _interior_point(system, factor, tolerance, (reaction, velocity), canonical)
    return (
        rest._replace(iterations=sweeps + rest.iterations),
        "interior_point",
        f"{n} disks: descent does not find the closed contacts exactly",
    )


def _interior_point(
    system: System,
    factor: Factor,
    tolerance: float,
    start: tuple[Floats, Floats] | None,
    canonical: bool,
) -> Found:
    """The interior point on slightly soft contacts, whose closed ones are those of the least-energy
    reactions, and the active set; on rigid ones, which takes about half as long, where any
    reactions will do or that does not reach the tolerance."""
    found = None
    if even(system) and canonical:
        reaction, velocity, soft = interior_point(system, factor, NEARLY, SOFT, start)
        closed = _closed(system, reaction, velocity, SOFT)
        found = _close(system, factor, closed, soft, True)
        if found.error <= tolerance:
            return found
    reaction, velocity, rigid = interior_point(system, factor, 0.5 * tolerance, start=start)
    apart = np.minimum(system.inverse_mass * reaction, _gap(system, velocity))
    error = float(np.abs(apart).max()) / system.scale
    if error > tolerance:
        better = _close(system, factor, _closed(system, reaction, velocity), rigid, True)
        if better.error < error:
            return better
    return Found(reaction, velocity, rigid + (found.iterations if found else 0), error, False)


def _steady(system: System) -> int:
    return STEADY + int(SHARE * len(system.first))


def _closed(system: System, reaction: Floats, velocity: Floats, soft: float = 0.0) -> Flags:
    """Which contacts (k,) press more than they open."""
    yielded = soft * reaction / stiffness(system)
    closed: Flags = system.inverse_mass * reaction > _gap(system, velocity) + yielded
    return closed


def _gap(system: System, velocity: Floats) -> Floats:
    """b − C u (k,) m/s: how fast the contacts open."""
    v = np.empty(len(system.first))
    approach(system, velocity, v)
    gap: Floats = system.offset - v
    return gap
