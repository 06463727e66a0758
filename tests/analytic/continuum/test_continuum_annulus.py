"""The exact case in the plane: half an annulus pressed to its middle, in modified Struve and Bessel
functions."""

import numpy as np
import pytest

from nscd.continuum.closed_forms import HalfAnnulus
from nscd.continuum.collision import collide
from nscd.continuum.medium import Medium, table_1_medium
from nscd.continuum.pressure import pressure
from nscd.continuum.space import Space
from nscd.percussions import Status

MEDIUM = table_1_medium(surface=0.0, person=1.0)
EXACT = HalfAnnulus(medium=MEDIUM, inner=1.0, outer=4.0, speed=1.5, push=2.0)


def measured(order, cells):
    """Errors of w in L², of D(w) in L², of p in L², and of the whole force on the walls."""
    space = Space(EXACT.mesh(cells, curved=order == 2), order)
    answer = collide(space, MEDIUM, EXACT.left_velocity, external=EXACT.external)
    assert answer.status is Status.SOLVED
    assert answer.active.all()
    assert (answer.wall_percussion > 0).all()
    assert answer.energy.error < 1e-11
    x, dx = np.asarray(space.basis.global_coordinates()), space.basis.dx
    gradient = np.asarray(answer.sum_field.grad)
    value = np.asarray(answer.sum_field) - EXACT.velocity_sum(x)
    strain = 0.5 * (gradient + gradient.swapaxes(0, 1)) - EXACT.strain(x)
    p = pressure(answer) - EXACT.pressure(x)
    norm = [
        np.sqrt((np.sum(error**2, axis=axes) * dx).sum())
        for error, axes in ((value, 0), (strain, (0, 1)), (p, ()))
    ]
    return [*norm, abs(answer.wall_force.sum() - EXACT.wall_force)]


def test_closed_form_holds_the_equation():
    """f″ + f′/r − f/r² − f/h² = 2U/h² and f′ itself, by differences."""
    r, d, h = np.linspace(1.2, 3.8, 14), 1e-4, MEDIUM.length
    f, slope = EXACT.radial, EXACT.slope
    assert slope(r) == pytest.approx((f(r + d) - f(r - d)) / (2 * d), rel=1e-6)
    second = (slope(r + d) - slope(r - d)) / (2 * d)
    assert second + slope(r) / r - f(r) / r**2 - f(r) / h**2 == pytest.approx(
        2 * 1.5 / h**2, rel=1e-6
    )
    assert slope(1.0) == pytest.approx(0, abs=1e-12)
    assert 9 * slope(4.0) == pytest.approx(2.0)


def test_closed_form_balances_momentum():
    """∫ρ(w − 2u⁻) = ∫r_ext − ∫μn along x, where the wall's n is x̂ and r̂·x̂ integrates to −2 over
    the half turn."""
    r = np.linspace(1.0, 4.0, 20_001)
    gained = -2 * 7 * np.trapezoid((EXACT.radial(r) + 2 * 1.5) * r, r)
    assert gained == pytest.approx(-2 * 2.0 * 4.0 - EXACT.wall_force, rel=1e-6)


@pytest.mark.parametrize(("order", "wanted"), [(1, [2, 1, 1, 2]), (2, [3, 2, 2, 4])])
def test_orders_of_half_annulus(order, wanted):
    coarse, fine = measured(order, 12), measured(order, 24)
    assert np.log2(np.array(coarse) / np.array(fine)) == pytest.approx(wanted, abs=0.2)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"inner": 5.0}, "inner, outer"),
        ({"medium": Medium(density=[7.0, 7.0], volume_dissipation=9)}, "density"),
        (
            {"medium": table_1_medium(person=1.0)},
            "surface_dissipation",
        ),
        ({"push": 100.0}, "leaves the wall"),
    ],
)
def test_bad_half_annulus(change, message):
    case = {"medium": MEDIUM, "inner": 1.0, "outer": 4.0, "speed": 1.5, "push": 2.0}
    with pytest.raises(ValueError, match=message):
        HalfAnnulus(**(case | change))


def test_half_annulus_without_cells():
    with pytest.raises(ValueError, match="cells"):
        EXACT.mesh(0, curved=False)
