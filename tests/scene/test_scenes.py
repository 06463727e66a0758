"""Scenes: files, makers, and what is refused. Bodies of people, and pushes in newton: what a scene
file may say in place of radii and speeds."""

import bz2
import gzip
import importlib
import lzma

import numpy as np
import pytest

from analysis.scene.anthropometry import Varied, bodies_of, separated
from analysis.scene.drive import Goal
from analysis.scene.placement import check_room
from analysis.scene.real.import_crowd import import_crowd
from analysis.scene.real.trajectory import read_heads
from analysis.scene.scene import Scene, SceneError, read_scene, scene_names
from analysis.scene.shipped_scenes import MAKERS, OF_FIXED_SIZE, make
from analysis.support.files import shipped
from nscd import Snapshot, Walls, find_contacts
from tests.crowds import disks_at


@pytest.mark.parametrize("name", [*OF_FIXED_SIZE, *MAKERS])
def test_committed_files_are_what_the_maker_writes(name, tmp_path):
    make(name).write(tmp_path)
    for suffix in (".toml", ".data"):
        assert (tmp_path / f"{name}{suffix}").read_bytes() == (
            shipped("scenes") / f"{name}{suffix}"
        ).read_bytes()


@pytest.mark.parametrize("name", scene_names())
def test_reading_gives_back_what_was_written(name, tmp_path):
    scene = read_scene(name)
    again = read_scene(scene.write(tmp_path))
    assert again.digest() == scene.digest()
    assert again.notes == scene.notes
    np.testing.assert_array_equal(again.snapshot.mass, scene.snapshot.mass)


def test_any_number_and_seed(tmp_path):
    a, b, c = make("arch", 1500, 3), make("arch", 1500, 3), make("arch", 1500, 4)
    np.testing.assert_array_equal(a.snapshot.position, b.snapshot.position)
    assert len(a.snapshot) == 1500
    assert not np.array_equal(a.snapshot.position, c.snapshot.position)
    a.check("arch")


def test_drive_points_to_the_nearest_point_of_the_door():
    drive = read_scene("arch").drive
    position = np.array([[-1.0, 0.3], [-3.0, 4.5], [0.5, 0.2]])
    desired = drive.desired_velocity(position)
    np.testing.assert_allclose(desired, [[2, 0], [2 * 0.6, -2 * 0.8], [2, 0]], atol=1e-15)


# Each key with values that cannot be meant: test_bad_keys.py.
CHANGES = [
    ("stiffness_N_per_m = 1000000.0", "stiffness_kN_per_m = 1000.0", "unknown key"),
    ('law = "hooke"', 'law = "body"', "contact: stiffness_N_per_m: law = body has a stiffness of"),
    ('law = "hooke"', 'law = "hook"', "contact.law"),
    ("outward = [1.0, 0.0]", "outward = [1.0, 1.0]", "unit vector"),
    ('data = "arch.data"', 'data = "absent.data"', "absent.data: no such file"),
    ('data = "arch.data"', 'data = "/etc/passwd"', "disks.data"),
    ("[drive]", "[drive", "line"),
]


@pytest.mark.parametrize(("old", "new", "message"), CHANGES, ids=[change[1] for change in CHANGES])
def test_bad_scene_file(tmp_path, old, new, message):
    path = make("arch").write(tmp_path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(SceneError, match=message):
        read_scene(path)


def _with_data(tmp_path, change):
    path = make("arch").write(tmp_path)
    data = tmp_path / "arch.data"
    data.write_text(change(data.read_text()))
    return path


def test_bad_initial_states(tmp_path):
    with pytest.raises(SceneError, match=r"arch\.data: truncated"):
        read_scene(_with_data(tmp_path, lambda text: "\n".join(text.splitlines()[:200])))
    lines = make("arch").write(tmp_path) and (tmp_path / "arch.data").read_text().splitlines()
    at = lines.index("Atoms # sphere") + 2
    first = lines[at].split()

    def replaced(column, value):
        words = list(first)
        words[column] = value
        return lambda _: "\n".join([*lines[:at], " ".join(words), *lines[at + 1 :]]) + "\n"

    for column, value, message in [
        (2, "0.0", r"radius: 0 in row 0"),
        (4, "nan", r"line 12: Atoms: nan: a finite number is needed"),
        (4, "5.0", r"disk 1 at \(5, .*outside the walls"),
        (2, "1.5", r"disk \d+ and .* overlap by"),
        (3, "word", r"line 12: Atoms: 'word' is not a number"),
    ]:
        with pytest.raises(SceneError, match=message):
            read_scene(_with_data(tmp_path, replaced(column, value)))


def square(x, y, side):
    """Four walls."""
    corners = np.array([[x, y], [x + side, y], [x + side, y + side], [x, y + side]], dtype=float)
    return [*zip(corners, np.roll(corners, -1, axis=0), strict=True)]


@pytest.mark.parametrize(
    ("squares", "door", "position", "is_refused"),
    [
        ([(0, 0, 1)], None, (3, 0), False),  # a pillar on an open floor
        ([(0, 0, 1), (4, 0, 1)], None, (2.5, 0.5), False),  # two
        ([(0, 0, 9)], None, (5, 5), False),  # a room without a door
        ([(0, 0, 9)], ((3, 0), (4, 0)), (-5, 5), True),  # outside of a room with a door
        ([(0, 0, 9), (4, 4, 1)], None, (2, 2), False),  # beside a pillar in a room
        ([(0, 0, 9), (4, 4, 1)], None, (4.5, 4.5), True),  # in it
        ([(0, 0, 9), (4, 4, 1)], ((3, 0), (4, 0)), (-2, 2), True),  # outside of all
    ],
)
def test_a_pillar_is_no_room(squares, door, position, is_refused):
    walls = [wall for corner in squares for wall in square(*corner)]
    if door:  # the wall below it in two
        (_, _, side), walls = squares[0], walls[1:]
        walls += [((0, 0), door[0]), (door[1], (side, 0))]
    start, end = np.array([wall for wall in walls], dtype=float).transpose(1, 0, 2)
    one = Snapshot(position=[position], velocity=[[0, 0]], radius=[0.2], mass=[75])
    room = Walls(start=start, end=end)
    doors = Walls(start=[door[0]], end=[door[1]]) if door else None
    if is_refused:
        with pytest.raises(ValueError, match=r"disk 1 at .* is outside the walls"):
            check_room(one, room, doors)
    else:
        assert check_room(one, room, doors) == []


def test_data_that_is_not_whole(tmp_path):
    make("pair").write(tmp_path)
    text = (tmp_path / "pair.data").read_text()
    before = text.split("Velocities")[0]

    def read(changed):
        (tmp_path / "pair.data").write_bytes(
            changed if isinstance(changed, bytes) else changed.encode()
        )
        return read_scene(tmp_path / "pair.toml")

    assert read(text).snapshot.velocity[0, 0] == 2
    for changed, message in [
        (before, r"pair.data: truncated: Velocities: 0 rows for 2 atoms"),
        (before + "Velocities\n", r"truncated: Velocities: 0 rows"),
        (text.replace("2 atoms", "2.5 atoms"), r"line 3: atoms: '2.5' where a whole number"),
        (text.replace("2 atoms", "1 atoms"), r"line \d+: Atoms: more rows than the 1 atoms"),
        (text.replace("2 atoms", "9999999999 atoms"), r"line 3: atoms: '9999999999' where"),
        (text.replace("2 atoms", "2000000000 atoms"), r"Atoms: 2 rows for 2000000000 atoms"),
        (text.replace("\n2 1 0.5", "\n2.7 1 0.5"), r"line 13: id: '2.7' where a whole number"),
        (text.replace("0.5 0.0 0.0\n", "0.5 0.0 0.5\n"), r"z differs between disks"),
        (text.replace("0.5 0.0 0.0\n", "0.5 0.0 nan\n"), r"line 13: Atoms: nan: a finite number"),
        (text.replace("2.0 0.0 0.0", "2.0 0.0 0.1"), r"v_z, ω_x or ω_y is not 0"),
        (text.replace("0.5 0.0 0.0\n", "0.5 0.0\n"), r"line 13: Atoms: 6 columns where 7 or 10"),
        (text.replace("Velocities", "Speeds"), r"line \d+: 'Speeds' where Atoms or Velocities"),
        (text.replace("0.5 0.0 0.0\n", "0_5 0.0 0.0\n"), r"'0_5' is not a number"),
        (text.encode() + b"\0" * 9, r"pair.data, line \d+: binary"),
        (text + "x" * 99999, r"pair.data, line \d+: longer than 65536 characters"),
    ]:
        with pytest.raises(SceneError, match=message) as error:
            read(changed)
        assert "\n" not in str(error.value)


def test_a_mark_of_windows_editors_is_no_text(tmp_path):
    path = make("pair").write(tmp_path)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))
    assert read_scene(path).title == make("pair").title


def test_compressed_data_is_read_and_endless_is_not(tmp_path):
    path = make("pair").write(tmp_path)
    plain = (tmp_path / "pair.data").read_bytes()
    for pack in (gzip.compress, bz2.compress, lzma.compress):
        (tmp_path / "pair.data").write_bytes(pack(plain))
        assert len(read_scene(path).snapshot) == 2
    (tmp_path / "pair.data").write_bytes(gzip.compress(plain)[:-30])
    with pytest.raises(SceneError, match=r"pair.data, line \d+: damaged"):
        read_scene(path)
    (tmp_path / "pair.data").unlink()
    (tmp_path / "pair.data").symlink_to("/dev/zero")
    with pytest.raises(SceneError, match=r"pair.data: not a regular file"):
        read_scene(path)
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(SceneError, match=r"folder.toml: not a regular file"):
        read_scene(tmp_path / "folder.toml")


@pytest.mark.parametrize("name", ["..", "../up", ".hidden", "a/b", ""])
def test_names_stay_in_their_folder(name):
    with pytest.raises(SceneError, match=r"name: "):
        Scene.of(make("pair"), name=name, snapshot=make("pair").snapshot)


def test_a_title_of_two_lines_is_one_line_of_the_data_file(tmp_path):
    scene = read_scene("pair").model_copy(update={"title": "a pair\n3 atoms\n"})
    again = read_scene(scene.write(tmp_path))
    assert again.title == scene.title
    assert len(again.snapshot) == 2
    assert (tmp_path / "pair.data").read_text().startswith("a pair 3 atoms (SI units")


def test_a_goal_of_some_people_there_and_back(tmp_path):
    crowd = make("arch", 30)
    door = {"door_start_m": (0.0, 6.0), "door_end_m": (-1.0, 7.0), "outward": (0.0, 1.0)}
    goals = (Goal(people=(11, 20), **door),)
    aimed = crowd.model_copy(
        update={"drive": crowd.drive.model_copy(update={"goals": goals}), "name": "two"}
    )
    path = aimed.write(tmp_path)
    again = read_scene(path)
    assert again.drive == aimed.drive
    assert again.digest() == aimed.digest() != crowd.digest()
    text = path.read_text()
    assert "[11, 20]" in text
    path.write_text(text.replace("[11, 20]", "[41, 50]"))
    with pytest.raises(SceneError, match=r"drive\.goals: number 1: nobody has an id from 41 to"):
        read_scene(path)


def written(tmp_path, old="", new="", name="arch", disks=30):
    """The path of a scene file with one part of its text replaced."""
    path = make(name, disks=disks).write(tmp_path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    return path


@pytest.mark.parametrize(
    ("people", "radius", "mass"), [("ANSUR II men", 0.180, 85.5), ("ANSUR II women", 0.167, 67.8)]
)
def test_bodies_have_the_means_of_the_survey(people, radius, mass):
    radii, masses = bodies_of(people, 4000, seed=1)
    assert radii.mean() == pytest.approx(radius, abs=5e-4)
    assert masses.mean() == pytest.approx(mass, rel=0.01)
    # ½ √(b d): half the sum of the relative spreads, cut at two standard deviations (0.88 of it)
    assert 0.07 < radii.std() / radii.mean() / 0.88 < 0.10
    assert np.corrcoef(radii, masses)[0, 1] > 0.99
    assert (bodies_of(people, 4000, seed=1)[0] == radii).all()
    assert (bodies_of(people, 4000, seed=2)[0] != radii).any()


def test_a_scene_of_people_is_the_same_when_written_and_read_again(tmp_path):
    data = 'data = "arch.data"'
    path = written(tmp_path, data, f'{data}\npeople = "ANSUR II"\npeople_seed = 5')
    scene = read_scene(path)
    radii, masses = bodies_of("ANSUR II", 30, seed=5)
    assert (scene.snapshot.radius == radii).all()
    assert (scene.snapshot.mass == masses).all()
    in_contact = find_contacts(scene.snapshot, scene.wall_segments(), tolerance=0.0)
    assert in_contact.gap.min(initial=0.0) > -1e-9
    again = read_scene(scene.write(tmp_path / "again"))
    assert again.digest() == scene.digest()


@pytest.mark.parametrize(
    ("lines", "speed", "time"),
    [
        ("push_N = 216.0", 1.44, 0.5),
        ("push_N = 216.0\nspeed_m_per_s = 1.2", 1.2, 1.2 * 75 / 216),
        ("push_N = 150.0\nrelaxation_time_s = 1.0", 2.0, 1.0),
    ],
)
def test_a_push_gives_speed_and_relaxation_time_to_yade_s_script_too(
    tmp_path, monkeypatch, lines, speed, time
):
    old = "speed_m_per_s = 2.0\nrelaxation_time_s = 0.5"
    scene = read_scene(path := written(tmp_path, old, lines))
    assert scene.drive.speed_m_per_s == pytest.approx(speed)
    assert scene.drive.relaxation_time_s == pytest.approx(time)
    monkeypatch.syspath_prepend(str(shipped("yade_scripts")))
    scripts = importlib.import_module("scene_file")
    plain = scripts.read_scene(path, {})["drive"]
    scripts.complete_drive(plain, scene.snapshot.mass)
    assert plain["speed_m_per_s"] == scene.drive.speed_m_per_s
    assert plain["relaxation_time_s"] == scene.drive.relaxation_time_s


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("speed_m_per_s = 2.0", "speed_m_per_s = 2.0\npush_N = 100.0", "push_N: instead of"),
        ("speed_m_per_s = 2.0", "push_N = -1.0", "push_N"),
        ("speed_m_per_s = 2.0", "push_N = nan", "push_N"),
        ("speed_m_per_s = 2.0", 'push_N = "100"', "push_N"),
        ('data = "arch.data"', 'data = "arch.data"\npeople = "giants"', r"disks.people"),
        ('data = "arch.data"', 'data = "arch.data"\npeople_seed = -1', r"disks.people_seed"),
    ],
)
def test_what_makes_no_sense_is_refused_by_its_key(tmp_path, old, new, message):
    path = written(tmp_path, old, new)
    with pytest.raises(SceneError, match=message) as found:
        read_scene(path)
    assert str(path) in str(found.value)


def test_radii_within_a_share():
    radii, masses = Varied(radius_share=0.1, seed=2).bodies(0.18, 75.0, 2000)
    assert 0.162 <= radii.min() < 0.165
    assert 0.195 < radii.max() <= 0.198
    assert set(masses) == {75.0}
    with pytest.raises(ValueError, match="From 0 to below 1"):
        Varied(radius_share=1.0).bodies(0.18, 75.0, 5)


def test_a_real_crowd_of_people(tmp_path):
    """The imported frame says how radii are spread, and nobody overlaps."""
    tracked = read_heads(shipped("scenes") / "gate_excerpt.txt", 405)
    room = shipped("scenes") / "rooms" / "gate.toml"
    found = import_crowd(tracked, radius=0.18, room=room, varied=Varied(people="ANSUR II women"))
    scene = read_scene(found.write(tmp_path))
    radii = scene.snapshot.radius
    assert 0.13 < radii.min() < radii.max() < 0.20
    assert scene.reconciliation.radius_m == pytest.approx(radii.mean(), abs=2e-6)
    assert scene.reconciliation.radius_sd_m == pytest.approx(radii.std(), abs=2e-6)
    assert "(standard deviation 0.01" in found.statement
    assert scene.snapshot.mass.std() > 5


def test_half_are_men():
    mixed, _ = bodies_of("ANSUR II", 4000, seed=1)
    assert mixed.mean() == pytest.approx(0.5 * (0.180 + 0.167), abs=1e-3)
    with pytest.raises(ValueError, match=r"'NHANES'\. There are: ANSUR II"):
        bodies_of("NHANES", 10, seed=1)


@pytest.mark.parametrize("seed", [4, 8, 14])
def test_nobody_is_pushed_apart_through_a_wall(seed):
    """30 people of whom many overlap by half: at once, one would leave the room."""
    position = np.random.default_rng(seed).uniform([-2.9, -0.9], [2.9, 0.9], (30, 2))
    corners = np.array([[-3.0, -1.0], [3.0, -1.0], [3.0, 1.0], [-3.0, 1.0]])
    walls = Walls(start=corners, end=np.roll(corners, -1, axis=0))
    moved = separated(disks_at(position), walls)
    assert (np.abs(moved.position) < [3.0, 1.0]).all()
    assert find_contacts(moved, walls, tolerance=0.0).gap.min(initial=0.0) > -1e-9
