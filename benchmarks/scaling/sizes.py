"""Cost against size: a heap before a 1 m exit, from 100 to a million disks: its contacts, its
percussions, a second of it in LAMMPS and in the rigid engine; a table, CSV and a picture.

Usage: python benchmarks/scaling/sizes.py [--sizes N …] [--what contacts …] [--out FOLDER]

Each point is a process of its own on one core. CPU seconds: of contacts and percussions the least
of a few, kernels loaded before; of a second of crowd that of a step times the steps in it. Every
step begins with the heap at rest, of which everybody pushes at 2 m/s to the exit (τ = 0.5 s). Of
LAMMPS a short run is taken from a long one, so that start and dumps do not count. Residuals are
max|min(wλ, −Cu)| over ‖u⁻‖∞, recomputed; of the rigid engine the largest of its steps' own."""

import dataclasses
import itertools
import logging
import resource
import tempfile
from collections.abc import Callable
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from analysis.engines import LAMMPS
from analysis.engines.programs.rigid import motion_of
from analysis.engines.run import simulate
from analysis.pages.drawing import BLUE, GREEN, GRID, ORANGE, VERMILION
from analysis.scene.scene import Scene, Wall, read_scene
from analysis.support.files import write_text
from benchmarks.cases import accuracy
from benchmarks.machine import describe, in_process, options, power, shortest_time, table, timed
from benchmarks.problems.families import Case, heap
from nscd import find_contacts, solve

SIZES = (100, 300, 1000, 3000, 10_000, 30_000, 100_000, 300_000, 1_000_000)
# Of these sizes, where they are smaller, is what is not counted: they take every path.
WARM = (99, 900, 2500, 20_000)
# Disks times steps of LAMMPS' long run; the short one has SHARE of them.
DISK_STEPS, LEAST_STEPS, MOST_STEPS, SHARE = 4e6, 120, 10_000, 0.2
RIGID_STEPS, RIGID_STEP_S = 3, 0.005
# Growth is of crowds of so many and more.
LARGE = 10_000


# CPU s of one solution or one step; of a second of crowd, NaN of what has no time; residual, NaN of
# what has none.
Measured = tuple[float, float, float]


def of_contacts(case: Case) -> Measured:
    """CPU s of finding the contacts."""
    seconds, _ = shortest_time(lambda: find_contacts(case.snapshot, case.walls, tolerance=1e-9))
    return seconds, np.nan, np.nan


def of_percussions(case: Case) -> Measured:
    """CPU s and residual of the percussions to 1e-10, contacts given."""
    arguments = {"left_velocity": case.left_velocity, "tolerance": 1e-10}
    seconds, found = shortest_time(partial(solve, case.snapshot, case.contacts, **arguments))
    return seconds, np.nan, accuracy(case, found.reaction).residual


def of_lammps(case: Case) -> Measured:
    """CPU s of a step, and of a second, of soft contacts of 10⁶ N/m."""
    scene, n = scene_of(case), len(case.snapshot)
    step = LAMMPS.timing(scene).time_step
    steps = int(np.clip(DISK_STEPS / n, LEAST_STEPS, MOST_STEPS))
    spent, made = [], []
    with tempfile.TemporaryDirectory() as folder:
        for count in (int(SHARE * steps), steps):
            run = scene.with_run(duration_s=count * step, frames=1)
            record = simulate(run, "lammps", Path(folder) / str(count))
            spent.append(record.cpu_seconds)
            made.append(record.steps)
    each = (spent[1] - spent[0]) / (made[1] - made[0])
    return each, each / step, np.nan


def of_rigid(case: Case) -> Measured:
    """CPU s of a rigid step of 5 ms, and of a second; the largest residual."""
    scene = scene_of(case)
    motion = motion_of(scene, scene.snapshot)
    spent, steps = zip(*(timed(motion.advance) for _ in range(RIGID_STEPS)), strict=True)
    each = float(np.median(spent))
    return each, each / motion.step, max(step.residual for step in steps)


# What is measured: its title, colour and marker.
METHODS: dict[str, tuple[Callable[[Case], Measured], str, str, str]] = {
    "contacts": (of_contacts, "contacts, once", GREEN, "o"),
    "percussions": (of_percussions, "percussions to 1e-10, once", BLUE, "s"),
    "LAMMPS": (of_lammps, "LAMMPS (1e6 N/m), a second of crowd", ORANGE, "^"),
    "rigid engine": (of_rigid, "rigid engine (5 ms), a second of crowd", VERMILION, "D"),
}


def scene_of(case: Case) -> Scene:
    """The heap at rest, driven as `arch` is."""
    arch = read_scene("arch")
    still, radius = np.zeros_like(case.snapshot.velocity), case.snapshot.radius.copy()
    # the heap begins with two disks that overlap by 5 mm: one is made smaller
    np.add.at(radius, case.contacts.first, np.minimum(case.contacts.gap, 0.0))
    snapshot = dataclasses.replace(case.snapshot, velocity=still, radius=radius)
    ends = enumerate(zip(case.walls.start.tolist(), case.walls.end.tolist(), strict=True))
    walls = tuple(Wall(name=f"wall{n}", start_m=tuple(a), end_m=tuple(b)) for n, (a, b) in ends)
    scene = arch.model_copy(update={"name": "heap", "walls": walls, "snapshot": snapshot})
    return scene.with_run(rigid_step_s=RIGID_STEP_S, duration_s=1.0, frames=1)


def measure(what: str, disks: int) -> dict[str, object]:
    """Measure a method at a size, in this process."""
    logging.disable(logging.WARNING)  # crowds so large are too soft: here only cost counts
    method, *_ = METHODS[what]
    for few in WARM:  # loads the kernels
        if few < disks and what != "LAMMPS":
            method(heap(few))
    case = heap(disks)
    unit, second, residual = method(case)
    who = resource.RUSAGE_CHILDREN if what == "LAMMPS" else resource.RUSAGE_SELF
    peak = resource.getrusage(who).ru_maxrss / 1024**2
    sizes = {"what": what, "disks": disks, "contacts": len(case.contacts)}
    return sizes | {"unit_s": unit, "second_s": second, "residual": residual, "peak_GB": peak}


def main() -> None:
    """Measure, print and write."""
    args = options(__doc__, sizes=SIZES, what=METHODS, out=Path("out/sizes"))
    rows: list[dict[str, object]] = []
    for what, disks in itertools.product(args.what, args.sizes):
        try:
            rows.append(in_process(measure, what, disks))
        except BrokenProcessPool:
            print(f"{what}, {disks} disks: the process was ended", flush=True)
            continue
        print(rows[-1], flush=True)
        found = pd.DataFrame(rows)
        found["shown_s"] = found.second_s.fillna(found.unit_s)
        write_text(args.out / "sizes.md", f"{describe()}\n\n{table_of(found)}\n")
        write_text(args.out / "sizes.csv", found.drop(columns="shown_s").to_csv(index=False))
        picture(found).savefig(args.out / "sizes.png")
    print(table_of(found))


def table_of(found: pd.DataFrame) -> str:
    """One row a size, one column a method; below, how each grows."""
    whats = [what for what in METHODS if what in set(found.what)]
    cells = found.apply(_cell, axis=1)
    lines = []
    for (disks, contacts), here in found.groupby(["disks", "contacts"]):
        known = dict(zip(here.what, cells[here.index], strict=True))
        lines.append([f"{disks:,}", f"{contacts:,}", *(known.get(what, "–") for what in whats)])
    large = [found[(found.what == what) & (found.disks >= LARGE)] for what in whats]
    growth = [f"N^{power(some.disks, some.unit_s):.2f}" for some in large]
    names = ["disks", "contacts", *(METHODS[what][1] for what in whats)]
    return table(names, [*lines, [f"from {LARGE:,} on", "", *growth]])


def _cell(row: pd.Series) -> str:
    """Seconds, residual and memory."""
    residual = "" if np.isnan(row.residual) else f", {row.residual:.0e}"
    return f"{float(f'{row.shown_s:.2g}'):,g} s{residual}, {row.peak_GB:.2g} GB"


def picture(found: pd.DataFrame) -> Figure:
    """CPU seconds against disks."""
    figure = Figure(figsize=(8, 5.2), layout="constrained", dpi=150)
    axes = figure.subplots()
    for what, (_, label, colour, marker) in METHODS.items():
        curve = found[found.what == what]
        axes.loglog(curve.disks, curve.shown_s, color=colour, marker=marker, ms=5, label=label)
    axes.set(xlabel="disks in the heap", ylabel="CPU seconds, one core")
    axes.grid(True, which="major", color=GRID, lw=0.6)
    axes.legend(frameon=False)
    return figure


if __name__ == "__main__":
    main()
