"""Contacts that open while k > 0 acts beside them."""

import dataclasses
from fractions import Fraction
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.cells import SOLVER_QUANTITIES, solver_cell
from analysis.stability.crowds import MASS_KG, contacts_of, disks, line
from analysis.stability.exact_line import exact_line
from nscd import ContactLaw, solve

# Of the energy: a gain above this is none of rounding.
ROUNDING = 1e-9


def attempt(opening: float, dissipation: float, folder: Path) -> Cell:
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


def theory(dissipation: float) -> float:
    """Compute the opening speed at which the exact change of energy changes its sign (m/s); NaN
    where it does not below 2."""

    def change(speed: float) -> float:
        return exact_energy(float(speed), dissipation)[1]

    speeds = np.geomspace(0.004, 2.0, 100)
    gains = np.array([change(speed) for speed in speeds]) > 0
    if not (at := np.flatnonzero(gains[1:] != gains[:-1])).size:
        return float("nan")
    return float(brentq(change, speeds[at[0]], speeds[at[0] + 1], xtol=1e-12))


def case(quick: bool) -> Case:
    """Make the case."""
    full = (0.005, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.5)
    return Case(
        name="opening_contacts",
        columns=Axis(
            "speed with which the second contact opens (m/s)",
            (0.02, 0.3, 0.7, 1.5) if quick else full,
        ),
        rows=Axis(
            "k / m",
            (1.0, 10.0, 50.0) if quick else (0.1, 1.0, 3.0, 6.0, 8.0, 12.0, 20.0, 50.0, 200.0),
        ),
        quantities=(*SOLVER_QUANTITIES, "change of energy / energy", "warnings"),
        attempt=attempt,
        fails_as=(Outcome.ENERGY_GAIN,),
        theory=theory,
    )
