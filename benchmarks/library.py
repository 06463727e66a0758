"""Solvers on the library of `percussions benchmark-library`: each one's answers, and the CPU seconds
that they took, in a folder of its own for `percussions benchmark-score`.

Usage: python benchmarks/library.py LIBRARY [--only heap_40 …] [--solvers nscd piqp "Siconos NSGS" …]
[--limit SECONDS] [--out ANSWERS]

Without friction the contest of percussions.py runs, with friction that of friction.py: the same
adapters, processes and limits. Answers that are there are kept, so that a run can be ended and gone
on with."""

import argparse
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

from analysis.exchange.crowd import CrowdProblem
from analysis.exchange.fclib import read_problem, write_answer
from analysis.library.families import heap
from analysis.library.writing import read_manifest
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
        return lambda case, problem, rows, mu: own(case, problem, rows, mu)
    if name == "Gauss-Seidel":
        return lambda case, problem, rows, mu: plain(problem, rows, limit)
    solver = name.split()[1]

    def foreign(case: Case, problem: Any, rows: Rows, mu: float) -> Result | None:
        if solver != "NSGS" and len(case.contacts) > MOST_DENSE:
            return None
        return siconos(problem, rows, solver, limit)

    return foreign


ROUGH = ("nscd", "Gauss-Seidel", "Siconos NSGS", "Siconos LEMKE")


def main() -> None:
    """Run the solvers that there are, problem by problem."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])  # type: ignore[union-attr]
    parser.add_argument("library", type=Path)
    parser.add_argument("--only", nargs="*", help="problems; all if left out")
    names = list(dict.fromkeys([*SMOOTH, *ROUGH]))
    parser.add_argument("--solvers", nargs="*", choices=names, default=names)
    parser.add_argument("--limit", type=float, default=20.0)
    parser.add_argument("--out", type=Path, default=Path("out/answers"))
    given = parser.parse_args()
    print(describe(), file=sys.stderr)
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
        todo = {name: file for name, file in files.items() if not file.exists()}
        run(
            case,
            entry["friction"],
            {n: todo[n] for n in todo if n not in missing},
            given.limit,
            missing,
        )


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
    heap(40)
    main()
