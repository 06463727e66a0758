"""Errata of section 3.1, of the desired direction, of Table 1 and of Fig. 10a."""

from fractions import Fraction

import numpy as np
import pytest

from tests.crowds import disks_at, solved
from tests.errata.dimension import DENSITY, ENERGY, FORCE, GRADIENT, IMPULSE

from tests.errata.dimension import KG, PED, PRESSURE, SPEED, STRAIN_RATE, M, S  # isort: skip
from tests.errata.rod import Rod


def radial_crowd(direction):
    """Half-annulus 0.5 < r < 5 m around an exit, u⁻ = direction · 1.7 r̂, smooth straight walls: r,
    p and wall μ.

    w = f(r) r̂ with ∫(ρ f v + k_v (f'v' + f v/r²)) r dr = 2ρ∫u⁻v r dr, by linear elements; p = −½
    k_v (f' + f/r), μ = −k_v f/r."""
    density, k_v, n = 7.0, 9.0, 600
    r = np.linspace(0.5, 5.0, n + 1)
    step, middle = r[1] - r[0], 0.5 * (r[1:] + r[:-1])
    operator, load = np.zeros((n + 1, n + 1)), np.zeros(n + 1)
    mean, slope = np.array([0.5, 0.5]), np.array([-1.0, 1.0]) / step
    for e in range(n):
        here = np.ix_([e, e + 1], [e, e + 1])
        element = (density + k_v / middle[e] ** 2) * np.outer(mean, mean)
        element += k_v * np.outer(slope, slope)
        operator[here] += step * middle[e] * element
        load[e : e + 2] += step * middle[e] * 2 * density * direction * 1.7 * mean
    f = np.linalg.solve(operator, load)
    strain, hoop = np.diff(f) / step, 0.5 * (f[1:] + f[:-1]) / middle
    return middle, -0.5 * k_v * (strain + hoop), -k_v * hoop


def test_desired_direction_points_to_the_exit():
    """3.2.2: (P − x)/|x − P| walks to the exit and presses; (x − P)/|x − P| walks away, in tension,
    off the walls."""
    _, pressure, wall = radial_crowd(-1.0)
    assert pressure.min() > 0
    assert wall.min() > 0
    _, pressure, wall = radial_crowd(+1.0)
    assert pressure.max() < 0
    assert wall.max() < 0

    exit_point = np.array([1.0, -0.3])
    j, i = (k.ravel() for k in np.indices((4, 5)))
    disks = np.column_stack([0.5 * i + 0.25 * (j % 2), 0.25 * np.sqrt(3) * j])
    printed = (disks - exit_point) / np.linalg.norm(disks - exit_point, axis=1)[:, None]
    total = {}
    for name, direction in (("corrected", -printed), ("printed", printed)):
        snapshot = disks_at(disks, 2.0 * direction)
        _, found = solved(snapshot)
        total[name] = found.reaction.sum()
        distance = np.linalg.norm(disks + 1e-3 * snapshot.velocity - exit_point, axis=1)
        nearer = distance < np.linalg.norm(disks - exit_point, axis=1)
        assert nearer.all() if name == "corrected" else not nearer.any()
    assert total["corrected"] > 1000
    assert total["printed"] == pytest.approx(0, abs=1e-6)


def test_external_percussion_lives_on_the_free_border():
    """3.1, percussion: ∫_Γf r·v is bounded by the L²(Γ_f) norm; by the L²(Ω) norm it is not, and there its unit
    is no energy."""
    traction = IMPULSE / M
    assert traction * SPEED * M == ENERGY
    assert traction * SPEED * M**2 != ENERGY
    in_domain, on_border = [], []
    # r = 1 N·s/m within `layer` of one side of a unit square, 0 elsewhere; v = 1 m/s
    for layer in (1e-2, 1e-4, 1e-6):
        widths, values = np.array([1 - layer, layer]), np.array([0.0, 1.0])
        work = values[-1] * 1.0
        on_border.append(work / abs(values[-1]))
        in_domain.append(work / np.sqrt(widths @ values**2))
    np.testing.assert_allclose(on_border, 1, rtol=1e-12)
    np.testing.assert_allclose(in_domain, [10, 100, 1000], rtol=1e-9)


def test_surface_potential_takes_the_velocity_itself():
    """3.1, potential: φ_s = k_s (w/2)² gives r_int = k_s w, a vector in N·s/m; with D(w) it is a matrix in
    another unit."""
    k_s, traction = KG / M, IMPULSE / M
    assert k_s * SPEED == traction
    assert k_s * STRAIN_RATE != traction
    # the gradient of each potential for a crowd that slides along the wall as one body, w = (0.5,
    # 0.2) m/s
    stiffness, w, step = 1.0, np.array([0.5, 0.2]), 1e-6
    positions = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])

    def of_velocity(w):
        return stiffness * ((w / 2) ** 2).sum()

    def of_strain(w):
        field = np.tile(w / 2, (3, 1))
        gradient = np.linalg.solve(positions[1:] - positions[0], field[1:] - field[0]).T
        assert gradient.shape == (2, 2)  # no vector comes of it
        return stiffness * ((0.5 * (gradient + gradient.T)) ** 2).sum()

    def percussion(potential):
        moved = step * np.eye(2)
        # the derivative is taken with respect to w/2
        return np.array([(potential(w + d) - potential(w - d)) / step for d in moved])

    np.testing.assert_allclose(percussion(of_velocity), stiffness * w, rtol=1e-8)
    # as printed the wall would not brake them
    np.testing.assert_array_equal(percussion(of_strain), 0)


def test_units_of_k_v_and_k_s():
    """Table 1, k: N·s²/m² and N·s²/m³ balance (11) for kg/m³, in space; in the plane k_v is in kg and
    k_s in kg/m."""

    def balances(density, k_v, k_s):
        momentum = density * SPEED
        stress = k_v * STRAIN_RATE
        return momentum == stress * GRADIENT and stress == k_s * SPEED

    printed = FORCE * S**2 / M**2, FORCE * S**2 / M**3
    assert balances(KG / M**3, *printed)
    assert not balances(DENSITY, *printed)
    assert not balances(PED / M**2, *printed)
    assert balances(DENSITY, KG, KG / M)
    # people or kilograms: with 75 kg in ρ, k_v and k_s alike the velocities stay and the
    # percussions are 75 times as large
    left = np.full(4001, 1.7)
    people, kilograms = Rod(), Rod(density=7 * 75.0, k_v=9 * 75.0, k_s=75.0)
    (right, reaction), (same, larger) = people.sticking(left), kilograms.sticking(left)
    np.testing.assert_allclose(same, right, atol=1e-9)
    assert larger == pytest.approx(75 * reaction, rel=1e-9)
    only_density = Rod(density=7 * 75.0)
    assert np.abs(only_density.sticking(left)[0] - right).max() > 0.5


@pytest.mark.parametrize("gamma", [Fraction(7, 5), Fraction(2), Fraction(3)], ids=str)
def test_unit_of_the_pressure_coefficient(gamma):
    """Table 1, p₀: p = p₀ρ^γ beside ρ|u|² needs ped^(1−γ) m^(2γ) s⁻²; the printed m^(2+γ) is the same
    at γ = 2 only."""
    density = PED / M**2
    wanted = density * SPEED**2
    corrected = PED ** (1 - gamma) * M ** (2 * gamma) / S**2
    printed = PED ** (1 - gamma) * M ** (2 + gamma) / S**2
    assert corrected * density**gamma == wanted
    assert (printed * density**gamma == wanted) == (gamma == 2)


def test_percussion_is_no_pressure():
    """Fig. 10a: σ = k_v D(w) is an impulse for each length, in proportion to the window δt; σ/δt is
    a pressure."""
    sigma = KG * STRAIN_RATE
    assert sigma == IMPULSE / M
    assert sigma != PRESSURE
    assert sigma / S == PRESSURE
    assert DENSITY * SPEED**2 == PRESSURE  # (M1), with ρ as mass
    # a crowd at rest, driven by 3.4 m/s² during δt, has u⁻ = −3.4 δt r̂
    windows = np.array([0.01, 0.1])
    percussion = np.array([radial_crowd(-2.0 * window)[1].max() for window in windows])
    assert percussion[1] / percussion[0] == pytest.approx(10, rel=1e-9)
    assert (percussion / windows)[1] == pytest.approx((percussion / windows)[0], rel=1e-9)
