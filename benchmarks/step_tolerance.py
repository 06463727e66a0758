"""How exactly must a step with friction be solved? Cost against error, over seeds.

    python benchmarks/step_tolerance.py [--cases "arch 594" …] [--friction 0.3] [--seeds 10]
        [--tolerances 1e-8 1e-6 1e-3 1e-2] [--seconds 2] [--out TABLE.csv]

Each crowd moves through the same time at every tolerance, in turn. Errors are differences from the
first tolerance, in per cent: mean over seeds, and its 95 % interval. Forces are means of contacts
over 0.1 s above 10 N, in the second half; walls bear their sum; `gone` are the people who have passed
a door; CPU ratio is the first tolerance's over this one's: median, and lowest over seeds."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from scipy import stats

from analysis.engines.programs.rigid import motion_of
from analysis.engines.rigid import timing
from analysis.scene.anthropometry import Varied
from analysis.scene.new_scene import Crowd, room
from analysis.scene.scene import Scene, read_scene
from analysis.scene.shipped_scenes import make, variant
from analysis.studies.exposure.loads import passed
from benchmarks.machine import options, show
from nscd.stepping import WindowSums

WINDOW_S, LEAST_N = 0.1, 10.0
CASES: dict[str, Callable[[int], Scene]] = {
    "arch 594": lambda seed: make("arch", seed=seed),
    "arch 2000": lambda seed: make("arch", disks=2000, seed=seed),
    "jam 300": lambda seed: make("jam", seed=seed),
    "gate": lambda seed: variant(read_scene("gate"), seed),
    "room 120": lambda seed: room(
        "room", 9.0, 7.0, 0.9, Crowd(people=120, varied=Varied(radius_share=0.1, seed=seed))
    ),
}
QUANTITIES = ("mean force", "95 % force", "walls", "gone", "kinetic energy")
COLUMNS = (
    "case", "friction", "tolerance", "CPU s", "CPU ratio", "lowest ratio", "largest residual",
    "energy error", *(f"{one}, %" for one in QUANTITIES), "solved by",
)  # fmt: skip


def measured(scene: Scene, seconds: float) -> dict[str, Any]:
    """Move a crowd; its cost, its worst step, and its quantities."""
    motion, h = motion_of(scene, scene.snapshot), timing(scene).time_step
    motion.separate()
    sums, ways = WindowSums(len(scene.snapshot)), Counter[str]()
    forces, walls, energies = [], [], []
    cost = worst = off = work = 0.0
    steps, every = round(seconds / h), round(WINDOW_S / h)
    for step in range(1, steps + 1):
        began = process_time()
        report = motion.advance()
        cost += process_time() - began
        ways[report.solver] += 1
        worst = max(worst, report.residual)
        off, work = off + report.energy.error, work + abs(report.energy.drive)
        sums.add(report.neighbours, report.reaction, report.friction)
        if step % every:
            continue
        window = sums.close(motion.time)
        if 2 * step <= steps:
            continue
        force = np.hypot(*window.impulse.T) / window.duration
        forces.append(force[force > LEAST_N])
        walls.append(force[window.is_wall].sum())
        energies.append(0.5 * float(scene.snapshot.mass @ (motion.velocity**2).sum(axis=1)))
    force = np.concatenate(forces)
    gone = passed(scene, motion.snapshot())
    values = force.mean(), np.quantile(force, 0.95), np.mean(walls), gone, np.mean(energies)
    return {"cost": cost, "worst": worst, "off": abs(off) / work, "values": values, "ways": ways}


def rows(value: Any) -> Iterator[list[str]]:
    """A row for each case and tolerance, against the first tolerance."""
    for case in value.cases:
        found: dict[float, list[dict[str, Any]]] = {one: [] for one in value.tolerances}
        for seed in range(1, value.seeds + 1):
            scene = CASES[case](seed).with_contact(friction=value.friction)
            for tolerance in value.tolerances:
                exact = scene.with_run(rigid_tolerance=tolerance)
                found[tolerance].append(measured(exact, value.seconds))
        first = found[value.tolerances[0]]
        for tolerance, runs in found.items():
            yield [case, f"{value.friction:g}", f"{tolerance:g}", *summary(runs, first)]


def summary(runs: list[dict[str, Any]], first: list[dict[str, Any]]) -> Iterator[str]:
    """The cells of a row."""
    ratio = [one["cost"] / now["cost"] for one, now in zip(first, runs, strict=True)]
    yield f"{np.median([now['cost'] for now in runs]):.2f}"
    yield f"{np.median(ratio):.2f}"
    yield f"{min(ratio):.2f}"
    yield f"{max(now['worst'] for now in runs):.1e}"
    yield f"{max(now['off'] for now in runs):.1e}"
    for index in range(len(QUANTITIES)):
        own, exact = (np.array([one["values"][index] for one in some]) for some in (runs, first))
        if runs is first or not exact.any():
            yield f"{exact.mean():.3g}"
            continue
        error = 100.0 * (own - exact) / exact.mean()
        half = stats.t.ppf(0.975, len(error) - 1) * stats.sem(error) if len(error) > 1 else np.nan
        yield f"{error.mean():+.1f} ± {half:.1f}"
    ways = sum((now["ways"] for now in runs), Counter[str]())
    yield " ".join(f"{name} {count}" for name, count in ways.most_common())


def main() -> None:
    """Print the table, and write it."""
    args = options(
        __doc__, cases=CASES, friction=0.3, seeds=10, tolerances=(1e-8, 1e-6, 1e-3, 1e-2),
        seconds=2.0, out=Path,
    )  # fmt: skip
    selected: list[list[str]] = []
    show(COLUMNS, (selected.append(row) or row for row in rows(args)))
    if args.out:
        with args.out.open("a", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows(([COLUMNS] if file.tell() == 0 else []) + selected)


if __name__ == "__main__":
    main()
