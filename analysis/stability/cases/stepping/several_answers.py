"""Friction without a unique answer."""

from pathlib import Path

import numpy as np

from analysis.stability.case import Axis, Case, Cell, Outcome
from nscd import ContactLaw, Contacts, Snapshot, Status, solve

DRAWN, STARTS = 60, 8
# Differences of u⁺ (m/s, of speeds about 1) that the tolerance explains.
SAME = 1e-6
QUANTITIES = ("largest spread of u⁺ (m/s)", "disks with several answers", "disks tried")


def wedged(apart_deg: float, random: np.random.Generator) -> tuple[Snapshot, Contacts]:
    """Make a disk that moves at random and touches two walls, whose normals are so far apart."""
    angle = np.radians(random.uniform(0.0, 360.0) + np.array([0.0, apart_deg]))
    normal = np.column_stack([np.cos(angle), np.sin(angle)])
    snapshot = Snapshot(
        position=np.zeros((1, 2)),
        velocity=random.normal(size=(1, 2)),
        radius=np.ones(1),
        mass=np.full(1, 75.0),
        spin=random.normal(size=1),
    )
    return snapshot, Contacts(
        first=np.zeros(2, dtype=int),
        second=np.arange(2),
        is_wall=np.ones(2, dtype=bool),
        normal=normal,
        gap=np.zeros(2),
        point=normal,
    )


def attempt(friction: float, apart_deg: float, folder: Path) -> Cell:
    """Solve for many disks between two walls from several starts, and see how far apart their u⁺
    are."""
    random = np.random.default_rng(7)
    spreads, unsolved = [], 0
    for _ in range(DRAWN):
        snapshot, contacts = wedged(apart_deg, random)
        law = ContactLaw(friction=friction)
        answer = solve(snapshot, contacts, law=law, tolerance=1e-10, starts=STARTS)
        unsolved += answer.status is not Status.SOLVED
        spread = answer.friction.spread if answer.friction else 0.0
        spreads.append(0.0 if np.isnan(spread) else spread)
    several = sum(spread > SAME for spread in spreads)
    outcome = Outcome.INACCURATE if several else Outcome.STABLE
    if unsolved:
        outcome = Outcome.NOT_CONVERGED
    reason = f"{several} of {DRAWN} disks have several u⁺, up to {max(spreads):.2g} m/s apart"
    numbers = (max(spreads), float(several), float(DRAWN))
    return Cell(outcome=outcome, reason=reason, said="solved", numbers=numbers)


def case(quick: bool) -> Case:
    """Make the case."""
    values = (0.3, 1.0, 3.0) if quick else (0.1, 0.3, 0.5, 0.8, 1.2, 2.0, 3.0)
    return Case(
        name="several_answers",
        columns=Axis("friction", values),
        rows=Axis("angle between the normals (°)", (90.0, 120.0, 150.0)),
        quantities=QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.INACCURATE,),
        values={"drawn": DRAWN, "starts": STARTS},
    )
