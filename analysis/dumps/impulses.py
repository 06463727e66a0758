"""Contact impulses of an impact: the engine's contact forces integrated over its dumps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from analysis.dumps.contacts import EngineContacts, contacts_at
from analysis.dumps.reader import snapshot_of
from analysis.dumps.table import DumpIndex
from nscd import Contacts, Snapshot
from nscd.arrays import Floats
from nscd.contacts import sum_at_disks

Key = tuple[int, int, bool]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Impulses:
    """What the contacts of an impact gave, all frames together.

    contacts: as the engine wrote them; their `force` is ∫f dt, (k,2) N·s
    change: (n,2) N·s, m(u_end − u_start) of each disk
    error: the largest distance of that change from what these impulses give, as a share of the
        largest change
    """

    contacts: EngineContacts
    change: Floats
    error: float


def integrate_contacts(
    index: DumpIndex, trajectory: Any, touching: Contacts, start: Snapshot
) -> Impulses:
    """Integrate every contact's force over all frames by the trapezoidal rule: ∫f dt.

    touching: contacts at the start; they jump to their damping force at once. Where frame 0 shows
        no force yet, theirs at t = 0 is extrapolated from the next two frames."""
    intervals = np.diff(np.array(index.steps) * trajectory.dt)
    weights = 0.5 * (np.pad(intervals, (0, 1)) + np.pad(intervals, (1, 0)))
    numbers: dict[Key, int] = {}
    seen: list[EngineContacts] = []
    early: list[dict[int, Floats]] = []
    total = np.zeros((0, 2))
    for frame, weight in enumerate(weights):
        contacts = contacts_at(index, frame)
        keys: list[Key] = list(
            zip(
                contacts.first.tolist(),
                contacts.second.tolist(),
                contacts.is_wall.tolist(),
                strict=True,
            )
        )
        seen.append(contacts.select(np.array([key not in numbers for key in keys], dtype=bool)))
        places = [numbers.setdefault(key, len(numbers)) for key in keys]
        total = np.pad(total, ((0, len(numbers) - len(total)), (0, 0)))
        total[places] += weight * contacts.force
        if frame < 3:
            early.append(dict(zip(places, contacts.force, strict=True)))
    if len(early) == 3:
        for number in _touching_at_start(numbers, touching, start):
            first, second, third = (forces.get(number, np.zeros(2)) for forces in early)
            if not first.any():
                total[number] += 0.5 * intervals[0] * (2 * second - third)
    contacts = replace(EngineContacts.joined(seen), force=total)
    return _impulses(contacts, start, snapshot_of(trajectory[-1]))


def _touching_at_start(numbers: dict[Key, int], touching: Contacts, start: Snapshot) -> list[int]:
    """The numbers of the contacts that touch at t = 0, of those that the engine ever had."""
    keys = (
        (int(start.ids[i]), j + 1 if wall else int(start.ids[j]), wall)
        for i, j, wall in zip(
            touching.first.tolist(),
            touching.second.tolist(),
            touching.is_wall.tolist(),
            strict=True,
        )
    )
    return [numbers[key] for key in keys if key in numbers]


def _impulses(contacts: EngineContacts, start: Snapshot, end: Snapshot) -> Impulses:
    """The impulses of all contacts, in order of their first appearance, against the change."""
    wall = contacts.is_wall
    first = np.searchsorted(start.ids, contacts.first)
    second = np.searchsorted(start.ids, np.where(wall, start.ids[0], contacts.second))
    given = sum_at_disks(
        first, np.where(wall, -1, second), -contacts.force, contacts.force, len(start)
    )
    change = start.mass[:, None] * (end.velocity - start.velocity)
    error = float(np.abs(change - given).max()) / (float(np.abs(change).max()) or 1.0)
    return Impulses(contacts=contacts, change=change, error=error)
