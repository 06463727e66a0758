"""The rivals of the collision against closed forms, general optimisers and a conic solver: laws of
the density, the first-order model (20), the crowd turbulence (15)–(19)."""

import numpy as np
import pytest
import scipy.sparse as sparse
from scipy.optimize import isotonic_regression, minimize, nnls
from skfem import MeshTri, MeshTri2

from nscd.continuum.closed_forms import chain_mesh
from nscd.continuum.left_velocity import random_speeds, toward_exit
from nscd.continuum.mesh import mesh_of
from nscd.continuum.rivals import density_laws as laws
from nscd.continuum.rivals import turbulence
from nscd.continuum.rivals.cells import Cells
from nscd.continuum.rivals.density_laws import TurbulencePressure, crowd_pressure, measured_speed
from nscd.continuum.rivals.first_order import PlaceEquation, first_order_flow
from nscd.continuum.rivals.turbulence import Congestion, TurbulenceLaw, turbulence_step
from nscd.continuum.room import room_of_outline, square_room
from nscd.percussions import Status
from tests.refusals import refusals

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
    ("equation", "into", "away"),
    [("complementarity", 1.0, 0.0), ("equality", 1.0, -1.0), ("printed", 0.0, 0.0)],
)
def test_crowd_that_walks_into_a_wall_and_one_that_leaves_it(equation, into, away):
    """p = Ux and u⁺ = 0; as printed nobody is pressed and everybody walks through. Who leaves goes
    with p ≥ 0; the equality's wall pulls him back, p = −Ux."""
    mesh = chain_mesh(10.0, 40)
    for speed, fraction in ((U, into), (-U, away)):
        flow = first_order_flow(mesh, [speed], equation=equation)
        assert flow.status is Status.SOLVED
        np.testing.assert_allclose(flow.pressure, fraction * U * mesh.p[0], atol=1e-11)
        np.testing.assert_allclose(flow.right_velocity, speed - fraction * U, atol=1e-11)
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
    **dict.fromkeys(
        (("complementarity", "wall"), ("complementarity", "free")),
        lambda r: U * ((OUTER - INNER) * np.log(r / INNER) / LOG - (r - INNER)),
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
        both = flow.desired_velocity, flow.right_velocity
        energy = [cells.measure @ (v**2).sum(1) for v in both]
        lost = cells.measure @ (cells.gradient(flow.pressure) ** 2).sum(1)
        assert energy[0] == pytest.approx(energy[1] + lost, rel=1e-12)
        assert (cells.moment(flow.right_velocity)[inside] <= 1e-9).all()
    assert 0.1 < flow.pressed.mean() < 0.9


def test_first_order_refuses_bad_input(room):
    mesh = mesh_of(room, 1.5)
    closed = mesh_of(room_of_outline([[0, 0], [1, 0], [1, 1], [0, 1]]), 0.5)
    curved = MeshTri2.from_mesh(mesh).with_boundaries(mesh.boundaries)
    cells = np.zeros((mesh.nelements, 2))
    for where, desired, inputs, says in (
        (mesh, [0, U], {"equation": "exact"}, "equation: unknown 'exact'"),
        (mesh, np.zeros((3, 2)), {}, r"^desired_velocity: shape \(3, 2\)"),
        (mesh, lambda x: x[:, 0], {}, "desired_velocity: the function gives shape"),
        (mesh, cells, {"equation": PlaceEquation.PRINTED}, "desired_velocity: values in cells"),
        (mesh, cells + np.nan, {}, "desired_velocity: not a finite number"),
        (mesh, [0, U], {"tolerance": 0}, "tolerance"),
        (closed, [0, U], {}, "no exit and no free border"),
        (curved, [0, U], {}, "curved"),
    ):
        with pytest.raises(ValueError, match=says):
            first_order_flow(where, desired, **inputs)


def test_first_order_tells_that_it_is_not_solved():
    flow = first_order_flow(half_annulus(8, "free"), to_centre, tolerance=1e-18)
    assert flow.status is Status.INACCURATE
    assert "above 1.0e-18" in flow.reason


def test_turbulence_pressure_is_continuous_or_jumps():
    law, near = TurbulencePressure(), 1e-10
    jump = lambda law, at: float(np.diff(law.pressure([at - near, at + near]))[0])  # noqa: E731
    assert jump(law, 3.5) == pytest.approx(31.4, abs=0.05)
    assert jump(law.continuous(), 3.5) == pytest.approx(0, abs=1e-6)
    assert law.continuous().c2 == pytest.approx(32.91, abs=0.005)
    for each in (law, law.continuous()):
        assert jump(each, 5.5) == pytest.approx(0, abs=1e-5)
        assert (np.diff(each.pressure(np.linspace(3.6, 8, 200))) > 0).all()
    # Table 1 at 7 people/m²: c₃ρ − c₂ with c₃ = 13.33/0.1
    assert float(law.pressure(7.0)) == pytest.approx(133.3 * 7 - 1.5)
    assert float(law.pressure(2.0)) == 0


def test_speed_and_pressure_laws():
    assert float(laws.power_pressure(7.0)) == pytest.approx(0.245)
    assert float(laws.exponential_speed(8.5)) == pytest.approx(2 * np.exp(-7.5))
    assert float(laws.exponential_speed(1e-9)) == pytest.approx(2.0)
    # Weidmann's own constants: greatest flow 1.22 people/(m s) at 1.75 people/m²
    rho = np.linspace(0.2, 5.4, 5201)
    flow = rho * laws.kladek_speed(rho, free_speed=1.34, greatest_density=5.4)
    assert flow.max() == pytest.approx(1.22, abs=0.01)
    assert rho[flow.argmax()] == pytest.approx(1.75, abs=0.02)
    assert (laws.kladek_speed([8.5, 9.0]) == 0).all()


def test_measured_speed_of_a_crowd_in_step():
    """The weighted mean returns the speed that all have; the printed sum follows the density, 7
    people/m² times 1.7 m/s."""
    side = 1 / np.sqrt(7.0)
    axis = np.arange(0.0, 12.0, side)
    position = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    at = np.random.default_rng(1).uniform(5, 7, (50, 2))
    speed = np.full(len(position), U)
    mean = measured_speed(position, speed, at)
    np.testing.assert_allclose(mean, U, rtol=1e-12)
    assert float(crowd_pressure(7.0, mean)) < 1e-20
    np.testing.assert_allclose(measured_speed(position, speed, at, printed=True), 7 * U, rtol=1e-6)
    # as a field: points that stand for ρ times an area each, however fine
    half = np.concatenate([position, position])
    speed, people = np.full(len(half), U), np.full(len(half), 0.5)
    found = measured_speed(half, speed, at, people=people, printed=True)
    np.testing.assert_allclose(found, 7 * U, rtol=1e-6)


def test_crowd_pressure_of_random_speeds():
    """Independent speeds of deviation s on a lattice of density ρ: Var(V) = s²∫f²/ρ, so that M1
    gives s²/(2πR²), whatever ρ."""
    rng = np.random.default_rng(4)
    for density in (4.0, 9.0):
        side = 1 / np.sqrt(density)
        axis = np.arange(0.0, 60.0, side)
        position = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
        at = rng.uniform(4, 56, (4000, 2))
        measured = measured_speed(position, rng.normal(U, 0.5, len(position)), at, reach=0.7)
        wanted = pytest.approx(0.25 / (2 * np.pi * 0.49), rel=0.1)
        assert float(crowd_pressure(density, measured)) == wanted


PLANE = chain_mesh(1.0, 3), 7.0, [U], TurbulenceLaw()
test_laws_refuse_bad_input = refusals(
    (lambda: TurbulencePressure(epsilon=0.0), "epsilon: 0"),
    (lambda: TurbulencePressure(critical_density=6.0), "critical_density: 6"),
    (lambda: laws.kladek_speed(7.0, free_speed=0.0), "free_speed: 0"),
    (lambda: laws.kladek_speed([1.0, 0.0]), "density: 0"),
    (lambda: laws.power_pressure(np.inf), "density: not a finite number"),
    (lambda: Congestion(greatest_density=0.0), "greatest_density: 0"),
    (lambda: measured_speed([[0, 0]], [1.0, 2.0], [[0, 0]]), "speed: shape"),
    (lambda: measured_speed([[0, 0]], [1.0], [[0, 0]], reach=0.0), "reach: 0"),
    (lambda: measured_speed([[0, 0]], [1.0], [[0, 0]], people=[-1.0]), "people: -1"),
    (lambda: measured_speed([[0, 0]], [1.0], [[99, 0]]), r"nobody is within reach of \(99, 0\)"),
    (lambda: crowd_pressure(-7.0, [1.0]), "density: -7"),
    (lambda: crowd_pressure(7.0, []), "measured: an empty sample"),
    (lambda: turbulence_step(*PLANE, time_step=0.01), "plane"),
)


def ring(cells):
    """INNER ≤ r ≤ OUTER all round: free inside, wall outside."""
    r = np.linspace(INNER, OUTER, 2 * cells + 1)
    count = 8 * cells
    angle = np.arange(count) * 2 * np.pi / count
    points = np.stack([np.outer(r, np.cos(angle)).ravel(), np.outer(r, np.sin(angle)).ravel()])
    i, j = (a.ravel() for a in np.meshgrid(np.arange(2 * cells), np.arange(count), indexing="ij"))
    a, b = i * count + j, i * count + (j + 1) % count
    c, d = a + count, b + count
    mesh = MeshTri(points, np.hstack([np.stack([a, c, d]), np.stack([a, d, b])]))
    outside = lambda x: np.hypot(*x) > 0.5 * (INNER + OUTER)  # noqa: E731
    return mesh.with_boundaries({"wall": outside, "free": lambda x: ~outside(x)})


def test_rotating_crowd_is_braked_by_its_rough_wall():
    """A ring that turns with ω, p given: S_rθ = −βp (R/r)²(r⁴ − a⁴)/(R⁴ − a⁴) and ω⁺ = ω −
    4βpδtR²/(ρ(R⁴ − a⁴)); order 1."""
    omega, pressure, beta, mass, people, step = 0.8, 300.0, 0.5, 70.0, 6.0, 5.0
    brake = 4 * beta * pressure * step * OUTER**2 / (mass * people * (OUTER**4 - INNER**4))
    assert 0.01 * omega < brake < omega
    errors = []
    for cells in (2, 4, 8):
        mesh = ring(cells)
        arguments = {"pressure": np.full(mesh.nvertices, pressure), "friction": beta}
        law, how = TurbulenceLaw(**arguments, mass_per_person=mass), {"time_step": step}
        turning = lambda x: omega * np.stack([-x[:, 1], x[:, 0]], axis=1)  # noqa: E731
        solution = turbulence_step(mesh, people, turning, law, **how, tolerance=1e-8)
        assert solution.status is Status.SOLVED, solution.reason
        np.testing.assert_allclose(solution.pressed_velocity, solution.left_velocity)
        change = solution.right_velocity - (1 - brake / omega) * solution.left_velocity
        area = Cells(mesh).measure
        errors.append(np.sqrt(area @ (change**2).sum(1) / area.sum()) / (brake * OUTER))
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert errors[-1] < 0.02
    assert orders[-1] == pytest.approx(1.0, abs=0.1)
    on_wall = np.isclose(np.hypot(*mesh.p), OUTER)
    assert solution.sliding[on_wall].all()
    assert not solution.sliding[np.hypot(*mesh.p) < 0.9 * OUTER].any()


def test_friction_against_a_general_optimiser():
    """The bounded-friction problem as nonlinear programming (SLSQP), with density and pressure that
    vary."""
    mesh = mesh_of(square_room(3.0, 1.0), 1.1, grading=1.0)
    cells = Cells(mesh)
    rng = np.random.default_rng(5)
    people, pressure = rng.uniform(4, 8, mesh.nvertices), rng.uniform(0, 400, mesh.nvertices)
    velocity, beta, step = rng.normal(0, 1.5, (mesh.nelements, 2)), 0.75, 0.02
    law = TurbulenceLaw(pressure=pressure, friction=beta, mass_per_person=1.0)
    solution = turbulence_step(mesh, people, velocity, law, time_step=step, tolerance=1e-9)
    assert solution.status is Status.SOLVED, solution.reason
    inside = np.flatnonzero(~cells.open)
    gx, gy = (g.toarray()[:, inside] for g in cells.slopes)
    start = velocity - step / solution.density[:, None] * cells.gradient(pressure)

    def after(s):
        xx, xy = s.reshape(2, -1)
        force = np.stack([gx @ xx + gy @ xy, gx @ xy - gy @ xx], axis=1)
        return start - step / solution.density[:, None] * force

    def energy(s):
        v = after(s)
        weighted = -step * cells.measure[:, None] * v
        x, y = weighted.T
        slope = np.concatenate([gx.T @ x - gy.T @ y, gy.T @ x + gx.T @ y])
        return 0.5 * (cells.measure * solution.density) @ (v**2).sum(1), slope

    def room_left(s):
        return (beta * pressure[inside]) ** 2 - (s.reshape(2, -1) ** 2).sum(0)

    def room_slope(s):
        return np.hstack([np.diag(-2 * part) for part in s.reshape(2, -1)])

    constrained = {"type": "ineq", "fun": room_left, "jac": room_slope}
    how = {"jac": True, "method": "SLSQP", "options": {"maxiter": 1000, "ftol": 1e-15}}
    found = minimize(energy, np.zeros(2 * len(inside)), constraints=constrained, **how)
    assert 0 < solution.sliding.sum() < len(inside)
    np.testing.assert_allclose(solution.right_velocity, after(found.x), atol=2e-5)
    # and no worse than what the general optimiser found
    assert energy(solution.deviator[inside].T.ravel())[0] <= found.fun * (1 + 1e-9)


def by_cone(problem):
    """The minimum by an interior-point solver: (1, y_i/b_i) in the cone of each vertex."""
    clarabel = pytest.importorskip("clarabel", reason="the conic solver is the oracle")
    k, bound = len(problem.vertex), np.tile(problem.bound, 2)
    scale = np.sqrt(problem.mass) / problem.rho
    scaled = sparse.diags_array(scale) @ problem.divergence @ sparse.diags_array(bound)
    rows = np.concatenate([3 * np.arange(k) + 1, 3 * np.arange(k) + 2])
    matrix = sparse.csc_matrix((-np.ones(2 * k), (rows, np.arange(2 * k))), shape=(3 * k, 2 * k))
    settings = clarabel.DefaultSettings()
    # the default, 0.99, leaves the central path: rounding then decides whether it stalls
    settings.verbose, settings.max_step_fraction = False, 0.8
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-12
    load = problem.moment(np.zeros(2 * k)) * bound
    unit, cones = 1 / np.abs(load).max(), [clarabel.SecondOrderConeT(3)] * k
    square = sparse.triu(unit * (scaled.T @ scaled)).tocsc()
    right = np.tile([1.0, 0.0, 0.0], k)
    solver = clarabel.DefaultSolver(square, -unit * load, matrix, right, cones, settings)
    return bound * solver.solve().x


@pytest.mark.parametrize("pressure", [TurbulencePressure(), Congestion()])
def test_gradient_agrees_with_a_conic_solver(room, pressure):
    mesh = mesh_of(room, 0.5)
    cells = Cells(mesh)
    field = random_speeds(room, toward_exit(room, 1.0), mean=U, deviation=0.5, seed=1, cell=0.38)
    law = TurbulenceLaw(pressure=pressure, mass_per_person=1.0)
    first = turbulence_step(mesh, 7.0, field, law, time_step=0.01)
    bound = np.where(cells.open, 0.0, law.friction * 0.01 * first.pressure)
    problem = turbulence.Friction(cells, first.density, first.pressed_velocity, bound)
    y, area = by_cone(problem), first.density * cells.measure
    expected = problem.velocity(y).reshape(2, -1).T
    size = np.sqrt(area @ (first.pressed_velocity**2).sum(1))
    tight = turbulence_step(mesh, 7.0, field, law, time_step=0.01, tolerance=1e-8)
    for quick, maximum in ((first, 3e-4), (tight, 1e-6)):
        assert quick.status is Status.SOLVED
        difference = np.sqrt(area @ ((quick.right_velocity - expected) ** 2).sum(1)) / size
        assert difference < maximum
        assert difference <= quick.error_bound + problem.error_bound(y)


def test_frictionless_congestion_against_a_bounded_optimiser(room):
    """β = 0, density that varies and is in part below ρ_max: π = δt p ≥ 0 minimises ½∫ρ|v − ∇π/ρ|²
    + ∫π(ρ_max/ρ − 1)₊/δt."""
    mesh = mesh_of(room, 0.9, grading=1.0)
    cells = Cells(mesh)
    people = 5.5 + 0.4 * np.sin(mesh.p[0])
    step, mass = 0.05, 70.0
    full = Congestion(greatest_density=5.5)
    law = TurbulenceLaw(pressure=full, friction=0.0, mass_per_person=mass)
    solution = turbulence_step(mesh, people, toward_exit(room, U), law, time_step=step)
    assert solution.status is Status.SOLVED
    assert not solution.deviator.any()
    inside = np.flatnonzero(~cells.open)
    slopes = sparse.vstack([g[:, inside] for g in cells.slopes]).tocsr()
    rho, area = np.tile(solution.density, 2), np.tile(cells.measure, 2)
    start = solution.left_velocity.T.ravel()
    gap = cells.integral(np.maximum(5.5 / people - 1, 0) / step)[inside]

    def energy(pi):
        v = start - slopes @ pi / rho
        return 0.5 * (area * rho) @ v**2 + gap @ pi, gap - slopes.T @ (area * v)

    ends = {"maxiter": 5000, "ftol": 1e-16, "gtol": 1e-11, "maxcor": 50}
    how = {"jac": True, "method": "L-BFGS-B", "bounds": [(0, None)] * len(inside), "options": ends}
    found = minimize(energy, np.zeros(len(inside)), **how)
    np.testing.assert_allclose(solution.pressure[inside] * step, found.x, atol=1e-4 * found.x.max())
    assert energy(solution.pressure[inside] * step)[0] <= found.fun + 1e-9 * abs(found.fun)
    assert 0 < (solution.pressure[inside] == 0).mean() < 1


def test_congested_crowd_without_friction_is_the_first_order_flow(room):
    """ρ ≥ ρ_max and β = 0: v⁺ is that of (20), and its p is δt p/ρ; whatever the step and the mass
    of a person."""
    mesh = mesh_of(room, 0.6)
    flow = first_order_flow(mesh, toward_exit(room, U))
    for step, mass in ((0.01, 1.0), (0.3, 75.0)):
        law = TurbulenceLaw(pressure=Congestion(), friction=0.0, mass_per_person=mass)
        solution = turbulence_step(mesh, 7.0, toward_exit(room, U), law, time_step=step)
        np.testing.assert_allclose(solution.right_velocity, flow.right_velocity, atol=1e-9)
        np.testing.assert_allclose(solution.pressure * step / (7.0 * mass), flow.pressure, atol=1e-9)


def test_time_step_decides_with_a_law_and_not_in_congestion(room):
    """A law: the same force at short steps, where friction slides, the same percussion at long
    ones; congestion: at all."""
    mesh = mesh_of(room, 0.6)
    field = random_speeds(room, toward_exit(room, 1.0), mean=U, deviation=0.5, seed=2, cell=0.38)
    both = TurbulencePressure(), Congestion()
    law, congested = (TurbulenceLaw(pressure=one, mass_per_person=1.0) for one in both)
    rows = turbulence.time_step_dependence(mesh, 7.0, field, law, [1e-7, 2e-7, 3e-3, 0.01, 1, 2])
    assert all(row.status is Status.SOLVED for row in rows)
    force, percussion = [row.force for row in rows], [row.percussion for row in rows]
    assert force[1] == pytest.approx(force[0], rel=1e-3)
    assert percussion[5] == pytest.approx(percussion[4], rel=1e-3)
    assert force[2] > 1.3 * force[3]
    assert percussion[3] > 1.3 * percussion[2]
    assert (np.diff([row.energy_left for row in rows]) < 1e-6).all()
    rows = turbulence.time_step_dependence(mesh, 7.0, field, congested, [1e-3, 0.1])
    assert rows[0].percussion == pytest.approx(rows[1].percussion, rel=1e-6)
    # a crowd with room left feels the step
    rows = turbulence.time_step_dependence(mesh, 5.0, field, congested, [1e-3, 0.1])
    assert rows[0].percussion < 0.5 * rows[1].percussion


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"density": -1.0}, "density: -1"), ({"density": np.ones(3)}, "density: shape"),
        ({"velocity": np.ones((3, 2))}, "^velocity: shape"), ({"time_step": -0.01}, "time_step: -0.01"),
        ({"mass_per_person": 0.0}, "mass_per_person: 0"), ({"friction": -0.1}, "friction: -0.1"),
        ({"pressure": np.ones(3)}, "pressure: shape"), ({"pressure": -1.0}, "pressure: -1"),
        ({"tolerance": 0.0}, "tolerance: 0"),
    ],
)  # fmt: skip
def test_turbulence_refuses_bad_input(room, change, message):
    mesh = mesh_of(room, 1.5)
    step = dict(density=7.0, velocity=[0.0, U], time_step=0.01)
    law = dict(pressure=Congestion())
    for name, value in change.items():
        (law if name in ("pressure", "friction", "mass_per_person") else step)[name] = value
    if isinstance(law["pressure"], float):
        law["pressure"] = np.full(mesh.nvertices, law["pressure"])
    with pytest.raises(ValueError, match=message):
        turbulence_step(mesh, law=TurbulenceLaw(**law), **step)
