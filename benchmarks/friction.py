"""Percussions with Coulomb friction: `solve`, plain non-smooth Gauss–Seidel from zero, and Siconos,
on the same contact problems; CPU seconds and the natural map recomputed here for everyone.

Usage: python benchmarks/friction.py [--families heap jammed …] [--sizes 594 5000] [--mu 0.1 0.3 …]
[--runs FOLDER …] [--every 10] [--siconos NSGS LEMKE CPG] [--no-plain] [--limit SECONDS] [--out
FILE.csv]

--runs: finished runs of an engine; every so many frames of each, pressed as their scene says."""

from __future__ import annotations

import argparse
import itertools
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from analysis.studies.exchange.problem import GlobalProblem, LocalProblem
from analysis.support.files import write_rows
from benchmarks.cases import frames
from benchmarks.contest import peers
from benchmarks.machine import describe, options, timed
from benchmarks.problems.families import FAMILIES, Case
from nscd import ContactLaw, solve
from nscd.friction.planar import natural_map
from nscd.friction.problem import FrictionProblem, friction_problem

TARGET = 1e-10
COLUMNS = ("case", "contacts", "mu", "solver", "cpu_s", "residual", "note")
# Pairs of sweeps between two looks at the clock.
BLOCK = 200
# Iterations of Siconos' solver whose time says how many the limit allows.
TRIAL = 100


class Result(NamedTuple):
    """CPU seconds, natural map over ‖u⁻‖∞ (recomputed), what is to be said of it, and λ and τ (k,)
    N·s."""

    seconds: float
    residual: float
    note: str
    reaction: tuple[Any, Any] | None = None


class FrictionCase(NamedTuple):
    """A case with friction μ at all contacts, set up for the product and written out as matrices."""

    case: Case
    law: ContactLaw
    problem: FrictionProblem
    local: LocalProblem

    @classmethod
    def of(cls, case: Case, mu: float) -> FrictionCase:
        law, left = ContactLaw(friction=mu), case.left_velocity
        problem = friction_problem(case.snapshot, case.contacts, left, law)
        total = GlobalProblem.of(case.snapshot, case.contacts, left, problem.friction)
        return cls(case, law, problem, total.local())

    def result(self, seconds: float, note: str, reaction: tuple[Any, Any]) -> Result:
        """What λ and τ (k,) N·s are worth."""
        local, both = self.local, np.column_stack(reaction).ravel()
        error = natural_map(local.delassus, local.free, local.friction, both)
        scale = float(np.abs(local.free).max(initial=0.0)) / self.problem.scale
        return Result(seconds, error * scale, note, reaction)


def own(frictional: FrictionCase, _: float) -> Result:
    """`solve`, from the snapshot on."""
    case, law = frictional.case, frictional.law
    arguments = {"left_velocity": case.left_velocity, "law": law, "tolerance": TARGET}
    seconds, found = timed(partial(solve, case.snapshot, case.contacts, **arguments))
    reaction = found.reaction, found.friction.tangential
    return frictional.result(seconds, f"{found.status}, {found.solver}", reaction)


def plain(frictional: FrictionCase, limit: float) -> Result:
    """Non-smooth Gauss–Seidel, forward and back, from zero, up to the limit."""
    k, core = len(frictional.case.contacts), frictional.problem.in_core(frictional.case.snapshot)
    along, across = np.zeros(k), np.zeros(k)
    started, pairs, error = time.process_time(), 0, np.inf
    while error > TARGET and time.process_time() - started < limit:
        found = core.sweep(along, across, BLOCK, TARGET)
        along, across, error = found.reaction, found.tangential, found.error
        pairs += found.cost
    seconds = time.process_time() - started
    return frictional.result(seconds, f"{2 * pairs} sweeps", (along, across))


def siconos(frictional: FrictionCase, limit: float, solver: str) -> Result:
    """One of Siconos' solvers in the system's Python, asked for ever less until 1e-10 is met or its
    iterations have taken the limit."""
    local, best = frictional.local, Result(np.inf, np.inf, "no answer")

    def requested(tolerance: float, iterations: int) -> Result:
        inputs = local.delassus, local.free, solver, tolerance, iterations, local.friction
        reaction, seconds = peers.siconos(*inputs)
        return frictional.result(seconds, f"asked {tolerance:.0e}", tuple(reaction.reshape(-1, 2).T))

    try:
        trial = requested(1e-16, TRIAL)
        maximum = max(int(limit * TRIAL / max(trial.seconds, 1e-3)), TRIAL)
        for tolerance in (1e-8, 1e-10, 1e-12):
            one = requested(tolerance, maximum)
            best = min(best, one, key=lambda result: result.residual)
            if one.residual <= TARGET:
                break
            if one.seconds > 0.5 * limit:
                return best._replace(note=f"not within {maximum} iterations")
    except ImportError:
        return best._replace(note=f"{peers.MISSING}: {peers.INSTALL_SICONOS}")
    except subprocess.CalledProcessError:
        return best._replace(note="it failed")
    return best


def cases(args: argparse.Namespace) -> Iterator[Case]:
    """The families and the frames of runs that were asked for."""
    for family, size in itertools.product(args.families, args.sizes):
        yield FAMILIES[family](size)._replace(name=f"{family} {size}")
    for run in args.runs:
        yield from frames(Path(run), args.every)


def main() -> None:
    """Measure and print a table, one line per case, coefficient and solver."""
    args = options(
        __doc__, families=("heap", "jammed"), sizes=(594,), mu=(0.05, 0.1, 0.2, 0.3, 0.5, 1.0),
        runs=(), every=10, siconos=("NSGS",), limit=60.0, plain=True,
        out=Path("out/benchmark/friction.csv"),
    )  # fmt: skip
    if unknown := set(args.families) - set(FAMILIES):
        sys.exit(f"families: {', '.join(unknown)}. There are: {', '.join(FAMILIES)}")
    solvers = {"solve": own} | ({"Gauss–Seidel": plain} if args.plain else {})
    solvers |= {f"Siconos {name}": partial(siconos, solver=name) for name in args.siconos}
    print(describe(), file=sys.stderr)
    rows: list[list[Any]] = []
    for case, mu in itertools.product(cases(args), args.mu):
        problem = FrictionCase.of(case, mu)
        for name, solver in solvers.items():
            found = solver(problem, args.limit)
            line = [case.name, len(case.contacts), mu, name, f"{found.seconds:.4g}"]
            rows.append([*line, f"{found.residual:.1e}", found.note])
            write_rows(args.out, COLUMNS, rows)
            print(*rows[-1], sep=" | ", flush=True)


if __name__ == "__main__":
    main()
