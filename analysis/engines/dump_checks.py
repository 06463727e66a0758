"""Whether what an engine wrote can be right, whatever its exit status says."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from analysis.dumps import DumpError, index_contacts, index_dump
from analysis.engines.guard import (
    CENTRES_SHARE,
    ENERGY_SHARE,
    RunStoppedError,
    elastic_energy,
    energy_besides,
    garbage,
)
from analysis.engines.record import RunRecord
from analysis.scene.scene import Scene
from nscd.arrays import Floats

NEEDED = ("id", "x", "y", "radius", "mass", "vx", "vy", "omegaz")


def check_bodies(path: Path, record: RunRecord, scene: Scene) -> Floats:
    """Read the whole body dump; return (2, frames) J: the kinetic energy of each frame, ½ Σ m u² +
    ½ Σ I ω², and the work of the body force until then, Σ m g·(x − x₀).

    Raises RunStoppedError naming the time of the first frame that cannot be right: disks that are
    missing or not those of the scene, values that are not finite, frames that are missing, the last
    step included."""
    energies = []
    order = np.argsort(scene.snapshot.ids)
    position, mass = scene.snapshot.position[order], scene.snapshot.mass[order]
    weight = mass[:, None] * np.array(scene.acceleration())
    try:
        index = index_dump(path)
        if missing := [name for name in NEEDED if name not in index.columns]:
            raise DumpError(f"{path}: missing columns: {', '.join(missing)}")
        columns = [index.columns.index(name) for name in NEEDED]
        for frame, (step, count) in enumerate(zip(index.steps, index.counts, strict=True)):
            if count != record.disks:
                lost = f"{record.disks - count} of {record.disks} disks are lost"
                raise garbage(record, lost, step, "lost")
            table = index.table(frame)
            if not np.isfinite(table).all():
                bad = index.columns[int(np.argmin(np.isfinite(table).all(0)))]
                raise garbage(record, f"not a finite number in column {bad}", step, "finite")
            row = dict(zip(NEEDED, table[:, columns].T, strict=True))
            if other := _not_of(scene, row, start=frame == 0):
                raise garbage(record, f"{other}: not those of the scene's disks", step)
            turning = 0.5 * (row["radius"] * row["omegaz"]) ** 2
            kinetic = 0.5 * float(mass @ (row["vx"] ** 2 + row["vy"] ** 2 + turning))
            moved = np.column_stack([row["x"], row["y"]]) - position
            energies.append((kinetic, float((weight * moved).sum())))
    except (DumpError, ValueError) as error:
        raise damaged(record, error, path.parent) from None
    expected = tuple(range(0, record.steps + 1, record.frame_interval))
    if index.steps != expected:
        raise garbage(record, f"{len(index.steps)} frames where {len(expected)} are due")
    return np.array(energies).T


def _not_of(scene: Scene, row: Mapping[str, Floats], *, start: bool) -> str:
    """The column in which the disks of a frame, sorted by id, are not the scene's; empty if none.
    Positions count at the start."""
    snapshot = scene.snapshot
    x, y = snapshot.position.T
    own = {"id": snapshot.ids, "radius": snapshot.radius, "mass": snapshot.mass}
    own |= {"x": x, "y": y} if start else {}
    order = np.argsort(snapshot.ids)
    same = (name for name in own if not np.allclose(row[name], own[name][order], 1e-9, 1e-9))
    return next(same, "")


def check_contacts(path: Path, energies: Floats, record: RunRecord, scene: Scene) -> float:
    """Read the whole contact dump; return the largest overlap of its frames as a share of the
    smaller radius. Raise RunStoppedError naming the time of the first frame that cannot be right.

    Overlap: two centres nearer than half the smallest radius. Energy: E = K + V − W with the kinetic energy K and
    the work W of the body force of each frame, energies (2, frames) J, and V = Σ ½ k δ² (hertz ⅖ K
    √R δ^2.5). Without drive E never grows; with drive K stays below max(E at the start, ½ M (U + g
    τ)²) and the largest V so far (docs/results/guard.md)."""
    snapshot, drive = scene.snapshot, scene.drive
    start = 0.5 * float(snapshot.mass @ (snapshot.velocity**2).sum(1)) + energy_besides(scene)
    desired = 0.0
    if drive:
        speed = drive.speed_m_per_s + np.hypot(*scene.acceleration()) * drive.relaxation_time_s
        desired = 0.5 * float(snapshot.mass.sum() * speed**2)
    margin = ENERGY_SHARE * (start + desired) + 1e-12
    # a tangential spring holds energy that is not in V and comes back
    keeps_all = not drive and scene.contact.friction == 0
    most, stored, deepest = max(start, desired), 0.0, 0.0
    nearest = CENTRES_SHARE * float(snapshot.radius.min())
    try:
        index = index_contacts(path)
        if len(index.steps) != len(energies[0]):
            raise garbage(
                record, f"{len(index.steps)} frames of contacts for {len(energies[0])} of bodies"
            )
        for frame, step in enumerate(index.steps):
            rows = index.table(frame)
            ids = np.where(rows[:, 2:3] > 0, rows[:, :1], rows[:, :2])
            if not np.isin(ids, snapshot.ids).all():
                raise garbage(record, "a contact of a disk that is not there", step)
            apart, overlap, elastic = _stored(rows, scene) if len(rows) else (np.inf, 0.0, 0.0)
            if not apart >= nearest:
                deep = f"overlap: two centres are {apart:.3g} m apart"
                raise garbage(record, deep, step, "overlap")
            deepest = max(deepest, overlap)
            kinetic, fallen = map(float, energies[:, frame])
            energy = kinetic + (0.0 if drive else elastic - fallen)
            stored = max(stored, elastic)
            most_now = most + stored if drive else most
            if energy > most_now + margin + ENERGY_SHARE * abs(fallen):
                what = "kinetic energy" if drive else "kinetic energy with that of the overlaps"
                grown = f"{what} {energy:.4g} J; there can be {most_now:.4g} J"
                raise garbage(record, grown, step, "energy")
            if keeps_all:
                most = min(most, energy)
    except DumpError as error:
        raise damaged(record, error, path.parent) from None
    return deepest


def damaged(record: RunRecord, error: ValueError, folder: Path) -> RunStoppedError:
    """Return the end of a run whose dumps in the folder cannot be read; the folder is not named,
    since it will be gone."""
    return garbage(record, str(error).replace(f"{folder}/", ""))


def _stored(rows: Floats, scene: Scene) -> tuple[float, float, float]:
    """The smallest distance of two centres (m), the largest overlap as a share of the smaller
    radius, and the energy of all overlaps (J)."""
    ids, radius = scene.snapshot.ids, scene.snapshot.radius
    order = np.argsort(ids)
    wall, overlap = rows[:, 2] > 0, rows[:, 5]
    first = radius[order[np.searchsorted(ids[order], rows[:, 0])]]
    other = radius[order[np.searchsorted(ids[order], np.where(wall, rows[:, 0], rows[:, 1]))]]
    # against a wall the effective radius is the disk's own
    effective = np.where(wall, first, first * other / (first + other))
    energy = float(elastic_energy(scene, overlap, effective, wall).sum())
    apart = np.where(wall, np.inf, first + other - overlap)
    return float(apart.min()), float((overlap / np.minimum(first, other)).max()), energy
