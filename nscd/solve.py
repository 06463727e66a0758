"""`solve`: percussions of a snapshot, with a certificate recomputed from the answer. They are solved
in the native core: `nscd/core/impact_solver.cpp`, and with friction `nscd/core/friction_solver.cpp`, have the
way from one method to the next."""

import time
from typing import Any, NoReturn, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from nscd import _core
from nscd._core import Method
from nscd.arrays import Floats, count, flag, instance, number, read_only, shown
from nscd.bodies import Snapshot
from nscd.contacts import Contacts, inverse_masses
from nscd.laws import ContactLaw
from nscd.percussions import GAIN, FrictionPart, Percussions, Status

INELASTIC = ContactLaw()
# Solvers that can be asked for.
SOLVERS = tuple(solver.name.lower() for solver in _core.Solver)
FIRST_ORDER = ("projected_gradient", "gauss_seidel")
# What gave an answer: the solver, and why it was taken for n disks.
CHOICES = {
    Method.NO_CONTACTS: ("none", "no contacts"),
    Method.NOTHING_PRESSES: ("closed_form", "nothing presses"),
    Method.SINGLE_CONTACTS: ("closed_form", "each pressed contact is alone: closed form"),
    Method.TREE: ("tree", "the contacts of {n} disks form trees: linear time"),
    Method.GUESS: ("active_set", "corrects the guess"),
    Method.DESCENT: ("active_set", "{n} disks of even masses: descent found the closed contacts"),
    Method.AUGMENTED_LAGRANGIAN: ("active_set", "{n} bodies of even masses: contacts made firmer step by step"),
    Method.INTERIOR_POINT_MARGINAL: ("interior_point", "{n} disks: descent does not find the closed contacts exactly"),
    Method.INTERIOR_POINT_UNEVEN_MASSES: ("interior_point", "{n} disks, masses far apart"),
    Method.INTERIOR_POINT_DISSIPATIVE: ("interior_point", "{n} disks, dissipative contacts"),
    Method.MAINTAINED: ("maintained", "every contact stays closed"),
    Method.BY_NAME: ("", "asked for"),
    Method.PROJECTED_GRADIENT: ("projected_gradient", "a loose tolerance: descent alone"),
    Method.LEFT_VELOCITY: ("closed_form", "nothing presses: u⁻ is an answer"),
    Method.NEWTON: ("sets", "Newton's method on the sets of open, stuck and sliding contacts"),
    Method.PROXIMAL_NEWTON: ("proximal", "proximal steps of Newton's method, smoothed by Gauss–Seidel sweeps"),
    Method.PROXIMAL_POINT: ("proximal_point", "proximal point method, each step a path of pivots"),
    Method.GAUSS_SEIDEL: ("sweeps", "Gauss–Seidel sweeps, some accelerated"),
    Method.PIVOTS: ("path", "a path from the answer of Gauss–Seidel sweeps"),
    Method.NONE: ("none", "no method reached the tolerance"),
}  # fmt: skip


# Fields of a solution that have to be finite.
NUMBERS = (
    "reaction", "impulse", "right_velocity", "energy_change", "energy_error", "residual",
    "velocity_error", "momentum_error",
)  # fmt: skip


class SolveOptions(TypedDict, total=False):
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
    **search: Unpack[SolveOptions],
) -> Percussions:
    """Compute the percussions of contacts for a left velocity, with their certificate.

    left_velocity: (n,2) m/s, u⁻; the snapshot's own where left out. The desired velocity of a
        blocked crowd gives its contact forces f = p/τ
    law: inelastic and frictionless where left out
    tolerance: dimensionless, of residual and momentum error, recomputed from the answer; beyond it
        the status is `inaccurate`
    solver: of `nscd.solve.SOLVERS`; "auto" takes the cheapest that serves
    guess: the answer of a similar problem with the same contacts, which makes this one cheaper
    search: see `SolveOptions`

    M(u⁺ − u⁻) + Dᵀp = 0, p_n = k_n max(C(u⁺ + u⁻), 0) + λ, 0 ≤ λ ⟂ −C u⁺ ≥ 0 (paper eq. (1),
    corrected, see `ContactLaw`; C u⁺ = 0 where the law says `maintained`). u⁺ is unique, λ is not
    where contacts are redundant.

    Where disks are joined to bodies (`Snapshot.joined`), these are what moves: M has their masses and
    inertias, the rows of C and T the levers of their contacts, and u⁻ is the motion of each body in
    the mean of its disks' velocities. Velocities are those of the disks, which turn with their body.

    With friction u⁺ is not unique either: the search begins from the convex programme of the cones
    (from u⁻ where nothing presses), so that its answer is one of several where there are several;
    `starts` > 1 searches for others too and gives how far apart the u⁺ are in
    `friction.spread`. Reactions are then not canonical, and there is no choice of solver or guess.

    Raises ValueError naming the field for what is not of the kind that is asked, a left velocity of
    the wrong shape or not finite, contacts that name disks which do not exist or that are given twice, a tolerance below
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
    [0.25, 0.75]"""
    started = time.perf_counter()
    law = INELASTIC if law is None else instance(law, ContactLaw, "law")
    canonical, starts, threads = _read_options(search) if search else (True, 1, 1)
    _check(snapshot, contacts, law, tolerance, solver)
    left = _unchecked_velocity(snapshot, left_velocity)
    arguments: dict[str, Any] = {}
    if guess is not None and len(instance(guess, Percussions, "guess").reaction) == len(contacts):
        arguments["guess"] = guess.reaction
    if (compound := snapshot.compound) is not None:
        if solver in FIRST_ORDER:
            raise ValueError(f"solver: {solver} is for disks, not for bodies of several")
        arguments |= {"bodies": compound.as_core_arguments(compound.mass), "spin": snapshot.spin}
    if not law.plain:
        arguments |= _arguments_of_law(snapshot, contacts, _left_velocity(snapshot, left), law, solver) | {"starts": starts}
    fields = _core.solve_impact(
        contacts.first, contacts.second, contacts.is_wall, contacts.normal, snapshot.position,
        snapshot.radius, snapshot.mass, left, tolerance=tolerance, canonical=canonical,
        threads=threads, solver=_core.Solver[solver.upper()], **arguments,
    )  # fmt: skip
    if fields is None:
        _refuse(snapshot, contacts, left_velocity)
    status, reason = _status_of(fields, tolerance)
    name, why = CHOICES[fields.method]
    threads_used = f", {fields.threads} threads" if fields.threads > 1 else ""
    change, spin, friction_solution = fields.energy_change, fields.right_spin, fields.friction
    grew = change > 1e-9 * fields.energy
    return Percussions(
        **{name: getattr(fields, name) for name in NUMBERS},
        right_spin=snapshot.spin if spin is None else spin,
        canonical=fields.canonical,
        iterations=fields.iterations,
        friction=_friction_part(friction_solution, arguments["friction"], starts) if friction_solution else None,
        status=status,
        reason=reason,
        warnings=(f"energy grew by {change:.3g} J: {GAIN}",) if grew else (),
        choice=why.format(n=fields.disks) + threads_used,
        solver=name or solver,
        seconds=time.perf_counter() - started,
        snapshot=snapshot,
        contacts=contacts,
    )


def _refuse(snapshot: Snapshot, contacts: Contacts, left: ArrayLike | None) -> NoReturn:
    """Raise ValueError for a disk that does not exist, a velocity that cannot be computed with, or a
    contact within a body."""
    contacts.check_disks(len(snapshot))
    _left_velocity(snapshot, left)
    pairs, bodies = contacts.select(~contacts.is_wall), snapshot.bodies
    if bodies is not None and (bodies.number[pairs.first] == bodies.number[pairs.second]).any():
        raise ValueError("contacts: two disks of one body")
    raise AssertionError("contacts and velocities that the core refuses and Python does not")


def _friction_part(solution: _core.FrictionSolution, coefficient: Floats, starts: int) -> FrictionPart:
    begun = f"random states {solution.seed}" if solution.seed else "convex programme"
    names = "tangential", "state", "signorini", "cone", "dissipation", "natural_map", "spread"
    parts = {name: getattr(solution, name) for name in names}
    start = "rest" if solution.seed < 0 else begun
    return FrictionPart(coefficient=coefficient, start=start, starts=starts, **parts)


def _arguments_of_law(
    snapshot: Snapshot, contacts: Contacts, left: Floats, law: ContactLaw, solver: str
) -> dict[str, Any]:
    """What the core is told of a law with dissipation or friction: μ (k,), k_n and k_t (k,) kg of
    contacts that do not open, and spins where something acts across."""
    contacts.check_disks(len(snapshot))
    if (compound := snapshot.compound) is not None:
        left = compound.of_disks(compound.motion(snapshot, left), snapshot.position)
    normal, tangential = law.active_dissipation(contacts, inverse_masses(snapshot, contacts), left)
    arguments: dict[str, Any] = {"maintained": law.maintained}
    if normal.any() or tangential.any():
        if solver in FIRST_ORDER:
            raise ValueError(f"solver: {solver} is for contacts without dissipation")
        arguments |= {"normal_dashpot": normal, "tangential_dashpot": tangential}
    if tangential.any() or law.frictional:
        arguments["spin"] = snapshot.spin
    if law.frictional:
        arguments["friction"] = law.frictions(contacts.is_wall)
    return arguments


def _left_velocity(snapshot: Snapshot, velocity: ArrayLike | None) -> Floats:
    if velocity is None:
        return snapshot.velocity
    return read_only(velocity, (len(snapshot), 2), "left_velocity")


def _unchecked_velocity(snapshot: Snapshot, velocity: ArrayLike | None) -> Floats:
    """The left velocities, not copied where the core, which looks at each number, can take them as they
    are."""
    if type(velocity) is not np.ndarray or velocity.dtype != np.float64 or not velocity.flags.c_contiguous:
        return _left_velocity(snapshot, velocity)
    return velocity if velocity.shape == (len(snapshot), 2) else _left_velocity(snapshot, velocity)


def _read_options(search: SolveOptions) -> tuple[bool, int, int]:
    for name in search:
        if name not in SolveOptions.__annotations__:
            raise TypeError(f"solve() got an unexpected keyword argument {name!r}")
    starts = count(search["starts"], "starts") if "starts" in search else 1
    threads = count(search["threads"], "threads") if "threads" in search else 1
    return flag(search.get("canonical", True), "canonical"), starts, threads


def _check(
    snapshot: Snapshot, contacts: Contacts, law: ContactLaw, tolerance: float, solver: str
) -> None:
    instance(snapshot, Snapshot, "snapshot")
    instance(contacts, Contacts, "contacts").check_once()
    need = "Between 1e-14 (rounding) and 1"
    if not 1e-14 <= number(tolerance, "tolerance", need) < 1:
        raise ValueError(f"tolerance: {tolerance}. {need} is needed")
    if not isinstance(solver, str) or solver not in SOLVERS:
        raise ValueError(f"solver: unknown {shown(solver)}. There are: {', '.join(SOLVERS)}")
    if law.frictional and solver != "auto":
        raise ValueError(f"solver: {solver} is for contacts without friction")


def _status_of(found: _core.ImpactSolution, tolerance: float) -> tuple[Status, str]:
    """The status of a solution, and the reason where it is not solved."""
    if not found.finite:
        for name in NUMBERS:
            if not np.isfinite(getattr(found, name)).all():
                return Status.FAILED, f"{name} is not finite"
    residual, momentum_error = found.residual, found.momentum_error
    if max(residual, momentum_error) <= tolerance:
        return Status.SOLVED, ""
    return Status.INACCURATE, (
        f"residual {residual:.1e}, momentum error {momentum_error:.1e}, tolerance {tolerance:.1e}"
    )
