"""Crowds that overlap, as the frames of soft engines do: `solve` beside PIQP, crowd by crowd.

    python benchmarks/overlapping.py [--pressed 40] [--runs 2] [--seed 1000] [--out FILE.csv]

Pressed heaps of 594, and frames of LAMMPS' `arch` and `jam` at 10⁵, 10⁶ and 10⁷ N/m, each of its own
seed. PIQP gets the scaled problem, in the variant and with the fewest iterations that reach 1e-10
(see `contest/peers.py`). CPU seconds, set-up included, the least of several, turn by turn; residuals
are recomputed for everyone."""

from __future__ import annotations

import argparse
import csv
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from cases import Case, Solver, accuracy, scaled
from contest.compete import TARGET
from contest.peers import PEERS
from machine import describe, options, table

from analysis.dumps import open_bodies, snapshot_of
from analysis.engines.run import simulate
from analysis.percussions import Setting
from analysis.scene.shipped_scenes import make
from benchmarks.problems.families import pressed
from nscd import solve

DISKS = 594
STIFFNESS = (1e5, 1e6, 1e7)  # N/m
FRAMES = (10, 20, 30, 40)
WAYS = {"any": False, "least energy": True}
TURNS = 5


def frames(scene_name: str, stiffness: float, seed: int) -> Iterator[Case]:
    """Contact problems of a LAMMPS run of a crowd; frames without contacts, or with overlaps that
    `percussions solve` refuses too, are left out."""
    scene = make(scene_name, seed=seed).with_contact(stiffness_N_per_m=stiffness)
    if scene_name == "jam":
        scene = scene.with_run(duration_s=4.0, frames=40)
    setting, walls = Setting.of(scene), scene.wall_segments()
    with tempfile.TemporaryDirectory() as name:
        simulate(scene, "lammps", Path(name) / "run")
        path = Path(name) / "run" / "bodies.dump"
        trajectory = open_bodies(path).trajectory
        for frame in FRAMES:
            snapshot = snapshot_of(trajectory[frame], path)
            try:
                contacts = setting.contacts(snapshot)
            except ValueError as error:
                print(f"{scene_name}, seed {seed}, frame {frame}: {error}", file=sys.stderr)
                continue
            if len(contacts):
                left = setting.left(snapshot)[0]
                yield Case(f"{scene_name} {stiffness:.0e}", snapshot, walls, contacts, left)


def cases(given: argparse.Namespace) -> Iterator[Case]:
    """Every crowd that was asked for."""
    for seed in range(given.seed, given.seed + given.pressed):
        yield pressed(DISKS, seed)
    for scene in ("arch", "jam"):
        for stiffness in STIFFNESS:
            for seed in range(given.seed, given.seed + given.runs):
                yield from frames(scene, stiffness, seed)


def own(case: Case, canonical: bool) -> tuple[Any, Any]:
    """λ and u⁺ of `solve`, from the snapshot and its contacts on."""
    found = solve(
        case.snapshot, case.contacts, left_velocity=case.left_velocity, tolerance=TARGET,
        canonical=canonical,
    )  # fmt: skip
    return found.reaction, found.right_velocity.ravel()


def piqp(case: Case) -> Callable[[], tuple[Any, Any]] | None:
    """PIQP's fastest way to 1e-10 of all its variants, or nothing."""
    problem, best = scaled(case), (np.inf, None)
    peer = next(peer for peer in PEERS if peer.name == "piqp")

    def run(solver: Solver, iterations: float) -> tuple[Any, Any]:
        found = solver(iterations)
        own_velocity = None if found.velocity is None else found.velocity * problem.velocity
        return found.multiplier * problem.reaction, own_velocity

    for prepare in peer.variants.values():
        solver, before = prepare(problem), None
        for iterations in peer.asked:
            way = partial(run, solver, iterations)
            seconds, found = timed(way)
            residual = accuracy(case, *found).residual
            if residual <= TARGET:
                best = min(best, (min(seconds, timed(way)[0]), way), key=lambda one: one[0])
            if residual <= TARGET or residual == before:
                break
            before = residual
    return best[1]


def timed(way: Callable[[], tuple[Any, Any]]) -> tuple[float, tuple[Any, Any]]:
    """CPU seconds of one run, and its answer."""
    started = time.process_time()
    found = way()
    return time.process_time() - started, found


def measured(case: Case) -> dict[str, Any]:
    """One line of the table: CPU seconds of each, infinite where 1e-10 is not reached."""
    ways: dict[str, Callable[[], tuple[Any, Any]] | None] = {
        name: partial(own, case, canonical) for name, canonical in WAYS.items()
    }
    ways["piqp"] = piqp(case)
    least = dict.fromkeys(ways, np.inf)
    for _ in range(TURNS):
        for name, way in ways.items():
            if way is not None:
                seconds, found = timed(way)
                if accuracy(case, *found).residual <= TARGET:
                    least[name] = min(least[name], seconds)
    return {"crowd": case.name, "disks": len(case.snapshot), "contacts": len(case.contacts)} | least


def summary(lines: list[dict[str, Any]]) -> str:
    """By crowd and for all: how many each solved, the median times, and how many times faster, in the median and at
    the worst twentieth of the crowds that both solved."""
    names = dict.fromkeys(line["crowd"] for line in lines)
    groups = {name: [line for line in lines if line["crowd"] == name] for name in names}
    rows = []
    for name, group in (groups | {"all": lines}).items():
        peer = np.array([line["piqp"] for line in group])
        for way in WAYS:
            mine = np.array([line[way] for line in group])
            both = np.isfinite(mine) & np.isfinite(peer)
            ratio = peer[both] / mine[both]
            times = 1e3 * np.median(mine), 1e3 * np.median(peer)
            numbers = *times, np.median(ratio), np.quantile(ratio, 0.05)
            counts = np.isfinite(peer).sum(), way, np.isfinite(mine).sum()
            rows.append([name, len(group), *counts, *(f"{number:.2g}" for number in numbers)])
    solves = "crowd", "crowds", "PIQP solves", "way", "solved"
    return table([*solves, "ms", "PIQP, ms", "times faster", "worst 5 %"], rows)


def main() -> None:
    """Measure crowd after crowd; print the summary and write every crowd."""
    out = Path("out/benchmark/overlapping.csv")
    given = options(__doc__, pressed=40, runs=2, seed=1000, out=out)
    print(describe(), end="\n\n")
    given.out.parent.mkdir(parents=True, exist_ok=True)
    lines = []
    with given.out.open("w", newline="", encoding="utf-8") as file:
        written = csv.DictWriter(file, ["crowd", "disks", "contacts", *WAYS, "piqp"])
        written.writeheader()
        for case in cases(given):
            lines.append(measured(case))
            written.writerow(lines[-1])
            file.flush()
            print(f"{len(lines)} {lines[-1]}", file=sys.stderr, flush=True)
    print(summary(lines))


if __name__ == "__main__":
    main()
