"""Arms, the soft layer around people: the programs agree, and what follows by hand."""

import numpy as np
import pytest

from analysis.engines import LAMMPS, EngineError
from analysis.engines.programs.rigid import motion_of
from analysis.engines.run import simulate as simulate_into
from analysis.percussions.snapshot import percussions_of
from analysis.scene.scene import SceneError
from analysis.scene.shipped_scenes import make
from analysis.studies.work_precision.soft import leapfrog, soft_reference
from nscd.contacts import sum_at_disks
from tests.crowds import disks_at, drive_to, scene_at
from tests.engines.laws.test_law import FALL, few

REACH, FORCE = 0.15, 600.0
ARMS = {"arm_reach_m": REACH, "arm_force_N": FORCE}


@pytest.mark.parametrize("name", ["lammps", "yade"])
@pytest.mark.parametrize("law", ["hooke", "hertz", "body"])
def test_the_programs_give_the_same_motion_and_the_dump_the_whole_force(simulate, name, law):
    stiffness = {"stiffness_N_per_m": None} if law == "body" else {}
    scene = few(law, FALL, **stiffness, **ARMS).with_run(time_step_s=2e-4)
    motion, simulation = leapfrog(scene), simulate(name, scene)
    moved = np.column_stack([simulation["x"][-1], simulation["y"][-1]]) - scene.snapshot.position
    np.testing.assert_allclose(moved, motion.displacement[1], rtol=0, atol=1e-11)
    through = set()
    for frame, contacts in enumerate(simulation.contacts):
        first, wall = contacts.first - 1, contacts.is_wall
        second = np.where(wall, -1, contacts.second - 1)
        inputs = sum_at_disks(first, second, -contacts.force, contacts.force, 3)
        full = np.column_stack([simulation[f][frame] for f in ("fx", "fy")])
        full -= scene.snapshot.mass[:, None] * np.array(FALL.acceleration_m_per_s2)
        np.testing.assert_allclose(inputs, full, rtol=0, atol=1e-7 * np.abs(full).max())
        through |= set(zip(wall.tolist(), (contacts.overlap > 0).tolist(), strict=True))
    assert through == {(True, True), (True, False), (False, True), (False, False)}


def meeting(speed, difference=0.8, **contact):
    """Two people of 80 and 40 kg, at a distance (m), who come together at a speed (m/s)."""
    velocity = [[0.5 * speed, 0.0], [-0.5 * speed, 0.0]]
    snapshot = disks_at([[0.0, 0.0], [difference, 0.0]], velocity, mass=[80.0, 40.0])
    return scene_at(
        snapshot, contact={"stiffness_N_per_m": 1e6, "restitution": 0.1} | ARMS | contact,
        run={"duration_s": 0.7, "frames": 140, "time_step_s": 1e-3}, name="meeting",
    )  # fmt: skip


@pytest.mark.parametrize("name", ["lammps", "yade", "rigid"])
def test_who_comes_with_less_than_the_work_of_arms_stops_at_a_distance(simulate, name):
    """½ m v² = ½ F_a (a − g)²/a, with the reduced mass m; nothing is lost."""
    speed = 1.2
    reduced = 80.0 * 40.0 / 120.0
    gap = REACH - speed * np.sqrt(reduced * REACH / FORCE)
    assert 0.02 < gap < 0.1
    simulation = simulate(name, meeting(speed).with_run(rigid_step_s=0.0005))
    difference = simulation["x"][:, 1] - simulation["x"][:, 0] - 0.5
    assert difference.min() == pytest.approx(gap, abs=2e-4)
    back = simulation["vx"][-1, 1] - simulation["vx"][-1, 0]
    assert back == pytest.approx(speed, rel=2e-3)


@pytest.mark.parametrize("name", ["lammps", "yade", "rigid"])
@pytest.mark.parametrize("push", [0.4, 1.5])
def test_a_row_pressed_at_a_wall_stands_at_the_gaps_of_the_law(simulate, name, push):
    """Each of three pushes with P: the m-th gap is a (1 − mP/F_a), or bodies press with mP − F_a."""
    fraction, stiffness = push * FORCE / 3, 2e4
    row = disks_at([[-0.3, 0.0], [-0.9, 0.0], [-1.5, 0.0]])
    scene = scene_at(
        row, [((0.0, -1.0), (0.0, 1.0))],
        drive=drive_to((9.0, 0.0), (9.0, 0.1), speed=0.5 * fraction / 75.0),
        contact={"stiffness_N_per_m": stiffness, "restitution": 0.5} | ARMS,
        run={"duration_s": 7.0, "frames": 7},
    )  # fmt: skip
    simulation = simulate(name, scene)
    behind = fraction * np.array([3, 2, 1])
    overlap = np.maximum(0.0, behind - FORCE) / stiffness * (name != "rigid")
    gap = np.maximum(0.0, REACH * (1 - behind / FORCE)) - overlap
    index = -(np.cumsum(gap) + 0.25 + 0.5 * np.arange(3))
    np.testing.assert_allclose(simulation["x"][-1], index, rtol=0, atol=1e-3)
    contacts = simulation.contacts[-1]
    order = np.argsort(np.where(contacts.is_wall, 0, contacts.first))
    np.testing.assert_allclose(contacts.force[order, 0] * [1, -1, -1], behind, rtol=5e-3)


def test_percussions_of_a_pressed_row_are_those_of_bodies_beside_their_arms():
    """Each of three pushes with 1.5 F_a/3 and stands as the law says: a wall bears 1.5 F_a, bodies
    give half of F_a of it, and nobody else touches."""
    fraction = 0.5 * FORCE
    anchor = -np.cumsum([0.25, 0.5, 0.5 + REACH / 2])
    scene = scene_at(
        disks_at(np.column_stack([anchor, 0 * anchor])), [((0.0, -1.0), (0.0, 1.0))],
        drive=drive_to((9.0, 0.0), (9.0, 0.1), speed=0.5 * fraction / 75.0),
        contact={"stiffness_N_per_m": 1e6, "restitution": 0.1} | ARMS,
        run={"duration_s": 1.0, "frames": 1},
    )  # fmt: skip
    found = percussions_of(scene, scene.snapshot)
    assert found.contacts.is_wall.tolist() == [False, True]
    np.testing.assert_allclose(found.force[:, 0], [0.0, 0.5 * FORCE], atol=1e-6 * FORCE)


def test_rigid_steps_through_arms_tend_to_the_soft_model_with_order_one():
    scene = meeting(1.2, difference=0.55).with_run(duration_s=0.24, frames=1)
    exact = soft_reference(scene).motion.displacement[1]
    errors = []
    for steps in (60, 120, 240):
        motion = motion_of(scene.with_run(rigid_step_s=0.24 / steps), scene.snapshot)
        for _ in range(steps):
            motion.advance()
        errors.append(np.abs(motion.position - scene.snapshot.position - exact).max())
    assert errors[-1] < 1e-3
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 1.0, atol=0.1)


@pytest.mark.parametrize(
    ("contact", "message"),
    [
        ({"arm_reach_m": 0.1}, "arm_force_N: arms need both"),
        ({"arm_force_N": 100.0}, "arm_reach_m: arms need both"),
        ({"arm_reach_m": -0.1, "arm_force_N": 100.0}, "arm_reach_m"),
        ({"arm_reach_m": 0.1, "arm_force_N": 0.0}, "arm_force_N"),
    ],
)
def test_half_an_arm_is_refused(contact, message):
    with pytest.raises(SceneError, match=rf"contact\.{message}|contact\.: {message}"):
        make("pair").with_contact(**contact)


def test_what_cannot_run_arms_is_refused_before_anything_runs(tmp_path, monkeypatch):
    scene = meeting(1.0)
    long = scene.with_run(rigid_step_s=0.1, duration_s=1.0, frames=1)
    with pytest.raises(EngineError, match=r"rigid_step_s: arms are not stable in steps of 0.1 s"):
        simulate_into(long, "rigid", tmp_path / "run")
    with pytest.raises(EngineError, match=r"arm_reach_m: LAMMPS cannot write friction beside arms"):
        simulate_into(scene.with_contact(friction=0.3), "lammps", tmp_path / "run")
    monkeypatch.setattr(LAMMPS, "has", lambda _: False)
    with pytest.raises(EngineError, match=r"contact\.arm_reach_m: this LAMMPS has no pair_style"):
        simulate_into(scene, "lammps", tmp_path / "run")
    for what in ("charts are", "advice is"):
        with pytest.raises(ValueError, match=rf"meeting: contact\.arm_reach_m: {what} for scenes"):
            scene.check_plain(what)
    assert not list(tmp_path.iterdir())
