"""Whether what an engine wrote can be right: the disks of its frames, its contacts, its energies."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from analysis.dumps import DumpError, index_contacts, index_dump
from analysis.engines import guard
from analysis.engines.record import RunRecord
from analysis.scene.scene import Scene
from nscd.arrays import Floats

NEEDED = ("id", "x", "y", "radius", "mass", "vx", "vy", "omegaz")


def check_bodies(path: Path, record: RunRecord, scene: Scene) -> Floats:
    """Read the whole body dump; return (3, frames) J: the kinetic energies of each frame, ½ Σ m u² of
    who moves and ½ Σ I ω², and the work of the body force until then, Σ m g·(x − x₀).

    Raises RunStoppedError naming the time of the first frame that cannot be right: disks that are
    missing or not those of the scene, values that are not finite, frames that are missing, the last
    step included."""
    energies = []
    order = np.argsort(scene.snapshot.ids)
    position, mass = scene.snapshot.position[order], scene.snapshot.mass[order]
    bodies, weight = scene.snapshot.bodies, mass[:, None] * np.array(scene.acceleration())
    of = np.arange(len(mass)) if bodies is None else bodies.number[order]
    inertia = guard.turning_inertia(scene.snapshot)[order]
    walls, before, moved = scene.wall_segments(), position, np.zeros_like(position)
    try:
        index = index_dump(path)
        if missing := [name for name in NEEDED if name not in index.columns]:
            raise DumpError(f"{path}: missing columns: {', '.join(missing)}")
        columns = [index.columns.index(name) for name in NEEDED]
        for frame, (step, count) in enumerate(zip(index.steps, index.counts, strict=True)):
            if count != record.disks:
                lost = f"{record.disks - count} of {record.disks} disks are lost"
                raise guard.garbage(record, lost, step, "lost")
            table = index.table(frame)
            if not np.isfinite(table).all():
                bad = index.columns[int(np.argmin(np.isfinite(table).all(0)))]
                raise guard.garbage(record, f"not a finite number in column {bad}", step, "finite")
            row = dict(zip(NEEDED, table[:, columns].T, strict=True))
            if other := _not_of(scene, row, start=frame == 0):
                raise guard.garbage(record, f"{other}: not those of the scene's disks", step)
            centres = sum(np.bincount(of, mass * row[v]) ** 2 for v in ("vx", "vy"))
            moving = 0.5 * float((centres / np.bincount(of, mass)).sum())
            every = mass @ (row["vx"] ** 2 + row["vy"] ** 2) + inertia @ row["omegaz"] ** 2
            spinning = 0.5 * float(every) - moving
            location = np.column_stack([row["x"], row["y"]])
            moved = moved + walls.shortest(location - before)
            before = location
            energies.append((moving, spinning, float((weight * moved).sum())))
    except (DumpError, ValueError) as error:
        raise damaged(record, error, path.parent) from None
    expected = tuple(range(0, record.steps + 1, record.frame_interval))
    if index.steps != expected:
        raise guard.garbage(record, f"{len(index.steps)} frames where {len(expected)} are due")
    return np.array(energies).T


def _not_of(scene: Scene, row: Mapping[str, Floats], *, start: bool) -> str:
    """The column in which the disks of a frame, sorted by id, are not the scene's; empty if none.
    Positions count at the start."""
    snapshot = scene.snapshot
    x, y = snapshot.position.T
    own = {"id": snapshot.ids, "radius": snapshot.radius, "mass": snapshot.mass}
    own |= {"x": x, "y": y} if start else {}
    order = np.argsort(snapshot.ids)
    for name, values in own.items():
        if (np.abs(row[name] - values[order]) > 1e-9 * (1 + np.abs(values[order]))).any():
            return name
    return ""


def check_contacts(path: Path, energies: Floats, record: RunRecord, scene: Scene) -> float:
    """Read the whole contact dump; return the largest overlap of its frames as a share of the
    smaller radius. Raise RunStoppedError naming the time of the first frame that cannot be right.

    Overlap: two centres nearer than half the smallest radius. Energy: E = K + S + V − W with the kinetic
    energies K of centres and S of spins and the work W of the body force of each frame, energies
    (3, frames) J, and V = Σ ½ k δ² (hertz ⅖ K √R δ^2.5). Without drive E never grows by more than a
    body force gives in a step; with drive K less the largest S so far, and S/2, stay below max(E at the
    start, ½ M (U + g τ)²) and the largest V so far (docs/results/guard.md)."""
    snapshot, drive = scene.snapshot, scene.drive
    start = 0.5 * float(snapshot.mass @ (snapshot.velocity**2).sum(1)) + guard.energy_besides(scene)
    falls_s = drive.relaxation_time_s if drive else record.time_step_s
    speed = np.hypot(*scene.acceleration()) * falls_s + (drive.fastest if drive else 0.0)
    desired = 0.5 * float(snapshot.mass.sum() * speed**2)
    margin = guard.ENERGY_SHARE * (start + desired) + 1e-12
    # a tangential spring holds energy that is not in V and comes back
    keeps_all = not drive and scene.contact.friction == 0 and not scene.giving()
    # the rigid engine writes gaps of the last step in which arms pushed, not of the frame
    late = scene.contact.arms is not None and record.stiffness_N_per_m is None
    maximum, stored, turned, deepest = max(start, desired), 0.0, 0.0, 0.0
    nearest = guard.CENTRES_SHARE * float(snapshot.radius.min())
    try:
        index = index_contacts(path)
        if len(index.steps) != len(energies[0]):
            raise guard.garbage(record, f"{len(index.steps)} frames of contacts for {len(energies[0])} of bodies")
        for frame, step in enumerate(index.steps):
            rows = index.table(frame)
            ids = np.where(rows[:, 2:3] > 0, rows[:, :1], rows[:, :2])
            if not np.isin(ids, snapshot.ids).all():
                raise guard.garbage(record, "a contact of a disk that is not there", step)
            difference, overlap, elastic = _stored(rows, scene) if len(rows) else (np.inf, 0.0, 0.0)
            if not difference >= nearest:
                deep = f"overlap: two centres are {difference:.3g} m apart"
                raise guard.garbage(record, deep, step, "overlap")
            deepest = max(deepest, overlap)
            moving, spinning, fallen = map(float, energies[:, frame])
            energy = moving + spinning + elastic * (not late) - fallen
            turned, stored = max(turned, spinning), max(stored, elastic)
            energy = max(moving - turned, 0.5 * spinning) if drive else energy
            most_now = maximum + stored if drive else maximum
            if energy > most_now + margin + guard.ENERGY_SHARE * abs(fallen):
                what = "kinetic energy" if drive else "kinetic energy with that of the overlaps"
                grown = f"{what} {energy:.4g} J where at most {most_now:.4g} J can be"
                raise guard.garbage(record, grown, step, "energy")
            if keeps_all and not late:
                maximum = min(maximum, energy)
    except DumpError as error:
        raise damaged(record, error, path.parent) from None
    return deepest


def damaged(record: RunRecord, error: ValueError, folder: Path) -> guard.RunStoppedError:
    """Return the end of a run whose dumps in the folder cannot be read; the folder is not named,
    since it will be gone."""
    return guard.garbage(record, str(error).replace(f"{folder}/", ""))


def _stored(rows: Floats, scene: Scene) -> tuple[float, float, float]:
    """The smallest distance of two centres (m), the largest overlap as a share of the smaller
    radius, and the energy of all overlaps and arms (J)."""
    ids, radius = scene.snapshot.ids, scene.snapshot.radius
    order = np.argsort(ids)
    wall, overlap = rows[:, 2] > 0, rows[:, 5]
    first = radius[order[np.searchsorted(ids[order], rows[:, 0])]]
    other = radius[order[np.searchsorted(ids[order], np.where(wall, rows[:, 0], rows[:, 1]))]]
    elastic = scene.contact.elastic(float(radius.mean()))
    energy = float(elastic.energy(overlap, guard.effective_radius(first, other, wall), wall).sum())
    if scene.contact.arms:
        energy += float(scene.contact.arms.energy(-overlap).sum())
    difference = np.where(wall, np.inf, first + other - overlap)
    return float(difference.min()), float((overlap / np.minimum(first, other)).max()), energy
