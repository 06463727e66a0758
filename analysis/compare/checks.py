"""Whether a run folder holds what it says: one scene, its dumps, and contacts of its disks."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from analysis.dumps import DumpError, DumpIndex, EngineContacts, snapshot_of
from analysis.engines.record import FINISHED, EngineError, RunRecord
from analysis.scene.scene import Scene
from nscd import Snapshot

# Engines write what they read, and contacts of what they write, to rounding.
SAME = 1e-9


def check_record(folder: Path, record: RunRecord, scene: Scene) -> None:
    """Refuse a record that is not of this scene, or of a run that has not ended.

    Raises EngineError naming the file and the key."""
    path, run = folder / "run.json", scene.run
    if record.exit_state != FINISHED:
        raise EngineError(f"{path}: exit_state: {record.exit_state}; the run has not finished")
    if record.scene_digest != scene.digest():
        raise EngineError(
            f"{path}: scene_digest: scene.toml and scene.data beside it are not the scene of this run"
        )
    if record.disks != len(scene.snapshot):
        raise EngineError(
            f"{path}: disks: {record.disks}; scene.toml beside it has {len(scene.snapshot)}"
        )
    step, asked = record.time_step_s, run.time_step_s
    whole = step * record.steps
    good = math.isclose(step, asked, rel_tol=SAME) if asked else _near(whole, run.duration_s)
    if not (step > 0 and good):
        raise EngineError(
            f"{path}: time_step_s: {step:g} s in {record.steps} steps is not the run of scene.toml "
            f"beside it ({asked or run.duration_s:g} s)"
        )


def check_bodies(path: Path, trajectory: Any, record: RunRecord, scene: Scene) -> None:
    """Refuse a body dump that does not begin with the scene's disks, or has other frames.

    Raises DumpError naming the file and what differs."""
    due = tuple(range(0, record.steps + 1, max(1, record.frame_interval)))
    if trajectory.steps != due:
        raise DumpError(f"{path}: its steps are not those of run.json beside it")
    start, expected = snapshot_of(trajectory[0], path), scene.snapshot
    if not np.array_equal(start.ids, expected.ids):
        raise DumpError(f"{path}: its disks are not those of scene.data beside it")
    for name in ("position", "velocity", "radius", "mass"):
        found, wanted = getattr(start, name), getattr(expected, name)
        error = np.abs(found - wanted).reshape(len(start), -1).max(1)
        if not (error <= SAME * max(1.0, float(np.abs(wanted).max()))).all():
            disk = start.ids[int(np.argmax(error))]
            raise DumpError(
                f"{path}: {name} of disk {disk} at the start is not that of scene.data beside it"
            )


def check_contacts(
    index: DumpIndex, number: int, contacts: EngineContacts, snapshot: Snapshot, scene: Scene
) -> None:
    """Refuse contacts of disks or walls that do not exist, and such as are not where the disks are.

    Raises DumpError naming the line."""
    wall, walls = contacts.is_wall, scene.wall_segments()
    known = np.isin(contacts.first, snapshot.ids)
    known &= np.where(wall, contacts.second <= len(walls), np.isin(contacts.second, snapshot.ids))
    line = index.frames[number].line
    if not known.all():
        row = int(np.argmin(known))
        raise DumpError(
            f"{index.path}, line {line + row}: a contact of {contacts.first[row]} and "
            f"{'wall ' if wall[row] else ''}{contacts.second[row]}, which the scene has not"
        )
    first = np.searchsorted(snapshot.ids, contacts.first)
    other = np.searchsorted(snapshot.ids, np.where(wall, snapshot.ids[0], contacts.second))
    end = snapshot.position[other].copy()
    reach = snapshot.radius[first] + np.where(wall, 0.0, snapshot.radius[other])
    if wall.any():
        end[wall] = walls.nearest_point(snapshot.position[first[wall]], contacts.second[wall] - 1)
    way = end - snapshot.position[first]
    off = np.abs(way - (reach - contacts.overlap)[:, None] * contacts.normal).max(1, initial=0.0)
    if not (off <= SAME + SAME * reach).all():
        row = int(np.argmax(off))
        raise DumpError(
            f"{index.path}, line {line + row}: overlap and normal are not those of disk "
            f"{contacts.first[row]} in bodies.dump beside it"
        )


def frame_of(steps: tuple[int, ...], time_step: float, time: float | None, default: float) -> int:
    """Find the frame of an instant `time` (s), or the one nearest to the scene's where none is
    asked.

    Raises DumpError for an instant that is not within the run."""
    times = np.array(steps) * time_step
    if time is not None and not times[0] <= time <= times[-1] * (1 + SAME):
        raise DumpError(f"time: {time:g} s; the run is from {times[0]:g} to {times[-1]:g} s")
    return int(np.argmin(np.abs(times - (default if time is None else time))))


def _near(a: float, b: float) -> bool:
    return math.isclose(a, b, rel_tol=1e-6)
