"""Penalty against rigid, like with like: the same snapshot, contact by contact, disk by disk, wall
by wall."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from analysis.compare.match import Match, match_contacts
from analysis.dumps import (
    DumpError,
    EngineContacts,
    contacts_at,
    frame_at,
    index_contacts,
    open_bodies,
    snapshot_of,
)
from analysis.dumps.impulses import integrate_contacts
from analysis.engines.record import RunRecord
from analysis.percussions.snapshot import FORCE, SnapshotPercussions, percussions_of
from analysis.scene.scene import Scene, read_scene
from nscd import Percussions, Snapshot
from nscd.arrays import Floats
from nscd.indeterminacy.determinacy import Determinacy, admissible_determinacy, determinacy

__all__ = ["FORCE", "Balance", "Comparison", "compare_run"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Balance:
    """Add up what drives a crowd and what the walls receive; of an impact in N·s.

    drive: (2,) N, Σ of the drive; of an impact Σ m Δu
    walls, rigid_walls: (2,) N, Σ of what the walls receive, in the penalty and the rigid model
    net: (2,) N, Σ m a of the engine; 0 for an impact
    closure_error: how far the engine's own balance is from closing: |Σ drive − Σ walls − Σ m a| /
        |Σ drive|, or the largest error of a disk's momentum change rebuilt from ∫f dt
    """

    drive: Floats
    walls: Floats
    rigid_walls: Floats
    net: Floats
    closure_error: float

    @property
    def unbalanced(self) -> float:
        """|Σ m a| / |Σ drive|: the share of the drive that still accelerates people, 0 at rest."""
        return float(np.hypot(*self.net)) / (float(np.hypot(*self.drive)) or 1.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Comparison:
    """Set one run of an engine beside the percussions of its own snapshot.

    scene, record: what was run, and how
    match: the contacts of both models, with what each of them gives
    balance: of the whole crowd
    percussions: the rigid answer for the snapshot
    by_balance: rank of the rigid contacts, and what the balance alone determines
    """

    scene: Scene
    record: RunRecord
    match: Match
    balance: Balance
    percussions: SnapshotPercussions
    by_balance: Determinacy

    @property
    def snapshot(self) -> Snapshot:
        """The disks at the instant of the comparison."""
        return self.percussions.snapshot

    @property
    def answer(self) -> Percussions:
        """The percussions with their certificate."""
        return self.percussions.answer

    @property
    def unit(self) -> str:
        """N (driven: contact force against p/τ) or N·s (impact: ∫f dt over the run against p)."""
        return self.percussions.unit

    def disk_sums(self) -> tuple[Floats, Floats]:
        """Sum the normal magnitudes at each disk, penalty and rigid, each (n,): what it carries."""
        penalty, rigid = (np.abs(part) for part in self.match.normal_parts())
        contacts, n = self.match.contacts, len(self.snapshot)
        return contacts.sum_at_disks(penalty, n), contacts.sum_at_disks(rigid, n)

    def disk_vectors(self) -> tuple[Floats, Floats]:
        """Sum the vectors that each disk receives, penalty and rigid, each (n,2)."""
        contacts, n = self.match.contacts, len(self.snapshot)
        penalty, rigid = self.match.penalty, self.match.rigid
        return contacts.momentum_change(penalty, n), contacts.momentum_change(rigid, n)

    def wall_loads(self) -> list[tuple[str, float, float]]:
        """List the walls: name and load (sum of normal components), penalty and rigid."""
        penalty, rigid = self.match.normal_parts()
        loads = []
        for number, wall in enumerate(self.scene.walls, start=1):
            on = self.match.is_wall & (self.match.ids[:, 1] == number)
            loads.append((wall.name, float(penalty[on].sum()), float(rigid[on].sum())))
        return loads


def compare_run(folder: Path, time: float | None = None, tolerance: float = 1e-10) -> Comparison:
    """Compare a finished run with the percussions of its snapshot at `time` (s; that of the scene
    by default).

    Raises DumpError for damaged dumps, SceneError for the scene, and DumpError where neither model
    has a contact."""
    scene, record = read_scene(folder / "scene.toml"), RunRecord.read(folder)
    trajectory = open_bodies(folder / "bodies.dump", record.time_step_s).trajectory
    index = index_contacts(folder / "contacts.dump")
    impact = scene.analysis.kind == "impact"
    wanted = (0.0 if impact else scene.analysis.time_s) if time is None else time
    frame = frame_at(np.array(index.steps) * record.time_step_s, wanted)
    step = index.steps[frame]
    if step not in trajectory.steps:
        raise DumpError(f"{folder}: contacts.dump has step {step} and bodies.dump has not")
    ts = trajectory[trajectory.steps.index(step)]
    found = percussions_of(scene, snapshot_of(ts, folder / "bodies.dump"), tolerance=tolerance)
    if impact:
        whole = integrate_contacts(index, trajectory, found.contacts, found.snapshot)
        engine, total, net, error = whole.contacts, whole.change.sum(0), np.zeros(2), whole.error
    else:
        engine = contacts_at(index, frame)
        total, net, error = _driven_balance(found.snapshot, ts.data, engine)
    if not len(found.contacts) and not len(engine):
        raise DumpError(
            f"scene {scene.name}, {record.engine}: no contact at all at {found.snapshot.time:g} s; "
            "nothing to compare"
        )
    known = determinacy(found.contacts, len(found.snapshot))
    failed = found.answer.status == "failed"
    sharper = known if failed else admissible_determinacy(found.contacts, found.answer)
    match = match_contacts(found, engine, sharper.determined)
    on_walls = match.is_wall
    return Comparison(
        scene=scene,
        record=record,
        match=match,
        balance=Balance(
            drive=total,
            walls=match.penalty[on_walls].sum(0),
            rigid_walls=match.rigid[on_walls].sum(0),
            net=net,
            closure_error=error,
        ),
        percussions=found,
        by_balance=known,
    )


def _driven_balance(
    snapshot: Snapshot, data: Any, engine: EngineContacts
) -> tuple[Floats, Floats, float]:
    """Σ drive (2,) N, Σ m a (2,) N where the dump has it, and how far the balance is from closing
    (NaN without it)."""
    total = np.zeros(2) if snapshot.drive is None else snapshot.drive.sum(0)
    if "fx" not in data or "fy" not in data:
        return total, np.zeros(2), float("nan")
    net = np.array([data["fx"].sum(), data["fy"].sum()])
    rest = total - engine.force[engine.is_wall].sum(0) - net
    return total, net, float(np.hypot(*rest)) / (float(np.hypot(*total)) or 1.0)
