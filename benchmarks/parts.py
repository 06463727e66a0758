"""What parts of the model cost, side by side in CPU seconds: the ways of a floor of 200 walls (54 rooms
with a doorway in each wall) for 1,000 people to one door, and one look at where all go next; 1 s of
`arch` with a way or with arms and without, the least of several turns; and a step and a solution of
as many bodies of five disks as disks that press into a corner.

    nice -n 19 python benchmarks/parts.py [--what ways runs bodies] [--repeats 5] [--people 594]
        [--steps 100] [--friction 0]

A body is 0.51 m broad and 0.25 m deep (ANSUR II); the disk has its area."""

import argparse
import tempfile
from functools import partial
from itertools import count, pairwise
from pathlib import Path

import numpy as np

from analysis.engines.run import simulate
from analysis.scene.drive import Drive
from analysis.scene.scene import Scene, read_scene
from benchmarks.machine import describe, in_turn, options, table, timed
from nscd import ContactLaw, Snapshot, Walls, find_contacts, solve
from nscd.arrays import Floats
from nscd.stepping import Motion, Push

ROOM_M, ACROSS, UP, DOORWAY_M = 4.0, 9, 6, 1.0
# Places across (m) and radii (m) of the disks of a body.
PLACES_M = np.array([-0.165, -0.09, 0.0, 0.09, 0.165])
RADII_M = np.array([0.09, 0.115, 0.125, 0.115, 0.09])
DISK_M = 0.18
MEETING_S, STEP_S, SOLUTIONS = 4.0, 5e-3, 20
CORNER = Walls(start=[[0, 0], [0, 0]], end=[[99, 0], [0, 99]])


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


def ways(given: argparse.Namespace) -> str:
    """Time floors."""
    rows = []
    for seed in range(given.repeats):
        walls, drive = floor(seed)
        place = np.random.default_rng(seed).uniform(0.3, [35.7, 23.7], (1000, 2))
        seconds, routed = timed(partial(drive.routed, walls, 0.25))
        look, _ = timed(partial(routed.desired_velocity, place))
        lost = int((routed.way.at(place, 0, routed.way.next) < 0).sum())
        rows.append([len(walls), len(place), f"{seconds:.2f}", f"{look:.2g}", lost])
    return table(["walls", "people", "ways (CPU s)", "look (CPU s)", "people without a way"], rows)


def runs(given: argparse.Namespace) -> str:
    """Time 1 s of `arch`, where everybody sees the door and nobody has arms, with either."""
    plain = read_scene("arch").with_run(duration_s=1.0, frames=4)
    scenes = {
        "plain": plain,
        "with a way": plain.with_drive(clearance_m=0.15),
        "with arms": plain.with_contact(arm_reach_m=0.15, arm_force_N=200.0),
    }
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        number = count()

        def spent(scene: Scene, engine: str) -> float:
            return simulate(scene, engine, Path(folder) / str(next(number))).cpu_seconds

        for engine in ("lammps", "rigid"):
            calls = {name: partial(spent, scene, engine) for name, scene in scenes.items()}
            least = {name: min(found) for name, found in in_turn(calls, given.repeats).items()}
            over = (f"{seconds:.3g} ({seconds / least['plain']:.2f})" for seconds in least.values())
            rows.append([engine, *over])
    return table(["engine", *(f"{name} (CPU s, over plain)" for name in scenes)], rows)


def crowd(people: int, wide: bool) -> Snapshot:
    """Make people on a square grid 0.55 m apart, turned at random."""
    rng = np.random.default_rng(1)
    side = int(np.ceil(np.sqrt(people)))
    place = 0.35 + 0.55 * np.column_stack(np.divmod(np.arange(people), side))
    place += rng.uniform(-0.02, 0.02, place.shape)
    if not wide:
        radius, mass = np.full(people, DISK_M), np.full(people, 75.0)
        return Snapshot(position=place, radius=radius, mass=mass)
    angle = rng.uniform(-0.5, 0.5, people)
    way = np.column_stack([np.sin(angle), np.cos(angle)])
    disks = (place[:, None] + PLACES_M[:, None] * way[:, None]).reshape(-1, 2)
    radius = np.tile(RADII_M, people)
    mass = 75.0 * radius**2 / (RADII_M**2).sum()
    one = Snapshot(position=disks, radius=radius, mass=mass)
    return one.joined(np.repeat(np.arange(people), len(RADII_M)))


def into_the_corner(position: Floats) -> Floats:
    """Walk to the corner at 1.5 m/s."""
    distance = np.hypot(*position.T)[:, None]
    return np.ascontiguousarray(-1.5 * position / np.maximum(distance, 0.1))


def pressed(people: int, wide: bool, steps: int, friction: float) -> list[float]:
    """Measure ms a step of a crowd that has met and ms a solution of its end, and count contacts."""
    push = Push(desired=into_the_corner, relaxation_time=0.5)
    start = crowd(people, wide)
    motion = Motion(start, CORNER, step=STEP_S, push=push, friction=friction)
    motion.separate()
    for _ in range(round(MEETING_S / STEP_S)):
        motion.advance()
    stepping, _ = timed(lambda: [motion.advance() for _ in range(steps)])
    end = motion.snapshot()
    contacts = find_contacts(end, CORNER, tolerance=1e-4)
    left, law = into_the_corner(end.position), ContactLaw(friction=friction)
    solution = partial(solve, end, contacts, left_velocity=left, law=law)
    assert solution().status == "solved"
    solving, _ = timed(lambda: [solution() for _ in range(SOLUTIONS)])
    return [1e3 * stepping / steps, 1e3 * solving / SOLUTIONS, len(contacts)]


def bodies(given: argparse.Namespace) -> str:
    """Time disks and bodies of five, and their ratio."""
    asked = given.steps, given.friction
    rows = [pressed(given.people, wide, *asked) for wide in (False, True)]
    ratio = [two / one for one, two in zip(*rows, strict=True)]
    named = zip(("disks", "bodies of five", "ratio"), [*rows, ratio], strict=True)
    cells = [(name, *(f"{value:.3g}" for value in row)) for name, row in named]
    return table(("people", "ms a step", "ms a solution", "contacts"), cells)


def main() -> None:
    """Print the tables."""
    parts = {"ways": ways, "runs": runs, "bodies": bodies}
    given = options(__doc__, what=parts, repeats=5, people=594, steps=100, friction=0.0)
    print(describe())
    for name in given.what:
        print("", parts[name](given), sep="\n", flush=True)


if __name__ == "__main__":
    main()
