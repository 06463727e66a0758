"""Contact impulses of an impact: the engine's contact forces integrated over its dumps."""

from __future__ import annotations

from typing import Any

import numpy as np

from analysis.dumps.reader import DumpIndex, EngineContacts, contacts_at, snapshot_of
from nscd import Contacts, Snapshot
from nscd.arrays import Floats
from nscd.contacts import sum_at_disks


def integrate_contacts(
    index: DumpIndex, trajectory: Any, time_step: float, touching: Contacts, start: Snapshot
) -> tuple[EngineContacts, float, Floats]:
    """∫f dt of every contact over all frames (trapezoidal rule), as EngineContacts whose `force` is
    an impulse in N·s.

    Contacts that touch at the start, `touching`, jump to their damping force at once; where frame 0
    shows no force yet, theirs at t = 0 is extrapolated from the next two frames. Also returned: the
    largest distance of the disks' momentum change from what these impulses give them, as a share of
    the largest change, and the change m(u_end − u_start) (n,2) N·s."""
    numbers: dict[tuple[int, int, bool], int] = {}
    normals: list[Floats] = []
    overlaps: list[float] = []
    forces: list[Floats] = []
    total = np.zeros((0, 2))
    for frame in range(len(index.steps)):
        contacts = contacts_at(index, frame)
        keys = list(
            zip(
                contacts.first.tolist(),
                contacts.second.tolist(),
                contacts.is_wall.tolist(),
                strict=True,
            )
        )
        for row, key in enumerate(keys):
            if key not in numbers:
                numbers[key] = len(numbers)
                normals.append(contacts.normal[row])
                overlaps.append(float(contacts.overlap[row]))
        at = [numbers[key] for key in keys]
        force = np.zeros((len(numbers), 2))
        force[at] = contacts.force
        total = np.pad(total, ((0, len(numbers) - len(total)), (0, 0)))
        if frame:
            interval = (index.steps[frame] - index.steps[frame - 1]) * time_step
            before = np.pad(forces[-1], ((0, len(numbers) - len(forces[-1])), (0, 0)))
            total += 0.5 * interval * (before + force)
        forces = [*forces[-1:], force] if frame != 2 else [*forces, force]
        if frame == 2:
            total += _jump_at_start(
                forces, numbers, touching, start, (index.steps[1] - index.steps[0]) * time_step
            )
    keys = list(numbers)
    summed = EngineContacts(
        step=index.steps[0],
        first=np.array([k[0] for k in keys], dtype=np.int64),
        second=np.array([k[1] for k in keys], dtype=np.int64),
        is_wall=np.array([k[2] for k in keys], dtype=bool),
        normal=np.array(normals).reshape(-1, 2),
        overlap=np.array(overlaps),
        force=total,
    )
    end = snapshot_of(trajectory[-1])
    change = start.mass[:, None] * (end.velocity - start.velocity)
    first, second = np.searchsorted(start.ids, [summed.first, summed.second])
    given = sum_at_disks(first, np.where(summed.is_wall, -1, second), -total, total, len(start))
    error = float(np.abs(change - given).max()) / (float(np.abs(change).max()) or 1.0)
    return summed, error, change


def _jump_at_start(
    forces: list[Floats],
    numbers: dict[tuple[int, int, bool], int],
    touching: Contacts,
    start: Snapshot,
    interval: float,
) -> Floats:
    """What the trapezoidal rule leaves out of the first interval for contacts that touch at t =
    0."""
    first, second, third = (np.pad(f, ((0, len(numbers) - len(f)), (0, 0))) for f in forces)
    jump = np.zeros((len(numbers), 2))
    for i, j, wall in zip(
        touching.first.tolist(), touching.second.tolist(), touching.is_wall.tolist(), strict=True
    ):
        number = numbers.get((int(start.ids[i]), j + 1 if wall else int(start.ids[j]), wall))
        if number is not None and not first[number].any():
            jump[number] = 0.5 * interval * (2 * second[number] - third[number])
    return jump
