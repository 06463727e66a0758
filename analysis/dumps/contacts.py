"""Contact dumps: who touches whom and with which force, and the impulses that these forces sum to."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.dumps.frame import DumpError
from analysis.dumps.index import DumpIndex, index_dump
from analysis.dumps.reader import snapshot_of
from nscd import Contacts, Snapshot, Walls
from nscd.arrays import Flags, Floats, Indices
from nscd.contacts import connected, sum_at_disks
from nscd.stepping import Arms

CONTACT_COLUMNS = ("first", "second", "is_wall", "nx", "ny", "overlap", "fx", "fy")
# Normals are unit vectors to this.
UNIT = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EngineContacts:
    """Hold contacts as an engine wrote them at one step.

    first: (k,) id of a disk
    second: (k,) id of the other disk, or the wall's number from 1 where is_wall
    is_wall: (k,)
    normal: (k,2), first→second
    overlap: (k,) m; below 0 of people who push through arms at a gap
    force: (k,2) N, of the first on the second"""

    first: Indices
    second: Indices
    is_wall: Flags
    normal: Floats
    overlap: Floats
    force: Floats

    def __len__(self) -> int:
        return len(self.first)

    def select(self, keep: Flags) -> EngineContacts:
        """Take the contacts that a mask chooses, in their order."""
        names = [field.name for field in fields(self)]
        return EngineContacts(**{name: getattr(self, name)[keep] for name in names})

    @classmethod
    def joined(cls, parts: Sequence[EngineContacts]) -> EngineContacts:
        """Join the contacts of several steps, one after the other."""
        names = [field.name for field in fields(cls)]
        return cls(**{n: np.concatenate([getattr(part, n) for part in parts]) for n in names})


def index_contacts(path: Path) -> DumpIndex:
    """Index a contact dump. Raises DumpError for missing columns and whatever `index_dump`
    finds."""
    index = index_dump(path, "ENTRIES")
    missing = [name for name in CONTACT_COLUMNS if name not in index.columns]
    if missing:
        raise DumpError(
            f"{path}: missing columns: {', '.join(missing)}. It has: {' '.join(index.columns)}"
        )
    return index


def contacts_at(index: DumpIndex, number: int) -> EngineContacts:
    """Read the contacts of one frame.

    Raises DumpError naming the line of a number that is not finite, an id that is none, a normal
    that is no unit vector, a disk that touches itself, and a contact that is listed twice."""
    table, here = index.table(number), range(number, number + 1)
    get = {name: table[:, index.columns.index(name)] for name in CONTACT_COLUMNS}
    first, second = (index.ids(here, get[name], name) for name in ("first", "second"))
    normal = np.column_stack([get["nx"], get["ny"]])
    wall = get["is_wall"] == 1
    again = _again((wall.astype(np.int64) << 62) + (first << 31) + second)
    for bad, what in (
        (np.asarray(~np.isfinite(table).all(axis=1)), "not a finite number"),
        (~wall & (get["is_wall"] != 0), "is_wall: 0 or 1 is needed"),
        (np.abs(np.hypot(*normal.T) - 1) > UNIT, "nx, ny: not a unit vector"),
        (~wall & (first >= second), "first: the smaller id of the two is needed"),
        (again, "this contact is listed twice"),
    ):
        index.refuse(here, bad, what)
    return EngineContacts(
        first=first,
        second=second,
        is_wall=wall,
        normal=normal,
        overlap=get["overlap"],
        force=np.column_stack([get["fx"], get["fy"]]),
    )


def _again(keys: Indices) -> Flags:
    """Which keys have occurred before."""
    if (keys[1:] > keys[:-1]).all():  # as every engine writes them
        return np.zeros(len(keys), dtype=bool)
    _, place = np.unique(keys, return_index=True)
    again = np.ones(len(keys), dtype=bool)
    again[place] = False
    return again


def read_contacts(path: Path) -> Iterator[EngineContacts]:
    """Read the contacts of a dump, frame by frame."""
    index = index_contacts(path)
    return (contacts_at(index, number) for number in range(len(index.frames)))


def arm_rows(arms: Arms, now: Snapshot, walls: Walls) -> Floats:
    """Give the rows of a contact dump of who reaches whom with arms: (k, 8), CONTACT_COLUMNS. Their
    overlap is below 0 where bodies do not touch."""
    near, push = arms.reached(now.position, now.radius, connected(walls))
    wall, first = near.second < 0, now.ids[near.first]
    other = np.where(wall, near.wall + 1, now.ids[near.second])
    swapped = ~wall & (first > other)
    normal = np.where(swapped, -1.0, 1.0)[:, None] * near.normal
    pairs = [np.where(swapped, other, first), np.where(swapped, first, other), wall]
    return np.column_stack([*pairs, normal, -near.gap, push[:, None] * normal])


def summed(tables: Sequence[Floats]) -> Floats:
    """Join tables (·, 8) of contacts in the order of a dump: their forces are summed where several
    have a contact, the rest is that of the first."""
    every = np.concatenate(tables)
    _, place, row = np.unique(every[:, [2, 0, 1]], axis=0, return_index=True, return_inverse=True)
    found = every[place]
    found[:, 6:] = 0.0
    np.add.at(found[:, 6:], row.ravel(), every[:, 6:])
    return found + 0.0  # no negative zeros


Key = tuple[int, int, bool]
# Impulses that miss the momentum change by more than this share deserve more frames.
FRAMES_NEEDED_FROM = 0.01
# The rule's order is between that of a jump and that of a smooth force.
LEAST_ORDER, MOST_ORDER = 1.0, 2.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Impulses:
    """Hold what the contacts of an impact gave, all frames together.

    error: the largest distance of that change from what these impulses give, as a share of the
        largest change
    frames_needed: about so many would bring the error to 1 %, by the error of every second frame"""

    contacts: EngineContacts  # as the engine wrote them; their `force` is ∫f dt, (k,2) N·s
    change: Floats  # (n,2) N·s, m(u_end − u_start − g T) of each disk, T the whole time
    error: float
    frames_needed: int


def integrate_contacts(
    index: DumpIndex,
    trajectory: Any,
    touching: Contacts,
    start: Snapshot,
    check: Callable[[int, EngineContacts], None],
    acceleration: Floats,
) -> Impulses:
    """Integrate every contact's force over all frames by the trapezoidal rule: ∫f dt.

    touching: contacts at the start; they jump to their damping force at once. Where frame 0 shows
        no force yet, theirs at t = 0 is extrapolated from the next two frames
    check: called with the number and the contacts of every frame
    acceleration: (2,) m/s², g of a body force"""
    times = np.array(index.steps) * trajectory.dt
    # of the rule over all frames, and over every second one
    weights = np.zeros((len(times), 2))
    weights[:, 0], weights[::2, 1] = _weights(times), _weights(times[::2])
    numbers: dict[Key, int] = {}
    seen: list[EngineContacts] = []
    first_forces: list[tuple[list[int], Floats]] = []
    sums = np.zeros((0, 2, 2))  # contact, rule, axis
    for frame in range(len(times)):
        contacts = contacts_at(index, frame)
        check(frame, contacts)
        keys = _keys(contacts.first, contacts.second, contacts.is_wall)
        seen.append(contacts.select(np.array([key not in numbers for key in keys], dtype=bool)))
        places = [numbers.setdefault(key, len(numbers)) for key in keys]
        sums = np.pad(sums, ((0, len(numbers) - len(sums)), (0, 0), (0, 0)))
        sums[places] += weights[frame, :, None] * contacts.force[:, None]
        if frame < 5:
            first_forces.append((places, contacts.force))
    early = np.zeros((5, len(numbers), 2))
    for force, (places, given) in zip(early, first_forces, strict=False):
        force[places] = given
    at_start = _touching_at_start(numbers, touching, start)
    every, end = EngineContacts.joined(seen), snapshot_of(trajectory[-1])
    gained = end.velocity - start.velocity - acceleration * (times[-1] - times[0])
    found = []
    for rule, some in enumerate((times, times[::2])):
        total = sums[:, rule]
        if len(some) > 2:
            first, second, third = early[: 2 * rule + 3 : rule + 1]
            late = at_start & ~first.any(axis=1)
            total[late] += 0.5 * (some[1] - some[0]) * (2 * second - third)[late]
        found.append(_against_change(replace(every, force=total), start, gained))
    fine, coarse = found
    return replace(fine, frames_needed=_frames_needed(len(times) - 1, fine.error, coarse.error))


def _weights(times: Floats) -> Floats:
    """Of the trapezoidal rule at some times, s."""
    intervals = np.diff(times)
    return 0.5 * (np.pad(intervals, (0, 1)) + np.pad(intervals, (1, 0)))


def _keys(first: Indices, second: Indices, is_wall: Flags) -> list[Key]:
    return list(zip(first.tolist(), second.tolist(), is_wall.tolist(), strict=True))


def _touching_at_start(numbers: dict[Key, int], touching: Contacts, start: Snapshot) -> Flags:
    """Which of the contacts that the engine ever had touch at t = 0."""
    second = np.where(
        touching.is_wall, touching.second + 1, start.ids[touching.second * ~touching.is_wall]
    )
    keys = _keys(start.ids[touching.first], second, touching.is_wall)
    return np.isin(np.arange(len(numbers)), [numbers.get(key, -1) for key in keys])


def _against_change(contacts: EngineContacts, start: Snapshot, gained: Floats) -> Impulses:
    """Impulses, in order of their first appearance, against the velocity (n,2) m/s that they
    gave."""
    wall = contacts.is_wall
    first = np.searchsorted(start.ids, contacts.first)
    second = np.searchsorted(start.ids, np.where(wall, start.ids[0], contacts.second))
    given = sum_at_disks(
        first, np.where(wall, -1, second), -contacts.force, contacts.force, len(start)
    )
    change = start.mass[:, None] * gained
    error = float(np.abs(change - given).max()) / (float(np.abs(change).max()) or 1.0)
    return Impulses(contacts=contacts, change=change, error=error, frames_needed=0)


def _frames_needed(frames: int, error: float, error_of_half: float) -> int:
    """About how many frames bring the error to 1 %: it falls with the order that halving shows."""
    if not error > FRAMES_NEEDED_FROM:
        return frames
    order = LEAST_ORDER
    if error_of_half > error:
        order = min(MOST_ORDER, max(LEAST_ORDER, math.log2(error_of_half / error)))
    return int(np.ceil(frames * (error / FRAMES_NEEDED_FROM) ** (1 / order)))
