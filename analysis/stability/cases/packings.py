"""Redundant packings: reactions that the mechanics leaves open, and answers that depend on the
order of the contacts."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.crowds import rhombus, rhombus_walls, scene_of
from analysis.stability.dense_reference import dense_percussions
from nscd import Contacts, Percussions, Snapshot, Status, find_contacts, solve
from nscd.indeterminacy.determinacy import admissible_determinacy

ROWS = (
    "auto",
    "interior_point",
    "active_set",
    "gauss_seidel",
    "projected_gradient, any λ",
    "gauss_seidel, any λ",
)
# Differences of u⁺ over |u⁻| and of λ over the largest λ that solver tolerances of 1e-8 explain.
SAME_VELOCITY, SAME_REACTION = 1e-5, 1e-4
ORDERS = 4


def pressed_corner(across: int) -> tuple[Snapshot, Contacts]:
    """across² disks on the triangular lattice that run into the corner of two walls."""
    walls = [wall for wall in rhombus_walls(across) if wall.name in ("low", "left")]
    velocity = np.tile([-1.0, -0.8], (across**2, 1))
    scene = scene_of(rhombus(across), velocity, walls=walls, duration=1.0)
    return scene.snapshot, find_contacts(scene.snapshot, scene.wall_segments(), tolerance=1e-6)


def _answer(snapshot: Snapshot, contacts: Contacts, row: str) -> Percussions:
    solver, *rest = row.split(", ")
    return solve(snapshot, contacts, solver=solver, canonical=not rest)


def redundant_attempt(across: float, row: str, folder: Path) -> Cell:
    """λ and u⁺ of the row's solver against dense least squares with the least Σλ²."""
    snapshot, contacts = pressed_corner(round(across))
    answer = _answer(snapshot, contacts, row)
    reaction, velocity = dense_percussions(snapshot, contacts, snapshot.velocity, least=True)
    off = float(np.abs(answer.reaction - reaction).max() / reaction.max())
    wrong = float(np.abs(answer.right_velocity - velocity).max() / np.abs(snapshot.velocity).max())
    freedom = (
        admissible_determinacy(contacts, answer).redundant
        if answer.status is Status.SOLVED
        else np.nan
    )
    return _cell(across, row, answer, wrong, off, float(freedom), "the least Σλ²")


def order_attempt(across: float, row: str, folder: Path) -> Cell:
    """λ and u⁺ of the same contacts in ORDERS random orders, each against the order in which they
    are found."""
    snapshot, contacts = pressed_corner(round(across))
    answer = _answer(snapshot, contacts, row)
    off = wrong = 0.0
    for seed in range(ORDERS):
        order = np.random.default_rng(seed).permutation(len(contacts))
        other = _answer(snapshot, contacts.select(order), row)
        off = max(
            off,
            float(np.abs(other.reaction - answer.reaction[order]).max() / answer.reaction.max()),
        )
        wrong = max(wrong, float(np.abs(other.right_velocity - answer.right_velocity).max()))
        if other.status is not Status.SOLVED:
            answer = dataclasses.replace(answer, status=other.status, reason=other.reason)
    wrong /= float(np.abs(snapshot.velocity).max())
    return _cell(across, row, answer, wrong, off, float("nan"), "another order")


def _cell(
    across: float,
    row: str,
    answer: Percussions,
    wrong: float,
    off: float,
    freedom: float,
    other: str,
) -> Cell:
    if answer.status is not Status.SOLVED:
        outcome, reason = Outcome.NOT_CONVERGED, answer.reason
    elif wrong > SAME_VELOCITY:
        outcome, reason = Outcome.INACCURATE, f"u⁺ differs by {wrong:.2g} from {other}"
    elif off > SAME_REACTION:
        outcome, reason = (
            Outcome.INACCURATE,
            f"λ differs by {off:.2g} of the largest from {other}; u⁺ is the same",
        )
    else:
        outcome, reason = Outcome.STABLE, f"λ as with {other} to {off:.2g}"
    return Cell(
        column=across,
        row=row,
        outcome=outcome,
        reason=reason,
        said=str(answer.status),
        numbers=(wrong, off, freedom, float(answer.iterations)),
    )


QUANTITIES = (
    "difference of u⁺ / |u⁻|",
    "difference of λ / largest λ",
    "dimension of the set of λ",
    "iterations",
)


def redundant(quick: bool) -> Case:
    """Packings whose reactions are not unique."""
    return Case(
        name="redundant",
        title="Redundant (triangular) packings",
        fails="solvers that take any λ: the reactions are one of many answers, with the same u⁺ and residual",
        columns=Axis(
            label="disks along a side",
            values=(2.0, 4.0, 7.0) if quick else (2.0, 3.0, 4.0, 5.0, 6.0, 8.0),
        ),
        rows=Axis(label="solver", values=ROWS),
        quantities=QUANTITIES,
        attempt=redundant_attempt,
        fails_as=(Outcome.INACCURATE,),
        words=(
            "Disks of the triangular lattice run into a corner. u⁺ is unique, the reactions are not: by default the ones "
            "of least Σλ² are given; “any λ” leaves the choice to the method. Reference: dense least squares.",
        ),
    )


def contact_order(quick: bool) -> Case:
    """Answers that depend on the order in which contacts are listed."""
    return Case(
        name="contact_order",
        title="Order of the contacts",
        fails="solvers that take any λ: another order of the same contacts gives other reactions",
        columns=Axis(
            label="disks along a side",
            values=(2.0, 4.0, 7.0) if quick else (2.0, 3.0, 4.0, 6.0, 8.0, 10.0),
        ),
        rows=Axis(label="solver", values=ROWS),
        quantities=QUANTITIES,
        attempt=order_attempt,
        fails_as=(Outcome.INACCURATE,),
        words=(
            f"The same packings with their contacts in {ORDERS} random orders. Nothing physical changes, so nothing in the "
            "answer should.",
        ),
    )
