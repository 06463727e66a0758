"""`solve`: percussions of a snapshot by the method that serves, with a certificate recomputed from the answer."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from nscd.bodies import Floats, Snapshot, read_only
from nscd.contacts import Contacts
from nscd.laws import ContactLaw
from nscd.percussions import Percussions, Status
from nscd.problem import ContactProblem, impact_problem
from nscd.solvers.cholesky import system_of
from nscd.solvers.closure import free_velocity, maintained, polish
from nscd.solvers.interior_point import interior_point

SOLVERS = ("auto", "interior_point")


def solve(
    snapshot: Snapshot,
    contacts: Contacts,
    *,
    left_velocity: ArrayLike | None = None,
    law: ContactLaw | None = None,
    tolerance: float = 1e-8,
    solver: str = "auto",
    guess: Percussions | None = None,
) -> Percussions:
    """Percussions of the contacts for the left velocity u⁻ (n,2) m/s, the snapshot's own by default.

    M(u⁺ − u⁻) + Dᵀp = 0, p = k D(u⁺ + u⁻) + λ n, 0 ≤ λ ⟂ −C u⁺ ≥ 0 (paper eq. (1), corrected; C u⁺ = 0 where the
    law says `maintained`). The residual is recomputed from the answer; beyond `tolerance` the status is `inaccurate`.
    For contact forces of a blocked crowd give the desired velocity as u⁻: f = p/τ.

    Raises ValueError for a left velocity of the wrong shape or not finite, contacts that name disks which do not
    exist, a tolerance below 1e-14 or an unknown solver.
    """
    started = time.perf_counter()
    law = ContactLaw() if law is None else law
    if not 1e-14 <= tolerance < 1:
        raise ValueError(f"tolerance: {tolerance}; between 1e-14 (rounding) and 1 is needed")
    if solver not in SOLVERS:
        raise ValueError(f"solver: unknown {solver!r}; there are: {', '.join(SOLVERS)}")
    contacts.check_disks(len(snapshot))
    left = (
        snapshot.velocity
        if left_velocity is None
        else read_only(left_velocity, (len(snapshot), 2), "left_velocity")
    )
    problem = impact_problem(snapshot, contacts, left, law)
    if not len(contacts):
        name, reaction, right, iterations = "no contacts", np.empty(0), problem.free, 0
    else:
        problem, name, reaction, right, iterations = solve_problem(problem, tolerance)
    return certify(snapshot, contacts, problem, reaction, right, tolerance, name, iterations, started)


def solve_problem(
    problem: ContactProblem, tolerance: float
) -> tuple[ContactProblem, str, Floats, Floats, int]:
    """The problem with its free velocity û, the solver's name, reactions (k,) N·s, velocities (n,d) m/s, iterations."""
    system, factor = system_of(problem)
    order = factor.order
    if problem.dissipative:
        kinetic = problem.mass * problem.left
        momentum = 2 * kinetic - problem.inertia(problem.left)  # (M − DᵀKD) u⁻
        free = np.empty_like(problem.left)
        free[order] = free_velocity(system, factor, momentum[order])
        problem = replace(problem, free=free)
        system = system._replace(free=free[order])
    if problem.maintained:
        name, (reaction, velocity, iterations) = (
            "maintained",
            maintained(system, factor, tolerance),
        )
    else:
        name = "interior_point"
        reaction, velocity, iterations = interior_point(system, factor, 0.5 * tolerance)
        right = np.empty_like(velocity)
        right[order] = velocity
        if problem.residual(reaction, right) > tolerance:
            reaction, velocity, rounds = polish(system, factor, reaction, velocity, tolerance)
            iterations += rounds
    right = np.empty_like(velocity)
    right[order] = velocity
    return problem, name, reaction, right, iterations


def certify(
    snapshot: Snapshot,
    contacts: Contacts,
    problem: ContactProblem,
    reaction: Floats,
    right: Floats,
    tolerance: float,
    solver: str,
    iterations: int,
    started: float,
) -> Percussions:
    """The answer with its residual, momentum and energy recomputed from reactions (k,) N·s and velocities (n,d)."""
    total = right + problem.left
    along, across = problem.approach(total), problem.sliding(total)
    normal = problem.normal_weight * along + reaction
    tangential = problem.tangent_weight * across
    tangent = np.column_stack([-contacts.normal[:, 1], contacts.normal[:, 0]])
    impulse = normal[:, None] * contacts.normal + tangential[:, None] * tangent
    energy = 0.5 * float((problem.mass * problem.left**2).sum())
    energy_change = 0.5 * float((problem.mass * (right - problem.left) * total).sum())
    work = 0.5 * float(normal @ along + tangential @ across)
    residual, momentum_error = problem.residual(reaction, right), problem.balance_error(reaction, right)
    status, reason = Status.SOLVED, ""
    if not np.isfinite(residual + momentum_error):
        status, reason = Status.FAILED, "the answer is not finite"
    elif max(residual, momentum_error) > tolerance:
        status = Status.INACCURATE
        reason = f"residual {residual:.1e}, momentum error {momentum_error:.1e}, tolerance {tolerance:.1e}"
    warnings: tuple[str, ...] = ()
    if energy_change > 1e-9 * energy:
        warnings = (
            f"energy grew by {energy_change:.3g} J: dissipation k > 0 acts on contacts that were already opening",
        )
    assert snapshot.spin is not None
    return Percussions(
        reaction=reaction,
        impulse=impulse,
        right_velocity=np.ascontiguousarray(right[:, :2]),
        right_spin=right[:, 2].copy() if right.shape[1] == 3 else snapshot.spin,
        residual=residual,
        momentum_error=momentum_error,
        energy_change=energy_change,
        energy_error=abs(energy_change + work) / (energy or 1.0),
        status=status,
        reason=reason,
        warnings=warnings,
        solver=solver,
        iterations=iterations,
        seconds=time.perf_counter() - started,
    )
