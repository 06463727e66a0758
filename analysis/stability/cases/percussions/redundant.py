"""Redundant packings: reactions that the mechanics leaves open."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.percussions.dense_reference import dense_percussions
from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.crowds import contacts_of, corner_walls, disks, rhombus
from nscd import Contacts, Percussions, Snapshot, Status, solve
from nscd.indeterminacy.determinacy import admissible_determinacy

# Differences of u⁺ over |u⁻| and of λ over the largest λ that solver tolerances of 1e-8 explain.
SAME_VELOCITY, SAME_REACTION = 1e-5, 1e-4
QUANTITIES = (
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


ROWS = (
    *(Choice(solver) for solver in ("auto", "interior_point", "active_set", "gauss_seidel")),
    *(Choice(solver, False) for solver in ("projected_gradient", "gauss_seidel")),
)


def pressed_corner(across: int) -> tuple[Snapshot, Contacts]:
    """Make across² disks on the triangular lattice that run into the corner of two walls."""
    snapshot = disks(rhombus(across), (-1.0, -0.8))
    return snapshot, contacts_of(snapshot, corner_walls(across))


def attempt(across: float, row: Choice, folder: Path) -> Cell:
    """Compare λ and u⁺ with dense least squares with the least Σλ²."""
    snapshot, contacts = pressed_corner(round(across))
    answer = row.solve(snapshot, contacts)
    reaction, velocity = dense_percussions(snapshot, contacts, snapshot.velocity, least=True)
    off = float(np.abs(answer.reaction - reaction).max() / reaction.max())
    wrong = float(np.abs(answer.right_velocity - velocity).max() / np.abs(snapshot.velocity).max())
    freedom = float("nan")
    if answer.status is Status.SOLVED:
        freedom = float(admissible_determinacy(contacts, answer).redundant)
    return cell_of(answer, (wrong, off, freedom), "the least Σλ²")


def cell_of(answer: Percussions, found: tuple[float, float, float], other: str) -> Cell:
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


def case(quick: bool) -> Case:
    """Make the case."""
    return Case(
        name="redundant",
        columns=Axis(
            "disks along a side", (2.0, 4.0, 7.0) if quick else (2.0, 3.0, 4.0, 5.0, 6.0, 8.0)
        ),
        rows=Axis("solver", ROWS),
        quantities=QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.INACCURATE,),
    )
