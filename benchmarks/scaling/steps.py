"""Rigid steps of a heap before a 1 m exit that has moved for a second, by this installation on one
thread and on several, and by another one beside it: CPU of a step, its mean and that over the
first row's; the least wall time, and that over the first row's; the largest residual; how far
velocities are from the first row's after one step, as a share of the largest.

Usage: python benchmarks/scaling/steps.py [--sizes N …] [--threads N …] [--steps N] [--moved S]
[--beside PYTHON]

PYTHON is that of another installation, such as that of an earlier commit. Each is a process of its
own; they make the same steps in turn, so that all meet the same load."""

import argparse
import contextlib
import itertools
import subprocess
import sys
import tempfile
import time
import zlib
from collections.abc import Iterator
from pathlib import Path
from subprocess import PIPE

import numpy as np

from nscd import Snapshot, Walls
from nscd.stepping import Motion, Push

STEP_S = 0.005
COLUMNS = ("disks", "by", "CPU of a step", "of the first's", "wall", "at best", "residual", "off by")


def serve(path: str, threads: str, out: str) -> None:
    """Make a step for each line of the input, and say what it took; the velocities of the first go to
    a file."""
    crowd = np.load(path)
    who = Snapshot(**{name: crowd[name] for name in ("position", "velocity", "radius", "mass")})
    push = Push(desired=lambda _: crowd["desired"], relaxation_time=float(crowd["relaxation_time"]))
    several = {"threads": int(threads)} if threads != "1" else {}  # an earlier one has no threads
    walls = Walls(start=crowd["start"], end=crowd["end"])
    motion = Motion(who, walls, step=STEP_S, push=push, **several)
    for line in sys.stdin:
        before = time.perf_counter(), time.process_time()
        report = motion.advance()
        spent = time.perf_counter() - before[0], time.process_time() - before[1]
        if line == "first\n":
            np.save(out, motion.velocity)
        print(*spent, report.residual, zlib.crc32(motion.velocity.tobytes()), flush=True)


def moved(disks: int, seconds: float, path: Path) -> None:
    """Write the heap as it is after so long."""
    from analysis.engines.programs.rigid import motion_of
    from benchmarks.problems.families import heap
    from benchmarks.scaling.sizes import scene_of

    scene = scene_of(heap(disks))
    motion, walls, drive = motion_of(scene, scene.snapshot), scene.wall_segments(), scene.drive
    assert walls
    assert drive
    motion.separate()
    while motion.time < seconds - 1e-9:
        motion.advance()
    now = motion.snapshot()
    wanted = drive.desired_velocity(now.position, now.ids, seconds, now.radius)
    names = ("position", "velocity", "radius", "mass")
    known = {name: getattr(now, name) for name in names} | {"start": walls.start, "end": walls.end}
    np.savez(path, desired=wanted, relaxation_time=drive.relaxation_time_s, **known)


def rows(args: argparse.Namespace, disks: int) -> Iterator[list[str]]:
    """A row for each installation and number of threads."""
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        moved(disks, args.moved, crowd := Path(folder) / "crowd.npz")
        which = {f"threads: {n}": (sys.executable, str(n)) for n in args.threads}
        which |= {"beside": (str(args.beside), "1")} if args.beside else {}
        running = {}
        for name, (python, threads) in which.items():
            words = [python, __file__, "serve", str(crowd), threads, f"{folder}/{name}.npy"]
            process = subprocess.Popen(words, stdin=PIPE, stdout=PIPE, text=True)
            running[name] = stack.enter_context(process)
        spent: dict[str, list[list[float]]] = {name: [] for name in running}
        for turn, (name, process) in itertools.product(range(args.steps), running.items()):
            assert process.stdin
            assert process.stdout
            process.stdin.write("next\n" if turn else "first\n")
            process.stdin.flush()
            spent[name].append([float(word) for word in process.stdout.readline().split()])
        first = np.array(spent[next(iter(spent))])
        before = np.load(f"{folder}/{next(iter(spent))}.npy")
        for name, of in spent.items():
            wall, cpu, residual, bits = np.array(of).T
            off = np.abs(np.load(f"{folder}/{name}.npy") - before).max() / np.abs(before).max()
            same = "no bit" if np.array_equal(bits, first[:, 3]) else f"{off:.0e}"
            yield [
                f"{disks:,}", name, f"{1e3 * cpu.mean():.1f} ms", f"{cpu.mean() / first[:, 1].mean():.2f}",
                f"{1e3 * wall.min():.1f} ms", f"{wall.min() / first[:, 0].min():.2f}",
                f"{residual.max():.0e}", same,
            ]  # fmt: skip


def main() -> None:
    """Measure and print."""
    from benchmarks.machine import options, show

    args = options(__doc__, sizes=(1000, 5000, 20_000), threads=(1, 2), steps=20, moved=1.0, beside=Path)
    show(COLUMNS, (row for disks in args.sizes for row in rows(args, disks)))


if __name__ == "__main__":
    serve(*sys.argv[2:]) if sys.argv[1:2] == ["serve"] else main()
