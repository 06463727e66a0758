"""Percussions with Coulomb friction, certified."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nscd.arrays import Floats
from nscd.bodies import Snapshot
from nscd.contacts import Contacts
from nscd.friction.certificate import Whole, certificate, momentum_error
from nscd.friction.ladder import FrictionAnswer, climb
from nscd.friction.measures import measure
from nscd.friction.problem import FrictionProblem, friction_problem
from nscd.laws import ContactLaw
from nscd.percussions import GAIN, Percussions, Status

# What a solver's name says of why it was taken.
WHY = {
    "closed_form": "nothing presses: u⁻ is an answer",
    "sets": "Newton's method on the sets of open, stuck and sliding contacts",
    "proximal": "proximal steps of Newton's method, smoothed by Gauss–Seidel sweeps",
    "proximal_point": "proximal point method, each step a path of pivots",
    "sweeps": "Gauss–Seidel sweeps, some accelerated",
    "path": "a path from the answer of Gauss–Seidel sweeps",
    "ray": "a path from all contacts open",
    "none": "no method reached the tolerance",
}

# Choices of the contacts at which k_n acts; most crowds need one to three.
ROUNDS = 12


def solve_with_friction(
    snapshot: Snapshot,
    contacts: Contacts,
    left: Floats,
    law: ContactLaw,
    tolerance: float,
    starts: int,
) -> Percussions:
    """Percussions for the left velocity (n,2) m/s under a law with friction, from the convex
    programme and `starts` − 1 searches for others. See `nscd.solve`."""
    started = time.perf_counter()
    problem = friction_problem(snapshot, contacts, left, law)
    aim = 0.9 * tolerance
    found = _one_sided(problem, snapshot.position, aim)
    velocities = [found.velocity]
    for seed in range(1, starts):
        other = _one_sided(problem, snapshot.position, aim, seed, velocities)
        solved = _errors(problem.acting(other.velocity), other) <= tolerance  # each island
        if solved[problem.island[problem.first]].any():
            at = solved[problem.island][:, None]
            velocities.append(np.where(at, other.velocity, found.velocity))
    acting = problem.acting(found.velocity)
    answer = _certified(snapshot, contacts, acting, found, tolerance)
    part = answer.friction
    assert part is not None
    part = replace(part, starts=starts, spread=_spread(velocities, snapshot.radius))
    return replace(answer, friction=part, seconds=time.perf_counter() - started)


def _one_sided(
    problem: FrictionProblem,
    position: Floats,
    aim: float,
    seed: int = 0,
    known: Sequence[Floats] = (),
) -> FrictionAnswer:
    """The answer with the k_n that push, see `FrictionProblem.acting`: found in rounds, the best
    met."""
    linear, best, least = problem, None, np.inf
    for _ in range(ROUNDS if problem.normal_weight.any() else 1):
        found = climb(linear, position, aim, seed, known=known)
        acting = problem.acting(found.velocity)
        error = float(_errors(acting, found).max(initial=0.0))
        if best is None or error < least:
            best, least = found, error
        if error <= aim or np.array_equal(acting.normal_weight, linear.normal_weight):
            break
        linear = acting
    assert best is not None
    return best


def _errors(problem: FrictionProblem, found: FrictionAnswer) -> Floats:
    """The errors of the islands."""
    k = len(found.reaction)
    v, s = np.empty((2, k))
    errors: Floats = measure(problem, found.velocity, found.reaction, found.friction, v, s)
    return errors


def _spread(velocities: list[Floats], radius: Floats) -> float:
    """How far apart the velocities are, m/s, spins times radius included; NaN for one alone."""
    if len(velocities) < 2:
        return float("nan")
    scaled = np.array(velocities)
    scaled[:, :, 2] *= radius
    return float(np.ptp(scaled, axis=0).max(initial=0.0))


def _certified(
    snapshot: Snapshot,
    contacts: Contacts,
    problem: FrictionProblem,
    found: FrictionAnswer,
    tolerance: float,
) -> Percussions:
    """The answer with its residuals, momentum and energy recomputed from percussions and
    velocities."""
    part = certificate(problem, found.reaction, found.friction, found.velocity, found.start)
    whole = Whole(problem, found.reaction, found.friction, found.velocity)
    tangent = np.column_stack([-contacts.normal[:, 1], contacts.normal[:, 0]])
    impulse = whole.pn[:, None] * contacts.normal + whole.pt[:, None] * tangent
    left, right = problem.left, found.velocity
    energy = 0.5 * float((problem.mass * left**2).sum())
    change = 0.5 * float((problem.mass * (right - left) * (right + left)).sum())
    work = 0.5 * float(whole.pn @ (whole.v + whole.v_left) + whole.pt @ (whole.s + whole.s_left))
    off = momentum_error(problem, whole, right)
    error = max(off, part.natural_map)
    status, reason = Status.SOLVED, ""
    if not np.isfinite(error):
        status, reason = Status.FAILED, "the answer is not finite"
    elif error > tolerance:
        status = Status.INACCURATE
        reason = f"residual {error:.1e}, tolerance {tolerance:.1e}; no method came nearer"
    warnings: tuple[str, ...] = ()
    if change > 1e-9 * energy:
        warnings = (f"energy grew by {change:.3g} J: {GAIN}",)
    return Percussions(
        reaction=found.reaction,
        impulse=impulse,
        right_velocity=np.ascontiguousarray(right[:, :2]),
        right_spin=right[:, 2].copy(),
        residual=part.natural_map,
        velocity_error=np.inf,
        momentum_error=off,
        energy_change=change,
        energy_error=abs(change + work) / (energy or 1.0),
        status=status,
        reason=reason,
        choice=WHY[found.solver],
        canonical=False,
        warnings=warnings,
        solver=found.solver,
        iterations=found.pairs + found.pivots,
        seconds=0.0,
        snapshot=snapshot,
        contacts=contacts,
        friction=part,
    )
