"""Scenes whose people are bodies of several disks: written, read, run by the rigid engine, refused."""

import numpy as np
import pytest

from analysis.dumps import open_bodies, snapshot_of
from analysis.engines.programs.rigid import main
from analysis.scene.scene import SceneError, read_scene
from tests.crowds import disks_at


@pytest.fixture
def scene(tmp_path):
    """Two dumbbells that walk to a door, one with an inertia of its own."""
    places = [[-3.0, 0.1], [-3.0, 0.5], [-2.2, 0.0], [-2.2, -0.4]]
    crowd = disks_at(places, (1.0, 0.0), 0.2, 30.0, spin=[0.5, 0.5, -1, -1], ids=[1, 2, 5, 7])
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
    whole = (out / "bodies.dump").read_bytes()
    trajectory = open_bodies(out / "bodies.dump", 0.01).trajectory
    end = snapshot_of(trajectory[len(trajectory) - 1])
    np.testing.assert_allclose(end.bodies.inertia, [3.0, 5.0])
    apart = end.position[1] - end.position[0]
    turned = [-0.4 * np.sin(0.15), 0.4 * np.cos(0.15)]
    np.testing.assert_allclose(apart, turned, atol=1e-9)
    (out / "bodies.dump").write_bytes(whole[: len(whole) * 3 // 4])
    assert main([str(tmp_path / "two.toml"), "--out", str(out)]) == 0
    assert (out / "bodies.dump").read_bytes() == whole


BAD = {
    "goes with the section Molecules": ("two.toml", 'bodies = "two.bodies"\n', ""),
    "body 8: one line": ("two.bodies", "\n9 60.0", "\n8 60.0"),
    "line 2: 20 numbers": ("two.bodies", "4 60.0", "4 x"),
    "body 4: 61 kg where": ("two.bodies", "4 60.0", "4 61.0"),
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
