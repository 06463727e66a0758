"""Friction on small random crowds, against all answers there are, and against conservation laws."""

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from nscd import ContactLaw, Snapshot, Walls, find_contacts, solve
from tests.friction.coulomb import Dense, all_answers, violation

WALL = Walls(start=[[-50.0, 0.0]], end=[[50.0, 0.0]])
MU = st.sampled_from([0.05, 0.1, 0.3, 0.5, 1.0, 2.0])


@st.composite
def clusters(draw, most=5):
    """Disks that each touch the one before; the first one the floor y = 0."""
    n = draw(st.integers(1, most))
    radius = np.array(draw(st.lists(st.floats(0.15, 0.4), min_size=n, max_size=n)))
    mass = np.array(draw(st.lists(st.floats(30.0, 120.0), min_size=n, max_size=n)))
    angle = np.array(draw(st.lists(st.floats(0.3, 2.8), min_size=n, max_size=n)))
    position = np.zeros((n, 2))
    position[0] = 0.0, radius[0]
    for i in range(1, n):
        step = radius[i - 1] + radius[i]
        position[i] = position[i - 1] + step * np.array([np.cos(angle[i]), np.sin(angle[i])])
    numbers = draw(st.lists(st.floats(-2.0, 2.0), min_size=3 * n, max_size=3 * n))
    velocity = np.array(numbers[: 2 * n]).reshape(n, 2)
    spin = np.array(numbers[2 * n :])
    return Snapshot(position=position, velocity=velocity, radius=radius, mass=mass, spin=spin)


@settings(max_examples=60, deadline=None)
@given(snapshot=clusters(most=4), mu=MU, wall_mu=MU)
def test_the_answer_is_one_of_those_that_exist(snapshot, mu, wall_mu):
    contacts = find_contacts(snapshot, WALL, tolerance=1e-9)
    assume(len(contacts) <= 5)
    assume((contacts.gap > -1e-9).all())
    found = solve(
        snapshot, contacts, law=ContactLaw(friction=mu, wall_friction=wall_mu), tolerance=1e-10
    )
    assert found.status == "solved"
    friction = np.where(contacts.is_wall, wall_mu, mu)
    dense = Dense(snapshot, contacts, snapshot.velocity)
    mine = np.column_stack([found.right_velocity, found.right_spin]).ravel()
    tau = found.friction.tangential
    assert violation(dense, found.reaction, tau, friction, mine) < 1e-6
    answers, singular = all_answers(dense, friction)
    assume(not singular)
    assert min(np.abs(u - mine).max() for u in answers) < 1e-6


@settings(max_examples=40, deadline=None)
@given(snapshot=clusters(), mu=MU)
def test_friction_dissipates_and_stays_in_its_cone(snapshot, mu):
    contacts = find_contacts(snapshot, WALL, tolerance=1e-9)
    found = solve(snapshot, contacts, law=ContactLaw(friction=mu), tolerance=1e-10)
    energy = 0.5 * (snapshot.mass[:, None] * snapshot.velocity**2).sum() + 1.0
    assert found.energy_change <= 1e-9 * energy
    assert found.energy_error < 1e-9
    part = found.friction
    assert max(part.signorini, part.cone, part.natural_map) <= 1e-10
    assert part.dissipation < 1e-8
    assert (np.abs(part.tangential) <= mu * found.reaction + 1e-8).all()
