"""Seconds to post-process a trajectory: a dump of 1,000 frames of 594 disks read, its contacts
found and solved, and written as CSV and as Parquet.

Beside it the parts: to find the frames and read their numbers, and to find and solve contacts.

A crowd that flows (arch) and one that comes to rest (jam); for both also the percussions of each
frame alone, and how far those of a block of frames are from them.

Usage: python benchmarks/trajectory.py [--frames N] [--disks N] [--workers 1 2] [--folder DIR];
LAMMPS runs once a folder."""

import itertools
import resource
import tempfile
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from analysis.dumps import index_dump, open_bodies
from analysis.engines.run import simulate
from analysis.percussions.setting import setting_beside
from analysis.percussions.snapshot import percussions_of
from analysis.percussions.solving import DumpToSolve, executor_for, solve_batch, solve_dump
from analysis.percussions.table import is_parquet
from analysis.scene.shipped_scenes import make
from benchmarks.machine import describe, head, line, options, timed

SCENES = ("arch", "jam")
TOLERANCE = 1e-10
# of the dumped positions (m), as far as disks that rest on each other may be apart
TOUCH = 1e-6


def main() -> None:
    """Make the dump unless the folder has it; solve it with each number of workers; print a
    table."""
    given = options(__doc__, frames=1000, disks=594, workers=(1, 2), folder=Path)
    print(describe())
    with tempfile.TemporaryDirectory() as brief:
        folder = given.folder or Path(brief)
        for name in SCENES:
            dump = folder / f"{name}_{given.disks}_{given.frames}" / "bodies.dump"
            if not dump.exists():
                scene = make(name, given.disks).with_run(frames=given.frames)
                record = simulate(scene, "lammps", dump.parent)
                print(f"LAMMPS took {record.wall_seconds:.0f} s")
            size = f"{dump.stat().st_size / 1e6:.0f} MB"
            print(
                f"\n{name}: {size}, {given.frames} frames of {given.disks} disks, to {TOLERANCE:g}\n"
            )
            names = ("wall s", "CPU s", "ms per frame", "contacts", "not solved")
            print(head("table", "workers", *names))
            for kind, workers in itertools.product(("csv", "parquet"), given.workers):
                whole(dump, workers, given.frames, folder / f"contacts.{kind}")
            parts(dump)
            alone(dump)


def job_of(dump: Path) -> DumpToSolve:
    """What is asked of the dump."""
    setting = setting_beside(dump, left_velocity="desired", contact_tolerance=TOUCH)
    return DumpToSolve(path=dump, setting=setting, tolerance=TOLERANCE, openness="none")


def whole(dump: Path, workers: int, frames: int, out: Path) -> None:
    """One row: the whole dump to a table."""
    job = job_of(dump)
    # kernels are loaded before; of another dump to the cache, so that frames are found once more
    replace(job, time_step=1.0, parquet=is_parquet(out)).solve(range(frames - 3, frames))
    started, used = time.perf_counter(), cpu_seconds()
    with executor_for(job, workers) as executor:
        found = solve_dump(job, out, executor=executor, workers=workers)
    wall, cpu = time.perf_counter() - started, cpu_seconds() - used
    spent = f"{wall:.2f}", f"{cpu:.2f}", f"{1e3 * wall / frames:.2f}"
    print(line([out.suffix[1:], workers, *spent, found.contacts, len(found.unsolved)]))
    print(*(f"    {words}\n" for words in found.unsolved[:3]), sep="", end="")


def parts(dump: Path) -> None:
    """CPU seconds of finding the frames, reading their numbers, and the rest up to percussions."""
    job = job_of(dump)
    found, index = timed(partial(index_dump, dump))
    trajectory = open_bodies(dump).trajectory
    read, solving = 0.0, 0.0
    for block in job.blocks(range(len(index.frames))):
        seconds, text = timed(partial(index.text, block))
        read += seconds + timed(partial(index.numbers, block, text))[0]
        bodies = trajectory.bodies(block, text, needs_velocity=False)
        solving += timed(partial(solve_batch, bodies, job.setting, job.tolerance))[0]
    print(
        f"CPU s of one thread: frames found {found:.2f}, numbers read {read:.2f} "
        f"({dump.stat().st_size / 1e6 / read:.0f} MB/s), contacts and percussions {solving:.2f}"
    )


def alone(dump: Path) -> None:
    """CPU seconds of each frame alone, and how far its reactions are from those of the block."""
    job, used, apart, left = job_of(dump), 0.0, [], 0
    trajectory = open_bodies(dump).trajectory
    for block in job.blocks(range(trajectory.n_frames)):
        text = trajectory.index.text(block)
        bodies = trajectory.bodies(block, text, needs_velocity=False)
        found = solve_batch(bodies, job.setting, job.tolerance)
        for number in range(len(block)):
            snapshot = bodies.snapshot(number)
            once = partial(percussions_of, job.setting, snapshot, tolerance=job.tolerance)
            seconds, one = timed(once)
            used += seconds
            left += not found.answered[number]
            together = found.reaction[slice(*found.start[number : number + 2])]
            if len(together) and (together != one.answer.reaction).any():
                far = np.abs(together - one.answer.reaction).max()
                apart.append(far / one.answer.reaction.max())
    print(
        f"contacts and percussions of each frame alone {used:.2f} CPU s; {len(apart)} frames differ "
        f"from it, by up to {max(apart, default=0.0):.0e} of the largest reaction; {left} are left to it"
    )


def cpu_seconds() -> float:
    """CPU seconds of this process and of its ended children."""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(u.ru_utime + u.ru_stime for u in used)


if __name__ == "__main__":
    main()
