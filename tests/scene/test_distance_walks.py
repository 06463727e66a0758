"""People who keep their distance: how they come to a door, and that none stands."""

import numpy as np
import pytest

from analysis.engines.programs.rigid import motion_of
from analysis.scene import Crowd, room
from analysis.scene.drive import Drive
from analysis.scene.waiting import opposing
from benchmarks.crowds import real_gate
from nscd import Walls

LAW = {"speed_m_per_s": 1.0, "relaxation_time_s": 0.3, "time_gap_s": 0.5, "push_share": 0.0}
DOOR = {"door_start_m": (0.0, -0.5), "door_end_m": (0.0, 0.5), "outward": (1.0, 0.0)}
FRONT = Walls(start=[(0, -9), (0, 0.5)], end=[(0, -0.5), (0, 9)])


def wish(*anchor, radius=0.2, **more):
    drive = Drive.model_validate(LAW | DOOR | more).routed(FRONT, radius)
    many = np.arange(1, len(anchor) + 1), 0.0, np.full(len(anchor), radius)
    return drive.desired_velocity(np.array(anchor, float), *many)


@pytest.mark.parametrize(
    ("position", "way"),
    [
        ((-3, 0.1), (1, 0)),  # before it
        ((-3, 5), (0, -1)),  # more than 45° aslant: along its line
        ((-5, 2.3), (3, -2)),  # the place 2 m before it, which the own radius is clear of the post
        ((1, 2), (1, 0)),  # beyond
    ],
)
def test_a_door_is_come_to_from_before_it(position, way):
    np.testing.assert_allclose(wish(position)[0], way / np.hypot(*way), atol=1e-12)


@pytest.mark.parametrize("gap", [0.0, 0.05])
def test_nobody_walks_into_a_wall_faster_than_its_gap_allows(gap):
    x, y = wish((-0.2 - gap, 3.0))[0]
    assert x <= gap / 0.5 + 1e-12
    assert y < -1 / 27  # a repulsion of at most 5 turns a way of 1 by n·e ≥ 1/√26


@pytest.mark.parametrize("jostling", [0.0, 0.1])
@pytest.mark.parametrize("door", [0.6, 2.0, opposing(6.0, 3.0), opposing(6.0, 3.0, 1.0)])
def test_nobody_stands_for_ever(door, jostling):
    scene = room("a", 6.0, 3.0, door, Crowd(people=16, radius=0.18, speed=1.34, relaxation=0.3))
    law = {"time_gap_s": 0.6, "push_share": 0.0, "jostling_m_per_s": jostling}
    scene = scene.with_drive(**law).with_run(rigid_step_s=0.02)
    motion, ids = motion_of(scene, scene.snapshot), scene.snapshot.ids
    while motion.time < 60.0 and not scene.drive.gone(motion.position, ids).all():
        motion.advance()
    assert scene.drive.gone(motion.position, ids).all()


def test_the_flow_through_a_real_gate_is_that_of_people():
    law = {
        "time_gap_s": 0.75,
        "relaxation_time_s": 0.3,
        "push_share": 0.0,
        "jostling_m_per_s": 0.06,
    }
    time, anchor, force = real_gate.run(real_gate.gate(2.3), real_gate.crowd(2.3, 20, 0.12, 1), law)
    flow, density, _ = real_gate.measured(time, anchor, 2.3)
    assert [flow, density] == pytest.approx([1.38, 1.24], rel=0.6)  # seen
    assert np.quantile(force, 0.9) < 500.0  # everybody who pushes for ever: 4 to 10 kN
