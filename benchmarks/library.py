"""The library of contact problems: write it, run the solvers that are installed on it, and score
anybody's answers.

Usage: python benchmarks/library.py write [--only heap_40 …] [--jobs N] [--out FOLDER]
       python benchmarks/library.py answer LIBRARY [--only heap_40 …] [--solvers nscd piqp …]
           [--limit SECONDS] [--out ANSWERS]
       python benchmarks/library.py score LIBRARY ANSWERS … [--limit SECONDS] [--out FOLDER]

write: FCLIB files, each with its answer, and a manifest: crowds of seven families and frames of a
real one, with and without friction, up to 5,000 people; 45 MB and 150 CPU seconds in all.

answer: without friction the contest of percussions.py runs, with friction that of friction.py: the
same adapters, processes and limits. Answers that are there are kept, so that a run can be ended and
gone on with.

score: answers are folders, one a solver, of HDF5 files of the names of the problems', with r in
/solution and perhaps the CPU `seconds` as its attribute. Right is one that solves the equations
and, without friction, has the velocities that there are, the forces that balance determines, and
others within their intervals. Writes scores.csv and profile.png."""

import argparse
import contextlib
import math
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.cli.app import progress, show, write_picture
from analysis.pages.numbers import number
from analysis.studies.exchange.fclib import read_problem, write_answer
from analysis.support.files import write_text
from analysis.support.parallel import workers
from benchmarks import friction
from benchmarks.contest.compete import compete
from benchmarks.contest.peers import CANONICAL, LISTED, MISSING, PEERS
from benchmarks.machine import describe, repeats
from benchmarks.problems.families import Case
from benchmarks.problems.score import means, profile_picture, score, times, with_friction
from benchmarks.problems.writing import PROBLEMS, read_manifest, write_library

# Folders of answers: ours by the name of the product, peers by their own.
SMOOTH = {"nscd": "auto", "nscd canonical": CANONICAL} | {name: name for name in (*PEERS, *LISTED)}
ROUGH = {
    "nscd": friction.own,
    "Gauss-Seidel": friction.plain,
    "Siconos NSGS": partial(friction.siconos, solver="NSGS"),
    "Siconos LEMKE": partial(friction.siconos, solver="LEMKE"),
}
# LEMKE takes a dense matrix, and its time grows with the cube: up to so many contacts.
MOST_DENSE = 500


def main() -> None:
    """Write, answer or score."""
    kind = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=kind)
    tasks = parser.add_subparsers(dest="task", required=True)
    write, solution_files, judged = (tasks.add_parser(name) for name in ("write", "answer", "score"))
    for task in (write, solution_files):
        task.add_argument("--only", nargs="*", help="problems; all if left out")
    write.add_argument("--jobs", type=int, help="processes; as many as cores if left out")
    names = list(dict.fromkeys([*SMOOTH, *ROUGH]))
    solution_files.add_argument("--solvers", nargs="*", choices=names, default=names)
    for task in (solution_files, judged):
        task.add_argument("library", type=Path)
        task.add_argument("--limit", type=float, default=20.0, help="CPU seconds")
    judged.add_argument("answers", type=Path, nargs="+")
    for task, out in ((write, "library"), (solution_files, "out/answers"), (judged, "scores")):
        task.add_argument("--out", type=Path, default=Path(out))
    args = parser.parse_args()
    try:
        {"write": written, "answer": answered, "score": scored}[args.task](args)
    except (ValueError, OSError, ImportError) as error:
        sys.exit(f"library: {error}")


def written(args: argparse.Namespace) -> None:
    """Write the library."""
    names = {problem.name: problem for problem in PROBLEMS}
    for name in args.only or ():
        if name not in names:
            raise ValueError(f"only: {name}. There are: {', '.join(names)}")
    chosen = [problem for name, problem in names.items() if not args.only or name in args.only]
    with contextlib.ExitStack() as stack:
        alone = args.jobs == 1 or len(chosen) == 1
        executor = None if alone else stack.enter_context(workers(args.jobs))
        print(write_library(args.out, chosen, executor, stack.enter_context(progress())))


def scored(args: argparse.Namespace) -> None:
    """Judge answers."""
    if not 0 < args.limit < math.inf:
        raise ValueError(f"limit: {args.limit:g}; a finite number above 0 is needed")
    with progress() as bars:
        found = score(args.library, args.answers, bars)
    write_text(args.out / "scores.csv", found.to_csv(index=False))
    for frictional in (False, True):
        say(with_friction(found, frictional), frictional, args.limit)
    print(args.out / "scores.csv")
    write_picture(args.out / "profile.png", lambda: profile_picture(found))


def say(scores: pd.DataFrame, friction: bool, limit: float) -> None:
    """Print a line for each solver, the fastest first."""
    if scores.empty:
        return
    used = means(times(scores), limit).sort_values()
    rows = []
    for name, mean in used.items():
        of = scores[scores.solver == name]
        right, wrong = (of[of.verdict == one] for one in ("right", "wrong"))
        counts = str(len(right)), str(len(wrong))
        numbers = mean, mean / used.min(), right.residual.max()
        rows.append([name, *counts, *(number(float(one), 2) for one in numbers)])
    kind = "with friction (residual alone)" if friction else "without friction"
    head = ["solver", "right", "wrong", "mean CPU s", "times the best", "worst residual"]
    show(head, rows, title=f"{scores.problem.nunique()} problems {kind}")


def answered(args: argparse.Namespace) -> None:
    """Run the solvers that there are, problem by problem."""
    print(describe(), file=sys.stderr)
    missing: set[str] = set()
    for entry in read_manifest(args.library):
        if args.only and entry["name"] not in args.only:
            continue
        read = read_problem(args.library / entry["file"])
        walls, left = read.setting.walls, read.left_velocity
        case = Case(entry["name"], read.snapshot, walls, read.contacts, left)
        mu, contestants = entry["friction"], ROUGH if entry["friction"] else SMOOTH
        frictional = friction.FrictionCase.of(case, mu) if mu else None
        for name in args.solvers:
            file = args.out / name / entry["file"]
            if name not in contestants or name in missing or file.exists():
                continue
            seconds, reaction, message = (
                solved_with_friction(frictional, name, args.limit)
                if frictional
                else smooth(case, SMOOTH[name], args.limit)
            )
            if message.startswith(MISSING):
                print(f"{name}: {message}", file=sys.stderr)
                missing.add(name)
                continue
            if reaction is not None:
                write_answer(file, np.column_stack(reaction).ravel(), seconds)
                message = f"{seconds:.2g} s, {message}"
            print(f"{case.name}: {name}: {message}", flush=True)


Found = tuple[float, tuple | None, str]


def smooth(case: Case, solver: str, limit: float) -> Found:
    """The CPU seconds of the fastest attempt that is exact, its λ and τ, if there is one, and words
    of it."""
    outcome = compete(case, solver, limit)
    if (best := outcome.best) is None:
        return math.nan, None, outcome.ended or "no answer"
    reaction = best.reaction, np.zeros(len(best.reaction))
    return best.seconds, reaction, f"{best.residual:.0e}, {best.variant}"


def solved_with_friction(frictional: friction.FrictionCase, solver: str, limit: float) -> Found:
    """The same with friction; short runs are repeated, since they are noisy."""
    run = partial(ROUGH[solver], frictional, limit)
    if solver == "Siconos LEMKE" and len(frictional.case.contacts) > MOST_DENSE:
        return math.nan, None, f"not asked for more than {MOST_DENSE} contacts"
    found = run()
    if found.reaction is None:
        return math.nan, None, found.note
    times = [found.seconds, *(run().seconds for _ in range(repeats(found.seconds)))]
    return min(times), found.reaction, f"{found.residual:.0e}"


if __name__ == "__main__":
    main()
