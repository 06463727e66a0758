"""Small crowds: the certificate of an answer computed again, and which method gives it."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscd import ContactLaw, Contacts, Snapshot, Walls, find_contacts, solve

WALLS = Walls(start=[[-1, -0.25]], end=[[9, -0.25]])


def crowd(seed, n, kept, decades=0.0):
    """A triangular lattice of which a share is kept: pairs, chains, rings and jams."""
    rng = np.random.default_rng(seed)
    side = int(np.ceil(np.sqrt(n / kept)))
    sites = np.array(
        [
            [0.5 * i + 0.25 * (j % 2), 0.25 * np.sqrt(3) * j]
            for i in range(side)
            for j in range(side)
        ]
    )
    chosen = rng.permutation(len(sites))[:n]
    return Snapshot(
        position=sites[chosen],
        velocity=rng.normal(size=(n, 2)),
        radius=np.full(n, 0.25),
        mass=60.0 * 10.0 ** rng.uniform(-decades, decades, n),
    )


@settings(max_examples=40)
@given(
    st.integers(0, 10**6), st.integers(2, 40), st.floats(0.15, 1.0), st.floats(0.0, 2.0),
    st.booleans(),
)  # fmt: skip
def test_what_an_answer_says_of_itself_is_so(seed, n, kept, decades, canonical):
    """The law and the certificate, computed again from impulses and velocities."""
    snapshot = crowd(seed, n, kept, decades)
    contacts = find_contacts(snapshot, WALLS, tolerance=1e-9)
    found = solve(snapshot, contacts, tolerance=1e-10, canonical=canonical)
    assert found.status == "solved"
    before, after, mass = snapshot.velocity, found.right_velocity, snapshot.mass[:, None]
    np.testing.assert_allclose(found.impulse, found.reaction[:, None] * contacts.normal, atol=1e-15)
    scale, weight = np.abs(before).max(), contacts.inverse_mass(snapshot.mass)
    error = np.minimum(weight * found.reaction, -contacts.approach_velocity(after))
    assert found.residual == pytest.approx(np.abs(error).max(initial=0.0) / scale, abs=1e-14)
    off = mass * (after - before) - contacts.momentum_change(found.impulse, n)
    received = contacts.sum_at_disks(found.reaction, n)
    share = np.abs(off).max(1) / (snapshot.mass * scale + received)
    assert found.momentum_error == pytest.approx(share.max(), abs=1e-14)
    energy = 0.5 * (mass * (after**2 - before**2)).sum()
    assert found.energy_change == pytest.approx(energy, abs=1e-12 * (mass * before**2).sum())
    assert found.energy_change <= 1e-9 * (mass * before**2).sum()


@pytest.mark.parametrize(
    ("n", "kept", "decades", "solver", "why"),
    [
        (12, 0.2, 0.0, "tree", "form trees"),
        (64, 0.6, 0.0, "active_set", "descent found the closed contacts"),
        (64, 0.85, 0.0, "interior_point", "does not find the closed contacts"),
        (64, 0.85, 2.0, "interior_point", "masses far apart"),
    ],
)
def test_each_rung_is_taken(n, kept, decades, solver, why):
    """Everybody walks to the middle."""
    still = crowd(4, n, kept, decades)
    inward = still.position.mean(0) - still.position
    snapshot = dataclasses.replace(still, velocity=inward)
    contacts = find_contacts(snapshot, WALLS, tolerance=1e-9)
    answer = solve(snapshot, contacts, tolerance=1e-10)
    assert answer.status == "solved"
    assert answer.solver == solver
    assert why in answer.choice
    assert answer.canonical


def test_a_contact_of_nobody_is_refused():
    pair = Snapshot(position=[[0, 0], [1, 0]], velocity=[[1, 0], [0, 0]], radius=[0.5] * 2, mass=[1, 1])  # fmt: skip
    touching = find_contacts(pair, tolerance=0)
    other = Contacts(
        first=[0], second=[7], is_wall=[False], normal=touching.normal, gap=touching.gap,
        point=touching.point,
    )  # fmt: skip
    with pytest.raises(ValueError, match="disk index 7 where there are 2 disks"):
        solve(pair, other)


def test_laws_that_do_more_than_push_are_not_plain():
    assert ContactLaw().plain
    assert ContactLaw(tangential_dissipation=0.0).plain
    for law in (
        ContactLaw(dissipation=1.0),
        ContactLaw(restitution=0.0),
        ContactLaw(tangential_dissipation=1.0),
        ContactLaw(friction=0.1),
        ContactLaw(wall_friction=0.1),
        ContactLaw(maintained=True),
    ):
        assert not law.plain
