"""Rigid steps of a heap (seed 1) before a 1 m exit that has moved for a while, by this installation
on one thread and on several, and by another one: mean CPU of a step, least wall time, both over those
of the first row; the largest residual; how far the velocities of the last step are from the first
row's (m/s).

Usage: python -m benchmarks.scaling.steps [--sizes N …] [--threads N …] [--steps N] [--beside PYTHON]

PYTHON is that of another installation, such as that of an earlier commit. Each is a process of its
own; they make the same steps in turn, so that all meet the same load."""

import argparse
import contextlib
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from subprocess import PIPE

import numpy as np

from nscd import Snapshot, Walls
from nscd.stepping import Motion, Push

STEP_S = 0.005
DISKS = ("position", "velocity", "radius", "mass")
COLUMNS = ("disks", "by", "CPU", "ratio", "wall", "ratio", "residual", "off by")


def serve(path: str, threads: str, out: str) -> None:
    """Make a step for each line of the input, and say what it took."""
    crowd = np.load(path)
    push = Push(desired=lambda _: crowd["desired"], relaxation_time=float(crowd["tau"]))
    walls = Walls(start=crowd["start"], end=crowd["end"])
    motion = Motion(Snapshot(**{k: crowd[k] for k in DISKS}), walls, step=STEP_S, push=push)
    motion.threads = int(threads)
    for _ in sys.stdin:
        before = time.process_time(), time.perf_counter()
        residual = motion.advance().residual
        spent = time.process_time() - before[0], time.perf_counter() - before[1]
        np.save(out, motion.velocity)
        print(*spent, residual, flush=True)


def moved(disks: int, path: Path) -> None:
    """Write the heap of `sizes.py` as it is after it has moved, and what people wish then."""
    from benchmarks.scaling.sizes import move, scene_of

    print(move(disks, 1, path))
    crowd = dict(np.load(path))
    now = Snapshot(**{key: crowd[key] for key in DISKS})
    drive = scene_of(now, Walls(start=crowd["start"], end=crowd["end"])).drive
    assert drive
    desired = drive.desired_velocity(now.position, now.ids, 1.0, now.radius)
    np.savez(path, desired=desired, tau=drive.relaxation_time_s, **crowd)


def rows(args: argparse.Namespace, disks: int) -> Iterator[list[str]]:
    """A row for each number of threads, and for the other installation."""
    which = {f"{n} threads": (sys.executable, str(n)) for n in args.threads}
    which |= {"beside": (str(args.beside), "1")} if args.beside else {}
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        moved(disks, crowd := Path(folder) / "crowd.npz")
        running = []
        for name, words in which.items():
            command = [words[0], __file__, "serve", str(crowd), words[1], f"{folder}/{name}.npy"]
            process = subprocess.Popen(command, stdin=PIPE, stdout=PIPE, bufsize=0)
            running.append(stack.enter_context(process))
        spent = []
        for turn in range(args.steps * len(running)):
            into, out = running[turn % len(running)].stdin, running[turn % len(running)].stdout
            assert into and out  # noqa: PT018
            into.write(b"\n")
            spent.append([float(word) for word in out.readline().split()])
        found = np.array(spent).reshape(args.steps, -1, 3)
        first, *_ = velocity = [np.load(f"{folder}/{name}.npy") for name in which]
    times = np.array([found[:, :, 0].mean(axis=0), found[:, :, 1].min(axis=0)])
    for i, name in enumerate(which):
        pairs = zip(times[:, i], times[:, i] / times[:, 0], strict=True)
        cells = (cell for one, ratio in pairs for cell in (f"{1e3 * one:.1f} ms", f"{ratio:.2f}"))
        worst = found[:, i, 2].max(), np.abs(velocity[i] - first).max()
        yield [f"{disks:,}", name, *cells, *(f"{one:.0e}" for one in worst)]


def main() -> None:
    """Measure and print."""
    from benchmarks.machine import options, show

    args = options(__doc__, sizes=(1000, 5000, 20_000), threads=(1, 2), steps=20, beside=Path)
    show(COLUMNS, (row for disks in args.sizes for row in rows(args, disks)))


if __name__ == "__main__":
    serve(*sys.argv[2:]) if sys.argv[1:2] == ["serve"] else main()
