"""Contact dumps: who touches whom and with which force, and the impulses that these forces sum to."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.dumps.find_frames import DumpError
from analysis.dumps.index import DumpIndex, index_dump
from analysis.dumps.open_dump import open_bodies, snapshot_of
from analysis.support.files import whole_file
from analysis.support.write_frames import write_frame
from nscd import Contacts, Snapshot, Walls
from nscd.arrays import Floats, Indices, Mask
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
    is_wall: Mask
    normal: Floats
    overlap: Floats
    force: Floats

    def __len__(self) -> int:
        return len(self.first)

    def select(self, keep: Mask | Indices) -> EngineContacts:
        """Take the contacts that a mask chooses, or places in their order."""
        names = [field.name for field in fields(self)]
        return EngineContacts(**{name: getattr(self, name)[keep] for name in names})

    def on_walls(self, ids: Indices, walls: int) -> EngineContacts:
        """Give the contacts with disks of these ids as those with walls behind so many others; not those
        that they have with each other and with walls."""
        fixed = np.isin(self.first, ids)
        either = fixed | (~self.is_wall & np.isin(self.second, ids))
        who, sign = np.where(fixed, self.first, self.second), np.where(fixed, -1.0, 1.0)[:, None]
        turned = replace(
            self,
            first=np.where(fixed, self.second, self.first),
            second=np.where(either, np.searchsorted(ids, who) + walls + 1, self.second),
            is_wall=self.is_wall | either,
            normal=sign * self.normal,
            force=sign * self.force,
        )
        return turned.select(~(fixed & self.is_wall) & ~np.isin(turned.first, ids))

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
    keys = keys_of(first, second, wall)
    again = np.ones(len(keys), dtype=bool)
    again[np.unique(keys, return_index=True)[1]] = False
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


def keys_of(first: Indices, second: Indices, is_wall: Mask) -> Indices:
    """Number contacts (k,), each by whom it joins."""
    return (is_wall.astype(np.int64) << 62) + (first << 31) + second


def read_contacts(path: Path) -> Iterator[EngineContacts]:
    """Read the contacts of a dump, frame by frame."""
    index = index_contacts(path)
    return (contacts_at(index, number) for number in range(len(index.frames)))


def arm_rows(arms: Arms, now: Snapshot, walls: Walls) -> Floats:
    """Give the rows of a contact dump of who reaches whom with arms: (k, 8), CONTACT_COLUMNS. Their
    overlap is below 0 where bodies do not touch."""
    neighbours, push = arms.reached(now.position, now.radius, connected(walls))
    wall, first = neighbours.second < 0, now.ids[neighbours.first]
    other = np.where(wall, neighbours.wall + 1, now.ids[neighbours.second])
    swapped = ~wall & (first > other)
    normal = np.where(swapped, -1.0, 1.0)[:, None] * neighbours.normal
    pairs = [np.where(swapped, other, first), np.where(swapped, first, other), wall]
    return np.column_stack([*pairs, normal, -neighbours.gap, push[:, None] * normal])


def add_arms(folder: Path, arms: Arms, walls: Walls) -> None:
    """Add to contacts.dump of a run's folder who reaches whom with arms: forces of bodies and arms are
    summed where there are both, the rest is that of the bodies."""
    index = index_dump(folder / "contacts.dump", "ENTRIES")
    trajectory: Any = open_bodies(folder / "bodies.dump").trajectory
    with index.path.open(encoding="utf-8") as file:
        box = "".join(itertools.islice(file, 5, 8))
    with whole_file(index.path) as out:
        for frame, step in enumerate(index.steps):
            pushes = arm_rows(arms, snapshot_of(trajectory[frame]), walls)
            every, keys = np.concatenate([index.table(frame), pushes]), [2, 0, 1]
            _, index_of, row = np.unique(
                every[:, keys], axis=0, return_index=True, return_inverse=True
            )
            rows = every[index_of]
            rows[:, 6:] = 0.0
            np.add.at(rows[:, 6:], row.ravel(), every[:, 6:])
            rows = rows + 0.0  # no negative zeros
            columns = [*rows[:, :3].T.astype(int), *rows[:, 3:].T]
            write_frame(out, "ENTRIES", step, CONTACT_COLUMNS, columns, box=box)


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
    contacts_of: Callable[[int], EngineContacts],
    trajectory: Any,
    times: Floats,
    in_contact: Contacts,
    start: Snapshot,
    acceleration: Floats,
) -> Impulses:
    """Integrate every contact's force over all frames by the trapezoidal rule: ∫f dt.

    contacts_of: gives those of a frame; times: s, of the frames
    in_contact: contacts at the start; they jump to their damping force at once. Where frame 0 shows
        no force yet, theirs at t = 0 is extrapolated from the next two frames
    acceleration: (2,) m/s², g of a body force"""
    # of the rule over all frames, and over every second one
    weights = np.zeros((len(times), 2))
    weights[:, 0], weights[::2, 1] = _weights(times), _weights(times[::2])
    frames = [contacts_of(frame) for frame in range(len(times))]
    frame = np.repeat(np.arange(len(times)), [*map(len, frames)])
    every = EngineContacts.joined(frames)
    keys = keys_of(every.first, every.second, every.is_wall)
    _, present, index = np.unique(keys, return_index=True, return_inverse=True)
    order = np.argsort(present)  # contacts are numbered as they first appear
    number = np.argsort(order)[index]
    sums = np.zeros((len(order), 2, 2))  # contact, rule, axis
    np.add.at(sums, number, weights[frame, :, None] * every.force[:, None])
    early, soon = np.zeros((5, len(order), 2)), frame < 5
    early[frame[soon], number[soon]] = every.force[soon]
    every = every.select(present[order])
    other = np.where(
        in_contact.is_wall, in_contact.second + 1, start.ids[in_contact.second * ~in_contact.is_wall]
    )
    touched = keys_of(start.ids[in_contact.first], other, in_contact.is_wall)
    at_start, end = np.isin(keys[present[order]], touched), snapshot_of(trajectory[-1])
    change = end.velocity - start.velocity - acceleration * (times[-1] - times[0])
    change *= start.mass[:, None]
    one = np.searchsorted(start.ids, every.first)
    two = np.searchsorted(start.ids, np.where(every.is_wall, start.ids[0], every.second))
    errors = []
    for rule, some in enumerate((times, times[::2])):
        total = sums[:, rule]
        if len(some) > 2:
            first, second, third = early[: 2 * rule + 3 : rule + 1]
            late = at_start & ~first.any(axis=1)
            total[late] += 0.5 * (some[1] - some[0]) * (2 * second - third)[late]
        values = sum_at_disks(one, np.where(every.is_wall, -1, two), -total, total, len(start))
        errors.append(float(np.abs(change - values).max()) / (float(np.abs(change).max()) or 1.0))
    return Impulses(
        contacts=replace(every, force=sums[:, 0]),
        change=change,
        error=errors[0],
        frames_needed=_frames_needed(len(times) - 1, *errors),
    )


def _weights(times: Floats) -> Floats:
    """Of the trapezoidal rule at some times, s."""
    intervals = np.diff(times)
    return 0.5 * (np.pad(intervals, (0, 1)) + np.pad(intervals, (1, 0)))


def _frames_needed(frames: int, error: float, error_of_half: float) -> int:
    """About how many frames bring the error to 1 %: it falls with the order that halving shows."""
    if not error > FRAMES_NEEDED_FROM:
        return frames
    order = LEAST_ORDER
    if error_of_half > error:
        order = min(MOST_ORDER, max(LEAST_ORDER, math.log2(error_of_half / error)))
    return int(np.ceil(frames * (error / FRAMES_NEEDED_FROM) ** (1 / order)))
