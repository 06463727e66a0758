"""Further frames of a film, made crowds as the one that became a scene."""

from __future__ import annotations

from bisect import bisect
from collections.abc import Callable
from dataclasses import replace

from analysis.scene.account import OtherFrames
from analysis.scene.real.import_crowd import ImportedCrowd
from analysis.scene.real.separate import OverlapError
from analysis.scene.real.trajectory import Recording, TrajectoryError
from analysis.scene.scene import SceneError


def with_other_frames(
    imported: ImportedCrowd,
    recording: Recording,
    count: int,
    apart_s: float,
    make: Callable[[int], ImportedCrowd],
) -> tuple[ImportedCrowd, list[str]]:
    """Let a scene have the crowds of other frames of its film; return it and, for each frame of
    which no crowd can be made, why.

    count, apart_s: how many, and s between two; see `frames_near`
    make: makes a crowd of the frame of a number
    """
    report = imported.report
    found, crowds, refused, reasons = [], [], [], []
    for number in frames_near(report.frame, recording, count, apart_s):
        try:
            crowd = make(number).scene.snapshot
        except (TrajectoryError, SceneError, OverlapError) as error:
            refused.append(number)
            reasons.append(str(error))
        else:
            found.append(number)
            crowds.append(crowd)
    if not found and not refused:
        return imported, []
    after = [round((number - report.frame) / recording.frame_rate, 6) for number in found]
    others = OtherFrames(
        frames=tuple(found),
        after_s=tuple(after),
        data=OtherFrames.files(imported.scene.name, found),
        refused=tuple(refused),
    )
    changes = {"other_frames": others, "other_crowds": tuple(crowds)}
    return replace(imported, scene=imported.scene.model_copy(update=changes)), reasons


def frames_near(frame: int, recording: Recording, count: int, apart_s: float) -> list[int]:
    """List the numbers of so many other frames, nearest first, each `apart_s` from the next; nearer
    to each other, evenly, where the film is too short, and fewer where it has not so many."""
    first, last = recording.ends

    def near(step: int) -> tuple[range, range]:
        return range(frame - step, first - 1, -step), range(frame + step, last + 1, step)

    wanted = max(1, round(min(apart_s * recording.frame_rate, last - first)))
    # the largest step, from `wanted` down, that leaves room for so many
    steps = range(wanted, 0, -1)
    place = bisect(steps, -1, key=lambda step: sum(map(len, near(step))) - count)
    every = (number for side in near(steps[min(place, len(steps) - 1)]) for number in side[:count])
    return sorted(every, key=lambda number: abs(number - frame))[:count]
