"""Percussions with Coulomb friction, certified, and those of a step, whose search begins from the step
before. They are solved in the native core: `nscd/core/friction_answer.cpp` has the way from one method
to the next."""

import math
import time
from typing import Any, NamedTuple

import numpy as np

from nscd.arrays import Floats
from nscd.bodies import Snapshot
from nscd.contacts import Contacts
from nscd.friction.problem import FrictionProblem, friction_problem
from nscd.laws import ContactLaw
from nscd.percussions import GAIN, FrictionPart, Percussions, Status

# What gave an answer, by its number in the core: the solver, and why it was taken.
ROUTES = (
    ("closed_form", "nothing presses: u⁻ is an answer"),
    ("sets", "Newton's method on the sets of open, stuck and sliding contacts"),
    ("proximal", "proximal steps of Newton's method, smoothed by Gauss–Seidel sweeps"),
    ("proximal_point", "proximal point method, each step a path of pivots"),
    ("sweeps", "Gauss–Seidel sweeps, some accelerated"),
    ("path", "a path from the answer of Gauss–Seidel sweeps"),
    ("none", "no method reached the tolerance"),
)


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
    said = problem.in_core(snapshot.position).solve(tolerance, starts, snapshot.radius)
    name, why = ROUTES[said["route"]]
    change, energy = said["change"], said["energy"]
    part = FrictionPart(
        coefficient=problem.friction,
        tangential=said["tangential"],
        state=said["state"],
        signorini=said["signorini"],
        cone=said["cone"],
        dissipation=said["dissipation"],
        natural_map=said["natural_map"],
        start=_start(said["seed"]),
        starts=starts,
        spread=said["spread"],
    )
    status, reason = _status_of(said, tolerance)
    return Percussions(
        reaction=said["reaction"],
        impulse=said["impulse"],
        right_velocity=np.ascontiguousarray(said["velocity"][:, :2]),
        right_spin=said["velocity"][:, 2].copy(),
        residual=part.natural_map,
        velocity_error=math.inf,
        momentum_error=said["momentum_error"],
        energy_change=change,
        energy_error=abs(change + 0.5 * said["work"]) / (energy or 1.0),
        status=status,
        reason=reason,
        choice=why,
        canonical=False,
        warnings=(f"energy grew by {change:.3g} J: {GAIN}",) if change > 1e-9 * energy else (),
        solver=name,
        iterations=said["iterations"],
        seconds=time.perf_counter() - started,
        snapshot=snapshot,
        contacts=contacts,
        friction=part,
    )


def _start(seed: int) -> str:
    """Where a search began, by its seed."""
    if seed < 0:
        return "rest"
    return f"random states {seed}" if seed else "convex programme"


def _status_of(said: dict[str, Any], tolerance: float) -> tuple[Status, str]:
    error = max(said["momentum_error"], said["natural_map"])
    if not math.isfinite(said["momentum_error"] + said["natural_map"]):
        return Status.FAILED, "the answer is not finite"
    if error <= tolerance:
        return Status.SOLVED, ""
    return (
        Status.INACCURATE,
        f"residual {error:.1e}, tolerance {tolerance:.1e}; no method came nearer",
    )


class StepAnswer(NamedTuple):
    """Hold the percussions of a step.

    reaction, friction: (k,) N·s, λ and τ
    velocity: (n,3) m/s, m/s, rad/s
    error: dimensionless, the larger of natural map and momentum error, recomputed
    pairs: of sweeps
    solver: its name"""

    reaction: Any
    friction: Any
    velocity: Any
    error: float
    pairs: int
    solver: str


def solve_step(
    problem: FrictionProblem, position: Any, guess: Any = None, tolerance: float = 1e-6
) -> StepAnswer:
    """Solve the contacts of a step from a guess (2,k) N·s of λ and τ, 0 where left out.

    An island that nothing presses keeps its velocities. The others: accelerated sweeps of
    Gauss–Seidel from the guess, all together; each island that these do not solve by proximal
    steps of Newton's method and paths from where the sweeps ended; at last the quick part of
    what `nscd.solve` does. So of several answers it gives one near the guess. The best answer met,
    with its error: the caller judges it. Needs a problem without dissipation, for which λ and τ are
    the whole percussions. position (n,2) m."""
    known = np.empty((2, 0)) if guess is None else np.asarray(guess, dtype=float)
    along, across = np.ascontiguousarray(known[0]), np.ascontiguousarray(known[1])
    found, error, pairs, route = problem.in_core(position).step(along, across, tolerance)
    name = ROUTES[route][0] if len(problem.first) else "none"
    return StepAnswer(*found, error, pairs, name)


def carried_over(key: Any, percussions: Any, wanted: Any) -> Any:
    """Give the percussions (2,k) of contacts with distinct keys (k,) to contacts with the wanted
    keys (m,), and 0 to those that are new: (2,m)."""
    guess = np.zeros((2, len(wanted)))
    if len(key):
        order = np.argsort(key)
        place = order[np.minimum(np.searchsorted(key, wanted, sorter=order), len(key) - 1)]
        known = key[place] == wanted
        guess[:, known] = percussions[:, place[known]]
    return guess
