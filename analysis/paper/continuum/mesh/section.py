"""What a mesh buys: errors of the collision (11) against CPU seconds, for P1 and P2 on uniform and
graded meshes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.pages.section import Cell, Picture, Section, Table
from analysis.paper.continuum.mesh.charts import work_precision_picture
from analysis.paper.continuum.mesh.study import (
    ANNULUS,
    APART,
    BODY,
    GRADING,
    NEAR,
    REFERENCE_GRADING,
    ROOM,
    SPEED,
    TABLE,
    Plan,
    Point,
    Study,
    study,
)
from analysis.support.machine import machine
from analysis.support.progress import Progress
from nscd.percussions import Status

GOAL = 0.01
CLEAR = 1.5
NAMES = {
    "energy": "the velocity sum w (energy norm)",
    "pressure": "the pressure over a body",
    "load": "the load of the walls",
}


def build(progress: Progress | None = None, plan: Plan | None = None) -> Section:
    """The chart of errors against CPU seconds in the room and in the half-annulus, its table, and
    what it says."""
    found = study(plan or Plan(), progress)
    unsolved = [p for p in (*found.room, *found.annulus) if p.status is not Status.SOLVED]
    warnings = [f"{p.family}, {p.size:g}: {p.status}" for p in unsolved]
    return Section(
        number="mesh",
        title="Work and precision: P1 and P2 elements, uniform and graded meshes",
        words=[*_setting(found), *_verdicts(found.room), _orders(found)],
        pictures=[
            Picture(
                name="mesh_precision",
                caption="Relative error against CPU seconds of mesh and collision. In the grey the reference says nothing: "
                f"so far from it is the next coarser one. {machine()}.",
                figure=work_precision_picture(found),
            )
        ],
        tables=[_table(found)],
        differs=(),
        warnings=warnings if found.reference_solved else [*warnings, "a reference is not solved"],
    )


def _setting(found: Study) -> list[str]:
    far = found.uncertainty
    side = float(np.ptp(ROOM.outline[:, 1]))
    return [
        f"A room of {side:g} m by {side:g} m with a 1 m exit, ρ = {TABLE.density:g} people/m² of "
        f"{TABLE.mass_per_person:g} kg, k_v and k_s of Table 1, u⁻ = {SPEED:g} m/s to the exit. Graded: the side of the "
        f"triangles falls to the jambs as d^{1 - GRADING[1]:g} (P1) and d^{1 - GRADING[2]:g} (P2). Reference: P2 with "
        f"{found.reference_unknowns:,} unknowns, graded as d^{1 - REFERENCE_GRADING:g}; the next coarser one is "
        f"{_percent(far.energy)} from it in energy, {_percent(far.pressure)} in pressure and {_percent(far.load)} in load "
        f"(its own error should be smaller). Pressures are Gaussian means of {BODY.width:g} m, every {APART:g} m within "
        f"{NEAR:g} m of the exit, the largest difference over the largest pressure.",
        f"The half-annulus ({ANNULUS.inner:g} m ≤ r ≤ {ANNULUS.outer:g} m, k_s = 0) has a closed form and no jamb "
        "singularity; P2 is isoparametric there.",
    ]


def _verdicts(room: Sequence[Point]) -> list[str]:
    """For each quantity, the CPU seconds of each family to the goal, and which needs least."""
    families = list(dict.fromkeys(p.family for p in room))
    words = []
    for name, what in NAMES.items():
        needed = {f: seconds_to([p for p in room if p.family == f], name, GOAL) for f in families}
        reached = {f: s for f, s in needed.items() if s is not None}
        said = [
            f"{f} {reached[f]:.2g} s" if f in reached
            else f"{f} does not get there (best {_percent(min(getattr(p.errors, name) for p in room if p.family == f))})"
            for f in families
        ]  # fmt: skip
        least = f"; cheapest: {min(reached, key=lambda f: reached[f])}" if reached else ""
        words.append(f"{_percent(GOAL)} in {what}: {', '.join(said)}{least}.")
    return words


def _orders(found: Study) -> str:
    said = []
    for points, where in ((found.room, "room"), (found.annulus, "half-annulus")):
        for family in dict.fromkeys(p.family for p in points):
            of = [p for p in points if p.family == family]
            if where == "room":
                of = [p for p in of if p.errors.energy > CLEAR * found.uncertainty.energy]
            if len(of) < 2:
                continue
            coarse, fine = of[-2:]
            rate = np.log(coarse.errors.energy / fine.errors.energy) / np.log(
                fine.unknowns / coarse.unknowns
            )
            said.append(f"{family} in the {where} {2 * rate:.2f}")
    return (
        "Order in energy, error as unknowns^(−order/2), between the two finest meshes that are more than "
        f"{CLEAR:g} times as far from the reference as the next coarser one is: {', '.join(said)}. The stress r^(−1/2) at "
        "the jambs leaves 1/2 of any element on uniform meshes. Graded ones have at most the order of the element, 3/2 where "
        f"a wall begins to hold the crowd, and 1/(2·{GRADING[1]:g}) = {1 / (2 * GRADING[1]):.2f} (P1) and "
        f"1/(2·{GRADING[2]:g}) = {1 / (2 * GRADING[2]):.2f} (P2)."
    )


def seconds_to(points: Sequence[Point], name: str, goal: float) -> float | None:
    """CPU seconds at which the error falls to the goal, a power law between neighbouring points;
    None where it does not."""
    for i, point in enumerate(points):
        error = getattr(point.errors, name)
        if error <= goal:
            if i == 0:
                return point.cpu_s
            before = points[i - 1]
            share = np.log(getattr(before.errors, name) / goal) / np.log(
                getattr(before.errors, name) / error
            )
            return float(before.cpu_s * (point.cpu_s / before.cpu_s) ** share)
    return None


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %"


def _table(found: Study) -> Table:
    rows: list[list[Cell]] = []
    for points, where in ((found.room, "room"), (found.annulus, "half-annulus")):
        rows += [
            [
                where,
                p.family,
                f"{p.size:g} m" if where == "room" else f"{p.size:g} cells",
                p.unknowns,
                f"{p.mesh_s:.3f}",
                f"{p.solve_s:.3f}",
                _percent(p.errors.energy),
                _percent(p.errors.pressure),
                _percent(p.errors.load),
                str(p.status),
            ]
            for p in points
        ]
    return Table(
        caption="Each mesh: side of its triangles, or cells along the radius; CPU seconds of this process (quick ones: the "
        "best of two); relative errors. Pressure: over a body in the room, in L² in the half-annulus.",
        head=["case", "elements", "size", "unknowns", "mesh (s)", "collision (s)", "energy error", "pressure error",
              "wall load error", "status"],
        rows=rows,
    )  # fmt: skip
