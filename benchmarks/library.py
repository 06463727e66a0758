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
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from cases import Case, write_case
from contest.compete import CANONICAL, MissingError, compete
from contest.peers import LISTED, PEERS
from friction import Result, Rows, own, plain, siconos
from machine import describe

from analysis.cli.app import progress, show, write_picture
from analysis.exchange.crowd import CrowdProblem
from analysis.exchange.fclib import read_problem, write_answer
from analysis.pages.numbers import number
from analysis.support.parallel import workers
from benchmarks.problems.families import heap
from benchmarks.problems.score import Scores, profile_picture, score, write_scores
from benchmarks.problems.writing import PROBLEMS, read_manifest, write_library
from nscd import ContactLaw
from nscd.friction.problem import friction_problem

# Folders of answers: ours by the name of the product, peers by their own.
OURS = {"nscd": "auto", "nscd canonical": CANONICAL}
SMOOTH = {**OURS, **{peer.name: peer.name for peer in (*PEERS, *LISTED)}}
# LEMKE takes a dense matrix, and its time grows with the cube: up to so many contacts.
MOST_DENSE = 500


def rough(name: str, limit: float) -> Callable[..., Result | None]:
    """The solver with friction of this name: a function of case, problem, rows and μ."""
    if name == "nscd":
        return own
    if name == "Gauss-Seidel":
        return lambda case, problem, rows, mu: plain(case, problem, rows, limit)
    solver = name.split()[1]

    def foreign(case: Case, problem: Any, rows: Rows, mu: float) -> Result | None:
        if solver != "NSGS" and len(case.contacts) > MOST_DENSE:
            return None
        return siconos(problem, rows, solver, limit)

    return foreign


ROUGH = ("nscd", "Gauss-Seidel", "Siconos NSGS", "Siconos LEMKE")


def main() -> None:
    """Write, answer or score."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    tasks = parser.add_subparsers(dest="task", required=True)
    write, answers, judged = (tasks.add_parser(name) for name in ("write", "answer", "score"))
    for task in (write, answers):
        task.add_argument("--only", nargs="*", help="problems; all if left out")
    write.add_argument("--jobs", type=int, help="processes; as many as cores if left out")
    names = list(dict.fromkeys([*SMOOTH, *ROUGH]))
    answers.add_argument("--solvers", nargs="*", choices=names, default=names)
    for task in (answers, judged):
        task.add_argument("library", type=Path)
        task.add_argument("--limit", type=float, default=20.0, help="CPU seconds")
    judged.add_argument("answers", type=Path, nargs="+")
    for task, out in ((write, "library"), (answers, "out/answers"), (judged, "scores")):
        task.add_argument("--out", type=Path, default=Path(out))
    given = parser.parse_args()
    try:
        {"write": written, "answer": answered, "score": scored}[given.task](given)
    except (ValueError, OSError, ImportError) as error:
        sys.exit(f"library: {error}")


def written(given: argparse.Namespace) -> None:
    """Write the library."""
    names = {problem.name: problem for problem in PROBLEMS}
    for name in given.only or ():
        if name not in names:
            raise ValueError(f"only: {name}; there are: {', '.join(names)}")
    chosen = [problem for name, problem in names.items() if not given.only or name in given.only]
    with contextlib.ExitStack() as stack:
        alone = given.jobs == 1 or len(chosen) == 1
        executor = None if alone else stack.enter_context(workers(given.jobs))
        print(write_library(given.out, chosen, executor, stack.enter_context(progress())))


def scored(given: argparse.Namespace) -> None:
    """Judge answers."""
    if not 0 < given.limit < math.inf:
        raise ValueError(f"limit: {given.limit:g}; a finite number above 0 is needed")
    with progress() as bars:
        found = score(given.library, given.answers, bars)
    write_scores(given.out / "scores.csv", found)
    for friction in (False, True):
        say(found.of(friction), friction, given.limit)
    print(given.out / "scores.csv")
    write_picture(given.out / "profile.png", lambda: profile_picture(found))


def say(scores: Scores, friction: bool, limit: float) -> None:
    """Print a line for each solver, the fastest first."""
    if not scores.problems:
        return
    means, right = scores.means(limit), scores.right
    least = min((mean for mean in means if math.isfinite(mean)), default=math.nan)
    rows = []
    for place in sorted(range(len(means)), key=lambda p: (math.isnan(means[p]), means[p])):
        residuals = [one.residual for one in scores.verdicts[place] if one and one.right]
        wrong = sum(one is not None and not one.right for one in scores.verdicts[place])
        times = number(means[place], 2), number(means[place] / least, 2)
        worst = number(max(residuals, default=math.nan), 2)
        rows.append(
            [scores.solvers[place], str(int(right[place].sum())), str(wrong), *times, worst]
        )
    kind = "with friction (residual alone)" if friction else "without friction"
    head = ["solver", "right", "wrong", "mean CPU s", "times the best", "worst residual"]
    show(head, rows, title=f"{len(scores.problems)} problems {kind}")


def answered(given: argparse.Namespace) -> None:
    """Run the solvers that there are, problem by problem."""
    print(describe(), file=sys.stderr)
    heap(40)  # the first run loads what later ones have
    missing: set[str] = set()
    for entry in read_manifest(given.library):
        if given.only and entry["name"] not in given.only:
            continue
        read = read_problem(given.library / entry["file"])
        assert isinstance(read, CrowdProblem)
        walls = read.setting.walls
        assert walls is not None
        case = Case(entry["name"], read.snapshot, walls, read.contacts, read.left_velocity)
        run = with_friction if entry["friction"] else without_friction
        files = {name: given.out / name / entry["file"] for name in given.solvers}
        todo = {n: file for n, file in files.items() if n not in missing and not file.exists()}
        run(case, entry["friction"], todo, given.limit, missing)


def without_friction(
    case: Case, _: float, files: dict[str, Path], limit: float, missing: set[str]
) -> None:
    """Every contestant on a case; the fastest attempt that is exact is its answer."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = folder / "case.npz"
        write_case(path, case)
        for solver in (name for name in files if name in SMOOTH):
            try:
                outcome = compete(path, SMOOTH[solver], folder, limit)
            except MissingError:
                peer = next(peer for peer in (*PEERS, *LISTED) if peer.name == solver)
                print(f"{solver}: not installed: {peer.install}", file=sys.stderr)
                missing.add(solver)
                continue
            best = outcome.best
            if best is None:
                print(f"{case.name}: {solver}: no answer: {outcome.ended}", flush=True)
                continue
            reaction = np.column_stack([best.reaction, np.zeros(len(best.reaction))]).ravel()
            write_answer(files[solver], reaction, best.seconds)
            said = f"{best.seconds:.2g} s, {best.residual:.0e}, {best.variant}"
            print(f"{case.name}: {solver}: {said}", flush=True)


def with_friction(
    case: Case, mu: float, files: dict[str, Path], limit: float, missing: set[str]
) -> None:
    """Every solver with friction on a case."""
    problem = friction_problem(
        case.snapshot, case.contacts, case.left_velocity, ContactLaw(friction=mu)
    )
    rows = Rows.of(problem)
    for solver in (name for name in files if name in ROUGH):
        run = partial(rough(solver, limit), case, problem, rows, mu)
        found = run()
        if found is None or found.reaction is None:
            why = "" if found is None else found.note
            if why.startswith("no python3-siconos"):
                print(f"{solver}: {why}: apt-get install python3-siconos", file=sys.stderr)
                missing.add(solver)
            continue
        # the first run of all compiles, and short ones are noisy
        seconds = found.seconds
        for _ in range(4 if seconds < 0.5 else 1 if seconds < 5 else 0):
            seconds = min(seconds, run().seconds)
        write_answer(files[solver], np.column_stack(found.reaction).ravel(), seconds)
        print(f"{case.name}: {solver}: {seconds:.2g} s, {found.residual:.0e}", flush=True)


if __name__ == "__main__":
    main()
