"""Restitution toward 1 with many contacts."""

from fractions import Fraction
from pathlib import Path

import numpy as np

from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.cells import SOLVER_QUANTITIES, solver_cell
from analysis.stability.crowds import MASS_KG, contacts_of, disks, line
from analysis.stability.exact_line import exact_line
from nscd import ContactLaw, solve

DISKS = 6
SOLVERS_WITH_DISSIPATION = ("auto", "interior_point", "active_set")


def attempt(below: float, solver: str, folder: Path) -> Cell:
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


def case(quick: bool) -> Case:
    """Make the case."""
    powers = (2, 8, 15) if quick else (1, 2, 4, 6, *range(8, 16))
    return Case(
        name="restitution",
        columns=Axis("1 − e", tuple(float(f"1e-{power}") for power in powers)),
        rows=Axis("solver", SOLVERS_WITH_DISSIPATION),
        quantities=SOLVER_QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.INACCURATE, Outcome.NOT_CONVERGED),
        values={"disks": DISKS},
    )
