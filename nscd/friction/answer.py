"""Percussions with Coulomb friction, certified. They are solved in the native core:
`nscd/core/friction_answer.cpp` has the way from one method to the next."""

import math
import time
from typing import Any

import numpy as np

from nscd.arrays import Floats
from nscd.bodies import Snapshot
from nscd.contacts import Contacts
from nscd.friction.problem import friction_problem
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
