"""The ladder of solvers: the cheapest that serves, and why."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from nscd.bodies import Floats
from nscd.islands import find_islands
from nscd.problem import ContactProblem
from nscd.solvers.cholesky import Factor, System, approach, system_of
from nscd.solvers.closure import active_set, free_velocity, maintained
from nscd.solvers.gauss_seidel import gauss_seidel
from nscd.solvers.interior_point import interior_point
from nscd.solvers.least_energy import least_energy
from nscd.solvers.projected_gradient import descend, projected_gradient
from nscd.solvers.tree import tree

SOLVERS = ("auto", "interior_point", "active_set", "projected_gradient", "gauss_seidel")
# Below, the interior point takes a few milliseconds and nothing needs to be tried before it; soft-packed snapshots of
# an engine, where the active set often cycles, are of this size.
LARGE = 2000
# Beyond this ratio of masses first-order methods stall.
EVEN = 100.0
# Sweeps before the active set is tried, and the share of contacts that may still change within 25 of them.
SWEEPS, STEADY = 1600, 1e-4
# A reaction above this share of the largest is one of a closed contact.
PRESSED = 1e-9
# Reactions that differ by less than this share of the largest are the same.
UNIQUE = 1e-8


class Outcome(NamedTuple):
    """Which solver and why; reactions (k,) N·s, velocities (n,d) m/s and iterations; canonical: whether the reactions are
    those of least energy (unique ones are)."""

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
    momentum = 2 * problem.mass * problem.left - problem.inertia(problem.left)
    free = np.empty_like(problem.left)
    free[factor.order] = free_velocity(system, factor, momentum[factor.order])
    return replace(problem, free=free)


def climb(
    problem: ContactProblem,
    tolerance: float,
    solver: str = "auto",
    guess: Floats | None = None,
    canonical: bool = True,
) -> Outcome:
    """Solve a problem with k ≥ 1 contacts by the named solver, or by the cheapest one that serves.

    Islands that nothing presses and single contacts are answered at once; trees by closing all their contacts; a crowd
    with a `guess` of its reactions (k,) by correcting it; the rest by descent and an active set (large and
    of even masses) or by the interior point.

    Where reactions are not unique, `canonical` ones have the least elastic energy (see `least_energy`).
    """
    if solver != "auto" or problem.maintained:
        return _whole(
            problem, tolerance, "maintained" if problem.maintained else solver, "asked for", guess, canonical
        )
    islands = find_islands(problem)
    island = islands.label[problem.first]
    reaction, velocity = np.zeros(len(island)), problem.free.copy()
    single = islands.pressed & (islands.contacts == 1) & (not problem.dissipative)
    if single.any():
        at = single[island]
        reaction[at] = np.maximum(
            (problem.approach(problem.free)[at] - problem.offset[at]) / problem.inverse_mass[at], 0.0
        )
        velocity -= problem.momentum(reaction) / problem.mass
    many = islands.pressed & ~single
    if not many.any():
        why = "nothing presses" if not single.any() else "each pressed contact is alone: closed form"
        return Outcome("closed_form", why, reaction, velocity, 0, True)
    at, disks = many[island], many[islands.label]
    part = problem.restricted(at, disks)
    some = None if guess is None else guess[at]
    outcome = _choose(part, tolerance, bool(islands.forest[many].all()), some, canonical)
    reaction[at], velocity[disks] = outcome.reaction, outcome.velocity
    return outcome._replace(reaction=reaction, velocity=velocity)


def _choose(
    problem: ContactProblem, tolerance: float, forest: bool, guess: Floats | None, canonical: bool
) -> Outcome:
    n = len(problem.mass)
    if forest and not problem.dissipative:
        found = Outcome("tree", f"the contacts of {n} disks form trees: linear time", *tree(problem), True)
        if _error(problem, found) <= tolerance:
            return found
    if guess is not None:
        found = _whole(problem, tolerance, "active_set", "corrects the guess", guess, canonical)
        if _error(problem, found) <= tolerance:
            return found
    heaviest, lightest = problem.mass[:, 0].max(), problem.mass[:, 0].min()
    if n >= LARGE and not problem.dissipative and heaviest <= EVEN * lightest:
        found = _whole(
            problem,
            tolerance,
            "active_set",
            f"{n} disks of even masses: descent finds the closed contacts",
            None,
            canonical,
        )
        if _error(problem, found) <= tolerance:
            return found
    return _whole(
        problem, tolerance, "interior_point", f"{n} disks, any masses, redundant or not", None, canonical
    )


def _error(problem: ContactProblem, outcome: Outcome) -> float:
    residual = problem.residual(outcome.reaction, outcome.velocity)
    return max(residual, problem.balance_error(outcome.reaction, outcome.velocity))


def _whole(
    problem: ContactProblem, tolerance: float, solver: str, why: str, guess: Floats | None, canonical: bool
) -> Outcome:
    system, factor = system_of(problem)
    if solver in ("projected_gradient", "gauss_seidel") and problem.dissipative:
        raise ValueError(f"solver: {solver} is for contacts without dissipation")
    if solver == "maintained":
        reaction, velocity, iterations = maintained(system, factor)
    elif solver == "active_set":
        reaction, velocity, iterations = _active_set(
            system, factor, tolerance, None if guess is None else guess[factor.contact]
        )
    elif solver == "projected_gradient":
        reaction, velocity, iterations = projected_gradient(system, 0.9 * tolerance)
    elif solver == "gauss_seidel":
        reaction, velocity, iterations = gauss_seidel(system, 0.9 * tolerance)
    else:
        reaction, velocity, iterations = _interior_point(system, factor, tolerance)
    right = np.empty_like(velocity)
    right[factor.order] = velocity
    unordered = np.empty_like(reaction)
    unordered[factor.contact] = reaction
    outcome = Outcome(solver, why, unordered, right, iterations, solver == "maintained")
    if canonical and not outcome.canonical:
        outcome = _canonical(problem, system, factor, outcome, velocity, tolerance)
    return outcome


def _canonical(
    problem: ContactProblem,
    system: System,
    factor: Factor,
    outcome: Outcome,
    velocity: Floats,
    tolerance: float,
) -> Outcome:
    """The outcome with the reactions of least energy, unless it is no answer or its accuracy would suffer."""
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


def _active_set(
    system: System, factor: Factor, tolerance: float, guess: Floats | None
) -> tuple[Floats, Floats, int]:
    """From a guess of the reactions, or from a descent until the closed contacts settle."""
    if guess is None:
        reaction, velocity, sweeps, _ = descend(system, tolerance, SWEEPS, STEADY)
        closed = None
    else:
        reaction, velocity, sweeps = np.maximum(guess, 0.0), system.free, 0
        closed = reaction > PRESSED * reaction.max(initial=0.0)
    reaction, velocity, rounds, _ = active_set(system, factor, reaction, velocity, tolerance, closed=closed)
    return reaction, velocity, sweeps + rounds


def _interior_point(system: System, factor: Factor, tolerance: float) -> tuple[Floats, Floats, int]:
    """The interior point, finished on its active set where degenerate contacts keep it from rounding."""
    reaction, velocity, iterations = interior_point(system, factor, 0.5 * tolerance)
    v = np.empty(len(reaction))
    approach(system, velocity, v)
    error = float(np.abs(np.minimum(system.inverse_mass * reaction, system.offset - v)).max()) / system.scale
    if error > tolerance:
        better, right, rounds, polished = active_set(system, factor, reaction, velocity, tolerance)
        if polished < error:
            return better, right, iterations + rounds
    return reaction, velocity, iterations
