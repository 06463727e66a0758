"""A corridor that begins again where it ends, in nscd and two engines, by hand."""

import numpy as np
import pytest

from analysis.dumps import DumpError, index_dump
from analysis.engines import engine
from analysis.engines.record import EngineError
from analysis.percussions.setting import setting_beside
from analysis.scene.scene import SceneError, read_scene
from analysis.scene.shipped_scenes import make
from nscd import Walls, find_contacts
from tests.crowds import disks_at, drive_to, scene_at, solved, spaced

ENGINES = ["lammps", "rigid"]
LONG = 3.0
CONTACT = {"stiffness_N_per_m": 1e5, "restitution": 0.1}


def test_contacts_are_those_of_all_images():
    rng = np.random.default_rng(1)
    position, radius = rng.uniform([-2, 0], [8, 10], (120, 2)), rng.uniform(0.1, 0.4, 120)
    walls = Walls(start=[[-2, 0], [8, 10]], end=[[8, 0], [-2, 10]], period_x=(-2.0, 8.0))
    found = find_contacts(disks_at(position, radius=radius), walls, tolerance=0.05)
    pairs = ~found.is_wall
    ways = position[None] - position[:, None] + np.array([-10, 0, 10])[:, None, None, None] * [1, 0]
    gap = np.hypot(*np.moveaxis(ways, 3, 0)) - radius - radius[:, None]
    _, first, second = np.nonzero((gap <= 0.05) & np.triu(np.ones((120, 120), bool), 1))
    expected = sorted(zip(first.tolist(), second.tolist(), strict=True))
    assert sorted(zip(found.first[pairs], found.second[pairs], strict=True)) == expected
    # who has gone round is where they were
    round_ = disks_at(position + np.array([30.0, 0.0]), radius=radius)
    there = find_contacts(round_, walls, tolerance=0.05)
    for name in ("first", "second", "is_wall", "gap", "normal"):
        np.testing.assert_allclose(getattr(there, name), getattr(found, name), atol=1e-12)


def test_a_ring_that_is_pressed_goes_on_with_the_mean_of_its_momentum():
    """Each disk may not come nearer to the next, all round: all have one velocity."""
    mass, speed = np.array([60.0, 75.0, 90.0, 75.0, 50.0]), np.array([2.0, 0.0, -1.0, 0.5, 0.3])
    position = np.column_stack([0.5 * np.arange(5), np.zeros(5)])
    ring = disks_at(position, np.column_stack([speed, np.zeros(5)]), mass=mass)
    walls = Walls(start=np.empty((0, 2)), end=np.empty((0, 2)), period_x=(0.0, 2.5))
    contacts, found = solved(ring, walls)
    assert len(contacts) == 5
    np.testing.assert_allclose(found.right_velocity[:, 0], mass @ speed / mass.sum(), atol=1e-9)


def two(at):
    """Two who meet, in the mean at this x (m)."""
    position = (np.array([[at - 0.3, 1.0], [at + 0.3, 1.1]])) % [LONG, 9]
    return scene_at(
        disks_at(position, [[1.0, 0.0], [-1.0, 0.0]], spin=[1.0, 0.0]), name="meeting",
        contact=CONTACT | {"friction": 0.3}, run={"duration_s": 0.4, "frames": 4},
        period_x_m=(0.0, LONG),
    )  # fmt: skip


@pytest.mark.parametrize("name", ENGINES)
def test_who_meet_across_the_end_do_as_those_who_meet_inside(simulate, name):
    across, inside = simulate(name, two(LONG)), simulate(name, two(0.5 * LONG))
    for column in ("vx", "vy", "omegaz", "y"):
        np.testing.assert_allclose(across[column], inside[column], rtol=0, atol=1e-11)
    assert (across["vx"][-1] * across["vx"][0] < 0.5).all()  # they did meet
    moved = (across["x"] - inside["x"] - 0.5 * LONG + 1e-9) % LONG
    np.testing.assert_allclose(moved, 1e-9, rtol=0, atol=1e-11)


@pytest.mark.parametrize("round_", [4.0, -80.0])
def test_who_keep_their_distance_do_so_across_the_end(round_):
    """Turned by half a period, or by ten, all want the same; jostling too, where it has the period."""
    scene = spaced(read_scene("two_way"), heading_sd_rad=0.2)
    people, drive, by = scene.snapshot, scene.drive, np.array([round_, 0.0])
    here = drive.desired_velocity(people.position, people.ids, 1.0, people.radius)
    there = drive.desired_velocity(people.position + by, people.ids, 1.0, people.radius)
    np.testing.assert_allclose(there, here, rtol=0, atol=1e-12)
    assert (np.hypot(*here.T) < 0.9 * drive.speed_m_per_s).any()
    jostled = spaced(scene, jostling_m_per_s=0.2).drive
    at = np.array([[0.0, 1.0], [8.0, 1.0]])[:, None] + [[1e-6, 0.0], [3.0, 0.2]]
    first, last = (
        jostled.desired_velocity(one, people.ids[:2], 1.0, people.radius[:2]) for one in at
    )
    np.testing.assert_allclose(last, first, rtol=0, atol=1e-12)
    plain = drive.desired_velocity(at[0], people.ids[:2], 1.0, people.radius[:2])
    assert np.hypot(*(first - plain).T).min() > 1e-3


@pytest.mark.parametrize("name", ENGINES)
def test_momentum_along_a_corridor_is_what_the_drive_gives(simulate, name):
    """Σ m u_x = Σ m U (1 − exp(−t/τ)): people press each other, which gives nothing."""
    scene = read_scene("two_way")
    goal = scene.drive.goals[0].model_copy(update={"people": (31, 40)})
    drive = scene.drive.model_copy(update={"goals": (goal,)})
    scene = scene.model_copy(update={"drive": drive}).with_run(duration_s=3.0, frames=10)
    found = simulate(name, scene)
    time = np.linspace(0, 3, 11)
    by_hand = 75.0 * (30 - 10) * (1 - np.exp(-time / 0.5))
    np.testing.assert_allclose((found["mass"] * found["vx"]).sum(1), by_hand, atol=15.0)
    assert np.ptp(found["x"]) < 8.1
    # and people were pressed across the end
    ways = [
        np.subtract(*x[np.array([now.first, now.second])[:, ~now.is_wall] - 1])
        for x, now in zip(found["x"], found.contacts, strict=True)
    ]
    assert np.abs(np.concatenate(ways)).max() > 4.0


def test_two_engines_agree_while_nobody_was_pushed_twice(simulate):
    scene = read_scene("two_way").with_run(duration_s=0.6, frames=2)
    one, other = (simulate(name, scene) for name in ENGINES)
    way = np.abs(one["x"] - other["x"])
    assert np.minimum(way, 8.0 - way).max() < 0.01
    assert np.abs(one["y"] - other["y"]).max() < 0.01


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"period_x_m": (0.0, 0.8)}, "period_x_m: 0.8 m. More than two diameters"),
        ({"period_x_m": (0.0, 7.5)}, "is not in it, from 0 to 7.5 m"),
        ({"drive": drive_to((9.0, 0.0), (9.0, 2.0))}, "no door. Leave out door_start_m"),
        ({"high": (8.0, 2.1)}, "wall upper comes within 0.43453 m of x = 0 m"),
        ({"high": (7.9, 2.0)}, "wall upper comes within 0.43453 m of x = 0 m"),
    ],
)
def test_what_does_not_go_round_is_refused(change, message):
    scene = make("two_way")
    if end := change.pop("high", None):
        wall = scene.walls[1].model_copy(update={"end_m": end})
        change["walls"] = (scene.walls[0], wall)
    changed = scene.model_copy(update=change)
    with pytest.raises(SceneError) as refused:
        changed.check("made")
    assert message in str(refused.value)


def test_who_cannot_take_a_period_says_so(tmp_path):
    scene = read_scene("two_way")
    path = scene.write(tmp_path)
    path.write_text(path.read_text().replace("period_x_m = [0.0, 8.0]", "period_x_m = [8.0, 0.0]"))
    says = r"two_way\.toml: period_x_m: from 8 to 0 m. The first must"
    with pytest.raises(SceneError, match=says):
        read_scene(path)
    with pytest.raises(EngineError, match="period_x_m: YADE has none here: use lammps or rigid"):
        engine("yade").check(scene)
    with pytest.raises(ValueError, match="period_x_m: advice is for scenes without"):
        scene.check_plain("advice is")
    text = (
        "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS pp ff pp\n0 8\n0 2\n-1 1\n"
        "ITEM: ATOMS id x y radius mass\n1 1 1 0.2 75\n"
    )
    (tmp_path / "bodies.dump").write_text(text)
    with pytest.raises(DumpError, match=r"put a scene\.toml with period_x_m beside it"):
        index_dump(tmp_path / "bodies.dump")
    (tmp_path / "scene.toml").write_text("period_x_m = [0.0, 8.0]\n")
    assert index_dump(tmp_path / "bodies.dump").steps == (0,)
    room = tmp_path / "room.toml"
    room.write_text('title = "other"\n')
    with pytest.raises(SceneError, match=r"room\.toml: period_x_m: missing"):
        setting_beside(tmp_path / "bodies.dump", room)
