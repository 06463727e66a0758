"""The bridge study: packings, (20) with friction against conic optimisation and without, the
section of a small plan."""

import numpy as np
import pytest
import scipy.sparse as sparse

from analysis.studies.paper.continuum import bridge
from analysis.studies.paper.continuum.bridge import (
    HALF_DOOR,
    FittedCrowd,
    Packing,
    area,
    crowd_size,
)

from analysis.studies.paper.continuum.bridge import to_exit, toward_exit  # isort: skip
from analysis.scene.packing import heap, press
from nscd import Walls, find_contacts, solve
from nscd.continuum.rivals.cells import Cells
from nscd.continuum.rivals.first_order import first_order_flow, frictional_flow
from tests.crowds import disks_at
from tests.pages.browser import says_little
from tests.refusals import refusals

N, MEAN = 300, 0.2
SHUT = Walls(start=[[0, -50]], end=[[0, 50]])


def snapshot(position, radius):
    return disks_at(position, toward_exit(position), radius, 100 * radius**2)


def test_a_heap_is_just_rigid_and_has_no_overlaps():
    """Every disk after the first touches two earlier ones, or one and the wall; the same seed gives
    the same heap."""
    position, radius = heap(N, 3, MEAN, HALF_DOOR)
    contacts = find_contacts(snapshot(position, radius), SHUT, tolerance=1e-9)
    assert contacts.gap.min() > -1e-12
    later = np.where(contacts.is_wall, contacts.first, np.maximum(contacts.first, contacts.second))
    assert (np.bincount(later, minlength=N)[1:] >= 2).all()
    assert len(contacts) <= 2 * N
    assert radius.mean() == pytest.approx(MEAN, rel=0.02)
    np.testing.assert_array_equal(position, heap(N, 3, MEAN, HALF_DOOR)[0])
    assert np.abs(position - heap(N, 4, MEAN, HALF_DOOR)[0]).max() > 0.1


def test_a_pressed_crowd_carries_its_push_before_the_shut_door():
    """Its percussions stop everybody, which the heap's do not."""
    position, radius = heap(N, 1, MEAN, HALF_DOOR)
    pressed, rested = press(position, radius, HALF_DOOR, 0.02)
    assert rested
    selected = []
    for location, tolerance in ((position, 1e-9), (pressed, 0.0)):
        crowd = snapshot(location, radius)
        contacts = find_contacts(crowd, SHUT, tolerance=tolerance)
        solution = solve(crowd, contacts)
        assert solution.status == "solved"
        selected.append((solution.right_velocity**2).sum() / (crowd.velocity**2).sum())
    assert selected[0] > 0.02
    assert selected[1] < 1e-3


test_packings_refuse_bad_input = refusals(
    (lambda: heap(0, 1, MEAN, HALF_DOOR), "n: 0"),
    (lambda: heap(3, 1, -1.0, HALF_DOOR), r"mean_radius: -1\.0 m"),
    (lambda: press(*heap(3, 1, MEAN, HALF_DOOR), HALF_DOOR, 0.0), "softness: 0"),
)


def test_the_size_of_an_even_crowd_is_found():
    rng = np.random.default_rng(0)
    everywhere = np.column_stack([rng.uniform(-9, 0, 200_000), rng.uniform(-9, 9, 200_000)])
    inside = everywhere[to_exit(everywhere) < 6.0]
    assert crowd_size(inside) == pytest.approx(6.0, rel=5e-3)
    assert len(inside) / 200_000 * 9 * 18 == pytest.approx(area(6.0), rel=1e-2)


@pytest.fixture(scope="module")
def crowd():
    previous, bridge.MESH = bridge.MESH, 0.6
    made = FittedCrowd(6.0)
    _ = made.mesh
    bridge.MESH = previous
    return made


def retained_energy(flow, cells, desired):
    return (cells.measure @ (flow.right_velocity**2).sum(1)) / (cells.measure @ (desired**2).sum(1))


def test_without_friction_it_is_the_place_equation(crowd):
    expected = first_order_flow(crowd.mesh, toward_exit)
    inputs = crowd.mesh, crowd.density, expected.desired_velocity
    flow = frictional_flow(*inputs, 0.0, tolerance=1e-9)
    assert flow.status == expected.status == "solved"
    np.testing.assert_allclose(flow.right_velocity, expected.right_velocity, atol=1e-6)
    pressure, near = crowd.density * expected.pressure, 1e-5 * flow.stress.max()
    np.testing.assert_allclose(flow.stress[:, 0], pressure, atol=near)


def test_friction_blocks_more_and_more(crowd):
    cells = Cells(crowd.mesh)
    desired = first_order_flow(crowd.mesh, toward_exit).desired_velocity
    fractions = []
    for friction in (0.0, 0.1, 0.3, 0.6):
        flow = frictional_flow(crowd.mesh, crowd.density, desired, friction)
        assert flow.status == "solved"
        p, a, b = flow.stress.T
        assert (np.hypot(a, b) <= friction * p * (1 + 1e-9)).all()
        fractions.append(retained_energy(flow, cells, desired))
    assert fractions == sorted(fractions, reverse=True)
    assert fractions[-1] < 0.1 * fractions[0]


def test_friction_agrees_with_conic_optimisation(crowd):
    """The dual, over velocities in the cells that spread as much as they shear, by an
    interior-point solver."""
    clarabel = pytest.importorskip("clarabel", reason="the conic solver of `bench` is the oracle")
    friction, mesh, cells = 0.3, crowd.mesh, Cells(crowd.mesh)
    desired = first_order_flow(crowd.mesh, toward_exit).desired_velocity
    weight = cells.measure
    # ∫u·∇φ ≤ 0 says that the crowd spreads at a vertex
    gx, gy = (g.T @ sparse.diags_array(weight) for g in cells.slopes)
    wall = np.zeros(mesh.nvertices, dtype=bool)
    wall[mesh.facets[:, mesh.boundaries["wall"]]] = True
    rows, cones = [], []
    pairs = [gx, gy], [gx, -gy], [gy, gx]
    spread, shear, turn = (sparse.csr_array(sparse.hstack(pair)) for pair in pairs)
    for i in np.flatnonzero(~cells.open):
        parts = [spread[[i]], friction * shear[[i]]] + ([] if wall[i] else [friction * turn[[i]]])
        rows += parts
        cones.append(clarabel.SecondOrderConeT(len(parts)))
    matrix = sparse.csc_matrix(sparse.vstack(rows))
    double = np.tile(weight, 2)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    problem = (sparse.csc_matrix(sparse.diags_array(double)), -double * desired.T.ravel(), matrix)
    solution = clarabel.DefaultSolver(*problem, np.zeros(matrix.shape[0]), cones, settings).solve()
    expected = np.array(solution.x).reshape(2, -1).T
    flow = frictional_flow(mesh, crowd.density, desired, friction, tolerance=1e-7)
    missed = weight @ ((flow.right_velocity - expected) ** 2).sum(1)
    assert np.sqrt(missed) < 1e-4 * np.sqrt(weight @ (expected**2).sum(1))


def test_the_section_of_a_small_plan(monkeypatch, tmp_path):
    monkeypatch.setattr(bridge, "VOLUMES", (1e3, 1e4))
    monkeypatch.setattr(bridge, "FRICTIONS", (0.2,))
    monkeypatch.setattr(bridge, "MESH", 0.8)
    observed = []
    plan = {Packing.TOUCHING: {150: 2, 300: 1}, Packing.PRESSED: {150: 2, 300: 1}}
    section = bridge.build(lambda what, fraction: observed.append((what, fraction)), plan)
    assert observed[-1] == ("crowds", 1.0)
    assert not section.warnings
    assert len(section.pictures) == 3
    says_little(section, tmp_path)
    for table in section.tables:
        assert {len(row) for row in table.rows} == {len(table.head)}
    status = section.tables[0].head.index("status")
    assert {row[status] for row in section.tables[0].rows} == {"solved"}
    assert any(words.startswith("Pressed: from 150 to 300 disks") for words in section.words)
    # the fitted parameters are numbers, not read back from a name
    fitted = {section.tables[1].head.index(name) for name in ("s", "k~v~ (kg)")}
    assert {row[i] for row in section.tables[1].rows for i in fitted} <= {0.0, 0.2, 1e3, 1e4}
    energy = {row[0]: row[4] for row in section.tables[0].rows}
    assert energy["nobody moves"] == "0.000"
    assert energy["u⁺ = u⁻"] == "1.000"
