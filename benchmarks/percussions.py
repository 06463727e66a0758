"""CPU seconds and recomputed residuals of the percussion solvers and of their peers, on the same
contact problems.

Usage: python benchmarks/percussions.py [--sizes 594 5000] [--families heap jammed] [--peers piqp
osqp] [--limit 100]"""

import argparse
import hashlib
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from cases import Case, read_case, write_case
from contest.compete import CANONICAL, TARGET, MissingError, Outcome, compete, first_solve
from contest.peers import PEERS
from contest.tables import Row, comma_separated, exponents, markdown, rows_of, summary
from contest.work_precision import TOLERANCES, picture
from machine import bandwidth, describe

from analysis.support.files import write_text
from benchmarks.problems import families
from benchmarks.problems.families import FAMILIES
from nscd import find_contacts
from nscd.solve import SOLVERS

PEER_NAMES = tuple(peer.name for peer in PEERS)
# least bytes per contact and sweep: each row, its λ and its two disks once (and what momentum and
# restart add)
SWEEP_BYTES = {"gauss_seidel": 68, "projected_gradient": 132}
# above, a peer runs only the variant that was fastest at the next smaller size
ALL_VARIANTS = 5000
PRECISION_SIZE, PRECISION_FAMILIES = 5000, ("heap", "jammed")


def main() -> None:
    """Run the contest; print one table and write it with the machine to the output folder."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=[594, 5000], help="disks")
    parser.add_argument("--families", nargs="+", choices=FAMILIES, default=list(FAMILIES))
    parser.add_argument("--peers", nargs="*", choices=PEER_NAMES, default=list(PEER_NAMES))
    parser.add_argument("--solvers", nargs="+", choices=SOLVERS, default=list(SOLVERS))
    parser.add_argument(
        "--limit", type=float, default=20.0, help="seconds of a solver on a case, all tolerances"
    )
    parser.add_argument(
        "--no-precision", action="store_true", help="leave the work-precision picture out"
    )
    parser.add_argument(
        "--cases",
        type=Path,
        help="keep the cases in this folder (a large jammed one takes minutes)",
    )
    parser.add_argument("--out", type=Path, default=Path("out/benchmark"))
    given = parser.parse_args()
    # ended from outside, it still ends the process that it waits for
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    given.out.mkdir(parents=True, exist_ok=True)
    bytes_per_second = bandwidth()
    words = [describe(), f"Memory bandwidth of one core: {bytes_per_second / 1e9:.1f} GB/s.", ""]
    rows: list[Row] = []
    lines: list[str] = []
    contestants = [*given.solvers, *((CANONICAL,) if "auto" in given.solvers else ()), *given.peers]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        small = folder / "small.npz"
        write_case(small, FAMILIES["heap"](594))
        cold = first_solve(small)
        lines.append(
            f"A new process: import nscd {cold['import_wall_s']:.2f} s, first solve of a heap of "
            f"594 {cold['solve_wall_s']:.2f} s, the whole process {cold['process_wall_s']:.2f} s "
            "(wall)."
        )
        for family in given.families:
            before: dict[str, Outcome] = {}
            sizes = set()
            for size in sorted(given.sizes):
                case, path = case_of(family, size, given.cases or folder)
                if len(case.snapshot) in sizes:
                    continue  # a family that exists in one size
                sizes.add(len(case.snapshot))
                lines.append(detection(case))
                before = run_case(path, case, contestants, before, given.limit, folder)
                rows += rows_of(case, list(before.values()), PEER_NAMES)
                lines += sweeps(case, before, bytes_per_second)
                save(given.out, words, rows, lines)
        if not given.no_precision:
            entered = ["auto", *given.peers]
            columns = []
            for family in PRECISION_FAMILIES:
                case, path = case_of(family, PRECISION_SIZE, given.cases or folder)
                columns.append((case, precision(path, case, entered, rows, folder, given.limit)))
            picture(columns, given.out / "work_precision.png")
    text = save(given.out, words, rows, lines)
    print(text)


def run_case(
    path: Path,
    case: Case,
    contestants: Sequence[str],
    before: dict[str, Outcome],
    limit: float,
    folder: Path,
) -> dict[str, Outcome]:
    """Every contestant on the case; what it did `before`, on fewer disks of the family, says where
    a large one starts."""
    outcomes = {}
    for solver in contestants:
        peer = next((peer for peer in PEERS if peer.name == solver), None)
        variant, asked = None, ()
        known = before[solver].best if solver in before else None
        if peer and known and known.residual <= TARGET and len(case.snapshot) > ALL_VARIANTS:
            variant = known.variant
            asked = tuple(
                a
                for a in peer.asked
                if (a >= known.asked if peer.by_iterations else a <= known.asked)
            )
        print(f"{case.name} {len(case.snapshot)}: {solver}", file=sys.stderr, flush=True)
        try:
            outcomes[solver] = compete(path, solver, folder, limit, asked=asked, variant=variant)
        except MissingError:
            outcomes[solver] = Outcome(solver, [], f"not installed: {peer.install if peer else ''}")
    return outcomes


def case_of(family: str, size: int, folder: Path) -> tuple[Case, Path]:
    """A case and its file in the folder, made if the folder has not got it from the same
    families.py."""
    made_by = hashlib.sha256(Path(families.__file__).read_bytes()).hexdigest()[:8]
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{family}_{size}_{made_by}.npz"
    if not path.exists():
        write_case(path, FAMILIES[family](size))
    return read_case(path), path


def precision(
    path: Path, case: Case, solvers: Sequence[str], rows: Sequence[Row], folder: Path, limit: float
) -> list[Outcome]:
    """Every solver at every tolerance, each peer in its fastest variant on this case."""
    outcomes = []
    for solver in solvers:
        at = [
            r
            for r in rows
            if (r.solver, r.family, r.disks) == (solver, case.name, len(case.snapshot))
        ]
        peer = next((peer for peer in PEERS if peer.name == solver), None)
        variant, asked = "", TOLERANCES
        if peer:
            asked = peer.asked if peer.by_iterations else TOLERANCES
            fastest = at[0].setting.rpartition(", ")[0] if at else ""
            variant = fastest if fastest in peer.variants else next(iter(peer.variants))
        print(f"work-precision {case.name}: {solver}", file=sys.stderr, flush=True)
        try:
            outcomes.append(
                compete(path, solver, folder, limit, target=0.0, asked=asked, variant=variant)
            )
        except MissingError:
            continue
    return outcomes


def detection(case: Case) -> str:
    """CPU seconds of finding the contacts of a case, in words."""
    tolerance = max(float(case.contacts.gap.max(initial=0.0)), 0.0)
    best = float("inf")
    for _ in range(3):
        started = time.process_time()
        find_contacts(case.snapshot, case.walls, tolerance=tolerance)
        best = min(best, time.process_time() - started)
        if best > 2:
            break
    sizes = f"{len(case.snapshot)} disks: {len(case.contacts)} contacts"
    return f"{case.name}, {sizes} found in {best:.4f} s CPU."


def sweeps(case: Case, outcomes: dict[str, Outcome], bytes_per_second: float) -> list[str]:
    """Measured time of a sweep beside what its least memory traffic would take, for the methods
    that sweep."""
    lines = []
    for solver, least in SWEEP_BYTES.items():
        best = outcomes[solver].best if solver in outcomes else None
        if best and best.iterations:
            each = best.seconds / best.iterations / len(case.contacts)
            lines.append(
                f"{case.name}, {len(case.snapshot)} disks, {solver}: {best.iterations} sweeps, "
                f"{each * 1e9:.1f} ns per contact "
                f"and sweep, all of the solve counted; {least} B at the measured bandwidth take "
                f"{least / bytes_per_second * 1e9:.1f} ns."
            )
    return lines


def save(out: Path, words: Sequence[str], rows: Sequence[Row], lines: Sequence[str]) -> str:
    """Write percussions.md, its short form summary.md, and percussions.csv; return the text."""
    notes = [
        "* with the solver's own u, its momentum error counted; else u = u⁻ − M⁻¹Cᵀλ.",
        "† against the best peer at 1e-8, since none reached 1e-10. × best peer: its CPU seconds "
        "over this solver's.",
    ]
    text = "\n".join(
        [
            *words,
            markdown(rows),
            *notes,
            "",
            "Cost ∝ Nˣ (number of sizes):",
            "",
            exponents(rows),
            *lines,
            "",
        ]
    )
    write_text(out / "percussions.md", text)
    write_text(out / "summary.md", summary(rows, PEER_NAMES))
    write_text(out / "percussions.csv", comma_separated(rows))
    return text


if __name__ == "__main__":
    main()
