"""Crowds that overlap, as the frames of soft engines do: `solve` beside PIQP, crowd by crowd.

    python benchmarks/overlapping.py [--pressed 40] [--runs 2] [--seed 1000] [--out FILE.csv]

Pressed heaps of 594, and --runs frames of LAMMPS' `arch` and `jam` at 10⁵, 10⁶ and 10⁷ N/m, each of
its own seed, of which --seed is the first. PIQP gets the scaled problem, in the variant and with the
fewest iterations that reach 1e-10 (see `contest/peers.py`). CPU seconds, set-up included, the least of
several, turn by turn; residuals are recomputed for everyone."""

import argparse
import itertools
import sys
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from analysis.engines.run import simulate
from analysis.scene.shipped_scenes import make
from analysis.support.files import write_rows
from benchmarks.cases import Solver, accuracy, frames, scaled
from benchmarks.contest.compete import TARGET, Asked, Attempt, Outcome
from benchmarks.contest.peers import CANONICAL, PEERS, own
from benchmarks.machine import describe, in_turn, options, table, timed
from benchmarks.problems.families import Case, pressed

DISKS = 594
STIFFNESS = (1e5, 1e6, 1e7)  # N/m
EVERY, LAST = 10, 40
WAYS = {"any": "auto", "least energy": CANONICAL}
TURNS = 5


def cases(given: argparse.Namespace) -> Iterator[Case]:
    """Every crowd that was asked for."""
    for seed in range(given.seed, given.seed + given.pressed):
        yield pressed(DISKS, seed)
    seeds = range(given.seed, given.seed + given.runs)
    for name, stiffness, seed in itertools.product(("arch", "jam"), STIFFNESS, seeds):
        scene = make(name, seed=seed).with_contact(stiffness_N_per_m=stiffness)
        if name == "jam":
            scene = scene.with_run(duration_s=4.0, frames=40)
        with tempfile.TemporaryDirectory() as folder:
            simulate(scene, "lammps", Path(folder) / "run")
            for case in frames(Path(folder) / "run", EVERY, LAST):
                yield case._replace(name=f"{name} {stiffness:.0e}")


def piqp(case: Case) -> Solver | None:
    """PIQP's fastest way to 1e-10 of all its variants, or nothing."""
    asked = Asked()
    prepared = asked.prepare(case, PEERS["piqp"])
    found = asked.attempts(case, PEERS["piqp"], prepared)
    best = Outcome("piqp", [one for one in found if isinstance(one, Attempt)], "").best
    if best is None or best.residual > TARGET:
        return None
    return partial(prepared[best.variant], best.asked)


def measured(case: Case) -> dict[str, Any]:
    """One line of the table: CPU seconds of each, infinite where 1e-10 is not reached."""
    problem = scaled(case)
    ways = {name: partial(own(problem, solver), TARGET) for name, solver in WAYS.items()}
    if best := piqp(case):
        ways["piqp"] = best
    turns = in_turn({name: partial(timed, way) for name, way in ways.items()}, TURNS)
    least = dict.fromkeys([*WAYS, "piqp"], np.inf)
    for name, found in turns.items():
        exact = (accuracy(case, one.reaction, one.velocity).residual <= TARGET for _, one in found)
        times = [seconds for (seconds, _), good in zip(found, exact, strict=True) if good]
        least[name] = min(times, default=np.inf)
    return {"crowd": case.name, "disks": len(case.snapshot), "contacts": len(case.contacts)} | least


def summary(lines: list[dict[str, Any]]) -> str:
    """By crowd and for all: how many each solved, the median times, and how many times faster, in the
    median and at the worst twentieth of the crowds that both solved."""
    groups = {name: [line for line in lines if line["crowd"] == name]
              for name in dict.fromkeys(line["crowd"] for line in lines)}  # fmt: skip
    rows = []
    for (name, group), way in itertools.product((groups | {"all": lines}).items(), WAYS):
        mine, peer = (np.array([line[one] for line in group]) for one in (way, "piqp"))
        both = np.isfinite(mine) & np.isfinite(peer)
        ratio = peer[both] / mine[both]
        values = 1e3 * np.median(mine), 1e3 * np.median(peer), np.median(ratio)
        cells = [f"{value:.2g}" for value in (*values, np.quantile(ratio, 0.05))]
        counts = np.isfinite(peer).sum(), way, np.isfinite(mine).sum()
        rows.append([name, len(group), *counts, *cells])
    names = ["crowd", "crowds", "PIQP solves", "way", "solved", "ms", "PIQP, ms"]
    return table([*names, "times faster", "worst 5 %"], rows)


def main() -> None:
    """Measure crowd after crowd; print the summary and write every crowd."""
    out = Path("out/benchmark/overlapping.csv")
    given = options(__doc__, pressed=40, runs=2, seed=1000, out=out)
    print(describe(), end="\n\n")
    given.out.parent.mkdir(parents=True, exist_ok=True)
    lines: list[dict[str, Any]] = []
    for case in cases(given):
        lines.append(measured(case))
        write_rows(given.out, list(lines[0]), (line.values() for line in lines))
        print(f"{len(lines)} {lines[-1]}", file=sys.stderr, flush=True)
    print(summary(lines))


if __name__ == "__main__":
    main()
