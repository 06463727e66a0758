"""The collision against its closed forms: chains that stick, rebound and leave, and half an annulus
pressed to its middle; and the closed forms against their own equations."""

from dataclasses import replace

import numpy as np
import pytest

from nscd.continuum.closed_forms import Chain, HalfAnnulus, chain_mesh
from nscd.continuum.collision import collide
from nscd.continuum.medium import Medium, table_1_medium
from nscd.continuum.pressure import pressure
from nscd.continuum.space import Space
from nscd.percussions import Status
from tests.refusals import refusals

LENGTH, SPEED, H = 10.0, 1.7, np.sqrt(9 / 7)
THRESHOLD = 9 / H * np.tanh(LENGTH / H)  # κ = tanh L


def medium(surface=0.0):
    return table_1_medium(surface=surface, person=1.0)


def orders(errors):
    """Observed orders of the last halving of the cells."""
    return np.log2(np.array(errors[-2]) / np.array(errors[-1]))


def errors(solution, exact, slope):
    """L² norms of the errors of u⁺ and of ∂w/∂x."""
    basis = solution.space.basis
    x = np.asarray(basis.global_coordinates())[0]
    value = solution.right_field[0] - exact(x)
    gradient = np.asarray(solution.sum_field.grad)[0, 0] - slope(x)
    return [np.sqrt((field**2 * basis.dx).sum()) for field in (value, gradient)]


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(
    ("surface", "sticks"),
    [(1.0, True), (THRESHOLD * (1 - 1e-9), True), (20.0, False)],
    ids=["sticks", "threshold", "rebounds"],
)
def test_orders_of_chain(order, surface, sticks):
    exact = Chain(medium=medium(surface), length=LENGTH, left_velocity=SPEED)
    found, wall = [], []
    for cells in (40, 80, 160):
        solution = collide(Space(chain_mesh(LENGTH, cells), order), medium(surface), [SPEED])
        assert solution.status is Status.SOLVED
        assert solution.energy.error < 1e-10
        slope = lambda x: -exact.internal_percussion(x) / 9  # noqa: E731
        found.append(errors(solution, exact.right_velocity, slope))
        wall.append(abs(solution.wall_percussion[0] - exact.wall_percussion))
        assert solution.active.all() == sticks
    assert orders(found) == pytest.approx([order + 1, order], abs=0.03)
    if sticks:
        assert orders(wall) == pytest.approx(2 * order, abs=0.05)
    else:
        assert solution.wall_percussion[0] == 0.0


def test_closed_form_holds_its_own_equation():
    """ρ[u] = −∂r_int/∂x, σ = k_v∂w/∂x and the wall's law, by differences of the closed form; both
    sides of the threshold."""
    x, step = np.linspace(0.5, 9.5, 19), 1e-5
    for surface in (0.0, 3.0, THRESHOLD * 0.999, THRESHOLD * 1.001, 20.0):
        chain = Chain(medium=medium(surface), length=LENGTH, left_velocity=SPEED)
        slope, spread = (
            (field(x + step) - field(x - step)) / (2 * step)
            for field in (chain.right_velocity, chain.internal_percussion)
        )
        assert chain.internal_percussion(x) == pytest.approx(-9 * slope, rel=1e-6)
        assert 7 * (chain.right_velocity(x) - SPEED) == pytest.approx(-spread, rel=1e-6)
        end = float(chain.right_velocity(LENGTH))
        wanted = surface * (end + SPEED) + chain.wall_percussion
        assert chain.internal_percussion(LENGTH) == pytest.approx(wanted)
        assert end <= 1e-12
        assert min(-end, chain.wall_percussion) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("waves", "order"), [(4, 1), (4, 2), (1, 2)])
def test_plane_mode_of_chain_that_leaves_its_wall(waves, order):
    """u⁺/u⁻ = (1 − h²q²)/(1 + h²q²) while the wall is not pressed: an even number of half waves
    needs hq > 1, an odd one < 1."""
    q = waves * np.pi / LENGTH
    ratio = (1 - (H * q) ** 2) / (1 + (H * q) ** 2)
    found = []
    for cells in (40, 80):
        solution = collide(Space(chain_mesh(LENGTH, cells), order), medium(), lambda x: np.cos(q * x))
        assert not solution.active.any()
        slope = lambda x: -(1 + ratio) * q * np.sin(q * x)  # noqa: E731
        found.append(errors(solution, lambda x: ratio * np.cos(q * x), slope))
    assert orders(found) == pytest.approx([order + 1, order], abs=0.05)


def test_walls_dissipate_only_where_they_are_pressed():
    """A crowd that leaves keeps its velocity; as printed, the wall holds it back."""
    space = Space(chain_mesh(LENGTH, 40), 2)
    free = collide(space, medium(3.0), [-SPEED])
    assert free.right_velocity == pytest.approx(-SPEED)
    assert free.energy.surface == 0.0
    printed = collide(space, medium(3.0), [-SPEED], surface_everywhere=True)
    assert printed.right_velocity.max() > -0.6 * SPEED
    assert printed.energy.surface < -1.0


def test_push_at_the_free_end():
    """r_ext at x = 0 of a resting chain: w = r_ext h/k_v · (cosh((l − x)/h) − …) with w(l) = 0:
    sinh((l − x)/h)/cosh L."""
    push, space = 5.0, Space(chain_mesh(LENGTH, 200), 2)
    solution = collide(space, medium(), [0.0], external=[push])
    x = space.nodes[:, 0]
    exact = push * H / 9 * np.sinh((LENGTH - x) / H) / np.cosh(LENGTH / H)
    assert solution.velocity_sum[:, 0] == pytest.approx(exact, abs=1e-6)
    assert solution.wall_percussion == pytest.approx(push / np.cosh(LENGTH / H), rel=1e-4)
    assert solution.energy.external > 0
    assert solution.energy.error < 1e-10


MEDIUM = table_1_medium(surface=0.0, person=1.0)
EXACT = HalfAnnulus(medium=MEDIUM, inner=1.0, outer=4.0, speed=1.5, push=2.0)


def measured(order, cells):
    """Errors of w in L², of D(w) in L², of p in L², and of the whole force on the walls."""
    space = Space(EXACT.mesh(cells, curved=order == 2), order)
    solution = collide(space, MEDIUM, EXACT.left_velocity, external=EXACT.external)
    assert solution.status is Status.SOLVED
    assert solution.active.all()
    assert (solution.wall_percussion > 0).all()
    assert solution.energy.error < 1e-11
    x, dx = np.asarray(space.basis.global_coordinates()), space.basis.dx
    gradient = np.asarray(solution.sum_field.grad)
    value = np.asarray(solution.sum_field) - EXACT.velocity_sum(x)
    strain = 0.5 * (gradient + gradient.swapaxes(0, 1)) - EXACT.strain(x)
    p = pressure(solution) - EXACT.pressure(x)
    squares = (value**2).sum(0), (strain**2).sum((0, 1)), p**2
    norm = (np.sqrt((square * dx).sum()) for square in squares)
    return [*norm, abs(solution.wall_force.sum() - EXACT.wall_force)]


def test_closed_form_holds_the_equation():
    """f″ + f′/r − f/r² − f/h² = 2U/h² and f′ itself, by differences."""
    r, d, h = np.linspace(1.2, 3.8, 14), 1e-4, MEDIUM.length
    f, slope = EXACT.radial, EXACT.slope
    assert slope(r) == pytest.approx((f(r + d) - f(r - d)) / (2 * d), rel=1e-6)
    second = (slope(r + d) - slope(r - d)) / (2 * d)
    balance = second + slope(r) / r - f(r) / r**2 - f(r) / h**2
    assert balance == pytest.approx(2 * 1.5 / h**2, rel=1e-6)
    assert slope(1.0) == pytest.approx(0, abs=1e-12)
    assert 9 * slope(4.0) == pytest.approx(2.0)


@pytest.mark.parametrize(("order", "wanted"), [(1, [2, 1, 1, 2]), (2, [3, 2, 2, 4])])
def test_orders_of_half_annulus(order, wanted):
    coarse, fine = measured(order, 12), measured(order, 24)
    assert np.log2(np.array(coarse) / np.array(fine)) == pytest.approx(wanted, abs=0.2)


test_bad_mesh_or_half_annulus = refusals(
    (lambda: chain_mesh(0.0, 4), "length"),
    (lambda: chain_mesh(1.0, 0), "cells"),
    (lambda: EXACT.mesh(0, curved=False), "cells"),
    (lambda: replace(EXACT, inner=5.0), "inner, outer"),
    (lambda: replace(EXACT, medium=Medium(density=[7.0, 7.0], volume_dissipation=9)), "density"),
    (lambda: replace(EXACT, medium=table_1_medium(person=1.0)), "surface_dissipation"),
    (lambda: replace(EXACT, push=100.0), "leaves the wall"),
)
