"""Laws that percussions obey whatever the crowd: balance, admissibility, invariance."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from nscd import ContactLaw, Walls, find_contacts, solve
from tests.crowds import disks_at, lattice

WALLS = Walls(start=[[-3, -0.6], [2.6, -3]], end=[[5, -0.6], [2.6, 3]])


def solved(snapshot, walls=WALLS, **law):
    contacts = find_contacts(snapshot, walls, tolerance=1e-9)
    answer = solve(snapshot, contacts, law=ContactLaw(**law), tolerance=1e-10)
    assert answer.status == "solved", answer.reason
    return contacts, answer


@given(st.integers(0, 10**6))
def test_balance_energy_and_complementarity(seed):
    snapshot = lattice(seed, decades=4.0)
    contacts, answer = solved(snapshot)
    momentum = snapshot.mass[:, None] * (answer.right_velocity - snapshot.velocity)
    size = snapshot.mass * np.abs(snapshot.velocity).max() + np.abs(answer.reaction).sum()
    assert (
        np.abs(momentum - contacts.momentum_change(answer.impulse, len(snapshot))).max(1)
        < 1e-9 * size
    ).all()
    assert answer.energy_change <= 1e-12
    assert answer.reaction.min() >= 0
    approach = contacts.approach_velocity(answer.right_velocity)
    assert approach.max() < 1e-9
    assert (
        np.minimum(answer.reaction * contacts.inverse_mass(snapshot.mass), -approach) < 1e-9
    ).all()


@given(st.integers(0, 10**6), st.floats(0, 2 * np.pi))
def test_rotation_turns_the_answer(seed, angle):
    snapshot = lattice(seed, decades=4.0)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    turned = disks_at(
        snapshot.position @ turn.T, snapshot.velocity @ turn.T, snapshot.radius, snapshot.mass
    )
    walls = Walls(start=WALLS.start @ turn.T, end=WALLS.end @ turn.T)
    (one, a), (two, b) = solved(snapshot), solved(turned, walls)
    assert len(one) == len(two)
    np.testing.assert_allclose(b.right_velocity, a.right_velocity @ turn.T, atol=1e-8)


@given(st.integers(0, 10**6))
def test_order_of_disks_does_not_matter(seed):
    snapshot = lattice(seed, decades=4.0)
    order = np.random.default_rng(seed + 1).permutation(len(snapshot))
    shuffled = disks_at(
        snapshot.position[order],
        snapshot.velocity[order],
        snapshot.radius[order],
        snapshot.mass[order],
    )
    np.testing.assert_allclose(
        solved(shuffled)[1].right_velocity, solved(snapshot)[1].right_velocity[order], atol=1e-8
    )


@given(st.integers(0, 10**6), st.sampled_from([1e-3, 1e3]), st.sampled_from([1e-2, 1e2]))
def test_units_scale_the_answer(seed, mass_scale, velocity_scale):
    snapshot = lattice(seed, decades=4.0)
    scaled = disks_at(
        snapshot.position,
        velocity_scale * snapshot.velocity,
        snapshot.radius,
        mass_scale * snapshot.mass,
    )
    a, b = solved(snapshot)[1], solved(scaled)[1]
    np.testing.assert_allclose(
        b.right_velocity, velocity_scale * a.right_velocity, atol=1e-8 * velocity_scale
    )
