"""The initial state of a scene as a LAMMPS data file (atom_style sphere)."""

import math
from pathlib import Path

import numpy as np

from analysis.support.files import write_text
from analysis.support.reading import NUMBER, lines_of, open_file, whole_number
from nscd import Snapshot
from nscd.arrays import Floats

# read_data takes the density column as a sphere's even in two dimensions, so that is the density
# written here: LAMMPS then gives each disk exactly the mass that is meant.
SPHERE = 4.0 * np.pi / 3.0
MARGIN_M = 200.0
# Columns of a row by section: id, type, diameter, density, x, y, z (and three image flags), and
# id, vx, vy, vz, wx, wy, wz; where disks are joined to bodies, id and body.
WIDTHS = {"Atoms": (7, 10), "Velocities": (7,), "Molecules": (2,)}
SECTIONS = " or ".join(WIDTHS)


def write_data(path: Path, snapshot: Snapshot, title: str, *, by_radius: bool = False) -> None:
    """Write disks as a LAMMPS data file: id, type (1, or by_radius the radius' rank), diameter (m),
    density (kg/m³, of the sphere of that diameter and mass), x, y, z (m); then velocities (m/s,
    rad/s). The box leaves 200 m on each side for people who walk out."""
    types = np.unique(snapshot.radius, return_inverse=True)[1] * by_radius + 1
    low, high = snapshot.position.min(0) - MARGIN_M, snapshot.position.max(0) + MARGIN_M
    half = 2.0 * snapshot.radius.max()
    words = "(SI units, density is that of the sphere, as read_data takes it)"
    lines = [f"{' '.join(title.split())} {words}", "", f"{len(snapshot)} atoms"]
    lines += [f"{types.max()} atom types", ""]
    lines += [f"{low[i]:.1f} {high[i]:.1f} {axis}lo {axis}hi" for i, axis in enumerate("xy")]
    lines += [f"{-half:.3f} {half:.3f} zlo zhi", "", "Atoms # sphere", ""]
    arrays = snapshot.ids, types, snapshot.radius, _density(snapshot), *snapshot.position.T
    ids, *rest = (array.tolist() for array in arrays)
    for i, kind, r, rho, x, y in zip(ids, *rest, strict=True):
        lines.append(f"{i} {kind} {2 * r!r} {rho!r} {x!r} {y!r} 0.0")
    lines += ["", "Velocities", ""]
    for i, (vx, vy), w in zip(ids, snapshot.velocity.tolist(), snapshot.spin.tolist(), strict=True):
        lines.append(f"{i} {vx!r} {vy!r} 0.0 0.0 0.0 {w!r}")
    if snapshot.bodies is not None:
        body = snapshot.bodies.ids[snapshot.bodies.number].tolist()
        lines += ["", "Molecules", ""]
        lines += [f"{i} {number}" for i, number in zip(ids, body, strict=True)]
    write_text(path, "\n".join(lines) + "\n")


def written_mass(snapshot: Snapshot) -> Floats:
    """Compute the masses (n,) kg that come back from a data file, which has densities instead."""
    return _mass(_density(snapshot), snapshot.radius)


def volumes(radius: Floats) -> Floats:
    """Compute the volumes (n,) m³ of spheres; processors round a power differently."""
    return SPHERE * (radius * radius * radius)


def _density(snapshot: Snapshot) -> Floats:
    density: Floats = snapshot.mass / volumes(snapshot.radius)
    return density


def _mass(density: Floats, radius: Floats) -> Floats:
    """To the digits that survive the way to a density and back."""
    with np.errstate(over="ignore"):  # what is not finite is refused by the snapshot
        mass = density * volumes(radius)
    return np.array([float(f"{m:.13g}") for m in mass])


def read_data(path: Path) -> Snapshot:
    """Read disks from a LAMMPS data file that `write_data` (or LAMMPS' write_data, atom_style
    sphere) wrote.

    Raises ValueError naming the file and the line for anything that is not such a file, and for one
    that ends early: positions and velocities of all atoms are needed. Disks are joined to the bodies
    of a section Molecules."""
    rows: dict[str, list[list[float]]] = {section: [] for section in WIDTHS}
    section, count = "", -1
    with open_file(path) as file:
        for number, line in enumerate(lines_of(file, path), start=1):
            where = f"{path}, line {number}"
            text = line.decode("utf-8", "replace").split("#")[0]
            words = text.split()
            if not words or number == 1:
                continue
            if words[0].isalpha():
                section = words[0]
                if section not in rows or rows[section] or len(words) > 1:
                    raise ValueError(f"{where}: {text.strip()[:40]!r} where {SECTIONS} is expected")
            elif section:
                rows[section].append(_numbers_of_row(where, section, words))
                if len(rows[section]) > count:
                    raise ValueError(f"{where}: {section}: more rows than the {count} atoms")
            elif words[1:] == ["atoms"]:
                count = whole_number(words[0], f"{where}: atoms")
    for section, found in rows.items():
        if (len(found) != count or not found) and (found or section != "Molecules"):
            raise ValueError(
                f"{path}: truncated: {section}: {len(found)} rows for {max(count, 0)} atoms"
            )
    snapshot = _snapshot(path, np.array(rows["Atoms"]), np.array(rows["Velocities"]))
    if not rows["Molecules"]:
        return snapshot
    ids, body = np.array(sorted(rows["Molecules"])).T
    if not np.array_equal(ids, snapshot.ids):
        raise ValueError(f"{path}: Molecules: the ids differ from those of Atoms")
    try:
        return snapshot.joined(body)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _numbers_of_row(where: str, section: str, words: list[str]) -> list[float]:
    """The numbers of a row, an id first."""
    if len(words) not in WIDTHS[section]:
        needed = " or ".join(str(width) for width in WIDTHS[section])
        raise ValueError(f"{where}: {section}: {len(words)} columns where {needed} are needed")
    values = [float(whole_number(words[0], f"{where}: id"))]
    for word in words[1:7]:
        if not NUMBER.fullmatch(word):
            raise ValueError(f"{where}: {section}: {word[:40]!r} is not a number")
        values.append(float(word))
        if not math.isfinite(values[-1]):
            raise ValueError(f"{where}: {section}: {word[:40]}: a finite number is needed")
    return values


def _snapshot(path: Path, atoms: Floats, motion: Floats) -> Snapshot:
    """The disks of both tables, in the order of their ids."""
    atoms, motion = (rows[np.argsort(rows[:, 0], kind="stable")] for rows in (atoms, motion))
    if not np.array_equal(motion[:, 0], atoms[:, 0]):
        raise ValueError(f"{path}: Velocities: the ids differ from those of Atoms")
    if np.ptp(atoms[:, 6]) > 0:
        raise ValueError(f"{path}: Atoms: z differs between disks. A crowd is in one plane")
    if motion[:, 3:6].any():
        raise ValueError(f"{path}: Velocities: v_z, ω_x or ω_y is not 0. A crowd is in one plane")
    radius = 0.5 * atoms[:, 2]
    try:
        return Snapshot(
            position=atoms[:, 4:6],
            velocity=motion[:, 1:3],
            radius=radius,
            mass=_mass(atoms[:, 3], radius),
            ids=atoms[:, 0].astype(np.int64),
            spin=motion[:, 6],
        )
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
