"""Friction at the joints of walls is said where a disk can slide over one."""

import numpy as np
import pytest

from analysis.engines.penalty import friction_at_joints
from analysis.scene.scene import Analysis, ContactModel, Run, Scene, Wall
from nscd import Snapshot

INSIDE = (1.0, 1.0)
SQUARE = [((0, 0), (2, 0)), ((2, 0), (2, 2)), ((2, 2), (0, 2)), ((0, 2), (0, 0))]


def scene_of(walls, place, friction):
    return Scene(
        name="joints",
        title="joints",
        source="none",
        walls=tuple(
            Wall(name=f"w{n}", start_m=start, end_m=end) for n, (start, end) in enumerate(walls)
        ),
        contact=ContactModel(stiffness_N_per_m=1e6, restitution=0.1, friction=friction),
        run=Run(duration_s=0.1, frames=2),
        analysis=Analysis(kind="impact"),
        snapshot=Snapshot(position=[place], velocity=[[0, 0]], radius=[0.2], mass=[75.0]),
    )


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
