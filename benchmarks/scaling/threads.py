"""One large crowd on one thread and on several, taking turns: wall seconds, CPU seconds, and whether
the answers are the same bits; a table.

Usage: python benchmarks/scaling/threads.py [--families heap …] [--sizes N …] [--threads 1 2 …]
[--any] [--repeats N] [--cases FOLDER] [--read CASE …]

Wall seconds are the least of the repeats, kernels loaded before; their ratio is to the first number
of threads. CPU seconds are those of all threads in the repeat of the least wall seconds, waiting
included; "critical path" is the least CPU time of the thread that asks, which is what the wall
shows where nobody else uses the cores. The residual, max|min(wλ, −Cu)| over ‖u⁻‖∞, is recomputed
from λ."""

import argparse
import itertools
import resource
import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cases import accuracy, case_of, read_case
from benchmarks.machine import in_turn, options, show
from benchmarks.problems.families import Case
from nscd import solve

COLUMNS = (
    "crowd", "disks", "contacts", "reactions", "threads", "wall", "ratio", "critical path", "ratio",
    "CPU of all", "residual", "bits", "memory",
)  # fmt: skip


def solved(case: Case, canonical: bool, threads: int) -> tuple[list[float], Any, bytes]:
    """Solve a case once: seconds of the wall, of this thread's CPU and of all threads' CPU, λ, and
    the bits of the answer."""
    clocks = time.perf_counter, time.thread_time, time.process_time
    given, how = (case.snapshot, case.contacts), {"canonical": canonical, "threads": threads}
    before = [clock() for clock in clocks]
    answer = solve(*given, left_velocity=case.left_velocity, tolerance=1e-10, **how)
    spent = [clock() - start for clock, start in zip(clocks, before, strict=True)]
    return spent, answer.reaction, answer.reaction.tobytes() + answer.right_velocity.tobytes()


def rows(case: Case, canonical: bool, threads: Sequence[int], repeats: int) -> Iterator[list[Any]]:
    """A row for each number of threads, which take turns."""
    calls = {number: partial(solved, case, canonical, number) for number in threads}
    in_turn(calls, 1)  # loads kernels
    found = in_turn(calls, repeats)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2
    sizes = f"{len(case.snapshot):,}", f"{len(case.contacts):,}"
    first = np.min([spent for spent, *_ in found[threads[0]]], axis=0)
    for number in threads:
        (_, _, every), reaction, _ = min(found[number], key=lambda one: one[0][0])
        wall, path, _ = np.min([spent for spent, *_ in found[number]], axis=0)
        same = "same" if found[number][-1][2] == found[threads[0]][-1][2] else "OTHER"
        yield [
            *(case.name, *sizes, "least energy" if canonical else "any", number),
            *(f"{wall:.2f} s", f"{wall / first[0]:.2f}"),
            *(f"{path:.2f} s", f"{path / first[1]:.2f}", f"{every:.2f} s"),
            *(f"{accuracy(case, reaction).residual:.0e}", same, f"{memory:.2g} GB"),
        ]


def cases(given: argparse.Namespace) -> Iterator[Case]:
    """The cases that were asked for: files, or families."""
    yield from map(read_case, map(Path, given.read))
    for family, size in () if given.read else itertools.product(given.families, given.sizes):
        yield case_of(family, size, given.cases)


if __name__ == "__main__":
    asked = options(
        __doc__, families=("heap", "jammed", "masses", "hexagonal"), sizes=(50_000,),
        threads=(1, 2), any=False, repeats=5, cases=Path, read=(),
    )  # fmt: skip
    how = not asked.any, asked.threads, asked.repeats
    show(COLUMNS, (row for case in cases(asked) for row in rows(case, *how)))
