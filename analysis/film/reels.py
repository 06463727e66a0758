"""Reels of a film: of runs, and of the heads of a real trajectory."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from analysis.compare.comparison import check_contacts, open_run, rigid_law_of
from analysis.dumps import DumpError, contacts_at
from analysis.film.frame import Frame, Frames, Reel, frame_of
from analysis.pages.names import engine_name
from analysis.percussions import PercussionAnalysis, Setting, SnapshotPercussions, percussions_of
from analysis.scene.real.import_crowd import ImportedCrowd, place_crowd
from analysis.scene.real.separate import OverlapError
from analysis.scene.real.trajectory import Heads, Recording, TrajectoryError
from analysis.scene.scene import Room, Scene, SceneError, read_room
from analysis.support.parallel import Task, do_all
from analysis.support.progress import Progress
from nscd import Snapshot
from nscd.percussions import Status

# The residual that the percussions of a comparison must reach.
TOLERANCE = 1e-10
# Runs whose frames differ by more than this share of the last time are not shown side by side.
SAME = 1e-6


def film_runs(
    folders: Sequence[Path],
    frames: Frames | None = None,
    progress: Progress | None = None,
    executor: Executor | None = None,
) -> list[Reel]:
    """Make a reel of each finished run.

    frames: of the dumps, from 0; about 50, evenly spread, where left out
    executor: whose workers match and measure the frames; this process where left out

    Runs of one engine are named by their folders too. Raises EngineError and DumpError for a folder
    that does not hold one finished run of its scene, ValueError for a folder that is given twice,
    for frames that are not there and for runs whose frames are not at the same times."""
    whole = [folder.resolve() for folder in folders]
    for number, folder in enumerate(whole):
        if folder in whole[:number]:
            raise ValueError(f"{folders[number]}: is given twice; a film shows a run once")
    reels = [_reel(folder, frames, progress, executor) for folder in folders]
    reels = [
        replace(reel, title=title) for reel, title in zip(reels, _titles(reels, whole), strict=True)
    ]
    times = [np.array([frame.time for frame in reel.frames]) for reel in reels]
    for folder, other in zip(folders[1:], times[1:], strict=True):
        if len(other) != len(times[0]) or np.abs(other - times[0]).max() > SAME * times[0].max():
            raise ValueError(f"{folder}: its frames are not at the times of those of {folders[0]}")
    return reels


def _titles(reels: Sequence[Reel], folders: Sequence[Path]) -> list[str]:
    """The names of engines; where two runs have one, followed by as much of the ends of their paths
    as keeps these apart."""
    titles = [reel.title for reel in reels]
    if len(set(titles)) == len(titles):
        return titles
    depth = next(
        depth
        for depth in range(1, max(len(folder.parts) for folder in folders) + 1)
        if len({folder.parts[-depth:] for folder in folders}) == len(folders)
    )
    ends = ["/".join(folder.parts[-depth:]) for folder in folders]
    alone = [titles.count(title) == 1 for title in titles]
    return [
        title if once else f"{title} ({end})"
        for title, once, end in zip(titles, alone, ends, strict=True)
    ]


def _reel(
    folder: Path, frames: Frames | None, progress: Progress | None, executor: Executor | None
) -> Reel:
    """The frames of one run."""
    run = open_run(folder)
    count = len(run.index.frames)
    chosen = (frames or Frames()).of(0, count - 1, folder)
    analysis = PercussionAnalysis(
        run.universe, run.scene, law=rigid_law_of(run.scene), tolerance=TOLERANCE
    )
    # one after the other: each is the guess of the next
    analysis.run(frames=list(chosen))
    tasks = []
    for number, found in zip(chosen, analysis.results.frames, strict=True):
        contacts = contacts_at(run.index, number)
        check_contacts(run.index, number, contacts, found.snapshot, run.scene)
        arguments = (run.scene, number, found, contacts)
        tasks.append(Task(call=frame_of, arguments=arguments, work=1.0))
    made = do_all(tasks, executor, f"film of {folder}", progress)
    if not any(len(frame.lower) for frame in made):
        raise DumpError(f"{folder}: no contact in any of its frames; there is nothing to see")
    name = engine_name(run.record.engine)
    return Reel(title=name, engine=run.record.engine, scene=run.scene, frames=made)


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
