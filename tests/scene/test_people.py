"""Bodies of people, and pushes in newton: what a scene file may say in place of radii and
speeds."""

import numpy as np
import pytest

from analysis.scene.anthropometry import Varied, bodies_of
from analysis.scene.real.import_crowd import import_crowd
from analysis.scene.real.trajectory import read_heads
from analysis.scene.scene import SceneError, read_scene
from analysis.scene.shipped_scenes import make
from analysis.support.files import shipped
from nscd import find_contacts


def written(tmp_path, old="", new="", name="arch", disks=30):
    """The path of a scene file with one part of its text replaced."""
    path = make(name, disks=disks).write(tmp_path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    return path


@pytest.mark.parametrize(
    ("people", "radius", "mass"),
    [("ANSUR II men", 0.180, 85.5), ("ANSUR II women", 0.167, 67.8)],
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
    touching = find_contacts(scene.snapshot, scene.wall_segments(), tolerance=0.0)
    assert touching.gap.min(initial=0.0) > -1e-9
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
def test_a_push_gives_speed_and_relaxation_time(tmp_path, lines, speed, time):
    old = "speed_m_per_s = 2.0\nrelaxation_time_s = 0.5"
    drive = read_scene(written(tmp_path, old, lines)).drive
    assert drive.speed_m_per_s == pytest.approx(speed)
    assert drive.relaxation_time_s == pytest.approx(time)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("speed_m_per_s = 2.0", "speed_m_per_s = 2.0\npush_N = 100.0", "push_N: instead of"),
        ("speed_m_per_s = 2.0", "push_N = -1.0", "push_N"),
        ("speed_m_per_s = 2.0", "push_N = nan", "push_N"),
        ("speed_m_per_s = 2.0", 'push_N = "100"', "push_N"),
        ('data = "arch.data"', 'data = "arch.data"\npeople = "giants"', r"disks.people"),
        ('data = "arch.data"', 'data = "arch.data"\npeople_seed = -1', r"disks.people_seed"),
    ],
)
def test_what_makes_no_sense_is_refused_by_its_key(tmp_path, old, new, said):
    path = written(tmp_path, old, new)
    with pytest.raises(SceneError, match=said) as found:
        read_scene(path)
    assert str(path) in str(found.value)


def test_radii_within_a_share():
    radii, masses = Varied(radius_share=0.1, seed=2).bodies(0.18, 75.0, 2000)
    assert 0.162 <= radii.min() < 0.165
    assert 0.195 < radii.max() <= 0.198
    assert set(masses) == {75.0}
    with pytest.raises(ValueError, match="from 0 to below 1"):
        Varied(radius_share=1.0).bodies(0.18, 75.0, 5)


def test_a_real_crowd_of_people(tmp_path):
    """The imported frame says how radii are spread, and nobody overlaps."""
    heads = read_heads(shipped("scenes") / "gate_excerpt.txt", 405)
    room = shipped("scenes") / "rooms" / "gate.toml"
    found = import_crowd(heads, radius=0.18, room=room, varied=Varied(people="ANSUR II women"))
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
    with pytest.raises(ValueError, match="'NHANES'; there are: ANSUR II"):
        bodies_of("NHANES", 10, seed=1)
