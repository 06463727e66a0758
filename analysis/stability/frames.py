"""What an engine's dumps hold, measured without asking the engine: energy, momentum, overlap,
disks."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from analysis.dumps import DumpError, index_dump
from analysis.scene.scene import Scene
from analysis.stability.trial import Edit, Trial, try_engine
from nscd import Snapshot, find_contacts
from nscd.arrays import Floats

COLUMNS = ("id", "x", "y", "vx", "vy", "omegaz")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Frames:
    """Frames of a trial that can be read (f of them).

    trial: the run.
    time: (f,) s.
    position, velocity: (f,n,2) m, m/s.
    spin: (f,n) rad/s.
    kinetic, elastic: (f,) J, ½mu² and Σ½k·overlap² of the linear law, from the positions.
    overlap: (f,) the largest over the smaller radius.
    drift: the largest change of Σmu over the largest Σm|u|; NaN where walls or a drive act.
    disks: how many the last frame has.
    lost: whether disks are gone from the dump, or nowhere.
    trouble: why later frames are not here, "" if all are."""

    trial: Trial
    time: Floats
    position: Floats
    velocity: Floats
    spin: Floats
    kinetic: Floats
    elastic: Floats
    overlap: Floats
    drift: float
    disks: int
    lost: bool
    trouble: str

    @property
    def energy(self) -> Floats:
        """Kinetic and elastic energy (f,) J."""
        total: Floats = self.kinetic + self.elastic
        return total

    @property
    def gain(self) -> float:
        """Largest energy of a frame over that of the first; NaN without frames."""
        if not len(self.time) or not self.energy[0] > 0:
            return float("nan")
        return float(np.nanmax(self.energy) / self.energy[0])


class _Frame(NamedTuple):
    time: float
    table: Floats
    kinetic: float
    elastic: float
    overlap: float


def run_frames(scene: Scene, engine: str, folder: Path, edits: Sequence[Edit] = ()) -> Frames:
    """Run a scene as `try_engine` does, and read what bodies.dump holds, as far as it can be read
    and is finite."""
    trial = try_engine(scene, engine, folder, edits)
    n = len(scene.snapshot)
    found: list[_Frame] = []
    disks, lost, trouble = n, False, ""
    try:
        index = index_dump(trial.folder / "bodies.dump")
        columns = [index.columns.index(name) for name in COLUMNS]
        for frame, (step, count) in enumerate(zip(index.steps, index.counts, strict=True)):
            time, disks = step * trial.time_step_s, count
            if count != n:
                lost, trouble = True, f"{n - count} of {n} disks are gone at t = {time:.3g} s"
                break
            table = index.table(frame)[:, columns]
            if not np.isfinite(table).all():
                disks = int(np.isfinite(table).all(1).sum())
                lost, trouble = True, f"not a finite number at t = {time:.3g} s"
                break
            table = table[np.argsort(table[:, 0], kind="stable")]
            found.append(_Frame(time, table, *_measure(scene, table[:, 1:3], table[:, 3:5])))
        if not trouble and index.steps[-1] < trial.steps:
            trouble = f"ended at step {index.steps[-1]} of {trial.steps}"
    except DumpError as error:
        trouble = str(error).replace(str(trial.folder), "").lstrip("/")
    tables = np.array([frame.table for frame in found]).reshape(-1, n, len(COLUMNS))
    velocity = tables[:, :, 3:5]
    return Frames(
        trial=trial,
        time=np.array([frame.time for frame in found]),
        position=tables[:, :, 1:3],
        velocity=velocity,
        spin=tables[:, :, 5],
        kinetic=np.array([frame.kinetic for frame in found]),
        elastic=np.array([frame.elastic for frame in found]),
        overlap=np.array([frame.overlap for frame in found]),
        drift=float("nan") if scene.walls or scene.drive else _drift(scene.snapshot.mass, velocity),
        disks=disks,
        lost=lost,
        trouble=trouble,
    )


def _drift(mass: Floats, velocity: Floats) -> float:
    """Largest |Σmu(t) − Σmu(0)| over the largest Σm|u|, of velocities (f,n,2) m/s; 0 where nothing
    moves."""
    momentum = (mass[:, None] * velocity).sum(1)
    size = (mass * np.hypot(velocity[..., 0], velocity[..., 1])).sum(1).max(initial=0.0)
    change = float(np.abs(momentum - momentum[:1]).max(initial=0.0))
    return change / float(size) if size else 0.0


def _measure(scene: Scene, position: Floats, velocity: Floats) -> tuple[float, float, float]:
    """Kinetic and elastic energy (J), largest overlap over the smaller radius."""
    start = scene.snapshot
    kinetic = 0.5 * float(start.mass @ (velocity**2).sum(1))
    snapshot = Snapshot(position=position, velocity=velocity, radius=start.radius, mass=start.mass)
    try:
        contacts = find_contacts(snapshot, scene.wall_segments(), tolerance=0.0)
    except ValueError:
        # two centres, or a centre and a wall, coincide
        return kinetic, float("nan"), 2.0
    elastic = 0.5 * scene.contact.stiffness_N_per_m * float((contacts.gap**2).sum())
    smaller = start.radius[contacts.first].copy()
    pairs = ~contacts.is_wall
    smaller[pairs] = np.minimum(smaller[pairs], start.radius[contacts.second[pairs]])
    return kinetic, elastic, float((-contacts.gap / smaller).max(initial=0.0))
