"""Seconds to post-process a trajectory: a dump of 1,000 frames of 594 disks read, its contacts found and solved, and written.

Usage: python benchmarks/trajectory.py [--frames N] [--disks N] [--workers 1 2] [--folder DIR]; LAMMPS runs once a folder.
"""

from __future__ import annotations

import argparse
import contextlib
import resource
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from families import heap
from machine import describe

from analysis.engines import engine
from analysis.engines.record import RunRecord
from analysis.making import make
from analysis.trajectory import solve_dump
from nscd import solve

TOLERANCE = 1e-10
# of the dumped positions (m), as far as disks that rest on each other may be apart
TOUCH = 1e-6


def main() -> None:
    """Make the dump unless the folder has it; solve it with each number of workers; print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--disks", type=int, default=594)
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--folder", type=Path, help="where the dump is kept; a temporary one by default")
    given = parser.parse_args()
    print(describe())
    with folder_of(given.folder) as folder:
        dump = dump_of(folder / f"arch_{given.disks}_{given.frames}", given.disks, given.frames)
        print(
            f"{dump.stat().st_size / 1e6:.0f} MB, {given.frames} frames of {given.disks} disks, to {TOLERANCE:g}"
        )
        print(
            f"{'workers':>8}{'wall s':>10}{'CPU s':>10}{'ms a frame':>12}{'contacts':>11}{'not solved':>12}"
        )
        out = folder / "contacts.csv"
        # compiled kernels are loaded before, so that the first row does not pay for it
        case = heap(given.disks)
        solve(case.snapshot, case.contacts, left_velocity=case.left_velocity)
        for workers in given.workers:
            started, used = time.perf_counter(), cpu_seconds()
            unsolved = solve_dump(dump, None, "desired", None, None, TOUCH, TOLERANCE, workers, out)
            wall, cpu = time.perf_counter() - started, cpu_seconds() - used
            with out.open(encoding="utf-8") as rows:
                contacts = sum(1 for _ in rows) - 1
            each = 1e3 * wall / given.frames
            print(f"{workers:>8}{wall:>10.2f}{cpu:>10.2f}{each:>12.2f}{contacts:>11}{len(unsolved):>12}")
            for line in unsolved[:3]:
                print(f"    {line}")


def dump_of(folder: Path, disks: int, frames: int) -> Path:
    """The LAMMPS dump of `arch` in the folder, made if it is not there."""
    dump = folder / "bodies.dump"
    if not dump.exists():
        scene = make("arch", disks)
        lammps = engine("lammps")
        lammps.prepare(scene.with_run(frames=frames), folder)
        record: RunRecord = lammps.run(folder)
        print(f"LAMMPS took {record.wall_seconds:.0f} s")
    return dump


def cpu_seconds() -> float:
    """CPU seconds of this process and of its ended children."""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(u.ru_utime + u.ru_stime for u in used)


@contextlib.contextmanager
def folder_of(given: Path | None) -> Iterator[Path]:
    """The given folder, or a temporary one."""
    if given is not None:
        given.mkdir(parents=True, exist_ok=True)
        yield given
        return
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


if __name__ == "__main__":
    main()
