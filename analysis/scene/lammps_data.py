"""The initial state of a scene as a LAMMPS data file (atom_style sphere)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.support.files import write_text
from nscd import Snapshot

# read_data takes the density column as a sphere's even in two dimensions, so that is the density
# written here: LAMMPS then gives each disk exactly the mass that is meant.
SPHERE = 4.0 * np.pi / 3.0
MARGIN_M = 200.0


def write_data(path: Path, snapshot: Snapshot, title: str) -> None:
    """Write disks as a LAMMPS data file: id, type 1, diameter (m), density (kg/m³, of the sphere of
    that diameter and mass), x, y, z (m); then velocities (m/s, rad/s). The box leaves 200 m on each
    side for people who walk out."""
    low, high = snapshot.position.min(0) - MARGIN_M, snapshot.position.max(0) + MARGIN_M
    half = 2.0 * snapshot.radius.max()
    lines = [
        f"{title} (SI units; density is that of the sphere, as read_data takes it)",
        "",
        f"{len(snapshot)} atoms",
    ]
    lines += [
        "1 atom types",
        "",
        f"{low[0]:.1f} {high[0]:.1f} xlo xhi",
        f"{low[1]:.1f} {high[1]:.1f} ylo yhi",
    ]
    lines += [f"{-half:.3f} {half:.3f} zlo zhi", "", "Atoms # sphere", ""]
    density = snapshot.mass / (SPHERE * snapshot.radius**3)
    ids = snapshot.ids.tolist()
    for i, r, rho, (x, y) in zip(
        ids, snapshot.radius.tolist(), density.tolist(), snapshot.position.tolist(), strict=True
    ):
        lines.append(f"{i} 1 {2 * r!r} {rho!r} {x!r} {y!r} 0.0")
    lines += ["", "Velocities", ""]
    for i, (vx, vy), w in zip(ids, snapshot.velocity.tolist(), snapshot.spin.tolist(), strict=True):
        lines.append(f"{i} {vx!r} {vy!r} 0.0 0.0 0.0 {w!r}")
    write_text(path, "\n".join(lines) + "\n")


def read_data(path: Path) -> Snapshot:
    """Read disks from a LAMMPS data file that `write_data` (or LAMMPS' write_data, atom_style
    sphere) wrote.

    Raises ValueError naming the file and the line for anything that is not such a file.
    """
    sections: dict[str, list[tuple[int, list[float]]]] = {"Atoms": [], "Velocities": []}
    current = ""
    count = None
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        words = line.split("#")[0].split()
        if not words or number == 1:
            continue
        if words[0] in sections:
            current = words[0]
        elif not current:
            if words[1:] == ["atoms"]:
                count = int(words[0])
        else:
            try:
                sections[current].append((number, [float(word) for word in words]))
            except ValueError:
                raise ValueError(
                    f"{path}, line {number}: not a row of numbers: {line.strip()!r}"
                ) from None
    rows = {name: _table(path, name, entries) for name, entries in sections.items()}
    atoms, velocities = rows["Atoms"], rows["Velocities"]
    if count is None or len(atoms) != count or len(velocities) not in (0, count):
        raise ValueError(
            f"{path}: truncated: {count} atoms announced, {len(atoms)} positions, {len(velocities)} velocities"
        )
    order = np.argsort(atoms[:, 0], kind="stable")
    atoms = atoms[order]
    motion = np.zeros((len(atoms), 7))
    if len(velocities):
        motion = velocities[np.argsort(velocities[:, 0], kind="stable")]
        if not np.array_equal(motion[:, 0], atoms[:, 0]):
            raise ValueError(f"{path}: Velocities: the ids differ from those of Atoms")
    radius = 0.5 * atoms[:, 2]
    mass = np.array([float(f"{m:.13g}") for m in atoms[:, 3] * SPHERE * radius**3])
    try:
        return Snapshot(
            position=atoms[:, 4:6],
            velocity=motion[:, 1:3],
            radius=radius,
            mass=mass,
            ids=atoms[:, 0].astype(np.int64),
            spin=motion[:, 6],
        )
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _table(
    path: Path, name: str, entries: list[tuple[int, list[float]]]
) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    width = 7
    for number, values in entries:
        if len(values) < width:
            raise ValueError(
                f"{path}, line {number}: {name}: {len(values)} columns where {width} are needed"
            )
    return np.array([values[:width] for _, values in entries]).reshape(-1, width)
