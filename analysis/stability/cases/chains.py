"""Long chains: how slowly projected Gauss–Seidel contracts, and when it gives up."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from analysis.stability import solver_cells
from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.crowds import RADIUS_M, end_walls, line, scene_of
from nscd import Contacts, Snapshot, find_contacts, solve
from nscd.solvers.gauss_seidel import gauss_seidel

# The tolerances between which the contraction is measured.
LOOSE, TIGHT = 1e-5, 1e-7
QUANTITIES = (
    *solver_cells.QUANTITIES,
    "contraction ρ a sweep",
    "cos²(π/(2n))",
    "(1−ρ) measured / theory",
    "cos²(π/(2n+1))",
)


def chain(n: int) -> tuple[Snapshot, Contacts]:
    """n touching disks that move at 1 m/s along x into a wall, and their n contacts."""
    position = line(n)
    walls = end_walls(-4 * RADIUS_M, position[-1, 0] + RADIUS_M)[1:]
    scene = scene_of(position, np.tile([1.0, 0.0], (n, 1)), walls=walls, duration=1.0)
    return scene.snapshot, find_contacts(scene.snapshot, scene.wall_segments(), tolerance=1e-6)


def contraction(n: int) -> float:
    """ρ of projected Gauss–Seidel on the chain: (TIGHT/LOOSE)^(1/sweeps between), from two
    solutions; NaN where one ended at the limit of sweeps."""
    snapshot, contacts = chain(n)
    found = [
        solve(snapshot, contacts, solver="gauss_seidel", tolerance=tolerance, canonical=False)
        for tolerance in (LOOSE, TIGHT)
    ]
    if any(answer.status != "solved" for answer in found):
        return float("nan")
    return float((TIGHT / LOOSE) ** (1 / (found[1].iterations - found[0].iterations)))


def rate(parts: float) -> float:
    """cos²(π/parts). With parts = 2n: the contraction of Gauss–Seidel on W of a chain of n equal
    disks against a wall, whose last contact has half the diagonal of the others, so that the Jacobi
    matrix has the eigenvalues cos((2j−1)π/(2n)). With parts = 2n+1: that of a chain whose contacts
    all have the same diagonal."""
    return float(np.cos(np.pi / parts) ** 2)


def chain_attempt(n: float, row: str, folder: Path) -> Cell:
    """A chain of n disks stopped by a wall, by the solver of the row; the closed form is u⁺ = 0."""
    count = round(n)
    snapshot, contacts = chain(count)
    answer = solve(snapshot, contacts, solver=row, tolerance=solver_cells.TOLERANCE)
    cell = solver_cells.solver_cell(n, row, answer, np.zeros((count, 2)), 1.0)
    swept = row == "gauss_seidel" and cell.said == "solved"
    measured, expected = contraction(count) if swept else float("nan"), rate(2 * count)
    numbers = (
        *cell.numbers,
        measured,
        expected,
        (1 - measured) / (1 - expected),
        rate(2 * count + 1),
    )
    return Cell(
        column=n, row=row, outcome=cell.outcome, reason=cell.reason, said=cell.said, numbers=numbers
    )


def chain_theory(row: str) -> float:
    """The length n at which the residual after the limit of sweeps, (2/n) cos²(π/(2n)) to their
    power, is the tolerance.

    The true reactions j·m·u of the contacts have the share 1/(n(1 − cos(π/(2n)))) of the slowest
    mode sin(jπ/(2n)), which the wall stops with 2(1 − cos(π/(2n))) times itself: 2/n of u for the
    longest mode at the first sweep."""
    if row != "gauss_seidel":
        return float("nan")
    sweeps = (gauss_seidel.__defaults__ or (0,))[0]
    wanted = np.log(solver_cells.TOLERANCE)
    return float(brentq(lambda n: np.log(2 / n) + sweeps * np.log(rate(2 * n)) - wanted, 10.0, 1e6))


def long_chains(quick: bool) -> Case:
    """Chains that are too long for sweeps."""
    lengths = (
        (10.0, 50.0, 120.0, 250.0) if quick else (3.0, 10.0, 30.0, 60.0, 100.0, 150.0, 250.0, 400.0)
    )
    return Case(
        name="long_chains",
        title="Long chains",
        fails="projected Gauss–Seidel: contracts by cos²(π/(2n)) a sweep and runs into its limit of sweeps",
        columns=Axis(label="disks in the chain", values=lengths, whole=True),
        rows=Axis(label="solver", values=solver_cells.SOLVERS),
        quantities=QUANTITIES,
        attempt=chain_attempt,
        fails_as=(Outcome.NOT_CONVERGED,),
        theory=chain_theory,
        edge="length n with (2/n) cos²(π/(2n)) to the power of the limit of sweeps = tolerance",
        words=(
            "Equal touching disks that run into a wall: closed form u⁺ = 0. The contraction is measured between the "
            f"tolerances {LOOSE:g} and {TIGHT:g}. Against a wall its theory is cos²(π/(2n)), since a wall contact has half the "
            "diagonal of a pair; cos²(π/(2n+1)) holds where all contacts have the same. The slowest mode starts with 2/n of "
            "the speed, which gives the longest chain that ends within the limit of sweeps.",
        ),
    )
