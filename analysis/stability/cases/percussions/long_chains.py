"""Long chains: how slowly projected Gauss–Seidel contracts, and when it gives up."""

import dataclasses
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.cells import SOLVER_QUANTITIES, SOLVERS, TOLERANCE, solver_cell
from analysis.stability.crowds import RADIUS_M, contacts_of, disks, end_walls, line
from nscd import Contacts, Snapshot, solve
from nscd._core import MOST_SWEEPS

# The tolerances between which the contraction is measured.
LOOSE, TIGHT = 1e-5, 1e-7
SWEEPER = "gauss_seidel"
QUANTITIES = (
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


def attempt(n: float, solver: str, folder: Path) -> Cell:
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


def theory(solver: str) -> float:
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


def case(quick: bool) -> Case:
    """Make the case."""
    full = (3.0, 10.0, 30.0, 60.0, 100.0, 150.0, 250.0, 400.0)
    return Case(
        name="long_chains",
        columns=Axis(
            "disks in the chain", (10.0, 50.0, 120.0, 250.0) if quick else full, whole=True
        ),
        rows=Axis("solver", SOLVERS),
        quantities=QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.NOT_CONVERGED,),
        theory=theory,
        values={"loose": LOOSE, "tight": TIGHT},
    )
