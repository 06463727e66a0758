"""Penalty against rigid, like with like: the same snapshot, contact by contact, disk by disk, wall
by wall."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.compare.checks import check_contacts, frame_of
from analysis.compare.match import Match, match_contacts
from analysis.dumps import (
    DumpError,
    DumpIndex,
    EngineContacts,
    contacts_at,
    index_contacts,
    open_bodies,
    snapshot_of,
)
from analysis.dumps.impulses import integrate_contacts
from analysis.engines.record import RunRecord
from analysis.percussions.snapshot import FORCE, SnapshotPercussions, law_of, percussions_of
from analysis.percussions.table import openness_of
from analysis.scene.scene import Scene, read_scene
from nscd import ContactLaw, Percussions, Snapshot
from nscd.arrays import Flags, Floats
from nscd.indeterminacy.determinacy import Determinacy, admissible_determinacy, determinacy

__all__ = ["FORCE", "Balance", "Comparison", "compare_run", "rigid_law_of"]
# Impulses that miss the momentum change by more than this share are compared with nothing.
LARGEST_CLOSURE_ERROR = 0.05
# Of two bodies; a dissipation as large as an elastic contact's would leave rounding errors only.
NEARLY_ELASTIC = 0.9999


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Balance:
    """Add up what drives a crowd and what the walls receive; of an impact in N·s.

    drive: (2,) N, Σ of the drive; of an impact Σ m Δu
    walls, rigid_walls: (2,) N, Σ of what the walls receive, in the penalty and the rigid model
    magnitudes: N, Σ of the magnitudes of what `drive` adds up: a sum far below it is rounding
    unbalanced: Σ |m a| / Σ |drive| over people, the body force in the drive: the share of the drive
        that accelerates them, 0 at rest; NaN where the dump has no forces
    closure_error: how far the engine's own balance is from closing: |Σ drive − Σ walls − Σ m a| /
        |Σ drive|, or the largest error of a disk's momentum change rebuilt from ∫f dt
    frames_needed: of an impact, about so many make that error 1 %; 0 of a driven crowd
    """

    drive: Floats
    walls: Floats
    rigid_walls: Floats
    magnitudes: float
    unbalanced: float
    closure_error: float
    frames_needed: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Comparison:
    """Set one run of an engine beside the percussions of its own snapshot.

    scene, record: what was run, and how
    match: the contacts of both models, with what each of them gives
    balance: of the whole crowd
    percussions: the rigid answer for the snapshot
    law: of the rigid contacts
    by_balance: rank of the rigid contacts, and what the balance alone determines
    """

    scene: Scene
    record: RunRecord
    match: Match
    balance: Balance
    percussions: SnapshotPercussions
    law: ContactLaw
    by_balance: Determinacy

    def __repr__(self) -> str:
        return (
            f"<Comparison: {self.scene.name}, {self.record.engine} against percussions at "
            f"{self.snapshot.time:g} s, {len(self.snapshot)} disks, {len(self.match.contacts)} "
            f"contacts, {self.answer.status}>"
        )

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


def compare_run(
    folder: Path,
    time: float | None = None,
    law: ContactLaw | None = None,
    tolerance: float = 1e-10,
) -> Comparison:
    """Compare a finished run with the percussions of its snapshot.

    time: s, of a driven crowd; that of the scene where left out
    law: of the rigid contacts; the scene's where left out, its restitution in an impact included
    tolerance: of `nscd.solve`

    Raises EngineError and DumpError for a folder that does not hold one finished run of its scene,
    SceneError for the scene, DumpError where neither model has a contact, and where the impulses of
    an impact miss the momentum of the disks by more than 5 %."""
    run = open_run(folder)
    record, scene, index, trajectory = run.record, run.scene, run.index, run.universe.trajectory
    impact = scene.analysis.kind == "impact"
    if impact and time is not None:
        raise DumpError(f"time: {time:g} s; an impact is compared over its whole run")
    default = 0.0 if impact else scene.analysis.time_s
    number = frame_of(index.steps, record.time_step_s, time, default)
    ts = trajectory[number]
    snapshot = snapshot_of(ts, folder / "bodies.dump")
    law = rigid_law_of(scene) if law is None else law
    found = percussions_of(scene, snapshot, law, tolerance=tolerance)
    if impact:
        engine, balance = _impulses(index, trajectory, found, scene)
    else:
        engine = contacts_at(index, number)
        check_contacts(index, number, engine, snapshot, scene)
        balance = _driven_balance(snapshot, ts.data, engine, np.array(scene.acceleration()))
    if not len(found.contacts) and not len(engine):
        raise DumpError(f"{folder}: no contact at all at {snapshot.time:g} s; nothing to compare")
    known = determinacy(found.contacts, len(snapshot))
    match = match_contacts(found, engine, _determined(found, known))
    rigid_walls = match.rigid[match.is_wall].sum(0)
    return Comparison(
        scene=scene,
        record=record,
        match=match,
        balance=replace(balance, rigid_walls=rigid_walls),
        percussions=found,
        law=law,
        by_balance=known,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OpenRun:
    """Hold a finished run, opened: its bodies as a universe, its contacts as an index."""

    record: RunRecord
    scene: Scene
    universe: Any
    index: DumpIndex


def open_run(folder: Path) -> OpenRun:
    """Open a finished run.

    Raises EngineError and DumpError for a folder that does not hold one finished run of its scene,
    SceneError for the scene."""
    record = RunRecord.read(folder)
    scene = read_scene(folder / "scene.toml").model_copy(update={"name": record.scene})
    record.check_finished(folder, scene)
    universe = open_bodies(folder / "bodies.dump", record.time_step_s)
    index = index_contacts(folder / "contacts.dump")
    if index.steps != universe.trajectory.steps:
        raise DumpError(f"{index.path}: its steps are not those of bodies.dump beside it")
    return OpenRun(record=record, scene=scene, universe=universe, index=index)


def _determined(found: SnapshotPercussions, known: Determinacy) -> Flags:
    """(k,): whether every admissible percussion is the same at a contact, friction included; with
    friction False where that was not found."""
    answer = found.answer
    if answer.friction is not None:
        return np.array([value == 1 for value in openness_of(found, False).determined], dtype=bool)
    if answer.status == "failed":
        return known.determined
    return admissible_determinacy(found.contacts, answer).determined


def rigid_law_of(scene: Scene) -> ContactLaw:
    """Give the law of the scene's rigid contacts (see `law_of`); of elastic ones that nearest to
    it which a finite dissipation gives."""
    elastic = scene.contact.restitution > NEARLY_ELASTIC and scene.analysis.kind == "impact"
    nearest = ContactLaw(restitution=NEARLY_ELASTIC, friction=scene.contact.friction)
    return nearest if elastic else law_of(scene)


def _impulses(
    index: DumpIndex, trajectory: Any, found: SnapshotPercussions, scene: Scene
) -> tuple[EngineContacts, Balance]:
    """The contacts of an impact with ∫f dt for forces, and its balance. Raises DumpError where they
    do not fit the momentum that the disks gain."""

    def check(number: int, contacts: EngineContacts) -> None:
        here = snapshot_of(trajectory[number], index.path)
        check_contacts(index, number, contacts, here, scene)

    acceleration = np.array(scene.acceleration())
    whole = integrate_contacts(
        index, trajectory, found.contacts, found.snapshot, check, acceleration
    )
    if not whole.error <= LARGEST_CLOSURE_ERROR:
        raise DumpError(
            f"{index.path}: the impulses ∫f dt miss the momentum that disks gain by "
            f"{whole.error:.0%}, so they are not compared; about {whole.frames_needed} frames "
            "(run.frames) would make it 1 %"
        )
    return whole.contacts, Balance(
        drive=whole.change.sum(0),
        walls=whole.contacts.force[whole.contacts.is_wall].sum(0),
        rigid_walls=np.zeros(2),
        magnitudes=float(np.hypot(*whole.change.T).sum()),
        unbalanced=0.0,
        closure_error=whole.error,
        frames_needed=whole.frames_needed,
    )


def _driven_balance(
    snapshot: Snapshot, data: Any, engine: EngineContacts, acceleration: Floats
) -> Balance:
    """The balance of a driven crowd, with a body force of an acceleration (2,) m/s²; NaN for what
    needs the forces of a dump that has none."""
    drive = snapshot.mass[:, None] * acceleration
    if snapshot.drive is not None:
        drive = drive + snapshot.drive
    walls, total = engine.force[engine.is_wall].sum(0), drive.sum(0)
    magnitudes = float(np.hypot(*drive.T).sum())
    error = unbalanced = float("nan")
    if "fx" in data:
        force = np.column_stack([data["fx"], data["fy"]])
        error = float(np.hypot(*(total - walls - force.sum(0)))) / (float(np.hypot(*total)) or 1.0)
        unbalanced = float(np.hypot(*force.T).sum()) / (magnitudes or 1.0)
    return Balance(
        drive=total,
        walls=walls,
        rigid_walls=np.zeros(2),
        magnitudes=magnitudes,
        unbalanced=unbalanced,
        closure_error=error,
        frames_needed=0,
    )
