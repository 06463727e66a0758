"""What a mesh buys: errors of (11) against CPU seconds, P1 and P2, uniform and graded meshes."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from analysis.pages.numbers import decimals, percent
from analysis.pages.section import Cell, Section
from analysis.pages.words import Words
from analysis.paper.continuum.mesh import study as constants
from analysis.paper.continuum.mesh.charts import QUANTITIES, work_precision_picture
from analysis.paper.continuum.mesh.study import Plan, Point, Study, study
from analysis.support.machine import machine
from analysis.support.progress import Progress
from nscd.percussions import Status

GOAL = 0.01
CLEAR = 1.5  # times the distance of the references: an error nearer to it says nothing


def build(progress: Progress | None = None, plan: Plan | None = None) -> Section:
    """Build the chart of errors against CPU seconds in the room and in the half-annulus."""
    found = study(plan or Plan(), progress)
    words = Words(
        __package__,
        **{"found": found, "far": found.uncertainty, "machine": machine(), "study": constants},
        **{"goal": GOAL, "clear": CLEAR, "side": float(np.ptp(constants.ROOM.outline[:, 1]))},
        reached=[_reached(found.room, name) for name in QUANTITIES],
        orders=_orders(found),
    )
    unsolved = [p for p in (*found.room, *found.annulus) if p.status is not Status.SOLVED]
    warnings = [f"{p.family}, {p.size:g}: {p.status}" for p in unsolved]
    return words.section(
        "mesh",
        pictures=[words.picture("mesh_precision", work_precision_picture(found))],
        tables=[
            words.table(
                "meshes",
                [_row("room", f"{p.size:g} m", p) for p in found.room]
                + [_row("half-annulus", f"{p.size:g} cells", p) for p in found.annulus],
            )
        ],
        warnings=warnings if found.reference_solved else [*warnings, "a reference is not solved"],
    )


class Reached(NamedTuple):
    """What each family of meshes needs to come to the goal in one quantity.

    seconds: s, CPU time, of the families that get there.
    best: the least error of each family.
    """

    quantity: str
    seconds: dict[str, float]
    best: dict[str, float]

    @property
    def cheapest(self) -> str | None:
        """The family that needs least."""
        return min(self.seconds, key=self.seconds.__getitem__, default=None)


def _reached(points: Sequence[Point], name: str) -> Reached:
    families = _families(points)
    needed = {family: seconds_to(some, name, GOAL) for family, some in families.items()}
    return Reached(
        name,
        {family: s for family, s in needed.items() if s is not None},
        {f: min(getattr(p.errors, name) for p in some) for f, some in families.items()},
    )


def seconds_to(points: Sequence[Point], name: str, goal: float) -> float | None:
    """Read the CPU seconds at which the error falls to the goal, a power law between points.

    None where it does not.
    """
    for i, point in enumerate(points):
        error = getattr(point.errors, name)
        if error <= goal:
            if i == 0:
                return point.cpu_s
            before = points[i - 1]
            start = getattr(before.errors, name)
            share = np.log(start / goal) / np.log(start / error)
            return float(before.cpu_s * (point.cpu_s / before.cpu_s) ** share)
    return None


def _orders(found: Study) -> list[tuple[str, str, float]]:
    """Family, case and the order in energy between the two finest meshes that are clear of the
    reference."""
    clear = [p for p in found.room if p.errors.energy > CLEAR * found.uncertainty.energy]
    orders = []
    for points, where in ((clear, "room"), (found.annulus, "half-annulus")):
        for family, some in _families(points).items():
            if len(some) > 1:
                coarse, fine = some[-2:]
                gain = np.log(coarse.errors.energy / fine.errors.energy)
                rate = 2 * float(gain / np.log(fine.unknowns / coarse.unknowns))
                orders.append((family, where, rate))
    return orders


def _families(points: Sequence[Point]) -> dict[str, list[Point]]:
    names = dict.fromkeys(p.family for p in points)
    return {name: [p for p in points if p.family == name] for name in names}


def _row(where: str, size: str, p: Point) -> list[Cell]:
    seconds = [decimals(s, 3) for s in (p.mesh_s, p.solve_s)]
    errors = [percent(getattr(p.errors, name), 2) for name in QUANTITIES]
    return [where, p.family, size, p.unknowns, *seconds, *errors, str(p.status)]
