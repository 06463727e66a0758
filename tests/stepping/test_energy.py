"""Where the energy of rigid steps goes, against closed forms; works and losses sum to what is gained."""

import numpy as np
import pytest

from nscd import Walls
from nscd.stepping import Arms, Motion, Push
from tests.crowds import disks_at

MASS, SPEED, TAU = 75.0, 2.0, 0.5


def rightwards(position):
    return np.tile([SPEED, 0.0], (len(position), 1))


def steps(motion, count):
    return [motion.advance().energy for _ in range(count)]


def lost(energies):
    """Along the normal and across (J)."""
    parts = [(e.impact.sum(), e.friction.sum()) for e in energies]
    return [float(sum(column)) for column in zip(*parts, strict=True)]


def test_an_impact_loses_what_restitution_takes():
    """½ m_eff v² (1 − e²), in the contact that hit."""
    pair = disks_at([[0.0, 0.0], [0.61, 0.0]], [[2.0, 0.0], [0.0, 0.0]], mass=[75.0, 25.0])
    energies = steps(Motion(pair, step=0.01, restitution=0.6, tolerance=1e-12), 20)
    assert lost(energies) == pytest.approx([0.5 * 75 * 25 / 100 * 4 * (1 - 0.36), 0.0], rel=1e-12)
    assert max(abs(one.error) for one in energies) < 1e-12


def test_a_sliding_disk_loses_the_friction_of_its_way():
    """A disk that slides until it rolls: v from v₀ to ⅔ v₀, so ⅙ m v₀² are left to friction."""
    floor = Walls(start=[[-1.0, 0.0]], end=[[9.0, 0.0]])
    disk = disks_at([[0.0, 0.25]], [[3.0, 0.0]], mass=MASS)
    push = Push(acceleration=(0.0, -10.0))
    motion = Motion(disk, floor, step=0.01, push=push, friction=0.2, tolerance=1e-12)
    energies = steps(motion, 100)
    assert motion.velocity[0, 0] == pytest.approx(2.0, rel=1e-9)
    assert lost(energies) == pytest.approx([0.0, MASS * 9 / 6], abs=1e-9)
    assert sum(one.weight for one in energies) == pytest.approx(0.0, abs=1e-9)


def test_a_drive_gives_a_free_walker_its_energy():
    """u_k = U (1 − (1 + h/τ)^−k): all work of the drive is kinetic."""
    push = Push(desired=rightwards, relaxation_time=TAU)
    motion = Motion(disks_at([[0.0, 0.0]], mass=MASS), step=0.01, push=push)
    energies = steps(motion, 30)
    speed = SPEED * (1 - 1.02**-30)
    assert sum(one.drive for one in energies) == pytest.approx(0.5 * MASS * speed**2, rel=1e-12)
    assert lost(energies) == [0.0, 0.0]


def test_a_row_that_runs_into_a_wall_loses_all_that_the_drive_gave():
    """Four disks with gaps of 5 cm: at rest, impacts have taken start and work, nearest the wall most
    often."""
    index = np.column_stack([-0.3 - 0.55 * np.arange(4), np.zeros(4)])
    row = disks_at(index, (1.0, 0.0), mass=MASS)
    push = Push(desired=rightwards, relaxation_time=TAU)
    walls = Walls(start=[[0.0, -1.0]], end=[[0.0, 1.0]])
    motion = Motion(row, walls, step=0.01, push=push, tolerance=1e-12)
    energies = steps(motion, 200)
    impact, friction = lost(energies)
    assert impact == pytest.approx(4 * 0.5 * MASS + sum(one.drive for one in energies), rel=1e-9)
    assert friction == 0.0
    assert np.abs(motion.velocity).max() < 1e-9


@pytest.mark.parametrize(
    "requested",
    [{}, {"restitution": 0.5}, {"friction": 0.4}, {"arms": Arms(0.1, 300.0)}, {"bodies": True}],
)
def test_all_that_happens_to_a_crowd_sums_up(requested):
    """To 1e-10 of the work, of what contacts lose in sum of magnitudes."""
    arguments, rng, n = dict(requested), np.random.default_rng(0), 36
    x, y = np.meshgrid(np.arange(6), np.arange(6))
    anchor = 0.5 * np.column_stack([x.ravel(), y.ravel()]) + rng.normal(0, 0.02, (n, 2))
    if joined := arguments.pop("bodies", False):
        anchor[1::2] = anchor[::2] + np.array([0.25, 0.0])
    velocity, radius = rng.normal(0, 1, (n, 2)), rng.uniform(0.15, 0.2, n)
    crowd = disks_at(anchor, velocity, radius, rng.uniform(60, 90, n))
    if joined:
        crowd = crowd.joined(np.arange(n) // 2)
        arguments["tolerance"] = 1e-12  # momentum of bodies is balanced to the residual
    room = [[-1, -1], [4, -1], [4, 4], [-1, 4]]
    pulled = {"acceleration": (0, -1), "arms": arguments.pop("arms", None)}
    push = Push(desired=rightwards, relaxation_time=TAU, **pulled)
    walls = Walls(start=room, end=room[1:] + room[:1])
    motion = Motion(crowd, walls, step=0.005, push=push, **arguments)
    energies = steps(motion, 200)
    work = sum(abs(one.drive) + np.abs(one.impact).sum() for one in energies)
    assert work > 1000
    assert max(abs(one.error) for one in energies) < 1e-10 * work / len(energies)
    if not requested:
        gained = 0.5 * crowd.mass @ (motion.velocity**2 - crowd.velocity**2).sum(1)
        assert sum(one.gained for one in energies) == pytest.approx(gained, rel=1e-9)
