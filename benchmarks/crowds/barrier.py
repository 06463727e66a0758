"""Barrier loads: a crowd of some depth that presses against a wall with the push of the Green
Guide's table, in every engine.

    nice -n 19 python benchmarks/crowds/barrier.py FOLDER

A lane 4 m wide, 47 people on 10 m² from ANSUR II, nobody walking at first, each pushing with what
Table 11.2 implies on the flat: load / depth / density. No friction. Prints a table: load per metre
of wall, as median and range over crowds. Runs that are in the folder are taken as they are."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from analysis.dumps.windows import RunWindows
from analysis.engines import engine
from analysis.engines.run import EngineRun
from analysis.scene.anthropometry import apart, bodies_of
from analysis.scene.contact import ContactModel
from analysis.scene.parts import Analysis, Drive, Room, Run, Wall
from analysis.scene.scene import Scene
from nscd import Snapshot, Walls
from nscd.arrays import Floats

# Green Guide, Table 11.2, lowest slope: depth of the crowd (m) → load (N per m of barrier).
TABLE = {2.0: 2000.0, 3.0: 3000.0, 4.0: 4000.0, 5.0: 5000.0}
DENSITY, WIDTH = 4.7, 4
PUSH_N = 1000.0 / DENSITY
TAU_S, DURATION_S, LAST_S, CROWDS = 0.5, 5.0, 2.0, 3
MODELS: Mapping[str, tuple[str, dict[str, object]]] = {
    "LAMMPS, 10⁶ N/m": ("lammps", {}),
    "YADE, 10⁶ N/m": ("yade", {}),
    "LAMMPS, a chest": ("lammps", {"law": "body_hertz"}),
    "rigid": ("rigid", {}),
}


def crowd(depth: float, seed: int) -> Snapshot:
    """Draw people at 4.7 per m² behind the wall x = 0: on a grid, moved by up to 0.1 m, pushed
    apart where they overlap."""
    count = round(DENSITY * depth * WIDTH)
    random = np.random.default_rng([seed, 6])
    rows = int(np.ceil(depth * np.sqrt(DENSITY)))
    across = int(np.ceil(count / rows))
    place = np.stack(np.divmod(np.arange(count), across), axis=1) + 0.5
    place = place * [-depth / rows, WIDTH / across] + random.uniform(-0.1, 0.1, (count, 2))
    radius, mass = bodies_of("ANSUR II", count, seed)
    disks = Snapshot(position=place, velocity=np.zeros_like(place), radius=radius, mass=mass)
    walls = Walls(
        start=np.array([wall.start_m for wall in lane(depth)]),
        end=np.array([wall.end_m for wall in lane(depth)]),
    )
    return apart(disks, walls)


def lane(depth: float) -> tuple[Wall, ...]:
    """Give the wall, metre by metre, and the sides of the lane."""
    front = [Wall(name=f"front_{y}", start_m=(0, y), end_m=(0, y + 1)) for y in range(WIDTH)]
    sides = [Wall(name=f"side_{y}", start_m=(-depth - 3, y), end_m=(0, y)) for y in (0, WIDTH)]
    return (*front, *sides)


def scene(depth: float, seed: int, changes: Mapping[str, object]) -> Scene:
    """Make the scene."""
    disks = crowd(depth, seed)
    speed = PUSH_N * TAU_S / float(disks.mass.mean())
    room = Room(
        title="A crowd before a barrier",
        source="Green Guide, Table 11.2",
        walls=lane(depth),
        drive=Drive(
            speed_m_per_s=speed,
            relaxation_time_s=TAU_S,
            door_start_m=(0, 0),
            door_end_m=(0, WIDTH),
            outward=(1, 0),
        ),
        contact=ContactModel(stiffness_N_per_m=1e6, restitution=0.1),
        run=Run(duration_s=DURATION_S, frames=round(10 * DURATION_S), impulses=True),
        analysis=Analysis(kind="driven"),
    )
    return Scene.of(room, name=f"barrier_{depth:g}", snapshot=disks).with_contact(**changes)


def loads(run: EngineRun) -> tuple[Floats, Floats]:
    """Run it; give the ends of the windows of 0.1 s, and the load (w, metres) N/m of the wall."""
    record = run.record()
    windows = list(RunWindows(run.folder, record.time_step_s).between_frames())
    found = np.zeros((len(windows), WIDTH))
    for row, window in zip(found, windows, strict=True):
        front = window.is_wall & (window.keys[:, 1] <= WIDTH)
        np.add.at(
            row, window.keys[front, 1] - 1, np.abs(window.impulse[front, 0]) / window.duration
        )
    return np.array([window.end for window in windows]), found


def measured(run: EngineRun, people: Snapshot) -> list[float]:
    """Give loads in kN per m: of the whole wall over the last 2 s, what balance gives, the largest
    0.1 s of the whole wall, and the most loaded metre over the last 2 s and in its largest 0.1 s."""
    end, load = loads(run)
    last = load[end > DURATION_S - LAST_S + 1e-9]
    balance = PUSH_N * float(people.mass.sum() / people.mass.mean()) / WIDTH
    whole = load.mean(1)
    values = [last.mean(), balance, whole.max(), last.mean(0).max(), load.max()]
    return [1e-3 * float(value) for value in values]


def main() -> None:
    """Run all, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    out = parser.parse_args().out
    print(f"push of a person: {PUSH_N:.0f} N")
    head = ["depth (m)", "table (kN/m)", "model", "last 2 s", "balance", "largest 0.1 s"]
    head += ["worst metre, last 2 s", "worst metre, 0.1 s", "deepest overlap (r)"]
    print("| " + " | ".join(head) + " |\n" + "|---" * len(head) + "|")
    for depth, table in TABLE.items():
        for title, (name, changes) in MODELS.items():
            if engine(name).find() is None:
                continue
            rows, deep = [], 0.0
            for seed in range(1, CROWDS + 1):
                made = scene(depth, seed, changes)
                folder = out / f"{depth:g}_{seed}_{name}_{'_'.join(map(str, changes.values()))}"
                run = EngineRun(scene=made, engine=name, folder=folder)
                rows.append(measured(run, made.snapshot))
                deep = max(deep, run.record().overlap_largest)
            cells = [_cell(np.array(column)) for column in zip(*rows, strict=True)]
            print(
                f"| {depth:g} | {table / 1000:g} | {title} | {' | '.join(cells)} | {deep:.2f} |",
                flush=True,
            )


def _cell(values: Floats) -> str:
    """Median and range."""
    return f"{np.median(values):.2f} ({values.min():.2f} – {values.max():.2f})"


if __name__ == "__main__":
    main()
