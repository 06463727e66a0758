"""Seconds to post-process a trajectory: a dump of 1,000 frames of 594 disks read, its contacts
found and solved, and written as CSV and as Parquet.

A crowd that flows (arch) and one that comes to rest (jam).

Usage: python benchmarks/trajectory.py [--frames N] [--disks N] [--workers 1 2] [--folder DIR];
LAMMPS runs once a folder."""

import itertools
import resource
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from analysis.engines.run import simulate
from analysis.percussions.setting import setting_beside
from analysis.percussions.solving import DumpToSolve, executor_for, solve_dump
from analysis.percussions.table import is_parquet
from analysis.scene.shipped_scenes import make
from benchmarks.machine import describe, head, line, options

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


def whole(dump: Path, workers: int, frames: int, out: Path) -> None:
    """One row: the whole dump to a table."""
    setting = setting_beside(dump, left_velocity="desired", contact_tolerance=TOUCH)
    job = DumpToSolve(path=dump, setting=setting, tolerance=TOLERANCE, openness="none")
    # kernels are loaded before; of another dump to the cache, so that frames are found once more
    replace(job, time_step=1.0, parquet=is_parquet(out)).solve(range(frames - 3, frames))
    started, used = time.perf_counter(), cpu_seconds()
    with executor_for(job, workers) as executor:
        found = solve_dump(job, out, executor=executor, workers=workers)
    wall, cpu = time.perf_counter() - started, cpu_seconds() - used
    spent = f"{wall:.2f}", f"{cpu:.2f}", f"{1e3 * wall / frames:.2f}"
    print(line([out.suffix[1:], workers, *spent, found.contacts, len(found.unsolved)]))


def cpu_seconds() -> float:
    """CPU seconds of this process and of its ended children."""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(u.ru_utime + u.ru_stime for u in used)


if __name__ == "__main__":
    main()
