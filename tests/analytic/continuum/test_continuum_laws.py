"""Pressure and speed of a crowd by its density: (M1), (M2), (L1), (L2)."""

import numpy as np
import pytest

from nscd.continuum.rivals.density_laws import (
    TurbulencePressure,
    crowd_pressure,
    exponential_speed,
    kladek_speed,
    measured_speed,
    power_pressure,
)
from nscd.continuum.rivals.turbulence import Congestion

U = 1.7


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
    assert float(power_pressure(7.0)) == pytest.approx(0.245)
    assert float(exponential_speed(8.5)) == pytest.approx(2 * np.exp(-7.5))
    assert float(exponential_speed(1e-9)) == pytest.approx(2.0)
    # Weidmann's own constants: greatest flow 1.22 people/(m s) at 1.75 people/m²
    rho = np.linspace(0.2, 5.4, 5201)
    flow = rho * kladek_speed(rho, free_speed=1.34, greatest_density=5.4)
    assert flow.max() == pytest.approx(1.22, abs=0.01)
    assert rho[flow.argmax()] == pytest.approx(1.75, abs=0.02)
    assert (kladek_speed([8.5, 9.0]) == 0).all()


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
    np.testing.assert_allclose(
        measured_speed(
            half, np.full(len(half), U), at, people=np.full(len(half), 0.5), printed=True
        ),
        7 * U,
        rtol=1e-6,
    )


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
        assert float(crowd_pressure(density, measured)) == pytest.approx(
            0.25 / (2 * np.pi * 0.49), rel=0.1
        )


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: TurbulencePressure(epsilon=0.0), "epsilon: 0"),
        (lambda: TurbulencePressure(critical_density=6.0), "critical_density: 6"),
        (lambda: power_pressure(7.0, exponent=1.0), "exponent: 1"),
        (lambda: power_pressure(7.0, coefficient=np.nan), "coefficient: nan"),
        (lambda: exponential_speed(7.0, steepness=-1.0), "steepness: -1"),
        (lambda: kladek_speed(7.0, decay=0.0), "decay: 0"),
        (lambda: kladek_speed([1.0, 0.0]), "density: 0"),
        (lambda: power_pressure(np.inf), "density: not a finite number"),
        (lambda: Congestion(greatest_density=0.0), "greatest_density: 0"),
        (lambda: measured_speed([[0, 0]], [1.0, 2.0], [[0, 0]]), "speed: shape"),
        (lambda: measured_speed([[0, 0]], [1.0], [[0, 0]], reach=0.0), "reach: 0"),
        (lambda: measured_speed([[0, 0]], [1.0], [[0, 0]], people=[-1.0]), "people: -1"),
        (
            lambda: measured_speed([[0, 0]], [1.0], [[99, 0]]),
            r"nobody is within reach of \(99, 0\)",
        ),
        (lambda: crowd_pressure(-7.0, [1.0]), "density: -7"),
        (lambda: crowd_pressure(7.0, []), "measured: an empty sample"),
    ],
)
def test_laws_refuse_bad_input(make, message):
    with pytest.raises(ValueError, match=message):
        make()
