"""Films of filmed crowds: heads made disks, frame by frame, and their percussions."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from analysis.film.frame import Frame, Reel, frame_of
from analysis.film.frames import Frames
from analysis.percussions import Setting, SnapshotPercussions, percussions_of
from analysis.scene.real.import_crowd import ImportedCrowd, place_crowd
from analysis.scene.real.separate import OverlapError
from analysis.scene.real.trajectory import Heads, Recording, TrajectoryError
from analysis.scene.scene import Room, Scene, SceneError, read_room
from analysis.support.parallel import Task, do_all
from analysis.support.progress import Progress
from nscd import Snapshot
from nscd.percussions import Status

# Of a file of fewer rows; one of more has no more frames than rows.
MOST_FRAMES = 1000


def film_heads(
    recording: Recording,
    room: Path,
    radii: Sequence[float],
    frames: Frames | None = None,
    *,
    mass: float = 75.0,
    progress: Progress | None = None,
    executor: Executor | None = None,
) -> list[Reel]:
    """Make a reel of a recording for each radius (m) of its people, in the order of the radii.

    frames: of the file; about 50, evenly spread, where left out
    mass: kg
    executor: whose workers measure the frames; this process where left out

    In each frame people are moved apart from where the frame before left them. Where they cannot
    be, or nobody is there, the frame has the status `failed` and its reason. Raises
    TrajectoryError, SceneError and ValueError naming the file, the frame, the person or the key."""
    first, last = recording.ends
    numbers = (frames or Frames()).of(first, last, recording.file)
    if len(numbers) > max(MOST_FRAMES, len(recording.data)):
        raise ValueError(
            f"--frames: {len(numbers)}; {recording.file} has only {len(recording.data)} rows"
        )
    shift = max(0, 1 - int(recording.data.id.min()))
    parts, _ = read_room(room, (float(np.mean(radii)), mass))
    if parts.drive is None:
        raise SceneError(f"{room}: drive: is missing; who walks where presses these people?")
    stills = {number: _still(recording, number, shift) for number in numbers}
    reels: list[Reel] = []
    label, every = f"film of {recording.file.name}", sorted(set(radii))
    for radius in every:
        tasks: list[Task] = []
        crowd: ImportedCrowd | None = None
        found: SnapshotPercussions | None = None
        for place, (number, still) in enumerate(stills.items()):
            time = number / recording.frame_rate
            if progress:
                progress(label, (len(reels) + place / len(stills)) / len(every))
            try:
                if isinstance(still, TrajectoryError):
                    raise still
                crowd = place_crowd(still, radius=radius, room=room, mass=mass, before=crowd)
            except (OverlapError, SceneError, TrajectoryError) as error:
                tasks.append(Task(call=_failed, arguments=(number, time, str(error)), work=0.0))
                continue
            snapshot = replace(crowd.scene.snapshot, time=time)
            found = percussions_of(Setting.of(crowd.scene), snapshot, before=found)
            call = partial(frame_of, heads=crowd.heads, account=crowd.report)
            tasks.append(Task(call=call, arguments=(crowd.scene, number, found), work=1.0))
        made: list[Frame] = do_all(tasks, executor, label)
        if all(frame.found is None for frame in made):
            raise ValueError(made[0].reason)
        reels.append(
            Reel(
                title=f"radius {radius:g} m",
                engine="",
                scene=_empty(parts, room),
                frames=made,
                radius=radius,
                shift=shift,
            )
        )
    return reels


def _still(recording: Recording, number: int, shift: int) -> Heads | TrajectoryError:
    """The heads of a frame, or why there are none; velocities are not asked for: who is held has
    none, and sees where to walk."""
    try:
        still = recording.still(number)
    except TrajectoryError as error:
        return error
    return replace(still, ids=still.ids + shift)


def _failed(number: int, time: float, reason: str) -> Frame:
    return Frame(number=number, time=time, status=str(Status.FAILED), reason=reason)


def _empty(parts: Room, room: Path) -> Scene:
    """The room as a scene with nobody in it."""
    nobody = Snapshot(
        position=np.zeros((0, 2)), velocity=np.zeros((0, 2)), radius=np.zeros(0), mass=np.zeros(0)
    )
    return Scene.of(parts, name=room.stem, snapshot=nobody)
