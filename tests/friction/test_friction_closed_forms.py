"""Friction against answers that are known in closed form. Steps of a moving crowd with friction:
the core against `solve`, and what a guess is worth."""

from dataclasses import replace

import numpy as np
import pytest

from nscd import ContactLaw, Contacts, ContactState, Walls, find_contacts, solve
from nscd._core import Percussed
from nscd.stepping import Motion
from tests.crowds import disks_at
from tests.friction.coulomb import Dense, all_answers, velocities, violation
from tests.refusals import refusals

EXACT = 1e-12


def on_walls(velocity, angles, spin=0.0, radius=1.0, mass=75.0):
    """One disk at the origin that touches walls whose inward normals are at these angles,
    degrees."""
    angles = np.radians(np.atleast_1d(angles))
    normal = -np.column_stack([np.cos(angles), np.sin(angles)])
    snapshot = disks_at([[0.0, 0.0]], [velocity], [radius], [mass], spin=[spin])
    k, position = len(normal), {"normal": normal, "point": radius * normal}
    walls = {"first": [0] * k, "second": np.arange(k), "is_wall": [True] * k}
    return snapshot, Contacts(**walls, gap=np.zeros(k), **position)


@pytest.mark.parametrize(
    ("mu", "across", "speed", "rim"),
    [(0.05, 7.5, 0.9, -0.2), (0.1, 15, 0.8, -0.4), *((mu, 25, 2 / 3, -2 / 3) for mu in (1 / 6, 1))],
)
def test_oblique_impact_slides_or_rolls(mu, across, speed, rim):
    snapshot, contacts = on_walls((1.0, -2.0), 90.0, radius=0.25)
    found = solve(snapshot, contacts, law=ContactLaw(friction=mu), tolerance=EXACT)
    assert found.status == "solved"
    np.testing.assert_allclose(found.impulse[0], [across, -150.0], atol=1e-9)
    np.testing.assert_allclose(found.right_velocity[0], [speed, 0.0], atol=1e-12)
    assert found.right_spin[0] * 0.25 == pytest.approx(rim, abs=1e-12)
    slides = mu < 1 / 6
    assert found.friction.state[0] == (ContactState.FORWARD if slides else ContactState.STICK)


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.19, 0.1925, 0.5])
def test_incline_of_30_degrees(mu):
    snapshot, contacts = on_walls((0.0, -1.0), 120.0)
    found = solve(snapshot, contacts, law=ContactLaw(friction=mu), tolerance=EXACT)
    down = np.array([-np.cos(np.radians(30)), -np.sin(np.radians(30))])
    rolls = mu >= np.tan(np.radians(30)) / 3
    along = 1 / 3 if rolls else 0.5 - mu * np.cos(np.radians(30))
    assert found.right_velocity[0] @ down == pytest.approx(along, abs=1e-12)
    rim = along if rolls else 2 * mu * np.cos(np.radians(30))
    assert abs(found.right_spin[0]) == pytest.approx(rim, abs=1e-12)


def pyramid(gap=0.0):
    """Two equal disks on the floor that touch, or stand apart, and one on top, all falling at 1
    m/s."""
    half = 1.0 + 0.5 * gap
    position = [[-half, 1.0], [half, 1.0], [0.0, 1.0 + np.sqrt(4.0 - half**2)]]
    snapshot = disks_at(position, [0.0, -1.0], 1.0)
    return snapshot, in_contact(snapshot)


STANDS = 2 - np.sqrt(3)


def test_pyramid_stands_from_two_minus_root_three():
    snapshot, contacts = pyramid()
    found = solve(snapshot, contacts, law=ContactLaw(friction=STANDS + 1e-6), tolerance=EXACT)
    assert np.abs(found.right_velocity).max() < 1e-12
    falls = solve(snapshot, contacts, law=ContactLaw(friction=STANDS - 1e-6), tolerance=EXACT)
    assert 1e-7 < np.abs(falls.right_velocity).max() < 1e-5


def test_pyramid_needs_less_friction_on_the_floor():
    snapshot, contacts = pyramid()
    at_floor = STANDS / 3
    assert at_floor == pytest.approx(0.0893164, abs=1e-7)
    law = {"friction": 1.0, "wall_friction": at_floor + 1e-6}
    found = solve(snapshot, contacts, law=ContactLaw(**law), tolerance=EXACT)
    assert np.abs(found.right_velocity).max() < 1e-12
    mobilised = abs(found.friction.tangential[-1]) / found.reaction[-1]
    assert mobilised == pytest.approx(at_floor, abs=2e-6)
    law["wall_friction"] = at_floor - 1e-6
    falls = solve(snapshot, contacts, law=ContactLaw(**law), tolerance=EXACT)
    assert np.abs(falls.right_velocity).max() > 1e-7


@pytest.mark.parametrize(
    ("mu", "gap", "top", "base"),
    [
        (0.05, 0.0, -0.092332, 0.159923),
        (0.1, 0.0, -0.061775, 0.106998),
        (0.2, 0.0, -0.024638, 0.042673),
        (0.1, 4e-3, -0.062156, 0.107371),
    ],
)
def test_pyramid_falls_apart(mu, gap, top, base):
    snapshot, contacts = pyramid(gap)
    found = solve(snapshot, contacts, law=ContactLaw(friction=mu), tolerance=EXACT)
    assert found.right_velocity[2, 1] == pytest.approx(top, abs=1e-6)
    np.testing.assert_allclose(found.right_velocity[:2, 0], [-base, base], atol=1e-6)
    dense = Dense(snapshot, contacts, snapshot.velocity)
    solutions, _ = all_answers(dense, np.full(len(contacts), mu))
    mine = velocities(found)
    assert min(np.abs(u - mine).max() for u in solutions) < 1e-9


def test_wedge_with_two_answers_keeps_the_velocity_that_is_admissible():
    left, mu = (-0.672788, -0.591936), 2.0
    snapshot, contacts = on_walls(left, [110.135 + 180, 343.340 + 180], spin=0.065169)
    dense = Dense(snapshot, contacts, snapshot.velocity)
    at_rest = violation(dense, np.zeros(2), np.zeros(2), np.full(2, mu), dense.left)
    collected = np.array([30.962917, 25.118999]), np.array([52.681842, -50.237999])
    stopped = violation(dense, *collected, np.full(2, mu), np.zeros(3))
    assert at_rest == 0.0
    assert stopped < 1e-3  # the percussions are given to six decimals
    found = solve(snapshot, contacts, law=ContactLaw(friction=mu), tolerance=EXACT)
    assert not found.impulse.any()
    assert found.friction.start == "rest"
    np.testing.assert_array_equal(found.right_velocity[0], left)


def test_wedges_have_one_answer_below_the_bound():
    rng = np.random.default_rng(3)
    several = 0
    for _ in range(150):
        first, difference = rng.uniform(0, 360), rng.uniform(20, 175)
        angles = np.array([first, first + difference])
        mu = rng.uniform(0.1, 3.0)
        snapshot, contacts = on_walls(rng.normal(size=2), angles, spin=rng.normal())
        dense = Dense(snapshot, contacts, snapshot.velocity)
        solutions, _ = all_answers(dense, np.full(2, mu))
        different = len(np.unique(np.round(solutions, 6), axis=0))
        # the angle D between the outward normals
        if mu < 1 / np.tan(np.radians(difference) / 2):
            assert different == 1
        several += different > 1
        found = solve(snapshot, contacts, law=ContactLaw(friction=mu), tolerance=1e-10)
        mine = np.append(found.right_velocity[0], found.right_spin[0])
        assert min(np.abs(u - mine).max() for u in solutions) < 1e-7
    assert several > 5


def test_a_contact_of_solid_disks_gives_way_three_times_as_easily_along_it():
    position, velocity = [[0.0, 0.0], [0.5, 0.0]], [[0.0, 1.0], [0.0, 0.0]]
    snapshot = disks_at(position, velocity, [0.2, 0.3], [60.0, 90.0])
    contacts = find_contacts(snapshot, tolerance=1e-9)
    dense = Dense(snapshot, contacts, snapshot.velocity)
    along = (dense.N**2 / dense.mass).sum()
    across = (dense.T**2 / dense.mass).sum()
    assert across / along == pytest.approx(3.0, rel=1e-12)
    law, left = ContactLaw(friction=1.0), [[1.0, 0.1], [0.0, 0.0]]
    pressed = solve(snapshot, contacts, left_velocity=left, law=law, tolerance=EXACT)
    assert pressed.friction.tangential[0] == pytest.approx(0.1 / across, rel=1e-12)
    assert pressed.reaction[0] == pytest.approx(1.0 / along, rel=1e-12)


@pytest.mark.parametrize("e", [0.0, 0.3, 0.8])
@pytest.mark.parametrize("mu", [0.05, 1.0])
def test_rebound_of_one_disk_with_friction(e, mu):
    snapshot, contacts = on_walls((1.0, -2.0), 90.0, radius=0.25)
    found = solve(snapshot, contacts, law=ContactLaw(friction=mu, restitution=e), tolerance=EXACT)
    normal = 75.0 * 2.0 * (1 + e)
    np.testing.assert_allclose(found.impulse[0], [min(mu * normal, 25.0), -normal], rtol=1e-10)
    assert found.right_velocity[0, 1] == pytest.approx(2.0 * e, abs=1e-10)


@pytest.mark.parametrize(
    ("open_by", "mu", "velocity", "spin"),
    [
        (0.2480747646021033, 2.0, (-0.06697733, -0.04344988), -19.390072624721252),
        (0.20137395671577987, 1.0, (0.02161242, -0.00780532), 1.7152433002212768),
        (0.23078122527663775, 0.8, (0.0276899, 0.00107312), 6.13887862914123),
    ],
)
def test_a_disk_that_spins_in_a_mouth_and_rebounds_has_its_answer(open_by, mu, velocity, spin):
    above = np.degrees(np.arcsin(np.sqrt(1 - open_by**2)))
    snapshot, contacts = on_walls(velocity, [above, 180 - above], spin, radius=0.25)
    found = solve(snapshot, contacts, law=ContactLaw(friction=mu, restitution=0.9))
    assert found.status == "solved"


def test_without_friction_it_is_the_same_bit_for_bit():
    snapshot, contacts = pyramid()
    spun = replace(snapshot, spin=[1.0, 2.0, 3.0])
    plain = solve(spun, contacts)
    zero = solve(spun, contacts, law=ContactLaw(friction=0.0, wall_friction=0.0))
    assert plain.friction is None
    assert zero.friction is None
    np.testing.assert_array_equal(plain.reaction, zero.reaction)
    np.testing.assert_array_equal(plain.right_velocity, zero.right_velocity)
    np.testing.assert_array_equal(zero.right_spin, spun.spin)


ROUGH = ContactLaw(friction=0.1)
test_bad_laws_and_requests_are_refused_by_name = refusals(
    (lambda: ContactLaw(friction=-0.1), "^friction:"),
    (lambda: ContactLaw(friction=np.nan), "^friction:"),
    (lambda: ContactLaw(wall_friction=-1.0), "^wall_friction:"),
    (lambda: ContactLaw(friction=0.1, maintained=True), "^friction:"),
    (lambda: solve(*pyramid(), law=ROUGH, starts=0), "^starts:"),
    (lambda: solve(*pyramid(), law=ROUGH, solver="active_set"), "^solver:"),
)


@pytest.mark.parametrize("speed", [1e-90, 1e-200, 1e-308, 5e-324])
def test_speeds_whose_squares_are_no_numbers_have_an_answer(speed):
    position, velocity = [[0.0, 0.2], [0.4, 0.2]], [[speed, -speed], [-speed, 0.0]]
    disks = disks_at(position, velocity, 0.2, spin=[speed, 0.0])
    found = solve(disks, in_contact(disks), law=ContactLaw(friction=0.05), tolerance=1e-10)
    assert found.status == "solved"
    assert np.abs(found.right_velocity).max() <= 2.0 * speed


FLOOR = Walls(start=[[-99.0, 0.0]], end=[[99.0, 0.0]])


def pile(rows=6):
    """A triangular pile of disks on the floor, falling and spinning a little."""
    rng = np.random.default_rng(4)
    position = [(2.0 * i + j, 1.0 + np.sqrt(3.0) * j) for j in range(rows) for i in range(rows - j)]
    n = len(position)
    velocity = np.array([0.0, -1.0]) + 0.05 * rng.normal(size=(n, 2))
    return disks_at(np.array(position) - [rows, 0.0], velocity, 1.0, spin=0.1 * rng.normal(size=n))


def in_contact(snapshot):
    """The contacts of a pile, its floor's included."""
    return find_contacts(snapshot, FLOOR, tolerance=1e-9)


def step_of(snapshot, mu, *, tolerance=1e-9, known=None):
    """A step so short that only those that touch at first are in contact: velocities (n,3), the
    report, and what the next step begins from."""
    motion = Motion(snapshot, FLOOR, step=1e-6, friction=mu, tolerance=tolerance)
    motion._core.history = known or motion._core.history
    report = motion.advance()
    return np.column_stack([motion.velocity, motion.spin]), report, motion._core.history


@pytest.mark.parametrize("mu", [0.05, 0.2])
def test_a_step_finds_what_solve_finds(mu):
    snapshot = pile()
    contacts = in_contact(snapshot)
    found = solve(snapshot, contacts, law=ContactLaw(friction=mu), tolerance=1e-12)
    velocity, step, _ = step_of(snapshot, mu)
    assert step.residual <= 1e-9
    np.testing.assert_allclose(velocity[:, :2], found.right_velocity, atol=1e-6)
    np.testing.assert_allclose(velocity[:, 2], found.right_spin, atol=1e-6)


def test_a_guess_that_is_the_answer_costs_one_block():
    snapshot = pile()
    _, first, known = step_of(snapshot, 0.2, tolerance=1e-6)
    _, again, _ = step_of(snapshot, 0.2, tolerance=1e-6, known=known)
    assert again.iterations <= 10 < first.iterations


def test_a_step_and_solve_may_find_different_answers_both_of_which_obey_the_law():
    snapshot, mu = pile(), 0.6
    contacts = in_contact(snapshot)
    found = solve(snapshot, contacts, law=ContactLaw(friction=mu), tolerance=1e-12)
    velocity, step, _ = step_of(snapshot, mu)
    dense = Dense(snapshot, contacts, snapshot.velocity)
    friction = np.full(len(contacts), mu)
    mine = velocities(found)
    theirs = velocity.ravel()
    assert violation(dense, found.reaction, found.friction.tangential, friction, mine) < 1e-6
    assert violation(dense, step.reaction, step.friction, friction, theirs) < 1e-6
    assert np.abs(mine - theirs).max() > 0.1


@pytest.mark.parametrize("mu", [0.1, 0.2])
def test_a_pile_that_slides_is_solved_where_sweeps_do_not_reach(mu):
    snapshot = pile(14)
    contacts = in_contact(snapshot)
    (velocity, step, _), (again, _, _) = step_of(snapshot, mu), step_of(snapshot, mu)
    assert step.solver in {"proximal", "path"}
    assert step.residual <= 1e-9
    np.testing.assert_array_equal(velocity, again)
    dense = Dense(snapshot, contacts, snapshot.velocity)
    friction = np.full(len(contacts), mu)
    wrong = violation(dense, step.reaction, step.friction, friction, velocity.ravel())
    assert wrong < 1e-6 * dense.mass.max()


def test_an_island_that_nothing_presses_keeps_its_velocities_whatever_the_guess():
    distance = pile(2).position * (1 + 1e-12)  # a gap below 0 by rounding would have to open
    still = disks_at(distance, [0.1, 0.0], 1.0, spin=np.zeros(3))
    _, _, known = step_of(still, 0.3)
    ones = np.ones(len(known.keys))
    velocity, step, _ = step_of(still, 0.3, known=Percussed(known.keys, ones, ones))
    np.testing.assert_array_equal(velocity, [[0.1, 0.0, 0.0]] * 3)
    assert len(known.keys) == len(step.reaction) == 5
    assert not step.reaction.any()
    assert not step.friction.any()


@pytest.mark.parametrize(
    ("gap", "velocity"),
    # the floor takes 0.3 m/s of the fall, and friction 0.3 of that along it
    [(6e-7, [1.0, -0.5, 0.0]), (2e-7, [0.91, -0.2, -0.18])],
)
def test_contacts_too_far_to_close_in_the_step_stay_open(gap, velocity):
    found, _, _ = step_of(disks_at([[0.0, 1.0 + gap]], [1.0, -0.5], 1.0, spin=[0.0]), 0.3)
    np.testing.assert_allclose(found, [velocity], atol=1e-9)


def test_percussions_of_contacts_that_are_gone_are_not_carried_over():
    _, first, known = step_of(pile(), 0.2)
    keep = np.flatnonzero(first.reaction > 0)[::2]
    some = known.keys[keep], known.reaction[keep], known.tangential[keep]
    more = [np.append(*both) for both in zip(some, (2**62 + 2**61, 1e3, 1e3), strict=True)]
    both = (step_of(pile(), 0.2, known=Percussed(*these)) for these in (some, more))
    (one, cost, _), (other, same, _) = both
    np.testing.assert_array_equal(one, other)
    assert cost.iterations == same.iterations > 10
