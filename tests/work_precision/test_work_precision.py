"""Work against precision: the references against closed forms, quantities against balance, fronts
by hand."""

import dataclasses
import json
from fractions import Fraction

import numpy as np
import pytest

from analysis.engines.penalty import damping_ratio_for, restitution_of
from analysis.scene.shipped_scenes import make
from analysis.studies.stability.cases.percussions import exact_line
from analysis.studies.work_precision.chart import cheapest
from analysis.studies.work_precision.charts import APART, scaling_picture, work_precision_picture
from analysis.studies.work_precision.point import Point, PointStatus, pareto_front, read_points

from analysis.studies.work_precision.point import write_points  # isort: skip
from analysis.studies.work_precision.rigid_solves import solve_rigid, solve_rivals
from analysis.studies.work_precision.soft import kept_reference, prepare_window, soft_reference
from analysis.studies.work_precision.window import (
    CONTACT_FORCE,
    CONTACT_IMPULSE,
    DISK_IMPULSE,
    DISPLACEMENT,
    WALL_FORCE,
    Window,
    driven_window,
    impact_window,
    relative_error,
    rigid_reference,
)
from tests.refusals import refusals
from tests.work_precision.wall_line import line_at_a_wall

POINT = Point(
    scene="pair", disks=2, method="lammps", law="hooke", solver="", time_step_s=1e-5, time_step_share=1.0,
    stiffness_N_per_m=1e6, tolerance=None, cpu_seconds=0.2, quantity="contact_impulse", unit="N·s", numerical_error=1e-3,
    numerical_bar=1e-7, model_error=0.02, model_bar=1e-7, total_error=0.021, status=PointStatus.OK, reason="",
    machine="a machine", date="2025-01-01",
)  # fmt: skip


def reference_of(window, *law):
    return rigid_reference(window.scene.snapshot, window.contacts, window.left_velocity, *law)


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
    solution = reference_of(window)
    assert "closed form" in solution.origin
    values = window.quantities(window.rigid_motion(solution.right_velocity), 1e6)
    assert sorted(values[CONTACT_FORCE]) == pytest.approx([300.0, 600.0, 900.0], rel=1e-12)
    assert not values[DISPLACEMENT].any()


def test_quantities_of_four_disks_are_the_percussions_of_the_paper():
    window = impact_window(make("four_disks"))
    solution = reference_of(window)
    values = window.quantities(window.rigid_motion(solution.right_velocity), 1e6)
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
    solution = rigid_reference(snapshot, window.contacts, -window.left_velocity)
    assert "least squares" in solution.origin
    assert solution.right_velocity == pytest.approx(-window.left_velocity, abs=1e-12)


def test_restitution_is_part_of_the_rigid_model():
    """Two disks at e = 0.5 pass on 37.5 · 1.5 · 2 N·s, and soft contacts of that restitution do the
    same: without it in the model, they would seem to be 50 % off."""
    window = impact_window(make("pair").with_contact(restitution=0.5))
    exact = reference_of(window, window.law)
    impulse = window.rigid_values(exact.right_velocity)[CONTACT_IMPULSE]
    assert impulse == pytest.approx([112.5], rel=1e-12)
    soft = window.quantities(soft_reference(window.variant("hooke", 1e6)).motion, 1e6)
    assert relative_error(soft[CONTACT_IMPULSE], impulse, impulse) < 1e-4
    for solution in solve_rigid(window):
        assert solution.values[CONTACT_IMPULSE] == pytest.approx([112.5], rel=1e-2)


@pytest.mark.parametrize("restitution", [0.1, 0.6])
def test_the_reference_of_a_line_with_restitution_is_that_of_exact_arithmetic(restitution):
    window = impact_window(make("chain_masses", 5, seed=3).with_contact(restitution=restitution))
    snapshot, contacts = window.scene.snapshot, window.contacts
    found = rigid_reference(snapshot, contacts, window.left_velocity, window.law)
    k = window.law.coefficients(contacts.inverse_mass(snapshot.mass))[0]
    order, along = np.argsort(snapshot.position[:, 0]), np.argsort(contacts.point[:, 0])
    exact, _ = exact_line(
        [int(m) for m in snapshot.mass[order]],
        [Fraction(float(u)) for u in window.left_velocity[order, 0]],
        [Fraction(float(c)) for c in k[along]],
    )
    right = found.right_velocity[order, 0]
    assert right == pytest.approx([float(u) for u in exact], abs=1e-12)


def test_a_pressed_crowd_has_no_restitution():
    scene = line_at_a_wall()
    window = driven_window(scene, scene.snapshot.position)
    assert scene.contact.restitution > 0
    assert window.law.restitution is None


@pytest.mark.parametrize("restitution", [0.0, 0.05])
def test_every_solver_is_within_its_tolerance_of_the_reference(restitution):
    window = impact_window(make("corridor").with_contact(restitution=restitution))
    reference = reference_of(window, window.law)
    exact = window.quantities(window.rigid_motion(reference.right_velocity), 1e6)
    for solution in solve_rigid(window):
        assert solution.status == PointStatus.OK, solution
        for quantity, values in exact.items():
            error = relative_error(solution.values[quantity], values, values)
            # the condition of this scene's contacts is about 60
            assert error < 60 * solution.tolerance + 1e-9, solution
    assert [solved.method for solved in solve_rivals(window)] == ["first_order"]


def test_rivals_of_a_driven_crowd_are_forces():
    scene = line_at_a_wall()
    window = driven_window(scene, scene.snapshot.position)
    found = {solution.method: solution for solution in solve_rivals(window)}
    assert set(found) == {"first_order", "social_force", "loehner_printed", "loehner_text"}
    # at touch and with equal radii Löhner's law as printed gives f_max/5, f_max = m u_d/τ = 300 N;
    # a wall is at one radius
    pairs = ~window.contacts.is_wall
    assert found["loehner_printed"].values[CONTACT_FORCE][pairs] == pytest.approx([60.0, 60.0])


LINE, PAIR = line_at_a_wall(2), make("pair")
AWAY = dataclasses.replace(LINE.snapshot, position=[[-1.0, 0.0], [-3.0, 0.0]])
APART_ALL = LINE.model_copy(update={"snapshot": AWAY, "drive": None})
RUBBING, ELASTIC = PAIR.with_contact(friction=0.5), PAIR.with_contact(restitution=1.0)
test_scenes_without_a_chart_are_refused_by_name = refusals(
    (lambda: prepare_window(RUBBING, None), r"contact\.friction"),
    (lambda: soft_reference(Window(scene=RUBBING).variant("hooke", 1e6)), r"contact\.friction"),
    (lambda: prepare_window(APART_ALL, None), "nobody touches"),
    (lambda: prepare_window(ELASTIC, None), r"contact\.restitution: 1"),
)


def test_a_kept_reference_is_taken_only_for_the_same_scene(tmp_path):
    window = impact_window(make("pair"))
    first, again = (kept_reference(window, "hooke", 1e6, tmp_path) for _ in range(2))
    assert np.array_equal(first.own[DISK_IMPULSE], again.own[DISK_IMPULSE])
    bouncing = impact_window(make("pair").with_contact(restitution=0.5))
    other = kept_reference(bouncing, "hooke", 1e6, tmp_path)
    assert not np.array_equal(first.own[DISK_IMPULSE], other.own[DISK_IMPULSE])
    (tmp_path / "reference_hooke_k1e+06.npz").write_bytes(b"broken")
    healed = kept_reference(window, "hooke", 1e6, tmp_path)
    assert np.array_equal(first.own[DISK_IMPULSE], healed.own[DISK_IMPULSE])


def test_the_reference_does_not_pull_at_contacts_that_open():
    """Three in a row: the first runs into the second, the third walks away from it, as if the third
    were not there."""
    row = make("chain", 3).with_contact(restitution=0.5)
    start = dataclasses.replace(row.snapshot, velocity=[[1.0, 0], [0, 0], [2.0, 0]])
    window = impact_window(row.model_copy(update={"snapshot": start}))
    found = rigid_reference(start, window.contacts, window.left_velocity, window.law)
    assert found.right_velocity[:, 0] == pytest.approx([0.25, 0.75, 2.0], abs=1e-12)


def test_points_go_through_their_file(tmp_path):
    failed = at(0.2, None, status=PointStatus.FAILED, reason="lost")
    write_points(tmp_path, [POINT, failed])
    assert read_points(tmp_path / "points.json") == [POINT, failed]
    head = (tmp_path / "points.csv").read_text().splitlines()[0].split(",")
    assert head[5:7] == ["time_step_s", "time_step_share"]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda p: p.pop("status"), r"status: Field required"),
        (lambda p: p.update(colour="red"), "colour: unknown key"),
        (lambda p: p.update(status="fine"), "status: Input should be 'ok'"),
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
    errors = {"total_error": error, "numerical_error": error}
    return dataclasses.replace(POINT, cpu_seconds=cpu, **errors | more)


def test_pareto_front_by_hand():
    best = [at(1.0, 0.5), at(2.0, 0.1), at(5.0, 0.01)]
    beaten = [at(6.0, 0.0099), at(1.5, 0.5), at(2.0, 0.2), at(9.0, 0.01)]
    states = {PointStatus.INACCURATE: 1e-9, PointStatus.FAILED: None}
    useless = [at(0.1, error, status=status) for status, error in states.items()]
    assert pareto_front([*beaten, *useless, *reversed(best)]) == best
    assert pareto_front(useless) == []
    # errors that cancel win nothing
    lucky = at(0.5, 0.9, model_error=0.9, total_error=1e-6)
    assert pareto_front([*best, lucky])[1:] == best


def test_cheapest_within_an_accuracy_by_hand():
    points = [at(1.0, 0.5), at(3.0, 1e-3), at(2.0, 5e-3), at(4.0, 0.5, method="yade")]
    points.append(at(0.1, 1e-3, status=PointStatus.INACCURATE))
    assert cheapest(points, 0.01) == [points[2]]


def test_pictures_show_points_that_failed_and_methods_they_do_not_know():
    window = impact_window(make("pair"))
    quantity = CONTACT_IMPULSE
    no = {"stiffness_N_per_m": None}
    points = [
        POINT,
        at(0.3, None, status=PointStatus.FAILED),
        at(0.3, 7.0, status=PointStatus.INACCURATE, stiffness_N_per_m=1e8),
        at(1e-4, 0.0, method="rigid", law="", solver="auto", tolerance=1e-8, **no),
        at(0.5, 0.01, method="continuum", law="deformable", mesh_side_m=0.3, **no),
        at(0.5, 0.01, method="a new one", law="", time_step_s=None, **no),
    ]
    figure = work_precision_picture(points, quantity, window.scene.name)
    assert len(figure.axes) == 3
    for axes in figure.axes:
        labels = [text.get_text() for text in axes.texts]
        assert "continuum (11), deformable" in labels
        assert "a new one" in labels
        heights = sorted(text.xyann[1] for text in axes.texts)
        assert min(np.diff(heights)) > 0.99 * APART
    crosses = [line for line in figure.axes[0].lines if line.get_marker() == "x"]
    assert len(crosses) == 2
    assert scaling_picture(points[:1], 0.01).axes
