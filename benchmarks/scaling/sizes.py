"""Cost against size: a heap before a 1 m exit, of 1,000 to a million disks: its percussions, and a
second of the crowd that has moved for a second, in LAMMPS and in the rigid engine; a table and CSV.

Usage: python benchmarks/scaling/sizes.py [--sizes N …] [--seeds N …] [--what rigid …] [--out FOLDER]

Each point is a process of its own on one core. CPU seconds: of percussions of the heap at rest the
least of a few, kernels loaded before. Everybody then pushes at 2 m/s to the exit (τ = 0.5 s) for a
second, in rigid steps of 5 ms, or as far as MOVE_CPU_S allow, which is printed. From that state on a
second of crowd is the mean of consecutive steps, of LAMMPS a short run taken from a long one, so that
start and dumps do not count, times the steps in a second. Ratios are over the rigid engine's. Only up to
10,000 disks are there several seeds, only up to 100,000 LAMMPS. Residuals are max|min(wλ, −Cu)| over
‖u⁻‖∞, recomputed; of the rigid engine the largest of its steps' own. s: see analysis/engines/softness.py."""

import dataclasses
import itertools
import logging
import resource
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.engines import LAMMPS
from analysis.engines.programs.rigid import motion_of
from analysis.engines.run import simulate
from analysis.engines.softness import softness
from analysis.scene.scene import Scene, Wall, read_scene
from analysis.support.files import write_text
from benchmarks.cases import accuracy
from benchmarks.machine import describe, in_process, options, shortest_time, table, timed
from benchmarks.problems.families import Case, heap
from nscd import Snapshot, Walls, solve

SIZES, SEEDS = (1000, 10_000, 100_000, 1_000_000), (1, 2, 3)
# Of these sizes, where they are smaller, is what is not counted: they take every path.
WARM = (99, 900, 2500, 20_000)
# Disks times steps of LAMMPS' long run; the short one has SHARE of them. Of rigid steps.
DISK_STEPS, LEAST_STEPS, MOST_STEPS, SHARE = 4e6, 60, 10_000, 0.2
RIGID_DISK_STEPS, RIGID_STEPS, RIGID_STEP_S = 4e5, (1, 100), 0.005
MOVED_S, MOVE_CPU_S, MANY, LARGEST = 1.0, 25.0, 10_000, 100_000


# CPU s of one solution or one step; of a second of crowd, NaN of what has no time; residual, or s of LAMMPS.
Measured = tuple[float, float, float]


def of_percussions(case: Case) -> Measured:
    """CPU s and residual of the percussions to 1e-10, contacts given."""
    arguments = {"left_velocity": case.left_velocity, "tolerance": 1e-10}
    seconds, found = shortest_time(partial(solve, case.snapshot, case.contacts, **arguments))
    return seconds, np.nan, accuracy(case, found.reaction).residual


def of_lammps(scene: Scene, stiffness: float) -> Measured:
    """CPU s of a step, and of a second, of soft contacts; their number s."""
    scene, n = scene.with_contact(stiffness_N_per_m=stiffness), len(scene.snapshot)
    step = LAMMPS.timing(scene).time_step
    steps = int(np.clip(DISK_STEPS / n, LEAST_STEPS, MOST_STEPS))
    with tempfile.TemporaryDirectory() as folder:
        runs = {count: scene.with_run(duration_s=count * step, frames=1) for count in (int(SHARE * steps), steps)}
        short, long = (simulate(run, "lammps", Path(folder) / str(count)) for count, run in runs.items())
    each = (long.cpu_seconds - short.cpu_seconds) / (long.steps - short.steps)
    return each, each / step, softness(scene)


def of_rigid(scene: Scene) -> Measured:
    """CPU s of a rigid step of 5 ms, and of a second; the largest residual."""
    motion = motion_of(scene, scene.snapshot)
    steps = int(np.clip(RIGID_DISK_STEPS / len(scene.snapshot), *RIGID_STEPS))
    spent, reports = timed(lambda: [motion.advance() for _ in range(steps)])
    return spent / steps, spent / steps / motion.step, max(one.residual for one in reports)


STATE = ("position", "velocity", "radius", "mass")
# What is measured, and its title.
METHODS: dict[str, tuple[Callable[..., Measured], str]] = {
    "percussions": (of_percussions, "percussions to 1e-10, once"),
    **{f"LAMMPS {k:.0e}": (partial(of_lammps, stiffness=k), f"LAMMPS ({k:.0e} N/m), a second of crowd") for k in (1e6, 1e7)},
    "rigid": (of_rigid, "rigid engine (5 ms), a second of crowd"),
}


def scene_of(now: Snapshot, walls: Walls) -> Scene:
    """A heap, driven as `arch` is."""
    ends = enumerate(zip(walls.start.tolist(), walls.end.tolist(), strict=True))
    named = tuple(Wall(name=f"wall{n}", start_m=tuple(a), end_m=tuple(b)) for n, (a, b) in ends)
    scene = read_scene("arch").model_copy(update={"name": "heap", "walls": named, "snapshot": now})
    return scene.with_run(rigid_step_s=RIGID_STEP_S, duration_s=1.0, frames=1)


def move(disks: int, seed: int, path: Path) -> str:
    """Move a heap from rest, and write where it is then; how far it was moved, in words."""
    case, spent = heap(disks, seed), 0.0
    still, radius = np.zeros_like(case.snapshot.velocity), case.snapshot.radius.copy()
    # the heap begins with two disks that overlap by 5 mm: one is made smaller
    np.add.at(radius, case.contacts.first, np.minimum(case.contacts.gap, 0.0))
    start = dataclasses.replace(case.snapshot, velocity=still, radius=radius)
    motion = motion_of(scene_of(start, case.walls), start)
    while motion.time < MOVED_S - 0.5 * motion.step and spent < MOVE_CPU_S:
        seconds, report = timed(motion.advance)
        spent += seconds
    arrays = {key: getattr(motion.snapshot(), key) for key in STATE}
    np.savez(path, **arrays, start=case.walls.start, end=case.walls.end)
    pressed = np.count_nonzero(report.reaction)
    return f"{disks:,} disks, seed {seed}: moved {motion.time:.3f} s, {spent:.0f} CPU s, {pressed:,} press"


def measure(what: str, disks: int, seed: int, path: Path) -> dict[str, object]:
    """Measure a method at a size, in this process."""
    logging.disable(logging.WARNING)  # crowds so large are too soft: here only cost counts
    for few in WARM:  # loads the kernels
        if few < disks and not what.startswith("LAMMPS"):
            of_percussions(heap(few))
    method, _ = METHODS[what]
    if what == "percussions":
        unit, second, quality = method(heap(disks, seed))
    else:
        of = np.load(path)
        now = Snapshot(**{key: of[key] for key in STATE})
        unit, second, quality = method(scene_of(now, Walls(start=of["start"], end=of["end"])))
    who = resource.RUSAGE_CHILDREN if what.startswith("LAMMPS") else resource.RUSAGE_SELF
    peak = resource.getrusage(who).ru_maxrss / 1024**2
    measured = {"unit_s": unit, "second_s": second, "residual_or_s": quality, "peak_GB": peak}
    return {"what": what, "disks": disks, "seed": seed} | measured


def main() -> None:
    """Measure, print and write."""
    args = options(__doc__, sizes=SIZES, seeds=SEEDS, what=METHODS, out=Path("out/sizes"))
    args.out.mkdir(parents=True, exist_ok=True)
    print(describe(), f"LAMMPS {LAMMPS.version()}", flush=True)
    rows: list[dict[str, object]] = []
    for disks, seed in itertools.product(args.sizes, args.seeds):
        if disks > MANY and seed != args.seeds[0]:
            continue
        path = args.out / f"{disks}_{seed}.npz"
        print(in_process(move, disks, seed, path), flush=True)
        for what in args.what:
            if disks > LARGEST and what.startswith("LAMMPS"):
                continue
            rows.append(in_process(measure, what, disks, seed, path))
            print(rows[-1], flush=True)
            found = pd.DataFrame(rows)
            found["shown_s"] = found.second_s.fillna(found.unit_s)
            rigid = found[found.what == "rigid"].set_index(["disks", "seed"]).second_s
            crowds = pd.MultiIndex.from_frame(found[["disks", "seed"]])
            found["ratio"] = found.second_s / rigid.reindex(crowds).to_numpy()
            write_text(args.out / "sizes.md", f"{describe()}\n\n{table_of(found)}\n")
            write_text(args.out / "sizes.csv", found.drop(columns="shown_s").to_csv(index=False))
    print(table_of(found))


def table_of(found: pd.DataFrame) -> str:
    """One row a crowd, one column a method."""
    whats = [what for what in METHODS if what in set(found.what)]
    cells = found.apply(_cell, axis=1)
    lines = []
    for (disks, seed), here in found.groupby(["disks", "seed"]):
        known = dict(zip(here.what, cells[here.index], strict=True))
        lines.append([f"{disks:,}", seed, *(known.get(what, "–") for what in whats)])
    return table(["disks", "seed", *(METHODS[what][1] for what in whats)], lines)


def _cell(row: pd.Series) -> str:
    """Seconds; their ratio to the rigid engine's and s, or the residual; memory."""
    soft = f"{row.ratio:.2f} times, s = {row.residual_or_s:.2g}"
    quality = soft if row.what.startswith("LAMMPS") else f"{row.residual_or_s:.0e}"
    return f"{float(f'{row.shown_s:.2g}'):,g} s, {quality}, {row.peak_GB:.2g} GB"


if __name__ == "__main__":
    main()
