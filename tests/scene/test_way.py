"""Ways round corners: lengths against the taut string and a visibility graph, and people who walk
them."""

import importlib
import re
from itertools import pairwise

import numpy as np
import pytest
import shapely
from scipy.sparse.csgraph import dijkstra

from analysis.engines.programs.rigid import motion_of
from analysis.percussions.setting import Setting
from analysis.scene import Crowd, Doorway, Inside, SceneError, read_scene, room
from analysis.scene.drive import Drive
from analysis.scene.scene import read_room
from analysis.scene.way import way_of
from analysis.support.files import shipped
from nscd import Snapshot, Walls
from tests.crowds import disks_at


def between(*lines):
    ends = np.array([line for points in lines for line in pairwise(points)], float)
    return Walls(start=ends[:, 0].copy(), end=ends[:, 1].copy())


# a corridor of 2 m that turns right at the corner (0, 0)
ELL = between([(0, -8), (0, 0), (-8, 0), (-8, 2), (2, 2), (2, -8)])
DOWN = np.array([[(0, -8), (2, -8), (0, -1)]], dtype=float)


def taut(position, radius):
    """From (n,2) m round a disk at the corner, then straight down to the door."""
    away = np.hypot(*position.T)
    observed = np.arctan2(position[:, 1], position[:, 0]) - np.arccos(radius / away)
    turning = np.sqrt(away**2 - radius**2) + radius * observed + 8.0
    # who is beyond the corner walks straight
    x, y = position.T
    aside = np.maximum(0.0, np.maximum(radius - x, x - (2 - radius)))
    return np.where(observed > 0, turning, np.hypot(aside, y + 8.0))


@pytest.mark.parametrize("clearance", [0.0, 0.15])
def test_the_way_round_a_corner_is_a_taut_string(clearance):
    way = way_of(ELL, DOWN, 0.2, clearance)
    random = np.random.default_rng(1)
    anchor = random.uniform((-7.5, 0.5), (0.0, 1.5), (200, 2))
    column, row = np.floor((anchor - way.origin) / way.cell).T.astype(int)
    middle = way.origin + way.cell * (np.column_stack([column, row]) + 0.5)
    length = way.length[0, row, column]
    assert (length >= taut(middle, 0.98 * 0.2) - 0.01).all()
    assert (length <= taut(middle, 0.2 + clearance) + 0.01).all()


def walked(walls, doors, way, radius, step=0.04):
    """People from all over the floor who walk alone: start, length of the way walked, how near to a
    wall they came; those who have not arrived have an infinite length."""
    lines = shapely.MultiLineString([*np.stack([walls.start, walls.end], axis=1)])
    shapely.prepare(lines)
    x, y = np.meshgrid(*(np.arange(way.origin[i], way.origin[i] + 14, 0.37) for i in (0, 1)))
    position = np.column_stack([x.ravel(), y.ravel()])
    door = shapely.LineString(doors[0, :2])
    faces = shapely.get_parts(shapely.polygonize([*lines.geoms, door]))
    floor = next(face for face in faces if face.boundary.contains(door))
    inside = shapely.contains_xy(floor, position)
    inside &= shapely.distance(shapely.points(position), lines) >= radius
    start = position[inside]
    position, near = start.copy(), np.full(len(start), np.inf)
    length = np.zeros(len(start))
    a, b, outward = doors[0]
    for _ in range(int(60 / step)):
        left = (position - a) @ outward < -1e-9
        left |= way.corner(position, 0)[0]
        if not left.any():
            break
        turning, corner = way.corner(position, 0)
        fraction = np.clip((position - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        to = np.where(turning[:, None], corner, a + fraction[:, None] * (b - a)) - position
        to *= (np.minimum(1.0, step / (np.hypot(*to.T) + 1e-300)) * left)[:, None]
        position, length = position + to, length + np.hypot(*to.T)
        far = np.abs((position - a) @ outward) > 2 * radius
        near[far] = np.minimum(near, shapely.distance(shapely.points(position), lines))[far]
    return start, np.where(left, np.inf, length), near


PILLAR = [(0.6, 0.6), (1.2, 0.6), (1.2, 1.2), (0.6, 1.2), (0.6, 0.6)]
TURNS = between([(0, 0), (0, 2), (6, 2), (6, 8)], [(0, 0), (8, 0), (8, 8)])
UP = np.array([[(6, 8), (8, 8), (0, 1)]], dtype=float)
LEFT = np.array([[(0, 0.2), (0, 1.8), (-1, 0)]], dtype=float)
# a passage that is 2 cm broader than a person
NARROW = between([(2, -8), (2, 7), (0, 7), (0, -8)], [(0, 0), (0.79, 0)], [(1.21, 0), (2, 0)])


@pytest.mark.parametrize(
    ("walls", "doors"),
    [
        (ELL, DOWN),
        (between([(0, -8), (0, 0), (-8, 0), (-8, 2), (2, 2), (2, -8)], PILLAR), DOWN),
        (TURNS, UP),
        (between([(0, 1.8), (0, 4), (6, 4), (6, 0), (0, 0), (0, 0.2)], [(0, 2), (5.45, 2)]), LEFT),
    ],
    ids=["corner", "pillar", "two corners", "end"],
)
def test_who_walks_alone_arrives_on_the_shortest_way_and_touches_nothing(walls, doors):
    way = way_of(walls, doors, 0.2, 0.15)
    start, length, near = walked(walls, doors, way, 0.2)
    assert len(start) > 120
    assert np.isfinite(length).all()
    assert near.min() >= 0.2 - 0.01
    shortest = way.at(start, 0, way.length)
    away = near > 0.3
    assert length[away] == pytest.approx(shortest[away], abs=0.25)


def test_nobody_turns_back_before_a_passage_that_is_hardly_wide_enough():
    """A person at a corner before it can be off the line by half the diagonal of a cell."""
    way = way_of(NARROW, DOWN, 0.2, 0.15)
    _, length, near = walked(NARROW, DOWN, way, 0.2)
    assert np.isfinite(length).all()
    assert near.min() >= 0.2 - way.cell / np.sqrt(2)


def test_lengths_among_random_blocks_are_those_of_a_visibility_graph():
    random = np.random.default_rng(7)
    for _ in range(2):
        low = random.uniform((1, 1), (8, 8), (5, 2))
        blocks = shapely.box(*low.T, *(low + random.uniform(0.5, 2, (5, 2))).T)
        rings = [
            np.array(ring.exterior.coords) for ring in shapely.get_parts(shapely.union_all(blocks))
        ]
        walls = between([(12, 7), (12, 12), (0, 12), (0, 0), (12, 0), (12, 5)], *rings)
        doors = np.array([[(12, 5), (12, 7), (1, 0)]], dtype=float)
        way = way_of(walls, doors, 0.2, 0.0)
        anchor = random.uniform(0.5, 11.5, (60, 2))
        column, row = np.floor((anchor - way.origin) / way.cell).T.astype(int)
        anchor = way.origin + way.cell * (np.column_stack([column, row]) + 0.5)
        lines = shapely.MultiLineString([*np.stack([walls.start, walls.end], axis=1)])
        clear = shapely.distance(shapely.points(anchor), lines) > 0.3
        clear &= ~shapely.contains_xy(shapely.union_all(blocks), anchor)
        oracle = by_visibility(lines, anchor[clear])
        found = way.length[0, row[clear], column[clear]]
        blocked = way.next[0, row[clear], column[clear]] < 0
        assert (np.isinf(oracle) == blocked).all()
        assert found[~blocked] == pytest.approx(oracle[~blocked], abs=0.02)


def by_visibility(lines, position):
    """Lengths from (n,2) m to the door x = 12, 5.2 < y < 6.8 among lines, by all pairs of corners."""
    width = lines.buffer(0.2, quad_segs=4)
    corners = shapely.get_coordinates(width)
    corners = corners[(corners.min(1) > 0) & (corners.max(1) < 12)]
    door = np.column_stack([np.full(41, 11.99), np.linspace(5.2, 6.8, 41)])
    shut = width.buffer(-1e-6).union(shapely.LineString([(12.05, 0), (12.05, 12)]))
    shapely.prepare(shut)
    nodes = np.concatenate([position, corners, door])
    one, two = np.triu_indices(len(nodes), 1)
    far = np.hypot(*(nodes[one] - nodes[two]).T)
    observed = ~shapely.intersects(
        shut, shapely.linestrings(np.stack([nodes[one], nodes[two]], axis=1))
    )
    graph = np.zeros((len(nodes), len(nodes)))
    graph[one[observed], two[observed]] = far[observed]
    graph[-41:, -41:] = 0
    every = dijkstra(
        graph, directed=False, indices=np.arange(len(nodes) - 41, len(nodes)), min_only=True
    )
    return every[: len(position)]


@pytest.mark.parametrize(
    ("barrier", "message"),
    [
        ([(-4, -3), (-4, 3)], r"drive: the way of person \d+ to the door from .* is shut"),
        (
            [(-4, -3), (-4, 2.7)],
            r"the way of person \d+ to the door .* is narrower than the widest",
        ),
    ],
)
def test_a_door_that_nobody_can_reach_is_refused(barrier, message):
    start = Doorway(ends=((0, -0.5), (0, 0.5)), start=shapely.box(-8, -3, -5, 3))
    with pytest.raises(SceneError, match=message):
        room("shut", 8.0, 6.0, [start], Crowd(people=5), inside=Inside(barriers=[barrier]))


def test_a_way_needs_a_door(tmp_path):
    path = tmp_path / "bare.toml"
    text = read_scene("turns").to_toml()
    path.write_text("\n".join(line for line in text.splitlines() if not line.startswith("door_")))
    with pytest.raises(SceneError, match=r"bare\.toml: drive: clearance_m: a way leads to a door"):
        read_room(path, (0.2, 75.0))
    path.write_text(re.sub(r"\nend_m = .*", "\nend_m = [0.0, 0.0]", text))
    with pytest.raises(SceneError, match=r"bare\.toml: walls\.0: start_m and end_m are the same"):
        read_room(path, (0.2, 75.0))


def test_who_is_shut_in_beyond_the_line_of_a_door_is_refused():
    outer = [(3, 7), (3, 10), (0, 10), (0, 0), (9, 0), (9, 10), (6, 10), (6, 3), (3, 3), (3, 5)]
    walls = between(outer, [(7, 5), (8, 5), (8, 6), (7, 6), (7, 5.3)])
    door = {"door_start_m": (3.0, 5.0), "door_end_m": (3.0, 7.0), "outward": (1.0, 0.0)}
    drive = Drive(speed_m_per_s=1, relaxation_time_s=1, clearance_m=0.15, aim="centre", **door)
    people = disks_at([[1.0, 8.0], [8.5, 8.0], [7.5, 5.5]], radius=0.2)
    assert drive.hidden(walls, people).tolist() == [False, True, True]
    with pytest.raises(ValueError, match=r"the way of person 3 to the door .* is narrower"):
        drive.routed(walls, 0.2).check_way(walls, people)


def test_a_door_narrower_than_a_person_is_no_way():
    door = Doorway(ends=((0, -0.15), (0, 0.15)), start=shapely.box(-8, -3, -5, 3))
    inside = Inside(barriers=[((-4, -2), (-4, 2))])
    with pytest.raises(SceneError, match=r"drive: the door .* is narrower than the widest person"):
        room("slit", 8.0, 6.0, [door], Crowd(people=5), inside=inside)


def test_percussions_of_a_dump_know_the_way():
    """A room whose file has a clearance sends the people of any snapshot round its walls."""
    scene = read_scene("ell")
    stated, _ = read_room("ell")
    left, tau = Setting.in_room(stated, left_velocity="desired").left(scene.snapshot)
    people = scene.snapshot
    assert left == pytest.approx(scene.drive.desired_velocity(people.position, people.ids))
    assert tau == scene.drive.relaxation_time_s
    straight = scene.drive.straight().desired_velocity(people.position, people.ids)
    assert np.abs(left - straight).max() > 0.5
    assert not scene.drive.gone(people.position, people.ids).any()


def test_who_is_alone_arrives_after_the_length_of_the_way_and_one_relaxation():
    """From rest, x = U (t − τ (1 − exp(−t/τ))): the arrival is τ after that at full speed, and each
    turn of a corner costs at most the relaxation once more."""
    scene, tau = read_scene("turns"), 0.1
    quick = scene.drive.model_copy(update={"relaxation_time_s": tau})
    scene = scene.model_copy(update={"drive": quick})
    position, speed = np.array([[1.2, 5.0]]), quick.speed_m_per_s
    body = {"radius": scene.snapshot.radius.max(keepdims=True), "mass": np.array([75.0])}
    alone = Snapshot(position=position, velocity=np.zeros((1, 2)), **body)
    motion = motion_of(scene.model_copy(update={"snapshot": alone}), alone)
    walked, before = 0.0, position
    while not scene.drive.gone(motion.position, alone.ids).any():
        motion.advance()
        walked += float(np.hypot(*(motion.position - before).T).sum())
        before = motion.position.copy()
    length = float(scene.drive.way.at(position, 0, scene.drive.way.length)[0])
    assert walked == pytest.approx(length, rel=0.02)
    assert 0.9 * tau < motion.time - length / speed < 3 * tau + 0.02 * length / speed


def test_yade_refuses_the_way_of_other_walls(tmp_path, monkeypatch):
    """Somebody has moved a wall by hand and runs the script itself."""
    monkeypatch.syspath_prepend(str(shipped("yade_scripts")))
    scripts = importlib.import_module("scene_file")
    path = read_scene("turns").write(tmp_path)
    scripts.read_scene(path, {})
    path.write_text(path.read_text().replace("\nstart_m = [5.0, 6.0]", "\nstart_m = [5.0, 5.5]"))
    with pytest.raises(scripts.SceneFileError, match=r"turns\.way: .*the walls are others"):
        scripts.read_scene(path, {})


def test_two_goals_may_be_one_door():
    once, twice = (way_of(ELL, np.repeat(DOWN, n, axis=0), 0.2, 0.15) for n in (1, 2))
    assert np.array_equal(twice.next[0], once.next[0])
    assert np.array_equal(twice.next[1], once.next[0])
    assert (once.next[0] >= 0).any()


@pytest.mark.parametrize("shift", [0.0, 0.02, 0.06])
def test_who_is_just_before_the_line_of_a_door_goes_through_it(shift):
    """A corner of the way stands in the door: nobody goes along the line to it."""
    posts = [(0, -1), (0, -4), (-8, -4), (-8, 4), (0, 4), (0, 1)]
    sides = between(posts, [(-3, -2), (-3, 4)])
    door = np.array([[(shift, shift - 1), (shift, shift + 1), (1.0, 0.0)]])
    way = way_of(Walls(start=sides.start + shift, end=sides.end + shift), door, 0.2, 0.15)
    before = np.stack(np.meshgrid(np.linspace(-0.1, -0.001, 8), np.linspace(-0.75, 0.75, 9)), -1)
    assert (way.at(before.reshape(-1, 2) + shift, 0, way.next) == 0).all()
