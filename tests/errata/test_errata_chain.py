"""Errata of the continuum chain, paper eqs. (12)–(14) and 3.2.1: the corrected form holds and the
printed one fails."""

import numpy as np
import pytest

from tests.crowds import line, solved
from tests.errata.dimension import DENSITY, IMPULSE, KG, SPEED, STRAIN_RATE, M
from tests.errata.rod import Rod

U = 1.7
TABLE_1 = Rod()  # l = 10 m, ρ = 7, k_v = 9, k_s = 1
STIFF_WALL = Rod(k_s=20.0)


def width(rod):
    """h = √(k_v/ρ), m."""
    return np.sqrt(rod.k_v / rod.density)


def constant(rod):
    return np.full(rod.elements + 1, U)


def internal_percussion(x, rod):
    """(14) times k_v: r_int(x) = k_v U sinh(x/h) / (h cosh(l/h)), without overflow."""
    h = width(rod)
    waves = np.exp((x - rod.length) / h) - np.exp(-(x + rod.length) / h)
    return rod.k_v * U / h * waves / (1 + np.exp(-2 * rod.length / h))


def test_wall_pushes_with_plus_and_would_pull_with_minus():
    """(12): +k_v ∂ₓw + k_s w + μ = 0 gives μ ≥ 0; with minus the crowd sticks only by a pull, or
    leaves gaining energy."""
    for rod in (TABLE_1, STIFF_WALL):
        left = constant(rod)
        h = width(rod)
        tanh = np.tanh(rod.length / h)
        root = np.sqrt(rod.k_v * rod.density)
        (right,) = rod.solutions(left)  # exactly one answer
        assert rod.energy(right) < rod.energy(left)
        _, pushes = rod.sticking(left)
        _, pulls = rod.sticking(left, sign=-1)
        assert pushes == pytest.approx(U * (root * tanh - rod.k_s), rel=1e-5)
        assert pulls == pytest.approx(-U * (root * tanh + rod.k_s), rel=1e-5)
        assert pulls < -15
    # printed: at Table 1's values neither sticking nor leaving is admissible
    assert TABLE_1.solutions(constant(TABLE_1), sign=-1) == []
    # printed: off a stiffer wall the crowd comes back faster than it came, with work that the wall
    # has done
    rod, left = STIFF_WALL, constant(STIFF_WALL)
    (printed,), (corrected,) = rod.solutions(left, sign=-1), rod.solutions(left)
    assert corrected[-1] == pytest.approx(-0.734026, abs=1e-5)
    assert printed[-1] < -2 * U
    for right, by_wall in ((corrected, -1), (printed, +1)):
        w = right + left
        inside = 0.5 * rod.k_v * float((np.diff(w) ** 2).sum()) * rod.elements / rod.length
        change = rod.energy(right) - rod.energy(left) + inside
        assert change == pytest.approx(by_wall * 0.5 * rod.k_s * w[-1] ** 2, rel=1e-8)
    # and with κ = k_s h/k_v just above tanh(l/h) it ends with more energy than it had
    rod = Rod(k_s=1.25 * 9 / width(TABLE_1))
    assert rod.energy(rod.solutions(left, sign=-1)[0]) > 2 * rod.energy(left)


@pytest.mark.parametrize("ratio", [0.1, 0.99, 1.01, 2.5])
def test_crowd_sticks_up_to_a_stiffness_of_the_wall(ratio):
    """(13): it sticks if and only if k_s h ≤ k_v tanh(l/h); the printed right side is −tanh(l/h) <
    0: always true."""
    rod, sticks = Rod(), ratio < 1
    h, L = width(rod), rod.length / width(rod)
    rod = Rod(k_s=ratio * rod.k_v / h * np.tanh(L))
    (right,) = rod.solutions(constant(rod))
    assert (abs(right[-1]) < 1e-12) == sticks
    assert (rod.k_s * h <= rod.k_v * np.tanh(L)) == sticks
    kappa = rod.k_s * h / rod.k_v
    expected = min(0.0, -U * (kappa - np.tanh(L)) / (kappa + np.tanh(L)))
    assert right[-1] == pytest.approx(expected, abs=1e-5)
    printed = (np.exp(-2 * L) - 1) / (np.exp(-2 * L) + 1)
    assert printed == pytest.approx(-np.tanh(L), rel=1e-12)
    assert rod.k_s / rod.k_v >= printed + 0.9  # true where it sticks and where it rebounds


def test_decay_length_is_of_k_v_over_density():
    """Under (13): h = √(k_v/ρ) = 1.13 m is a length and gives the modes; √(k̃/ρ) = 0.126 is none
    and does not."""
    k_v, k_s = KG, KG / M
    assert (k_v / DENSITY) ** 0.5 == M
    assert (k_s / k_v / DENSITY) ** 0.5 != M

    rod = TABLE_1
    q = 3 * np.pi / rod.length
    mode = np.cos(q * rod.x)
    gain = rod.free(mode)[0]
    (right,) = rod.solutions(constant(rod))
    h, printed = width(rod), np.sqrt(rod.k_s / rod.k_v / rod.density)

    def ratio(length):
        return (1 - (length * q) ** 2) / (1 + (length * q) ** 2)

    def profile(length):
        return U * (1 - np.cosh(rod.x / length) / np.cosh(rod.length / length))

    assert gain == pytest.approx(ratio(h), abs=1e-5)
    assert abs(gain - ratio(printed)) > 1
    np.testing.assert_allclose(right, profile(h), atol=1e-5)
    assert np.abs(right - profile(printed)).max() > 0.5 * U


def test_internal_percussion_has_the_factor_k_v():
    """(14): r_int = k_v U sinh(x/h)/(h cosh(l/h)) is the momentum lost before x; as printed it is 9
    times too small."""
    rod = TABLE_1
    (right,) = rod.solutions(constant(rod))
    lost = rod.density * (U - right)
    step = rod.length / rod.elements
    momentum = np.concatenate([[0.0], np.cumsum(0.5 * step * (lost[1:] + lost[:-1]))])
    np.testing.assert_allclose(internal_percussion(rod.x, rod), momentum, atol=1e-4)
    slope = -rod.k_v * np.gradient(right + U, rod.x, edge_order=2)  # −σ
    np.testing.assert_allclose(internal_percussion(rod.x, rod), slope, atol=1e-3)
    printed = internal_percussion(rod.x, rod) / rod.k_v
    assert momentum[-1] / printed[-1] == pytest.approx(9, rel=1e-4)
    # an impulse for each length of wall; without k_v it is a strain rate
    assert KG * SPEED / M == IMPULSE / M
    assert SPEED / M == STRAIN_RATE != IMPULSE / M


def test_percussion_grows_with_density_only_near_the_wall():
    """After (14): ∂r_int/∂ρ > 0 only within about h of the wall; farther back a denser crowd is
    pressed less."""
    rod, x = TABLE_1, TABLE_1.x[1:]
    denser = Rod(density=rod.density * (1 + 1e-6))
    growth = internal_percussion(x, denser) - internal_percussion(x, rod)
    turns = x[np.argmax(growth > 0)]
    assert (growth[x < turns] < 0).all()
    assert (growth[x > turns] > 0).all()
    assert rod.length - turns == pytest.approx(width(rod), rel=0.01)
    # 4 m from the wall, doubling the density takes away more than half of the percussion (by the
    # solver)
    at = np.searchsorted(rod.x, 6.0)
    both = rod, Rod(density=2 * rod.density)
    before, after = (-r.k_v * np.gradient(r.solutions(constant(r))[0], r.x)[at] for r in both)
    assert after < 0.5 * before


def test_stopped_chain_is_still_being_compressed():
    """3.2.1: u⁺ falls towards the wall, by up to U tanh(l/h)/h = 1.5 1/s: people still close up;
    glued means ∂ₓu⁺ = 0."""
    rod = TABLE_1
    (right,) = rod.solutions(constant(rod))
    closing = -np.gradient(right, rod.x, edge_order=2)
    assert closing[1:].min() > 0
    h = width(rod)
    assert closing.max() == pytest.approx(U * np.tanh(rod.length / h) / h, rel=1e-3)
    assert closing.max() > 1.4


def test_free_chain_of_large_k_v_is_elastic_not_rigid():
    """3.2.1: for k_v → ∞ a free chain with falling u⁻ gets 2ū − u⁻ and keeps its energy; rigid
    disks get ū."""
    rod = Rod(k_v=1e7, elements=200)
    left = 2.0 - 0.2 * rod.x
    right = rod.free(left)
    np.testing.assert_allclose(right, 2 * 1.0 - left, atol=1e-3)
    assert rod.energy(right) == pytest.approx(rod.energy(left), rel=1e-3)
    assert np.abs(right - 1.0).max() > 0.9

    speed = np.linspace(2.0, 0.0, 11)
    _, rigid = solved(line(np.full(11, 75.0), speed))
    np.testing.assert_allclose(rigid.right_velocity[:, 0], 1.0, atol=1e-9)
