"""What a way costs: CPU seconds to find the ways of a floor of 200 walls (54 rooms with a doorway in
each wall) for 1,000 people to one door, of one look at where all go next, and of runs.

Usage: python benchmarks/way.py [--repeats N]"""

import tempfile
from itertools import pairwise
from pathlib import Path

import numpy as np

from analysis.engines.run import simulate
from analysis.scene.drive import Drive
from analysis.scene.scene import read_scene
from benchmarks.machine import describe, head, line, options, timed
from nscd import Walls
from nscd.arrays import Floats

ROOM_M, ACROSS, UP, DOORWAY_M = 4.0, 9, 6, 1.0


def floor(seed: int) -> tuple[Walls, Drive]:
    """Make the floor, its doorways at random places, and the drive to its door."""
    random = np.random.default_rng(seed)
    lines: list[Floats] = []
    for axis, (walls, rooms) in enumerate(((ACROSS, UP), (UP, ACROSS))):
        for wall in range(1, walls):
            for room in range(rooms):
                gap = random.uniform(0.5, ROOM_M - DOORWAY_M - 0.5)
                along = ROOM_M * room + np.array([[0, gap], [gap + DOORWAY_M, ROOM_M]])
                across = np.full((2, 2), ROOM_M * wall)
                pair = (across, along) if axis == 0 else (along, across)
                lines.extend(np.stack(pair, axis=-1))
    x, y = ROOM_M * ACROSS, ROOM_M * UP
    outer = [(x, 0), (0, 0), (0, y), (x, y), (x, 2.0)]
    lines += [np.array(pair, dtype=float) for pair in pairwise(outer)]
    for _ in range(200 - len(lines)):
        place = random.uniform(1.0, [x - 1.0, y - 1.0])
        lines.append(np.stack([place, place + np.array([0.4, 0.3])]))
    ends = np.array(lines)
    drive = Drive(
        speed_m_per_s=1.3,
        relaxation_time_s=0.5,
        door_start_m=(x, 0.0),
        door_end_m=(x, 2.0),
        outward=(1.0, 0.0),
        clearance_m=0.15,
    )
    return Walls(start=ends[:, 0], end=ends[:, 1]), drive


def row(seed: int) -> str:
    """Time one floor."""
    walls, drive = floor(seed)
    place = np.random.default_rng(seed).uniform(0.3, [35.7, 23.7], (1000, 2))
    seconds, routed = timed(lambda: drive.routed(walls, 0.25))
    look, _ = timed(lambda: routed.desired_velocity(place))
    lost = int((routed.way.at(place, 0, routed.way.next) < 0).sum())
    return line([len(walls), len(place), f"{seconds:.2f}", f"{look:.2g}", lost])


def run(engine: str, clearance: float | None) -> str:
    """Time 1 s of `arch`, where everybody sees the door, straight or with a way."""
    scene = read_scene("arch").with_run(duration_s=1.0, frames=4)
    assert scene.drive is not None
    drive = scene.drive.model_copy(update={"clearance_m": clearance})
    with tempfile.TemporaryDirectory() as folder:
        walking = scene.model_copy(update={"drive": drive}).rerouted()
        return f"{simulate(walking, engine, Path(folder) / 'run').cpu_seconds:.2f}"


def main() -> None:
    """Print the seconds of each floor, and of runs of `arch`."""
    given = options(__doc__, repeats=5)
    print(describe())
    print(head("walls", "people", "ways (CPU s)", "look (CPU s)", "people without a way"))
    for seed in range(given.repeats):
        print(row(seed))
    print(head("engine", "arch, straight (CPU s)", "with a way"))
    for engine in ("lammps", "rigid"):
        for _ in range(given.repeats):
            print(line([engine, run(engine, None), run(engine, 0.15)]))


if __name__ == "__main__":
    main()
