"""The same work on one core and on several, taking turns: the percussions of a large crowd on threads,
1,000 steps of a pressed crowd in LAMMPS on ranks of MPI. Wall and CPU seconds, the least of the repeats,
over those of the first number of cores, and whether the percussions are the same bits.

Usage: python benchmarks/scaling/cores.py [--what percussions lammps] [--cores 1 2 …] [--repeats N]
[--families heap …] [--sizes N …] [--disks N …] [--cases FOLDER]"""

import argparse
import itertools
import logging
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from analysis.engines import LAMMPS
from analysis.engines.run import run_engine
from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import make
from benchmarks.cases import case_of
from benchmarks.machine import in_turn, options, show
from benchmarks.problems.families import Case
from nscd import solve

STEPS = 1000  # of LAMMPS
COLUMNS = ("crowd", "disks", "cores", "wall", "ratio", "CPU of all", "ratio", "bits")
# Wall and CPU seconds, and the bits of the answer.
Spent = tuple[float, float, bytes]


def solved(case: Case, threads: int) -> Spent:
    """Solve a case once."""
    before = time.perf_counter(), time.process_time()
    inputs, how = (case.snapshot, case.contacts), {"tolerance": 1e-10, "threads": threads}
    solution = solve(*inputs, left_velocity=case.left_velocity, **how)
    bits = solution.reaction.tobytes() + solution.right_velocity.tobytes()
    return time.perf_counter() - before[0], time.process_time() - before[1], bits


def run(scene: Scene, ranks: int) -> Spent:
    """Run LAMMPS once."""
    with tempfile.TemporaryDirectory() as folder:
        record = run_engine(scene, "lammps", Path(folder) / "run", ranks=ranks)
    return record.wall_seconds, record.cpu_seconds, b""


def works(args: argparse.Namespace) -> Iterator[tuple[str, int, Callable[[int], Spent]]]:
    """Name, disks and call of all that was asked for."""
    if "percussions" in args.what:
        for family, size in itertools.product(args.families, args.sizes):
            case = case_of(family, size, args.cases)
            solved(case, 1)  # loads kernels
            yield family, size, partial(solved, case)
    for disks in args.disks if "lammps" in args.what else ():
        scene = make("arch", disks)
        duration = STEPS * LAMMPS.timing(scene).time_step
        yield "arch, LAMMPS", disks, partial(run, scene.with_run(duration_s=duration, frames=1))


def rows(args: argparse.Namespace) -> Iterator[list[object]]:
    """A row for each crowd and number of cores, which take turns."""
    for name, disks, call in works(args):
        found = in_turn({cores: partial(call, cores) for cores in args.cores}, args.repeats)
        minimum = {c: np.min([one[:2] for one in every], axis=0) for c, every in found.items()}
        for cores, every in found.items():
            pairs = zip(minimum[cores], minimum[cores] / minimum[args.cores[0]], strict=True)
            times = (cell for one, fraction in pairs for cell in (f"{one:.2f} s", f"{fraction:.2f}"))
            same = every[-1][2] == found[args.cores[0]][-1][2]
            yield [name, f"{disks:,}", cores, *times, "same" if same else "OTHER"]


if __name__ == "__main__":
    logging.disable(logging.WARNING)  # crowds so large are too soft: here only their cost counts
    args = options(
        __doc__, what=dict.fromkeys(("percussions", "lammps")), cores=(1, 2), repeats=5,
        families=("heap", "jammed", "masses", "hexagonal"), sizes=(50_000,), disks=(5000, 20_000),
        cases=Path,
    )  # fmt: skip
    show(COLUMNS, rows(args))
