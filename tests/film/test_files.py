"""Film, exposure and comparison of files that are no run: dumps of disks as other programs write them,
and trajectories that hold their geometry. Judged by a pressed row, and by `solve` of the same file."""

import csv
import itertools

import numpy as np
import pytest

from analysis.scene.real.trajectory import Recording
from analysis.studies.film.export import film_heads
from analysis.studies.film.files import FileOptions, open_any
from analysis.studies.film.frame import FrameRange
from analysis.studies.film.page import _what, words_of
from analysis.studies.film.summary import headline_rows
from tests.crowds import frame
from tests.walkers import KINDS, archive, base_of

PUSH, RADIUS = 150.0, 0.2
ROOM = """
[drive]
speed_m_per_s = 1.0
relaxation_time_s = 0.5
door_start_m = [5.0, -0.1]
door_end_m = [5.0, 0.1]
outward = [1.0, 0.0]
aim = "centre"
"""
WALL = '[[walls]]\nname = "end"\nstart_m = [0.0, -0.4]\nend_m = [0.0, 0.4]\n'
TIMED = ("--time-step", "0.1", "--room", "room.toml")
FLOOR = "POLYGON ((-4 -1, 0 -1, 0 1, -4 1, -4 -1))"


def row_of(ids, scale=1.0):
    """People of 75 kg in a row against the wall x = 0, the first of these ids at it."""
    return [
        [one, -RADIUS * (2 * k + 1) * scale, 0, RADIUS * scale, 75, 0, 0]
        for k, one in enumerate(ids)
    ]


CROWDS = ([7, 5, 3], [7, 5, 3, 4], [5, 3, 4])  # who enters, and who leaves


def text(scale=1.0, mass=75):
    frames = (frame(2 * k, row_of(ids, scale)) for k, ids in enumerate(CROWDS))
    return "".join(frames).replace(" 75 ", f" {mass} ")


def own(scale=0.9):
    """The contacts of the dump with other forces: a share of what rigid disks give."""
    made = ""
    for step, ids in enumerate(CROWDS):
        rows = [[ids[0], 1, 1, 1, 0, 0, scale * PUSH * len(ids), 0]]
        for k, (one, other) in enumerate(itertools.pairwise(ids), start=1):
            sign = 1 if other < one else -1  # the smaller id is the first
            pushed = sign * scale * PUSH * (len(ids) - k)
            rows.append([min(one, other), max(one, other), 0, sign, 0, 0, pushed, 0])
        made += frame(2 * step, sorted(rows), "first second is_wall nx ny overlap fx fy", "ENTRIES")
    return made


@pytest.fixture
def row(tmp_path):
    (tmp_path / "row.dump").write_text(text())
    (tmp_path / "room.toml").write_text(WALL + ROOM)
    return tmp_path


def table(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def column(path, name, **where):
    rows = table(path)
    return [float(one[name]) for one in rows if all(one[key] == is_ for key, is_ in where.items())]


def test_exposure_of_a_dump_is_what_solve_finds_and_people_may_enter_and_leave(percussions, row):
    assert percussions("solve", "row.dump", *TIMED).returncode == 0
    made = percussions("exposure", "row.dump", *TIMED)
    assert made.returncode == 0, made.stderr
    assert "3 single frames, not sums of impulses" in " ".join(made.stdout.split())
    assert "frames are up to 0.2 s apart, too far for windows of 0.1 s" in made.stderr
    people = row / "exposure/exposure_people.csv"
    assert column(people, "time_s", id="7") == [0.0, 0.2]
    assert column(people, "time_s", id="4") == [0.2, 0.4]
    assert column(people, "contact_largest_N", id="5") == pytest.approx([300, 450, 450], rel=1e-6)
    forces: dict[tuple[str, str], float] = {}
    for one in table(row / "contacts.csv"):
        size = float(one["force_N"])
        for who in [one["first"]] + [one["second"]] * (one["is_wall"] == "0"):
            forces[one["time_s"], who] = forces.get((one["time_s"], who), 0.0) + size
    found = {(one["time_s"], one["id"]): float(one["contact_sum_N"]) for one in table(people)}
    assert found == pytest.approx(forces, rel=1e-9)
    walls = column(row / "exposure/exposure_walls.csv", "load_N")
    assert walls == pytest.approx([450, 600, 450], rel=1e-6)
    limits = row / "exposure/exposure_limits.csv"
    # 450 and 450 N are above 400 N in the last two frames, each of which stands for 0.2 s
    assert column(limits, "longest_s", limit="flow_may_be_unstable", id="5") == [pytest.approx(0.4)]


def test_centimetres_give_the_same_percussions(percussions, row):
    (row / "cm.dump").write_text(text(100.0))
    assert percussions("exposure", "cm.dump", *TIMED, "--unit", "cm").returncode == 0
    walls = column(row / "exposure/exposure_walls.csv", "load_N")
    assert walls == pytest.approx([450, 600, 450], rel=1e-6)


def test_a_film_of_a_dump_with_its_own_forces(percussions, row):
    (row / "row_contacts.dump").write_text(own())
    made = percussions("film", "row.dump", *TIMED)
    assert made.returncode == 0, made.stderr
    film = row / "film/film.csv"
    assert column(film, "walls_N", model="percussions") == pytest.approx([450, 600, 450], rel=1e-6)
    assert column(film, "walls_N", model="own") == pytest.approx([405, 540, 405])
    assert column(film, "people", model="own") == [3, 4, 3]
    page = (row / "film/film.html").read_text()
    assert "3 frames of row.dump" in page
    assert "Own forces are" in page


def test_a_dump_compared_with_its_own_forces_and_with_another(percussions, row):
    (row / "mine.dump").write_text(own())
    made = percussions("compare", "row.dump", *TIMED, "--contacts", "mine.dump")
    assert made.returncode == 0, made.stderr
    frames = row / "compare/row_own_frames.csv"
    assert column(frames, "contacts_both") == [3, 4, 3]
    assert column(frames, "sum_difference") == pytest.approx([1 / 0.9 - 1] * 3, rel=1e-6)
    assert column(frames, "person_relative_difference") == pytest.approx([1 / 9] * 3, rel=1e-6)
    contacts = row / "compare/row_own_frame_contacts.csv"
    assert column(contacts, "second_run_x_N", first="7", is_wall="1") == pytest.approx([450, 600])
    # another dump of the crowd, without the middle frame, and with one who has gone
    rows = row_of([7, 5, 3])[:2]
    (row / "less.dump").write_text(frame(0, rows) + frame(4, row_of(CROWDS[2])))
    assert percussions("compare", "row.dump", "less.dump", *TIMED).returncode == 0
    frames = row / "compare/less_frames.csv"
    assert column(frames, "time_s") == [0.0, 0.4]
    assert column(frames, "first_walls_N") == pytest.approx([450, 450], rel=1e-6)
    assert column(frames, "second_walls_N") == pytest.approx([300, 450], rel=1e-6)


def test_a_frame_without_people_and_files_of_one_name(percussions, row):
    """Frames 0.1 s apart are not too far for windows of 0.1 s."""
    (row / "a").mkdir()
    rows = row_of([7, 5, 3])
    for name, last in (("gap.dump", rows), ("a/gap.dump", rows[:1])):
        frames = (frame(step, now) for step, now in enumerate((rows, [], rows, last)))
        (row / name).write_text("".join(frames))
    assert percussions("film", "gap.dump", *TIMED).returncode == 0
    assert column(row / "film/film.csv", "people") == [3, 0, 3, 3]
    made = percussions("exposure", "gap.dump", *TIMED)
    assert (made.returncode, made.stderr) == (0, "")
    walls = column(row / "exposure/exposure_walls.csv", "load_N")
    assert walls == pytest.approx([450, 0, 450, 450], rel=1e-6)
    made = percussions("compare", "gap.dump", "gap.dump", "a/gap.dump", *TIMED)
    assert made.returncode == 0, made.stderr
    for name, last in (("gap", 450), ("gap_2", 150)):
        walls = column(row / f"compare/{name}_frames.csv", "second_walls_N")
        assert walls == pytest.approx([450, 0, 450, last], rel=1e-6)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["film", "row.dump"], "row.dump: its frames have no times. Give --time-step"),
        (["film", "row.dump", "--mass", 75], "--mass: of heads"),
        (["film", "thin.dump", *TIMED], "thin.dump: missing columns: radius"),
        (
            ["film", "row.dump", *TIMED, "--contacts", "row.dump"],
            "row.dump, line 3: not the head of a frame",
        ),
        (["film", "row.dump", *TIMED, "--contacts", "odd.dump"], "line 11: a contact of 5 and 9"),
        (["film", "row.dump", *TIMED, "--contacts", "late.dump"], "late.dump: step 0 of row.dump"),
        (["film", "row.dump", *TIMED, "--contacts", "odd.dump", "--unit", "cm"], "in N and m only"),
        (["exposure", "row.dump", "--time-step", 0.1], "are impulses (N·s) of measured velocities"),
        (["exposure", "row.dump", *TIMED, "--frames", "1"], "row.dump: one frame only"),
        (
            ["exposure", "row.dump", *TIMED, "--sensors", "mine.toml"],
            "--sensors: row.dump is no run",
        ),
        (["exposure", "heads.txt", "--unit", "m"], "heads.txt: it holds no walls. Give --room"),
        (["compare", "row.dump", *TIMED], "row.dump: nothing to compare with"),
        (["compare", "row.dump", "heavy.dump", *TIMED], "at 0 s the mass of disk 3 is 75 and 80"),
        (["compare", "row.dump", "row.dump", "--window", 1], "--window: only of runs"),
        (["compare", "row.dump", "."], ".: a folder. Give runs only, or files only"),
        (["film", "nowhere.sqlite"], "nowhere.sqlite: no geometry of JuPedSim"),
        (["film", "nowhere.h5"], "nowhere.h5: no geometry: attribute wkt_geometry"),
        (["film", "nowhere.h5", "--contacts", "odd.dump"], "--contacts: of a dump"),
        (["film", "holds.h5", "--room", "far.toml"], "holds.h5: door: "),
        (
            ["film", "holds.h5", "--frame-rate", 50],
            "--frame-rate 50: the file states 10 per second",
        ),
        (["film", "broken.h5", "--room", "far.toml"], "broken.h5: "),
        (["exposure", "late_cm.dump", *TIMED], "20 m in the middle, which is no person"),
        (["exposure", "town.txt", "--room", "far.toml"], "town.txt: states no unit"),
    ],
)
def test_what_no_command_can_take_is_one_line(refused, row, words, message):
    rows = [(i, f, 0.5 * i, 0.1 * f) for i in (1, 2, 3) for f in range(5)]
    base_of(row / "nowhere.sqlite", rows)
    archive(row / "nowhere.h5", rows)
    archive(row / "holds.h5", rows, floor=FLOOR)
    archive(row / "broken.h5", rows, floor="POLYGON ((oops))")
    (row / "late_cm.dump").write_text(frame(0, []) + frame(1, row_of([7, 5], 100.0)))
    (row / "town.txt").write_text("# framerate: 10\n# in Mannheim, in m/s\n1 0 0 0\n")
    (row / "far.toml").write_text(ROOM)
    (row / "heads.txt").write_text("# framerate: 10\n1 0 0 0\n")
    (row / "thin.dump").write_text(text().replace("radius", "size"))
    (row / "odd.dump").write_text(own().replace("\n5 7 0", "\n5 9 0"))
    (row / "late.dump").write_text(
        own().split("ITEM: TIMESTEP\n4", 1)[1].join(["ITEM: TIMESTEP\n4", ""])
    )
    (row / "heavy.dump").write_text(text(mass=80))
    assert message in refused(*words)


@pytest.mark.parametrize("kind", ["sqlite", "h5"])
def test_a_trajectory_with_its_geometry_needs_no_room(tmp_path, kind):
    """Three people walk at 1 m/s into the wall x = 0, in a row: the last of their frames stops them.
    With a door on the other side and a drive they are held at places of their own."""
    rows = [(i, f, -0.2 - 0.4 * i + 0.1 * f, 0.0) for i in (0, 1, 2) for f in range(-10, 1)]
    rows = [(i, f + 10, x, y) for i, f, x, y in rows]
    if kind == "sqlite":
        base_of(tmp_path / "t.sqlite", rows, geometry=[FLOOR])
    else:
        archive(tmp_path / "t.h5", rows, KINDS, floor=FLOOR)
    path = tmp_path / f"t.{kind}"
    source = open_any(path, FileOptions(radius=0.2))
    assert len(source.scene.walls) == 4
    (last,) = source.frames("10")
    assert last.found.unit == "N·s"
    on_wall = last.found.contacts.is_wall
    # all of m u: 3 · 75 kg · 1 m/s
    assert np.hypot(*last.found.pressing[on_wall].T) == pytest.approx([225.0], rel=1e-4)
    room = ROOM.replace("5.0", "-4.0").replace("[1.0", "[-1.0").replace("0.1]", "0.4]")
    (tmp_path / "door.toml").write_text(room + "clearance_m = 0.1\n")
    source = open_any(path, FileOptions(radius=0.2, room=tmp_path / "door.toml"))
    assert len(source.scene.walls) == 5  # the door is open
    (last,) = source.frames("10")
    assert last.found.unit == "N"
    assert last.found.largest == pytest.approx(0.0, abs=1e-6)  # they push away from the wall
    if kind == "h5":
        animations = film_heads(Recording.read(path), None, [0.2], FrameRange.parse("10"))
        titles = [row[0] for row in headline_rows(animations)[1][:3]]
        sums = [
            f"sum of percussions on {where} (N·s)"
            for where in ("the most loaded person", "all walls")
        ]
        assert titles == ["largest percussion (N·s)", *sums]
        assert "what stops the measured" in _what(words_of(animations), animations, "t.h5")[-1]


def test_a_trajectory_that_jupedsim_wrote(percussions, tmp_path):
    jps = pytest.importorskip("jupedsim")
    area = [(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 2.0)]
    for end, kind in (("sqlite", "SqliteTrajectoryWriter"), ("h5", "Hdf5TrajectoryWriter")):
        writer = getattr(jps, kind)(output_file=tmp_path / f"t.{end}", every_nth_frame=5)
        model = jps.CollisionFreeSpeedModel()
        walk = jps.Simulation(model=model, geometry=area, trajectory_writer=writer)
        stage = walk.add_exit_stage([(3.5, 0.5), (4.0, 0.5), (4.0, 1.5), (3.5, 1.5)])
        journey = walk.add_journey(jps.JourneyDescription([stage]))
        for x in (0.5, 1.0, 1.5):
            walk.add_agent(
                jps.CollisionFreeSpeedModelAgentParameters(
                    journey_id=journey, stage_id=stage, position=(x, 1.0)
                )
            )
        for _ in range(200):
            walk.iterate()
        writer.close()
        made = percussions("film", f"t.{end}", "--radius", "0.2", "--out", end)
        assert made.returncode == 0, made.stderr
    assert column(tmp_path / "sqlite/film.csv", "walls_Ns") == column(
        tmp_path / "h5/film.csv", "walls_Ns"
    )


def test_a_film_of_a_room_without_doors_says_nothing_of_a_door(percussions, row):
    room = "".join(line for line in (WALL + ROOM).splitlines(True) if "door" not in line)
    (row / "room.toml").write_text(room.replace('aim = "centre"\n', ""))
    made = percussions("film", "row.dump", *TIMED)
    assert made.returncode == 0, made.stderr
    assert "of the door" not in made.stdout
    assert "pressure_door_N_per_m" not in (row / "film/film.csv").read_text()


@pytest.mark.long
def test_a_film_shows_the_mean_and_nine_tenths_of_all_admissible_states(percussions, tmp_path):
    """A flower of seven: spokes s are even on [0, m U], and the rim has m U − s. So the largest is
    max(s, m U − s), and who bears most max(6 s, 2 m U − s)."""
    angle, load = np.pi / 3 * np.arange(6), 150.0
    rim = np.column_stack([np.cos(angle), np.sin(angle)])
    rows = [[2 + i, *(0.5 * at), 0.25, 75, *(-2.0 * at)] for i, at in enumerate(rim)]
    made = "".join(frame(step, [[1, 0, 0, 0.25, 75, 0, 0], *rows]) for step in range(3))
    (tmp_path / "flower.dump").write_text(made)
    (tmp_path / "wall.toml").write_text(WALL.replace("0.0, ", "-9.0, "))
    how = ("flower.dump", "--room", "wall.toml", "--time-step", 1, "--frames", "0", "--openness")
    done = percussions("film", *how, "ensemble")
    assert done.returncode == 0, done.stderr
    (row,) = table(tmp_path / "film" / "film.csv")
    fraction = np.linspace(0, 1, 100001)
    laws = {
        "contact_largest": np.maximum(fraction, 1 - fraction),
        "person_largest": np.maximum(6 * fraction, 2 - fraction),
        "walls": 0 * fraction,
    }
    for name, law in laws.items():
        found = [float(row[f"{name}{end}_Ns"]) / load for end in ("", "_low", "_high")]
        expected = [law.mean(), *np.quantile(law, [0.05, 0.95])]
        assert found == pytest.approx(expected, abs=0.1 * np.ptp(law) + 1e-9), name
    page = (tmp_path / "film" / "film.html").read_text()
    assert "and 90 % of admissible percussions" in " ".join(page.split())
    assert percussions("film", *how, "ranges").returncode == 0
    (row,) = table(tmp_path / "film" / "film.csv")
    assert float(row["contact_largest_high_Ns"]) == pytest.approx(load)
