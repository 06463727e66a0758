"""A run compared with the percussions of its snapshot, contact by contact, and statistics of that."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from analysis import dumps
from analysis.dumps.contacts import arm_rows, integrate_contacts
from analysis.dumps.listed_contacts import checked_contacts
from analysis.engines.record import RunRecord, read_finished
from analysis.percussions.setting import FORCE, Setting
from analysis.percussions.snapshot import SnapshotPercussions, bounds_of, percussions_of_frames
from analysis.scene.anthropometry import separated
from analysis.scene.scene import Scene, SceneError
from analysis.support.columns import Columns
from analysis.support.files import write_columns
from nscd import ContactLaw, Contacts, Percussions, Snapshot
from nscd.arrays import Floats, Indices, Mask
from nscd.contacts import NO_WALLS
from nscd.indeterminacy.determinacy import Determinacy, admissible_determinacy, determinacy
from nscd.indeterminacy.equilibrium import Equilibrium
from nscd.indeterminacy.intervals import Intervals, IntervalStatus, weights_of_wall
from nscd.indeterminacy.linear import ProgramError
from nscd.stepping import StepError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Match:
    """Pair the contacts of the penalty and of the rigid model: the k that either of them has.

    contacts: k, disks by their places in the snapshot; normal and gap (m) are the rigid model's
        where it has the contact, else the engine's
    ids: (k,2), of the first disk, and of the second or the number of the wall from 1; rising
    penalty, rigid: (k,2) N or N·s, what the first body gives to the second, through arms too; 0
        where the model has not the contact
    in_penalty, in_rigid: (k,) which model has it
    determined: (k,) whether the balance of the disks, and that nothing pulls, fix its rigid force
    """

    contacts: Contacts
    ids: Indices
    penalty: Floats
    rigid: Floats
    in_penalty: Mask
    in_rigid: Mask
    determined: Mask

    @property
    def is_wall(self) -> Mask:
        """(k,): whether the second body is a wall."""
        return self.contacts.is_wall

    @property
    def keys(self) -> Indices:
        """(k,): one integer per contact, rising; the same in every run of a scene."""
        return _keys(self.ids[:, 0], self.ids[:, 1], self.is_wall)

    def normal_parts(self) -> tuple[Floats, Floats]:
        """Give the normal components of penalty and rigid, each (k,), positive where they push."""
        normal = self.contacts.normal
        return (self.penalty * normal).sum(1), (self.rigid * normal).sum(1)


def match_contacts(
    found: SnapshotPercussions, engine: dumps.EngineContacts, determined: Mask
) -> Match:
    """Match the rigid contacts of a snapshot, and their forces (impulses of an impact), with an
    engine's.

    determined: (k',), of the rigid contacts"""
    contacts, snapshot = found.contacts, found.snapshot
    rigid_keys = keys_of(found)
    engine_keys = _keys(engine.first, engine.second, engine.is_wall)
    reached = _arms(found)
    arms_keys = _keys(*reached[:, :3].astype(np.int64).T)
    keys = np.union1d(rigid_keys, np.union1d(engine_keys, arms_keys))
    at_rigid, at_engine, at_arms = (
        np.searchsorted(keys, some) for some in (rigid_keys, engine_keys, arms_keys)
    )

    def spread(rows: Indices, values: Any) -> Any:
        """Values of some contacts in an array of all; 0 elsewhere."""
        every = np.zeros((len(keys), *values.shape[1:]), dtype=values.dtype)
        every[rows] = values
        return every

    normal, gap = spread(at_engine, engine.normal), spread(at_engine, -engine.overlap)
    normal[at_arms], gap[at_arms] = reached[:, 3:5], -reached[:, 5]
    normal[at_rigid], gap[at_rigid] = contacts.normal, contacts.gap
    is_wall = (keys & 1).astype(bool)
    ids = np.column_stack([keys >> 32, (keys >> 1) & 0x7FFFFFFF])
    first = np.searchsorted(snapshot.ids, ids[:, 0])
    other = np.searchsorted(snapshot.ids, np.where(is_wall, ids[:, 0], ids[:, 1]))
    both = Contacts(
        first=first,
        second=np.where(is_wall, ids[:, 1] - 1, other),
        is_wall=is_wall,
        normal=normal,
        gap=gap,
        point=snapshot.position[first] + snapshot.radius[first, None] * normal,
    )
    return Match(
        contacts=both,
        ids=ids,
        penalty=spread(at_engine, engine.force),
        rigid=spread(at_rigid, found.pressing) + spread(at_arms, reached[:, 6:]),
        in_penalty=np.isin(keys, engine_keys),
        in_rigid=np.isin(keys, rigid_keys) | np.isin(keys, arms_keys),
        determined=spread(at_rigid, determined)
        | ~np.isin(keys, rigid_keys) & np.isin(keys, arms_keys),
    )


def _arms(found: SnapshotPercussions) -> Floats:
    """Rows of a contact dump of what arms give beside the percussions; an impact knows none."""
    setting = found.setting
    if setting.arms is None or found.window is None:
        return np.empty((0, 8))
    return arm_rows(setting.arms, found.snapshot, setting.walls or NO_WALLS)


def keys_of(found: SnapshotPercussions) -> Indices:
    """Give the key of each rigid contact of a snapshot, (k,), as in `Match.keys`."""
    contacts, ids = found.contacts, found.snapshot.ids
    wall = contacts.is_wall
    second = np.where(wall, contacts.second + 1, ids[np.where(wall, 0, contacts.second)])
    return _keys(ids[contacts.first], second, wall)


def _keys(first: Indices, second: Indices, is_wall: Mask) -> Indices:
    """first · 2³² + second · 2 + is_wall: sorts by first, then second."""
    keys: Indices = (first << 32) | (second << 1) | is_wall
    return keys


# Steps times the time step are the end of a run to rounding.
SAME = 1e-9


def frame_of(steps: tuple[int, ...], time_step: float, time: float | None, default: float) -> int:
    """Find the frame of an instant `time` (s), or the one nearest to the scene's where none is
    asked.

    Raises DumpError for an instant that is not within the run."""
    times = np.array(steps) * time_step
    if time is not None and not times[0] <= time <= times[-1] * (1 + SAME):
        raise dumps.DumpError(f"time: {time:g} s. The run is from {times[0]:g} to {times[-1]:g} s")
    return int(np.argmin(np.abs(times - (default if time is None else time))))


# Impulses that miss the momentum change by more than this share are compared with nothing.
LARGEST_CLOSURE_ERROR = 0.05


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Balance:
    """Add up what drives a crowd; of an impact in N·s.

    drive: (2,) N, Σ of the drive; of an impact Σ m Δu
    magnitudes: N, Σ of the magnitudes of what `drive` adds up: a sum far below it is rounding
    unbalanced: Σ |m a| / Σ |drive| over people, the body force in the drive: the share of the drive
        that accelerates them, 0 at rest; NaN where the dump has no forces
    closure_error: how far the engine's own balance is from closing: |Σ drive − Σ walls − Σ m a| /
        |Σ drive|, or the largest error of a disk's momentum change rebuilt from ∫f dt
    frames_needed: of an impact, about so many make that error 1 %; 0 of a driven crowd"""

    drive: Floats
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
    by_balance: rank of the rigid contacts, and what the balance alone determines"""

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
            f"contacts, {self.solution.status}>"
        )

    @property
    def snapshot(self) -> Snapshot:
        """The disks at the instant of the comparison."""
        return self.percussions.snapshot

    @property
    def solution(self) -> Percussions:
        """The percussions with their certificate."""
        return self.percussions.solution

    @property
    def unit(self) -> str:
        """N (driven: contact force against p/τ) or N·s (impact: ∫f dt over the run against p)."""
        return self.percussions.unit

    def disk_sums(self) -> tuple[Floats, Floats]:
        """Sum the normal magnitudes at each disk, penalty and rigid, each (n,): what it carries."""
        penalty, rigid = (np.abs(part) for part in self.match.normal_parts())
        contacts, n = self.match.contacts, len(self.snapshot)
        return contacts.sum_at_disks(penalty, n), contacts.sum_at_disks(rigid, n)

    def wall_loads(self) -> list[tuple[str, float, float]]:
        """List the walls: name and load (sum of normal components), penalty and rigid."""
        penalty, rigid = self.match.normal_parts()
        loads = []
        for number, wall in enumerate(self.scene.walls, start=1):
            on = self.match.is_wall & (self.match.ids[:, 1] == number)
            loads.append((wall.name, float(penalty[on].sum()), float(rigid[on].sum())))
        return loads


def compare_run(
    folder: Path, time: float | None = None, law: ContactLaw | None = None, tolerance: float = 1e-10
) -> Comparison:
    """Compare a finished run with the percussions of its snapshot.

    time: s, of a driven crowd; that of the scene where left out
    law: of the rigid contacts; the scene's where left out, its restitution in an impact included
    tolerance: of `nscd.solve`

    Raises EngineError and DumpError for a folder that does not hold one finished run of its scene,
    SceneError for the scene, NoContactError, and DumpError where the impulses of an impact miss the
    momentum of the disks by more than 5 %."""
    run = OpenRun.of(folder)
    record, scene = run.record, run.scene
    impact = scene.analysis.kind == "impact"
    if impact and time is not None:
        raise dumps.DumpError(f"time: {time:g} s. An impact is compared over its whole run")
    default = 0.0 if impact else scene.analysis.time_s
    number = frame_of(run.index.steps, record.time_step_s, time, default)
    trajectory, setting = run.universe.trajectory, Setting.of(scene)
    law = setting.law if law is None else law
    frames = percussions_of_frames(trajectory, [number], setting, law, tolerance=tolerance)
    _, found = next(frames)
    snapshot = found.snapshot
    if impact:
        engine, balance = _impulses(run, found)
    else:
        engine = checked_contacts(run.index, number, snapshot, scene)
        balance = _driven_balance(snapshot, trajectory.ts.data, engine, np.array(scene.acceleration()))
    if not len(found.contacts) and not len(engine):
        raise dumps.NoContactError(f"{folder}: no contact at all at {snapshot.time:g} s")
    by_balance = determinacy(found.contacts, len(snapshot), snapshot)
    return Comparison(
        scene=scene,
        record=record,
        match=match_contacts(found, engine, _determined(found, by_balance)),
        balance=balance,
        percussions=found,
        law=law,
        by_balance=by_balance,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OpenRun:
    """Hold a finished run, opened: its bodies as a universe, its contacts as an index."""

    record: RunRecord
    scene: Scene
    universe: Any
    index: dumps.DumpIndex

    @classmethod
    def of(cls, folder: Path) -> OpenRun:
        """Open a finished run.

        Raises EngineError and DumpError for a folder that does not hold one finished run of its
        scene, SceneError for the scene."""
        scene, record = read_finished(folder)
        universe = dumps.open_bodies(folder / "bodies.dump", record.time_step_s)
        index = dumps.index_contacts(folder / "contacts.dump")
        if index.steps != universe.trajectory.steps:
            raise dumps.DumpError(f"{index.path}: its steps are not those of bodies.dump beside it")
        return cls(record=record, scene=scene, universe=universe, index=index)


def _determined(found: SnapshotPercussions, by_balance: Determinacy) -> Mask:
    """(k,): whether every admissible percussion is the same at a contact, friction included; with
    friction False where that was not found."""
    solution = found.solution
    if solution.friction is not None:
        every: Mask = bounds_of(found, False).determined == 1
        return every
    if solution.status == "failed":
        return by_balance.determined
    return admissible_determinacy(found.contacts, solution).determined


def _impulses(run: OpenRun, found: SnapshotPercussions) -> tuple[dumps.EngineContacts, Balance]:
    """The contacts of an impact with ∫f dt for forces, and its balance. Raises DumpError where they
    do not fit the momentum that the disks gain."""
    index, trajectory = run.index, run.universe.trajectory

    def contacts_of(number: int) -> dumps.EngineContacts:
        now = dumps.snapshot_of(trajectory[number], index.path)
        return checked_contacts(index, number, now, run.scene)

    g, times = np.array(run.scene.acceleration()), np.array(index.steps) * trajectory.dt
    total = integrate_contacts(contacts_of, trajectory, times, found.contacts, found.snapshot, g)
    if not total.error <= LARGEST_CLOSURE_ERROR:
        raise dumps.DumpError(
            f"{index.path}: the impulses ∫f dt miss the momentum that disks gain by "
            f"{total.error:.0%}, so they are not compared. About {total.frames_needed} frames "
            "(run.frames) would make it 1 %"
        )
    return total.contacts, Balance(
        drive=total.change.sum(0),
        magnitudes=float(np.hypot(*total.change.T).sum()),
        unbalanced=0.0,
        closure_error=total.error,
        frames_needed=total.frames_needed,
    )


def _driven_balance(
    snapshot: Snapshot, data: Any, engine: dumps.EngineContacts, acceleration: Floats
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
        magnitudes=magnitudes,
        unbalanced=unbalanced,
        closure_error=error,
        frames_needed=0,
    )


# The share of the drive that may still accelerate a crowd "at rest".
AT_REST = 0.01
# From so many stiffnesses on a trend is fitted.
FEWEST = 4


def at_rest(comparison: Comparison) -> bool:
    """Whether a crowd has come to rest: Σ |m a| is at most 1 % of Σ |drive|."""
    pressed = comparison.scene.analysis.kind != "impact"
    return pressed and comparison.balance.unbalanced <= AT_REST


def begun_anew(scene: Scene, rested: Comparison, stiffnesses: int) -> Scene | None:
    """Return the scene with the crowd of a run that came to rest: without those beyond the door,
    without speed, overlaps pushed apart as little as possible.

    None where it has not come to rest, where that is no scene, and for fewer than four stiffnesses,
    of which no trend is fitted."""
    if stiffnesses < FEWEST or not at_rest(rested):
        return None
    now, stays = rested.snapshot, np.ones(len(rested.snapshot), dtype=bool)
    if scene.drive:
        stays = ~scene.drive.gone(now.position, now.ids)
    still = Snapshot(
        position=now.position[stays],
        velocity=0.0 * now.velocity[stays],
        radius=now.radius[stays],
        mass=now.mass[stays],
        ids=now.ids[stays],
    )
    try:
        anew = scene.model_copy(
            update={
                "snapshot": separated(still, scene.wall_segments()),
                "reconciliation": None,
                "other_frames": None,
                "other_crowds": (),
            }
        )
        anew.check(scene.name)
    except (StepError, SceneError):
        return None
    return anew


def folder_of(folder: Path) -> Path:
    """Where such a run lives, beside the one from the scene's own beginning."""
    return folder.with_name(f"{folder.name}_anew")


# Of a driven crowd those in newtons are written, of an impact those in newton-seconds.
CONTACTS = Columns("compare")


def write_contacts(path: Path, comparison: Comparison) -> None:
    """Write one row per contact, both models side by side, as CSV with the unit in the names."""
    match, other = comparison.match, "_Ns" if comparison.unit == FORCE else "_N"
    names = [name for name in CONTACTS if not name.endswith(other)]
    which = (match.is_wall, match.in_penalty, match.in_rigid, match.determined)
    is_wall, *has = (one * 1 for one in which)
    bodies = [*match.ids.T, is_wall, *match.contacts.normal.T, match.contacts.gap]
    columns = [*bodies, *match.penalty.T, *match.rigid.T, *has]
    write_columns(path, dict(zip(names, columns, strict=True)))


# An interval narrower than this share of its upper end is one number.
ONE = 1e-6


class Range(NamedTuple):
    """Smallest and largest load (N, or N·s for an impact) over all admissible percussions, and the
    status in words: determined, proven, unbounded, unproven, or why there is none."""

    lower: float
    upper: float
    status: str


def wall_ranges(comparison: Comparison) -> list[Range]:
    """Find the ranges of the loads of all walls of the scene."""
    contacts, window = comparison.percussions.contacts, comparison.percussions.window or 1.0
    nothing, walls = float("nan"), range(len(comparison.scene.walls))
    try:
        intervals = Intervals(Equilibrium.of(contacts, comparison.solution))
    except (ValueError, ProgramError) as error:
        return [Range(nothing, nothing, str(error))] * len(walls)
    ranges = []
    for wall in walls:
        try:
            found = intervals.of(weights_of_wall(contacts, wall))
        except ProgramError as error:
            ranges.append(Range(nothing, nothing, str(error)))
            continue
        one = found.status == IntervalStatus.PROVEN and found.width <= ONE * abs(found.upper)
        status = "determined" if one else str(found.status)
        ranges.append(Range(found.lower / window, found.upper / window, status))
    return ranges


def statistics(comparison: Comparison) -> dict[str, float | int]:
    """Summarise a comparison: counts, correlation and relative difference per contact, per
    determined contact and per disk; N or N·s is the comparison's unit.

    Relative difference: rms(rigid − penalty) / rms(penalty), of normal components; correlation:
    Pearson's, NaN where it has no meaning."""
    match, by_balance = comparison.match, comparison.by_balance
    penalty, rigid = match.normal_parts()
    both = match.in_penalty & match.in_rigid
    fixed = both & match.determined
    out: dict[str, float | int] = {
        "contacts_both": int(both.sum()),
        "contacts_only_penalty": int((match.in_penalty & ~match.in_rigid).sum()),
        "contacts_only_rigid": int((~match.in_penalty & match.in_rigid).sum()),
        "rigid_contacts": int(match.in_rigid.sum()),
        "rank": by_balance.rank,
        "redundant": by_balance.redundant,
        "determined_contacts": int(match.determined.sum()),
        "determined_by_balance_alone": int(by_balance.determined.sum()),
        "penalty_mean": _mean(penalty[match.in_penalty]),
        "rigid_mean": _mean(rigid[match.in_rigid]),
        "penalty_max": float(penalty.max()),
        "rigid_max": float(rigid.max()),
    }
    n = len(comparison.snapshot)
    received = (match.contacts.momentum_change(part, n) for part in (match.penalty, match.rigid))
    parts = {
        "contact": (penalty, rigid),
        "determined": (penalty[fixed], rigid[fixed]),
        "disk_sum": comparison.disk_sums(),
        "disk_vector": tuple(vectors.ravel() for vectors in received),
    }
    for name, (a, b) in parts.items():
        out[f"{name}_correlation"] = correlation(a, b)
        out[f"{name}_relative_difference"] = relative_difference(a, b)
    out["closure_error"] = comparison.balance.closure_error
    out["unbalanced_share"] = comparison.balance.unbalanced
    out["residual"] = comparison.solution.residual
    return out


def penalty_difference(a: Comparison, b: Comparison) -> float:
    """Compare the penalty forces of two runs over their united contacts: rms of the difference,
    relative to the rms of the first."""
    keys = np.union1d(a.match.keys, b.match.keys)
    forces = np.zeros((2, len(keys), 2))
    for force, one in zip(forces, (a.match, b.match), strict=True):
        force[np.searchsorted(keys, one.keys)] = one.penalty
    return relative_difference(forces[0].ravel(), forces[1].ravel())


def correlation(a: Floats, b: Floats) -> float:
    """Compute Pearson's correlation; NaN for fewer than three pairs or no spread."""
    if len(a) < 3 or any(x.std() < 1e-9 * np.abs(x).max(initial=1e-300) for x in (a, b)):
        return float("nan")
    return float(np.corrcoef(a, b)[0, 1])


def relative_difference(a: Floats, b: Floats) -> float:
    """Compute rms(b − a) / rms(a); NaN where a vanishes."""
    size = float(np.sqrt((a**2).mean())) if len(a) else 0.0
    return float(np.sqrt(((b - a) ** 2).mean())) / size if size else float("nan")


def exponent(x: Floats, y: Floats) -> float:
    """Fit a of y ∝ xᵃ by least squares of the logarithms; NaN for fewer than two points."""
    finite = np.isfinite(y) & (y > 0)
    if finite.sum() < 2:
        return float("nan")
    return float(np.polyfit(np.log(x[finite]), np.log(y[finite]), 1)[0])


def first_above(time: Floats, values: Floats, level: float) -> Floats:
    """Find when values (f, …) first reach a level, linear between frames: s (…), infinite for never."""
    above = values >= level
    frame = above.argmax(0)
    earlier = np.maximum(frame - 1, 0)
    before, after = (np.take_along_axis(values, one[None], 0)[0] for one in (earlier, frame))
    fraction = np.divide(level - before, after - before, out=np.zeros_like(before), where=frame > 0)
    found = time[earlier] + fraction * (time[frame] - time[earlier])
    return np.asarray(np.where(above.any(0), found, np.inf))


def _mean(values: Floats) -> float:
    return float(values.mean()) if len(values) else 0.0
