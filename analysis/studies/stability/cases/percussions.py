"""What solvers of percussions fail at."""

import itertools
from collections.abc import Iterable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq

from analysis.percussions.dense_reference import dense_percussions
from analysis.studies.stability import crowds
from analysis.studies.stability.case import Cell, Of, Outcome, case
from analysis.studies.stability.trial import (
    SOLVER_QUANTITIES,
    SOLVERS,
    TOLERANCE,
    cell,
    solver_cell,
)
from nscd import ContactLaw, Contacts, Percussions, Snapshot, Status, solve
from nscd._core import MAX_SWEEPS
from nscd.arrays import Floats, Mask
from nscd.indeterminacy.determinacy import admissible_determinacy

ACROSS = 5


@case(
    columns=("heavy mass / light mass", 1.0, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6),
    few_columns=(1.0, 1e3, 1e6),
    rows=("solver", *SOLVERS),
    quantities=SOLVER_QUANTITIES,
    fails_as=(Outcome.NOT_CONVERGED,),
    values={"across": ACROSS},
)
def mass_ratio_solvers(ratio: float, solver: str, folder: Path) -> Cell:
    """Solve a rhombus of alternating masses in a corner, against dense NNLS."""
    n = ACROSS**2
    light = (np.arange(n) + np.arange(n) // ACROSS) % 2 == 0
    left = np.random.default_rng(1).normal(size=(n, 2))
    mass = crowds.MASS_KG * np.where(light, 1 / ratio, 1.0)
    snapshot = crowds.disks(crowds.rhombus(ACROSS), left, mass)
    contacts = crowds.contacts_of(snapshot, crowds.corner_walls(ACROSS))
    _, reference = dense_percussions(snapshot, contacts, left)
    solution = solve(snapshot, contacts, solver=solver)
    return solver_cell(solution, reference, float(np.abs(left).max()))


# The tolerances between which the contraction is measured.
LOOSE, TIGHT = 1e-5, 1e-7
SWEEPER = "gauss_seidel"
CONTRACTION = ("contraction ρ a sweep", "cos²(π/(2n))", "(1−ρ) measured / theory", "cos²(π/(2n+1))")


def chain(n: int) -> tuple[Snapshot, Contacts]:
    """Make n touching disks that move at 1 m/s along x into a wall, and their n contacts."""
    position = crowds.line(n)
    walls = crowds.end_walls(-4 * crowds.RADIUS_M, position[-1, 0] + crowds.RADIUS_M)[1:]
    snapshot = crowds.disks(position, (1.0, 0.0))
    return snapshot, crowds.contacts_of(snapshot, walls)


def contraction(n: int) -> float:
    """Measure ρ of projected Gauss–Seidel on the chain: (TIGHT/LOOSE)^(1/sweeps between), from two
    solutions; NaN where one ended at the limit of sweeps."""
    snapshot, contacts = chain(n)
    found = [
        solve(snapshot, contacts, solver=SWEEPER, tolerance=tolerance, canonical=False)
        for tolerance in (LOOSE, TIGHT)
    ]
    if any(solution.status != "solved" for solution in found):
        return float("nan")
    return float((TIGHT / LOOSE) ** (1 / (found[1].iterations - found[0].iterations)))


def rate(parts: float) -> float:
    """Compute cos²(π/parts).

    With parts = 2n: the contraction of Gauss–Seidel on W of a chain of n equal disks against a
    wall, whose last contact has half the diagonal of the others, so that the Jacobi matrix has the
    eigenvalues cos((2j−1)π/(2n)). With parts = 2n+1: that of a chain whose contacts all have the
    same diagonal."""
    return float(np.cos(np.pi / parts) ** 2)


def sweeps_theory(solver: str) -> float:
    """Compute the length n at which the residual after the limit of sweeps, (2/n) cos²(π/(2n)) to
    their power, is the tolerance.

    The true reactions j·m·u of the contacts have the share 1/(n(1 − cos(π/(2n)))) of the slowest
    mode sin(jπ/(2n)), which the wall stops with 2(1 − cos(π/(2n))) times itself: 2/n of u for the
    longest mode at the first sweep."""
    if solver != SWEEPER:
        return float("nan")

    def above(n: float) -> float:
        return float(np.log(2 / n) + MAX_SWEEPS * np.log(rate(2 * n)) - np.log(TOLERANCE))

    return float(brentq(above, 10.0, 1e6))


@case(
    columns=("disks in the chain", 3.0, 10.0, 30.0, 60.0, 100.0, 150.0, 250.0, 400.0),
    few_columns=(10.0, 50.0, 120.0, 250.0),
    rows=("solver", *SOLVERS),
    quantities=(*SOLVER_QUANTITIES, *CONTRACTION),
    fails_as=(Outcome.NOT_CONVERGED,),
    theory=sweeps_theory,
    complete=True,
)
def long_chains(n: float, solver: str, folder: Path) -> Cell:
    """Stop a chain of n disks by a wall; the closed form is u⁺ = 0."""
    count = round(n)
    snapshot, contacts = chain(count)
    solution = solve(snapshot, contacts, solver=solver, tolerance=TOLERANCE)
    swept = solver == SWEEPER and solution.status is Status.SOLVED
    measured, expected = contraction(count) if swept else float("nan"), rate(2 * count)
    rates = (measured, expected, (1 - measured) / (1 - expected), rate(2 * count + 1))
    return solver_cell(solution, np.zeros((count, 2)), 1.0, more=rates)


# Differences of u⁺ over |u⁻| and of λ over the largest λ that solver tolerances of 1e-8 explain.
SAME_VELOCITY, SAME_REACTION = 1e-5, 1e-4
CHOICE_QUANTITIES = (
    "difference of u⁺ / |u⁻|",
    "difference of λ / largest λ",
    "dimension of the set of λ",
    "iterations",
)
# Rows: a solver, and whether it gives the reactions of least Σλ² or any that fit.
CHOICES = (
    *(Of(name, (name, True)) for name in ("auto", "interior_point", "active_set", "gauss_seidel")),
    *(Of(f"{name}, any λ", (name, False)) for name in ("projected_gradient", "gauss_seidel")),
)


def pressed_corner(across: int) -> tuple[Snapshot, Contacts]:
    """Make across² disks on the triangular lattice that run into the corner of two walls."""
    snapshot = crowds.disks(crowds.rhombus(across), (-1.0, -0.8))
    return snapshot, crowds.contacts_of(snapshot, crowds.corner_walls(across))


def chosen(row: Of, snapshot: Snapshot, contacts: Contacts) -> Percussions:
    """Solve with the row's choice."""
    solver, canonical = row.values
    return solve(snapshot, contacts, solver=solver, canonical=canonical)


@case(
    columns=("disks along a side", 2.0, 3.0, 4.0, 5.0, 6.0, 8.0),
    few_columns=(2.0, 4.0, 7.0),
    rows=("solver", *CHOICES),
    quantities=CHOICE_QUANTITIES,
    fails_as=(Outcome.INACCURATE,),
)
def redundant(across: float, row: Of, folder: Path) -> Cell:
    """Compare λ and u⁺ with dense least squares with the least Σλ²."""
    snapshot, contacts = pressed_corner(round(across))
    solution = chosen(row, snapshot, contacts)
    reaction, velocity = dense_percussions(snapshot, contacts, snapshot.velocity, minimum=True)
    off = float(np.abs(solution.reaction - reaction).max() / reaction.max())
    wrong = float(np.abs(solution.right_velocity - velocity).max() / np.abs(snapshot.velocity).max())
    freedom = float("nan")
    if solution.status is Status.SOLVED:
        freedom = float(admissible_determinacy(contacts, solution).redundant)
    return compared(solution, solution, (wrong, off, freedom), "the least Σλ²")


def compared(
    solution: Percussions, worst: Percussions, found: tuple[float, float, float], other: str
) -> Cell:
    """Make a cell of an answer whose u⁺ and λ differ by the first two numbers from another's; worst:
    the one whose status counts."""
    wrong, off, _ = found
    differs = f"λ differs by {off:.2g} of the largest from {other}, u⁺ is the same"
    return cell(
        str(worst.status),
        (*found, float(solution.iterations)),
        f"λ as with {other} to {off:.2g}",
        (worst.status is not Status.SOLVED, Outcome.NOT_CONVERGED, worst.reason),
        (wrong > SAME_VELOCITY, Outcome.INACCURATE, f"u⁺ differs by {wrong:.2g} from {other}"),
        (off > SAME_REACTION, Outcome.INACCURATE, differs),
    )


ORDERS = 4


@case(
    columns=("disks along a side", 2.0, 3.0, 4.0, 6.0, 8.0, 10.0),
    few_columns=(2.0, 4.0, 7.0),
    rows=("solver", *CHOICES),
    quantities=CHOICE_QUANTITIES,
    fails_as=(Outcome.INACCURATE,),
    values={"orders": ORDERS},
)
def contact_order(across: float, row: Of, folder: Path) -> Cell:
    """Compare λ and u⁺ of the same contacts in ORDERS random orders with those of the order in
    which they are found."""
    snapshot, contacts = pressed_corner(round(across))
    solution = worst = chosen(row, snapshot, contacts)
    off = wrong = 0.0
    for seed in range(ORDERS):
        order = np.random.default_rng(seed).permutation(len(contacts))
        other = chosen(row, snapshot, contacts.select(order))
        off = max(off, float(np.abs(other.reaction - solution.reaction[order]).max()))
        wrong = max(wrong, float(np.abs(other.right_velocity - solution.right_velocity).max()))
        worst = worst if other.status is Status.SOLVED else other
    off /= float(solution.reaction.max())
    wrong /= float(np.abs(snapshot.velocity).max())
    return compared(solution, worst, (wrong, off, float("nan")), "another order")


DISKS = 6


@case(
    columns=("1 − e", *(float(f"1e-{p}") for p in (1, 2, 4, 6, *range(8, 16)))),
    few_columns=(1e-2, 1e-8, 1e-15),
    rows=("solver", "auto", "interior_point", "active_set"),
    quantities=SOLVER_QUANTITIES,
    fails_as=(Outcome.INACCURATE, Outcome.NOT_CONVERGED),
    values={"disks": DISKS},
)
def restitution(below: float, solver: str, folder: Path) -> Cell:
    """Let the first of DISKS in a line run into the others with e = 1 − below, against the answer
    in exact arithmetic for the same k."""
    speed = [1, *[0] * (DISKS - 1)]
    snapshot = crowds.disks(crowds.line(DISKS), along_x(speed))
    contacts = crowds.contacts_of(snapshot)
    law = ContactLaw(restitution=1 - below)
    k = law.coefficients(contacts.inverse_mass(snapshot.mass))[0]
    start = [Fraction(u) for u in speed]
    exact, _ = exact_line([int(crowds.MASS_KG)] * DISKS, start, [Fraction(float(c)) for c in k])
    solution = solve(snapshot, contacts, law=law, solver=solver)
    return solver_cell(solution, along_x(map(float, exact)), 1.0)


def along_x(speed: Iterable[float]) -> Floats:
    """Make velocities (n,2) m/s of speeds along x."""
    return np.array([(u, 0.0) for u in speed])


# Of the energy: a gain above this is none of rounding.
ROUNDING = 1e-9


def opening_theory(dissipation: float) -> float:
    """Compute the opening speed at which the exact change of energy changes its sign (m/s); NaN
    where it does not below 2."""

    def change(speed: float) -> float:
        return exact_energy(float(speed), dissipation)[1]

    speeds = np.geomspace(0.004, 2.0, 100)
    gains = np.array([change(speed) for speed in speeds]) > 0
    if not (at := np.flatnonzero(gains[1:] != gains[:-1])).size:
        return float("nan")
    return float(brentq(change, speeds[at[0]], speeds[at[0] + 1], xtol=1e-12))


OPENING = (0.005, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.5)


@case(
    columns=("speed with which the second contact opens (m/s)", *OPENING),
    few_columns=(0.02, 0.3, 0.7, 1.5),
    rows=("k / m", 0.1, 1.0, 3.0, 6.0, 8.0, 12.0, 20.0, 50.0, 200.0),
    few_rows=(1.0, 10.0, 50.0),
    quantities=(*SOLVER_QUANTITIES, "change of energy / energy", "warnings"),
    fails_as=(Outcome.ENERGY_GAIN,),
    theory=opening_theory,
)
def opening_contacts(opening: float, dissipation: float, folder: Path) -> Cell:
    """Solve three touching disks: the first runs at 1 m/s into the second, at rest, and the third
    leaves it at `opening` m/s; k = dissipation · m of both contacts."""
    snapshot = crowds.disks(crowds.line(3), along_x((1.0, 0.0, opening)))
    law = ContactLaw(dissipation=dissipation * crowds.MASS_KG, tangential_dissipation=0.0)
    solution = solve(snapshot, crowds.contacts_of(snapshot), law=law)
    exact, change = exact_energy(opening, dissipation)
    before = 0.5 * crowds.MASS_KG * (1 + opening**2)
    gain = solution.energy_change / before
    reason = f"energy {gain:+.3g} of the start, exact {change / before:+.3g}"
    return solver_cell(
        solution,
        along_x(exact),
        max(1.0, opening),
        (gain > ROUNDING, Outcome.ENERGY_GAIN, reason),
        more=(gain, float(len(solution.warnings))),
    )


def exact_energy(opening: float, dissipation: float) -> tuple[list[float], float]:
    """Compute u⁺ (3) m/s and the change of energy (J) of an attempt in exact arithmetic."""
    mass = int(crowds.MASS_KG)
    speed = [Fraction(1), Fraction(0), Fraction(opening)]
    after, change = exact_line([mass] * 3, speed, [Fraction(dissipation) * mass] * 2)
    return [float(u) for u in after], float(change)


def exact_line(
    mass: Sequence[int], velocity: Sequence[Fraction], dissipation: Sequence[Fraction]
) -> tuple[list[Fraction], Fraction]:
    """Compute u⁺ (n) and the change of the kinetic energy ½Σm(u⁺² − u⁻²) of n touching disks in a
    line, in exact arithmetic.

    M(u⁺ − u⁻) + Cᵀp = 0, p = k max(C(u⁺ + u⁻), 0) + λ, 0 ≤ λ ⟂ −C u⁺ ≥ 0 (see `ContactLaw`) with
    one k (kg) per contact. Every choice of closed contacts, and of those where k acts, is tried
    until one gives λ ≥ 0, C u⁺ ≤ 0 and the signs of C(u⁺ + u⁻): for short lines only. Raises
    ValueError where none does, which the convexity of the problem excludes."""
    n = len(mass)
    m, left, k = (np.array(values, dtype=object) for values in (mass, velocity, dissipation))
    closing = (np.eye(n - 1, n) - np.eye(n - 1, n, 1)).astype(int).astype(object)
    before = closing @ left
    free = (k > 0) & (before > 0)
    for closed in itertools.product((True, False), repeat=n - 1):
        shut = np.array(closed, dtype=bool)
        may = [(True, False) if one else (False,) for one in free & ~shut]
        for acts in itertools.product(*may):
            active = np.where(free & (shut | np.array(acts, dtype=bool)), k, 0)
            after, reaction = _with_closed(m, left, closing, active, shut)
            rates = closing @ after
            pushed = rates + before
            signs = np.where(active > 0, pushed >= 0, (pushed <= 0) | (k == 0))
            if signs.all() and (reaction >= 0).all() and (rates <= 0).all():
                change = (m * (after**2 - left**2)).sum()
                return after.tolist(), Fraction(change, 2)
    raise ValueError("velocity: no set of closed contacts fits")


def _with_closed(mass: Any, left: Any, closing: Any, k: Any, shut: Mask) -> tuple[Any, Any]:
    """u⁺ (n) and λ of the contacts that are shut, the others without any, in exact arithmetic: the
    system by Gauss and Jordan."""
    n, selected = len(mass), closing[shut]
    drag = (closing.T * k) @ closing
    none = np.zeros((len(selected), len(selected)), dtype=object)
    right = np.concatenate([mass * left - drag @ left, none.sum(1)])
    rows = np.column_stack([np.block([[np.diag(mass) + drag, selected.T], [selected, none]]), right])
    for i in range(len(rows)):
        pivot = next(r for r in range(i, len(rows)) if rows[r, i])
        rows[[i, pivot]] = rows[[pivot, i]]
        rows[i] = rows[i] * (1 / Fraction(rows[i, i]))
        others = np.arange(len(rows)) != i
        rows[others] -= rows[others, i : i + 1] * rows[i]
    return rows[:n, -1], rows[n:, -1]
