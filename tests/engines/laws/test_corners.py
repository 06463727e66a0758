"""Walls that meet are one body: a disk moved along, over and round its corners has one contact for
each nearest point, in nscd, both engines and the Python model; the distance is shapely's."""

import numpy as np
import pytest
import shapely
from shapely.ops import nearest_points

from analysis.scene.schema import BodyForce
from analysis.studies.work_precision.soft import leapfrog
from nscd import Snapshot, Walls, find_contacts
from nscd.stepping.arms import neighbours
from nscd.stepping.motion import segments_of
from tests.crowds import scene_at

ENGINES = ["lammps", "yade"]
RADIUS, MASS, K = 0.25, 75.0, 1e5


def outline(corners, turn=0.0, at=(0.0, 0.0), order=None):
    """The walls of a polygon, turned (rad), moved, and in another order, each the other way."""
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    points = np.array(corners) @ rotation.T + np.array(at)
    sides = list(zip(points, np.roll(points, -1, axis=0), strict=True))
    order = range(len(sides)) if order is None else order
    sides = [sides[n] if n % 2 else sides[n][::-1] for n in order]
    return Walls(start=[a for a, _ in sides], end=[b for _, b in sides]), shapely.Polygon(points)


THICK = [(-2.0, -0.2), (0.3, -0.2), (2.0, -0.2), (2.0, 0.0), (0.5, 0.0), (-2.0, 0.0)]
PILLAR = [(0.3 * np.cos(a), 0.3 * np.sin(a)) for a in np.arange(8) * np.pi / 4]
BODIES = {"thick wall": THICK, "pillar": PILLAR}


def both_searches(position, walls, margin):
    """Walls, gaps and normals of a disk at the position, by each of nscd's two searches."""
    one = Snapshot(position=[position], velocity=[[0, 0]], radius=[RADIUS], mass=[MASS])
    contacts = find_contacts(one, walls, tolerance=margin)
    yield contacts.gap, contacts.normal
    reachable = neighbours(one.position, one.radius, segments_of(walls), margin)
    yield reachable.gap, reachable.normal


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("turn", [0.0, 0.3, np.pi / 2])
def test_one_contact_all_round_a_body(body, turn):
    rng = np.random.default_rng(7)
    corners = BODIES[body]
    order = rng.permutation(len(corners))
    walls, polygon = outline(corners, turn, (0.7, -0.4), order)
    ring = polygon.buffer(0.9 * RADIUS, quad_segs=64).exterior
    # over every corner and joint too
    positions = [ring.interpolate(s, normalized=True) for s in np.linspace(0, 1, 400)]
    positions += [ring.interpolate(ring.project(shapely.Point(c))) for c in polygon.exterior.coords]
    for location in positions:
        nearest, _ = nearest_points(polygon.exterior, location)
        position = np.array([location.x, location.y])
        away = np.array([nearest.x, nearest.y]) - position
        for gap, normal in both_searches(position, walls, 0.0):
            assert len(gap) == 1
            assert gap[0] == pytest.approx(np.hypot(*away) - RADIUS, abs=1e-12)
            np.testing.assert_allclose(normal[0], away / np.hypot(*away), atol=1e-9)


def test_two_contacts_in_a_corner():
    room = Walls(start=[[0, 0], [0, 3], [1, 3]], end=[[2, 0], [0, 0], [0, 3]])
    for x, y in ((0.2, 0.24), (0.1, 0.1)):
        for gap, normal in both_searches(np.array([x, y]), room, 0.0):
            assert sorted(gap + RADIUS) == pytest.approx(sorted([x, y]), abs=1e-15)
            assert {tuple(n) for n in normal.round(12) + 0.0} == {(-1.0, 0.0), (0.0, -1.0)}


def test_a_wall_that_ends_in_another():
    """A T: one contact behind the wall that goes through, two in each corner before it."""
    tee = Walls(start=[[0, 0], [-2, 0]], end=[[0, 1], [2, 0]])
    for gap, normal in both_searches(np.array([0.01, -0.2]), tee, 0.1):
        assert len(gap) == 1
        np.testing.assert_allclose(normal, [[0.0, 1.0]], atol=1e-12)
    for gap, _ in both_searches(np.array([0.2, 0.24]), tee, 0.0):
        assert sorted(gap + RADIUS) == pytest.approx([0.2, 0.24], abs=1e-15)


def scene_of(walls, position, velocity, body_force=(0.0, 0.0), restitution=1.0, duration=1.0):
    """One disk and the walls, in a room that is too wide to matter."""
    disk = Snapshot(position=[position], velocity=[velocity], radius=[RADIUS], mass=[MASS])
    room, _ = outline([(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)])
    pairs = [*zip(walls.start, walls.end, strict=True), *zip(room.start, room.end, strict=True)]
    return scene_at(
        disk, pairs, name="corner", contact={"stiffness_N_per_m": K, "restitution": restitution},
        run={"duration_s": duration, "frames": round(duration * 100), "time_step_s": 2e-4},
        body_force=BodyForce(acceleration_m_per_s2=body_force) if any(body_force) else None,
    )  # fmt: skip


def follow(simulation, polygon):
    """Hold every frame against the distance of the disk to the polygon; the numbers of contacts."""
    counts = []
    for frame, contacts in enumerate(simulation.contacts):
        position = shapely.Point(simulation["x"][frame, 0], simulation["y"][frame, 0])
        nearest, _ = nearest_points(polygon.exterior, position)
        deep = RADIUS - position.distance(polygon.exterior)
        counts.append(len(contacts))
        assert len(contacts) == (deep > 1e-12), frame
        if deep > 1e-12:
            assert contacts.overlap[0] == pytest.approx(deep, abs=1e-9)
            normal = np.array([nearest.x - position.x, nearest.y - position.y])
            np.testing.assert_allclose(contacts.normal[0], normal / np.hypot(*normal), atol=1e-7)
            assert np.hypot(*contacts.force[0]) == pytest.approx(K * deep, rel=1e-6, abs=1e-6)
    return counts


@pytest.mark.parametrize("name", ENGINES)
def test_a_disk_slides_along_a_thick_wall_and_over_its_corner(simulate, name):
    """It passes the joint of two walls in line at x = 0.5, and the corner at x = 2, where it tips
    over."""
    walls, polygon = outline(THICK)
    start = (0.2, RADIUS)
    scene = scene_of(walls, start, (1.5, 0.0), (0.0, -8.0), duration=1.6)
    simulation = simulate(name, scene)
    counts = follow(simulation, polygon)
    assert simulation["x"][0, 0] < 0.5 < 2.0 < simulation["x"][-1, 0]
    assert simulation["y"][-1, 0] < -0.2
    # on the wall until the corner, up and down by no more than its weight presses
    on = simulation["x"][:, 0] < 1.99
    assert np.abs(simulation["y"][on, 0] - RADIUS + MASS * 8.0 / K).max() < 1.01 * MASS * 8.0 / K
    assert sum(counts) > 0.9 * on.sum()
    motion = leapfrog(scene)
    moved = np.array([simulation["x"][-1, 0], simulation["y"][-1, 0]]) - start
    np.testing.assert_allclose(moved, motion.displacement[1, 0], rtol=0, atol=1e-8)


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("aim", [0.0, 0.05, -0.11])
def test_a_disk_bounces_off_a_pillar(simulate, name, aim):
    """Without damping its speed is kept, wherever between faces and corners it hits."""
    walls, polygon = outline(PILLAR)
    scene = scene_of(walls, (-0.8, aim), (2.0, 0.0), duration=0.5)
    simulation = simulate(name, scene)
    assert max(follow(simulation, polygon)) == 1
    speed = np.hypot(simulation["vx"][-1, 0], simulation["vy"][-1, 0])
    assert speed == pytest.approx(2.0, rel=1e-3)
    motion = leapfrog(scene)
    moved = np.array([simulation["x"][-1, 0] + 0.8, simulation["y"][-1, 0] - aim])
    np.testing.assert_allclose(moved, motion.displacement[1, 0], rtol=0, atol=1e-8)


@pytest.mark.parametrize("name", ENGINES)
def test_the_common_end_of_two_walls_rebounds_as_asked(simulate, name):
    """Two contacts there, of half the stiffness each, gave 0.396 for 0.5."""
    tip = Walls(start=[[1.0, 0.5], [1.0, -0.5]], end=[[0.0, 0.0], [0.0, 0.0]])
    scene = scene_of(tip, (-0.3, 0.0), (1.0, 0.0), restitution=0.5, duration=0.3)
    simulation = simulate(name, scene.with_run(time_step_s=2e-5))
    assert simulation["vx"][-1, 0] == pytest.approx(-0.5, abs=2e-3)
    assert max(map(len, simulation.contacts)) == 1


@pytest.mark.parametrize("name", ENGINES)
def test_a_disk_pressed_into_a_corner_is_held_by_both_walls(simulate, name):
    room = Walls(start=[[0, 0], [0, 3]], end=[[3, 0], [0, 0]])
    scene = scene_of(room, (0.3, 0.3), (0.0, 0.0), (-3.0, -4.0), restitution=0.01, duration=2.0)
    simulation = simulate(name, scene)
    last = simulation.contacts[-1]
    assert last.is_wall.all()
    np.testing.assert_allclose(last.force[0], [0.0, -4.0 * MASS], rtol=0, atol=0.01 * MASS)
    np.testing.assert_allclose(last.force[1], [-3.0 * MASS, 0.0], rtol=0, atol=0.01 * MASS)
