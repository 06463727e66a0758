"""One large crowd on one thread and on several, taking turns: wall seconds, CPU seconds, and whether
the answers are the same bits; a table.

Usage: python benchmarks/scaling/threads.py [--families heap …] [--sizes N …] [--threads 1 2 …]
[--any] [--repeats N] [--cases FOLDER] [--read CASE.npz …] [--out FOLDER]

Wall seconds are the least of the repeats, kernels loaded before; their ratio is to the first number
of threads. CPU seconds are those of all threads in the repeat of the least wall seconds, waiting
included; "critical path" is the least CPU time of the thread that asks, which is what the wall
shows where nobody else uses the cores. The residual, max|min(wλ, −Cu)| over ‖u⁻‖∞, is recomputed
from λ."""

import hashlib
import resource
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

from cases import accuracy, read_case
from machine import describe, head, line, options
from percussions import case_of

from benchmarks.problems.families import Case
from nscd import solve

COLUMNS = (
    "crowd", "disks", "contacts", "reactions", "threads", "wall", "ratio", "critical path", "ratio",
    "CPU of all", "residual", "bits", "memory",
)  # fmt: skip


@dataclass
class Spent:
    """Seconds of one solution: of the wall, of this thread's CPU, and of all threads' CPU."""

    wall: float
    own: float
    every: float


def solved(case: Case, canonical: bool, threads: int) -> tuple[Spent, Any]:
    """Solve a case once."""
    wall, own, every = time.perf_counter(), time.thread_time(), time.process_time()
    given, how = (case.snapshot, case.contacts), {"canonical": canonical, "threads": threads}
    answer = solve(*given, left_velocity=case.left_velocity, tolerance=1e-10, **how)
    spent = Spent(time.perf_counter() - wall, time.thread_time() - own, time.process_time() - every)
    return spent, answer


def rows_of(case: Case, canonical: bool, threads: list[int], repeats: int) -> list[str]:
    """A row for each number of threads, which take turns."""
    found: dict[int, list[Spent]] = {number: [] for number in threads}
    bits, last = {}, {}
    for repeat in range(repeats + 1):  # the first one loads kernels
        for number in threads:
            spent, answer = solved(case, canonical, number)
            bits[number] = hashlib.sha256(
                answer.reaction.tobytes() + answer.right_velocity.tobytes()
            ).hexdigest()
            last[number] = answer
            if repeat:
                found[number].append(spent)
    rows = []
    first = threads[0]
    least = {number: min(one.wall for one in found[number]) for number in threads}
    path = {number: min(one.own for one in found[number]) for number in threads}
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2
    for number in threads:
        every = min(found[number], key=lambda one: one.wall).every
        residual = accuracy(case, last[number].reaction, None).residual
        sizes = f"{len(case.snapshot):,}", f"{len(case.contacts):,}"
        times = [
            words
            for one in (least, path)
            for words in (f"{one[number]:.2f} s", f"{one[number] / one[first]:.2f}")
        ]
        same = "same" if bits[number] == bits[first] else "OTHER"
        cells = [case.name, *sizes, "least energy" if canonical else "any", number, *times]
        rows.append(line([*cells, f"{every:.2f} s", f"{residual:.0e}", same, f"{memory:.2g} GB"]))
    return rows


def main() -> None:
    """Measure, print and write threads.md."""
    given = options(
        __doc__, families=("heap", "jammed", "masses", "hexagonal"), sizes=(50_000,),
        threads=(1, 2), any=False, repeats=5, cases=Path, read=(), out=Path("out/threads"),
    )  # fmt: skip
    given.out.mkdir(parents=True, exist_ok=True)
    lines = [describe(), "", head(*COLUMNS)]
    print("\n".join(lines), flush=True)
    with tempfile.TemporaryDirectory() as name:
        folder = given.cases or Path(name)
        wanted = [(family, size) for family in given.families for size in given.sizes]
        cases = [read_case(Path(path)) for path in given.read]
        for case in cases or (case_of(family, size, folder)[0] for family, size in wanted):
            rows = rows_of(case, not given.any, given.threads, given.repeats)
            lines += rows
            print("\n".join(rows), flush=True)
            (given.out / "threads.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
