"""Coarse-grained stress against closed forms: identity, chain, lattice, wall load, and what it
refuses; it follows translations, rotations and orders of contacts, and adds up."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from nscd import ContactLaw, Contacts, Walls, find_contacts, solve
from nscd.stress import Kernel, branches, coarse_grain, flow_field, stress_field, virial
from tests.crowds import disks_at, turn, turned

KERNELS = [Kernel(width=0.4, cutoff=9.0), Kernel(width=0.4, compact=True)]
NAMES = ["gaussian", "compact"]


def crowd(seed=0, n=60):
    """Disks thrown close to a corner, pressed into both walls, and points without any disk near."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(8) * 0.5, np.arange(8) * 0.5)
    position = np.column_stack([x.ravel(), y.ravel()])[:n] + rng.uniform(-0.04, 0.04, (n, 2)) + 0.25
    velocity, radius = rng.normal(0, 0.5, (n, 2)) - [1.0, 1.5], rng.uniform(0.2, 0.25, n)
    snapshot = disks_at(position, velocity, radius, rng.uniform(50, 100, n))
    walls = Walls(start=[[0, 0], [0, 0]], end=[[9, 0], [0, 9]])
    return snapshot, find_contacts(snapshot, walls, tolerance=0.08)


def points(seed=1, m=300):
    return np.random.default_rng(seed).uniform(-1.0, 5.0, (m, 2))


@pytest.mark.parametrize("kernel", KERNELS, ids=NAMES)
@pytest.mark.parametrize("law", [ContactLaw(), ContactLaw(dissipation=30.0)], ids=["hard", "soft"])
def test_momentum_gained_is_divergence_and_traction(kernel, law):
    """Σ mΔu φ = div Σ + t to rounding, and not without the walls' traction."""
    snapshot, contacts = crowd()
    solution = solve(snapshot, contacts, law=law, tolerance=1e-12)
    assert contacts.is_wall.any()
    assert not contacts.is_wall.all()
    at = points()
    change = snapshot.mass[:, None] * (solution.right_velocity - snapshot.velocity)
    gained, _ = coarse_grain(snapshot.position, change, kernel, at)
    field = stress_field(snapshot, contacts, solution.impulse, kernel, at)
    size = np.abs(gained).max()
    assert np.abs(gained - field.divergence - field.traction).max() < 1e-11 * size
    assert np.abs(gained - field.divergence).max() > 0.3 * size


@pytest.mark.parametrize("kernel", KERNELS, ids=NAMES)
def test_divergence_is_that_of_the_stress(kernel):
    """Differences of eighth order of Σ; the compact kernel is smooth to its second derivative."""
    snapshot, contacts = crowd()
    impulse = np.random.default_rng(2).normal(0, 1, (len(contacts), 2))
    at, h = points(m=80), 0.02 if not kernel.compact else 0.002
    weights = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
    divergence = np.zeros_like(at)
    for axis in (0, 1):
        for k, weight in weights.items():
            for side in (1, -1):
                moved = at.copy()
                moved[:, axis] += side * k * h
                field = stress_field(snapshot, contacts, impulse, kernel, moved)
                divergence += side * weight / h * field.stress[:, :, axis]
    exact = stress_field(snapshot, contacts, impulse, kernel, at).divergence
    error = np.abs(divergence - exact).max() / np.abs(exact).max()
    assert error < (1e-4 if kernel.compact else 1e-9)


@pytest.mark.parametrize("kernel", KERNELS, ids=NAMES)
@pytest.mark.parametrize("length", [1e-9, 0.03, 0.5, 4.0])
def test_line_integral_is_that_of_adaptive_quadrature(kernel, length):
    """Of the kernel as printed, integrated along the branch of one contact."""
    direction = np.array([np.cos(0.7), np.sin(0.7)])
    position = np.array([[0.3, -0.2], [0.3, -0.2] + length * direction])
    snapshot = disks_at(position, radius=length / 2, mass=1)
    contacts = find_contacts(snapshot, tolerance=length / 100)
    at = np.array([[0.5, 0.1], [0.3, -0.2], [1.1, 0.2], [-0.2, -0.4]])
    found = stress_field(snapshot, contacts, direction[None, :], kernel, at).pressure * 2 / length
    w = kernel.width

    def phi(r2):
        if kernel.compact:
            return 4 / (np.pi * 10 * w**2) * max(1 - r2 / (10 * w**2), 0) ** 3
        return np.exp(-r2 / (2 * w**2)) / (2 * np.pi * w**2)

    for x, value in zip(at, found, strict=True):
        there = lambda s, x=x: ((x - position[0] - s * length * direction) ** 2).sum()  # noqa: E731
        exact = quad(lambda s, there=there: phi(there(s)), 0, 1, epsabs=1e-12)[0]
        assert value == pytest.approx(exact, rel=1e-8, abs=1e-10)


@pytest.mark.parametrize("kernel", KERNELS, ids=NAMES)
def test_integral_of_the_stress_is_the_virial(kernel):
    """On a grid that covers all (spectral for the Gaussian)."""
    snapshot, contacts = crowd(n=12)
    impulse = np.random.default_rng(3).normal(0, 1, (len(contacts), 2))
    h = 0.1
    axis = np.arange(-4.5, 8.5, h)
    at = np.stack(np.meshgrid(axis, axis), -1).reshape(-1, 2)
    total = stress_field(snapshot, contacts, impulse, kernel, at).stress.sum(0) * h**2
    expected = -np.einsum("ki,kj->ij", impulse, branches(snapshot, contacts))
    np.testing.assert_allclose(virial(snapshot, contacts, impulse), expected, atol=1e-12)
    np.testing.assert_allclose(total, expected, atol=3e-6 if kernel.compact else 1e-12)


@pytest.mark.parametrize("kernel", KERNELS, ids=NAMES)
def test_a_chain_carries_its_percussion_through_every_section(kernel):
    """Twenty disks between two walls, each contact with p: ∫Σ_xx dy = −p at any x, and all else 0."""
    n, p, near = 20, 112.5, 1e-4 if kernel.compact else 1e-10
    position = np.column_stack([0.25 + 0.5 * np.arange(n), np.zeros(n)])
    snapshot = disks_at(position, mass=1.0)
    walls = Walls(start=[[0, -1], [10, -1]], end=[[0, 1], [10, 1]])
    contacts = find_contacts(snapshot, walls, tolerance=1e-9)
    y = np.arange(-4.0, 4.0, 0.05)
    for x in (4.0, 4.8137, 5.25):
        at = np.column_stack([np.full_like(y, x), y])
        field = stress_field(snapshot, contacts, p * contacts.normal, kernel, at)
        np.testing.assert_allclose(field.stress.sum(0) * 0.05, [[-p, 0], [0, 0]], atol=near)
    # traction on the wall at x = 10 pushes back, with p in all
    grid = np.stack(np.meshgrid(np.arange(6, 14, 0.05), y), -1).reshape(-1, 2)
    field = stress_field(snapshot, contacts, p * contacts.normal, kernel, grid)
    np.testing.assert_allclose(field.traction.sum(0) * 0.05**2, [-p, 0], atol=near)


def test_a_hexagonal_packing_under_pressure_has_the_lattice_stress():
    """Bonds of length d that all carry p: Σ = −(√3 p/d) 1; those along x only: −(2p/√3 d) x⊗x."""
    d, p = 0.4, 30.0
    i, j = (a.ravel() for a in np.meshgrid(np.arange(-20, 21), np.arange(-20, 21)))
    position = d * np.column_stack([i + 0.5 * (j % 2), np.sqrt(3) / 2 * j])
    snapshot = disks_at(position, radius=d / 2, mass=1.0)
    contacts = find_contacts(snapshot, tolerance=1e-9)
    at = np.random.default_rng(4).uniform(-1, 1, (50, 2))
    impulse = p * contacts.normal
    kernel = Kernel(width=d, cutoff=9.0)
    field = stress_field(snapshot, contacts, impulse, kernel, at)
    np.testing.assert_allclose(field.pressure, np.sqrt(3) * p / d, rtol=1e-10)
    expected = -np.sqrt(3) * p / d * np.eye(2)
    np.testing.assert_allclose(field.stress, np.tile(expected, (50, 1, 1)), atol=1e-8)
    flat = np.abs(contacts.normal[:, 1]) < 1e-6
    field = stress_field(snapshot, contacts, np.where(flat[:, None], impulse, 0.0), kernel, at)
    expected = -2 * p / (np.sqrt(3) * d) * np.diag([1.0, 0.0])
    np.testing.assert_allclose(field.stress, np.tile(expected, (50, 1, 1)), atol=1e-8)


def test_wide_kernels_are_cut_within_the_stated_error():
    snapshot, contacts = crowd()
    impulse = solve(snapshot, contacts).impulse
    at = points()
    total = stress_field(snapshot, contacts, impulse, Kernel(width=0.4, cutoff=12.0), at)
    for cutoff in (2.0, 4.0):
        cut = stress_field(snapshot, contacts, impulse, Kernel(width=0.4, cutoff=cutoff), at)
        error = np.abs(cut.stress - total.stress).max()
        assert 0 < error <= cut.truncation
    assert stress_field(snapshot, contacts, impulse, KERNELS[1], at).truncation == 0


def test_flow_field_of_a_linear_motion_and_its_gradient():
    """Rigid rotation: the gradient at the centre is that of smeared positions; density to Σm; far NaN."""
    snapshot, _ = crowd()
    u = snapshot.position @ np.array([[0.0, 0.3], [-0.2, 0.1]])
    kernel = Kernel(width=0.5, cutoff=9.0)
    at, h = np.array([[1.9, 2.1], [2.2, 1.4]]), 1e-4
    field = flow_field(snapshot, u, kernel, at)
    np.testing.assert_allclose(field.momentum, field.density[:, None] * field.velocity)
    for axis in (0, 1):
        step = h * np.eye(2)[axis]
        up, down = (flow_field(snapshot, u, kernel, at + s * step).velocity for s in (1, -1))
        np.testing.assert_allclose(field.gradient[:, :, axis], (up - down) / (2 * h), atol=1e-7)
    axis = np.arange(-5, 9, 0.1)
    grid = np.stack(np.meshgrid(axis, axis), -1).reshape(-1, 2)
    total = np.nansum(flow_field(snapshot, u, kernel, grid).density) * 0.01
    assert total == pytest.approx(snapshot.mass.sum(), rel=1e-12)
    assert np.isnan(flow_field(snapshot, u, kernel, [[100.0, 0.0]]).velocity).all()


def test_no_contacts_no_stress():
    snapshot = disks_at([[0.0, 0.0]])
    contacts = find_contacts(snapshot, tolerance=0.0)
    field = stress_field(snapshot, contacts, np.empty((0, 2)), Kernel(width=0.3), points())
    assert not field.stress.any()
    assert not field.traction.any()
    assert field.truncation == 0
    assert not virial(snapshot, contacts, np.empty((0, 2))).any()


def test_bad_input_is_refused_by_name():
    snapshot, contacts = crowd(n=4)
    good, kernel, at = np.zeros((len(contacts), 2)), Kernel(width=0.3), points()
    broken = np.where(np.arange(len(good))[:, None] == 1, np.nan, good)
    position = {"normal": [[1, 0]], "gap": [0], "point": [[0, 0]]}
    beyond = Contacts(first=[7], second=[0], is_wall=[False], **position)

    def field(crowd=contacts, impulse=good, at=at):
        return stress_field(snapshot, crowd, impulse, kernel, at)

    for call, says in [
        *((lambda w=w: Kernel(width=w), r"width: .* positive") for w in (0, -1, np.nan, np.inf)),
        (lambda: Kernel(width=0.3, cutoff=0.5), r"cutoff: 0\.5 widths"),
        (lambda: field(impulse=broken), "impulse: not a .* in row 1"),
        (lambda: field(impulse=good[1:]), "impulse: shape"),
        (lambda: field(at=[1.0, 2.0]), "at: shape"),
        (lambda: field(at=[[np.inf, 2.0]]), "at: not a finite"),
        (lambda: coarse_grain(snapshot.position, np.zeros(3), kernel, at), "values: shape"),
        (lambda: field(beyond, [[1.0, 0.0]]), "disk index 7 where there"),
        (lambda: virial(snapshot, beyond, [[1.0, 0.0]]), "disk index 7 where there are 4 disks"),
    ]:
        with pytest.raises(ValueError, match=says):
            call()


EVERY = settings(max_examples=25, deadline=None)
SOME = st.sampled_from([Kernel(width=0.5, cutoff=9.0), Kernel(width=0.5, compact=True)])


def any_case(seed):
    """A dozen disks, their contacts up to 0.3 m apart, any impulses, any points."""
    rng = np.random.default_rng(seed)
    position, velocity = rng.uniform(0, 3, (12, 2)), rng.normal(0, 1, (12, 2))
    radius, mass = rng.uniform(0.2, 0.3, 12), rng.uniform(50, 100, 12)
    snapshot = disks_at(position, velocity, radius, mass)
    contacts = find_contacts(snapshot, tolerance=0.3)
    return snapshot, contacts, rng.normal(0, 10, (len(contacts), 2)), rng.uniform(-1, 4, (20, 2))


@EVERY
@given(st.integers(0, 10**6), st.floats(0, 6.3), st.floats(-50, 50), SOME)
def test_rotation_and_translation(seed, angle, shift, kernel):
    snapshot, contacts, impulse, at = any_case(seed)
    by, far = turn(angle), np.array([shift, -0.3 * shift])
    position = {"normal": contacts.normal @ by.T, "point": contacts.point @ by.T + far}
    there = turned(snapshot, by, far), dataclasses.replace(contacts, **position)
    before = stress_field(snapshot, contacts, impulse, kernel, at)
    after = stress_field(*there, impulse @ by.T, kernel, at @ by.T + far)
    np.testing.assert_allclose(after.stress, by @ before.stress @ by.T, atol=1e-9)
    np.testing.assert_allclose(after.pressure, before.pressure, atol=1e-9)
    np.testing.assert_allclose(after.divergence, before.divergence @ by.T, atol=1e-9)


@EVERY
@given(st.integers(0, 10**6), SOME)
def test_naming_the_disks_of_a_contact_the_other_way_round(seed, kernel):
    """The second disk gives −p to the first: the same stress, in any order of the contacts."""
    snapshot, contacts, impulse, at = any_case(seed)
    names = "first", "second", "is_wall", "normal", "gap", "point"
    back = {name: getattr(contacts, name)[::-1] for name in names}
    back |= {"first": back["second"], "second": back["first"], "normal": -back["normal"]}
    swapped = Contacts(**back)
    one = stress_field(snapshot, contacts, impulse, kernel, at)
    other = stress_field(snapshot, swapped, -impulse[::-1], kernel, at)
    np.testing.assert_allclose(one.stress, other.stress, atol=1e-10)
    np.testing.assert_allclose(one.divergence, other.divergence, atol=1e-10)


@EVERY
@given(st.integers(0, 10**6), SOME)
def test_momentum_balance_of_any_impulses(seed, kernel):
    """What impulses give the disks, smeared, is the divergence of their stress; parts add up."""
    snapshot, contacts, impulse, at = any_case(seed)
    change = contacts.momentum_change(impulse, len(snapshot))
    given_to, _ = coarse_grain(snapshot.position, change, kernel, at)
    total = stress_field(snapshot, contacts, impulse, kernel, at)
    np.testing.assert_allclose(total.divergence, given_to, atol=1e-10)
    half = np.arange(len(contacts)) % 2 == 0
    one, two = (stress_field(snapshot, contacts.select(k), impulse[k], kernel, at).stress
                for k in (half, ~half))  # fmt: skip
    np.testing.assert_allclose(total.stress, one + two, atol=1e-10)
