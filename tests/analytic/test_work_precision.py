"""Work against precision: the references against closed forms, quantities against balance, fronts by hand."""

import dataclasses
import json
from itertools import pairwise

import numpy as np
import pytest

from analysis.engines.penalty import damping_ratio_for, restitution_of
from analysis.making import make
from analysis.scene import Analysis, ContactModel, Drive, Run, Scene, Wall
from analysis.work_precision import continuum_ladder as ladders
from analysis.work_precision.book import Book
from analysis.work_precision.continuum_ladder import ContinuumLadder, continuum_ladder
from analysis.work_precision.continuum_solves import ContinuumModel, solve_continuum
from analysis.work_precision.crowd_region import crowd_room
from analysis.work_precision.kept import kept_reference
from analysis.work_precision.pareto import pareto_front
from analysis.work_precision.pictures import scaling_picture, work_precision_picture
from analysis.work_precision.point import Point, PointStatus, read_points, write_points
from analysis.work_precision.rigid_reference import rigid_reference
from analysis.work_precision.rigid_solves import solve_rigid, solve_rivals
from analysis.work_precision.scaling import cheapest
from analysis.work_precision.soft_reference import soft_reference
from analysis.work_precision.start import prepare_window
from analysis.work_precision.window import (
    CONTACT_FORCE,
    CONTACT_IMPULSE,
    DISK_FORCE,
    DISPLACEMENT,
    WALL_FORCE,
    Window,
    driven_window,
    impact_window,
    relative_error,
)
from nscd import Snapshot
from nscd.continuum.collision import collide
from nscd.continuum.medium import Medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.room import room_of_outline
from nscd.continuum.space import Space

POINT = Point(
    scene="pair", disks=2, method="lammps", law="hooke", solver="", time_step_s=1e-5, time_step_share=1.0,
    stiffness_N_per_m=1e6, tolerance=None, cpu_seconds=0.2, quantity="contact_impulse", unit="N·s", numerical_error=1e-3,
    numerical_bar=1e-7, model_error=0.02, model_bar=1e-7, total_error=0.021, status=PointStatus.OK, reason="",
    machine="a machine", date="2025-01-01",
)  # fmt: skip


def line_at_a_wall(disks=3, stiffness=1e6):
    """Disks of 75 kg in a line that want to walk at 2 m/s (τ = 0.5 s) into a wall: each pushes with 300 N."""
    radius = 0.25
    x = -radius - 2 * radius * np.arange(disks)
    snapshot = Snapshot(
        position=np.column_stack([x, np.zeros(disks)]),
        velocity=np.zeros((disks, 2)),
        radius=np.full(disks, radius),
        mass=np.full(disks, 75.0),
    )
    # everybody walks to a door far away beyond the wall
    drive = Drive(
        speed_m_per_s=2.0,
        relaxation_time_s=0.5,
        door_start_m=(1e6, -0.5),
        door_end_m=(1e6, 0.5),
        outward=(1.0, 0.0),
    )
    return Scene(
        name="line",
        title="A line at a wall",
        source="a test",
        snapshot=snapshot,
        walls=(Wall(name="wall", start_m=(0.0, -1.0), end_m=(0.0, 1.0)),),
        drive=drive,
        contact=ContactModel(stiffness_N_per_m=stiffness, restitution=0.1),
        run=Run(duration_s=1.0, frames=1),
        analysis=Analysis(kind="driven", time_s=1.0),
    )


@pytest.mark.parametrize("law", ["hooke", "hertz"])
@pytest.mark.parametrize("restitution", [0.01, 0.5])
def test_soft_reference_of_two_disks_is_the_closed_form(law, restitution):
    scene = make("pair").with_contact(restitution=restitution, law=law)
    window = impact_window(scene)
    found = soft_reference(window.variant(law, 1e7))
    # p = m_eff (1 + e) U with the restitution that the dashpot really gives (Schwager and Pöschel)
    e = restitution_of(damping_ratio_for(restitution))
    impulse = window.quantities(found.motion, 1e7)[CONTACT_IMPULSE]
    assert impulse == pytest.approx([37.5 * (1 + e) * 2.0], rel=2e-6)
    looser = window.quantities(found.looser, 1e7)[CONTACT_IMPULSE]
    assert relative_error(looser, impulse, impulse) < 1e-4


def test_soft_line_at_a_wall_comes_to_carry_what_everybody_pushes():
    scene = line_at_a_wall(stiffness=1e9)
    window = driven_window(scene, scene.snapshot.position)
    values = window.quantities(soft_reference(window.variant("hooke", 1e9)).motion, 1e9)
    order = np.argsort(values[CONTACT_FORCE])
    assert values[CONTACT_FORCE][order] == pytest.approx([300.0, 600.0, 900.0], rel=1e-4)
    assert values[WALL_FORCE] == pytest.approx([900.0, 0.0], rel=1e-4, abs=1e-6)


def test_rigid_line_at_a_wall_is_exact_and_stands():
    scene = line_at_a_wall()
    window = driven_window(scene, scene.snapshot.position)
    answer = rigid_reference(window.scene.snapshot, window.contacts, window.left_velocity)
    assert "closed form" in answer.origin
    values = window.quantities(window.rigid_motion(answer.right_velocity), 1e6)
    assert sorted(values[CONTACT_FORCE]) == pytest.approx([300.0, 600.0, 900.0], rel=1e-12)
    assert not values[DISPLACEMENT].any()


def test_free_flight_of_a_driven_crowd_has_no_contact_force():
    # u = u_d (1 − e^(−t/τ)): the balance must find nothing that contacts gave
    scene = line_at_a_wall()
    window = driven_window(scene, scene.snapshot.position)
    values = window.quantities(window.rigid_motion(window.left_velocity), 1e6)
    assert np.abs(values[CONTACT_FORCE]).max() < 1e-6


def test_quantities_of_four_disks_are_the_percussions_of_the_paper():
    window = impact_window(make("four_disks"))
    answer = rigid_reference(window.scene.snapshot, window.contacts, window.left_velocity)
    values = window.quantities(window.rigid_motion(answer.right_velocity), 1e6)
    assert sorted(values[CONTACT_IMPULSE]) == pytest.approx([37.5, 75.0, 112.5], rel=1e-14)


@pytest.mark.parametrize("name", ["chain_masses", "chain_wall_masses", "chain"])
def test_closed_form_and_least_squares_agree_within_the_bound(name):
    window = impact_window(make(name, 12, seed=3))
    snapshot = window.scene.snapshot
    closed = rigid_reference(snapshot, window.contacts, window.left_velocity)
    assert "closed form" in closed.origin
    # a speed across the line, which no contact feels, leads past the closed form
    across = window.left_velocity + np.array([0.0, 0.25])
    dense = rigid_reference(snapshot, window.contacts, across)
    assert "least squares" in dense.origin
    difference = dense.right_velocity - [0.0, 0.25] - closed.right_velocity
    error = float(np.sqrt((snapshot.mass[:, None] * difference**2).sum()))
    assert error <= dense.bound + closed.bound < 1e-9


def test_a_line_that_is_pulled_apart_has_no_closed_form():
    scene = make("chain", 6)
    snapshot = scene.snapshot
    window = impact_window(scene)
    answer = rigid_reference(snapshot, window.contacts, -window.left_velocity)
    assert "least squares" in answer.origin
    assert answer.right_velocity == pytest.approx(-window.left_velocity, abs=1e-12)


def test_every_solver_is_within_its_tolerance_of_the_reference():
    window = impact_window(make("corridor"))
    reference = rigid_reference(window.scene.snapshot, window.contacts, window.left_velocity)
    exact = window.quantities(window.rigid_motion(reference.right_velocity), 1e6)
    for answer in solve_rigid(window):
        assert answer.status == PointStatus.OK, answer
        found = window.quantities(answer.motion, 1e6)
        for quantity, values in exact.items():
            # the condition of this scene's contacts is about 60
            assert relative_error(found[quantity], values, values) < 60 * answer.tolerance + 1e-9, answer
    assert [answer.method for answer in solve_rivals(window)] == ["first_order"]


def test_rivals_of_a_driven_crowd_are_forces():
    scene = line_at_a_wall()
    window = driven_window(scene, scene.snapshot.position)
    found = {answer.method: answer for answer in solve_rivals(window)}
    assert set(found) == {"first_order", "social_force", "loehner_printed", "loehner_text"}
    # at touch and with equal radii Löhner's law as printed gives f_max/5, f_max = m u_d/τ = 300 N; a wall is at one radius
    pairs = ~window.contacts.is_wall
    assert found["loehner_printed"].contact_force[pairs] == pytest.approx([60.0, 60.0])


def test_friction_is_refused_by_name():
    scene = make("pair").with_contact(friction=0.5)
    with pytest.raises(ValueError, match=r"contact\.friction"):
        prepare_window(scene, None)
    with pytest.raises(ValueError, match=r"contact\.friction"):
        soft_reference(Window(scene=scene).variant("hooke", 1e6))


def test_a_scene_in_which_nobody_touches_is_refused():
    scene = line_at_a_wall(2)
    apart = dataclasses.replace(scene.snapshot, position=[[-1.0, 0.0], [-3.0, 0.0]])
    impact = scene.model_copy(update={"snapshot": apart, "drive": None})
    with pytest.raises(ValueError, match="nobody touches"):
        prepare_window(impact, None)


def test_a_kept_reference_is_taken_only_for_the_same_scene(tmp_path):
    window = impact_window(make("pair"))
    first = kept_reference(window.variant("hooke", 1e6), tmp_path / "kept")
    again = kept_reference(window.variant("hooke", 1e6), tmp_path / "kept")
    assert np.array_equal(first.motion.velocity, again.motion.velocity)
    other = kept_reference(window.variant("hooke", 1e6).with_contact(restitution=0.5), tmp_path / "kept")
    assert not np.array_equal(first.motion.velocity, other.motion.velocity)
    (tmp_path / "kept.npz").write_bytes(b"broken")
    healed = kept_reference(window.variant("hooke", 1e6), tmp_path / "kept")
    assert np.array_equal(first.motion.velocity, healed.motion.velocity)


def test_points_go_through_their_file(tmp_path):
    failed = dataclasses.replace(
        POINT, status=PointStatus.FAILED, numerical_error=None, total_error=None, reason="lost"
    )
    write_points(tmp_path, [POINT, failed])
    assert read_points(tmp_path / "points.json") == [POINT, failed]
    assert (tmp_path / "points.csv").read_text().splitlines()[0].split(",")[5:7] == [
        "time_step_s",
        "time_step_share",
    ]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda p: p.pop("status"), "status: missing"),
        (lambda p: p.update(colour="red"), "colour: unknown"),
        (lambda p: p.update(status="fine"), "status: 'fine'"),
    ],
)
def test_broken_points_are_named(tmp_path, change, says):
    write_points(tmp_path, [POINT])
    content = json.loads((tmp_path / "points.json").read_text())
    change(content["points"][0])
    (tmp_path / "points.json").write_text(json.dumps(content))
    with pytest.raises(ValueError, match=says):
        read_points(tmp_path / "points.json")
    with pytest.raises(ValueError, match="percussions chart"):
        read_points(tmp_path / "none.json")


def at(cpu, error, **more):
    return dataclasses.replace(POINT, cpu_seconds=cpu, total_error=error, numerical_error=error, **more)


def test_pareto_front_by_hand():
    best = [at(1.0, 0.5), at(2.0, 0.1), at(5.0, 0.01)]
    beaten = [at(6.0, 0.0099), at(1.5, 0.5), at(2.0, 0.2), at(9.0, 0.01)]
    useless = [at(0.1, 1e-9, status=PointStatus.INACCURATE), at(0.1, None, status=PointStatus.FAILED)]
    assert pareto_front([*beaten, *useless, *reversed(best)]) == best
    assert pareto_front(useless) == []
    # errors that cancel win nothing
    lucky = dataclasses.replace(
        POINT, cpu_seconds=0.5, numerical_error=0.9, model_error=0.9, total_error=1e-6
    )
    assert pareto_front([*best, lucky])[1:] == best


def test_cheapest_within_an_accuracy_by_hand():
    other = {"method": "yade"}
    points = [
        at(1.0, 0.5),
        at(3.0, 1e-3),
        at(2.0, 5e-3),
        at(0.1, 1e-3, status=PointStatus.INACCURATE),
        at(4.0, 0.5, **other),
    ]
    assert cheapest(points, 0.01) == [points[2]]


def test_pictures_show_points_that_failed_and_methods_they_do_not_know():
    window = impact_window(make("pair"))
    quantity = CONTACT_IMPULSE
    points = [
        POINT,
        at(0.3, None, status=PointStatus.FAILED),
        at(0.3, 7.0, status=PointStatus.INACCURATE, stiffness_N_per_m=1e8),
        at(1e-4, 0.0, method="rigid", law="", solver="auto", stiffness_N_per_m=None, tolerance=1e-8),
        at(0.5, 0.01, method="continuum", law="deformable", stiffness_N_per_m=None, mesh_side_m=0.3),
        at(0.5, 0.01, method="a new one", law="", stiffness_N_per_m=None, time_step_s=None),
    ]
    figure = work_precision_picture(points, quantity, window.scene.name)
    assert len(figure.axes) == 3
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "continuum (11), deformable" in labels
    assert "a new one" in labels
    crosses = [line for line in figure.axes[0].lines if line.get_marker() == "x"]
    assert len(crosses) == 2
    assert scaling_picture(points[:1], 0.01).axes


RADIUS, ROWS, COLUMNS = 0.2, 4, 10


def dead_end(gap=0.0):
    """40 disks of 75 kg fill a dead end, 1.6 m wide with its end at x = 0. The door that they want to walk to at 2 m/s (τ =
    0.5 s) is so far away behind that end that all want to walk along x. gap (m): how far the last half of them is from
    the rest."""
    column, row = (k.ravel() for k in np.meshgrid(np.arange(COLUMNS), np.arange(ROWS), indexing="ij"))
    x = -RADIUS * (2 * column + 1) - gap * (column >= COLUMNS // 2)
    far, wide = 1e6, 2 * RADIUS * ROWS
    corners = [
        (far, -2.0), (-12.0, -2.0), (-12.0, wide), (0.0, wide), (0.0, 0.0), (-10.0, 0.0), (-10.0, -1.0), (far, -1.0),
    ]  # fmt: skip
    scene = line_at_a_wall()
    disks = Snapshot(
        position=np.column_stack([x, RADIUS * (2 * row + 1)]),
        velocity=np.zeros((len(x), 2)),
        radius=np.full(len(x), RADIUS),
        mass=np.full(len(x), 75.0),
    )
    walls = tuple(
        Wall(name=f"wall_{number}", start_m=corners[number], end_m=corners[number + 1]) for number in range(7)
    )
    drive = Drive(
        speed_m_per_s=2.0,
        relaxation_time_s=0.5,
        door_start_m=corners[-1],
        door_end_m=corners[0],
        outward=(1.0, 0.0),
    )
    scene = scene.model_copy(update={"snapshot": disks, "walls": walls, "drive": drive})
    return driven_window(scene, disks.position)


def test_the_region_of_a_crowd_reaches_its_walls_and_is_free_behind():
    room = crowd_room(dead_end().scene)
    long, wide = 2 * RADIUS * COLUMNS, 2 * RADIUS * ROWS
    # all but the dents between the disks of the last column
    assert long * wide - ROWS * 0.3 * RADIUS * 2 * RADIUS < room.area < long * wide
    walls = room.pieces("wall")
    # and a little farther along the side walls, where nobody else fits in
    assert np.hypot(*(walls[:, 1] - walls[:, 0]).T).sum() == pytest.approx(2 * long + wide, abs=1.5 * RADIUS)
    assert {tuple(point) for point in room.jambs[:, 1:].tolist()} == {(0.0,), (wide,)}
    assert len(room.pieces("exit")) == 0


def test_first_order_crowd_in_a_dead_end_is_blocked():
    # p = ρU(l + x), u⁺ = 0: everybody pushes with m u_d/τ = 300 N
    window = dead_end()
    answer = solve_continuum(window, ContinuumModel.FIRST_ORDER, 0.5 * RADIUS)
    assert answer.status == PointStatus.OK
    values = answer.values(window)
    force = values[DISK_FORCE].reshape(-1, 2)
    deep = window.scene.snapshot.position[:, 0] > -0.7 * 2 * RADIUS * COLUMNS
    assert force[deep] == pytest.approx(np.tile([-300.0, 0.0], (int(deep.sum()), 1)), abs=0.5)
    assert values[WALL_FORCE] == pytest.approx([40 * 300.0, 0.0], rel=0.01, abs=120.0)
    assert CONTACT_FORCE not in values


def test_deformable_crowd_is_that_of_a_room_drawn_by_hand():
    window = dead_end()
    answer = solve_continuum(window, ContinuumModel.DEFORMABLE, 0.5 * RADIUS)
    long, wide = 2 * RADIUS * COLUMNS, 2 * RADIUS * ROWS
    room = room_of_outline(
        [[0, 0], [0, wide], [-long, wide], [-long, 0]], border=["wall", "wall", "free", "wall"]
    )
    space = Space(mesh_of(room, 0.5 * RADIUS))
    density = ROWS * COLUMNS / room.area
    medium = Medium(density=density, volume_dissipation=9.0, surface_dissipation=1.0, mass_per_person=75.0)
    found = collide(space, medium, window.left_velocity.mean(0))
    # what the walls give: reactions, and k_s w along those that are pressed (not the upper one: the door is a hair below)
    wall, left = space.border("wall"), window.left_velocity.mean(0)
    pressed = np.einsum("k,kfq->fq", left, np.asarray(wall.normals)) >= 0
    rubbed = medium.k_s * (np.asarray(wall.interpolate(found.unknowns)) * pressed * wall.dx).sum((1, 2))
    given = (found.wall_force[:, None] * space.wall.normal).sum(0) + rubbed
    assert answer.wall_impulse == pytest.approx(given, rel=0.01, abs=0.01 * given[0])
    # less than everybody's momentum: this crowd can be compressed
    assert given[0] < 0.6 * 40 * 150.0
    assert -75.0 * answer.change.sum(0) == pytest.approx(answer.wall_impulse, rel=0.02, abs=0.02 * given[0])


def test_scenes_without_a_continuum_say_why():
    def reason(window):
        return continuum_ladder(window, (4.0,), None).reason

    assert "an impact" in reason(impact_window(make("chain", 5)))
    assert "in 2 pieces" in reason(dead_end(gap=2.5 * RADIUS))
    assert "no wall" in reason(away_from_walls())
    line = line_at_a_wall()
    assert "not closed" in reason(driven_window(line, line.snapshot.position))


def away_from_walls():
    """Two touching disks in the middle of a hall with a door."""
    window = dead_end()
    people = window.scene.snapshot
    start = Snapshot(
        position=[[0.0, -6.0], [0.4, -6.0]],
        velocity=np.zeros((2, 2)),
        radius=people.radius[:2],
        mass=people.mass[:2],
    )
    corners = [(5.0, -0.5), (5.0, -10.0), (-5.0, -10.0), (-5.0, 10.0), (5.0, 10.0), (5.0, 0.5)]
    walls = tuple(Wall(name=f"wall_{n}", start_m=a, end_m=b) for n, (a, b) in enumerate(pairwise(corners)))
    drive = window.scene.drive.model_copy(update={"door_start_m": corners[-1], "door_end_m": corners[0]})
    return Window(scene=window.scene.model_copy(update={"snapshot": start, "walls": walls, "drive": drive}))


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    """A window, its ladder, its book, and where the ladder's references are kept."""
    window, path = dead_end(), tmp_path_factory.mktemp("ladder") / "continuum"
    rigid = rigid_reference(window.scene.snapshot, window.contacts, window.left_velocity)
    return (
        window,
        continuum_ladder(window, (4.0, 2.0, 1.0), path),
        Book(window=window, name="end", rigid=rigid),
        path,
    )


def forces(book, ladder):
    """Points of forces: rigid disks that are blocked have no displacement to compare with."""
    points = list(book.of_continuum(ladder))
    assert {p.quantity for p in points} == {"disk_force", "wall_force", "displacement"}
    return [p for p in points if p.unit == "N"]


def test_numerical_error_of_the_continuum_falls_with_the_mesh_and_the_model_error_stays(pressed):
    _, ladder, book, _ = pressed
    points = forces(book, ladder)
    for model in ContinuumModel:
        for quantity in ("disk_force", "wall_force"):
            curve = [p for p in points if p.law == model and p.quantity == quantity]
            assert [p.mesh_side_m for p in curve] == pytest.approx([4 * RADIUS, 2 * RADIUS, RADIUS])
            assert curve[-1].numerical_error < 0.6 * curve[0].numerical_error
            assert curve[-1].numerical_bar < curve[-1].numerical_error
            assert len({p.model_error for p in curve}) == 1
            for p in curve:
                assert p.total_error <= p.numerical_error + p.model_error + 1e-12
                assert p.cpu_seconds > 0
    # rigid disks are blocked as well: (20) is near, (11) is compressed
    models = {(p.law, p.quantity): p.model_error for p in points}
    assert models["first_order", "wall_force"] < 0.02
    assert models["deformable", "wall_force"] > 0.1


def test_references_of_the_continuum_are_kept(pressed, monkeypatch):
    window, ladder, _, path = pressed
    monkeypatch.setattr(ladders, "solve_both", None)
    again = continuum_ladder(window, (1.0,), path)
    for kept, made in zip(again.references, ladder.references, strict=True):
        assert np.array_equal(kept[1].change, made[1].change)


def test_a_continuum_that_is_not_solved_is_visible(pressed):
    _, ladder, book, _ = pressed
    coarse, fine = ladder.references[0]
    unsure = dataclasses.replace(fine, status=PointStatus.INACCURATE, reason="residual 1 above 0")
    lost = dataclasses.replace(
        ladder.answers[0], change=None, wall_impulse=None, status=PointStatus.FAILED, reason="no mesh"
    )
    points = forces(book, ContinuumLadder(answers=(lost, ladder.answers[1]), references=((coarse, unsure),)))
    assert len(points) == 4
    failed, rest = points[:2], points[2:]
    assert [(p.status, p.reason, p.error_sum) for p in failed] == [(PointStatus.FAILED, "no mesh", None)] * 2
    for p in rest:
        assert "residual 1 above 0" in p.reason
        assert p.numerical_error is None
        assert p.total_error is not None
    off = dataclasses.replace(ladder.answers[1], change=9.0 * ladder.answers[1].change)
    wrong = forces(book, ContinuumLadder(answers=(off,), references=ladder.references))[0]
    assert wrong.status == PointStatus.INACCURATE
    assert "too coarse" in wrong.reason
