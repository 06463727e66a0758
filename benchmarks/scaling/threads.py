"""One large crowd on one thread and on several, taking turns: wall seconds, CPU seconds, and whether
the answers are the same bits; a table.

Usage: python benchmarks/scaling/threads.py [--families heap …] [--sizes N …] [--threads 1 2 …]
[--any] [--repeats N] [--cases FOLDER] [--read CASE …] [--out FOLDER]

Wall seconds are the least of the repeats, kernels loaded before; their ratio is to the first number
of threads. CPU seconds are those of all threads in the repeat of the least wall seconds, waiting
included; "critical path" is the least CPU time of the thread that asks, which is what the wall
shows where nobody else uses the cores. The residual, max|min(wλ, −Cu)| over ‖u⁻‖∞, is recomputed
from λ."""

import itertools
import resource
import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from analysis.support.files import write_text
from benchmarks.cases import accuracy, case_of, read_case
from benchmarks.machine import describe, head, in_turn, line, options
from benchmarks.problems.families import Case
from nscd import solve

COLUMNS = (
    "crowd", "disks", "contacts", "reactions", "threads", "wall", "ratio", "critical path", "ratio",
    "CPU of all", "residual", "bits", "memory",
)  # fmt: skip


class Solved(NamedTuple):
    """Seconds of one solution: of the wall, of this thread's CPU, of all threads' CPU; its bits."""

    wall: float
    own: float
    every: float
    reaction: Any
    bits: bytes


def solved(case: Case, canonical: bool, threads: int) -> Solved:
    """Solve a case once."""
    clocks = time.perf_counter, time.thread_time, time.process_time
    given, how = (case.snapshot, case.contacts), {"canonical": canonical, "threads": threads}
    before = [clock() for clock in clocks]
    answer = solve(*given, left_velocity=case.left_velocity, tolerance=1e-10, **how)
    spent = (clock() - start for clock, start in zip(clocks, before, strict=True))
    bits = answer.reaction.tobytes() + answer.right_velocity.tobytes()
    return Solved(*spent, answer.reaction, bits)


def rows(case: Case, canonical: bool, threads: Sequence[int], repeats: int) -> Iterator[str]:
    """A row for each number of threads, which take turns."""
    calls = {number: partial(solved, case, canonical, number) for number in threads}
    in_turn(calls, 1)  # loads kernels
    found = in_turn(calls, repeats)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2
    walls, paths = ([min(getattr(one, name) for one in found[number]) for number in threads]
                    for name in ("wall", "own"))  # fmt: skip
    sizes = f"{len(case.snapshot):,}", f"{len(case.contacts):,}"
    for number, wall, path in zip(threads, walls, paths, strict=True):
        least = min(found[number], key=lambda one: one.wall)
        same = "same" if found[number][-1].bits == found[threads[0]][-1].bits else "OTHER"
        yield line(
            [
                *(case.name, *sizes, "least energy" if canonical else "any", number),
                *(f"{wall:.2f} s", f"{wall / walls[0]:.2f}"),
                *(f"{path:.2f} s", f"{path / paths[0]:.2f}", f"{least.every:.2f} s"),
                *(f"{accuracy(case, least.reaction).residual:.0e}", same, f"{memory:.2g} GB"),
            ]
        )


def main() -> None:
    """Measure, print and write threads.md."""
    given = options(
        __doc__, families=("heap", "jammed", "masses", "hexagonal"), sizes=(50_000,),
        threads=(1, 2), any=False, repeats=5, cases=Path, read=(), out=Path("out/threads"),
    )  # fmt: skip
    lines = [describe(), "", head(*COLUMNS)]
    print("\n".join(lines), flush=True)
    wanted = itertools.product(given.families, given.sizes)
    made = (case_of(family, size, given.cases) for family, size in wanted)
    for case in map(read_case, map(Path, given.read)) if given.read else made:
        for row in rows(case, not given.any, given.threads, given.repeats):
            lines.append(row)
            print(row, flush=True)
        write_text(given.out / "threads.md", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
