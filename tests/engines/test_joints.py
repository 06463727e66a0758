"""Friction at the joints of walls is said where a disk can slide over one."""

import numpy as np
import pytest

from analysis.engines.penalty import friction_at_joints
from tests.crowds import disks_at, scene_at

INSIDE = (1.0, 1.0)
SQUARE = [((0, 0), (2, 0)), ((2, 0), (2, 2)), ((2, 2), (0, 2)), ((0, 2), (0, 0))]


def scene_of(walls, place, friction):
    contact = {"stiffness_N_per_m": 1e6, "restitution": 0.1, "friction": friction}
    run = {"duration_s": 0.1, "frames": 2}
    return scene_at(disks_at([place], radius=0.2), walls, contact=contact, run=run)


@pytest.mark.parametrize(
    ("walls", "place", "joints"),
    [
        (SQUARE, INSIDE, 0),  # corners that a disk sits in
        (SQUARE, (4.0, 1.0), 2),  # the two corners that point at it
        ([((0, 0), (1, 0)), ((1, 0), (3, 0))], INSIDE, 1),  # in line
        ([((0, 0), (3, 0)), ((1, 0), (1, -2))], INSIDE, 0),  # an end within a wall
        ([((0, 0), (3, 0))], INSIDE, 0),
    ],
)
def test_joints_that_a_disk_slides_over_are_counted(walls, place, joints):
    said = friction_at_joints(scene_of(walls, place, 0.5))
    assert bool(said) == bool(joints)
    assert not joints or said.startswith(f"friction at {joints} joints of walls")
    assert not friction_at_joints(scene_of(walls, place, 0.0))


def test_the_length_is_that_of_the_spring():
    """μF/k_t with k_t = 2/7 k or what the scene says."""
    scene = scene_of([((0, 0), (1, 0)), ((1, 0), (3, 0))], INSIDE, 0.5)
    length = 0.5 * 1000 / (scene.contact.tangential_ratio * 1e6)
    assert f"over the next {length:.2g} m (at 1000 N" in friction_at_joints(scene)
    assert np.isfinite(length)
