"""The answer of a problem that came as a file, written as CSV."""

import dataclasses
from pathlib import Path

import numpy as np

from analysis.exchange.crowd import CrowdProblem
from analysis.exchange.fclib import read_problem, read_velocities
from analysis.exchange.problem import ExchangeError, LocalProblem
from analysis.percussions.table import COLUMNS, Cells, Openness, cells_of
from analysis.support.files import write_rows
from nscd.arrays import Floats
from nscd.friction.planar import solve_planar
from nscd.percussions import Status

# Of a problem whose bodies are not known, in the units of its file.
BARE = ("contact", "mu", "r_n", "r_t", "u_n", "u_t", "status", "residual")


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class SolvedFile:
    """Say what a problem's answer is worth.

    difference: largest difference of u from the solution in the file, in the file's unit; None
        where it has none"""

    contacts: int
    residual: float  # dimensionless, see `nscd.solve` and `nscd.friction.planar.solve_planar`
    difference: float | None
    why: str  # of what is not solved, empty where it is


def solve_file(path: Path, out: Path, tolerance: float, openness: Openness) -> SolvedFile:
    """Solve the problem of an FCLIB file and write `out`, one row per contact: the columns of
    `percussions solve` where the file says whose contacts they are.

    openness: what is said of reactions that the mechanics may leave open, where bodies are known

    Raises ExchangeError as `read_problem` does."""
    problem, known = read_problem(path), read_velocities(path)
    if isinstance(problem, CrowdProblem):
        cells, velocity, residual, why = _of_crowd(problem, tolerance, openness)
    else:
        cells, velocity, residual, why = _of_local(problem, tolerance)
    difference = None
    if known is not None:
        if velocity.shape != known.shape:
            raise ExchangeError(
                f"{path}: /solution/u: {known.size} numbers where {velocity.size} are needed"
            )
        difference = float(np.abs(velocity - known).max())
    write_rows(out, list(cells), zip(*cells.values(), strict=True))
    return SolvedFile(contacts=len(velocity), residual=residual, difference=difference, why=why)


def _of_crowd(
    problem: CrowdProblem, tolerance: float, openness: Openness
) -> tuple[Cells, Floats, float, str]:
    found = problem.solve(tolerance)
    answer, every = found.answer, cells_of(found, openness, time=found.snapshot.time)
    cells = {name: every[name] for name in COLUMNS if name in every}
    moved = np.column_stack([answer.right_velocity, answer.right_spin]).ravel()
    matrices = problem.matrices(np.zeros(len(problem.contacts)))
    velocity = (matrices.transfer.T @ moved).reshape(-1, 2)
    why = "" if answer.status == Status.SOLVED else f"{answer.status}: {answer.reason}"
    return cells, velocity, answer.residual, why


def _of_local(problem: LocalProblem, tolerance: float) -> tuple[Cells, Floats, float, str]:
    found = solve_planar(problem.delassus, problem.free, problem.friction, tolerance)
    k, solved = len(problem.friction), found.residual <= tolerance
    status = Status.SOLVED if solved else Status.INACCURATE
    columns = [range(1, k + 1), problem.friction, *found.reaction.T, *found.velocity.T]
    columns += [[str(status)] * k, [found.residual] * k]
    cells = {name: list(column) for name, column in zip(BARE, columns, strict=True)}
    why = "" if solved else f"{status}: residual {found.residual:.1e}, tolerance {tolerance:.1e}"
    return cells, found.velocity, found.residual, why
