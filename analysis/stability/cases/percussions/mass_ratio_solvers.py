"""Mass ratios in the solvers of percussions."""

from pathlib import Path

import numpy as np

from analysis.percussions.dense_reference import dense_percussions
from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.cells import SOLVER_QUANTITIES, SOLVERS, solver_cell
from analysis.stability.crowds import MASS_KG, contacts_of, corner_walls, disks, rhombus
from nscd import solve

ACROSS = 5


def attempt(ratio: float, solver: str, folder: Path) -> Cell:
    """Solve a rhombus of alternating masses in a corner, against dense NNLS."""
    n = ACROSS**2
    light = (np.arange(n) + np.arange(n) // ACROSS) % 2 == 0
    left = np.random.default_rng(1).normal(size=(n, 2))
    snapshot = disks(rhombus(ACROSS), left, MASS_KG * np.where(light, 1 / ratio, 1.0))
    contacts = contacts_of(snapshot, corner_walls(ACROSS))
    _, reference = dense_percussions(snapshot, contacts, left)
    answer = solve(snapshot, contacts, solver=solver)
    return solver_cell(answer, reference, float(np.abs(left).max()))


def case(quick: bool) -> Case:
    """Make the case."""
    ratios = (1.0, 1e3, 1e6) if quick else (1.0, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6)
    return Case(
        name="mass_ratio_solvers",
        columns=Axis("heavy mass / light mass", ratios),
        rows=Axis("solver", SOLVERS),
        quantities=SOLVER_QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.NOT_CONVERGED,),
        values={"across": ACROSS},
    )
