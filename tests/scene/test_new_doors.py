"""`percussions new`: several doors, streams, what stands inside, floors of other programs."""

import json

import numpy as np
import pytest
import shapely
from scipy.optimize import linear_sum_assignment

from analysis.scene import (
    Crowd,
    Doorway,
    Inside,
    SceneError,
    from_geometry,
    opposing,
    read_floor,
    read_scene,
    room,
)
from analysis.scene.anthropometry import Varied
from analysis.scene.waiting import _shared_out
from nscd import find_contacts

TWO = [Doorway(ends=((0, -3), (0, -2)), share=2), Doorway(ends=((-4, 4), (-5.2, 4)), share=1)]


def parted(scene):
    """People by the door that they go to, in the order of the doors."""
    return [mine for _, mine in scene.drive.exits(scene.snapshot.ids)]


def test_each_door_has_its_share_of_those_who_are_near_it():
    scene = room("two", 10.0, 8.0, TWO, Crowd(people=120))
    one, two = parted(scene)
    assert (one.sum(), two.sum()) == (80, 40)
    position = shapely.points(scene.snapshot.position)
    far = np.array([shapely.distance(position, shapely.LineString(way.ends)) for way in TWO])
    # nobody would gain by a change of places with somebody of the other door
    assert (far[1] - far[0])[one].min() >= (far[1] - far[0])[two].max() - 0.2
    doors = scene.door()
    ways = [shapely.LineString(pair) for pair in zip(doors.start, doors.end, strict=True)]
    assert [way.length for way in ways] == pytest.approx([1.0, 1.2])
    walls = scene.wall_segments()
    length = np.hypot(*(walls.end - walls.start).T).sum()
    assert length == pytest.approx(2 * (10 + 8) - 2.2)
    goal = scene.drive.desired_velocity(scene.snapshot.position, scene.snapshot.ids)
    assert (goal[two, 1] > 0).all()
    assert scene.drive.goals[0].outward == (0.0, 1.0)
    assert scene.notes.splitlines()[-1].startswith("80 go to door 1, 40 go to door 2")


def test_streams_by_command(percussions, tmp_path):
    words = ("new", "flow", "--room", "12x3", "--stream", "--people", 60, "--duration", 0.2)
    made = percussions(*words)
    assert made.returncode == 0, made.stderr
    scene = read_scene(tmp_path / "flow.toml")
    right, left = parted(scene)
    x = scene.snapshot.position[:, 0]
    assert (right.sum(), left.sum()) == (30, 30)
    assert x[right].max() < -5.9
    assert x[left].min() > -6.1
    assert len(scene.walls) == 2  # open at both ends
    run = percussions("run", "flow.toml", "--engine", "rigid")
    assert run.returncode == 0, run.stderr
    narrow = room("narrow", 12.0, 3.0, opposing(12.0, 3.0, 1.0), Crowd(people=20))
    assert len(narrow.walls) == 6


def test_blocks_and_barriers_by_command(percussions, tmp_path):
    words = ["new", "full", "--room", "8x6", "--door", 1, "--people", 80]
    made = percussions(*words, "--block=-3,-1,-2,1", "--barrier=-5,-2,-5,2")
    assert made.returncode == 0, made.stderr
    scene = read_scene(tmp_path / "full.toml")
    disks, walls = scene.snapshot, scene.wall_segments()
    assert len(scene.walls) == 5 + 4 + 1
    assert find_contacts(disks, walls, tolerance=1e-3).gap.min() > -1e-6
    block = shapely.box(-3, -1, -2, 1)
    assert (shapely.distance(block, shapely.points(disks.position)) >= disks.radius - 1e-6).all()
    assert scene.drive.clearance_m is None  # there is room beside the block


def test_shares_decide_who_waits_where():
    """Each wing of the floor has the people of its own door, as many as they are."""
    ell = shapely.Polygon([(0, 0), (10, 0), (10, 4), (4, 4), (4, 10), (0, 10)])
    doors = [Doorway(ends=((1, 10), (2, 10))), Doorway(ends=((10, 1), (10, 2)), share=4)]
    scene = from_geometry("ell", ell, doors, Crowd(people=80))
    assert scene.drive.clearance_m is None
    few, many = parted(scene)
    assert (few.sum(), many.sum()) == (16, 64)
    assert scene.snapshot.position[few, 1].min() > 7
    assert scene.snapshot.position[many, 0].min() > 5


def test_cells_are_shared_out_at_the_least_price():
    random = np.random.default_rng(3)
    for _ in range(5):
        cost = random.uniform(0, 3, (3, 60)) + 6 * (random.uniform(size=(3, 60)) < 0.4)
        wanted = np.array([25, 10, 5])
        going = _shared_out(cost, wanted)
        counts = np.bincount(going + 1, minlength=4)[1:]
        assert np.abs(counts - wanted).max() <= 1
        rows = np.repeat(cost, counts, axis=0)
        minimum = rows[linear_sum_assignment(rows)].sum()
        used = going >= 0
        assert cost[going[used], np.flatnonzero(used)].sum() == pytest.approx(minimum)


def test_doors_as_long_as_the_floor_share_out_whole_and_broken_columns():
    column = np.repeat(np.arange(30.0), 10)  # before such a door a whole column is as far from it
    cost = np.stack([column, 29 - column])
    for wanted in (np.array([35, 12]), np.array([250, 19]), np.array([150, 150])):
        going = _shared_out(cost, wanted)
        for row, number in enumerate(wanted):
            mine = cost[row, going == row]
            assert sorted(mine) == sorted(cost[row])[:number]


@pytest.mark.parametrize(("people", "seed"), [(2, 3), (5, 6), (10, 7)])
def test_a_small_stream_has_room_enough(people, seed):
    doors = [
        Doorway(ends=((0, 0), (0, 10)), start=shapely.box(-4, 0, 0, 10), share=people),
        Doorway(ends=((-30, 0), (-30, 10)), start=shapely.box(-30, 0, -26, 10), share=100),
    ]
    crowd = Crowd(people=100 + people, varied=Varied(radius_share=0.1, seed=seed))
    scene = from_geometry("few", shapely.box(-30, 0, 0, 10), doors, crowd)
    assert [mine.sum() for mine in parted(scene)] == [people, 100]
    assert find_contacts(scene.snapshot, tolerance=0.0).gap.min(initial=0.0) > -1e-6


def test_a_door_narrower_than_a_disk_is_said(percussions):
    made = percussions("new", "slit", "--room", "8x6", "--door", 0.3, "--people", 9)
    assert made.returncode == 0
    assert made.stderr.startswith("warning: the door (0.3 m) is narrower than the widest disk (0.4")
    assert len(made.stderr.splitlines()) == 1


def shape(x, y, width, height):
    return {"type": "RECTANGLE", "x": x, "y": y, "width": width, "height": height}


def vadere(**changes):
    """A hall of 20 × 10 m with a pillar, a target at each end and a source before each."""
    corners = [(9, 4), (11, 4), (10, 6)]
    triangle = {"type": "POLYGON", "points": [{"x": x, "y": y} for x, y in corners]}
    topography = {
        "attributes": {"bounds": shape(0, 0, 21, 11), "boundingBoxWidth": 0.5, "bounded": True},
        "obstacles": [{"id": 1, "shape": triangle}],
        "targets": [
            {"id": 7, "shape": shape(0.5, 4, 1, 2)},
            {"id": 8, "shape": shape(19.5, 4, 1, 3)},
        ],
        "sources": [
            {"id": 3, "shape": shape(14, 2, 4, 7), "targetIds": [7], "spawnNumber": 30},
            {
                "id": 4,
                "shape": shape(2, 2, 4, 7),
                "targetIds": [8],
                "spawner": {"constraintsElementsMax": 10},
            },
        ],
    }
    return {"name": "hall", "scenario": {"topography": topography | changes}}


def test_a_vadere_scenario_has_its_doors(percussions, tmp_path):
    (tmp_path / "hall.scenario").write_text(json.dumps(vadere()))
    made = percussions("new", "hall", "--geometry", "hall.scenario", "--people", 40)
    assert made.returncode == 0, made.stderr
    scene = read_scene(tmp_path / "hall.toml")
    west, east = parted(scene)
    assert (west.sum(), east.sum()) == (30, 10)
    x = scene.snapshot.position[:, 0]
    assert x[west].min() > 13.9
    assert x[east].max() < 6.1
    first, second = scene.drive.doors
    assert sorted([first.door_start_m, first.door_end_m]) == [(1.5, 4.0), (1.5, 6.0)]
    assert first.outward == (-1.0, 0.0)
    assert np.hypot(*np.subtract(*second.door)) == pytest.approx(3.0)
    floor = read_floor(tmp_path / "hall.scenario").polygon
    assert floor.area == pytest.approx(20 * 10 - 2 - 3 - 2)


def circle(x, y):
    return {"type": "CIRCLE", "center": {"x": x, "y": y}, "radius": 0.5}


BAD = {
    "shape": ({"obstacles": [{"id": 5, "shape": {"type": "LINE"}}]}, "obstacle 5: shape 'LINE'"),
    "far": (
        {"targets": [{"id": i, "shape": circle(15, 5)} for i in (7, 8)]},
        "target 7: it does not lie at the",
    ),
    "missing": ({"targets": [{"id": 7}]}, "topography: KeyError: 'shape'"),
    "bounds": ({"attributes": {}}, "topography: KeyError: 'bounds'"),
    "no_target": ({"targets": []}, "source 3: targetIds: [7]. One target is needed"),
    "no_sources": ({"sources": []}, None),
}


@pytest.mark.parametrize("bad", BAD)
def test_a_scenario_that_is_no_room_is_one_line(refused, tmp_path, bad):
    change, says = BAD[bad]
    (tmp_path / "hall.scenario").write_text(json.dumps(vadere(**change)))
    message = refused("new", "hall", "--geometry", "hall.scenario", "--people", 40)
    where = "hall.scenario: " if says else "door: hall.scenario has none"
    assert message.startswith(f"percussions: {where}{says or ''}")


def test_people_of_a_source_stand_all_over_it(tmp_path):
    """Behind a gap they stood in the line of sight; uniform over 6 m they scatter by 6/√12 m."""
    walls = [{"id": n, "shape": shape(11, y, 0.5, 4)} for n, y in enumerate((0.5, 6.5))]
    changes = {
        "obstacles": walls,
        "sources": [{"id": 3, "shape": shape(2, 2, 6, 6), "targetIds": [8]}],
    }
    (tmp_path / "gap.scenario").write_text(json.dumps(vadere(**changes)))
    floor = read_floor(tmp_path / "gap.scenario")
    position = from_geometry("gap", floor.polygon, floor.doors, Crowd(people=60)).snapshot.position
    assert position.std(0) == pytest.approx([6 / np.sqrt(12)] * 2, rel=0.2)
    assert position.mean(0) == pytest.approx([5, 5], abs=4 * 1.73 / np.sqrt(60))


def test_a_floor_that_is_packed_and_cut_off_is_damaged(tmp_path):
    """An end of file inside of it was taken for an interrupt."""
    (tmp_path / "hall.scenario").write_bytes(b"BZh91AY&S")
    with pytest.raises(SceneError, match=r"hall\.scenario: damaged: "):
        read_floor(tmp_path / "hall.scenario")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("--door 0,1,0,2 --door 0,1.5,0,2.5", "door: ((0.0, 1.5), (0.0, 2.5)) m overlaps another"),
        ("--door 0,1,0,2:0", "door: shares [0.0]. Numbers above 0 are needed"),
        ("--door 0,1,0,2:x", "door share: 'x'. Numbers as m are needed"),
        ("--door 0,1,0,2 --door 0,-1,0,-2:1e-9", "door: nobody of 9 goes to door 2. A larger"),
        ("", "door: its width or its ends are needed (--door)"),
        ("--door 1 --door 2", "door: '1'. Numbers as m,m,m,m are needed"),
        ("--stream --door 1 --door 2", "stream: at most one --door is needed, the width of both"),
        ("--stream --door 9", "door: 9 m. It needs 0 to the side of 6 m"),
        ("--door 1 --block=-1,1,-1,2", "block: -1,1,-1,2. Two opposite corners are needed"),
        ("--door 1 --barrier=-1,1,1,2", "barrier: a part of it is not on the floor"),
        (
            "--door 1 --block=-6,-9,-5,9",
            "area: one polygon in one piece is needed, not MultiPolygon",
        ),
    ],
)
def test_what_cannot_be_made_is_one_line(refused, words, says):
    message = refused("new", "bad", "--room", "8x6", "--people", 9, *words.split())
    assert message.startswith(f"percussions: {says}")


def test_a_start_that_is_too_small():
    small = Doorway(ends=((0, -1), (0, 1)), start=shapely.box(-2, -1, -1, 0))
    with pytest.raises(SceneError, match=r"people: 30 of mean radius .* do not fit where they are"):
        room("small", 8.0, 6.0, [small], Crowd(people=30))
    with pytest.raises(SceneError, match="Two opposite corners"):
        from_geometry("x", shapely.box(0, 0, 9, 9), [small], Crowd(people=3), inside=Inside(
            blocks=[(1, 1, 1, 2)]))  # fmt: skip
