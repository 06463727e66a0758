"""Bodies of several disks: their mass, centre and inertia in the file that LAMMPS' fix rigid/small
takes as its `infile`, and the people that they are."""

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from analysis.support.files import write_text
from analysis.support.reading import NUMBER, lines_of, open_file
from nscd import Snapshot
from nscd.arrays import Floats, Indices

COLUMNS = ("id", "mass", "x", "y", "z", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz", "vx", "vy", "vz",
           "Lx", "Ly", "Lz", "x image", "y image", "z image")  # fmt: skip
INERTIA = 7
# Masses of the bodies and the sums of their disks' may differ by this share: files have 13 digits.
SAME = 1e-9
# m, m/s and rad/s: as far centres and their motion.
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
        words_of_position = f"{float(x)!r} {float(y)!r} 0.0 {i!r} {i!r} {i!r} 0.0 0.0 0.0"
        moving = f"{vx!r} {vy!r} 0.0 0.0 0.0 {i * spin!r} 0 0 0"
        lines.append(f"{body} {float(mass)!r} {words_of_position} {moving}")
    write_text(path, "\n".join(lines) + "\n")


def read_bodies(path: Path, disks: Snapshot) -> Snapshot:
    """Give joined disks the inertias of the file. All else in it must be what the disks have, too.

    Raises ValueError naming file, line or body for what is no such file, bodies that have no disks or
    are missing, and a number that is another than that of the disks."""
    bodies, rows, count = disks.bodies, [], ""
    assert bodies is not None
    with open_file(path) as file:
        for number, line in enumerate(lines_of(file, path), start=1):
            words = line.decode("utf-8", "replace").split("#")[0].split()
            if number == 1:
                count = " ".join(words)
            elif words:
                if len(words) != len(COLUMNS) or not all(NUMBER.fullmatch(word) for word in words):
                    raise ValueError(
                        f"{path}, line {number}: {len(COLUMNS)} numbers of a body are needed"
                    )
                rows.append([float(word) for word in words])
    if count != str(len(rows)):
        raise ValueError(f"{path}, line 1: {count!r} where {len(rows)} bodies follow")
    table = np.array(sorted(rows)).reshape(-1, len(COLUMNS))
    if not np.array_equal(table[:, 0], bodies.ids):
        odd = sorted(set(table[:, 0].tolist()) ^ set(bodies.ids.tolist()))
        raise ValueError(
            f"{path}: body {odd[0] if odd else table[0, 0]:g}: one line, and disks of it, are needed"
        )
    have, near = _columns(disks, table[:, INERTIA])
    with np.errstate(invalid="ignore"):  # of infinite ones
        off = ~(np.abs(table - have) <= near)
    if off.any():
        worst, column = np.argwhere(off)[0].tolist()
        own = f"{COLUMNS[column]} is {table[worst, column]:g} where its disks have"
        raise ValueError(f"{path}: body {bodies.ids[worst]}: {own} {have[worst, column]:g}")
    try:
        return disks.joined(bodies.ids[bodies.number], inertia=table[:, INERTIA])
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _columns(disks: Snapshot, inertia: Floats) -> tuple[Floats, Floats]:
    """The table (b,20) of bodies with moments of inertia (b,) kg m², the same about all axes, and by
    how much a file may be off."""
    bodies = disks.bodies
    assert bodies is not None
    (vx, vy, spin), mass = bodies.motion(disks, disks.velocity).T, bodies.mass
    have, near = np.zeros((2, len(bodies), len(COLUMNS)))
    have[:, [0, 1, 2, 3]] = np.column_stack([bodies.ids, mass, bodies.centre])
    have[:, [5, 6, 7, 11, 12, 16]] = np.column_stack([*[inertia] * 3, vx, vy, inertia * spin])
    near[:, 1], near[:, [2, 3, 11, 12]] = SAME * mass, SAME_M
    near[:, [5, 6, 7, 16]] = np.abs(inertia)[:, None] * [SAME, SAME, SAME, SAME_M]
    return have, near


@lru_cache(maxsize=4)
def people_of(disks: Snapshot) -> tuple[Snapshot, Indices]:
    """Give people as one disk each, and whose (n,) each disk is: of a body of several its centre, motion
    and mass, the id of its first disk, and the radius of a circle as long as its outline."""
    if (of := disks.compound) is None:
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
