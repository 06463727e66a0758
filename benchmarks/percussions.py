"""CPU seconds and recomputed residuals of the percussion solvers and of their peers, on the same
contact problems.

    python benchmarks/percussions.py [--sizes 594 5000] [--families heap jammed] [--peers piqp osqp]
        [--solvers auto] [--seed 1] [--limit 100] [--cases FOLDER] [--out FOLDER] [--no-precision]
        [--seeds 40]

--limit: seconds of a solver on a case, all tolerances. --cases: keep the cases in this folder (a
large jammed one takes minutes). --no-precision: leave the work-precision picture out. --seeds: over
so many from --seed on, instead, the median and the worst twentieth of each peer's time over ours."""

import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from analysis.support.files import write_text
from benchmarks.cases import case_of, write_case
from benchmarks.contest.compete import TARGET, Outcome, Request, compete
from benchmarks.contest.peers import CANONICAL, PEERS
from benchmarks.contest.seeds import NAMES, over_seeds
from benchmarks.contest.tables import exponents, picture, rows_of, summary
from benchmarks.machine import describe, options, show
from benchmarks.problems.families import FAMILIES, heap
from nscd.solve import SOLVERS

# What a new process pays: seconds to import nscd and to solve the case of a file once.
FIRST_SOLVE = """
import pickle, sys, time
started = time.perf_counter()
from nscd import solve
_, snapshot, _, contacts, left = pickle.load(open(sys.argv[1], "rb"))
solve(snapshot, contacts, left_velocity=left, tolerance=1e-10)
print(time.perf_counter() - started)
"""
# above, a peer runs only the variant that was fastest at the next smaller size
ALL_VARIANTS = 5000
PRECISION_SIZE, PRECISION_FAMILIES = 5000, ("heap", "jammed")
PRECISION = tuple(10.0**-power for power in range(2, 13))
Outcomes = Mapping[str, Outcome]


def first_solve() -> str:
    """Wall seconds of a new process that imports nscd and solves a heap once, the best of three."""
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder) / "small"
        write_case(case, heap(594))
        words = [sys.executable, "-c", FIRST_SOLVE, case]
        spent = min(float(subprocess.check_output(words)) for _ in range(3))
    return f"A new process: import nscd and first solve of a heap of 594, {spent:.2f} s (wall)."


def tighter(before: Outcomes) -> dict[str, Request]:
    """What peers are asked on a large case, from what they did on fewer disks of the family."""
    requested = {}
    for name, peer in PEERS.items():
        known = before[name].best if name in before else None
        if known and known.residual <= TARGET:
            at = known.requested
            ladder = tuple(a for a in peer.requested if a == at or (a > at) == peer.by_iterations)
            requested[name] = Request(ladder=ladder, variant=known.variant)
    return requested


def every_tolerance(outcomes: Outcomes) -> dict[str, Request]:
    """Every tolerance, each peer in its fastest variant on this case."""
    target = {"auto": Request(0.0, PRECISION)}
    for name, peer in PEERS.items():
        best = outcomes[name].best if name in outcomes else None
        variant = best.variant if best else next(iter(peer.variants))
        target[name] = Request(0.0, peer.requested if peer.by_iterations else PRECISION, variant)
    return target


def save(out: Path, words: str, rows: Sequence[dict[str, Any]]) -> str:
    """Write percussions.csv and summary.md, and return the latter."""
    found = pd.DataFrame(rows)
    growth = f"Cost ∝ Nˣ (number of sizes):\n\n{exponents(found)}"
    text = "\n\n".join([describe(), summary(found), growth, words, ""])
    write_text(out / "summary.md", text)
    write_text(out / "percussions.csv", found.to_csv(index=False))
    return text


def main() -> None:
    """Run the contest; print one table and write it with the machine to the output folder."""
    args = options(
        __doc__, sizes=(594, 5000), families=FAMILIES, peers=PEERS, solvers=dict.fromkeys(SOLVERS),
        seed=1, limit=20.0, precision=True, cases=Path, out=Path("out/benchmark"), seeds=0,
    )  # fmt: skip
    if args.seeds:
        seeds = range(args.seed, args.seed + args.seeds)
        print(f"Seeds {seeds[0]} to {seeds[-1]}.")
        show(NAMES, (row for f in args.families for n in args.sizes for row in over_seeds(f, n, seeds, args.peers)))
        return
    # ended from outside, it still ends the process that it waits for
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    args.out.mkdir(parents=True, exist_ok=True)
    rows: list[dict[str, Any]] = []
    words, all_outcomes = first_solve(), {}
    contestants = [*args.solvers, *((CANONICAL,) if "auto" in args.solvers else ()), *args.peers]
    for family in args.families:
        outcomes: Outcomes = {}
        for size in sorted(args.sizes):
            case = case_of(family, size, args.cases, args.seed)
            if (family, len(case.snapshot)) in all_outcomes:
                continue  # a family that exists in one size
            requested = tighter(outcomes) if len(case.snapshot) > ALL_VARIANTS else {}
            print(f"{family} {len(case.snapshot)}", file=sys.stderr, flush=True)
            some = {name: requested.get(name, Request()) for name in contestants}
            outcomes = {one: compete(case, one, args.limit, some[one]) for one in some}
            all_outcomes[family, len(case.snapshot)] = outcomes
            rows += rows_of(case, list(outcomes.values()))
            text = save(args.out, words, rows)
    if args.precision:
        columns = []
        for family in PRECISION_FAMILIES:
            case = case_of(family, PRECISION_SIZE, args.cases)
            requested = every_tolerance(all_outcomes.get((family, PRECISION_SIZE), {}))
            print(f"work-precision {family}", file=sys.stderr, flush=True)
            found = [compete(case, one, args.limit, requested[one]) for one in ("auto", *args.peers)]
            columns.append((case, [outcome for outcome in found if outcome.attempts]))
        picture(columns).savefig(args.out / "work_precision.png")
    print(text)


if __name__ == "__main__":
    main()
