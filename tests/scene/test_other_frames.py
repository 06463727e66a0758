"""Other frames of a film in a scene: which, as crowds that a report takes turns with, refusals."""

import numpy as np
import pytest
from typer.testing import CliRunner

from analysis.cli.commands import app
from analysis.scene.real.import_crowd import frames_near, import_crowd
from analysis.scene.real.trajectory import Recording, read_heads
from analysis.scene.scene import SceneError, read_scene
from analysis.scene.shipped_scenes import PLACE_M, how_varied, variant
from tests.scene.test_import import EXCERPT, FORMATS, FREE, GATE, ROOT


def crowd_of(number):
    return import_crowd(read_heads(EXCERPT, number), radius=0.18, room=GATE)


def imported(*arguments):
    return CliRunner().invoke(app, ["import", *map(str, arguments)])


def test_shipped_scene_is_what_import_makes_bit_by_bit(tmp_path):
    made = imported(EXCERPT, "--frame", 405, "--room", GATE, "--others", 2, "--out", tmp_path)
    assert made.exit_code == 0
    files = ["gate.toml", "gate.data", "gate.reconciliation.json", "gate_400.data", "gate_410.data"]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(files)
    for name in files:
        assert (tmp_path / name).read_bytes() == (ROOT / "scenes" / name).read_bytes(), name
    assert "Other frames of the film: 400 (−0.2 s), 410 (+0.2 s)." in made.stdout


def test_a_room_says_nothing_of_another_file(tmp_path):
    """What holds of the shipped excerpt alone is in its head, and in no scene made of another."""
    rows = [line for line in EXCERPT.read_text().splitlines() if not line.startswith("#")]
    other = tmp_path / "other.txt"
    other.write_text("\n".join(["# framerate: 25 fps", "# id frame x/m y/m z/m", *rows, ""]))
    made = imported(other, "--frame", 405, "--room", GATE, "--others", 0, "--out", tmp_path)
    assert made.exit_code == 0
    output = made.stdout + (tmp_path / "gate.toml").read_text()
    for own in ("040", "motivation", "0.22 m", "1.02 m/s"):
        assert own not in output
        assert own in EXCERPT.read_text()


@pytest.mark.parametrize(
    ("frame", "count", "difference", "found"),
    [
        (405, 4, 0.08, [403, 407, 401, 409]),
        (405, 2, 0.04, [404, 406]),
        (405, 4, 1.0, [403, 407, 401, 409]),  # 11 frames in 0.4 s: as far apart as they can be
        (400, 2, 1.0, [405, 410]),
        (405, 20, 1.0, [404, 406, 403, 407, 402, 408, 401, 409, 400, 410]),
        (405, 0, 1.0, []),
    ],
)
def test_which_frames(frame, count, difference, found):
    assert frames_near(frame, Recording.read(EXCERPT), count, difference) == found


def test_a_film_of_one_frame_has_no_others():
    recording = Recording.read(EXCERPT)
    one = recording.data[recording.data.frame == 405]
    assert frames_near(405, Recording(file=EXCERPT, data=one, frame_rate=25.0), 4, 1.0) == []


def test_crowds_take_turns_with_the_frames():
    scene = read_scene("gate")
    frames = [crowd_of(number).scene.snapshot for number in (405, 400, 410)]
    assert variant(scene, 0) is scene
    for number in range(1, 5):
        made, own = variant(scene, number), frames[number % 3]
        assert made.snapshot.ids.tolist() == own.ids.tolist()
        far = np.hypot(*(made.snapshot.position - own.position).T)
        assert 0 < np.median(far) < 3 * PLACE_M
        assert not made.other_crowds
    message = how_varied(scene, 5)
    assert "(3 frames, from 0.2 s before to 0.2 s after that of the first crowd)" in message
    assert "2 frames, from 0.2 s before to 0 s after" in how_varied(scene, 2)
    assert "frame" not in how_varied(scene, 1)


def test_runs_of_a_scene_do_not_depend_on_its_other_frames(tmp_path):
    scene = read_scene("gate")
    alone = scene.model_copy(update={"other_frames": None, "other_crowds": ()})
    assert scene.digest() == alone.digest()
    again = read_scene(scene.model_copy(update={"name": "again"}).write(tmp_path))
    assert again.other_frames.data == ("again_400.data", "again_410.data")
    (tmp_path / "again_410.data").unlink()
    with pytest.raises(SceneError, match=r"again_410\.data"):
        read_scene(tmp_path / "again.toml")


def test_a_frame_that_cannot_be_a_crowd_is_named(tmp_path):
    """Two people of frame 3 at one place."""
    text = (FORMATS / "metres.txt").read_text()
    assert "2 3 0.500" in text
    film = tmp_path / "film.txt"
    film.write_text(text.replace("2 3 0.500", "2 3 0.000"))
    options = ("--room", FREE, "--radius", 0.2, "--apart", 0.1, "--others", 2, "--out", tmp_path)
    made = imported(film, "--frame", 2, *options)
    assert made.exit_code == 0
    assert "film.txt: frame 3: persons" in made.stderr
    assert "frame 3" not in made.stdout
    assert "these could not be made crowds: 3." in made.stdout
    scene = read_scene(tmp_path / "free.toml")
    assert (scene.other_frames.frames, scene.other_frames.refused) == ((1,), (3,))
    assert scene.other_frames.rows()[1] == ("other frames that could not become crowds", "3")
