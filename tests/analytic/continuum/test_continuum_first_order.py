"""The first-order model (20), as complementarity and as printed, against closed forms and other
solvers."""

import numpy as np
import pytest
from scipy.optimize import isotonic_regression, nnls
from skfem import MeshTri, MeshTri2

from nscd.continuum.closed_forms import chain_mesh
from nscd.continuum.left_velocity import toward_exit
from nscd.continuum.mesh import mesh_of
from nscd.continuum.rivals.cells import Cells
from nscd.continuum.rivals.first_order import PlaceEquation, first_order_flow
from nscd.continuum.room import room_of_outline, square_room
from nscd.percussions import Status

U = 1.7
INNER, OUTER = 0.5, 5.0


def half_annulus(cells, outer):
    """INNER ≤ r ≤ OUTER, x ≤ 0: a straight wall with an exit as inner arc; the outer arc is
    `outer`."""
    s, t = np.linspace(0, 1, 2 * cells + 1), np.linspace(0, 1, 3 * cells + 1)
    flat = MeshTri.init_tensor(s, t)
    r, angle = INNER * (OUTER / INNER) ** flat.p[0], np.pi * (0.5 + flat.p[1])
    mesh = MeshTri(np.stack([r * np.cos(angle), r * np.sin(angle)]), flat.t)
    at = lambda value: flat.facets_satisfying(lambda x: np.isclose(x[0], value))  # noqa: E731
    straight = np.setdiff1d(flat.boundary_facets(), np.concatenate([at(0.0), at(1.0)]))
    names = {"wall": straight, "exit": at(0.0), "free": np.zeros(0, dtype=np.int64)}
    names[outer] = np.union1d(names[outer], at(1.0))
    return mesh.with_boundaries(names)


def to_centre(points):
    return -U * points / np.linalg.norm(points, axis=1)[:, None]


@pytest.fixture(scope="module")
def room():
    return square_room(6.0, 1.0)


@pytest.mark.parametrize(
    ("equation", "share"), [("complementarity", 1.0), ("equality", 1.0), ("printed", 0.0)]
)
def test_crowd_that_walks_into_a_wall(equation, share):
    """p = Ux and u⁺ = 0; as printed nobody is pressed and everybody walks through."""
    mesh = chain_mesh(10.0, 40)
    flow = first_order_flow(mesh, [U], equation=equation)
    assert flow.status is Status.SOLVED
    np.testing.assert_allclose(flow.pressure, share * U * mesh.p[0], atol=1e-11)
    np.testing.assert_allclose(flow.right_velocity, (1 - share) * U, atol=1e-11)


@pytest.mark.parametrize(
    ("equation", "share"), [("complementarity", 0.0), ("equality", -1.0), ("printed", 0.0)]
)
def test_crowd_that_leaves_a_wall(equation, share):
    """With p ≥ 0 it goes; the equality's wall pulls it back, p = −Ux."""
    mesh = chain_mesh(10.0, 40)
    flow = first_order_flow(mesh, [-U], equation=equation)
    assert flow.status is Status.SOLVED
    np.testing.assert_allclose(flow.pressure, share * U * mesh.p[0], atol=1e-11)
    assert flow.pressed.any() == (equation != "complementarity")


def test_chain_is_an_isotonic_regression():
    """In one dimension u⁺ is the nearest speed that nowhere falls and is ≤ 0 at the wall:
    min(isotonic regression, 0)."""
    rng = np.random.default_rng(3)
    for cells in (5, 40, 150):
        speed = rng.normal(0.0, 1.0, cells)
        flow = first_order_flow(chain_mesh(4.0, cells), speed[:, None])
        assert flow.status is Status.SOLVED
        expected = np.minimum(isotonic_regression(speed).x, 0.0)
        np.testing.assert_allclose(flow.right_velocity[:, 0], expected, atol=1e-10)
        assert (flow.pressure >= 0).all()


LOG = np.log(OUTER / INNER)
RADIAL = {
    ("complementarity", "wall"): lambda r: (
        U * ((OUTER - INNER) * np.log(r / INNER) / LOG - (r - INNER))
    ),
    ("complementarity", "free"): lambda r: (
        U * ((OUTER - INNER) * np.log(r / INNER) / LOG - (r - INNER))
    ),
    ("equality", "wall"): lambda r: -U * (r - INNER),
    ("printed", "wall"): lambda r: U * (OUTER * np.log(r / INNER) - (r - INNER)),
}


@pytest.mark.parametrize(("equation", "outer"), RADIAL)
def test_half_annulus_with_the_logarithm(equation, outer):
    """u_d = −U r̂: p(r) in closed form, at observed order 2 in L²; the wall that people leave
    carries nothing."""
    errors = []
    for cells in (4, 8, 16):
        mesh = half_annulus(cells, outer)
        flow = first_order_flow(mesh, to_centre, equation=equation)
        assert flow.status is Status.SOLVED
        radius = np.hypot(*mesh.p)
        mass = Cells(mesh).integral((flow.pressure - RADIAL[equation, outer](radius)) ** 2)
        errors.append(np.sqrt(mass.sum()))
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders[-1] == pytest.approx(2.0, abs=0.15)
    if equation == "complementarity":
        assert flow.pressure[np.isclose(radius, OUTER)].max() < 1e-12
        assert 0 < flow.pressed.mean() < 1


def test_room_against_non_negative_least_squares(room):
    """p ≥ 0 minimises ∫|u_d − ∇p|²: a dense NNLS finds the same, also where a crowd spreads."""
    mesh = mesh_of(room, 0.7, grading=1.0)
    cells = Cells(mesh)
    rng = np.random.default_rng(7)
    middle = mesh.p[:, mesh.t].mean(1).T
    spreading = 0.5 * (middle - [-5.0, 0.0]) + rng.normal(0, 0.3, middle.shape)
    for desired in (toward_exit(room, U), spreading):
        flow = first_order_flow(mesh, desired)
        assert flow.status is Status.SOLVED
        inside, root = ~cells.open, np.sqrt(np.tile(cells.measure, 2))
        slopes = np.vstack([g.toarray() for g in cells.slopes])[:, inside]
        found, _ = nnls(root[:, None] * slopes, root * flow.desired_velocity.T.ravel())
        np.testing.assert_allclose(flow.pressure[inside], found, atol=1e-9)
        # u⁺ and ∇p are orthogonal: what is lost is ∫|∇p|²
        energy = [
            cells.measure @ (v**2).sum(1) for v in (flow.desired_velocity, flow.right_velocity)
        ]
        lost = cells.measure @ (cells.gradient(flow.pressure) ** 2).sum(1)
        assert energy[0] == pytest.approx(energy[1] + lost, rel=1e-12)
        assert (cells.moment(flow.right_velocity)[inside] <= 1e-9).all()
    assert 0.1 < flow.pressed.mean() < 0.9


def test_first_order_refuses_bad_input(room):
    mesh = mesh_of(room, 1.5)
    with pytest.raises(ValueError, match="equation: unknown 'exact'"):
        first_order_flow(mesh, [0, U], equation="exact")
    with pytest.raises(ValueError, match=r"^desired_velocity: shape \(3, 2\)"):
        first_order_flow(mesh, np.zeros((3, 2)))
    with pytest.raises(ValueError, match="desired_velocity: the function gives shape"):
        first_order_flow(mesh, lambda x: x[:, 0])
    with pytest.raises(ValueError, match="desired_velocity: values in cells"):
        first_order_flow(mesh, np.zeros((mesh.nelements, 2)), equation=PlaceEquation.PRINTED)
    with pytest.raises(ValueError, match="desired_velocity: not a finite number"):
        first_order_flow(mesh, np.full((mesh.nelements, 2), np.nan))
    with pytest.raises(ValueError, match="tolerance"):
        first_order_flow(mesh, [0, U], tolerance=0)
    closed = mesh_of(room_of_outline([[0, 0], [1, 0], [1, 1], [0, 1]]), 0.5)
    with pytest.raises(ValueError, match="no exit and no free border"):
        first_order_flow(closed, [0, U])
    with pytest.raises(ValueError, match="curved"):
        first_order_flow(MeshTri2.from_mesh(mesh).with_boundaries(mesh.boundaries), [0, U])


def test_first_order_tells_that_it_is_not_solved():
    flow = first_order_flow(half_annulus(8, "free"), to_centre, tolerance=1e-18)
    assert flow.status is Status.INACCURATE
    assert "above 1.0e-18" in flow.reason
