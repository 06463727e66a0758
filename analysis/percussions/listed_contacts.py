"""The contacts that came with a dump of disks: opened, held against the disks, and tested by the momentum of
these: sign and factor of their forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from analysis.dumps import DumpError, EngineContacts, contacts_at, snapshot_of
from analysis.dumps.contacts import keys_of
from analysis.dumps.index import DumpIndex
from analysis.dumps.last_digits import LastDigit
from analysis.dumps.listed_contacts import ListedContacts, open_contacts
from analysis.dumps.unused_columns import wall_fixes
from analysis.percussions.audit.hypotheses import WRONG_FORCES
from analysis.percussions.audit.judge import judge
from analysis.percussions.audit.record import Record, record_of
from analysis.percussions.setting import MOST_ROUNDING, Setting
from analysis.scene.scene import Scene
from analysis.support.reading import note
from nscd import Contacts, Snapshot
from nscd.arrays import Floats

# Of numbers that are rounded to a step, the standard deviation is this share of it.
ROUNDED = 12**-0.5
# Momentum is looked at in so many frames, those with the most contacts, of so many rows at most.
FRAMES, ROWS = 40, 20_000


def open_listed_contacts(
    trajectory: Any, contacts: Path, scene: Scene, setting: Setting, *, columns: str | None = None,
    factor: float | None = None, geometry: bool = True,
) -> ListedContacts:  # fmt: skip
    """Open the contacts of a dump of disks, of a room as a scene and its setting; their signs are found.

    columns: see `open_contacts`; factor: where stated, N of the first on the second for 1 listed
    geometry: whether they are of the instant of the disks

    Raises DumpError naming the row or the step of what these disks cannot have."""
    file, index = trajectory.filename, open_contacts(contacts, columns, trajectory)
    if missing := {*trajectory.steps} - {*index.steps}:
        raise DumpError(f"{index.path}: step {min(missing)} of {file} is missing")
    listing = ListedContacts(index, scene, geometry, setting.fixed_disks)
    listing.wall_fixes = wall_fixes(() if "is_wall" in index.columns else trajectory.ts.data)
    if factor is not None:
        listing.factor, listing.sign = abs(factor) if not listing.is_whole else factor, np.sign(factor)
    listing.check_signs(trajectory, file, factor is not None)
    if not np.isnan(trajectory[0].time):
        _test_by_momentum(listing, trajectory, setting, stated=factor is not None)
    return listing


class Listed(NamedTuple):
    """Hold the contacts (k,) of a snapshot that are listed, with the geometry of its bodies, and their own
    forces (k,2) N; how many listed ones do not touch, and how many touch and are not listed."""

    contacts: Contacts
    force: Floats
    apart: int
    missing: int


def listed_in(listing: ListedContacts, ts: Any, now: Snapshot, setting: Setting) -> Listed:
    """Take the contacts of a frame that are listed: those that touch, and without arms those that have a
    force. Of pairs alone walls are those that are found. Raises DumpError as `ListedContacts.at` does."""
    rows, (touch, _) = listing.at(ts, now), setting.touch(now.position, now.radius)
    pressed, smallest = np.asarray(rows.force.any(axis=1)), float(now.radius.min(initial=1.0))
    gap = 0.0 if setting.arms else float(-rows.overlap[pressed].min(initial=0.0))
    found = setting.find(now, max(touch, min((1 + 1e-9) * gap, MOST_ROUNDING * smallest)))
    wall = found.is_wall
    one, two = now.ids[found.first], now.ids[np.where(wall, 0, found.second)]
    first, second = np.where(wall, [one, found.second + 1], [np.minimum(one, two), np.maximum(one, two)])
    keys, theirs = keys_of(first, second, wall), keys_of(rows.first, rows.second, rows.is_wall)
    _, here, there = np.intersect1d(keys, theirs, return_indices=True)
    force, near = np.full((len(found), 2), np.nan), np.asarray(found.gap <= touch)
    keep = np.zeros(len(found), dtype=bool)
    force[here] = np.where(one == first, 1.0, -1.0)[here, None] * rows.force[there]
    keep[here] = near[here] | pressed[there]
    selected = keep | (near & wall & listing.lacks_walls)
    return Listed(found.select(selected), force[selected], len(rows) - int(keep.sum()), int((near & ~selected).sum()))


def _test_by_momentum(listing: ListedContacts, trajectory: Any, setting: Setting, *, stated: bool) -> None:
    """Find the factor of forces from the momentum of the disks, and say what is wrong with them.

    Raises DumpError where they are not the forces on these disks, by a hypothesis that explains them."""
    path, counts, steps = listing.index.path, dict(zip(listing.index.steps, listing.index.counts, strict=True)), trajectory.steps
    rows = np.array([counts[step] for step in steps])
    some = int(min(FRAMES, max(4, ROWS // max(1, rows.max()))))
    first = int(np.argmax(np.convolve(rows, np.ones(min(some, len(rows))), "valid")))
    record = read_record(listing, trajectory, setting, range(first, min(first + some, len(rows))))
    found = judge(record, time_step=record.step_s)
    faults, stated_value = {*found.faults}, found.words[0].lower() + found.words[1:]
    if found.status == "unknown":
        if not (listing.is_whole or stated):
            note(path, f"{stated_value}. They are taken as N (--contacts-factor)")
    elif found.status == "agrees":
        if not listing.is_whole:
            note(path, stated_value)
    elif faults & WRONG_FORCES:
        raise DumpError(f"{path}: {stated_value}. See percussions audit")
    elif np.isfinite(found.factor) and found.factor != 1 and not stated:
        if meant := "factor" not in faults:
            listing.factor *= found.factor
        factor = listing.stated * (1.0 if meant else found.factor)
        factor_words = f"times {found.factor:.6g}, as with" if meant else "as they are, not with"
        note(path, f"{stated_value}. They are taken {factor_words} --contacts-factor {factor:.6g}")
    elif faults != {"walls missing"} or not listing.lacks_walls:
        note(path, stated_value)


def read_record(
    listing: ListedContacts, trajectory: Any, setting: Setting, numbers: Sequence[int], *,
    acceleration: Sequence[float] | None = None, impulses: bool = False,
) -> Record:  # fmt: skip
    """Read frames of disks with their contacts as they are listed, and all other forces: of the setting, or
    m times an acceleration (2,) m/s². impulses: whether contacts have N·s since the frame before.

    Raises DumpError naming the file and the frame."""
    file, steps = trajectory.filename, trajectory.steps
    pressed = acceleration is not None or setting.drive is not None or any(setting.acceleration)
    finite = pressed or setting.walls is not None or "drive_x" in trajectory.ts.data
    every = bool((np.diff([steps[k] for k in numbers]) == 1).all())
    snapshots: list[Snapshot] = []
    listed = []
    for number in numbers:
        snapshots.append(snapshot_of(trajectory[number], file, needs_velocity=False))
        index = listing.index.steps.index(steps[number])
        duration = float(np.diff([one.time for one in snapshots[-2:]] * 2)[0]) or np.inf
        listed.append(_listed(listing, index, trajectory.ts, snapshots[-1], duration if impulses else 0.0))
    pushes = (lambda now: external_of(setting, now, acceleration)) if finite else None
    has_velocity = "vx" in trajectory.ts.data
    try:
        record = record_of(snapshots, listed, pushes, setting.walls, has_velocity, every_step=every)
    except ValueError as error:
        raise DumpError(f"{listing.index.path}: {error}") from None
    per_step = np.ptp(record.times) / max(1, steps[numbers[-1]] - steps[numbers[0]])
    return replace(record, noise=_noise(trajectory, listing.index, record), step_s=float(per_step) or None)


def external_of(setting: Setting, now: Snapshot, acceleration: Sequence[float] | None) -> Floats:
    """Compute all forces (n,2) N that are no contacts: body force, and the drive of the dump or the room."""
    force: Floats = now.mass[:, None] * np.array(setting.acceleration if acceleration is None else acceleration)
    if now.drive is not None or setting.drive is None:
        return force if now.drive is None else force + now.drive
    alone = replace(setting, acceleration=(0.0, 0.0), arms=None, left_velocity="desired", window=None)
    wanted, time = alone.left(now)
    return np.asarray(force + now.mass[:, None] * (wanted - now.velocity) / (time or 1.0))


def _listed(listing: ListedContacts, number: int, ts: Any, now: Snapshot, duration: float) -> EngineContacts:
    """The contacts of a frame as they are listed; of impulses their mean force over a duration (s)."""
    if duration:
        first, second, wall, *impulse = listing.index.table(number).T
        force, one, two = np.column_stack(impulse[:2]) / duration, first.astype(np.int64), second.astype(np.int64)
        return EngineContacts(first=one, second=two, is_wall=wall == 1, force=force, normal=np.nan * force, overlap=first)
    fixed = listing.fixed_disks
    every = now if fixed is None else fixed.behind(now)
    found = contacts_at(listing.index, number) if listing.is_whole else listing.pairs(number, every, strict=False)
    if listing.wall_fixes:
        found = EngineContacts.joined([found, listing.of_fixes(ts.data, every)])
    if listing.is_whole:
        found = replace(found, force=listing.factor * found.force)
    return found if fixed is None else found.on_walls(fixed.ids, len(listing.scene.walls))


def _noise(trajectory: Any, index: DumpIndex, record: Record) -> float:
    """What the last digits of velocities, or places, and of forces leave open in the force on a body, N."""
    columns, h = trajectory.columns, float(np.median(record.durations)) if len(record.times) > 2 else 1.0

    def step(of: DumpIndex, chosen: Sequence[str]) -> float:
        words = dict(zip(of.columns, zip(*of.sample, strict=True), strict=False))
        last = LastDigit.of([word for name in chosen for word in words.get(name, ())])
        return ROUNDED * last.step(last.largest) if last else 0.0

    moved = step(columns.index, columns.place[:2] if record.moved else ("vx", "vy")) * columns.unit
    moved *= float(np.median(record.mass)) * (6**0.5 / h**2 if record.moved else 2**0.5 / h)
    return float(np.hypot(moved, 2 * step(index, ("fx", "fy"))))
