"""The collision in a room: against another solver, by symmetry, units and energy, and what its
pressure means."""

import numpy as np
import pytest
import scipy.sparse as sparse

from nscd.continuum import collision as forms
from nscd.continuum.active_set import bounded_minimum
from nscd.continuum.collision import collide
from nscd.continuum.left_velocity import random_speeds, toward_exit
from nscd.continuum.medium import Medium, table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.pressure import body_fields, body_wall_percussion, largest_pressures

from nscd.continuum.pressure import percussion_density, pressure, stress  # isort: skip
from nscd.continuum.room import room_of_outline, square_room
from nscd.continuum.space import Space
from nscd.percussions import Status
from nscd.stress import Kernel

ROOM = square_room(6.0, 1.0)
PAPER = table_1_medium(person=1.0)
CORNERS, BORDER = [[0, 0], [4, -1], [5, 2], [2, 4], [-1, 2]], ["wall"] * 3 + ["free", "wall"]
SLANTED = room_of_outline(CORNERS, exits=[(2, 0.5, 1.5)], border=BORDER)


def swirl(x):
    return np.column_stack([np.sin(2 * x[:, 1]) + 0.3, np.cos(3 * x[:, 0]) - 0.2])


@pytest.mark.parametrize(("order", "surface"), [(1, 0.0), (1, 3.0), (2, 3.0)])
def test_interior_point_solver_finds_the_same(order, surface):
    """Clarabel on the untransformed problem min ½wᵀAw − bᵀw, Cw ≤ g, slanted walls and corners
    included."""
    clarabel = pytest.importorskip("clarabel", reason="clarabel is in the extra `bench`")
    space = Space(mesh_of(SLANTED, 0.5), order)
    medium = table_1_medium(surface=surface, person=1.0)
    solution = collide(space, medium, swirl, surface_everywhere=True, external=[0.4, 0.1])
    basis = space.basis
    rho = np.full(basis.dx.shape, 7.0)
    matrix = forms.volume.assemble(basis, rho=rho, k_v=9.0)
    matrix = matrix + forms.surface.assemble(space.border("wall"), k_s=surface)
    points = np.asarray(basis.global_coordinates())
    left = swirl(points.reshape(2, -1).T).T.reshape(points.shape)
    free = space.border("free")
    push = np.array([0.4, 0.1])[:, None, None] * np.ones_like(free.dx)
    load = 2 * forms.momentum.assemble(basis, rho=rho, u=left)
    load = load + forms.traction.assemble(free, r=push)
    bound = (swirl(space.wall.point) * space.wall.normal).sum(1)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-10
    # its scaling of these problems ends in InsufficientProgress
    settings.equilibrate_enable = False
    solver = clarabel.DefaultSolver(
        sparse.csc_matrix(sparse.triu(matrix)), -load, sparse.csc_matrix(space.constraints), bound,
        [clarabel.NonnegativeConeT(len(bound))], settings,
    )  # fmt: skip
    found = solver.solve()
    assert str(found.status) == "Solved"
    assert solution.status is Status.SOLVED
    assert 0 < solution.active.sum() < len(solution.active)
    assert solution.unknowns == pytest.approx(np.array(found.x), abs=1e-7)
    assert solution.wall_force == pytest.approx(np.array(found.z), abs=1e-6)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("left", ["exit", "random", "uniform", "vertices"])
def test_certificate_and_energy(order, left):
    mesh = mesh_of(ROOM, 0.5)
    exit_ward = toward_exit(ROOM, 1.0)
    velocity = {
        "exit": exit_ward,
        "random": random_speeds(ROOM, exit_ward, mean=0.3, deviation=1.0, seed=1, cell=0.38),
        "uniform": [1.2, 0.7],
        "vertices": swirl(mesh.p.T),
    }[left]
    density = 7 + np.sin(mesh.p[0])
    medium = table_1_medium(density, person=1.0)
    solution = collide(Space(mesh, order), medium, velocity)
    assert solution.status is Status.SOLVED
    assert solution.residual < 1e-12
    assert solution.energy.error < 1e-12
    assert solution.energy.change < 0
    right_normal = (solution.right_velocity[solution.space.wall.node] * solution.space.wall.normal).sum(1)
    assert right_normal.max() < 1e-12
    assert solution.wall_force.min() >= 0
    assert np.abs(right_normal[solution.wall_force > 1e-9]).max() < 1e-12


def test_an_answer_that_is_not_exact_enough_says_so():
    space = Space(mesh_of(ROOM, 1.0))
    solution = collide(space, PAPER, [1.0, 0.0], tolerance=1e-30)
    assert solution.status is Status.INACCURATE
    assert "above 1.0e-30" in solution.reason


def test_active_set_says_when_it_has_not_settled():
    rng = np.random.default_rng(0)
    root = rng.normal(size=(30, 30))
    matrix, load = sparse.csc_array(root @ root.T + 0.1 * np.eye(30)), rng.normal(size=30)
    index, bound = np.arange(30), np.full(30, 0.01)
    assert not bounded_minimum(matrix, load, index, bound, max_rounds=1).settled
    found = bounded_minimum(matrix, load, index, bound)
    assert found.settled
    gradient = load - matrix @ found.z
    assert (found.z <= bound + 1e-9).all()
    assert np.minimum(gradient, bound - found.z) == pytest.approx(0, abs=1e-8)


def test_people_of_75_kg_press_75_times_as_hard():
    space, left = Space(mesh_of(ROOM, 0.5)), toward_exit(ROOM, 1.7)
    people = table_1_medium()
    one, many = collide(space, PAPER, left), collide(space, people, left)
    assert people.length == PAPER.length == pytest.approx(1.1339, abs=1e-4)
    assert many.velocity_sum == pytest.approx(one.velocity_sum, abs=1e-12)
    assert pressure(many) == pytest.approx(75 * pressure(one), abs=1e-8)
    assert many.wall_percussion == pytest.approx(75 * one.wall_percussion, abs=1e-8)
    assert percussion_density(many) == pytest.approx(75 * percussion_density(one), abs=1e-8)
    assert many.energy.change == pytest.approx(75 * one.energy.change)
    # the other reading of Table 1, k_v in kg: the crowd feels its walls only 13 cm deep
    assert Medium(density=525, volume_dissipation=9).length == pytest.approx(0.1309, abs=1e-4)


def test_mirrored_room_gives_mirrored_answer():
    """The square room is its own mirror image in y = 0; the mesh is not."""
    space = Space(mesh_of(ROOM, 0.25), 2)
    solution = collide(space, PAPER, toward_exit(ROOM, 1.7))
    at = np.array([[-0.4, 1.0], [-1.0, 0.7], [-2.0, 2.0]])
    here, there = (body_fields(solution, Kernel(width=0.2), at * [1, s]) for s in (1, -1))
    assert here.pressure == pytest.approx(there.pressure, rel=0.005)


def test_largest_pressure_grows_raw_and_settles_over_a_body():
    crowd = ROOM, PAPER, toward_exit(ROOM, 1.7), Kernel(width=0.2)
    rows = largest_pressures(*crowd, [0.5, 0.25, 0.125])
    raw, body = (np.array([getattr(row, name) for row in rows]) for name in ("raw", "body"))
    assert raw[2] / raw[0] == pytest.approx(2, abs=0.3)
    graded = largest_pressures(*crowd, [0.4, 0.2], grading=0.4)
    # size^(−1/(2 grading))
    assert graded[1].raw / graded[0].raw == pytest.approx(2**1.25, abs=0.25)
    assert graded[1].body == pytest.approx(graded[0].body, rel=0.02)
    assert body[2] == pytest.approx(graded[1].body, rel=0.05)


def test_body_fields_of_a_known_stress():
    """w = (−cx, 0): σ = −k_v c e_x⊗e_x everywhere, p = ½k_v c, also beside a wall; the trace of the
    stress agrees."""
    space = Space(mesh_of(ROOM, 0.5))
    solution = collide(space, PAPER, [0.0, 0.0])
    solution.velocity_sum[:, 0] = -2.0 * space.nodes[:, 0]
    fields = body_fields(solution, Kernel(width=0.2), [[-3.0, 0.0], [-6.0, 3.0], [0.0, 0.5]])
    assert fields.pressure == pytest.approx(9.0)
    assert fields.stress == pytest.approx(np.tile([[-18.0, 0], [0, 0]], (3, 1, 1)), abs=1e-9)
    assert stress(solution)[0, 0] == pytest.approx(-18.0)
    with pytest.raises(ValueError, match="at"):
        body_fields(solution, Kernel(width=0.2), [[50.0, 0.0]])


def test_wall_percussion_over_a_body_keeps_its_force_and_settles():
    largest = []
    for size in (0.25, 0.125):
        solution = collide(Space(mesh_of(ROOM, size)), PAPER, toward_exit(ROOM, 1.7))
        mean = body_wall_percussion(solution, 0.2)
        assert mean.min() >= 0
        assert mean @ solution.space.wall.weight == pytest.approx(solution.wall_force.sum(), rel=0.03)
        largest.append((solution.wall_percussion.max(), mean.max()))
    (raw, body), (finer_raw, finer_body) = largest
    assert finer_raw > 1.5 * raw
    assert finer_body == pytest.approx(body, rel=0.05)
    with pytest.raises(ValueError, match="width"):
        body_wall_percussion(solution, 0.0)


def test_smallest_closed_room_holds_its_crowd():
    """A few triangles, of which the corners are held in both directions."""
    closed = room_of_outline([[0, 0], [1, 0], [1, 1], [0, 1]])
    space = Space(mesh_of(closed, 1.5))
    solution = collide(space, PAPER, [0.6, 0.8])
    assert solution.status is Status.SOLVED
    assert solution.energy.error < 1e-12
    right = (solution.right_velocity[space.wall.node] * space.wall.normal).sum(1)
    assert right.max() < 1e-12


def solved(size, grading, order):
    """Unknowns, and the minimum ½a(w,w) − 2∫ρu⁻·w of a crowd that walks at 1 m/s into the wall with
    the exit."""
    solution = collide(Space(mesh_of(ROOM, size, grading=grading), order), PAPER, [1.0, 0.0])
    assert solution.status is Status.SOLVED
    w, dx = np.asarray(solution.sum_field), solution.space.basis.dx
    inertia = (solution.density_field * (0.5 * w**2 - 2 * w * solution.left_field).sum(0) * dx).sum()
    return solution.space.basis.N, inertia - solution.energy.volume - solution.energy.surface


@pytest.fixture(scope="module")
def minimum():
    """The minimum by P2, graded below 1/4; what a finer mesh still changes is a quarter of the
    smallest error below."""
    coarse, fine = (solved(size, 0.22, 2)[1] for size in (0.15, 0.1))
    assert 0 < coarse - fine < 5e-4
    return fine


@pytest.mark.long
@pytest.mark.parametrize(
    ("order", "grading", "sizes"),
    [
        *((1, grading, (0.4, 0.1)) for grading in (1.0, 0.5, 0.3)),
        *((2, grading, (0.8, 0.2)) for grading in (1.0, 0.5, 0.4, 0.3)),
    ],
)
def test_energy_order_is_the_least_of_element_and_singularities(minimum, order, grading, sizes):
    """‖w_h − w‖ ~ N^(−s/2), s = min(order, 1/(2 grading), 3/2): each ring of triangles around a
    jamb costs what r^(1/2) leaves of it, and where a side wall begins to hold the crowd w ~
    r^(3/2), on which the mesh is not graded.

    w_h is admissible here (u⁻·n is constant on each wall), so the error in the norm of a is at most
    √(2(J(w_h) − J(w)))."""
    (n, coarse), (m, fine) = (solved(size, grading, order) for size in sizes)
    assert fine - minimum > 1e-3
    observed = np.log((coarse - minimum) / (fine - minimum)) / np.log(m / n)
    assert observed == pytest.approx(min(order, 1 / (2 * grading), 1.5), abs=0.12)
