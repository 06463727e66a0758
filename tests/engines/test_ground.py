"""Ground that slopes, in three engines and by hand."""

import numpy as np
import pytest

from analysis.percussions.snapshot import percussions_of
from analysis.scene.scene import SceneError, read_scene
from analysis.scene.schema import GRAVITY, BodyForce
from tests.crowds import disks_at, scene_at

ENGINES = ["lammps", "yade", "rigid"]
DOWNHILL = (0.6, -0.8)


@pytest.mark.parametrize("name", ENGINES)
def test_who_slides_down_a_slope_goes_half_g_sine_times_the_square_of_time(simulate, name):
    scene = scene_at(
        disks_at([[0.0, 0.0]], [[0.3, 0.1]]), name="slope",
        contact={"stiffness_N_per_m": 1e5, "restitution": 0.1},
        run={"duration_s": 0.2, "frames": 2, "time_step_s": 0.001, "rigid_step_s": 0.01},
        body_force=BodyForce(slope_deg=30.0, downhill=DOWNHILL),
    )  # fmt: skip
    found = simulate(name, scene)
    end = [found["x"][-1, 0], found["y"][-1, 0]]
    by_hand = 0.2 * np.array([0.3, 0.1]) + 0.25 * GRAVITY * 0.2**2 * np.array(DOWNHILL)
    np.testing.assert_allclose(end, by_hand, rtol=0, atol=1e-12)


def test_at_rest_a_barrier_carries_the_weight_along_the_slope(simulate):
    scene = read_scene("terrace")
    assert scene.body_force.slope_deg == 25.0
    found, mass = simulate("rigid", scene), scene.snapshot.mass
    carried = [now.force[now.is_wall & (now.second == 2), 0].sum() for now in found.contacts[21:]]
    weight = mass.sum() * GRAVITY * np.sin(np.radians(25.0))
    slowed = mass @ (found["vx"][20] - found["vx"][40]) / 2.0
    assert np.mean(carried) == pytest.approx(weight + slowed, rel=1e-6)
    assert np.mean(carried) == pytest.approx(weight, rel=1e-3)


def test_percussions_at_rest_carry_the_weight_of_all_above():
    row = disks_at([[0.25, 0.0], [0.75, 0.0], [1.25, 0.0]], mass=[60.0, 75.0, 90.0])
    scene = scene_at(
        row, [([0, -1], [0, 1])], name="rest", contact={"stiffness_N_per_m": 1e6, "restitution": 0.1},
        run={"duration_s": 1.0, "frames": 1},
        body_force=BodyForce(slope_deg=10.0, downhill=(-1.0, 0.0)),
    )  # fmt: skip
    found = percussions_of(scene, row)
    above = np.array([165.0, 90.0, 225.0])  # two pairs and the wall
    assert found.unit == "N"
    by_hand = above * GRAVITY * np.sin(np.radians(10.0))
    np.testing.assert_allclose(np.abs(found.force[:, 0]), by_hand, rtol=1e-12)


def test_people_at_rest_on_a_slope_with_friction_are_not_stopped_for_rounding(simulate):
    """Three in a row against a wall overlap by 5e-11 m at the start: pushed apart, they are as much
    higher up."""
    positions = (0.25 + 0.5 * np.arange(3)) * (1 - 1e-10)
    scene = scene_at(
        disks_at(np.column_stack([positions, np.zeros(3)])), [([0, -1], [0, 1])], name="rest",
        contact={"stiffness_N_per_m": 1e6, "restitution": 0.1, "friction": 0.3},
        run={"duration_s": 0.05, "frames": 2, "rigid_step_s": 0.005},
        body_force=BodyForce(slope_deg=10.0, downhill=(-1.0, 0.0)),
    )  # fmt: skip
    found = simulate("rigid", scene)
    np.testing.assert_allclose(found["x"][-1], 0.25 + 0.5 * np.arange(3), rtol=0, atol=1e-9)


SLOPE = "slope_deg = 10.0"
NEEDED = "body_force: acceleration_m_per_s2, or slope_deg and downhill, are needed"


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("slope_deg = 91.0\ndownhill = [1.0, 0.0]", "body_force.slope_deg: "),
        (f"{SLOPE}\ndownhill = [1.0, 1.0]", "body_force: downhill must be a unit vector"),
        (SLOPE, NEEDED),
        (f"{SLOPE}\ndownhill = [1.0, 0.0]\nacceleration_m_per_s2 = [1.0, 0.0]", NEEDED),
    ],
)
def test_half_a_slope_is_refused_by_its_key(tmp_path, lines, message):
    scene = read_scene("terrace")
    path = scene.write(tmp_path)
    text = path.read_text(encoding="utf-8")
    old = text[text.index("slope_deg") : text.index("[contact]")]
    path.write_text(text.replace(old, f"{lines}\n\n"), encoding="utf-8")
    with pytest.raises(SceneError) as refused:
        read_scene(path)
    assert str(refused.value).startswith(f"{path}: {message}")
