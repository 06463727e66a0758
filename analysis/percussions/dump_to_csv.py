"""Percussions of a dump file, written as CSV."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from MDAnalysis.analysis.backends import BackendBase

from analysis.dumps import DumpError, open_bodies
from analysis.engines.record import EngineError, RunRecord
from analysis.percussions.snapshot import LeftVelocity
from analysis.percussions.trajectory import CSV_HEADER, PercussionAnalysis, contact_rows
from analysis.scene.scene import Scene, read_scene
from analysis.support.files import whole_file
from analysis.support.parallel import workers
from nscd import Walls

BLOCK = 64


def solve_dump(
    dump: Path,
    walls: Path | None,
    left_velocity: LeftVelocity | None,
    window: float | None,
    time_step: float | None,
    contact_tolerance: float,
    tolerance: float,
    processes: int,
    out: Path,
    progress: Callable[[str, float], None] | None = None,
) -> list[str]:
    """Solve every frame and write `out` (one row a contact, columns CSV_HEADER); return a line a
    frame that is not solved.

    Frames are solved and written in blocks, so that neither the dump nor the answers need to fit in
    memory. Raises DumpError for a damaged dump, one without any contact, and whatever the scene or
    the left velocity lack."""
    scene = _scene(dump, walls)
    drive = scene.drive if scene else None
    kind: LeftVelocity = left_velocity or ("desired" if drive else "dump")
    universe = open_bodies(dump, _time_step(dump, time_step))
    frames = universe.trajectory.n_frames
    segments: Walls | None = scene.wall_segments() if scene else None
    unsolved: list[str] = []
    rows = 0
    with whole_file(out) as file, _pool(processes) as pool:
        file.write(CSV_HEADER + "\n")
        for start in range(0, frames, BLOCK):
            stop = min(start + BLOCK, frames)
            analysis = PercussionAnalysis(
                universe,
                walls=segments,
                drive=drive,
                left_velocity=kind,
                window=window,
                tolerance=tolerance,
                contact_tolerance=contact_tolerance,
            )
            analysis.run(start=start, stop=stop, n_parts=min(processes, stop - start), **pool)
            for frame, contacts, answer in zip(
                range(start, stop),
                analysis.results.contacts,
                analysis.results.percussions,
                strict=True,
            ):
                time = float(analysis.times[frame - start])
                if answer.status != "solved":
                    unsolved.append(
                        f"{dump}, frame {frame} ({time:g} s): {answer.status}: {answer.reason}"
                    )
                lines = contact_rows(time, analysis.ids, contacts, answer)
                rows += len(lines)
                file.writelines(line + "\n" for line in lines)
            if progress:
                progress(f"percussions of {dump}", stop / frames)
        if not rows:
            raise DumpError(
                f"{dump}: no contact in any frame (gap ≤ {contact_tolerance:g} m); nothing was written"
            )
    return unsolved


class _Pool(BackendBase):  # type: ignore[misc]
    """The product's own pool as MDAnalysis wants it: its workers end with their parent."""

    def __init__(self, executor: Executor) -> None:
        self.executor = executor

    def apply(self, func: Callable[..., Any], computations: list[Any]) -> list[Any]:
        """Return what the function gives for each part of the frames."""
        return list(self.executor.map(func, computations))


@contextmanager
def _pool(processes: int) -> Iterator[dict[str, Any]]:
    """Give the options with which an analysis runs in so many processes."""
    if processes == 1:
        yield {}
        return
    with workers(processes) as executor:
        yield {"backend": _Pool(executor), "unsupported_backend": True}


def _scene(dump: Path, walls: Path | None) -> Scene | None:
    beside = dump.parent / "scene.toml"
    if walls is not None:
        return read_scene(walls)
    return read_scene(beside) if beside.exists() else None


def _time_step(dump: Path, given: float | None) -> float:
    if given is not None:
        return given
    try:
        return RunRecord.read(dump.parent).time_step_s
    except EngineError:
        raise DumpError(
            f"{dump}: no run.json beside it; give the time step of the simulation (--time-step, s)"
        ) from None
