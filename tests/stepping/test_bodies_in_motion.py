"""Bodies of several disks in motion, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from nscd import Walls
from nscd.stepping import Motion, Push
from tests.crowds import disks_at

FLOOR = Walls(start=[[-99, 0]], end=[[99, 0]])


def rods(*centres, disks=3, radius=0.1, spin=0.0, velocity=(0.0, 0.0)):
    """Touching disks of 20 kg in a row along x about each centre."""
    along = 2 * radius * (np.arange(disks) - (disks - 1) / 2)
    positions = np.concatenate([np.array(at) + np.outer(along, [1.0, 0.0]) for at in centres])
    body = np.repeat(np.arange(len(centres)), disks)
    turning = np.broadcast_to(spin, len(centres))[body]
    moving = np.broadcast_to(velocity, (len(centres), 2))[body]
    return disks_at(positions, moving, radius, 20.0, spin=turning).joined(body)


def momenta(motion, bodies):
    """Linear and angular momentum about the origin, and twice the energy."""
    mass = motion.mass[:, None]
    linear = (mass * motion.velocity).sum(0)
    first = np.unique(bodies.number, return_index=True)[1]
    spin = motion.spin[first]
    centre = bodies.mean(motion.position, motion.mass)
    v = bodies.mean(motion.velocity, motion.mass)
    cross = centre[:, 0] * v[:, 1] - centre[:, 1] * v[:, 0]
    angular = bodies.mass @ cross + bodies.inertia @ spin
    return [*linear, angular, bodies.mass @ (v**2).sum(1) + bodies.inertia @ spin**2]


def test_a_free_rod_turns_about_its_centre_of_mass():
    motion = Motion(rods([0.0, 0.0], spin=3.0, velocity=(1.0, 0.5)), step=0.01)
    for _ in range(100):
        motion.advance()
    way = 0.2 * np.array([np.cos(3.0), np.sin(3.0)])
    wanted = np.array([1.0, 0.5]) + np.outer([-1, 0, 1], way)
    np.testing.assert_allclose(motion.position, wanted, atol=1e-12)
    turning = 3.0 * way[::-1] * [-1, 1]
    np.testing.assert_allclose(motion.velocity[2] - [1.0, 0.5], turning, atol=1e-12)


@pytest.mark.parametrize("inertia", [None, [2.0, 5.0]])
@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_two_rods_keep_their_momenta_and_with_e_1_their_energy(restitution, inertia):
    """One hits the other off its centre."""
    crowd = rods([0.0, 0.0], [0.5, 0.205], velocity=[[1.0, 1.0], [0.0, 0.0]])
    crowd = crowd.joined(crowd.bodies.number, inertia=inertia)
    motion = Motion(crowd, step=1e-3, restitution=restitution, tolerance=1e-13)
    before, pressed, energy = momenta(motion, crowd.bodies), 0.0, []
    for _ in range(60):
        reaction = motion.advance().reaction.sum()
        pressed += reaction
        energy.append(momenta(motion, crowd.bodies)[3])
    assert pressed > 1.0
    after = momenta(motion, crowd.bodies)
    np.testing.assert_allclose(after[:3], before[:3], atol=1e-10)
    if restitution == 1.0:
        assert after[3] == pytest.approx(before[3], rel=1e-10)
    else:
        assert after[3] < before[3] * (1 - 1e-3)
        assert np.diff(energy).max() < 1e-10


@pytest.mark.parametrize("mu", [0.0, 0.2, 0.9])
def test_a_rod_slides_down_a_slope_as_a_block_does(mu):
    """g (sin θ − μ cos θ), or it sticks; the lower end bears more by the moment of friction."""
    angle = np.deg2rad(20)
    pull = 9.81 * np.array([np.sin(angle), -np.cos(angle)])
    crowd = rods([0.0, 0.1])
    push = Push(acceleration=(pull[0], pull[1]))
    motion = Motion(crowd, FLOOR, step=1e-3, friction=mu, push=push, tolerance=1e-11)
    for _ in range(200):
        report = motion.advance()
    fraction = min(mu, np.tan(angle)) * np.cos(angle)
    wanted = 9.81 * (np.sin(angle) - fraction) * 0.2
    np.testing.assert_allclose(motion.velocity, [[wanted, 0.0]] * 3, atol=1e-9)
    neighbours, force = report.neighbours, report.reaction / 1e-3
    moment = force @ crowd.position[neighbours.first, 0]
    assert force.sum() == pytest.approx(60 * 9.81 * np.cos(angle), rel=1e-8)
    assert moment == pytest.approx(0.1 * 60 * 9.81 * fraction, rel=1e-7, abs=1e-7)
    assert motion.overlap < 1e-9


def test_a_driven_rod_presses_a_wall_with_its_push_and_lies_flat():
    """It walks on with m U/τ = 240 N; the wall turns it until all of it touches."""
    crowd = rods([0.0, 0.0])
    angle = np.deg2rad(60)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    tilted = replace(crowd, position=crowd.position @ turn - np.array([0.4, 0.0]))
    wall = Walls(start=[[0.0, -2.0]], end=[[0.0, 2.0]])
    walk = Push(desired=lambda at: np.tile([2.0, 0.0], (len(at), 1)), relaxation_time=0.5)
    motion = Motion(tilted.joined(crowd.bodies.number), wall, step=5e-3, push=walk)
    for _ in range(800):
        report = motion.advance()
    assert report.reaction.sum() / 5e-3 == pytest.approx(60 * 2.0 / 0.5, rel=1e-3)
    np.testing.assert_allclose(motion.position[:, 0], -0.1, atol=1e-3)
    assert motion.overlap < 1e-4


def test_overlapping_bodies_are_pushed_apart_whole():
    crowd = rods([0.0, 0.0], [0.05, 0.17], [0.1, 0.34])
    motion = Motion(crowd, step=1e-3)
    assert 0.01 < motion.separate() < 0.1
    assert motion.overlap < 1e-9
    distance = np.linalg.norm(motion.position[2] - motion.position[0])
    assert distance == pytest.approx(0.4, abs=1e-12)
    motion.forget()
    start = motion.position.copy()
    motion.advance()
    np.testing.assert_allclose(motion.position, start, atol=1e-12)


def test_bodies_of_one_disk_move_as_disks_to_the_bit():
    rng = np.random.default_rng(5)
    crowd = disks_at(rng.uniform(0, 3, (12, 2)), rng.normal(size=(12, 2)), radius=0.1)
    motions = [Motion(one, FLOOR, step=0.01) for one in (crowd, crowd.joined(range(12)))]
    for motion in motions:
        motion.separate()
        for _ in range(50):
            motion.advance()
    np.testing.assert_array_equal(motions[0].position, motions[1].position)
