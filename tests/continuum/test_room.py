"""Rooms, meshes and bad input of the continuous crowd."""

import numpy as np
import pytest

from analysis.scene.scene import read_scene
from nscd import Walls
from nscd.continuum.collision import collide
from nscd.continuum.left_velocity import random_speeds, toward_exit
from nscd.continuum.medium import Medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.pressure import percussion_density
from nscd.continuum.room import Exit, Room, room_of_outline, room_of_walls, square_room
from nscd.continuum.space import Space
from tests.refusals import refusals

SQUARE = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]]
PILLARS = ([[1.0, 1.0], [1.0, 2.0], [2.0, 2.0], [2.0, 1.0]], [[3.0, 1.0], [3.5, 1.0], [3.0, 2.0]])
THREE = Walls(start=[[4, 0], [4, 3], [0, 3]], end=[[4, 3], [0, 3], [0, 0]])


def slit(width):
    """A room with a wall of this thickness (m) standing in it."""
    there = 2 + width
    return room_of_outline([*SQUARE[:1], [2, 0], [2, 2], [there, 2], [there, 0], *SQUARE[1:]])


def collided(left, *, density=7.0, border="exit", **others):
    """A crowd in a small room with one edge that is no wall."""
    room = Room(outline=SQUARE, border=("wall", border, "wall", "wall"))
    medium = Medium(density=density, volume_dissipation=9)
    return collide(Space(mesh_of(room, 1.0)), medium, left, **others)


def lengths(room):
    return {
        kind: np.linalg.norm(np.diff(room.pieces(kind), axis=1), axis=2).sum()
        for kind in ("wall", "exit", "free")
    }


def test_outline_and_walls_give_the_same_room():
    cut = room_of_outline(SQUARE, exits=[Exit(0, 1.0, 2.0), (2, 0.0, 0.5)])
    pieces = Walls(
        start=[[0, 0], [2, 0], [4, 0], [3.5, 3], [0, 3]],
        end=[[1, 0], [4, 0], [4, 3], [0, 3], [0, 0]],
    )
    joined = room_of_walls(pieces, exits=[[[1, 0], [2, 0]], [[4, 3], [3.5, 3]]])
    assert cut.area == joined.area == 12.0
    assert lengths(cut) == lengths(joined) == {"wall": 12.5, "exit": 1.5, "free": 0.0}
    for room in (cut, joined):
        assert sorted(map(tuple, room.jambs)) == [(1, 0), (2, 0), (3.5, 3), (4, 3)]


def test_clockwise_outline_is_turned_with_its_border():
    there = Room(outline=SQUARE, border=("exit", "wall", "free", "wall"))
    back = Room(outline=SQUARE[::-1], border=("free", "wall", "exit", "wall"))
    for kind in ("wall", "exit", "free"):
        one, other = (sorted(map(tuple, r.pieces(kind).reshape(-1, 4))) for r in (there, back))
        assert one == other


def test_room_of_the_disks_scene():
    scene = read_scene("arch")
    door = [scene.drive.door_start_m, scene.drive.door_end_m]
    room = room_of_walls(scene.wall_segments(), exits=[door])
    wanted = square_room(18.0, 1.0)
    assert lengths(room) == pytest.approx(lengths(wanted))
    assert sorted(map(tuple, room.jambs)) == sorted(map(tuple, wanted.jambs))


test_bad_room_mesh_medium_or_collision = refusals(
    (lambda: room_of_outline(SQUARE, exits=[(0, 0.0, 5.0)]), "exit 0 is 5 m wide, its wall only 4 m"),
    (lambda: room_of_outline(SQUARE, exits=[(0, 3.5, 4.5)]), "ends beyond its wall"),
    (lambda: room_of_outline(SQUARE, exits=[(0, 1, 2), (0, 1.5, 3)]), "two exits overlap"),
    (lambda: room_of_outline(SQUARE, exits=[(0, 2, 1)]), "needs a width"),
    (lambda: room_of_outline(SQUARE, exits=[(7, 1, 2)]), "is no wall"),
    (lambda: room_of_walls(THREE), r"not closed at \((4|0), 0\) m"),
    (lambda: room_of_walls(THREE, exits=[[[1, 0], [2, 0]]]), "not closed"),
    (lambda: room_of_walls(THREE, exits=[[[0, 0], [4, 0]], [[4, -1], [4, 2]]]), r"reaches over wall 1"),
    (lambda: Room(outline=SQUARE[:2], border=("wall",) * 2), "outline: 2 vertices"),
    (lambda: Room(outline=np.array(SQUARE)[[0, 2, 1, 3]], border=("wall",) * 4), "outline: the edges touch or cross"),
    (lambda: Room(outline=SQUARE, border=("free",) * 4), "no wall"),
    (lambda: Room(outline=SQUARE, border=("wall",) * 3), "border: 3 kinds for 4 edges"),
    (lambda: Room(outline=SQUARE, border=("wall", "wall", "wall", "door")), "edge 3 is 'door'"),
    (lambda: room_of_outline(SQUARE, pillars=[[[1, 1], [2, 1]]]), "pillars: number 0: 2 vertices"),
    (lambda: room_of_outline(SQUARE, pillars=[[[3, 1], [5, 1], [3, 2]]]), "pillars: number 0 is not inside"),
    (lambda: room_of_outline(SQUARE, pillars=[[[0, 1], [1, 1], [0, 2]]]), "number 0 is not inside.*or touches"),
    (lambda: room_of_outline(SQUARE, pillars=[PILLARS[0], PILLARS[0]]), "pillars: number 1 is not inside"),
    (lambda: room_of_walls(Walls(start=[*SQUARE, [4, 0]], end=[*SQUARE[1:], SQUARE[0], [0, 3]])), "enclose 2 rooms"),
    (lambda: room_of_walls(Walls(start=[*SQUARE, [1, 1], [2, 1]], end=[*SQUARE[1:], SQUARE[0], [2, 1], [1, 2]]),
                               exits=[[[1, 2], [1, 1]]]), "the pillar at .* has an exit"),
    (lambda: mesh_of(square_room(4.0, 1.0), 0.0), "size"),
    (lambda: mesh_of(square_room(4.0, 1.0), 0.5, reach=-1.0), "reach"),
    (lambda: mesh_of(square_room(4.0, 1.0), 0.005, grading=0.001, reach=4.0), "size.*grading.*triangles"),
    (lambda: mesh_of(square_room(4.0, 1.0), 0.5, grading=2.0), "grading"),
    (lambda: mesh_of(square_room(4.0, 1.0), 1e-4), "size.*triangles"),
    (lambda: mesh_of(slit(1e-6), 0.5), "room: the mesh generator failed"),
    (lambda: mesh_of(slit(1e-8), 0.5), "room: the mesh generator failed"),
    (lambda: Medium(density=0.0, volume_dissipation=9), "density"),
    (lambda: Medium(density=[7.0, -1.0], volume_dissipation=9), "density"),
    (lambda: Medium(density=-7.0, volume_dissipation=9), "density: -7"),
    (lambda: Medium(density=7, volume_dissipation=0), "volume_dissipation"),
    (lambda: Medium(density=7, volume_dissipation=-9), "volume_dissipation: -9"),
    (lambda: Medium(density=7, volume_dissipation=9, surface_dissipation=-1), "surface_dissipation"),
    (lambda: Medium(density=7, volume_dissipation=9, mass_per_person=0), "mass_per_person"),
    (lambda: toward_exit(room_of_outline(SQUARE), 1.0), "no exit"),
    (lambda: collided([1.0, 2.0, 3.0]), "left_velocity: shape"),
    (lambda: collided([[1.0, 2.0]]), "left_velocity: shape"),
    (lambda: collided([np.nan, 0.0]), "left_velocity"),
    (lambda: collided(lambda x: x[:, 0]), "left_velocity: the function gives shape"),
    (lambda: collided([1.0, 0.0], external=[1.0, 0.0]), "external: the mesh has no boundary named free"),
    (lambda: collided([1.0, 0.0], border="free", external=[1.0]), "external: shape"),
    (lambda: collided([1.0, 0.0], tolerance=0.0), "tolerance"),
    (lambda: collided([1.0, 0.0], density=[7.0, 7.0]), "density: shape"),
    (lambda: Space(mesh_of(square_room(4.0, 1.0), 1.0), 3), "order"),
    (lambda: Space(mesh_of(square_room(4.0, 1.0), 1.0).with_boundaries({"wall": np.array([], dtype=int)})), "wall"),
)  # fmt: skip


def test_mesh_fills_the_room_and_is_fine_at_the_jambs():
    room = square_room(6.0, 1.0)
    mesh = mesh_of(room, 0.5, grading=0.5)
    corners = mesh.p[:, mesh.t]
    (ax, ay), (bx, by) = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = 0.5 * np.abs(ax * by - ay * bx)
    assert area.sum() == pytest.approx(36.0)
    assert area.max() < 2 * np.sqrt(3) / 4 * 0.5**2
    edges = mesh.p[:, mesh.facets[0]] - mesh.p[:, mesh.facets[1]]
    # size²/reach at the jambs
    assert 0.25 * 0.5**2 / 1.5 < np.hypot(*edges).min() < 0.5**2 / 1.5
    assert np.hypot(*edges[:, mesh.boundaries["exit"]]).max() < 0.5
    for kind, length in lengths(room).items():
        found = np.hypot(*edges[:, mesh.boundaries[kind]]).sum()
        assert found == pytest.approx(length)
    assert min(np.hypot(*(mesh.p.T - jamb).T).min() for jamb in room.jambs) == 0.0


def smallest_angle(mesh):
    """The smallest angle of any triangle, in degrees."""
    corners = mesh.p[:, mesh.t]
    ways = [np.roll(corners, -k, axis=1) - corners for k in (1, 2)]
    cosine = (ways[0] * ways[1]).sum(0) / (np.hypot(*ways[0]) * np.hypot(*ways[1]))
    return np.degrees(np.arccos(cosine.max()))


@pytest.mark.parametrize("grading", [1.0, 0.5, 0.35, 0.2])
def test_triangles_are_round_and_of_the_size_asked_for(grading):
    """Also where the grading asks for sides of a micrometre: they end at 4e-6 of the room."""
    room = square_room(18.0, 1.0)
    mesh = mesh_of(room, 0.5, grading=grading, reach=4.5)
    assert smallest_angle(mesh) > 25
    edges = np.hypot(*(mesh.p[:, mesh.facets[0]] - mesh.p[:, mesh.facets[1]]))
    assert edges.min() == pytest.approx(max(4.5 * (0.5 / 4.5) ** (1 / grading), 4e-6 * 18), rel=0.3)
    if grading == 1.0:
        assert np.sqrt(324 / mesh.nelements / (np.sqrt(3) / 4)) == pytest.approx(0.5, rel=0.1)


def test_thin_wall_is_meshed_round():
    mesh = mesh_of(slit(0.01), 0.5)
    edges = np.hypot(*(mesh.p[:, mesh.facets[0]] - mesh.p[:, mesh.facets[1]]))
    assert edges[mesh.boundaries["wall"]].sum() == pytest.approx(18.0)


def test_same_mesh_every_time():
    room = room_of_outline(SQUARE, exits=[(0, 1, 2)], pillars=[[[2, 1], [3, 1], [3, 2]]])
    first, second = mesh_of(room, 0.3), mesh_of(room, 0.3)
    assert np.array_equal(first.p, second.p)
    assert np.array_equal(first.t, second.t)


def test_crowd_around_pillars():
    """Pillars given as polygons or as loops of walls; what they and the walls give is what the
    crowd gains."""
    room = room_of_outline(SQUARE, exits=[(0, 1.0, 2.0)], pillars=PILLARS)
    loops = [np.array(p) for p in PILLARS]
    start = np.vstack([[[0, 0], [2, 0], [4, 0], [4, 3], [0, 3]], *loops])
    end = [[1, 0], [4, 0], [4, 3], [0, 3], [0, 0]], *(np.roll(p, -1, axis=0) for p in loops)
    walls = Walls(start=start, end=np.vstack(end))
    joined = room_of_walls(walls, exits=[[[1, 0], [2, 0]]])
    assert room.area == pytest.approx(12 - 1 - 0.25)
    assert joined.area == pytest.approx(room.area)
    assert lengths(room) == pytest.approx(lengths(joined))
    assert len(room.jambs) == 2
    mesh = mesh_of(room, 0.2)
    assert smallest_angle(mesh) > 20
    space = Space(mesh, 2)
    assert space.basis.dx.sum() == pytest.approx(room.area)
    assert space.wall.weight.sum() == pytest.approx(lengths(room)["wall"])
    # out of the crowd, that is into the pillar
    centre = np.mean(PILLARS[0], axis=0)
    beside = np.abs(space.wall.point - centre).max(1) < 0.51
    assert (((centre - space.wall.point) * space.wall.normal).sum(1)[beside] > 0).all()
    solution = collide(space, Medium(density=7, volume_dissipation=9), [0.5, -1.0])
    assert solution.residual < 1e-12
    assert solution.energy.error < 1e-12
    gained = (percussion_density(solution) * space.basis.dx).sum((1, 2))
    inputs = -(solution.wall_force[:, None] * space.wall.normal).sum(0)
    assert gained == pytest.approx(inputs, abs=1e-9)
    assert solution.wall_force[beside].sum() > 0


def test_walls_carry_each_corner_twice_and_their_length_once():
    room = square_room(6.0, 1.0)
    for order in (1, 2):
        wall = Space(mesh_of(room, 1.0), order).wall
        assert wall.weight.sum() == pytest.approx(23.0)
        assert len(wall.node) - len(np.unique(wall.node)) == 4
        assert np.abs(wall.normal).sum(1) == pytest.approx(1.0)


def test_toward_exit_points_to_the_exit_and_stops_there():
    field = toward_exit(square_room(6.0, 1.0), 2.0)
    points = np.array([[-3.0, 0.2], [-3.0, 3.5], [0.0, 2.0], [0.0, 0.5], [0.0, 0.1]])
    wanted = np.array([[2, 0], [np.sqrt(2), -np.sqrt(2)], [0, -2], [0, 0], [0, 0]])
    assert field(points) == pytest.approx(wanted, abs=1e-12)


def test_random_speeds_have_their_mean_and_deviation_and_know_no_mesh():
    room = square_room(18.0, 1.0)

    def east(x):
        return np.tile([1.0, 0.0], (len(x), 1))

    field = random_speeds(room, east, mean=1.34, deviation=0.26, seed=3, cell=0.38)
    points = np.random.default_rng(0).uniform([-18, -9], [0, 9], (20000, 2))
    drawn = field(points)
    speeds = np.unique(drawn[:, 0])
    assert len(speeds) > 2000
    # 2304 independent draws: 5 standard errors
    assert speeds.mean() == pytest.approx(1.34, abs=5 * 0.26 / 48)
    assert speeds.std() == pytest.approx(0.26, abs=5 * 0.26 / 68)
    assert np.array_equal(field(points[::-1])[::-1], drawn)
    other = random_speeds(room, east, mean=1.34, deviation=0.26, seed=4, cell=0.38)
    assert not np.array_equal(other(points), drawn)
    for name, bad in (("deviation", {"deviation": -1.0}), ("cell", {"cell": 0.0})):
        arguments = {"mean": 1.0, "deviation": 0.1, "seed": 0, "cell": 1.0} | bad
        with pytest.raises(ValueError, match=name):
            random_speeds(room, east, **arguments)
