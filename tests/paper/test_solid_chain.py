"""The chain of 3.2.1 against another solver and by hand: densities that vary, chains that are
free."""

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from analysis.pages.section import Verdict
from analysis.paper.continuum.solid_chain import (
    FROM_WALL_M,
    LENGTH,
    SPEED,
    chains,
    varied,
    verdicts,
)


@pytest.fixture(scope="module")
def found():
    return chains(0.2)


@pytest.mark.parametrize("ends", [(10.5, 3.5), (7.0, 7.0), (3.5, 10.5)])
def test_a_chain_of_varying_density_against_a_boundary_value_problem(ends):
    """ρ(w − 2U) = k_v w″, w′(0) = 0, w(l) = U where it sticks; the percussion is −k_v w′, and that
    at the wall less k_s U is what the wall gives."""
    rod, volume = varied(*ends, 0.2), 9.0

    def slopes(x, y):
        rho = ends[0] + (ends[1] - ends[0]) * x / LENGTH
        return np.stack([y[1], rho / volume * (y[0] - 2 * SPEED)])

    x = np.linspace(0, LENGTH, 400)
    start = np.stack([2 * SPEED - SPEED * np.exp(x - LENGTH), -SPEED * np.exp(x - LENGTH)])
    exact = solve_bvp(slopes, lambda a, b: np.array([a[1], b[0] - SPEED]), x, start, tol=1e-7)
    assert exact.success
    expected = -volume * exact.sol(LENGTH - np.array(FROM_WALL_M))[1]
    assert rod.inner == pytest.approx(expected, rel=3e-3)
    assert rod.answer.wall_force.sum() == pytest.approx(expected[0] - SPEED, rel=1e-6)


def test_rigid_disks_press_with_the_momentum_of_all_behind(found):
    for rod in found.varied:
        x = np.linspace(0, LENGTH, 20_001)
        rho = np.interp(x, [0, LENGTH], rod.ends)
        for at, percussion in zip(FROM_WALL_M, rod.rigid, strict=True):
            behind = x <= LENGTH - at + 1e-9
            assert percussion == pytest.approx(SPEED * np.trapezoid(rho[behind], x[behind]))


def test_verdicts_on_the_chain(found):
    """What the paper says of free chains and of densities, judged by the numbers above."""
    judged = verdicts(found)
    assert judged["constant"] is Verdict.HOLDS
    assert judged["free"] is Verdict.FAILS
    # denser at the wall presses more, but not as rigid disks do
    assert judged["variable"] is Verdict.PARTLY
    # the formula is right with the h of (13), not with the one beside it
    assert judged["solution"] is Verdict.PARTLY
    assert found.constant.answer.right_velocity == pytest.approx(-SPEED)
    assert found.table_1.formula_error(found.table_1.printed_length) > 0.5
