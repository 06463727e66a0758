"""Films of runs: an engine's contacts beside the percussions of the same snapshots."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path

import numpy as np

from analysis.compare.checks import check_contacts
from analysis.compare.comparison import open_run, rigid_law_of
from analysis.dumps import DumpError, contacts_at
from analysis.film.frame import Reel, frame_of
from analysis.film.frames import Frames
from analysis.pages.names import engine_name
from analysis.percussions import PercussionAnalysis
from analysis.support.parallel import Task, do_all
from analysis.support.progress import Progress

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
