"""What solvers of percussions fail at."""

import dataclasses
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from analysis.percussions.dense_reference import dense_percussions
from analysis.stability.case import Cell, Outcome, case
from analysis.stability.crowds import (
    MASS_KG,
    RADIUS_M,
    contacts_of,
    corner_walls,
    disks,
    end_walls,
    line,
    rhombus,
)
from analysis.stability.trial import SOLVER_QUANTITIES, SOLVERS, TOLERANCE, solver_cell
from nscd import ContactLaw, Contacts, Percussions, Snapshot, Status, solve
from nscd._core import MOST_SWEEPS
from nscd.indeterminacy.determinacy import admissible_determinacy

ACROSS = 5


@case(
    columns=("heavy mass / light mass", (1.0, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6), (1.0, 1e3, 1e6)),
    rows=("solver", SOLVERS),
    quantities=SOLVER_QUANTITIES,
    fails_as=(Outcome.NOT_CONVERGED,),
    values={"across": ACROSS},
)
def mass_ratio_solvers(ratio: float, solver: str, folder: Path) -> Cell:
    """Solve a rhombus of alternating masses in a corner, against dense NNLS."""
    n = ACROSS**2
    light = (np.arange(n) + np.arange(n) // ACROSS) % 2 == 0
    left = np.random.default_rng(1).normal(size=(n, 2))
    snapshot = disks(rhombus(ACROSS), left, MASS_KG * np.where(light, 1 / ratio, 1.0))
    contacts = contacts_of(snapshot, corner_walls(ACROSS))
    _, reference = dense_percussions(snapshot, contacts, left)
    answer = solve(snapshot, contacts, solver=solver)
    return solver_cell(answer, reference, float(np.abs(left).max()))


# The tolerances between which the contraction is measured.
LOOSE, TIGHT = 1e-5, 1e-7
SWEEPER = "gauss_seidel"
CHAIN_QUANTITIES = (
    *SOLVER_QUANTITIES,
    "contraction ρ a sweep",
    "cos²(π/(2n))",
    "(1−ρ) measured / theory",
    "cos²(π/(2n+1))",
)


def chain(n: int) -> tuple[Snapshot, Contacts]:
    """Make n touching disks that move at 1 m/s along x into a wall, and their n contacts."""
    position = line(n)
    walls = end_walls(-4 * RADIUS_M, position[-1, 0] + RADIUS_M)[1:]
    snapshot = disks(position, (1.0, 0.0))
    return snapshot, contacts_of(snapshot, walls)


def contraction(n: int) -> float:
    """Measure ρ of projected Gauss–Seidel on the chain: (TIGHT/LOOSE)^(1/sweeps between), from two
    solutions; NaN where one ended at the limit of sweeps."""
    snapshot, contacts = chain(n)
    found = [
        solve(snapshot, contacts, solver=SWEEPER, tolerance=tolerance, canonical=False)
        for tolerance in (LOOSE, TIGHT)
    ]
    if any(answer.status != "solved" for answer in found):
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
    wanted = np.log(TOLERANCE)
    return float(
        brentq(lambda n: np.log(2 / n) + MOST_SWEEPS * np.log(rate(2 * n)) - wanted, 10.0, 1e6)
    )


@case(
    columns=(
        "disks in the chain",
        (3.0, 10.0, 30.0, 60.0, 100.0, 150.0, 250.0, 400.0),
        (10.0, 50.0, 120.0, 250.0),
    ),
    rows=("solver", SOLVERS),
    quantities=CHAIN_QUANTITIES,
    fails_as=(Outcome.NOT_CONVERGED,),
    theory=sweeps_theory,
    values={"loose": LOOSE, "tight": TIGHT},
    whole=True,
)
def long_chains(n: float, solver: str, folder: Path) -> Cell:
    """Stop a chain of n disks by a wall; the closed form is u⁺ = 0."""
    count = round(n)
    snapshot, contacts = chain(count)
    answer = solve(snapshot, contacts, solver=solver, tolerance=TOLERANCE)
    cell = solver_cell(answer, np.zeros((count, 2)), 1.0)
    swept = solver == SWEEPER and cell.said == "solved"
    measured, expected = contraction(count) if swept else float("nan"), rate(2 * count)
    ratio = (1 - measured) / (1 - expected)
    rates = (measured, expected, ratio, rate(2 * count + 1))
    return dataclasses.replace(cell, numbers=(*cell.numbers, *rates))


# Differences of u⁺ over |u⁻| and of λ over the largest λ that solver tolerances of 1e-8 explain.
SAME_VELOCITY, SAME_REACTION = 1e-5, 1e-4
CHOICE_QUANTITIES = (
    "difference of u⁺ / |u⁻|",
    "difference of λ / largest λ",
    "dimension of the set of λ",
    "iterations",
)


@dataclass(frozen=True, slots=True)
class Choice:
    """A row: a solver, and whether it gives the reactions of least Σλ² or any that fit."""

    solver: str
    canonical: bool = True

    def __str__(self) -> str:
        return self.solver + ("" if self.canonical else ", any λ")

    def solve(self, snapshot: Snapshot, contacts: Contacts) -> Percussions:
        """Solve with this choice."""
        return solve(snapshot, contacts, solver=self.solver, canonical=self.canonical)


CHOICES = (
    *(Choice(solver) for solver in ("auto", "interior_point", "active_set", "gauss_seidel")),
    *(Choice(solver, False) for solver in ("projected_gradient", "gauss_seidel")),
)


def pressed_corner(across: int) -> tuple[Snapshot, Contacts]:
    """Make across² disks on the triangular lattice that run into the corner of two walls."""
    snapshot = disks(rhombus(across), (-1.0, -0.8))
    return snapshot, contacts_of(snapshot, corner_walls(across))


@case(
    columns=("disks along a side", (2.0, 3.0, 4.0, 5.0, 6.0, 8.0), (2.0, 4.0, 7.0)),
    rows=("solver", CHOICES),
    quantities=CHOICE_QUANTITIES,
    fails_as=(Outcome.INACCURATE,),
)
def redundant(across: float, row: Choice, folder: Path) -> Cell:
    """Compare λ and u⁺ with dense least squares with the least Σλ²."""
    snapshot, contacts = pressed_corner(round(across))
    answer = row.solve(snapshot, contacts)
    reaction, velocity = dense_percussions(snapshot, contacts, snapshot.velocity, least=True)
    off = float(np.abs(answer.reaction - reaction).max() / reaction.max())
    wrong = float(np.abs(answer.right_velocity - velocity).max() / np.abs(snapshot.velocity).max())
    freedom = float("nan")
    if answer.status is Status.SOLVED:
        freedom = float(admissible_determinacy(contacts, answer).redundant)
    return compared(answer, (wrong, off, freedom), "the least Σλ²")


def compared(answer: Percussions, found: tuple[float, float, float], other: str) -> Cell:
    """Make a cell of an answer whose u⁺ and λ differ by the first two numbers from another's."""
    wrong, off, _ = found
    if answer.status is not Status.SOLVED:
        outcome, reason = Outcome.NOT_CONVERGED, answer.reason
    elif wrong > SAME_VELOCITY:
        outcome, reason = Outcome.INACCURATE, f"u⁺ differs by {wrong:.2g} from {other}"
    elif off > SAME_REACTION:
        outcome = Outcome.INACCURATE
        reason = f"λ differs by {off:.2g} of the largest from {other}; u⁺ is the same"
    else:
        outcome, reason = Outcome.STABLE, f"λ as with {other} to {off:.2g}"
    numbers = (*found, float(answer.iterations))
    return Cell(outcome=outcome, reason=reason, said=str(answer.status), numbers=numbers)


ORDERS = 4


@case(
    columns=("disks along a side", (2.0, 3.0, 4.0, 6.0, 8.0, 10.0), (2.0, 4.0, 7.0)),
    rows=("solver", CHOICES),
    quantities=CHOICE_QUANTITIES,
    fails_as=(Outcome.INACCURATE,),
    values={"orders": ORDERS},
)
def contact_order(across: float, row: Choice, folder: Path) -> Cell:
    """Compare λ and u⁺ of the same contacts in ORDERS random orders with those of the order in
    which they are found."""
    snapshot, contacts = pressed_corner(round(across))
    answer = row.solve(snapshot, contacts)
    largest = answer.reaction.max()
    off = wrong = 0.0
    for seed in range(ORDERS):
        order = np.random.default_rng(seed).permutation(len(contacts))
        other = row.solve(snapshot, contacts.select(order))
        off = max(off, float(np.abs(other.reaction - answer.reaction[order]).max() / largest))
        wrong = max(wrong, float(np.abs(other.right_velocity - answer.right_velocity).max()))
        if other.status is not Status.SOLVED:
            answer = dataclasses.replace(answer, status=other.status, reason=other.reason)
    wrong /= float(np.abs(snapshot.velocity).max())
    return compared(answer, (wrong, off, float("nan")), "another order")


DISKS = 6


@case(
    columns=(
        "1 − e",
        tuple(float(f"1e-{p}") for p in (1, 2, 4, 6, *range(8, 16))),
        (1e-2, 1e-8, 1e-15),
    ),
    rows=("solver", ("auto", "interior_point", "active_set")),
    quantities=SOLVER_QUANTITIES,
    fails_as=(Outcome.INACCURATE, Outcome.NOT_CONVERGED),
    values={"disks": DISKS},
)
def restitution(below: float, solver: str, folder: Path) -> Cell:
    """Let the first of DISKS in a line run into the others with e = 1 − below, against the answer
    in exact arithmetic for the same k."""
    speed = [1.0] + [0.0] * (DISKS - 1)
    snapshot = disks(line(DISKS), np.column_stack([speed, np.zeros(DISKS)]))
    contacts = contacts_of(snapshot)
    law = ContactLaw(restitution=1 - below)
    k = law.coefficients(contacts.inverse_mass(snapshot.mass))[0]
    exact, _ = exact_line(
        [int(MASS_KG)] * DISKS, [Fraction(v) for v in speed], [Fraction(float(c)) for c in k]
    )
    reference = np.column_stack([[float(u) for u in exact], np.zeros(DISKS)])
    return solver_cell(solve(snapshot, contacts, law=law, solver=solver), reference, 1.0)


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


@case(
    columns=(
        "speed with which the second contact opens (m/s)",
        (0.005, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.5),
        (0.02, 0.3, 0.7, 1.5),
    ),
    rows=("k / m", (0.1, 1.0, 3.0, 6.0, 8.0, 12.0, 20.0, 50.0, 200.0), (1.0, 10.0, 50.0)),
    quantities=(*SOLVER_QUANTITIES, "change of energy / energy", "warnings"),
    fails_as=(Outcome.ENERGY_GAIN,),
    theory=opening_theory,
)
def opening_contacts(opening: float, dissipation: float, folder: Path) -> Cell:
    """Solve three touching disks: the first runs at 1 m/s into the second, at rest, and the third
    leaves it at `opening` m/s; k = dissipation · m of both contacts."""
    snapshot = disks(line(3), [[1.0, 0.0], [0.0, 0.0], [opening, 0.0]])
    law = ContactLaw(dissipation=dissipation * MASS_KG, tangential_dissipation=0.0)
    answer = solve(snapshot, contacts_of(snapshot), law=law)
    exact, change = exact_energy(opening, dissipation)
    cell = solver_cell(answer, np.column_stack([exact, np.zeros(3)]), max(1.0, opening))
    before = 0.5 * MASS_KG * (1 + opening**2)
    gain = answer.energy_change / before
    numbers = (*cell.numbers, gain, float(len(answer.warnings)))
    if cell.outcome is Outcome.STABLE and gain > ROUNDING:
        reason = f"energy {gain:+.3g} of the start; exact {change / before:+.3g}"
        cell = dataclasses.replace(cell, outcome=Outcome.ENERGY_GAIN, reason=reason)
    return dataclasses.replace(cell, numbers=numbers)


def exact_energy(opening: float, dissipation: float) -> tuple[list[float], float]:
    """Compute u⁺ (3) m/s and the change of energy (J) of an attempt in exact arithmetic."""
    mass = int(MASS_KG)
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
    before = [velocity[c] - velocity[c + 1] for c in range(n - 1)]
    for closed in itertools.product((True, False), repeat=n - 1):
        choices = [
            (shut,) if not k or shut or v <= 0 else (True, False)
            for shut, k, v in zip(closed, dissipation, before, strict=True)
        ]
        for acts in itertools.product(*choices):
            k = [
                value if act and v > 0 else Fraction(0)
                for value, act, v in zip(dissipation, acts, before, strict=True)
            ]
            after, reaction = _with_closed(mass, velocity, k, closed)
            rates = [after[c] - after[c + 1] for c in range(n - 1)]
            pushed = [a + b for a, b in zip(rates, before, strict=True)]
            signs = all(
                w >= 0 if acting else w <= 0 or not value
                for w, acting, value in zip(pushed, k, dissipation, strict=True)
            )
            if signs and all(r >= 0 for r in reaction) and all(v <= 0 for v in rates):
                change = sum(
                    (m * (a * a - b * b) for m, a, b in zip(mass, after, velocity, strict=True)),
                    Fraction(0),
                )
                return after, change / 2
    raise ValueError("velocity: no set of closed contacts fits")


def _with_closed(
    mass: Sequence[int],
    velocity: Sequence[Fraction],
    dissipation: Sequence[Fraction],
    closed: Sequence[bool],
) -> tuple[list[Fraction], list[Fraction]]:
    """u⁺ (n) and λ (n − 1) with these contacts closed and no λ at the others."""
    n = len(mass)
    rows: list[list[Fraction]] = []
    for i in range(n):
        row, right = [Fraction(0)] * (2 * n - 1), mass[i] * velocity[i]
        row[i] += mass[i]
        for c, sign in ((i, 1), (i - 1, -1)):
            if 0 <= c < n - 1:
                row[c] += sign * dissipation[c]
                row[c + 1] -= sign * dissipation[c]
                right -= sign * dissipation[c] * (velocity[c] - velocity[c + 1])
                row[n + c] += sign
        rows.append([*row, right])
    for c in range(n - 1):
        row = [Fraction(0)] * (2 * n)
        if closed[c]:
            row[c], row[c + 1] = Fraction(1), Fraction(-1)
        else:
            row[n + c] = Fraction(1)
        rows.append(row)
    found = _eliminate(rows)
    return found[:n], found[n:]


def _eliminate(rows: list[list[Fraction]]) -> list[Fraction]:
    """The solution of a regular system, rows with the right side last, by Gauss and Jordan."""
    size = len(rows)
    for i in range(size):
        pivot = next(r for r in range(i, size) if rows[r][i])
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [value / rows[i][i] for value in rows[i]]
        for r in range(size):
            if r != i and rows[r][i]:
                factor = rows[r][i]
                rows[r] = [a - factor * b for a, b in zip(rows[r], rows[i], strict=True)]
    return [row[-1] for row in rows]
