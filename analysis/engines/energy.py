"""The energy of a run: what the drive put in, where it was lost, and what does not add up.

    K + V − K₀ − V₀ = W_drive + W_weight − lost in impacts − lost in friction + error

The rigid engine sums each step as it is made (`nscd.stepping.motion.StepEnergy`), which leaves rounding. Of
engines with springs the dumps are read, by the trapezoidal rule, which leaves O(h²): only where
each step is a frame."""

import itertools
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from analysis.dumps import contacts_at, index_contacts, open_bodies, snapshot_of
from analysis.dumps.contacts import EngineContacts, keys_of
from analysis.engines.guard import effective_radius, turning_inertia
from analysis.engines.penalty import penalty_of
from analysis.engines.record import RunRecord
from analysis.scene.scene import Scene
from analysis.support.columns import Columns
from analysis.support.write_frames import write_frame
from nscd import Snapshot, _core
from nscd.arrays import Floats, Indices
from nscd.stepping.arms import Neighbours
from nscd.stepping.motion import StepEnergy

CSV, DUMP = "energy.csv", "energy.dump"
ENERGY = Columns("energy")
CONTACTS = Columns("losses")


def kinetic(now: Snapshot) -> float:
    """Compute ½ Σ m u² + ½ Σ I ω² (J)."""
    turning = turning_inertia(now) @ now.spin**2
    return 0.5 * float(now.mass @ (now.velocity**2).sum(1) + turning)


class Losses(NamedTuple):
    """Hold what contacts lose, along the normal and across (k,) J. keys: (k,), of the first, the second
    and whether it is a wall."""

    keys: Indices
    impact: Floats
    friction: Floats


def of_step(now: Snapshot, neighbours: Neighbours, energy: StepEnergy) -> Losses:
    """Name the contacts of a rigid step as dumps do, the smaller id first; those that lost."""
    some = np.flatnonzero((energy.impact != 0) | (energy.friction != 0))
    first, second, wall = neighbours.first[some], neighbours.second[some], neighbours.second[some] < 0
    one, other = now.ids[first], np.where(wall, neighbours.wall[some] + 1, now.ids[second])
    swapped = ~wall & (one > other)
    keys = keys_of(np.where(swapped, other, one), np.where(swapped, one, other), wall)
    return Losses(keys, energy.impact[some], energy.friction[some])


class Account:
    """Sum the energies of steps from frame to frame, and write them: `table` is the CSV, `dump` the
    contacts."""

    def __init__(self, table: IO[str], dump: IO[str], energy_before: float | None = None) -> None:
        """energy_before: J, kinetic and stored, of a frame that was written; its headers are there too."""
        self.table, self.dump, self.energy_before = table, dump, energy_before
        self._begin()
        if energy_before is None:
            self.table.write(",".join(ENERGY) + "\n")

    def _begin(self) -> None:
        self.drive = self.weight = 0.0
        self.parts = [Losses(np.empty(0, np.int64), np.empty(0), np.empty(0))]

    def add(self, drive: float, weight: float, losses: Losses) -> None:
        """Add the works (J) and losses of a step."""
        self.drive, self.weight = self.drive + drive, self.weight + weight
        self.parts.append(losses)

    def write(self, step: int, time: float, moving: float, stored: float) -> None:
        """Write the frame that ends now, with its kinetic and stored energy (J)."""
        keys, *lost = map(np.concatenate, zip(*self.parts, strict=True))
        once, index = np.unique(keys, return_inverse=True)
        impact, friction = (np.bincount(index, part, len(once)) for part in lost)
        energy = self.energy_before if self.energy_before is not None else moving + stored
        gained = impact.sum() + friction.sum() - self.drive - self.weight
        self.energy_before = moving + stored
        row = (time, moving, stored, self.drive, self.weight, impact.sum(), friction.sum())
        numbers = np.array([[*row, self.energy_before - energy + gained]])
        self.table.write(_core.table([*numbers.T.copy()], csv=True).decode())
        self.table.flush()
        pairs = [(once >> 31) & (2**31 - 1), once & (2**31 - 1), once >> 62]
        write_frame(self.dump, "ENTRIES", step, CONTACTS, [*pairs, impact, friction])
        self._begin()


def write_energy(scene: Scene, folder: Path, record: RunRecord) -> None:
    """Write the energy of a run of an engine with springs, each step of which is a frame; nothing of
    others, and of walls that give. Raises DumpError for dumps that cannot be read."""
    if record.frame_interval != 1 or scene.giving():
        return
    h, index = record.time_step_s, index_contacts(folder / "contacts.dump")
    frames: Any = open_bodies(folder / "bodies.dump", h).trajectory
    every = (
        _frame(scene, snapshot_of(frames[number]), contacts_at(index, number))
        for number in range(len(frames))
    )
    with (folder / CSV).open("w") as table, (folder / DUMP).open("w") as dump:
        account = Account(table, dump)
        first = next(every)
        account.write(0, 0.0, kinetic(first.now), first.stored.sum())
        for step, (one, other) in enumerate(itertools.pairwise(itertools.chain([first], every)), 1):
            account.add(*_between(scene, one, other, h))
            account.write(step, step * h, kinetic(other.now), other.stored.sum())


class _Frame(NamedTuple):
    """A frame of a run: (k,) forces (N) on the second along the normal, of the springs alone, and
    across; what is stored (J), and across."""

    now: Snapshot
    keys: Indices
    near: Neighbours
    along: Floats
    spring: Floats
    across: Floats
    stored: Floats
    stored_across: Floats


def _frame(scene: Scene, now: Snapshot, found: EngineContacts) -> _Frame:
    first = np.searchsorted(now.ids, found.first).astype(np.int32)
    second = np.where(found.is_wall, -1, np.searchsorted(now.ids, found.second)).astype(np.int32)
    wall = np.where(found.is_wall, found.second - 1, -1).astype(np.int32)
    neighbours = Neighbours(first, second, wall, found.normal, -found.overlap)
    (n_x, n_y), (x, y) = found.normal.T, found.force.T
    radius, across = now.radius, n_x * y - n_y * x
    effective = effective_radius(radius[first], radius[second], found.is_wall)
    law = found.overlap, effective, found.is_wall
    elastic, arms = scene.contact.elastic(float(radius.mean())), scene.contact.arms
    force, stored = elastic.force(*law), elastic.energy(*law)
    if arms:
        force, stored = force + arms.push(neighbours.gap), stored + arms.energy(neighbours.gap)
    of = penalty_of(scene)
    springs = np.where(found.is_wall, of.wall_tangential_stiffness, of.tangential_stiffness)
    sliding = 0.5 * across**2 / springs if scene.contact.friction else np.zeros(len(across))
    keys = keys_of(found.first, found.second, found.is_wall)
    return _Frame(now, keys, neighbours, n_x * x + n_y * y, force, across, stored + sliding, sliding)


def _between(scene: Scene, one: _Frame, other: _Frame, h: float) -> tuple[float, float, Losses]:
    """The works of the drive and of a body force (J) in a step of h s, and what contacts lost: forces
    times the mean velocity, half of each frame, less what their springs store."""
    before, after = one.now, other.now
    mean = 0.5 * (before.velocity + after.velocity)
    moving = np.column_stack([mean, 0.5 * (before.spin + after.spin)])
    drive = sum(
        0.5 * h * float((now.drive * mean).sum())
        for now in (before, after)
        if now.drive is not None
    )
    weight = h * float((before.mass[:, None] * mean).sum(0) @ np.array(scene.acceleration()))
    parts = []
    for sign, frame in ((1.0, one), (-1.0, other)):
        damping, across = 0.5 * h * (frame.along - frame.spring), 0.5 * h * frame.across
        works = _core.works(*frame.near, frame.now.radius, moving, damping, across)
        parts.append((frame.keys, works.impact, works.friction + sign * frame.stored_across))
    return drive, weight, Losses(*map(np.concatenate, zip(*parts, strict=True)))
