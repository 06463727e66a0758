"""Crowds that slide: each method of the search alone, against the law written out densely; what is
not found is said."""

import numpy as np
import pytest
from coulomb import Dense, violation
from test_steps_with_friction import FLOOR, arrays, pile

from nscd import ContactLaw, find_contacts, solve
from nscd.friction.factor import factorise, solve_factorised, solve_two
from nscd.friction.ladder import part_of
from nscd.friction.pivots.island import Search

METHODS = {
    "proximal": lambda search, none: search.by_proximal(none, none.copy(), search.velocity.copy()),
    "proximal_point": lambda search, none: search.by_point(
        search.points_from(none, none, search.velocity), 5000
    ),
    "from sweeps": lambda search, none: search.by_point(
        search.points_from_sweeps(none, none.copy()), 5000
    ),
    "ray": lambda search, none: search.by_ray(1),
    "random": lambda search, none: search.run_from(3),
}


@pytest.mark.parametrize("mu", [0.05, 0.15])
@pytest.mark.parametrize("method", METHODS)
def test_each_method_alone_finds_an_answer_that_obeys_the_law(method, mu):
    snapshot = pile(rows=8)
    contacts = find_contacts(snapshot, FLOOR, tolerance=1e-9)
    problem = arrays(snapshot, contacts, mu)
    part = part_of(problem, snapshot.position, np.arange(len(snapshot)), np.arange(len(contacts)))
    search = Search(part.problem, part.factor, 1e-11)
    METHODS[method](search, np.zeros(len(contacts)))
    lam, tau = np.empty((2, len(contacts)))
    u = np.empty_like(search.velocity)
    lam[part.contacts], tau[part.contacts] = search.reaction, search.friction
    u[part.disks] = search.velocity
    dense = Dense(snapshot, contacts, snapshot.velocity)
    assert violation(dense, lam, tau, np.full(len(contacts), mu), u.ravel()) < 1e-6
    sliding = (lam > 0) & (np.abs(dense.T @ u.ravel()) > 1e-6)
    assert sliding.sum() > 10  # the law was put to the test


def test_a_search_that_finds_nothing_says_how_far_its_best_answer_is(monkeypatch):
    for name in ("by_proximal", "by_point", "points_from_sweeps", "by_ray"):
        monkeypatch.setattr(Search, name, lambda *arguments: None)
    monkeypatch.setattr("nscd.friction.ladder.LOOKS", ((1e-4, 0), (1e-9, 0)))
    snapshot = pile(rows=8)
    contacts = find_contacts(snapshot, FLOOR, tolerance=1e-9)
    found = solve(snapshot, contacts, law=ContactLaw(friction=0.15), tolerance=1e-10)
    assert found.status == "inaccurate"
    assert found.solver == "none"
    assert found.friction.natural_map > 1e-10
    assert f"residual {max(found.friction.natural_map, found.momentum_error):.1e}" in found.reason


def test_the_effort_of_the_proximal_point_method_is_bounded():
    snapshot, mu = pile(rows=12), 0.15
    contacts = find_contacts(snapshot, FLOOR, tolerance=1e-9)
    problem = arrays(snapshot, contacts, mu)
    part = part_of(problem, snapshot.position, np.arange(len(snapshot)), np.arange(len(contacts)))
    search, none = Search(part.problem, part.factor, 1e-30), np.zeros(len(contacts))
    points = search.points_from(none, none, search.velocity)
    search.by_point(points, 600)
    once, error = search.pivots, search.error
    assert once <= 600
    search.by_point(points, 600)  # and goes on from there
    assert once < search.pivots <= 1200
    assert search.error < error


def test_the_matrix_of_contacts_that_stick_and_slide_is_solved_for_one_and_for_two_right_hand_sides():
    snapshot = pile(rows=8)
    contacts = find_contacts(snapshot, FLOOR, tolerance=1e-9)
    n, k = len(snapshot), len(contacts)
    problem = arrays(snapshot, contacts, 0.3)
    part = part_of(problem, snapshot.position, np.arange(n), np.arange(k))
    rng = np.random.default_rng(1)
    weight = 1e4 * rng.random((4, k))
    weight[2:] *= rng.choice([-0.3, 0.0, 0.3], (2, k))
    dense = Dense(snapshot, contacts, snapshot.velocity)
    alpha, beta, gamma, delta = weight
    matrix = np.diag(dense.mass) + dense.N.T @ (alpha[:, None] * dense.N + delta[:, None] * dense.T)
    matrix += dense.T.T @ (beta[:, None] * dense.T + gamma[:, None] * dense.N)
    assert np.abs(matrix - matrix.T).max() > 1.0
    given = rng.random((2, n, 3))
    given[1, rng.permutation(n)[3:]] = 0.0  # of one contact most is zero
    expected = [np.linalg.solve(matrix, one.ravel()).reshape(n, 3) for one in given]
    assert factorise(part.problem, part.factor, weight[:, part.contacts])
    one, two = given[:, part.disks].copy()
    solve_two(part.factor, one, two)
    alone = given[0, part.disks].copy()
    solve_factorised(part.factor, alone)
    for found, right in zip((one, two, alone), (*expected, expected[0]), strict=True):
        np.testing.assert_allclose(found, right[part.disks], rtol=0, atol=1e-9 * abs(right).max())
