"""Answers that depend on the order in which contacts are listed."""

import dataclasses
from pathlib import Path

import numpy as np

from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.cases.percussions.redundant import (
    QUANTITIES,
    ROWS,
    Choice,
    cell_of,
    pressed_corner,
)
from nscd import Status

ORDERS = 4


def attempt(across: float, row: Choice, folder: Path) -> Cell:
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
    return cell_of(answer, (wrong, off, float("nan")), "another order")


def case(quick: bool) -> Case:
    """Make the case."""
    return Case(
        name="contact_order",
        columns=Axis(
            "disks along a side", (2.0, 4.0, 7.0) if quick else (2.0, 3.0, 4.0, 6.0, 8.0, 10.0)
        ),
        rows=Axis("solver", ROWS),
        quantities=QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.INACCURATE,),
        values={"orders": ORDERS},
    )
