"""Steps of a moving crowd with friction: the array entry against `solve`, and what a guess is
worth."""

import numpy as np
import pytest

from nscd import ContactLaw, Walls, find_contacts, solve
from nscd.friction import carried_over, problem_of, solve_step
from tests.crowds import disks_at
from tests.friction.coulomb import Dense, violation

FLOOR = Walls(start=[[-99.0, 0.0]], end=[[99.0, 0.0]])


def pile(rows=6):
    """A triangular pile of disks on the floor, falling and spinning a little."""
    rng = np.random.default_rng(4)
    position = [(2.0 * i + j, 1.0 + np.sqrt(3.0) * j) for j in range(rows) for i in range(rows - j)]
    n = len(position)
    velocity = np.array([0.0, -1.0]) + 0.05 * rng.normal(size=(n, 2))
    return disks_at(np.array(position) - [rows, 0.0], velocity, 1.0, spin=0.1 * rng.normal(size=n))


def arrays(snapshot, contacts, mu):
    return problem_of(
        pairs=(
            contacts.first.astype(np.int32),
            np.where(contacts.is_wall, -1, contacts.second).astype(np.int32),
        ),
        normal=np.array(contacts.normal),
        friction=np.full(len(contacts), mu),
        radius=snapshot.radius,
        mass=np.column_stack([snapshot.mass, snapshot.mass, snapshot.inertia]),
        left=np.column_stack([snapshot.velocity, snapshot.spin]),
    )


@pytest.mark.parametrize("mu", [0.05, 0.2])
def test_a_step_finds_what_solve_finds(mu):
    snapshot = pile()
    contacts = find_contacts(snapshot, FLOOR, tolerance=1e-9)
    found = solve(snapshot, contacts, law=ContactLaw(friction=mu), tolerance=1e-12)
    step = solve_step(arrays(snapshot, contacts, mu), snapshot.position, tolerance=1e-9)
    assert step.error <= 1e-9
    np.testing.assert_allclose(step.velocity[:, :2], found.right_velocity, atol=1e-6)
    np.testing.assert_allclose(step.velocity[:, 2], found.right_spin, atol=1e-6)


def test_a_step_and_solve_may_find_different_answers_both_of_which_obey_the_law():
    snapshot, mu = pile(), 0.6
    contacts = find_contacts(snapshot, FLOOR, tolerance=1e-9)
    found = solve(snapshot, contacts, law=ContactLaw(friction=mu), tolerance=1e-12)
    step = solve_step(arrays(snapshot, contacts, mu), snapshot.position, tolerance=1e-9)
    dense = Dense(snapshot, contacts, snapshot.velocity)
    friction = np.full(len(contacts), mu)
    mine = np.column_stack([found.right_velocity, found.right_spin]).ravel()
    theirs = step.velocity.ravel()
    assert violation(dense, found.reaction, found.friction.tangential, friction, mine) < 1e-6
    assert violation(dense, step.reaction, step.friction, friction, theirs) < 1e-6
    assert np.abs(mine - theirs).max() > 0.1


@pytest.mark.parametrize("mu", [0.1, 0.2])
def test_a_pile_that_slides_is_solved_where_sweeps_do_not_reach(mu):
    snapshot = pile(14)
    contacts = find_contacts(snapshot, FLOOR, tolerance=1e-9)
    problem = arrays(snapshot, contacts, mu)
    step = solve_step(problem, snapshot.position, tolerance=1e-9)
    again = solve_step(problem, snapshot.position, tolerance=1e-9)
    assert step.solver in {"proximal", "path"}
    assert step.error <= 1e-9
    np.testing.assert_array_equal(step.velocity, again.velocity)
    dense = Dense(snapshot, contacts, snapshot.velocity)
    friction = np.full(len(contacts), mu)
    wrong = violation(dense, step.reaction, step.friction, friction, step.velocity.ravel())
    assert wrong < 1e-6 * dense.mass.max()


def test_an_island_that_nothing_presses_keeps_its_velocities_whatever_the_guess():
    snapshot = pile(2)
    contacts = find_contacts(snapshot, FLOOR, tolerance=1e-9)
    still = arrays(snapshot, contacts, 0.3)
    still = still._replace(left=np.tile([0.1, 0.0, 0.0], (len(snapshot), 1)))
    step = solve_step(still, snapshot.position, np.ones((2, len(contacts))))
    np.testing.assert_array_equal(step.velocity, still.left)
    assert not step.reaction.any()
    assert not step.friction.any()


def test_contacts_too_far_to_close_in_the_step_stay_open():
    snapshot = disks_at([[0.0, 1.0]], [1.0, -0.5], 1.0, spin=[0.0])
    contacts = find_contacts(snapshot, FLOOR, tolerance=1e-9)
    problem = arrays(snapshot, contacts, 0.3)
    far = solve_step(problem._replace(offset=np.array([0.6])), snapshot.position)
    near = solve_step(problem._replace(offset=np.array([0.2])), snapshot.position)
    np.testing.assert_array_equal(far.velocity, [[1.0, -0.5, 0.0]])
    # the floor takes 0.3 m/s of the fall, and friction 0.3 of that along it
    np.testing.assert_allclose(near.velocity, [[0.91, -0.2, -0.18]], atol=1e-12)


def test_percussions_are_carried_over_by_key():
    before = np.array([[1.0, 2.0, 3.0], [0.1, 0.2, 0.3]])
    guess = carried_over(np.array([7, 3, 5]), before, np.array([5, 4, 7, 9]))
    np.testing.assert_array_equal(guess, [[3.0, 0.0, 1.0, 0.0], [0.3, 0.0, 0.1, 0.0]])
    assert carried_over(np.empty(0, int), np.empty((2, 0)), np.array([1])).tolist() == [[0.0]] * 2
