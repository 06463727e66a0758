"""The soft-contact law in three programs, LAMMPS, YADE and Python, which agree to rounding; and
what follows from it by hand."""

import numpy as np
import pytest

from analysis.engines import LAMMPS, EngineError
from analysis.engines.run import simulate as simulate_into
from analysis.scene.law import AS_HERTZ, BODY, hertz_stiffness
from analysis.scene.scene import Wall, read_scene
from analysis.scene.schema import BodyForce
from analysis.scene.shipped_scenes import make
from analysis.studies.work_precision.soft import leapfrog, soft_reference
from tests.crowds import disks_at, scene_at
from tests.engines.at_hand import require

ENGINES = ["lammps", "yade"]
FALL = BodyForce(acceleration_m_per_s2=(1.5, -9.81))


def few(law, body_force, **contact):
    """Three unequal disks that meet each other, a level wall and a slanted one."""
    anchor, velocity = [[0, 0], [0.55, 0.05], [0.3, 0.5]], [[1.0, -0.5], [-1.0, 0.2], [0.1, -1.5]]
    snapshot = disks_at(anchor, velocity, [0.25, 0.3, 0.2], [60.0, 90.0, 45.0])
    return scene_at(
        snapshot, [((-3.0, -0.3), (3.0, -0.3)), ((0.75, -0.3), (1.35, 1.0))], name="few",
        contact={"law": law, "stiffness_N_per_m": 2e5, "restitution": 0.4} | contact,
        run={"duration_s": 0.2, "frames": 20, "time_step_s": 1e-4}, body_force=body_force,
    )  # fmt: skip


def on_a_floor(scene, disks):
    """The scene with other disks, and a floor alone."""
    floor = Wall(name="floor", start_m=(-1.0, 0.0), end_m=(1.0, 0.0))
    return scene.model_copy(update={"snapshot": disks, "walls": (floor,)})


STEEL = {"wall_stiffness_N_per_m": 1e6}
CLOTH = {"wall_stiffness_N_per_m": 1e5, "restitution": 1.0}


@pytest.mark.parametrize(
    ("body_force", "contact"),
    [(FALL, {"restitution": 1.0}), (FALL, STEEL), (None, CLOTH)],
    ids=["falling", "steel", "cloth"],
)
@pytest.mark.parametrize("law", ["hooke", "hertz"])
def test_three_programs_give_the_same_motion(simulate, law, body_force, contact):
    _same_motion(simulate, few(law, body_force, **contact), ENGINES)


@pytest.mark.parametrize("law", [BODY, AS_HERTZ])
def test_the_laws_of_a_body_are_the_same_motion(simulate, law):
    _same_motion(simulate, few(law, FALL, stiffness_N_per_m=None), ENGINES)


def _same_motion(simulate, scene, engines):
    motion = leapfrog(scene)
    assert np.abs(motion.displacement[1]).max() > 0.1
    for name in engines:
        simulation = simulate(name, scene)
        moved = np.column_stack([simulation["x"][-1], simulation["y"][-1]])
        moved -= scene.snapshot.position
        np.testing.assert_allclose(moved, motion.displacement[1], rtol=0, atol=1e-11)
        velocity = np.column_stack([simulation["vx"][-1], simulation["vy"][-1]])
        np.testing.assert_allclose(velocity, motion.velocity[1], rtol=0, atol=1e-9)
        walls = {n for contacts in simulation.contacts for n in contacts.second[contacts.is_wall]}
        assert walls == {1, 2}
        assert any((~contacts.is_wall).any() for contacts in simulation.contacts)


def test_a_crowd_pressed_by_drive_and_body_force(simulate):
    """The desired velocity is then u_d + τ g."""
    scene = make("arch", 60).model_copy(update={"body_force": FALL, "name": "pressed"})
    scene = scene.with_contact(law="hertz", stiffness_N_per_m=3e5)
    scene = scene.with_run(duration_s=0.4, frames=4, time_step_s=2e-4)
    lammps, yade = (simulate(name, scene) for name in ENGINES)
    for column in ("x", "y"):
        np.testing.assert_allclose(lammps[column], yade[column], rtol=0, atol=1e-10)
    for column in ("vx", "vy", "fx", "fy", "drive_x", "drive_y"):
        size = np.abs(lammps[column]).max()
        np.testing.assert_allclose(lammps[column], yade[column], rtol=0, atol=1e-8 * size)
    assert len(lammps.contacts[-1]) > 10


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("law", ["hooke", "hertz"])
def test_at_rest_the_floor_carries_the_weight(simulate, name, law):
    """By hand: a column of three presses with m g, 2 m g and 3 m g; a Hertz contact is then deep by
    (F / (K √R))^(2/3)."""
    snapshot = disks_at([[0.0, 0.25], [0.0, 0.75], [0.0, 1.25]])
    scene = few(law, BodyForce(acceleration_m_per_s2=(0.0, -2.0)), restitution=0.01)
    scene = on_a_floor(scene, snapshot)
    simulation = simulate(name, scene.with_run(duration_s=2.0, frames=4, time_step_s=None))
    contacts = simulation.contacts[-1]
    weight = 75.0 * 2.0 * np.array([2, 1, 3])
    np.testing.assert_allclose(np.abs(contacts.force[:, 1]), weight, rtol=1e-3)
    if law == "hertz":
        stiffness = 2e5 / (1.5 * np.sqrt(0.5 * 0.01) * 0.25)
        radius = np.array([0.125, 0.125, 0.25])
        deep = (weight / (stiffness * np.sqrt(radius))) ** (2 / 3)
    else:
        deep = weight / 2e5
    np.testing.assert_allclose(contacts.overlap, deep, rtol=1e-3)


@pytest.mark.parametrize("name", [*ENGINES, "reference"])
@pytest.mark.parametrize("law", ["hooke", "hertz"])
def test_a_disk_is_as_deep_in_a_wall_as_its_energy(simulate, name, law):
    """By hand, without a dashpot: v √(m/k) after a quarter of the period (Hertz: (5 m v²/(4 K
    √R))^(2/5) after 1.4716 δ/v), and as fast as it came after twice that."""
    stiffness, v, m, r = 5e5, 1.5, 75.0, 0.25
    if law == "hooke":
        deep = v * np.sqrt(m / stiffness)
        quarter = 0.5 * np.pi * deep / v
    else:
        constant = stiffness / (1.5 * np.sqrt(0.5 * 0.01) * r)
        deep = (1.25 * m * v**2 / (constant * np.sqrt(r))) ** 0.4
        quarter = 1.47160 * deep / v
    one = disks_at([[0.0, r]], [0.0, -v])
    scene = on_a_floor(few(law, None, wall_stiffness_N_per_m=stiffness, restitution=1.0), one)
    scene = scene.with_run(duration_s=2 * quarter, frames=2, time_step_s=quarter / 1000)
    if name == "reference":
        motion = soft_reference(scene).motion
        heights, velocity = r + motion.displacement[:, 0, 1], motion.velocity[-1, 0, 1]
    else:
        simulation = simulate(name, scene)
        heights, velocity = simulation["y"][1:, 0], simulation["vy"][-1, 0]
        # held with the stiffness of the wall, not of the disks
        assert simulation.record.wall_stiffness_N_per_m == stiffness
    assert r - heights[0] == pytest.approx(deep, rel=1e-5)
    assert velocity == pytest.approx(v, rel=1e-5)
    assert heights[1] == pytest.approx(r, abs=1e-5)


@pytest.mark.parametrize("name", ENGINES)
def test_a_chest_is_as_deep_in_a_wall_as_its_energy(simulate, name):
    """½ m v² = ½ A D² + ⅓ B D³, and the contact forces are A D + B D²."""
    v, m, r = 0.8, 75.0, 0.25
    one = disks_at([[0.0, r]], [0.0, -v])
    scene = on_a_floor(few(BODY, None, stiffness_N_per_m=None, restitution=1.0), one)
    simulation = simulate(name, scene.with_run(duration_s=0.4, frames=100, time_step_s=1e-4))
    deep = max(np.roots([108000 / 3, 5490 / 2, 0.0, -0.5 * m * v**2]).real)
    assert r - simulation["y"].min() == pytest.approx(deep, rel=1e-3)
    assert simulation["vy"][-1, 0] == pytest.approx(v, rel=1e-5)
    for contacts in simulation.contacts:
        force = 5490 * contacts.overlap + 108000 * contacts.overlap**2
        np.testing.assert_allclose(-contacts.force[:, 1], force, rtol=1e-9)


def test_a_body_as_hertz_is_within_8_percent():
    """From 0.05 to 0.3 m between two people, and from half of that at a wall, which meets one."""
    overlap, pair, radius = np.linspace(0.05, 0.3, 100), np.zeros(100, bool), 0.17
    both = (few(law, None, stiffness_N_per_m=None) for law in (BODY, AS_HERTZ))
    body, hertz = (scene.contact.elastic(radius) for scene in both)
    for depth, wall in ((overlap, pair), (0.5 * overlap, ~pair)):
        at = depth, np.where(wall, radius, 0.5 * radius), wall
        ratio = hertz.force(*at) / body.force(*at)
        assert 0.07 < np.abs(ratio - 1).max() < 0.085
        for law in (body, hertz):
            slope = np.gradient(law.energy(*at), depth)[1:-1]
            np.testing.assert_allclose(slope, law.force(*at)[1:-1], rtol=1e-3)


def test_a_body_is_refused_where_it_cannot_be(tmp_path, monkeypatch):
    scene = few(BODY, None, stiffness_N_per_m=None)
    with pytest.raises(EngineError, match=r"few: run\.impulses: LAMMPS sums none with contact"):
        simulate_into(scene.with_run(impulses=True), "lammps", tmp_path / "run")
    monkeypatch.setattr(LAMMPS, "has", lambda _: False)
    says = r"this LAMMPS has no pair_style lepton/sphere .* law = bo"
    with pytest.raises(EngineError, match=says):
        simulate_into(scene, "lammps", tmp_path / "run")
    with pytest.raises(ValueError, match="friction: law = body has none"):
        few(BODY, None, stiffness_N_per_m=None, friction=0.2)
    with pytest.raises(ValueError, match="stiffness_N_per_m: law = body_hertz has a stiffness of"):
        few(AS_HERTZ, None, stiffness_N_per_m=1e5)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ENGINES)
def test_a_fall_without_contacts_is_the_parabola(simulate, name):
    scene = few("hooke", FALL).model_copy(update={"walls": ()})
    one = disks_at([[0.0, 0.0]], [1.0, 2.0])
    simulation = simulate(name, scene.model_copy(update={"snapshot": one}))
    t = 0.2
    position = np.array([t * 1.0 + 0.5 * 1.5 * t**2, t * 2.0 - 0.5 * 9.81 * t**2])
    found = [simulation["x"][-1, 0], simulation["y"][-1, 0]]
    np.testing.assert_allclose(found, position, rtol=0, atol=1e-12)
    assert simulation["fy"][-1, 0] == pytest.approx(-9.81 * 75.0, rel=1e-12)


def test_the_python_model_is_what_small_steps_tend_to():
    scene = few("hertz", FALL)
    exact = soft_reference(scene).motion.displacement[1]
    errors = []
    for step in (1e-4, 5e-5):
        moved = leapfrog(scene.with_run(time_step_s=step)).displacement[1]
        errors.append(np.abs(moved - exact).max())
    assert errors[1] < 0.6 * errors[0] < 1e-3


def test_young_s_modulus_gives_the_stiffness(tmp_path):
    """K = ⁴⁄₃ E*, E* = E/(2 (1 − ν²)); the file and the scene that it makes are the same run."""
    path = make("pair").with_contact(law="hertz").write(tmp_path)
    text = path.read_text()
    assert "stiffness_N_per_m = 1000000.0" in text
    material = "young_modulus_Pa = 1.5e7\npoisson_ratio = 0.3"
    path.write_text(text.replace("stiffness_N_per_m = 1000000.0", material))
    scene = read_scene(path)
    effective = 1.5e7 / (2 * (1 - 0.3**2))
    # the tangent of 4/3 E* √R δ^1.5 at δ = 1 % of 0.25 m, R = 0.125 m
    tangent = 2.0 * effective * np.sqrt(0.125 * 0.0025)
    assert scene.contact.stiffness_N_per_m == pytest.approx(tangent, rel=1e-12)
    assert hertz_stiffness(1.5e7, 0.3, 0.25) == pytest.approx(tangent, rel=1e-12)
    again = read_scene(scene.write(tmp_path / "again"))
    assert again.digest() == scene.digest()


def test_yade_refuses_hertz_with_friction(tmp_path):
    require("yade")
    scene = few("hertz", None, friction=0.3)
    with pytest.raises(EngineError, match=r"few: contact\.friction: 0\.3. YADE runs hertz without"):
        simulate_into(scene, "yade", tmp_path / "run")
    assert not list(tmp_path.iterdir())
