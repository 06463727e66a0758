"""Errata of the continuum rivals, paper eqs. (15)–(20), (M1), (L1), (L2)."""

import itertools

import numpy as np
import pytest
from scipy.optimize import nnls

from tests.errata.dimension import DENSITY, ENERGY, GRADIENT, NUMBER, PED, PRESSURE, SPEED, M, S

RHO_C, RHO_Y, C_1, C_2, EPSILON = 3.5, 5.5, 13.33, 1.5, 0.01  # Table 1


def test_force_of_a_positive_pressure_is_minus_its_divergence():
    """(15), (19): with σ = pI + S and p > 0 repulsive, −∇·σ drives people apart; ∇·σ draws them
    together."""
    x = np.linspace(-3, 3, 121)
    X, Y = np.meshgrid(x, x, indexing="ij")
    sigma = np.exp(-(X**2) - Y**2)[..., None, None] * np.eye(2)  # a crowded spot, S = 0
    slopes = [np.gradient(sigma[..., axis, :], x, axis=axis) for axis in (0, 1)]
    divergence = slopes[0] + slopes[1]
    outward = np.stack([X, Y], axis=-1)
    area = (x[1] - x[0]) ** 2
    virial = float((-divergence * outward).sum() * area)
    # ∫ x·(−∇p) = 2∫p = 2π: the moment of the force spreads the crowd
    assert virial == pytest.approx(2 * np.pi, rel=1e-2)
    assert float((divergence * outward).sum() * area) < -6


def turbulence_pressure(density, c_2):
    """(16)."""
    middle = C_1 * density / np.sqrt(np.maximum(RHO_Y - density, 0) + EPSILON) - c_2
    high = C_1 / np.sqrt(EPSILON) * density - c_2
    return np.where(density <= RHO_C, 0.0, np.where(density < RHO_Y, middle, high))


def test_pressure_law_jumps_at_the_critical_density():
    """(16): continuous at ρ_y; at ρ_c it jumps by 31.4 with Table 1's c₂ = 1.5, and by nothing with
    c₂ = 32.91."""

    def jump(at, c_2):
        below, above = turbulence_pressure(np.array([at - 1e-9, at + 1e-9]), c_2)
        return above - below

    assert jump(RHO_Y, C_2) == pytest.approx(0, abs=1e-4)
    assert jump(RHO_C, C_2) == pytest.approx(31.4, abs=0.05)
    assert jump(RHO_C, 32.91) == pytest.approx(0, abs=0.005)


def test_kinetic_energy_of_the_friction_problem():
    """(17): ‖ρv − δt∇p − δt∇·S‖²/(2ρ) is the energy after a step of the force −∇·σ; as printed
    units do not add."""
    force, momentum = PRESSURE * GRADIENT, DENSITY * SPEED
    assert S * force == momentum
    assert momentum**2 / DENSITY * M**2 == ENERGY
    assert momentum != DENSITY * PRESSURE * GRADIENT  # ρ∇p beside ρv

    density, step = 525.0, 0.01
    v, grad_p, div_s = np.array([1.2, -0.4]), np.array([900.0, 300.0]), np.array([-150.0, 420.0])
    after = v - step * (grad_p + div_s) / density
    energy = 0.5 * density * after @ after
    corrected = ((density * v - step * grad_p - step * div_s) ** 2).sum() / (2 * density)
    printed = ((density * (v - grad_p) + step * div_s) ** 2).sum() / density
    assert corrected == pytest.approx(energy, rel=1e-12)
    assert printed > 1e5 * energy


def mean_pressure_friction(deviator):
    """Greatest tangential stress on the planes through a point whose normal stress is the mean
    pressure p.

    There n·S n = 0. In the plane such lines are searched over all directions; in space the
    octahedral planes, equally inclined to the principal axes, are taken."""
    d = len(deviator)
    if d == 3:
        _, axes = np.linalg.eigh(deviator)
        normals = [axes @ signs / np.sqrt(3) for signs in itertools.product((1, -1), repeat=3)]
    else:
        angle = np.linspace(0, np.pi, 200_001)
        normal = np.column_stack([np.cos(angle), np.sin(angle)])
        along = np.einsum("ki,ij,kj->k", normal, deviator, normal)
        normals = normal[np.flatnonzero(np.diff(np.sign(along)))]
    assert len(normals) > 1
    for n in normals:
        assert abs(n @ deviator @ n) < 1e-4 * np.linalg.norm(deviator)
    return max(np.linalg.norm(deviator @ n - (n @ deviator @ n) * n) for n in normals)


def test_friction_bound_in_the_plane_has_the_root_of_two():
    """(18): tangential ≤ β × normal stress means ‖S‖_F ≤ √2 β p in the plane; √3 is of space, 22 %
    too much here."""
    beta, p = 0.75, 10.0
    rng = np.random.default_rng(0)
    for dimension, factor in ((2, np.sqrt(2)), (3, np.sqrt(3))):
        matrix = rng.normal(size=(dimension, dimension))
        deviator = matrix + matrix.T
        deviator -= np.trace(deviator) / dimension * np.eye(dimension)
        at_bound = deviator * factor * beta * p / np.linalg.norm(deviator)
        assert mean_pressure_friction(at_bound) == pytest.approx(beta * p, rel=1e-4)
        if dimension == 2:
            printed = at_bound * np.sqrt(3 / 2)
            assert mean_pressure_friction(printed) > 1.22 * beta * p


def place_equation(desired, edges, kind, weight=1.0):
    """p (nodes after the first) and u⁺ = u_d − p' (cells) between p = 0 at the exit, edges[0], and
    a wall at edges[-1].

    `complementarity`: the projection min ∫weight |u_d − p'|² over p ≥ 0, whose wall condition is p'
    ≥ u_d·n; `equality`: the same without p ≥ 0, p' = u_d·n; `printed`: (20), −Δp = −div u_d with p'
    = 0 at the wall. desired (cells,) m/s: u_d away from the exit; weight: 1, or r for a
    half-annulus."""
    step = np.diff(edges)
    n = len(step)
    root = np.sqrt(weight * step)
    gradient = (np.eye(n) - np.eye(n, k=-1)) / step[:, None]
    scaled, target = root[:, None] * gradient, root * desired
    if kind == "complementarity":
        p, _ = nnls(scaled, target, maxiter=50 * n)
    else:
        load = scaled.T @ target
        if kind == "printed":
            load[-1] -= np.broadcast_to(weight, n)[-1] * desired[-1]
        p = np.linalg.solve(scaled.T @ scaled, load)
    return p, desired - gradient @ p


def test_first_order_pressure_needs_the_desired_velocity_at_the_wall():
    """(20): a crowd that walks into a wall presses on it, p = U x; with ∂ₙp = 0 it walks through,
    without pressure."""
    U, edges = 1.7, np.linspace(0, 1, 101)
    to_wall = np.full(100, U)
    p, right = place_equation(to_wall, edges, "printed")
    np.testing.assert_allclose(p, 0, atol=1e-9)
    np.testing.assert_allclose(right, U, atol=1e-9)
    p, right = place_equation(to_wall, edges, "complementarity")
    np.testing.assert_allclose(p, U * edges[1:], atol=1e-9)
    np.testing.assert_allclose(right, 0, atol=1e-9)


def test_first_order_pressure_needs_a_sign():
    """(20): as an equality ∂ₙp = u_d·n holds a crowd that walks out, p = −U·dist < 0; with p ≥ 0 it
    lets it go."""
    U, edges = 1.7, np.linspace(0, 1, 101)
    to_exit = np.full(100, -U)
    p, right = place_equation(to_exit, edges, "equality")
    np.testing.assert_allclose(p, -U * edges[1:], atol=1e-9)
    np.testing.assert_allclose(right, 0, atol=1e-9)
    p, right = place_equation(to_exit, edges, "complementarity")
    np.testing.assert_allclose(p, 0, atol=1e-12)
    np.testing.assert_allclose(right, -U, atol=1e-12)


def test_first_order_pressure_before_an_exit():
    """(20): in the half-annulus 0.5 < r < 5 m, as printed p is greatest at the wall that people leave;
    with p ≥ 0 it is 0 there."""
    U, a, R = 1.7, 0.5, 5.0
    edges = np.linspace(a, R, 301)
    r, middle = edges[1:], 0.5 * (edges[1:] + edges[:-1])
    to_exit = np.full(300, -U)
    log = np.log(r / a)
    exact = {
        "complementarity": U * ((R - a) * log / np.log(R / a) - (r - a)),
        "equality": -U * (r - a),
        "printed": U * (R * log - (r - a)),
    }
    found = {}
    for kind, expected in exact.items():
        p, right = place_equation(to_exit, edges, kind, middle)
        np.testing.assert_allclose(p, expected, atol=0.01 * np.abs(expected).max())
        found[kind] = p, right
    assert found["complementarity"][0].min() >= 0
    assert found["complementarity"][0][-1] < 1e-9
    assert found["equality"][0].max() < 0
    # its last two values differ by rounding: dp/dr = 0 at r = R
    assert found["printed"][0][-1] == pytest.approx(found["printed"][0].max(), rel=1e-12)
    assert found["printed"][0].argmax() >= 298
    # and the printed answer is not the admissible velocity nearest to the desired one
    distance = {kind: float(middle @ (right - to_exit) ** 2) for kind, (_, right) in found.items()}
    assert distance["printed"] > 1.3 * distance["complementarity"]


def weidmann(density, gamma):
    """(L2) as u(ρ), with Weidmann's 1.34 m/s and 5.4 ped/m²."""
    return 1.34 * (1 - np.exp(-gamma * (1 / density - 1 / 5.4)))


def test_speed_laws_give_speed_from_density():
    """(L1), (L2): the right sides are speeds; L2's γ is 1.913 ped/m² (capacity 1.22 ped/(m s) at
    1.75), not γ = 2 of (M2)."""
    density = PED / M**2
    gamma = density  # so that γ(1/ρ − 1/ρ_max) is a number, and the right side is a speed
    assert gamma / density == NUMBER
    assert NUMBER / density != NUMBER  # the adiabatic exponent is a number
    assert density != SPEED

    # (L1) with Table 1: at the greatest density, 8.5 ped/m², the right side is near 0, and it is
    # u_max where nobody is
    right_side = 2.0 * np.exp(-7.5 * (np.array([0.0, 8.5]) / 8.5) ** 2)
    np.testing.assert_allclose(right_side, [2.0, 0.0], atol=2e-3)
    assert abs(right_side[1] - 8.5) > 8
    rho = np.linspace(0.2, 5.4, 5201)
    flow = rho * weidmann(rho, 1.913)
    assert flow.max() == pytest.approx(1.22, abs=0.01)
    assert rho[flow.argmax()] == pytest.approx(1.75, abs=0.02)
    printed = rho * weidmann(rho, 2.0)
    assert printed.max() > 1.25
    assert weidmann(5.4, 1.913) == 0


def test_measured_velocity_is_a_weighted_mean():
    """(M1): Σ‖u‖f/Σf returns the speed that all have, with no variance; Σ‖u‖f returns ρ times it,
    in m⁻¹ s⁻¹."""
    assert SPEED * M**-2 != SPEED
    assert SPEED * M**-2 / M**-2 == SPEED

    density, R = 7.0, 0.7
    rng = np.random.default_rng(1)
    people = rng.uniform(0, 16, (int(density * 16**2), 2))
    positions = rng.uniform(4, 12, (300, 2))
    distance = np.linalg.norm(positions[:, None] - people[None], axis=-1)
    f = np.exp(-(distance**2) / R**2) / (np.pi * R**2)
    speed = np.full(len(people), 1.7)
    printed, corrected = f @ speed, f @ speed / f.sum(1)
    np.testing.assert_allclose(corrected, 1.7, rtol=1e-12)
    assert printed.mean() == pytest.approx(density * 1.7, rel=0.05)
    assert density * corrected.var() < 1e-20
    assert density * printed.var() > 10  # a crowd pressure where nobody differs from anybody

    speed = rng.normal(1.7, 0.5, len(people))
    assert (f @ speed).var() > 49 * (f @ speed / f.sum(1)).var()
