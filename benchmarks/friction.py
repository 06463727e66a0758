"""Percussions with Coulomb friction: `solve`, plain non-smooth Gauss–Seidel from zero, and Siconos,
on the same contact problems; CPU seconds and the natural map recomputed here for everyone.

Usage: python benchmarks/friction.py [--families heap jammed …] [--sizes 594 5000] [--mu 0.1 0.3 …]
[--runs FOLDER …] [--every 10] [--siconos NSGS LEMKE CPG] [--limit SECONDS] [--out FILE.csv]

--runs: finished runs of an engine; every so many frames of each, pressed as their scene says."""

from __future__ import annotations

import argparse
import csv
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sparse
from cases import Case
from machine import describe

from analysis.dumps import open_bodies, snapshot_of
from analysis.percussions import Setting
from analysis.scene.scene import read_scene
from benchmarks.problems.families import FAMILIES
from nscd import ContactLaw, solve
from nscd.friction.problem import FrictionProblem, friction_problem

TARGET = 1e-10
SYSTEM_PYTHON = "/usr/bin/python3"  # python3-siconos lives with the system's own interpreter
SICONOS = Path(__file__).parent / "processes" / "siconos_friction.py"
# Pairs of sweeps between two looks at the clock.
BLOCK = 200
# Iterations of Siconos' solver whose time says how many the limit allows.
TRIAL = 100


class Result(NamedTuple):
    """CPU seconds, natural map (recomputed), what is to be said of it, and λ and τ (k,) N·s."""

    seconds: float
    residual: float
    note: str
    reaction: tuple[Any, Any] | None = None


class Rows(NamedTuple):
    """N and T (k,3n), sparse, M (3n,) and u⁻ (3n,): the problem written out."""

    normal: Any
    tangent: Any
    mass: Any
    left: Any

    @classmethod
    def of(cls, problem: FrictionProblem) -> Rows:
        """Write out a problem."""
        n, k = len(problem.mass), len(problem.first)
        pair = np.flatnonzero(problem.second >= 0)
        i, j = 3 * problem.first.astype(int), 3 * problem.second[pair].astype(int)
        x, y = problem.normal.T
        every, shape = np.arange(k), (k, 3 * n)
        at = np.concatenate([every, every, pair, pair])
        normal = sparse.csr_matrix(
            (np.concatenate([x, y, -x[pair], -y[pair]]),
             (at, np.concatenate([i, i + 1, j, j + 1]))), shape=shape,
        )  # fmt: skip
        levers = problem.lever[:, 0], problem.lever[pair, 1]
        tangent = sparse.csr_matrix(
            (np.concatenate([-y, x, y[pair], -x[pair], *levers]),
             (np.concatenate([at, every, pair]),
              np.concatenate([i, i + 1, j, j + 1, i + 2, j + 2]))), shape=shape,
        )  # fmt: skip
        return cls(normal, tangent, problem.mass.ravel(), problem.left.ravel())

    def residual(self, problem: FrictionProblem, lam: Any, tau: Any) -> float:
        """The natural map of λ, τ (k,) over ‖u⁻‖∞, with the velocities that balance them."""
        u = self.left - (self.normal.T @ lam + self.tangent.T @ tau) / self.mass
        w, wt, most = problem.normal_inverse, problem.tangent_inverse, problem.friction * lam
        one = np.minimum(w * lam, -(self.normal @ u))
        two = wt * (tau - np.clip(tau + (self.tangent @ u) / wt, -most, np.maximum(most, 0)))
        return float(max(np.abs(one).max(), np.abs(two).max())) / problem.scale


def own(case: Case, problem: FrictionProblem, rows: Rows, mu: float) -> Result:
    """`solve`, from the snapshot on."""
    started = time.process_time()
    law, left = ContactLaw(friction=mu), case.left_velocity
    found = solve(case.snapshot, case.contacts, left_velocity=left, law=law, tolerance=TARGET)
    seconds = time.process_time() - started
    assert found.friction is not None
    reaction = found.reaction, found.friction.tangential
    said = f"{found.status}, {found.solver}"
    return Result(seconds, rows.residual(problem, *reaction), said, reaction)


def plain(case: Case, problem: FrictionProblem, rows: Rows, limit: float) -> Result:
    """Non-smooth Gauss–Seidel, forward and back, from zero, up to the limit."""
    k, core = len(problem.first), problem.in_core(case.snapshot.position)
    along, across = np.zeros(k), np.zeros(k)
    started, pairs, error = time.process_time(), 0, np.inf
    while error > TARGET and time.process_time() - started < limit:
        (along, across, _), error, made = core.sweep(along, across, BLOCK, TARGET)
        pairs += made
    seconds = time.process_time() - started
    residual = rows.residual(problem, along, across)
    return Result(seconds, residual, f"{2 * pairs} sweeps", (along, across))


def siconos(problem: FrictionProblem, rows: Rows, solver: str, limit: float) -> Result:
    """One of Siconos' solvers in the system's Python, asked for ever less until 1e-10 is met or
    its iterations have taken the limit."""
    both = sparse.vstack([rows.normal, rows.tangent]).tocsr()
    k = len(problem.first)
    both = -both[np.arange(2 * k).reshape(2, k).T.ravel()]
    best = Result(np.inf, np.inf, "no answer")
    with tempfile.TemporaryDirectory() as folder:
        given, found = Path(folder) / "given.npz", Path(folder) / "found.npy"
        np.savez(
            given, data=both.data, indices=both.indices, indptr=both.indptr,
            inverse=1.0 / rows.mass, velocity=both @ rows.left, friction=problem.friction,
        )  # fmt: skip

        def asked(tolerance: float, iterations: int) -> Result:
            words = [SYSTEM_PYTHON, SICONOS, given, solver, tolerance, iterations, found]
            said = subprocess.run(
                [str(word) for word in words], capture_output=True, text=True, check=True
            )
            seconds = float(json.loads(said.stdout.splitlines()[-1])["seconds"])
            reaction = tuple(np.load(found).reshape(-1, 2).T)
            residual = rows.residual(problem, *reaction)
            return Result(seconds, residual, f"asked {tolerance:.0e}", reaction)

        try:
            trial = asked(1e-16, TRIAL)
            most = max(int(limit * TRIAL / max(trial.seconds, 1e-3)), TRIAL)
            for tolerance in (1e-8, 1e-10, 1e-12):
                one = asked(tolerance, most)
                if one.residual < best.residual:
                    best = one
                if one.residual <= TARGET:
                    break
                if one.seconds > 0.5 * limit:
                    return best._replace(note=f"not within {most} iterations")
        except subprocess.CalledProcessError:
            return best._replace(note="no python3-siconos, or it failed")
        except OSError:
            return best._replace(note="no python3-siconos")
    return best


def cases(arguments: argparse.Namespace) -> Iterator[Case]:
    """The families and the frames of runs that were asked for."""
    for family in arguments.families:
        for size in arguments.sizes:
            yield FAMILIES[family](size)._replace(name=f"{family} {size}")
    for folder in arguments.runs:
        scene = read_scene(folder / "scene.toml")
        setting = Setting.of(scene)
        trajectory = open_bodies(folder / "bodies.dump").trajectory
        for number in range(arguments.every, len(trajectory), arguments.every):
            snapshot = snapshot_of(trajectory[number], folder / "bodies.dump")
            contacts, walls = setting.contacts(snapshot), scene.wall_segments()
            name = f"{folder.parent.name} frame {number}"
            yield Case(name, snapshot, walls, contacts, setting.left(snapshot)[0])


def answers(
    case: Case, problem: FrictionProblem, mu: float, arguments: argparse.Namespace
) -> Iterator[tuple[str, Result]]:
    """The solvers' names and results, each as soon as it is there."""
    rows = Rows.of(problem)
    yield "solve", own(case, problem, rows, mu)
    if arguments.plain:
        yield "Gauss–Seidel", plain(case, problem, rows, arguments.limit)
    for name in arguments.siconos:
        yield f"Siconos {name}", siconos(problem, rows, name, arguments.limit)


def main() -> None:
    """Measure and print a table, one line per case, coefficient and solver."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])  # type: ignore[union-attr]
    parser.add_argument("--families", nargs="*", choices=list(FAMILIES), default=["heap", "jammed"])
    parser.add_argument("--sizes", nargs="*", type=int, default=[594])
    parser.add_argument("--mu", nargs="*", type=float, default=[0.05, 0.1, 0.2, 0.3, 0.5, 1.0])
    parser.add_argument("--runs", nargs="*", type=Path, default=[])
    parser.add_argument("--every", type=int, default=10)
    parser.add_argument("--siconos", nargs="*", default=["NSGS"])
    parser.add_argument("--limit", type=float, default=60.0)
    parser.add_argument("--plain", action=argparse.BooleanOptionalAction, default=True)
    parser.add_argument("--out", type=Path, default=Path("out/benchmark/friction.csv"))
    arguments = parser.parse_args()
    print(describe(), file=sys.stderr)
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    with arguments.out.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["case", "contacts", "mu", "solver", "cpu_s", "residual", "note"])
        for case in cases(arguments):
            for mu in arguments.mu:
                law = ContactLaw(friction=mu)
                problem = friction_problem(case.snapshot, case.contacts, case.left_velocity, law)
                for solver, result in answers(case, problem, mu, arguments):
                    line = [case.name, len(case.contacts), mu, solver, f"{result.seconds:.4g}"]
                    line += [f"{result.residual:.1e}", result.note]
                    table.writerow(line)
                    file.flush()
                    print(" | ".join(map(str, line)), flush=True)


if __name__ == "__main__":
    main()
