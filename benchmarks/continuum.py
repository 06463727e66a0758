"""Seconds of the continuum collision against its unknowns, with the certificate, and its largest
pressure under refinement.

python benchmarks/continuum.py [--largest 100000]"""

import itertools
from functools import partial
from typing import NamedTuple

import numpy as np

from benchmarks.machine import describe, head, least, line, options, power, table
from nscd.continuum.collision import collide
from nscd.continuum.left_velocity import random_speeds, toward_exit
from nscd.continuum.medium import table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.pressure import largest_pressures
from nscd.continuum.room import square_room
from nscd.continuum.space import Space
from nscd.stress import Kernel

ROOM = square_room(18.0, 1.0)
MEDIUM = table_1_medium()
TOWARD = toward_exit(ROOM, 1.7)
# half of the people walk away from the exit: walls that hold and walls that are left, mixed
RANDOM = random_speeds(ROOM, toward_exit(ROOM, 1.0), mean=0.0, deviation=1.0, seed=1, cell=7**-0.5)
LEFT = {"to the exit": TOWARD, "random": RANDOM}
# unknowns of a graded P1 mesh of side 1 m, measured; the sides are chosen from it
UNKNOWNS = 900.0


class Row(NamedTuple):
    """One solved room: CPU seconds of the mesh and of the collision, the best of a few."""

    order: int
    left: str
    unknowns: int
    mesh_s: float
    cpu_s: float
    iterations: int
    residual: float
    energy_error: float
    status: str


def measure(order: int, left: str, wanted: float) -> Row:
    """The room with about `wanted` unknowns."""
    mesh_s, mesh = least(partial(mesh_of, ROOM, order * np.sqrt(UNKNOWNS / wanted)))
    cpu_s, answer = least(lambda: collide(Space(mesh, order), MEDIUM, LEFT[left]))
    unknowns = int(answer.space.basis.N)
    found = answer.iterations, answer.residual, answer.energy.error, answer.status
    return Row(order, left, unknowns, mesh_s, cpu_s, *found)


def growth(name: str, rows: list[Row]) -> str:
    """How the CPU seconds grow with the unknowns."""
    sizes, seconds = [r.unknowns for r in rows], [r.cpu_s for r in rows]
    upper = power(sizes[-2:], seconds[-2:])
    return (
        f"{name}: CPU seconds grow as N^{power(sizes, seconds):.2f} over all sizes, as "
        f"N^{upper:.2f} between the two largest."
    )


def main() -> None:
    """Print the tables."""
    largest = options(__doc__, largest=100_000.0).largest
    sizes = [3125 * 2**k for k in range(8) if 3125 * 2**k <= largest]
    print(describe(), end="\n\n")
    print(
        head(
            *("elements", "u⁻", "unknowns", "mesh CPU s", "collision CPU s", "sets", "residual"),
            *("energy error", "status"),
        )
    )
    fits = []
    for order, left in itertools.product((1, 2), LEFT):
        rows = [measure(order, left, size) for size in sizes]
        for r in rows:
            seconds = [f"{one:.2f}" for one in (r.mesh_s, r.cpu_s)]
            errors = [f"{one:.1e}" for one in (r.residual, r.energy_error)]
            cells = [f"P{r.order}", r.left, r.unknowns, *seconds, r.iterations, *errors, r.status]
            print(line(cells), flush=True)
        fits += [growth(f"P{order}, {left}", rows)] if len(rows) > 1 else []
    print("", *fits, "", sep="\n")
    names = ("mesh", "side m", "unknowns", "largest p in a triangle N·s/m", "over a body (0.2 m)")
    body = Kernel(width=0.2)
    pressures = [
        [name, f"{p.size:g}", p.unknowns, f"{p.raw:.0f}", f"{p.body:.0f}"]
        for name, grading in (("uniform", 1.0), ("graded", 0.4))
        for p in largest_pressures(ROOM, MEDIUM, TOWARD, body, [1, 0.5, 0.25], grading=grading)
    ]
    print(table(names, pressures))


if __name__ == "__main__":
    main()
