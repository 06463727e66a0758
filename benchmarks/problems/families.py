"""Families of contact problems: arrays that `nscd` takes, any size, reproducible.

heap: disks (0.18–0.25 m) grown round an arch at a 1 m exit, each touching two others or the wall:
nearly isostatic; jammed: the same relaxed as soft disks with the door closed; contacts are
overlaps, redundant and ill-conditioned; hexagonal: equal disks on a lattice, redundant; chain: a
line against a wall; masses: the heap with masses 1:10⁶; gate: one frame of a real crowd before a
gate, the scene `gate`, in its one size; push: a row of people before a wall, the last of whom is
pushed. The left velocity is 2 m/s toward the nearest point of the exit (along the chain; in `gate`
the scene's own; in `push` of the last alone); pressed: the heap pushed together, as deeply and evenly as
chance has it, so that it overlaps like a frame of a soft engine."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from analysis.scene.packing import REST
from analysis.scene.scene import read_scene
from nscd import Contacts, Snapshot, Walls, _core, find_contacts
from nscd.arrays import normal
from nscd.segments import lengths

DOOR = 0.5  # half width, m
WIDEST, SKIN = 0.25, 0.05  # m
# Of a pushed row: how far people stand to the left and right of it (m).
ASIDE = 0.03
# The ends of the wall before a chain and a row (m).
ACROSS = [[[0.0, -1.0], [0.0, 1.0]]]


class Case(NamedTuple):
    """One contact problem; left_velocity: (n,2) m/s, u⁻."""

    name: str
    snapshot: Snapshot
    walls: Walls
    contacts: Contacts
    left_velocity: Any


def heap(n: int, seed: int = 1) -> Case:
    """A heap of n disks of 75 kg."""
    position, radius = _heap(n, seed)
    return _case("heap", position, radius, np.full(n, 75.0), 1e-9, closed=False)


def masses(n: int, seed: int = 1) -> Case:
    """The heap with masses from 10⁻³ to 10³ times 75 kg."""
    position, radius = _heap(n, seed)
    # 12 are those of every processor
    mass = 75.0 * 10.0 ** np.random.default_rng(seed).uniform(-3, 3, n)
    mass = np.array([float(f"{one:.12g}") for one in mass])
    return _case("masses", position, radius, mass, 1e-9, closed=False)


def jammed(n: int, seed: int = 1) -> Case:
    """The heap pressed to a closed door until its soft disks rest: no force is off balance by more
    than a thousandth of the mean contact force."""
    position, radius = _heap(n, seed)
    # stiffer in a larger crowd, so that overlaps stay below a tenth of a radius
    # stiffness waves cross a larger crowd more slowly, hence the steps
    stiffness, maximum = 1e6 * np.sqrt(n / 594), 20_000 + int(400 * np.sqrt(n))
    root, cell = np.sqrt(stiffness), 2 * float(radius.max()) + SKIN
    rested = _core.press(
        position, radius, np.full(n, 75.0 * 2.0 / 0.5), half_door=DOOR, stiffness=stiffness,
        step=0.02 / root, longest=0.5 / root, skin=SKIN, cell=cell, force_tolerance=REST, max_steps=maximum,
    )  # fmt: skip
    if not rested:
        raise RuntimeError(f"{n} jammed disks did not come to rest")
    return _case("jammed", position, radius, np.full(n, 75.0), 0.0, closed=True)


def hexagonal(n: int, seed: int = 1) -> Case:
    """The n sites of a touching triangular lattice (0.2 m) that are nearest to the door."""
    del seed
    r = 0.2
    m = int(np.sqrt(n)) + 2
    i, j = (a.ravel() for a in np.meshgrid(np.arange(m), np.arange(-m, m + 1), indexing="ij"))
    position = np.column_stack([-r - i * r * np.sqrt(3), (j + 0.5 * (i % 2)) * 2 * r])
    position = position[np.argsort(lengths(position), kind="stable")[:n]]
    return _case("hexagonal", position, np.full(n, r), np.full(n, 75.0), 1e-9, closed=False)


def chain(n: int, seed: int = 1) -> Case:
    """n disks in line against a wall, all at 2 m/s into it."""
    del seed
    position = np.column_stack([0.5 * np.arange(n) - 0.5 * n + 0.25, np.zeros(n)])
    velocity = np.tile([2.0, 0.0], (n, 1))
    return _before("chain", ACROSS, position, velocity, np.full(n, 0.25), np.full(n, 75.0))


def gate(n: int = 0, seed: int = 1) -> Case:
    """The people of the scene `gate`, however many are asked for; contacts are those that touch to
    1e-6 m."""
    del n, seed
    scene = read_scene("gate")
    snapshot, walls = scene.snapshot, scene.wall_segments()
    assert scene.drive is not None
    contacts = find_contacts(snapshot, walls, tolerance=scene.analysis.contact_tolerance_m)
    return Case("gate", snapshot, walls, contacts, scene.drive.desired_velocity(snapshot.position))


def push(n: int, seed: int = 1) -> Case:
    """A row of n people who touch, a little aside of each other, before a wall; the last of them is
    pushed at 2 m/s."""
    rng = np.random.default_rng(seed)
    radius, aside = rng.uniform(0.18, 0.25, n), rng.uniform(-ASIDE, ASIDE, n)
    mass = rng.uniform(55.0, 100.0, n)
    intervals, beside = radius[1:] + radius[:-1], np.diff(aside)
    between = np.sqrt(intervals * intervals - beside * beside)
    along = -radius[0] - np.concatenate([[0.0], np.cumsum(between)])
    velocity = np.zeros((n, 2))
    velocity[-1, 0] = 2.0
    return _before("push", ACROSS, np.column_stack([along, aside]), velocity, radius, mass)


def pressed(n: int, seed: int = 1) -> Case:
    """A heap that overlaps: drawn together by up to 7 %, displaced by 10 mm and pushed apart for up to 119
    rounds. By seed the door is open or closed, contacts are 1e-9 or 1e-3 m, masses and speeds differ."""
    rng = np.random.default_rng(1000 * n + seed)
    position, radius = _heap(n, seed)
    position = position * rng.uniform(0.93, 0.995) + 0.01 * normal(rng, (n, 2))
    position[:, 0] = np.minimum(position[:, 0], -0.9 * radius)
    for _ in range(int(rng.integers(0, 120))):
        pair = cKDTree(position).query_pairs(2 * WIDEST, output_type="ndarray")
        separation = position[pair[:, 1]] - position[pair[:, 0]]
        distance = lengths(separation)
        overlap = np.maximum(radius[pair].sum(1) - distance, 0) / distance
        push = 0.25 * overlap[:, None] * separation
        moved = np.zeros((n, 2))
        np.add.at(moved, pair[:, 0], -push)
        np.add.at(moved, pair[:, 1], push)
        moved[:, 0] -= 0.5 * np.maximum(position[:, 0] + radius, 0)
        position = position + moved
    even, shut, noisy = seed % 4 != 0, seed % 2 == 0, seed % 3 == 0
    mass = np.full(n, 75.0) if even else rng.uniform(50.0, 110.0, n)
    case = _case("pressed", position, radius, mass, 1e-3 if shut else 1e-9, closed=shut)
    noise = 0.3 * normal(rng, (n, 2)) if noisy else 0.0
    return case._replace(left_velocity=case.left_velocity + noise)


_MAKERS = (heap, jammed, hexagonal, chain, masses, gate, push, pressed)
FAMILIES: dict[str, Callable[..., Case]] = {make.__name__: make for make in _MAKERS}


def _case(name: str, position: Any, radius: Any, mass: Any, tolerance: float, closed: bool) -> Case:
    y = position[:, 1]
    target = np.column_stack([np.zeros(len(y)), np.clip(y, -DOOR, DOOR)])
    towards = target - position
    velocity = 2.0 * towards / lengths(towards)[:, None]
    reach = float(np.abs(position).max()) + 1.0
    shut = [[[0.0, -reach], [0.0, reach]]]
    ajar = [[[0.0, -reach], [0.0, -DOOR]], [[0.0, DOOR], [0.0, reach]]]
    ends = shut if closed else ajar
    return _before(name, ends, position, velocity, radius, mass, tolerance=tolerance)


def _before(name: str, ends: Any, *disks: Any, tolerance: float = 1e-9) -> Case:
    """The case of disks, their places, velocities, radii and masses, before walls with these ends (m)."""
    start, end = np.array(ends).swapaxes(0, 1)
    walls = Walls(start=start, end=end)
    names = "position", "velocity", "radius", "mass"
    snapshot = Snapshot(**dict(zip(names, disks, strict=True)))
    contacts = find_contacts(snapshot, walls, tolerance=tolerance)
    return Case(name, snapshot, walls, contacts, disks[1])


def _heap(n: int, seed: int) -> tuple[Any, Any]:
    radius = np.random.default_rng(seed).uniform(0.18, 0.25, n)
    position = np.zeros((n, 2))
    reach = 2.0 * np.sqrt(n * 0.25) + 6.0
    placed = _core.grow(
        position, radius, _arch(position, radius), half_door=DOOR, cell=2 * WIDEST, reach=reach,
        typical=0.215, reach_between=0.43, beside=3.2 * WIDEST, wall_distance=0.17, hollow=0.9, shut=False,
    )  # fmt: skip
    if placed < n:
        raise RuntimeError("the heap stopped growing")
    return position, radius


def _arch(position: Any, radius: Any) -> int:
    """Place an arch of touching disks from wall to wall, on a circle round the door; their
    number."""
    position[0] = -radius[0], 0.75
    for count in range(1, len(radius)):
        rho, step = 0.8, radius[count - 1] + radius[count]
        sine = step / (2 * rho)  # of half the angle between both, seen from the door
        x, y = rho * position[count - 1] / lengths(position[count - 1])
        c, s = 1 - 2 * sine * sine, 2 * sine * np.sqrt(1 - sine * sine)
        position[count] = x * c - y * s, x * s + y * c
        if position[count, 0] > -radius[count]:
            return count
    return len(radius)
