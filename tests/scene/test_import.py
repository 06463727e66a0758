"""Import of real crowds: formats, the shipped scene bit by bit, one message for each kind of bad
input."""

import json
from pathlib import Path

import numpy as np
import pytest
import shapely

from analysis.scene.real.import_crowd import import_crowd
from analysis.scene.real.separate import OverlapError
from analysis.scene.real.trajectory import TrajectoryError, read_heads
from analysis.scene.scene import SceneError, read_room, read_scene
from analysis.support.files import write_text

ROOT = Path(__file__).resolve().parents[2]
FORMATS = ROOT / "tests" / "data" / "trajectories"
FREE = ROOT / "tests" / "data" / "rooms" / "free.toml"
EXCERPT, GATE = ROOT / "scenes" / "gate_excerpt.txt", ROOT / "scenes" / "rooms" / "gate.toml"
DATA = ROOT.parent / "shared" / "data"
WHOLE = DATA / "crowdqueue_040_c_56_h-_low_motivation.txt"


def real(path):
    if not path.exists():
        pytest.skip(f"the trajectory {path.name} is not here (it is not shipped)")
    return path


def three_walkers(positions):
    """What tests/data/trajectories/README.md says of every file in it, at frame 2."""
    np.testing.assert_array_equal(positions.ids, [1, 2, 3])
    np.testing.assert_allclose(positions.position, [[0, 0.2], [0.5, 0.2], [1, 0.2]], atol=1e-12)
    np.testing.assert_allclose(positions.velocity, [[0, 1], [0, 1], [0, 1]], atol=1e-9)


STATED = "metres.txt centimetres.txt pathfinder.csv pathfinder.json crowdit.csv viswalk.pp".split()  # noqa: SIM905


@pytest.mark.parametrize("name", STATED)
def test_formats_that_state_unit_and_frame_rate(name):
    three_walkers(read_heads(FORMATS / name, 2))


@pytest.mark.parametrize("name", ["viswalk.pp", "bare.txt", "table.csv"])
@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        (b"", b"5e-324\n", "line 1: '5e-324' has too few cells for a row"),
        (b"\n", b"\r", r"has a carriage return. Lines end in \\n or \\r\\n"),
    ],
    ids=["a number first", "line ends of old"],
)
def test_a_line_that_is_no_row(name, old, new, reason, tmp_path):
    content = (FORMATS / name).read_bytes()
    (tmp_path / name).write_bytes(content.replace(old, new) if old else new + content)
    with pytest.raises(TrajectoryError, match=reason):
        read_heads(tmp_path / name, 2, unit="m", frame_rate=10)


def test_formats_that_do_not():
    three_walkers(read_heads(FORMATS / "bare.txt", 2, unit="m", frame_rate=10))
    three_walkers(read_heads(FORMATS / "table.csv", 2, unit="m"))


def test_whole_file_gives_the_shipped_scene():
    full = import_crowd(read_heads(real(WHOLE), 405), radius=0.18, room=GATE)
    shipped = read_scene("gate")
    for name in ("position", "velocity", "ids"):
        np.testing.assert_array_equal(
            getattr(full.scene.snapshot, name), getattr(shipped.snapshot, name)
        )


def test_excerpt_is_unchanged_lines_of_the_whole_file():
    lines = set(real(WHOLE).read_text().splitlines())
    assert all(
        line in lines for line in EXCERPT.read_text().splitlines() if not line.startswith("#")
    )


def test_room_holds_the_crowd_that_was_filmed():
    """Every head of the run that is before the gate is between the walls of the room."""
    room, _ = read_room(GATE)
    positions = np.loadtxt(real(WHOLE), usecols=(2, 3))
    before = positions[positions[:, 1] > 0]
    area = shapely.MultiPoint(
        [p for wall in room.walls for p in (wall.start_m, wall.end_m)]
    ).envelope
    assert shapely.contains_xy(area, before).all()
    # the gate: all who pass y = 0 do it between the posts
    rows = np.loadtxt(WHOLE, usecols=(0, 1, 2, 3))
    for person in np.unique(rows[:, 0]):
        track = rows[rows[:, 0] == person]
        after = np.flatnonzero(track[:, 3] < 0)
        if len(after):
            assert abs(track[after[0], 2]) < 0.25 + 0.18


def test_report_agrees_with_the_scene():
    made = import_crowd(read_heads(EXCERPT, 405), radius=0.18, room=GATE)
    report, snapshot = made.report, made.scene.snapshot
    moved = np.hypot(*(snapshot.position - made.head_positions).T)
    assert report.people == len(snapshot) == 55
    assert report.left_out == 2
    assert report.moved_largest_m == pytest.approx(moved.max(), abs=1e-6)
    assert report.moved_mean_m == pytest.approx(moved.mean(), abs=1e-6)
    pairs = np.hypot(*(made.head_positions[:, None] - made.head_positions[None]).transpose(2, 0, 1))[
        np.triu_indices(55, 1)
    ]
    assert report.overlaps_before == (pairs < 0.36).sum()
    assert report.overlap_before_largest_m == pytest.approx(0.36 - pairs.min(), abs=1e-6)
    after = np.hypot(*(snapshot.position[:, None] - snapshot.position[None]).transpose(2, 0, 1))
    after = after[np.triu_indices(55, 1)]
    assert after.min() >= 0.36 - 1e-12
    assert report.overlap_after_m == 0
    # those who overlapped now touch: exactly, not nearly
    assert (
        report.contacts_after
        == (after < 0.36 + made.scene.analysis.contact_tolerance_m).sum()
        >= 33
    )
    assert "2 outside the walls" in made.statement
    assert "15.7 cm at most" in made.statement


def test_people_counted_from_0_become_disks_that_an_engine_takes(tmp_path):
    counted, lines = tmp_path / "counted.txt", []
    for line in (FORMATS / "metres.txt").read_text().splitlines():
        person, _, rest = line.partition(" ")
        lines.append(f"{person if person == '#' else int(person) - 1} {rest}\n")
    counted.write_text("".join(lines))
    made = import_crowd(read_heads(counted, 2), radius=0.2, room=FREE)
    again = read_scene(made.write(tmp_path))
    assert again.snapshot.ids.tolist() == [1, 2, 3]
    assert "Ids of disks are those of the people plus 1." in again.notes
    plain = import_crowd(read_heads(FORMATS / "metres.txt", 2), radius=0.2, room=FREE)
    assert plain.scene.snapshot.ids.tolist() == [1, 2, 3]
    assert "Ids of disks" not in plain.scene.notes


def test_reconciliation_survives_the_scene_file(tmp_path):
    made = import_crowd(read_heads(EXCERPT, 405), radius=0.18, room=GATE)
    again = read_scene(made.write(tmp_path))
    assert again.reconciliation == made.report
    assert again.notes == made.scene.notes
    content = json.loads((tmp_path / "gate.reconciliation.json").read_text())
    np.testing.assert_array_equal(content["disk_x_m"], again.snapshot.position[:, 0])
    np.testing.assert_array_equal(content["id"], again.snapshot.ids)


def test_crowd_on_an_open_floor():
    made = import_crowd(read_heads(FORMATS / "metres.txt", 2), radius=0.3, room=FREE)
    x = made.scene.snapshot.position[:, 0]
    np.testing.assert_allclose(x, [-0.1, 0.5, 1.1], atol=1e-7)
    assert made.report.contacts_after == 2
    assert made.scene.name == "free"


def variant(tmp_path, old, new):
    path = tmp_path / "changed.txt"
    write_text(path, (FORMATS / "metres.txt").read_text().replace(old, new))
    return path


ROW = "2 2 0.500 0.200"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (ROW, "2 2 nan 0.200", r"changed.txt: frame 2: the position of person 2 is no num"),
        (ROW, "2 2 0.000 0.200", r"frame 2: persons [12] and [12] are at the same place"),
        (ROW, "1 2 0.500 0.200", r"frame 2: person 1 occurs twice"),
        (ROW, "2 2 half 0.200", r"changed.txt, line 10: '2 2 half 0.200' is not a row"),
        (ROW, "2 1e308 0.500 0.200", r"changed.txt: line 10: frame: .*. A whole number"),
        (ROW, "2 2 1e308 0.200", r"the position of person 2 is no number of metres"),
        (ROW, "2 2 0.500 0.200 7", r"changed.txt, line 10: .* is not a row"),
        (ROW, "2 0.500 0.200", r"changed.txt, line 10: .* is not a row"),
        (ROW, "2 2.5 0.500 0.200", r"changed.txt: line 10: frame: .*. A whole number"),
        ("x/m y/m", "x/cm y/cm", r"neighbours are 0.005 m apart .* Is the unit right"),
        ("x/m y/m", "x y", r"changed.txt: states no unit. Give --unit m or --unit cm$"),
        ("# framerate: 10", "#", r"changed.txt: states no frame rate. Give --frame-rate$"),
        ("framerate: 10", "framerate: inf", "inf frames per second"),
        ("framerate: 10", "framerate: 1e300", r"a tenth of the steps are faster than 1e\+299 m/s"),
        (
            "framerate: 10",
            "framerate: 1e-300",
            r"times are 1e\+300 s apart. Is the frame rate right",
        ),
    ],
)
def test_bad_files_have_one_message(tmp_path, old, new, message):
    with pytest.raises(TrajectoryError, match=message) as error:
        read_heads(variant(tmp_path, old, new), 2)
    assert "\n" not in str(error.value)


def test_missing_frame_file_columns_and_window(tmp_path):
    write_text(tmp_path / "odd.csv", "person,when,px,py\n1,0,0.0,0.0\n")
    for name, frame, window, says in (
        ("metres.txt", 9, 0.4, "metres.txt: there is no frame 9. The frames go from 0 to 4"),
        ("none.txt", 2, 0.4, "none.txt: no such file"),
        (
            tmp_path / "odd.csv",
            0,
            0.4,
            "odd.csv: no column for x, y, frame or time among person, when, px, py",
        ),
        ("metres.txt", 2, 1e300, r"a window of 1e\+300 s is 1e\+301 frames"),
    ):
        with pytest.raises(TrajectoryError, match=says):
            read_heads(FORMATS / name, frame, window_s=window)


def test_person_not_seen_long_enough(tmp_path):
    lines = (FORMATS / "metres.txt").read_text().splitlines()
    rows = [line for line in lines if not line.startswith("3 ")]
    write_text(tmp_path / "short.txt", "\n".join([*rows, "3 2 1.0 0.2"]) + "\n")
    with pytest.raises(TrajectoryError, match=r"frame 2: person 3 is not seen over 0.4 s"):
        import_crowd(read_heads(tmp_path / "short.txt", 2), radius=0.2, room=FREE)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"radius": 18.0}, r"radius: 18 m. Between 0.05 and 0.5 m"),
        ({"radius": 0.35}, "55 people of radius 0.35 m do not fit into gate.toml"),
        ({"radius": 0.4}, "55 people of radius 0.4 m do not fit into gate.toml"),
        ({"mass": 0.0}, r"mass: 0 kg"),
        ({"room": GATE.with_name("none.toml")}, r"none.toml: no such file"),
        ({"file": FORMATS / "metres.txt", "frame": 0}, r"frame 0: nobody is inside the walls of .*gate.toml"),
    ],
)  # fmt: skip
def test_bad_arguments_have_one_message(change, message):
    arguments = {"file": EXCERPT, "frame": 405, "radius": 0.18, "room": GATE} | change
    with pytest.raises((SceneError, TrajectoryError), match=message):
        import_crowd(read_heads(arguments.pop("file"), arguments.pop("frame")), **arguments)


def test_bad_rooms_name_the_key(tmp_path):
    text = GATE.read_text()
    for old, new, message in [
        ('name = "back"', 'nam = "back"', r"room.toml: walls.3"),
        ("end_m = [-2.8, 0.0]", "end_m = [-2.8, 0.1]", r"room.toml: walls: with the door they must enclose"),
        ("restitution = 0.1", "restitution = 2.0", r"room.toml: contact.restitution"),
    ]:  # fmt: skip
        write_text(tmp_path / "room.toml", text.replace(old, new))
        with pytest.raises(SceneError, match=message):
            import_crowd(read_heads(EXCERPT, 405), radius=0.18, room=tmp_path / "room.toml")


def test_too_many_people_for_the_room(tmp_path):
    text = GATE.read_text().replace("6.7", "3.8").replace("2.8", "1.9")
    write_text(tmp_path / "room.toml", text)
    with pytest.raises(OverlapError, match=r"frame 405: there is no room for \d+ disks"):
        import_crowd(read_heads(EXCERPT, 405), radius=0.3, room=tmp_path / "room.toml")


def test_times_that_do_not_grow(tmp_path):
    rows = [line.split(",") for line in (FORMATS / "table.csv").read_text().splitlines()]
    for row in rows[1:]:
        row[2] = "0.0"
    write_text(tmp_path / "heads.csv", "\n".join(map(",".join, rows)) + "\n")
    with pytest.raises(TrajectoryError, match=r"heads\.csv: time does not grow from frame 0"):
        read_heads(tmp_path / "heads.csv", 2, unit="m")
