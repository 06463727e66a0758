"""A crowd of N disks in a room of fixed size before a 1 m exit that opens."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from analysis.paper.continuum.exit_room import EXIT, to_exit
from analysis.scene.packing import heap, press
from nscd import Percussions, Snapshot, Walls, find_contacts, solve
from nscd.arrays import Floats
from nscd.continuum.medium import PERSON
from nscd.stress import FlowField, Kernel, StressField, flow_field, stress_field

HALF_DOOR = 0.5 * EXIT  # m
SPEED = 2.0  # m/s, toward the nearest point of the exit
PEOPLE, RADIUS = 600, 0.215  # how many of which mean radius (m) make up the crowd's mass and size
MASS = PERSON * PEOPLE
KERNEL = Kernel(width=0.4, compact=True)
SPACING = 0.25  # m, of the points where fields are compared
WITHIN = 7.25  # m of the exit, where these points lie; crowds end at 7.8 to 8 m
SOFTNESS = 0.02
NEAR = 0.2  # of the mean radius


class Packing(StrEnum):
    """Which disks count as touching, and how they came to stand."""

    TOUCHING = "touching"
    NEAR = "near"
    PRESSED = "pressed"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sample:
    """One crowd: its answer and its fields at `points`.

    size: m, R: the crowd fills x < 0 within R of the exit.
    coordination: contacts per disk, 2k/n on average.
    stress, flow, left: the fields of percussions, u⁺ and u⁻ by KERNEL.
    kept: Σm|u⁺|²/Σm|u⁻|², which for k = 0 is also Σmu⁺·u⁻/Σm|u⁻|².
    wall_load: N·s, Σ of the walls' percussions along x.
    """

    seed: int
    size: float
    coordination: float
    answer: Percussions
    stress: StressField
    flow: FlowField
    left: FlowField
    kept: float
    wall_load: float


def sample(packing: Packing, n: int, seed: int) -> Sample:
    """Pack n disks of mean radius 0.215 m·√(600/n) and 45 t in all, masses ∝ r², and solve their
    percussions with k = 0.

    The door is shut while the crowd packs, and open when it walks. touching: a heap just as it was
    grown, contacts where disks touch; near: the same heap, gaps up to 0.2 mean radii count as
    contacts; pressed: soft disks at rest against the shut door, contacts where they overlap.
    """
    mean = RADIUS * np.sqrt(PEOPLE / n)
    position, radius = heap(n, seed, mean, HALF_DOOR)
    if packing is Packing.PRESSED:
        position, rested = press(position, radius, HALF_DOOR, SOFTNESS)
        if not rested:
            raise RuntimeError(f"{n} pressed disks did not come to rest (seed {seed})")
    tolerance = {Packing.TOUCHING: 1e-9, Packing.NEAR: NEAR * mean, Packing.PRESSED: 0.0}[packing]
    snapshot = Snapshot(
        position=position,
        velocity=toward_exit(position),
        radius=radius,
        mass=MASS * radius**2 / (radius**2).sum(),
    )
    far = 2.0 * float(np.abs(position).max())
    walls = Walls(
        start=np.array([[0, -far], [0, HALF_DOOR]]), end=np.array([[0, -HALF_DOOR], [0, far]])
    )
    contacts = find_contacts(snapshot, walls, tolerance=tolerance)
    # where λ is not unique its choice moves the pressure by less than a thousandth: the cheapest
    # will do
    answer = solve(snapshot, contacts, canonical=False)
    at = points()
    energy = [
        float((snapshot.mass[:, None] * u**2).sum())
        for u in (answer.right_velocity, snapshot.velocity)
    ]
    return Sample(
        seed=seed,
        size=crowd_size(position),
        coordination=2 * len(contacts) / n,
        answer=answer,
        stress=stress_field(snapshot, contacts, answer.impulse, KERNEL, at),
        flow=flow_field(snapshot, answer.right_velocity, KERNEL, at),
        left=flow_field(snapshot, snapshot.velocity, KERNEL, at),
        kept=energy[0] / energy[1],
        wall_load=float(answer.impulse[contacts.is_wall, 0].sum()),
    )


def points() -> Floats:
    """Where fields are compared, (m,2) m: a square grid within 7.25 m of the exit."""
    axis = np.arange(0.5 * SPACING, WITHIN + 2 * HALF_DOOR, SPACING)
    grid = np.stack(
        np.meshgrid(-axis, np.concatenate([-axis[::-1], axis]), indexing="ij"), -1
    ).reshape(-1, 2)
    return grid[to_exit(grid) <= WITHIN]


def toward_exit(position: Floats) -> Floats:
    """2 m/s toward the nearest point of the exit, 0 on it: (n,2) m → (n,2) m/s."""
    way = -position
    way[:, 1] += np.clip(position[:, 1], -HALF_DOOR, HALF_DOOR)
    distance = np.hypot(*way.T)[:, None]
    velocity: Floats = SPEED * np.divide(way, distance, out=np.zeros_like(way), where=distance > 0)
    return velocity


def area(size: float) -> float:
    """Of x < 0 within `size` (m) of the exit, m²."""
    return 0.5 * np.pi * size**2 + 2 * HALF_DOOR * size


def crowd_size(position: Floats) -> float:
    """R (m) of a crowd of even density: half of it stands on half the area, within the median
    distance of the exit."""
    whole = 2 * area(float(np.median(to_exit(position))))
    return float((np.sqrt((2 * HALF_DOOR) ** 2 + 2 * np.pi * whole) - 2 * HALF_DOOR) / np.pi)
