"""Loads and times above limits: closed forms of a pressed row, and files of limits that are
wrong."""

import csv

import numpy as np
import pytest

from analysis.dumps import DumpError
from analysis.dumps.windows import Window
from analysis.engines.run import simulate
from analysis.scene.scene import Wall
from analysis.studies.exposure.limits import QUANTITIES, Limit, LimitError, known_limits
from analysis.studies.exposure.loads import (
    RunLoads,
    exposure_rows,
    loads_of,
    read_exposure,
    sources_of,
    values_of,
    write_exposure,
)
from analysis.studies.film.page import force_notes
from tests.crowds import OWN_LIMIT, disks_at, drive_to, scene_at

PUSH, RADIUS, PEOPLE = 150.0, 0.2, 5


def row(radius=RADIUS):
    """Five people in a row against a wall of 0.8 m, who all push with 150 N."""
    reach = -radius * (2 * np.arange(PEOPLE) + 1)
    snapshot = disks_at(np.column_stack([reach, np.zeros(PEOPLE)]), radius=radius)
    return scene_at(
        snapshot, [((0.0, -0.4), (0.0, 0.4))], name="row", time=0.5,
        drive=drive_to((5.0, -0.1), (5.0, 0.1), speed=1.0, aim="centre"),
        contact={"stiffness_N_per_m": 1e6, "restitution": 0.1},
        run={"duration_s": 0.5, "frames": 10},
    )  # fmt: skip


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("row") / "run"
    simulate(row(), "rigid", folder)
    return folder


def test_the_load_on_the_last_of_a_row_is_the_push_of_all(pressed):
    """Contact j carries j pushes; the last person bears n + (n − 1) of them in sum, is at rest with
    the resultant that undoes the own push, and the wall of 0.8 m carries n over its length."""
    found = read_exposure(pressed)
    assert found.duration == pytest.approx(np.full(5, 0.1))
    order = np.arange(PEOPLE)  # 0 stands at the wall
    both = PUSH * (2 * (PEOPLE - order) - 1)
    expected = {
        "contact_largest": PUSH * (PEOPLE - order),
        "contact_sum": both,
        "resultant": np.full(PEOPLE, PUSH),
        "pressure": both / (2 * np.pi * RADIUS),
        "wall_load": [PUSH * PEOPLE],
        "wall_line_load": [1e-3 * PUSH * PEOPLE / 0.8],
    }
    for key, one in expected.items():
        assert found.loads[key] == pytest.approx(np.tile(one, (5, 1)), rel=1e-6), key


def limit(number, quantity="contact_largest", **rest):
    words = {"what": "x", "population": "x", "source": "x", "read": "first-hand", "name": "mine"}
    return Limit(number=number, unit=QUANTITIES[quantity].unit, quantity=quantity, **words | rest)


def test_times_above_a_limit(pressed):
    found = read_exposure(pressed, window_s=0.2)
    assert found.duration[0] == pytest.approx(0.2)
    total, longest = found.time_above(limit(PUSH * 2.5))
    assert total == pytest.approx([0.4, 0.4, 0.4, 0, 0])
    assert longest == pytest.approx(total)
    assert found.loads["contact_largest"].max() == pytest.approx(PUSH * PEOPLE)
    with pytest.raises(DumpError, match="shorter than 3 s"):
        read_exposure(pressed, window_s=3.0)


def test_a_break_ends_a_stretch_but_not_the_sum():
    forces = np.array([[700.0, 100], [700, 700], [100, 700], [700, 700]])
    found = RunLoads(
        scene=row(),
        ids=[1, 2],
        time=0.1 * np.arange(1, 5),
        duration=np.full(4, 0.1),
        loads={"contact_largest": forces},
        values={},
    )
    total, longest = found.time_above(limit(623.0))
    assert total == pytest.approx([0.3, 0.3])
    assert longest == pytest.approx([0.2, 0.3])


def test_the_line_load_is_that_of_the_worst_metre():
    """Of people at 0, 0.9, 1.8 and 4 m along a wall who press with 1, 2, 3 and 4 kN, two at most
    are within a metre: 2 + 3 kN."""
    along = np.array([0.0, 0.9, 1.8, 4.0])
    now = disks_at(np.column_stack([-0.2 * np.ones(4), along]), radius=0.2)
    scene = row().model_copy(
        update={
            "snapshot": now,
            "drive": None,
            "walls": (Wall(name="long", start_m=(0.0, 0.0), end_m=(0.0, 5.0)),),
        }
    )
    keys = np.column_stack([now.ids, np.ones(4, int), np.ones(4, int)])
    impulse = np.column_stack([100.0 * np.array([1, 2, 3, 4]), np.zeros(4)])
    loads = loads_of(scene, Window(start=0.0, end=0.1, now=now, keys=keys, impulse=impulse))
    assert loads["wall_line_load"] == pytest.approx([5.0])
    assert loads["wall_load"] == pytest.approx([10_000.0])
    assert not loads["density"].size


def test_a_person_of_two_disks_bears_what_both_do():
    """Two dumbbells, each before the other's disks and one at a wall, by hand."""
    positions = [[0.0, 0.0], [0.4, 0.0], [0.4, 0.3], [0.0, 0.3]]
    now = disks_at(positions, (1.0, 0.0), 0.2, 30.0).joined([9, 5, 5, 9])
    keys = np.array([[1, 1, 1], [1, 2, 0], [3, 4, 0]])
    impulse = np.array([[-70.0, 0.0], [30.0, 0.0], [-40.0, 5.0]])
    window = Window(start=0.0, end=0.1, now=now, keys=keys, impulse=impulse)
    scene = row().model_copy(update={"snapshot": now})
    loads = loads_of(scene, window)
    assert loads["contact_largest"] == pytest.approx([700.0, np.hypot(400, 50)])
    assert loads["contact_sum"] == pytest.approx(
        [1000 + np.hypot(400, 50), 300 + np.hypot(400, 50)]
    )
    assert loads["resultant"] == pytest.approx([50.0, np.hypot(700, 50)])
    outline = 4 * 0.2 * (np.pi - np.arccos(0.3 / 0.4))
    assert loads["pressure"] == pytest.approx(loads["contact_sum"] / outline, rel=1e-3)
    people = window.of_people()
    assert people.now.ids.tolist() == [1, 2]
    np.testing.assert_allclose(people.now.position, [[0.0, 0.15], [0.4, 0.15]], atol=1e-15)
    np.testing.assert_allclose(people.summed().impulse, [[-70.0, 0.0], [70.0, -5.0]])
    assert people.of_people() is people
    assert values_of(scene, window, loads)["walls"] == pytest.approx(700.0)


def test_density_is_that_of_pedpy():
    """Where heads stand in the half disk before the door, PedPy counts the same density."""
    import pandas as pd
    import pedpy
    import shapely

    scene = row()
    random = np.random.default_rng(3)
    positions = np.array([5.0, 0.0]) + random.uniform(-3, 3, (40, 2))
    now = disks_at(positions, random.normal(size=(40, 2)), 0.2)
    empty = {"keys": np.empty((0, 3), int), "impulse": np.empty((0, 2))}
    crowd = loads_of(scene, window := Window(start=0.0, end=0.1, now=now, **empty))
    half = shapely.Point(5.0, 0.0).buffer(2.0, quad_segs=400) & shapely.box(0, -9, 5.0, 9)
    table = pd.DataFrame({"id": now.ids, "frame": 0, "x": positions[:, 0], "y": positions[:, 1]})
    trajectory, area = pedpy.TrajectoryData(table, frame_rate=1.0), pedpy.MeasurementArea(half)
    measured = pedpy.compute_classic_density(traj_data=trajectory, measurement_area=area)
    assert crowd["density"] == pytest.approx([measured["density"].iloc[0]], rel=1e-4)
    # some go to another door: of two half disks that of the fuller one
    far = {"people": (1, 20), "door_start_m": (0.0, 5.0), "door_end_m": (1.0, 5.0)}
    drive = drive_to((5.0, -0.1), (5.0, 0.1), goals=[{**far, "outward": (0.0, 1.0)}])
    two = scene.model_copy(update={"drive": drive})
    found = values_of(two, window, loads_of(two, window))
    assert found["density_door"] == pytest.approx(measured["density"].iloc[0], rel=1e-4)
    spread = now.velocity[shapely.contains_xy(half, positions)].var(axis=0).sum()
    assert crowd["crowd_pressure"] == pytest.approx(crowd["density"] * spread)


def test_tables_hold_every_person_wall_and_limit(pressed):
    found, known = read_exposure(pressed), known_limits()
    files = {
        path.name: list(csv.DictReader(path.read_text().splitlines()))
        for path in write_exposure(found, known, pressed)
    }
    assert len(files["exposure_people.csv"]) == 5 * PEOPLE
    assert len(files["exposure_walls.csv"]) == 5
    persons = [one for one in known if QUANTITIES[one.quantity].of == "person"]
    rows = [row for row in files["exposure_limits.csv"] if row["of"] == "person"]
    assert len(rows) == PEOPLE * len(persons)
    (first,) = (r for r in rows if r["limit"] == "chest_bar_men" and r["id"] == "1")
    assert float(first["time_above_s"]) == pytest.approx(0.5)
    assert first["source"] == "Evans & Hayden 1971, quoted by Lee & Hughes 2006"
    shown = {row[0]: row for row in exposure_rows(found, known)}
    assert shown["chest_bar_men"][2:4] == ["1 of 5", "0.5 s"]
    assert shown["asphyxia_minutes"][3] == "0 of 240 s"
    *below, signs = sources_of(known)
    assert "Evans & Hayden 1971†" in below[0]
    assert sorted(name for line in below for name in line.split(":")[0].split(", ")) == sorted(shown)
    assert "†" in signs


def test_every_shipped_limit_says_where_it_is_from():
    known = known_limits()
    # no source says how long a wall its sum on a wall is of
    assert not [one.name for one in known if one.quantity == "wall_load"]
    assert {(one.number, one.unit) for one in known} >= {
        (623, "N"), (1112, "N"), (6227, "N"), (2000, "N"), (9000, "N"), (400, "N"),
        (715, "N"), (2, "kN/m"), (5, "kN/m"),
    }  # fmt: skip


def test_users_add_and_replace_limits(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(OWN_LIMIT + OWN_LIMIT.replace("mine", "chest_bar_men"))
    known = {one.name: one for one in known_limits([path])}
    assert known["mine"].cited == "my report, 2026"
    assert known["chest_bar_men"].number == 500
    assert len(known) == len(known_limits()) + 1
    # of a limit that the first screen of a report names
    path.write_text(OWN_LIMIT.replace("mine", "asphyxia_minutes"))
    (message,) = force_notes({}, "Simulated: 1 s", (path,))
    assert "500 N may kill, 6\u202f227 N in 15 s (estimates). Simulated: 1 s." in message
    with pytest.raises(LimitError, match="no such file"):
        known_limits([tmp_path / "none.toml"])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (OWN_LIMIT, OWN_LIMIT + OWN_LIMIT, "two limits are called mine"),
        ('"mine"', '"barrier_2_m"', "'barrier_2_m' replaces one of the quantity wall_line_load"),
        ('unit = "N"', 'unit = "kN"', r"'mine': unit 'kN', but contact_largest is in N"),
        ('unit = "N"', 'unit = "N/m"', r"unit 'N/m', but contact_largest is in N"),
        ('source = "my report, 2026"\n', "", r"limit 'mine' source: is missing"),
        ('"my report, 2026"', '" "', r"limit 'mine' source:"),
        ("500.0", "nan", r"limit 'mine' number:"),
        ("500.0", "-5.0", r"limit 'mine' number:.*greater than 0"),
        ("500.0", '"500"', r"limit 'mine' number:.*valid number"),
        ("contact_largest", "stress", r"quantity 'stress'. There are: contact_largest"),
        ("first-hand", "second-hand", r"quoted_by is needed"),
        ("first-hand", "hearsay", r"limit 'mine' read:"),
        ('what = "my own"', "whom = 1", r"limit 'mine' what: is missing"),
        ("[[limit]]", "[[limits]]", r"limit: is missing"),
        ("[[limit]]", "[[limit", r"mine.toml: .*line 2"),
        ('"mine"', '"my own"', r"limit 'my own' name:"),
    ],
)  # fmt: skip
def test_a_wrong_file_names_the_limit_and_the_key(tmp_path, old, new, message):
    path = tmp_path / "mine.toml"
    path.write_text(OWN_LIMIT.replace(old, new))
    with pytest.raises(LimitError, match=message) as found:
        known_limits([path])
    assert str(path) in str(found.value)
