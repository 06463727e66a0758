"""Bodies of several disks: their mass, centre and inertia in the file that LAMMPS' fix rigid/small
takes as its `infile`, and the people that they are."""

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from analysis.support.files import write_text
from analysis.support.reading import NUMBER, lines_of, open_file
from nscd import Snapshot
from nscd.arrays import Indices

# id, mass, centre, inertia xx yy zz xy xz yz, velocity, angular momentum (3 each), three image flags
COLUMNS, INERTIA = 20, 7
# Masses of the bodies and the sums of their disks' may differ by this share: files have 13 digits.
SAME = 1e-9
# m: as far centres.
SAME_M = 1e-6


def write_bodies(path: Path, snapshot: Snapshot) -> None:
    """Write the bodies of a snapshot: their number, then a line of 20 numbers for each."""
    bodies = snapshot.bodies
    assert bodies is not None
    motion = bodies.motion(snapshot, snapshot.velocity).tolist()
    lines = [f"{len(bodies)}"]  # LAMMPS takes no comment on this line
    rows = zip(bodies.ids, bodies.mass, bodies.centre, bodies.inertia, motion, strict=True)
    for body, mass, (x, y), inertia, (vx, vy, spin) in rows:
        i = float(inertia)
        place = f"{float(x)!r} {float(y)!r} 0.0 {i!r} {i!r} {i!r} 0.0 0.0 0.0"
        moving = f"{vx!r} {vy!r} 0.0 0.0 0.0 {i * spin!r} 0 0 0"
        lines.append(f"{body} {float(mass)!r} {place} {moving}")
    write_text(path, "\n".join(lines) + "\n")


def read_bodies(path: Path, disks: Snapshot) -> Snapshot:
    """Give joined disks the inertias of the file. Raises ValueError naming file, line or body for what
    is no such file, bodies that have no disks or are missing, and another mass than the disks'."""
    bodies, rows = disks.bodies, []
    assert bodies is not None
    with open_file(path) as file:
        for number, line in enumerate(lines_of(file, path), start=1):
            words = line.decode("utf-8", "replace").split("#")[0].split()
            if not words or number == 1:
                continue
            if len(words) != COLUMNS or not all(NUMBER.fullmatch(word) for word in words):
                raise ValueError(f"{path}, line {number}: {COLUMNS} numbers of a body are needed")
            rows.append([float(word) for word in words])
    table = np.array(sorted(rows)).reshape(-1, COLUMNS)
    if not np.array_equal(table[:, 0], bodies.ids):
        odd = sorted(set(table[:, 0].tolist()) ^ set(bodies.ids.tolist()))
        raise ValueError(
            f"{path}: body {odd[0] if odd else table[0, 0]:g}: one line, and disks of it, are needed"
        )
    stated = np.column_stack([bodies.mass, bodies.centre])
    near = np.column_stack([SAME * bodies.mass, np.full((len(bodies), 2), SAME_M)])
    if (off := ~(np.abs(table[:, 1:4] - stated) <= near)).any():
        worst, column = np.argwhere(off)[0].tolist()
        unit, said = ("kg", "m of x", "m of y")[column], table[worst, 1 + column]
        own = f"{said:g} {unit} where its disks have {stated[worst, column]:g}"
        raise ValueError(f"{path}: body {bodies.ids[worst]}: {own}")
    try:
        return disks.joined(bodies.ids[bodies.number], inertia=table[:, INERTIA])
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


@lru_cache(maxsize=4)
def people_of(disks: Snapshot) -> tuple[Snapshot, Indices]:
    """Give people as one disk each, and whose (n,) each disk is: of a body of several its centre, motion
    and mass, the id of its first disk, and the radius of a circle as long as its outline."""
    if (of := disks.wide) is None:
        return disks, np.arange(len(disks))
    first = np.unique(of.number, return_index=True)[1]
    order = np.argsort(disks.ids[first])
    motion, outline = of.motion(disks, disks.velocity), [shape.length for shape in shapes(disks)]
    people = Snapshot(
        position=of.centre[order],
        velocity=motion[order, :2],
        radius=np.array(outline)[order] / (2 * np.pi),
        mass=of.mass[order],
        ids=disks.ids[first][order],
        time=disks.time,
    )
    return people, np.argsort(order)[of.number]


def shapes(disks: Snapshot) -> list[Any]:
    """Give what the disks of each body cover together, as shapely has it."""
    import shapely

    assert disks.bodies is not None
    circles = shapely.buffer(shapely.points(disks.position), disks.radius, quad_segs=64)
    bodies = range(len(disks.bodies))
    return [shapely.union_all(circles[disks.bodies.number == body]) for body in bodies]
