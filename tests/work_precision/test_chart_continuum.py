"""The continuum models on the chart: the region of a crowd, their two errors, and scenes without
them."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from analysis.scene.scene import Wall
from analysis.scene.shipped_scenes import make
from analysis.studies.work_precision import continuum as ladders
from analysis.studies.work_precision.continuum import ContinuumModel, continuum_ladder, converged

from analysis.studies.work_precision.continuum import crowd_room, solve_continuum  # isort: skip
from analysis.studies.work_precision.point import PointStatus
from analysis.studies.work_precision.window import (
    CONTACT_FORCE,
    DISK_FORCE,
    WALL_FORCE,
    Judge,
    Window,
    driven_window,
    impact_window,
    rigid_reference,
)
from nscd.continuum.collision import collide
from nscd.continuum.medium import table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.room import room_of_outline
from nscd.continuum.space import Space
from tests.crowds import disks_at, drive_to
from tests.work_precision.wall_line import line_at_a_wall

RADIUS, ROWS, COLUMNS = 0.2, 4, 10


def dead_end(gap=0.0):
    """40 disks of 75 kg fill a dead end, 1.6 m wide with its end at x = 0. The door that they want
    to walk to at 2 m/s (τ = 0.5 s) is so far away behind that end that all want to walk along x.
    gap (m): how far the last half of them is from the rest."""
    column, row = (k.ravel() for k in np.indices((COLUMNS, ROWS)))
    x = -RADIUS * (2 * column + 1) - gap * (column >= COLUMNS // 2)
    far, width = 1e6, 2 * RADIUS * ROWS
    corners = [
        (far, -2.0), (-12.0, -2.0), (-12.0, width), (0.0, width), (0.0, 0.0), (-10.0, 0.0), (-10.0, -1.0), (far, -1.0),
    ]  # fmt: skip
    scene = line_at_a_wall()
    disks = disks_at(np.column_stack([x, RADIUS * (2 * row + 1)]), radius=RADIUS)
    drive = drive_to(corners[-1], corners[0])
    changes = {"snapshot": disks, "walls": along(corners), "drive": drive}
    return driven_window(scene.model_copy(update=changes), disks.position)


def along(corners):
    """Walls from corner to corner."""
    pairs = enumerate(pairwise(corners))
    return tuple(Wall(name=f"wall_{n}", start_m=a, end_m=b) for n, (a, b) in pairs)


def test_the_region_of_a_crowd_reaches_its_walls_and_is_free_behind():
    room = crowd_room(dead_end().scene)
    long, width = 2 * RADIUS * COLUMNS, 2 * RADIUS * ROWS
    # all but the dents between the disks of the last column
    assert long * width - ROWS * 0.3 * RADIUS * 2 * RADIUS < room.area < long * width
    walls = room.pieces("wall")
    # and a little farther along the side walls, where nobody else fits in
    length = np.hypot(*(walls[:, 1] - walls[:, 0]).T).sum()
    assert length == pytest.approx(2 * long + width, abs=1.5 * RADIUS)
    assert {tuple(point) for point in room.jambs[:, 1:].tolist()} == {(0.0,), (width,)}
    assert len(room.pieces("exit")) == 0


def test_first_order_crowd_in_a_dead_end_is_blocked():
    # p = ρU(l + x), u⁺ = 0: everybody pushes with m u_d/τ = 300 N
    window = dead_end()
    solution = solve_continuum(window, ContinuumModel.FIRST_ORDER, 0.5 * RADIUS)
    assert solution.status == PointStatus.OK
    values = solution.values
    force = values[DISK_FORCE].reshape(-1, 2)
    deep = window.scene.snapshot.position[:, 0] > -0.7 * 2 * RADIUS * COLUMNS
    assert force[deep] == pytest.approx(np.tile([-300.0, 0.0], (int(deep.sum()), 1)), abs=0.5)
    assert values[WALL_FORCE] == pytest.approx([40 * 300.0, 0.0], rel=0.01, abs=120.0)
    assert CONTACT_FORCE not in values


def test_deformable_crowd_is_that_of_a_room_drawn_by_hand():
    window = dead_end()
    solution = solve_continuum(window, ContinuumModel.DEFORMABLE, 0.5 * RADIUS)
    long, width = 2 * RADIUS * COLUMNS, 2 * RADIUS * ROWS
    corners = [[0, 0], [0, width], [-long, width], [-long, 0]]
    room = room_of_outline(corners, border=["wall", "wall", "free", "wall"])
    space = Space(mesh_of(room, 0.5 * RADIUS))
    density = ROWS * COLUMNS / room.area
    medium = table_1_medium(density)
    found = collide(space, medium, window.left_velocity.mean(0))
    # what the walls give: reactions, and k_s w along those that are pressed (not the upper one: the
    # door is a hair below)
    wall, left = space.border("wall"), window.left_velocity.mean(0)
    pressed = np.einsum("k,kfq->fq", left, np.asarray(wall.normals)) >= 0
    slip = np.asarray(wall.interpolate(found.unknowns))
    friction_loss = medium.k_s * (slip * pressed * wall.dx).sum((1, 2))
    inputs = (found.wall_force[:, None] * space.wall.normal).sum(0) + friction_loss
    tau = window.scene.drive.relaxation_time_s
    impulse = tau * solution.values[WALL_FORCE]
    assert impulse == pytest.approx(inputs, rel=0.01, abs=0.01 * inputs[0])
    # less than everybody's momentum: this crowd can be compressed
    assert inputs[0] < 0.6 * 40 * 150.0
    received = tau * solution.values[DISK_FORCE].reshape(-1, 2).sum(0)
    assert -received == pytest.approx(impulse, rel=0.02, abs=0.02 * inputs[0])


def test_scenes_without_a_continuum_say_why():
    def reason(window):
        return continuum_ladder(window, (4.0,), None)[1]

    assert "an impact" in reason(impact_window(make("chain", 5)))
    assert "in 2 pieces" in reason(dead_end(gap=2.5 * RADIUS))
    assert "no wall" in reason(away_from_walls())
    line = line_at_a_wall()
    assert "not closed" in reason(driven_window(line, line.snapshot.position))


def away_from_walls():
    """Two touching disks in the middle of a hall with a door."""
    window = dead_end()
    people = window.scene.snapshot
    start = disks_at([[0.0, -6.0], [0.4, -6.0]], radius=people.radius[:2], mass=people.mass[:2])
    corners = [(5.0, -0.5), (5.0, -10.0), (-5.0, -10.0), (-5.0, 10.0), (5.0, 10.0), (5.0, 0.5)]
    ends = {"door_start_m": corners[-1], "door_end_m": corners[0]}
    drive = window.scene.drive.model_copy(update=ends)
    changes = {"snapshot": start, "walls": along(corners), "drive": drive}
    return Window(scene=window.scene.model_copy(update=changes))


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    """A window, its ladder, its judge, and where the ladder's references are kept."""
    window, path = dead_end(), tmp_path_factory.mktemp("ladder") / "continuum"
    rigid = rigid_reference(window.scene.snapshot, window.contacts, window.left_velocity)
    ladder = continuum_ladder(window, (4.0, 2.0, 1.0), path)[0]
    return window, ladder, Judge(window=window, name="end", rigid=rigid), path


def forces(judge, ladder):
    """Points of forces: rigid disks that are blocked have no displacement to compare with."""
    points = [p for solution in ladder for p in judge.points(solution)]
    assert {p.quantity for p in points} == {"disk_force", "wall_force", "displacement"}
    return [p for p in points if p.unit == "N"]


def test_numerical_error_of_the_continuum_falls_with_the_mesh_and_the_model_error_stays(pressed):
    _, ladder, judge, _ = pressed
    points = forces(judge, ladder)
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
    solve = ladders.solve_models

    def coarse(window, side_m, *models):
        assert side_m >= RADIUS  # the references have finer meshes
        return solve(window, side_m, *models)

    monkeypatch.setattr(ladders, "solve_models", coarse)
    again, _ = continuum_ladder(window, (1.0,), path)
    made = {solution.law: solution.model for solution in ladder}
    for selected in again:
        for quantity, values in made[selected.law].own.items():
            assert np.array_equal(selected.model.own[quantity], values)


def test_a_continuum_that_is_not_solved_is_visible(pressed):
    _, ladder, judge, _ = pressed
    why = {"status": PointStatus.INACCURATE, "reason": "residual 1 above 0"}
    unsure = replace(ladder[0], **why)
    lost, rest = (replace(solution, model=converged(solution, unsure)) for solution in ladder[:2])
    lost = replace(lost, values=None, status=PointStatus.FAILED, reason="no mesh")
    points = forces(judge, [lost, rest])
    assert len(points) == 4
    failed, rest = points[:2], points[2:]
    for p in failed:
        assert (p.status, p.reason, p.error_sum) == (PointStatus.FAILED, "no mesh", None)
    for p in rest:
        assert "residual 1 above 0" in p.reason
        assert p.numerical_error is None
        assert p.total_error is not None
    large = {quantity: 9.0 * value for quantity, value in ladder[1].values.items()}
    wrong = forces(judge, [replace(ladder[1], values=large)])[0]
    assert wrong.status == PointStatus.INACCURATE
    assert "too coarse" in wrong.reason
