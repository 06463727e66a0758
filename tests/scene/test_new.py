"""`percussions new`: a room, its door and a crowd of one's own."""

import numpy as np
import pytest
import shapely
from scipy.spatial import Delaunay

from analysis.scene import Crowd, SceneError, from_geometry, read_scene, room
from analysis.scene.anthropometry import PEOPLE, Varied
from analysis.scene.named_crowds import CROWDS, crowds_beside, with_crowd
from nscd import find_contacts

ELL = shapely.Polygon([(0, 0), (10, 0), (10, 4), (4, 4), (4, 10), (0, 10)])
DOOR = ((1.0, 10.0), (2.0, 10.0))


def test_a_room_by_command(percussions, tmp_path):
    words = ("new", "my_room", "--room", "8x6", "--door", 0.8, "--people", 40, "--duration", 0.2)
    made = percussions(*words, "--people-from", "ANSUR II", "--push", 100)
    assert made.returncode == 0, made.stderr
    assert made.stdout.splitlines()[-4:] == [
        "my_room.toml",
        "my_room.data",
        "my_room.png",
        "next: percussions report my_room.toml",
    ]
    assert (tmp_path / "my_room.png").read_bytes().startswith(b"\x89PNG")
    scene = read_scene(tmp_path / "my_room.toml")
    drive, disks = scene.drive, scene.snapshot
    push = disks.mass.mean() * drive.speed_m_per_s / drive.relaxation_time_s
    assert push == pytest.approx(100.0)
    length = np.hypot(*(scene.wall_segments().end - scene.wall_segments().start).T).sum()
    assert length == pytest.approx(2 * (8 + 6) - 0.8)
    means = [0.5 * np.sqrt(group.breadth[0] * group.depth[0]) for group in PEOPLE["ANSUR II"]]
    assert min(means) - 0.01 < disks.radius.mean() < max(means) + 0.01
    again = percussions("new", "my_room.toml", *words[2:])
    assert again.returncode == 1
    assert again.stderr == (
        "percussions: my_room.toml: exists already. Give another name or --out\n"
    )
    assert percussions("run", "my_room.toml", "--engine", "rigid").returncode == 0


@pytest.mark.parametrize(
    ("inputs", "speed", "tau", "push"),
    [
        ({"relaxation": 1.0}, 2.0, 1.0, 150.0),
        ({"speed": 1.5}, 1.5, 0.75, 150.0),
        ({"speed": 1.5, "relaxation": 0.25, "friction": 0.4}, 1.5, 0.25, 450.0),
    ],
)
def test_speed_tau_and_push_give_each_other(inputs, speed, tau, push):
    """Push = m speed/τ."""
    made = room("small", 4.0, 3.0, 0.8, Crowd(people=4, law="body_hertz", **inputs))
    drive, contact = made.drive, made.contact
    assert (drive.speed_m_per_s, drive.relaxation_time_s) == pytest.approx((speed, tau))
    assert f"push with {push:g} N" in made.notes
    assert (contact.law, contact.friction) == ("body_hertz", inputs.get("friction", 0.0))
    assert contact.stiffness_N_per_m == pytest.approx(5445.0)


@pytest.mark.parametrize(("name", "push"), [("waiting", 0.0), ("pressing", 33.5), ("pushing", 150)])
def test_a_named_crowd_pushes_with_its_share(name, push):
    """75 kg · p · 1.34 m/s / 0.3 s of who keeps a distance, as file and in Python."""
    made = room("small", 4.0, 3.0, 0.8, Crowd(people=4, does=name))
    assert made.push_range == pytest.approx((push, push))
    same = [(one, ratio) for one, ratio, same in crowds_beside(made) if same]
    assert same == [(name, CROWDS[name].fractions[0])]
    for other, fraction, _ in crowds_beside(made):
        changed = with_crowd(made, other, fraction)
        assert (changed.drive.time_gap_s is None) == (other == "pushing")
        assert [fraction for *_, same in crowds_beside(changed) if same] == [fraction]
        assert changed.push_range[0] == pytest.approx(150 if other == "pushing" else 335 * fraction)


def test_people_wait_nearest_to_the_door_without_overlaps_or_order():
    scene = room("big", 30.0, 20.0, 1.2, Crowd(people=600))
    disks = scene.snapshot
    gap = find_contacts(disks, scene.wall_segments(), tolerance=1e-3).gap
    assert gap.min() >= -1e-6 * disks.radius.min()
    reach = np.hypot(*(disks.position - [0.0, 0.0]).T).max()
    cover = np.pi * (disks.radius**2).sum() / (0.5 * np.pi * reach**2)
    assert 0.5 < cover < 0.6  # a half disk before the door
    first, after = Delaunay(disks.position).vertex_neighbor_vertices
    order = []
    for i in np.flatnonzero(np.hypot(*disks.position.T) < 0.8 * reach):
        x, y = (disks.position[after[first[i] : first[i + 1]]] - disks.position[i]).T
        order.append(np.exp(6j * np.arctan2(y, x)).mean())
    assert abs(np.mean(order)) < 0.15  # a crystal has 1
    other = room("big", 30.0, 20.0, 1.2, Crowd(people=600, varied=Varied(radius_share=0.1, seed=2)))
    assert not np.allclose(other.snapshot.position, disks.position)
    assert room("big", 30.0, 20.0, 1.2, Crowd(people=600)).digest() == scene.digest()


@pytest.mark.parametrize("form", ["POLYGON", "GeoJSON", "GEOMETRYCOLLECTION"])
def test_a_floor_with_a_pillar(percussions, tmp_path, form):
    floor = ELL.difference(shapely.box(1.5, 1.5, 2.5, 2.5))
    shape = shapely.GeometryCollection([floor]) if form == "GEOMETRYCOLLECTION" else floor
    text = shapely.to_geojson(shape) if form == "GeoJSON" else shapely.to_wkt(shape)
    (tmp_path / "floor").write_text(text)
    made = percussions("new", "ell", "--geometry", "floor", "--door", "2,10,1,10", "--people", 200)
    assert made.returncode == 0, made.stderr
    scene = read_scene(tmp_path / "ell.toml")
    radius, position = scene.snapshot.radius, scene.snapshot.position
    assert len(scene.walls) == 11  # six sides, of which the door's are two, and four of the pillar
    assert (shapely.distance(floor.boundary, shapely.points(position)) > radius - 1e-6).all()
    assert shapely.contains_xy(floor, position).all()
    assert tuple(scene.drive.outward) == (0.0, 1.0)
    behind = (position[:, 0] > 6) & (position[:, 1] < 4)  # no straight way round the corner
    (message,) = (line for line in scene.notes.splitlines() if "walk round it" in line)
    assert int(message.split()[0]) >= behind.sum() > 0


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("--room 8x --door 1", "room: '8x'. Numbers as mxm are needed"),
        ("--room -8x6 --door 1", "room: -8 m by 6 m. Positive lengths are needed"),
        ("--room 8x6 --door 7", "door: 7 m. It needs 0 to the side of 6 m"),
        ("--room 3x3 --door 1", "people: 90 of mean radius 0.201 m would cover 128% of the floor"),
        ("--door 1", "room: --room or --geometry is needed, not both"),
        ("--room 8x6 --door 1 --people-from Me", "people: 'Me'. There are: ANSUR II"),
        ("--room 8x6 --door 1 --people 1e9", "people: 1e+09. Above 0 and at most 5000"),
        ("--room 8x6 --door 1 --duration 1e308", "duration: 1e+308. Above 0 and at most 1"),
        ("--room 8x6 --door 1 --push 1e308", "push: 1e+308. Above 0 and at most 1"),
        ("--room 1e300x6 --door 1", "area: coordinates in m within ±1"),
        ("--room 8000x6000 --door 1", "area: 8000 m by 6000 m. Coordinates in m (not in degrees, "),
        ("--room 8x6 --door 1 --mass 1e20", "mass: 1e+20. Above 0 and at most 1000 is needed"),
        ("--room 8x6 --door 1 --radius 20", "radius: 20. Above 0 and at most 1 is needed"),
        *(
            (f"--room 8x6 --door 1 --people-from Me --{one} 0.5", f"--{one}: --people-from has")
            for one in ("mass", "radius", "radius-spread")
        ),
        ("--geometry none --door 1,9,2,9", "none: no such file"),
        ("--room 20x20 --door 1 --law body --friction 0.4", "friction: law = body has none"),
        ("--room 20x20 --door 1 --law soft", "law: Input should be 'hooke', "),
        ("--room 8x6 --door 1 --speed 1 --tau 1 --push 9", "--push: --speed and --tau give it"),
    ],
)
def test_what_cannot_be_made_is_one_line(refused, words, says):
    message = refused("new", "bad", "--people", 90, *words.split())
    assert message.startswith(f"percussions: {says}")


FLOORS = {
    "degrees": (
        '{"type": "Polygon", "coordinates": [[[11.5, 48.1], [11.6, 48.1], [11.6, 48.2], [11.5, 48.1]]]}',
        "area: 0.1 m by 0.1 m. Coordinates in m (not in degrees",
    ),
    "curves": ("CURVEPOLYGON(CIRCULARSTRING(0 0, 5 5, 10 0, 5 -5, 0 0))", "area: curves are not"),
    "nested": (
        "GEOMETRYCOLLECTION(" * 60_000 + "POINT(0 0)" + ")" * 60_000,
        "area: more than 100 brackets within each other",
    ),
}


@pytest.mark.parametrize("floor", FLOORS)
def test_a_floor_that_is_none_is_one_line(refused, tmp_path, floor):
    text, says = FLOORS[floor]
    (tmp_path / "floor").write_text(text)
    message = refused("new", "no", "--geometry", "floor", "--door", "0,0,1,0", "--people", 1)
    assert message.startswith(f"percussions: floor: {says}")


def test_a_door_lies_on_one_side_and_a_floor_is_one_polygon():
    with pytest.raises(SceneError, match="not on one side of the room's outline"):
        from_geometry("ell", ELL, ((1.0, 9.0), (2.0, 10.0)), Crowd(people=9))
    two = shapely.MultiPolygon([shapely.box(0, 0, 1, 1), shapely.box(2, 0, 3, 1)])
    with pytest.raises(SceneError, match="one polygon in one piece is needed, not MultiPolygon"):
        from_geometry("two", two, DOOR, Crowd(people=1))


def test_a_few_before_a_wide_door_and_many_in_a_small_room():
    few = room("few", 8.0, 6.0, 6.0, Crowd(people=5))
    assert len(few.walls) == 3
    assert np.abs(few.snapshot.position[:, 0]).max() < 1.0
    full = room("full", 4.0, 3.0, 0.8, Crowd(people=56))  # 59 % of the floor
    assert len(full.snapshot) == 56
