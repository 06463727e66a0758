"""Rival force laws against hand-computed pairs, closed forms of a chain, symmetries and an
independent solver."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import nnls

from nscd import Walls, find_contacts, solve
from nscd.rivals import LoehnerReading, SocialForceLaw, first_order, loehner_force, social_force
from tests.crowds import disks_at, line, turn, turned, wall_after
from tests.refusals import refusals

RADIUS = 0.25
UNEQUAL = np.array([50.0, 93, 61, 75, 88, 52, 99, 70, 64, 81])


def pair(gap, radii=(0.2, 0.3), velocities=((0.0, 0.0), (0.0, 0.0))):
    """Two disks along x with the given gap, and their one contact."""
    snapshot = disks_at([[0, 0], [sum(radii) + gap, 0]], velocities, radii, [60.0, 80.0])
    return snapshot, find_contacts(snapshot, tolerance=max(gap, 0) + 1e-9)


def crowd(seed, n=25, unequal=True):
    """Random disks in the plane, some overlapping, all moving."""
    rng = np.random.default_rng(seed)
    return disks_at(
        rng.uniform(0, 1.8, (n, 2)),
        rng.normal(0, 1.5, (n, 2)),
        rng.uniform(0.15, 0.25, n),
        rng.uniform(50, 100, n) if unequal else np.full(n, 75.0),
    )


@pytest.mark.parametrize("mass", [1.0, 75.0])
def test_first_order_is_the_percussion_of_equal_masses(mass):
    """λ of (4) times the common mass is the percussion, where it is unique."""
    snapshot = line(np.full(10, mass), np.linspace(2, 0, 10))
    contacts = find_contacts(snapshot, tolerance=1e-9)
    model = first_order(snapshot, contacts)
    assert model.status == "solved"
    reaction = solve(snapshot, contacts).reaction
    np.testing.assert_allclose(model.multiplier * mass, reaction, rtol=1e-9)


def test_first_order_misjudges_unequal_masses():
    """Against a wall λ(i,i+1) of (4) is i·u whatever the masses; the percussion is Σ_{j≤i} m_j
    u."""
    snapshot = line(UNEQUAL, 2.0)
    contacts = find_contacts(snapshot, wall_after(snapshot), tolerance=1e-9)
    model = first_order(snapshot, contacts)
    np.testing.assert_allclose(model.multiplier, 2.0 * np.arange(1, 11), rtol=1e-9)
    scaled = model.multiplier * UNEQUAL.mean()
    error = scaled / np.cumsum(2.0 * UNEQUAL) - 1
    assert np.abs(error).max() > 0.4  # the first: 73.3 kg in place of 50 kg
    assert abs(error[-1]) < 1e-9  # the wall carries the whole mass


@pytest.mark.parametrize("seed", range(4))
def test_first_order_against_least_squares_with_bounds(seed):
    """u⁺ is the projection of u⁻ on {C u ≤ 0}: λ of min |Cᵀλ − u⁻|, λ ≥ 0 gives the same."""
    snapshot = crowd(seed)
    contacts = find_contacts(snapshot, tolerance=0.02)
    model = first_order(snapshot, contacts)
    assert model.status == "solved"
    C = contacts.normal_matrix(len(snapshot)).toarray()
    oracle, _ = nnls(C.T, snapshot.velocity.ravel(), maxiter=5000)
    right = (snapshot.velocity.ravel() - C.T @ oracle).reshape(-1, 2)
    np.testing.assert_allclose(model.right_velocity, right, atol=1e-8)
    masses_count = solve(snapshot, contacts).right_velocity
    assert np.abs(masses_count - right).max() > 0.01


@pytest.mark.parametrize("seed", range(4))
def test_maintained_first_order_is_the_printed_equality(seed):
    """CCᵀλ = C u⁻ by dense least squares; some λ pull, which the complementarity forbids."""
    snapshot = crowd(seed, n=12)
    contacts = find_contacts(snapshot, tolerance=0.02)
    model = first_order(snapshot, contacts, maintained=True)
    C = contacts.normal_matrix(len(snapshot)).toarray()
    oracle = np.linalg.lstsq(C @ C.T, C @ snapshot.velocity.ravel(), rcond=1e-10)[0]
    assert model.status == "solved"
    np.testing.assert_allclose(C @ model.right_velocity.ravel(), 0, atol=1e-9)
    # the shortest λ where they are redundant
    np.testing.assert_allclose(model.multiplier, oracle, atol=1e-9)
    assert model.multiplier.min() < -0.01
    assert first_order(snapshot, contacts).multiplier.min() >= 0


def test_social_force_of_an_overlapping_pair_by_hand():
    """10 mm of overlap, the second passes at 0.5 m/s: 2000 e^{1/8} + 1200 N along, 1200 N across."""
    snapshot, contacts = pair(-0.01, velocities=((0, 0), (0, 0.5)))
    found = social_force(snapshot, contacts)
    np.testing.assert_allclose(found.repulsion, 2266.2969061336526, rtol=1e-12)
    np.testing.assert_allclose(found.body, 1200, rtol=1e-12)
    wanted = [[-3466.2969061336526, 1200], [3466.2969061336526, -1200]]
    np.testing.assert_allclose(found.resultant(), wanted, rtol=1e-12)
    np.testing.assert_allclose(found.magnitude_sum(), 3466.2969061336526, rtol=1e-12)


def test_social_force_of_a_wall():
    """A disk 5 mm into a wall that it slides along at 1 m/s is held back by 2.4e5 · 0.005 = 1200
    N."""
    snapshot = disks_at([[0, 0.245]], [1.0, 0])
    contacts = find_contacts(snapshot, Walls(start=[[-1, 0]], end=[[1, 0]]), tolerance=0.0)
    normal = 2000 * np.exp(0.0625) + 600
    found = social_force(snapshot, contacts).resultant()
    np.testing.assert_allclose(found, [[-1200, normal]], rtol=1e-12, atol=1e-9)


def test_social_force_at_touch_is_its_strength_all_along_a_chain():
    snapshot = line(UNEQUAL, 2.0)
    found = social_force(snapshot, find_contacts(snapshot, wall_after(snapshot), tolerance=1e-9))
    assert len(found.normal) == 10
    np.testing.assert_allclose(found.normal, 2000, rtol=1e-12)
    np.testing.assert_allclose(found.resultant()[1:], 0, atol=1e-8)


def test_social_force_of_next_neighbours():
    """A pair with m disks between: A exp(−2rm/B); at an end of a chain the geometric series."""
    snapshot = line(np.full(6, 75.0), 0.0)
    law = SocialForceLaw()
    pairs = find_contacts(snapshot, tolerance=10.0)
    found = social_force(snapshot, pairs, law)
    between = pairs.second - pairs.first - 1
    ratio = np.exp(-2 * RADIUS / 0.08)
    np.testing.assert_allclose(found.normal, 2000 * ratio**between, rtol=1e-10)
    series = 2000 * (1 - ratio**5) / (1 - ratio)
    np.testing.assert_allclose(found.magnitude_sum()[0], series, rtol=1e-12)


def test_what_a_search_leaves_out():
    """Beyond law.reach(f) each pair gives less than f; the sums differ by less than (n − 1) f."""
    snapshot, law = crowd(1, n=60), SocialForceLaw()
    every = social_force(snapshot, find_contacts(snapshot, tolerance=100.0))
    reach = law.reach(1.0)
    near = social_force(snapshot, find_contacts(snapshot, tolerance=reach))
    assert law.repulsion(np.array([reach]))[0] == pytest.approx(1.0)
    missing = every.magnitude_sum() - near.magnitude_sum()
    assert 0 < missing.max() < 59.0


@given(st.integers(0, 10_000))
def test_social_force_keeps_momentum_and_friction_dissipates(seed):
    snapshot = crowd(seed)
    found = social_force(snapshot, find_contacts(snapshot, tolerance=1.0))
    np.testing.assert_allclose(found.resultant().sum(0), 0, atol=1e-7)
    power = (found.sliding * found.pairs.deformation_velocity(snapshot.velocity)).sum(1)
    assert (power >= 0).all()  # what the first gives to the second times how fast it slips past it


@pytest.mark.parametrize(("gap", "printed"), [(0.0, 60), (1e-6, 120), (-1e-6, 60)])
def test_loehner_jumps_by_two_at_touch(gap, printed):
    """Equal radii: d_i = 2 at touch, so f_max/5 on one side and 2 f_max/5 on the other."""
    snapshot, contacts = pair(gap, radii=(0.25, 0.25))
    for reading, force in ((LoehnerReading.PRINTED, printed), (LoehnerReading.TEXT, 180 - printed)):
        found = loehner_force(snapshot, contacts, 300.0, reading)
        np.testing.assert_allclose([found.on_first[0], found.on_second[0]], force, rtol=1e-5)


def test_loehner_is_not_symmetric_for_unequal_radii():
    """r = 0.2 and 0.3 m at touch: 300/(1 + 2.5²) on the first, 300/(1 + (5/3)²) on the second."""
    snapshot, contacts = pair(0.0)
    found = loehner_force(snapshot, contacts, 300.0, LoehnerReading.PRINTED, tolerance=1e-9)
    wanted = [[-300 / 7.25, 0], [300 / (1 + 25 / 9), 0]]
    np.testing.assert_allclose(found.resultant(), wanted, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.magnitude_sum(), [300 / 7.25, 300 * 9 / 34], rtol=1e-12)


def test_loehner_by_receiver_and_at_a_wall():
    """f_max belongs to who receives; a wall is a neighbour without radius and receives nothing."""
    snapshot = line(np.array([60.0, 80.0]), 0.0)
    contacts = find_contacts(snapshot, wall_after(snapshot), tolerance=1e-9)
    found = loehner_force(snapshot, contacts, [100.0, 200.0], LoehnerReading.TEXT)
    np.testing.assert_allclose(found.on_first, [2 * 100 / 5, 2 * 200 / 2], rtol=1e-12)
    np.testing.assert_allclose(found.on_second, [2 * 200 / 5, 0], rtol=1e-12)


@given(st.integers(0, 10_000), st.floats(-np.pi, np.pi))
def test_forces_turn_with_the_crowd(seed, angle):
    still, by = crowd(seed, n=12), turn(angle)
    limit = np.linspace(100, 400, 12)
    for force in (social_force, lambda a, b: loehner_force(a, b, limit, LoehnerReading.PRINTED)):
        both = still, turned(still, by)
        a, b = (force(x, find_contacts(x, tolerance=5.0)).resultant() for x in both)
        np.testing.assert_allclose(b, a @ by.T, atol=1e-7 * np.abs(a).max())


TEXT = LoehnerReading.TEXT
FIVE = find_contacts(line(np.full(5, 75.0), 0.0), tolerance=1e-9)
THREE = line(np.full(3, 75.0), 0.0)


test_bad_input = refusals(
    (lambda: SocialForceLaw(strength=-1.0), "strength"),
    (lambda: SocialForceLaw(decay=0.0), "decay"),
    (lambda: SocialForceLaw(body_stiffness=np.nan), "body_stiffness"),
    (lambda: SocialForceLaw(sliding_friction=np.inf), "sliding_friction"),
    *((lambda f=f: SocialForceLaw().reach(f), "left_out") for f in (0.0, -1.0, 3000.0, np.nan)),
    *((lambda f=f: loehner_force(*pair(0.0), f, TEXT), "maximum_force") for f in (-1.0, np.nan, [1, 2, 3])),
    (lambda: loehner_force(*pair(0.0), 1.0, TEXT, tolerance=-1.0), "tolerance"),
    (lambda: loehner_force(*pair(0.0), 1.0, "upside down"), "reading"),
    (lambda: social_force(THREE, FIVE), "contacts: disk index 4"),
    (lambda: first_order(THREE, FIVE), "contacts: disk index 4"),
    (lambda: loehner_force(THREE, FIVE, 1.0, TEXT), "contacts: disk index 4"),
)  # fmt: skip
