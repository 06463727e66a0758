"""Coarse-grained stress follows translations, rotations and orders of contacts; it adds up."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from nscd import Contacts, find_contacts
from nscd.stress import Kernel, smear, stress_field
from tests.crowds import disks_at

EVERY = settings(max_examples=25, deadline=None)
KERNELS = st.sampled_from([Kernel(width=0.5, cutoff=9.0), Kernel(width=0.5, compact=True)])


def case(seed):
    """A dozen disks, their contacts up to 0.3 m apart, any impulses, any points."""
    rng = np.random.default_rng(seed)
    snapshot = disks_at(
        rng.uniform(0, 3, (12, 2)),
        rng.normal(0, 1, (12, 2)),
        rng.uniform(0.2, 0.3, 12),
        rng.uniform(50, 100, 12),
    )
    contacts = find_contacts(snapshot, tolerance=0.3)
    return snapshot, contacts, rng.normal(0, 10, (len(contacts), 2)), rng.uniform(-1, 4, (20, 2))


def moved(snapshot, contacts, turn, shift):
    there = disks_at(
        snapshot.position @ turn.T + shift,
        snapshot.velocity @ turn.T,
        snapshot.radius,
        snapshot.mass,
    )
    return there, Contacts(
        first=contacts.first,
        second=contacts.second,
        is_wall=contacts.is_wall,
        normal=contacts.normal @ turn.T,
        gap=contacts.gap,
        point=contacts.point @ turn.T + shift,
    )


@EVERY
@given(st.integers(0, 10**6), st.floats(0, 6.3), st.floats(-50, 50), KERNELS)
def test_rotation_and_translation(seed, angle, shift, kernel):
    snapshot, contacts, impulse, at = case(seed)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    by = np.array([shift, -0.3 * shift])
    before = stress_field(snapshot, contacts, impulse, kernel, at)
    after = stress_field(
        *moved(snapshot, contacts, turn, by), impulse @ turn.T, kernel, at @ turn.T + by
    )
    np.testing.assert_allclose(after.stress, turn @ before.stress @ turn.T, atol=1e-9)
    np.testing.assert_allclose(after.pressure, before.pressure, atol=1e-9)
    np.testing.assert_allclose(after.divergence, before.divergence @ turn.T, atol=1e-9)


@EVERY
@given(st.integers(0, 10**6), KERNELS)
def test_naming_the_disks_of_a_contact_the_other_way_round(seed, kernel):
    """The second disk gives −p to the first: the same stress; and the order of contacts does not
    matter."""
    snapshot, contacts, impulse, at = case(seed)
    swapped = Contacts(
        first=contacts.second[::-1],
        second=contacts.first[::-1],
        is_wall=contacts.is_wall[::-1],
        normal=-contacts.normal[::-1],
        gap=contacts.gap[::-1],
        point=contacts.point[::-1],
    )
    one = stress_field(snapshot, contacts, impulse, kernel, at)
    other = stress_field(snapshot, swapped, -impulse[::-1], kernel, at)
    np.testing.assert_allclose(one.stress, other.stress, atol=1e-10)
    np.testing.assert_allclose(one.divergence, other.divergence, atol=1e-10)


@EVERY
@given(st.integers(0, 10**6), KERNELS)
def test_momentum_balance_of_any_impulses(seed, kernel):
    """What impulses give the disks, smeared, is the divergence of their stress; parts of a crowd
    add up."""
    snapshot, contacts, impulse, at = case(seed)
    given_to, _ = smear(
        snapshot.position, contacts.momentum_change(impulse, len(snapshot)), kernel, at
    )
    whole = stress_field(snapshot, contacts, impulse, kernel, at)
    np.testing.assert_allclose(whole.divergence, given_to, atol=1e-10)
    half = np.arange(len(contacts)) % 2 == 0
    parts = [
        stress_field(snapshot, contacts.select(k), impulse[k], kernel, at).stress
        for k in (half, ~half)
    ]
    np.testing.assert_allclose(whole.stress, sum(parts), atol=1e-10)
