"""Penalty against rigid, like with like: the same snapshot, contact by contact, disk by disk, wall
by wall."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.dumps.impulses import integrate_contacts
from analysis.dumps.reader import (
    DumpError,
    EngineContacts,
    contacts_at,
    frame_at,
    index_contacts,
    open_bodies,
    snapshot_of,
)
from analysis.engines.record import RunRecord
from analysis.percussions.snapshot import percussions_of
from analysis.scene.scene import Scene, read_scene
from nscd import Contacts, Percussions, Snapshot
from nscd.arrays import Flags, Floats, Indices
from nscd.contacts import sum_at_disks
from nscd.indeterminacy.determinacy import admissible_determinacy, determinacy

FORCE, IMPULSE = "N", "N·s"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Comparison:
    """One run of an engine against the percussions of its own snapshot.

    unit: "N" (driven: contact force against p/τ) or "N·s" (impact: ∫f dt over the run against p).
    Contacts are the union of both models', matched by ids: first, second (k,) ids (second: number
    of the wall from 1 where is_wall), normal (k,2), gap (k,) m; penalty, rigid (k,2): what the
    first body gives to the second; in_penalty, in_rigid: which model has the contact (force 0 in
    the other); determined: the balance of the disks and that no contact pulls fix its rigid force
    (determined_by_balance: for how many the balance alone does). contacts, answer: the rigid
    problem's contacts and its percussions with their certificate; window: τ (s), None for an
    impact; rank, redundant: of the rigid contact problem. drive_sum, wall_sum, rigid_wall_sum,
    net_sum (2,): Σ drive, Σ penalty force on the walls, the same of the rigid model, and Σ m a of
    the engine (N); for an impact Σ m Δu in place of the drive, and net_sum 0. closure_error: how
    far the engine's own balance is from closing: |Σ drive − Σ wall − Σ m a| / |Σ drive|, or the
    largest error of a disk's momentum change rebuilt from ∫f dt; unbalanced: |Σ m a| / |Σ drive|, 0
    at rest."""

    scene: Scene
    record: RunRecord
    time: float
    unit: str
    snapshot: Snapshot
    first: Indices
    second: Indices
    is_wall: Flags
    normal: Floats
    gap: Floats
    penalty: Floats
    rigid: Floats
    in_penalty: Flags
    in_rigid: Flags
    determined: Flags
    contacts: Contacts
    answer: Percussions
    window: float | None
    rank: int
    redundant: int
    determined_by_balance: int
    drive_sum: Floats
    wall_sum: Floats
    rigid_wall_sum: Floats
    net_sum: Floats
    closure_error: float
    unbalanced: float

    def normal_parts(self) -> tuple[Floats, Floats]:
        """Normal components of penalty and rigid, each (k,), positive where they push."""
        return (self.penalty * self.normal).sum(1), (self.rigid * self.normal).sum(1)

    def disk_sums(self) -> tuple[Floats, Floats]:
        """Sum of the normal magnitudes at each disk, penalty and rigid, each (n,): what it
        carries."""
        a, b = self._disks()
        second, n = np.where(self.is_wall, -1, b), len(self.snapshot)
        penalty, rigid = (np.abs(part) for part in self.normal_parts())
        return (
            sum_at_disks(a, second, penalty, penalty, n),
            sum_at_disks(a, second, rigid, rigid, n),
        )

    def disk_vectors(self) -> tuple[Floats, Floats]:
        """Vector sum of what each disk receives, penalty and rigid, each (n,2)."""
        a, b = self._disks()
        second, n = np.where(self.is_wall, -1, b), len(self.snapshot)
        return (
            sum_at_disks(a, second, -self.penalty, self.penalty, n),
            sum_at_disks(a, second, -self.rigid, self.rigid, n),
        )

    def wall_loads(self) -> list[tuple[str, float, float]]:
        """For each wall its name and load (sum of normal components), penalty and rigid."""
        penalty, rigid = self.normal_parts()
        loads = []
        for number, wall in enumerate(self.scene.walls, start=1):
            on = self.is_wall & (self.second == number)
            loads.append((wall.name, float(penalty[on].sum()), float(rigid[on].sum())))
        return loads

    def _disks(self) -> tuple[Indices, Indices]:
        a = np.searchsorted(self.snapshot.ids, self.first)
        b = np.searchsorted(
            self.snapshot.ids, np.where(self.is_wall, self.snapshot.ids[0], self.second)
        )
        return a, b


def compare_run(folder: Path, time: float | None = None, tolerance: float = 1e-10) -> Comparison:
    """Compare a finished run with the percussions of its snapshot at `time` (s; that of the scene
    by default).

    Raises DumpError for damaged dumps, SceneError for the scene, and DumpError where neither model
    has a contact."""
    scene, record = read_scene(folder / "scene.toml"), RunRecord.read(folder)
    universe = open_bodies(folder / "bodies.dump", record.time_step_s)
    trajectory = universe.trajectory
    index = index_contacts(folder / "contacts.dump")
    impact = scene.analysis.kind == "impact"
    wanted = (0.0 if impact else scene.analysis.time_s) if time is None else time
    frame = frame_at(np.array(index.steps) * record.time_step_s, wanted)
    snapshot = snapshot_of(
        trajectory[_same_step(index.steps[frame], trajectory, folder)], folder / "bodies.dump"
    )
    found = percussions_of(scene, snapshot, tolerance=tolerance)
    contacts, window, answer = found.contacts, found.window, found.answer
    net = np.zeros(2)
    closure_error = np.nan
    if impact:
        engine, closure_error, change = integrate_contacts(
            index, trajectory, record.time_step_s, contacts, snapshot
        )
        total = change.sum(0)
    else:
        engine = contacts_at(index, frame)
        total = np.zeros(2) if snapshot.drive is None else snapshot.drive.sum(0)
        data = trajectory.ts.data
        if "fx" in data and "fy" in data:
            net = np.array([data["fx"].sum(), data["fy"].sum()])
            rest = total - engine.force[engine.is_wall].sum(0) - net
            closure_error = float(np.hypot(*rest)) / (float(np.hypot(*total)) or 1.0)
    return _matched(
        scene, record, snapshot, contacts, answer, engine, window, total, net, closure_error
    )


def _same_step(step: int, trajectory: object, folder: Path) -> int:
    steps = trajectory._index.steps  # type: ignore[attr-defined]
    if step not in steps:
        raise DumpError(f"{folder}: contacts.dump has step {step} and bodies.dump has not")
    return int(steps.index(step))


def _matched(
    scene: Scene,
    record: RunRecord,
    snapshot: Snapshot,
    contacts: Contacts,
    answer: Percussions,
    engine: EngineContacts,
    window: float | None,
    total: Floats,
    net: Floats,
    closure_error: float,
) -> Comparison:
    ids = snapshot.ids
    second = np.where(
        contacts.is_wall, contacts.second + 1, ids[np.where(contacts.is_wall, 0, contacts.second)]
    )
    rigid_key = _key(ids[contacts.first], second, contacts.is_wall)
    engine_key = _key(engine.first, engine.second, engine.is_wall)
    keys = np.union1d(rigid_key, engine_key)
    if not len(keys):
        raise DumpError(
            f"scene {scene.name}, {record.engine}: no contact at all at {snapshot.time:g} s; nothing to compare"
        )
    at_rigid, at_engine = np.searchsorted(keys, rigid_key), np.searchsorted(keys, engine_key)
    k = len(keys)
    normal, gap, penalty, rigid = np.zeros((k, 2)), np.zeros(k), np.zeros((k, 2)), np.zeros((k, 2))
    normal[at_engine], gap[at_engine], penalty[at_engine] = (
        engine.normal,
        -engine.overlap,
        engine.force,
    )
    normal[at_rigid], gap[at_rigid], rigid[at_rigid] = (
        contacts.normal,
        contacts.gap,
        answer.impulse / (window or 1.0),
    )
    in_penalty, in_rigid, determined = (np.zeros(k, dtype=bool) for _ in range(3))
    in_penalty[at_engine] = True
    in_rigid[at_rigid] = True
    known = determinacy(contacts, len(snapshot))
    sharper = known if answer.status == "failed" else admissible_determinacy(contacts, answer)
    determined[at_rigid] = sharper.determined
    is_wall = (keys & 1).astype(bool)
    return Comparison(
        scene=scene,
        record=record,
        time=snapshot.time,
        unit=IMPULSE if window is None else FORCE,
        snapshot=snapshot,
        first=keys >> 32,
        second=(keys >> 1) & 0x7FFFFFFF,
        is_wall=is_wall,
        normal=normal,
        gap=gap,
        penalty=penalty,
        rigid=rigid,
        in_penalty=in_penalty,
        in_rigid=in_rigid,
        determined=determined,
        contacts=contacts,
        answer=answer,
        window=window,
        rank=known.rank,
        redundant=known.redundant,
        determined_by_balance=int(known.determined.sum()),
        drive_sum=total,
        wall_sum=penalty[is_wall].sum(0),
        rigid_wall_sum=rigid[is_wall].sum(0),
        net_sum=net,
        closure_error=closure_error,
        unbalanced=float(np.hypot(*net)) / (float(np.hypot(*total)) or 1.0),
    )


def _key(first: Indices, second: Indices, is_wall: Flags) -> Indices:
    """One integer a contact: first · 2³² + second · 2 + is_wall; sorts by first, then second."""
    key: Indices = (first << 32) | (second << 1) | is_wall
    return key


def statistics(comparison: Comparison) -> dict[str, float | int]:
    """Numbers of a comparison: counts, correlation and relative difference per contact, per
    determined contact and per disk; units in the names (N or N·s is the comparison's unit).
    Relative difference: rms(rigid − penalty) / rms(penalty), of normal components; correlation:
    Pearson's, NaN where it has no meaning."""
    penalty, rigid = comparison.normal_parts()
    both = comparison.in_penalty & comparison.in_rigid
    fixed = both & comparison.determined
    penalty_sum, rigid_sum = comparison.disk_sums()
    penalty_vector, rigid_vector = comparison.disk_vectors()
    out: dict[str, float | int] = {
        "contacts_both": int(both.sum()),
        "contacts_only_penalty": int((comparison.in_penalty & ~comparison.in_rigid).sum()),
        "contacts_only_rigid": int((~comparison.in_penalty & comparison.in_rigid).sum()),
        "rigid_contacts": int(comparison.in_rigid.sum()),
        "rank": comparison.rank,
        "redundant": comparison.redundant,
        "determined_contacts": int(comparison.determined.sum()),
        "determined_by_balance_alone": comparison.determined_by_balance,
        "penalty_mean": float(penalty[comparison.in_penalty].mean())
        if comparison.in_penalty.any()
        else 0.0,
        "rigid_mean": float(rigid[comparison.in_rigid].mean())
        if comparison.in_rigid.any()
        else 0.0,
        "penalty_max": float(penalty.max()),
        "rigid_max": float(rigid.max()),
    }
    parts = {
        "contact": (penalty, rigid),
        "determined": (penalty[fixed], rigid[fixed]),
        "disk_sum": (penalty_sum, rigid_sum),
        "disk_vector": (penalty_vector.ravel(), rigid_vector.ravel()),
    }
    for name, (a, b) in parts.items():
        out[f"{name}_correlation"] = correlation(a, b)
        out[f"{name}_relative_difference"] = relative_difference(a, b)
    out["closure_error"] = comparison.closure_error
    out["unbalanced_share"] = comparison.unbalanced
    out["residual"] = comparison.answer.residual
    return out


def penalty_difference(a: Comparison, b: Comparison) -> float:
    """rms difference of the penalty forces of two runs over their united contacts, relative to the
    rms of the first."""
    key_a, key_b = (_key(c.first, c.second, c.is_wall) for c in (a, b))
    keys = np.union1d(key_a, key_b)
    forces = np.zeros((2, len(keys), 2))
    forces[0, np.searchsorted(keys, key_a)] = a.penalty
    forces[1, np.searchsorted(keys, key_b)] = b.penalty
    return relative_difference(forces[0].ravel(), forces[1].ravel())


def correlation(a: Floats, b: Floats) -> float:
    """Pearson's correlation; NaN for fewer than three pairs or no spread."""
    if (
        len(a) < 3
        or a.std() < 1e-9 * np.abs(a).max(initial=1e-300)
        or b.std() < 1e-9 * np.abs(b).max(initial=1e-300)
    ):
        return float("nan")
    return float(np.corrcoef(a, b)[0, 1])


def relative_difference(a: Floats, b: Floats) -> float:
    """rms(b − a) / rms(a); NaN where a vanishes."""
    size = float(np.sqrt((a**2).mean())) if len(a) else 0.0
    return float(np.sqrt(((b - a) ** 2).mean())) / size if size else float("nan")
