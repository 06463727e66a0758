"""`solve`: percussions of a snapshot by the method that serves, with a certificate recomputed from
the answer."""

from __future__ import annotations

import math
import time
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from nscd.arrays import Floats, count, flag, instance, number, read_only, shown
from nscd.bodies import Snapshot
from nscd.contacts import Contacts
from nscd.laws import ContactLaw
from nscd.percussions import GAIN, Percussions, Status
from nscd.problem import ContactProblem, impact_problem
from nscd.solvers.closed_form import ALONE, NOTHING
from nscd.solvers.dissipation import solve_one_sided
from nscd.solvers.ladder import AT_ONCE, COMPILED, SOLVERS, climb
from nscd.solvers.small import Small, certified, solve_small
from nscd.solvers.system import in_given_order
from nscd.solvers.task import Answer, Task
from nscd.solvers.thresholds import AT

INELASTIC = ContactLaw()


class Search(TypedDict, total=False):
    """Say how the answer is searched for.

    canonical: whether λ is to be the one of least elastic energy where contacts are redundant,
        which is the default: least Σλ², the stiff limit of a packing of equal stiffness loaded from
        rest. Any λ is cheaper; u⁺ is the same
    starts: with friction, how many searches are made, all but the first for another answer; 1 where
        left out
    threads: how many cores work on one crowd; 1 where left out. They serve from 10,000 disks on,
        without friction; the answer is the same bit by bit for any number"""

    canonical: bool
    starts: int
    threads: int


def solve(
    snapshot: Snapshot,
    contacts: Contacts,
    *,
    left_velocity: ArrayLike | None = None,
    law: ContactLaw | None = None,
    tolerance: float = 1e-8,
    solver: str = "auto",
    guess: Percussions | None = None,
    **search: Unpack[Search],
) -> Percussions:
    """Compute the percussions of contacts for a left velocity, with their certificate.

    left_velocity: (n,2) m/s, u⁻; the snapshot's own where left out. The desired velocity of a
        blocked crowd gives its contact forces f = p/τ
    law: inelastic and frictionless where left out
    tolerance: dimensionless, of residual and momentum error, recomputed from the answer; beyond it
        the status is `inaccurate`
    solver: of `nscd.solvers.ladder.SOLVERS`; "auto" takes the cheapest that serves
    guess: the answer of a similar problem with the same contacts, which makes this one cheaper
    search: see `Search`

    M(u⁺ − u⁻) + Dᵀp = 0, p_n = k_n max(C(u⁺ + u⁻), 0) + λ, 0 ≤ λ ⟂ −C u⁺ ≥ 0 (paper eq. (1),
    corrected, see `ContactLaw`; C u⁺ = 0 where the law says `maintained`). u⁺ is unique, λ is not
    where contacts are redundant.

    With friction u⁺ is not unique either: the search begins from the convex programme of the cones
    (from u⁻ where nothing presses), so that its answer is one of several where there are several;
    `starts` > 1 searches for others too and gives how far apart the u⁺ are in
    `friction.spread`. Reactions are then not canonical, and there is no choice of solver or guess.

    Raises ValueError naming the field for what is not of the kind that is asked, a left velocity of
    the wrong shape or not finite, contacts that name disks which do not exist, a tolerance below
    1e-14, an unknown solver, a solver by name where there is friction, or fewer than one start.

    >>> from nscd import find_contacts
    >>> pair = Snapshot(
    ...     position=[[0, 0], [0.5, 0]],
    ...     velocity=[[1, 0], [0, 0]],
    ...     radius=[0.25, 0.25],
    ...     mass=[75, 75],
    ... )
    >>> answer = solve(pair, find_contacts(pair, tolerance=1e-9), law=ContactLaw(restitution=0.5))
    >>> answer.status.value, answer.impulse.round(9).tolist()  # N·s
    ('solved', [[56.25, 0.0]])
    >>> answer.right_velocity[:, 0].round(9).tolist()  # m/s
    [0.25, 0.75]
    """
    started = time.perf_counter()
    law = INELASTIC if law is None else instance(law, ContactLaw, "law")
    canonical, starts, threads = _read(search) if search else (True, 1, 1)
    _check(snapshot, contacts, law, tolerance, solver)
    n, k = len(snapshot), len(contacts)
    known = _known(guess, k)
    if law.plain and solver == "auto" and known is None and k > 0 and n < AT.large and COMPILED:
        left = _unread(snapshot, left_velocity)
        small = solve_small(snapshot, contacts, left, tolerance, canonical)
        if small is not None:
            return _of_small(snapshot, contacts, small, started)
    left = _left(snapshot, left_velocity)
    contacts.check_disks(n)
    if law.frictional:
        from nscd.friction.answer import solve_with_friction  # slow to import

        return solve_with_friction(snapshot, contacts, left, law, tolerance, starts)
    # What overflows is not finite, and is said to be failed.
    with np.errstate(all="ignore"):
        problem = impact_problem(snapshot, contacts, left, law)
        task = Task(
            problem=problem, tolerance=tolerance, canonical=canonical, guess=known, threads=threads
        )
        found = _climb(task, solver)
        problem = problem.acting(found.velocity)
        return certify(snapshot, contacts, problem, found, tolerance, started)


def _left(snapshot: Snapshot, given: ArrayLike | None) -> Floats:
    if given is None:
        return snapshot.velocity
    return read_only(given, (len(snapshot), 2), "left_velocity")


def _unread(snapshot: Snapshot, given: ArrayLike | None) -> Floats:
    """The left velocities, not copied where the kernel, which looks at each number, can take them as
    they are."""
    if type(given) is not np.ndarray or given.dtype != np.float64 or not given.flags.c_contiguous:
        return _left(snapshot, given)
    if given.shape != (len(snapshot), 2):
        return _left(snapshot, given)
    left: Floats = given.view()
    left.flags.writeable = False
    return left


def _climb(task: Task, solver: str) -> Answer:
    """The answer; no number where a kernel divides by zero."""
    try:
        return solve_one_sided(task, lambda one: climb(one, solver))
    except ZeroDivisionError:  # by what underflowed
        nothing = np.full(len(task.problem.first), np.nan)
        nowhere = np.full_like(task.problem.left, np.nan)
        return Answer(nothing, nowhere, 0, least=False, solver=solver)


def _known(guess: Percussions | None, k: int) -> Floats | None:
    if guess is None or len(instance(guess, Percussions, "guess").reaction) != k:
        return None
    return guess.reaction


def _of_small(snapshot: Snapshot, contacts: Contacts, small: Small, started: float) -> Percussions:
    if small.disks:
        rung = AT_ONCE[small.rung]
        solver, why = rung.name, rung.why.format(n=small.disks)
    else:
        solver, why = "closed_form", ALONE if small.reaction.any() else NOTHING
    return Percussions(
        reaction=small.reaction,
        impulse=small.impulse,
        right_velocity=small.velocity,
        right_spin=snapshot.spin,
        residual=small.residual,
        velocity_error=small.velocity_error,
        momentum_error=small.momentum_error,
        energy_change=small.change,
        energy_error=abs(small.change + 0.5 * small.work) / (small.energy or 1.0),
        status=Status.SOLVED,
        reason="",
        warnings=_grown(small.change, small.energy),
        choice=why,
        canonical=small.least,
        solver=solver,
        iterations=small.iterations,
        seconds=time.perf_counter() - started,
        snapshot=snapshot,
        contacts=contacts,
    )


def _read(search: Search) -> tuple[bool, int, int]:
    for name in search:
        if name not in Search.__annotations__:
            raise TypeError(f"solve() got an unexpected keyword argument {name!r}")
    starts = count(search["starts"], "starts") if "starts" in search else 1
    threads = count(search["threads"], "threads") if "threads" in search else 1
    return flag(search.get("canonical", True), "canonical"), starts, threads


def _check(
    snapshot: Snapshot, contacts: Contacts, law: ContactLaw, tolerance: float, solver: str
) -> None:
    instance(snapshot, Snapshot, "snapshot")
    instance(contacts, Contacts, "contacts")
    need = "between 1e-14 (rounding) and 1"
    if not 1e-14 <= number(tolerance, "tolerance", need) < 1:
        raise ValueError(f"tolerance: {tolerance}; {need} is needed")
    if not isinstance(solver, str) or solver not in SOLVERS:
        raise ValueError(f"solver: unknown {shown(solver)}; there are: {', '.join(SOLVERS)}")
    if law.frictional and solver != "auto":
        raise ValueError(f"solver: {solver} is for contacts without friction")


def certify(
    snapshot: Snapshot,
    contacts: Contacts,
    problem: ContactProblem,
    found: Answer,
    tolerance: float,
    started: float,
) -> Percussions:
    """Judge what a solver found, and recompute all that an answer says of itself.

    found: reactions, velocities and their proven bound
    started: s, when the clock was started

    Residual, momentum, energy, and that every number is finite."""
    plain = not problem.dissipative and not problem.maintained
    if plain and len(snapshot) >= AT.large:
        said, energy = _by_kernel(snapshot, problem, found)
    else:
        said, energy = _recomputed(snapshot, contacts, problem, found)
    judged = _judged(said, tolerance)
    return _percussions(snapshot, contacts, found, said, judged, energy, started)


def _recomputed(
    snapshot: Snapshot, contacts: Contacts, problem: ContactProblem, found: Answer
) -> tuple[dict[str, Any], float]:
    """What an answer says of itself, and the kinetic energy before (J)."""
    reaction, right = found.reaction, found.velocity
    normal, tangential = problem.impulses(reaction, right)
    total = right + problem.left
    impulse = normal[:, None] * contacts.normal
    work = float(normal @ problem.approach(total))
    if tangential is not None:
        tangent = np.column_stack([-contacts.normal[:, 1], contacts.normal[:, 0]])
        impulse += tangential[:, None] * tangent
        work += float(tangential @ problem.sliding(total))
    energy = 0.5 * float((problem.mass * problem.left**2).sum())
    energy_change = 0.5 * float((problem.mass * (right - problem.left) * total).sum())
    said: dict[str, Any] = {
        "reaction": reaction,
        "impulse": impulse,
        "right_velocity": np.ascontiguousarray(right[:, :2]),
        "right_spin": right[:, 2].copy() if right.shape[1] == 3 else snapshot.spin,
        "residual": problem.residual(reaction, right),
        "velocity_error": found.distance / float(np.sqrt(snapshot.mass.sum() or 1.0)),
        "momentum_error": problem.imbalance(right, normal, tangential),
        "energy_change": energy_change,
        "energy_error": abs(energy_change + 0.5 * work) / (energy or 1.0),
    }
    return said, energy


def _by_kernel(
    snapshot: Snapshot, problem: ContactProblem, found: Answer
) -> tuple[dict[str, Any], float]:
    """The same of contacts without dissipation."""
    of = certified(in_given_order(problem), found.reaction, found.velocity, found.distance)
    said: dict[str, Any] = {
        "reaction": found.reaction,
        "impulse": of.impulse,
        "right_velocity": found.velocity,
        "right_spin": snapshot.spin,
        "residual": of.residual,
        "velocity_error": of.velocity_error,
        "momentum_error": of.momentum_error,
        "energy_change": of.change,
        "energy_error": abs(of.change + 0.5 * of.work) / (of.energy or 1.0),
    }
    return said, of.energy


def _percussions(
    snapshot: Snapshot,
    contacts: Contacts,
    found: Answer,
    said: dict[str, Any],
    judged: tuple[Status, str],
    energy: float,
    started: float,
) -> Percussions:
    return Percussions(
        **said,
        status=judged[0],
        reason=judged[1],
        warnings=_grown(said["energy_change"], energy),
        choice=found.why,
        canonical=found.least,
        solver=found.solver,
        iterations=found.iterations,
        seconds=time.perf_counter() - started,
        snapshot=snapshot,
        contacts=contacts,
    )


def _grown(change: float, before: float) -> tuple[str, ...]:
    """A warning where the kinetic energy (J) grew by more than rounding."""
    return (f"energy grew by {change:.3g} J: {GAIN}",) if change > 1e-9 * before else ()


def _judged(said: dict[str, Any], tolerance: float) -> tuple[Status, str]:
    """The status of an answer with these numbers, and the reason where it is not solved."""
    for name, value in said.items():
        finite = math.isfinite(value) if isinstance(value, float) else np.isfinite(value).all()
        if not finite:
            return Status.FAILED, f"{name} is not finite"
    residual, momentum_error = said["residual"], said["momentum_error"]
    if max(residual, momentum_error) <= tolerance:
        return Status.SOLVED, ""
    return Status.INACCURATE, (
        f"residual {residual:.1e}, momentum error {momentum_error:.1e}, tolerance {tolerance:.1e}"
    )
