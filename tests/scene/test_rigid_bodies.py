"""Scenes whose people are bodies of several disks: written, read, run by the rigid engine, refused."""

import csv

import numpy as np
import pytest

from analysis.dumps import open_bodies, snapshot_of
from analysis.engines.programs.rigid import main
from analysis.percussions.setting import Setting
from analysis.percussions.solve_dump import DumpToSolve, solve_dump
from analysis.scene.drive import Goal
from analysis.scene.scene import SceneError, read_scene
from analysis.scene.shipped_scenes import variant
from analysis.studies.exposure.sensors import Sensor
from nscd import Walls
from tests.crowds import disks_at


@pytest.fixture
def scene(tmp_path):
    """Two dumbbells that walk to a door, one with an inertia of its own."""
    positions = [[-3.0, 0.1], [-3.0, 0.5], [-2.2, 0.0], [-2.2, -0.4]]
    crowd = disks_at(positions, (1.0, 0.0), 0.2, 30.0, spin=[0.5, 0.5, -1, -1], ids=[1, 2, 5, 7])
    crowd = crowd.joined([4, 4, 9, 9], inertia=[3.0, 5.0])
    arch = read_scene("arch").with_run(duration_s=0.3, frames=3, rigid_step_s=0.01)
    found = arch.model_copy(update={"name": "two", "snapshot": crowd})
    found.write(tmp_path)
    return found


def test_a_scene_of_bodies_comes_back_as_it_was(scene, tmp_path):
    again = read_scene(tmp_path / "two.toml")
    assert again.digest() == scene.digest()
    one, other = scene.snapshot.bodies, again.snapshot.bodies
    for name in ("ids", "number", "inertia", "mass", "centre"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-12)
    assert again.digest() != read_scene("arch").digest()


def test_the_rigid_engine_turns_them_and_goes_on_to_the_same_digits(scene, tmp_path):
    out = tmp_path / "out"
    assert main([str(tmp_path / "two.toml"), "--out", str(out)]) == 0
    full = (out / "bodies.dump").read_bytes()
    trajectory = open_bodies(out / "bodies.dump", 0.01).trajectory
    end = snapshot_of(trajectory[len(trajectory) - 1])
    np.testing.assert_allclose(end.bodies.inertia, [3.0, 5.0])
    distance = end.position[1] - end.position[0]
    turned = [-0.4 * np.sin(0.15), 0.4 * np.cos(0.15)]
    np.testing.assert_allclose(distance, turned, atol=1e-9)
    (out / "bodies.dump").write_bytes(full[: len(full) * 3 // 4])
    assert main([str(tmp_path / "two.toml"), "--out", str(out)]) == 0
    assert (out / "bodies.dump").read_bytes() == full


def test_many_frames_at_once_are_solved_as_bodies(tmp_path):
    """A rod on two feet, which a ball loads on one side: the levers share its weight."""
    feet = [[0.0, 0.12], [0.2, 0.12], [0.4, 0.12], [0.2, 0.34]]
    radius, mass = [0.12, 0.1, 0.12, 0.12], [30.0, 30.0, 30.0, 60.0]
    rows = [
        f"{i + 1} {x} {y} {r} {m} 0 -1 0 {1 + (i == 3)} {1.0 + (i == 3)}"
        for i, ((x, y), r, m) in enumerate(zip(feet, radius, mass, strict=True))
    ]
    names = "id x y radius mass vx vy omegaz mol body_inertia"
    head = "ITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n4\nITEM: BOX BOUNDS ff ff ff\n"
    frame = head + "-9 9\n-9 9\n-9 9\nITEM: ATOMS " + names + "\n" + "\n".join(rows) + "\n"
    dump = tmp_path / "bodies.dump"
    dump.write_text("".join(frame.format(step) for step in range(4)), encoding="utf-8")
    setting = Setting(walls=Walls(start=[[-9, 0]], end=[[9, 0]]))
    todo = DumpToSolve(path=dump, setting=setting, time_step=1.0, indeterminacy="none")
    assert todo.in_batches
    solve_dump(todo, tmp_path / "contacts.csv")
    with open(tmp_path / "contacts.csv", encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert len(table) == 4 * 3  # none between disks of one body
    for row in table:
        if row["is_wall"] == "1":
            assert float(row["reaction_Ns"]) == pytest.approx(75.0)


def test_people_are_bodies_in_their_push_and_goals(scene):
    drive = scene.drive
    assert scene.mean_push == pytest.approx(drive.push(60.0))
    assert scene.push_range == pytest.approx((drive.push(60.0),) * 2)
    wanted = drive.desired_velocity(scene.snapshot.bodies.centre, np.array([1, 5]))
    assert (Setting.of(scene).left(scene.snapshot)[0] == wanted.repeat(2, axis=0)).all()
    goal = {"people": (1, 5), "outward": (1.0, 0.0)}
    ends = {"door_start_m": drive.door_start_m, "door_end_m": drive.door_end_m}
    goals = (Goal(**goal, **ends),)
    cut = scene.model_copy(update={"drive": drive.model_copy(update={"goals": goals})})
    with pytest.raises(SceneError, match=r"drive\.goals: number 1: .* some disks of body 9"):
        cut.check("two.toml")
    arms = scene.contact.model_copy(update={"arm_reach_m": 0.1, "arm_force_N": 100.0})
    with pytest.raises(SceneError, match=r"contact.arm_reach_m: only for people of one disk"):
        scene.model_copy(update={"contact": arms}).check("two.toml")
    vest = Sensor(name="vest", person=1, arc_deg=(0.0, 90.0), rate_Hz=10.0)
    with pytest.raises(ValueError, match="vests are for people of one disk"):
        vest.placed(scene)


def test_another_crowd_of_a_scene_has_the_same_bodies(scene):
    """All at other places, and each larger or smaller in all."""
    other = variant(scene, 1).snapshot
    for some in ([0, 1], [2, 3]):
        was, now = (
            one.position[some[1]] - one.position[some[0]] for one in (scene.snapshot, other)
        )
        size = other.radius[some[0]] / 0.2
        np.testing.assert_allclose(now, size * was, atol=1e-12)
        assert 0 < abs(size - 1) < 0.02
    far = np.hypot(*(other.position - scene.snapshot.position).T)
    assert (far > 1e-3).all()
    np.testing.assert_allclose(other.bodies.inertia, [3.0, 5.0], rtol=0.04)


BAD = {
    "goes with the section Molecules": ("two.toml", 'bodies = "two.bodies"\n', ""),
    "body 8: one line": ("two.bodies", "\n9 60.0", "\n8 60.0"),
    "line 2: 20 numbers": ("two.bodies", "4 60.0", "4 x"),
    "body 4: mass is nan where": ("two.bodies", "4 60.0", "4 nan"),
    "body 4: x is -2.9 where": ("two.bodies", "4 60.0 -3.0", "4 60.0 -2.9"),
    "Molecules: the ids differ": ("two.data", "\n5 9\n", "\n6 9\n"),
    "Molecules: 3 rows": ("two.data", "\n5 9\n", "\n"),
    "disks of body 9 turn differently": ("two.data", "\n2 4\n", "\n2 9\n"),
    "body 4: its disks do not hang together": ("two.data", " -3.0 0.5 0.0\n", " -3.0 1.5 0.0\n"),
}


@pytest.mark.parametrize("words", BAD)
def test_bad_files_of_bodies_are_refused_in_one_line(scene, tmp_path, words):
    name, old, new = BAD[words]
    text = (tmp_path / name).read_text(encoding="utf-8")
    assert old in text
    (tmp_path / name).write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(SceneError, match=words) as refused:
        read_scene(tmp_path / "two.toml")
    assert "\n" not in str(refused.value)
    assert name in str(refused.value)


def test_every_number_of_a_file_of_bodies_counts(scene, tmp_path):
    """Whatever else is in a cell is refused by the name of the file, or is no other crowd."""
    path, digest = tmp_path / "two.bodies", scene.digest()
    lines = path.read_text().splitlines()
    table = [line.split() for line in lines[1:]]
    used, sentences = [], []
    for row, column in np.ndindex(2, 20):
        for word in ("nan", "inf", "-1", "0", "1e308", "", "x", table[1 - row][column]):
            changed = [list(cells) for cells in table]
            changed[row][column] = word
            path.write_text("\n".join([lines[0], *map(" ".join, changed)]))
            try:
                assert read_scene(tmp_path / "two.toml").digest() == digest, (row, column, word)
                used.append(float(word) == float(table[row][column]))
            except SceneError as why:
                sentences.append(str(why))
    assert used
    assert all(used)
    assert [one for one in sentences if "two.bodies" not in one] == []
    for count in ("3", "", "two"):
        path.write_text("\n".join([count, *lines[1:]]))
        with pytest.raises(SceneError, match=r"two\.bodies, line 1: .* where 2 bodies follow"):
            read_scene(tmp_path / "two.toml")
