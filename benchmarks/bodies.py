"""The cost of five-disk bodies over that of disks: as many people press into a corner, side by side.

    python benchmarks/bodies.py [--people 594] [--steps 100] [--friction 0]

CPU seconds of the steps of a rigid crowd, from when it has met, and of the percussions of its end.
A body is 0.51 m broad and 0.25 m deep (ANSUR II); the disk has its area."""

import time
from collections.abc import Callable

import numpy as np

from benchmarks.machine import describe, options, table
from nscd import ContactLaw, Percussions, Snapshot, Walls, find_contacts, solve
from nscd.stepping import Motion, Push

# Places across (m) and radii (m) of the disks of a body.
ACROSS = np.array([-0.165, -0.09, 0.0, 0.09, 0.165])
RADII = np.array([0.09, 0.115, 0.125, 0.115, 0.09])
DISK = 0.18
MEETING_S, STEP_S = 4.0, 5e-3
CORNER = Walls(start=[[0, 0], [0, 0]], end=[[99, 0], [0, 99]])


def crowd(people: int, wide: bool) -> Snapshot:
    """Make people on a square grid 0.55 m apart, turned at random."""
    rng = np.random.default_rng(1)
    side = int(np.ceil(np.sqrt(people)))
    place = 0.35 + 0.55 * np.column_stack(np.divmod(np.arange(people), side))
    place += rng.uniform(-0.02, 0.02, place.shape)
    if not wide:
        radius, mass = np.full(people, DISK), np.full(people, 75.0)
        return Snapshot(position=place, velocity=np.zeros_like(place), radius=radius, mass=mass)
    angle = rng.uniform(-0.5, 0.5, people)
    way = np.column_stack([np.sin(angle), np.cos(angle)])
    disks = (place[:, None] + ACROSS[:, None] * way[:, None]).reshape(-1, 2)
    radius = np.tile(RADII, people)
    mass = 75.0 * radius**2 / (RADII**2).sum()
    still = np.zeros_like(disks)
    one = Snapshot(position=disks, velocity=still, radius=radius, mass=mass)
    return one.joined(np.repeat(np.arange(people), len(RADII)))


def into_the_corner(position: np.ndarray) -> np.ndarray:
    """Walk to the corner at 1.5 m/s."""
    distance = np.hypot(*position.T)[:, None]
    return np.ascontiguousarray(-1.5 * position / np.maximum(distance, 0.1))


def seconds(act: Callable[[], object], repeats: int = 1) -> float:
    """Measure the CPU seconds of one of several calls."""
    start = time.process_time()
    for _ in range(repeats):
        act()
    return (time.process_time() - start) / repeats


def measured(people: int, wide: bool, steps: int, friction: float) -> list[float]:
    """Measure ms a step and a solution, and count contacts."""
    push = Push(desired=into_the_corner, relaxation_time=0.5)
    start = crowd(people, wide)
    motion = Motion(start, CORNER, step=STEP_S, push=push, friction=friction)
    motion.separate()
    for _ in range(round(MEETING_S / STEP_S)):
        motion.advance()
    step = seconds(motion.advance, steps)
    end = motion.snapshot()
    contacts = find_contacts(end, CORNER, tolerance=1e-4)
    left, law = into_the_corner(end.position), ContactLaw(friction=friction)

    def percussions() -> Percussions:
        return solve(end, contacts, left_velocity=left, law=law)

    assert percussions().status == "solved"
    return [1e3 * step, 1e3 * seconds(percussions, 20), len(contacts)]


def main() -> None:
    """Print the table."""
    given = options(__doc__, people=594, steps=100, friction=0.0)
    print(describe())
    rows = [measured(given.people, wide, given.steps, given.friction) for wide in (False, True)]
    ratio = [two / one for one, two in zip(*rows, strict=True)]
    named = zip(("disks", "bodies of five", "ratio"), [*rows, ratio], strict=True)
    cells = [(name, *(f"{value:.3g}" for value in row)) for name, row in named]
    print(table(("people", "ms a step", "ms a solution", "contacts"), cells))


if __name__ == "__main__":
    main()
