"""What the command refuses, and how it ends: one line that names the option, nothing written."""

import shutil
from pathlib import Path

import pytest

from analysis.scene.shipped_scenes import make
from tests.crowds import two_people

POSITIVE = "a finite number above 0 is needed"


@pytest.mark.parametrize("value", ["-1", "0", "nan", "inf", "-inf", "much"])
@pytest.mark.parametrize(
    "words",
    [
        ("run", "pair", "--time-step"),
        ("run", "pair", "--duration"),
        ("run", "pair", "--stiffness"),
        ("solve", "a.dump", "--time-step"),
        ("solve", "a.dump", "--window"),
        ("solve", "a.dump", "--tolerance"),
        ("solve", "a.dump", "--contact-tolerance"),
        ("report", "pair", "--stiffness"),
        ("import", "a.txt", "--frame", "1", "--room", "a.toml", "--frame-rate"),
        ("import", "a.txt", "--frame", "1", "--room", "a.toml", "--radius"),
        ("import", "a.txt", "--frame", "1", "--room", "a.toml", "--mass"),
        ("import", "a.txt", "--frame", "1", "--room", "a.toml", "--window"),
    ],
)
def test_numbers_that_must_be_positive(refused, words, value):
    assert refused(*words, value) == f"percussions: {words[-1]}: {value}: {POSITIVE}"


@pytest.mark.parametrize("value", ["-0.1", "1.1", "nan"])
def test_restitution_is_a_share(refused, value):
    said = refused("run", "pair", "--restitution", value)
    assert said == f"percussions: --restitution: {value}: a number from 0 to 1 is needed"


@pytest.mark.parametrize(
    "words",
    [
        ("solve", "a.dump", "--workers"),
        ("chart", "pair", "--jobs"),
        ("stability", "--jobs"),
        ("scenes", "--make", "arch", "--disks"),
    ],
)
@pytest.mark.parametrize("value", ["0", "-3", "2.5", "many"])
def test_counts_are_whole_and_positive(refused, words, value):
    said = refused(*words, value)
    assert said == f"percussions: {words[-1]}: {value}: a whole number above 0 is needed"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("run",), "scene"),
        (("run", "pair", "--speed", "3"), "--speed"),
        (("nonsense",), "nonsense"),
        (("run", "pair", "pair"), "pair"),
        (("scenes", "--make", "arch", "--disks", "1e18"), "--disks 1000000000000000000: at most"),
        (
            ("run", "arch", "--stiffness", "1e20"),
            "arch: 5.74e+10 steps of 3.48e-11 s for 594 disks",
        ),
        (("run", "arch", "--stiffness", "1e300"), "would not end within a month"),
        (("run", "arch", "--duration", "1e300", "--stiffness", "1e300"), "too many steps"),
        (("run", "arch", "--duration", "1e12"), "would not end within a month"),
        (("run", "pair", "--time-step", "1e-300"), "run.time_step_s: 1e-300 is nearer to 0"),
        (("run", "pair", "--time-step", "1e-99"), "would not end within a month"),
    ],
)
def test_words_that_are_not_known(refused, words, says):
    assert says in refused(*words)


@pytest.mark.parametrize(
    "words", [("solve", "pair.dump", "--out", "a.csv"), ("export", "pair", "--fclib", "a.hdf5")]
)
def test_friction_of_walls_that_are_not_there(refused, tmp_path, words):
    (tmp_path / "pair.dump").write_text(two_people())
    said = refused(*words, "--wall-friction", "0.3")
    assert said == "percussions: wall_friction: 0.3; there are no walls"


def test_friction_of_one_wall_is_no_key_of_a_scene(refused, tmp_path):
    path = make("corridor").write(tmp_path)
    text = path.read_text()
    path.write_text(text.replace("[[walls]]", "[[walls]]\nfriction = 0.3", 1))
    assert "friction" in refused("run", path)
    path.write_text(text.replace("[contact]", "[contact]\nwall_friction = 0.3", 1))
    assert "contact.wall_friction" in refused("run", path)


def test_more_than_fits_on_the_disk(refused, tmp_path):
    path = make("arch", 100).with_run(frames=10**9, time_step_s=1.0).write(tmp_path)
    said = refused("run", path)
    assert "run.frames: 1000000000 frames of 100 disks need about 5e+04 GB" in said


@pytest.mark.parametrize("words", [("solve", "a.dump", "--workers"), ("chart", "pair", "--jobs")])
def test_more_processes_than_any_machine_runs(refused, words):
    assert "1e9: at most 1024 processes are started" in refused(*words, "1e9")


@pytest.mark.parametrize(
    ("words", "names"),
    [
        (("solve", "a.dump", "--out", ""), "--out"),
        (("solve", "a.dump", "--out="), "--out"),
        (("run", "pair", "--out", "", "--stiffness", "1e5"), "--out"),
        (("compare", ""), "argument"),
    ],
)
def test_an_empty_word_is_not_the_current_folder(refused, words, names):
    assert refused(*words) == f"percussions: {names}: empty; a value is needed"


@pytest.mark.parametrize("words", [("solve", "a.dump", "--out"), ("run", "pair", "--out")])
def test_an_option_is_no_path(refused, words):
    said = refused(*words, "--out")
    assert said.startswith("percussions: --out: --out: a path is needed")


def test_a_table_does_not_replace_its_dump(refused, tmp_path):
    dump = tmp_path / "a.dump"
    dump.write_text("anything")
    said = refused("solve", "a.dump", "--out", tmp_path / "." / "a.dump")
    assert "a.dump: the table would replace what it is made of" in said
    assert dump.read_text() == "anything"


def test_a_scene_does_not_replace_its_room(refused, tmp_path):
    data = Path(__file__).resolve().parents[1] / "data"
    room = shutil.copy(data / "rooms/free.toml", tmp_path / "free.toml")
    words = ("import", data / "trajectories/metres.txt", "--frame", 2, "--room", room)
    assert "free.toml: the scene would replace its room; give --name or --out" in refused(*words)
