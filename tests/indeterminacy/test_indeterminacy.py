"""Redundant contacts whose admissible percussions are known by hand: wedges, a flower, a corner;
and bad input. Laws of redundant contacts, on random lattices and against dense linear algebra,
vertices and least distance."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import null_space
from scipy.optimize import linprog, nnls
from scipy.sparse import csr_array, diags_array

from nscd import ContactLaw, Walls, find_contacts, solve
from nscd.indeterminacy.determinacy import admissible_determinacy, determinacy
from nscd.indeterminacy.equilibrium import Equilibrium
from nscd.indeterminacy.intervals import (
    Intervals,
    IntervalStatus,
    interval,
    weights_of_contacts,
    weights_of_disk,
    weights_of_wall,
)
from nscd.indeterminacy.nearest import least_energy
from nscd.indeterminacy.orthogonal import factorise
from tests.crowds import disks_at

MASS, SPEED, RADIUS = 75.0, 2.0, 0.25
LOAD, UNEQUAL = MASS * SPEED, np.array([75.0, 60, 90, 50, 100])
ANGLE = np.pi / 3 * np.arange(6)
RIM = 2 * RADIUS * np.column_stack([np.cos(ANGLE), np.sin(ANGLE)])
FLOWER = np.concatenate([[[0, 0]], RIM])


def crowd(position, velocity, walls=None, mass=MASS):
    """Contacts and percussions of touching disks."""
    snapshot = disks_at(position, velocity, RADIUS, mass)
    contacts = find_contacts(snapshot, walls, tolerance=1e-9)
    solution = solve(snapshot, contacts, tolerance=1e-10)
    assert solution.status == "solved"
    return contacts, solution


def vertices(matrix, impulse):
    """All vertices of {x ≥ 0, matrix x = impulse}: every basis, by least squares."""
    rank = np.linalg.matrix_rank(matrix)
    size, found = np.abs(impulse).max(), []
    for columns in map(list, itertools.combinations(range(matrix.shape[1]), rank)):
        part = matrix[:, columns]
        if np.linalg.svd(part, compute_uv=False)[-1] < 1e-9:
            continue
        x = np.linalg.lstsq(part, impulse, rcond=None)[0]
        if x.min() > -1e-9 * size and np.abs(part @ x - impulse).max() < 1e-9 * size:
            vertex = np.zeros(matrix.shape[1])
            vertex[columns] = x
            found.append(vertex)
    return np.array(found)


def assert_ends(found, values):
    """An interval ends at the least and the largest of values."""
    ends = values.min(), values.max()
    assert (found.lower, found.upper) == pytest.approx(ends, abs=1e-9 * LOAD)


@pytest.mark.parametrize("speed", [0.0, SPEED])
def test_three_disks_wedged_between_two_walls(speed):
    """Nobody can say how hard they are squeezed: λ = s + Σ m u of those behind, for any squeeze s ≥
    0."""
    walls = Walls(start=[[0, -1], [1.5, -1]], end=[[0, 1], [1.5, 1]])
    contacts, solution = crowd([[0.25, 0], [0.75, 0], [1.25, 0]], [speed, 0.0], walls)
    # first, second: disks ahead of the left wall
    behind = {(0, 0): 0, (0, 1): 1, (1, 2): 2, (2, 1): 3}
    pairs = zip(contacts.first, contacts.second, strict=True)
    minimum = [behind[pair] * MASS * speed for pair in pairs]
    known = determinacy(contacts, 3)
    assert (known.rank, known.redundant, known.determined.sum()) == (3, 1, 0)
    for contact in range(4):
        found = interval(contacts, solution, weights_of_contacts(contacts, contact))
        assert found.status is IntervalStatus.UNBOUNDED
        assert found.upper == np.inf
        assert found.lower == pytest.approx(minimum[contact], abs=1e-9)
    # what they push on the right wall more than on the left one is determined all the same
    thrust = interval(contacts, solution, weights_of_wall(contacts, 1) - weights_of_wall(contacts, 0))
    assert (thrust.lower, thrust.upper) == pytest.approx((3 * MASS * speed,) * 2, abs=1e-9)
    np.testing.assert_allclose(least_energy(contacts, solution), minimum, atol=1e-9)


def row_and_pair():
    """Three disks across a channel that they just fill, and two behind that press them to its
    end."""
    high = np.sqrt(3) * RADIUS
    position = [[-RADIUS, 2 * RADIUS * (i - 1)] for i in range(3)]
    position += [[-RADIUS - high, RADIUS * (2 * i - 1)] for i in range(2)]
    left, right = [0, -3 * RADIUS], [0, 3 * RADIUS]
    walls = Walls(start=[left, right, [-5, left[1]]], end=[right, [-5, right[1]], left])
    return crowd(position, [SPEED, 0.3 * SPEED], walls, mass=UNEQUAL)


def test_beside_a_wedge_intervals_are_finite_and_those_of_all_vertices():
    contacts, solution = row_and_pair()
    matrix = contacts.normal_matrix(5).toarray().T
    corners = vertices(matrix, matrix @ solution.reaction)
    intervals = Intervals(Equilibrium.of(contacts, solution))
    assert Equilibrium.of(contacts, solution).closed.all()
    across = (contacts.first < 3) & (np.abs(contacts.normal[:, 1]) > 0.9)
    assert across.sum() == 4
    for contact in range(len(contacts)):
        found = intervals.of(weights_of_contacts(contacts, contact))
        if across[contact]:
            assert (found.status, found.upper) == (IntervalStatus.UNBOUNDED, np.inf)
            assert found.lower == pytest.approx(corners[:, contact].min(), abs=1e-9 * LOAD)
        else:
            assert found.status is IntervalStatus.PROVEN
            assert_ends(found, corners[:, contact])
    # the squeeze is the same all the way
    ends = np.flatnonzero(across & contacts.is_wall)
    sides = np.zeros(len(contacts))
    sides[ends] = 1.0, -1.0
    assert_ends(intervals.of(sides), corners @ sides)


@pytest.mark.parametrize("rim_stiffness", [1.0, 3.0])
def test_a_flower_of_seven_disks(rim_stiffness):
    """Six disks pressed to a seventh: each needs spoke + rim = m U; the flower has one self-stress,
    spokes − rim."""
    contacts, solution = crowd(FLOWER, -SPEED * FLOWER / (2 * RADIUS))
    spoke = contacts.first == 0
    known = determinacy(contacts, 7)
    assert (known.rank, known.redundant, known.determined.any()) == (11, 1, False)
    assert admissible_determinacy(contacts, solution).redundant == 1
    intervals = Intervals(Equilibrium.of(contacts, solution))
    for contact in range(12):
        found = intervals.of(weights_of_contacts(contacts, contact))
        assert found.status is IntervalStatus.PROVEN
        assert (found.lower, found.upper) == pytest.approx((0, LOAD), abs=1e-9)
    centre = intervals.of(weights_of_disk(contacts, 0))
    assert (centre.lower, centre.upper) == pytest.approx((0, 6 * LOAD), abs=1e-8)
    petal = intervals.of(weights_of_disk(contacts, 3))  # one spoke and two of the rim
    assert (petal.lower, petal.upper) == pytest.approx((LOAD, 2 * LOAD), abs=1e-8)
    # least s²/1 + t²/κ with s + t = m U
    fraction = np.where(spoke, 1.0, rim_stiffness)
    chosen = least_energy(contacts, solution, fraction)
    np.testing.assert_allclose(chosen, LOAD * fraction / (1 + rim_stiffness), rtol=1e-12)


def corner():
    """Five disks in a corner, three on the right wall and two behind, pressed into it: eleven
    contacts, ten velocities."""
    high = np.sqrt(3) * RADIUS
    position = [[-RADIUS, RADIUS + 2 * RADIUS * i] for i in range(3)]
    position += [[-RADIUS - high, 2 * RADIUS * (i + 1)] for i in range(2)]
    walls = Walls(start=[[0, 0], [0, 0]], end=[[0, 5], [-5, 0]])
    return crowd(position, [SPEED, -0.5 * SPEED], walls, mass=UNEQUAL)


def test_intervals_in_a_corner_are_those_of_all_vertices():
    contacts, solution = corner()
    assert determinacy(contacts, 5).redundant >= 1
    admissible = Equilibrium.of(contacts, solution)
    closed = np.flatnonzero(admissible.closed)
    matrix = contacts.select(closed).normal_matrix(5).toarray().T
    corners = vertices(matrix, matrix @ admissible.reaction[closed])
    assert len(corners) >= 2
    intervals = Intervals(admissible)
    rng = np.random.default_rng(0)
    rows = [*np.eye(len(contacts)), *rng.normal(size=(10, len(contacts)))]
    for weights in rows:
        found = intervals.of(weights)
        assert found.status is IntervalStatus.PROVEN
        assert_ends(found, corners @ weights[closed])
        for reaction in (solution.reaction, least_energy(contacts, solution)):
            assert found.lower - 1e-6 <= weights @ reaction <= found.upper + 1e-6


def test_what_a_flat_wall_carries_is_determined_though_no_contact_is():
    """A row of redundant disks pressed straight into a wall: its load is the momentum that they
    lose."""
    contacts, solution = corner()
    right = interval(contacts, solution, weights_of_wall(contacts, 0))
    assert right.width == pytest.approx(0, abs=1e-8)
    assert right.upper == pytest.approx(SPEED * (75 + 60 + 90 + 50 + 100), rel=1e-12)


def test_a_contact_that_opens_carries_nothing():
    contacts, solution = crowd([[0, 0], [0.5, 0], [1.0, 0]], [[2, 0], [0, 0], [5, 0]])
    found = interval(contacts, solution, weights_of_contacts(contacts, 1))
    assert (found.lower, found.upper, found.status) == (0, 0, IntervalStatus.PROVEN)
    assert admissible_determinacy(contacts, solution).determined.all()


def test_positivity_determines_more_than_balance():
    """The flower hit from one side only: the self-stress would pull where nothing pushes."""
    contacts, solution = crowd(FLOWER, [[0, 0], [-SPEED, 0], *[[0, 0]] * 5])
    assert not determinacy(contacts, 7).determined.any()
    sharper = admissible_determinacy(contacts, solution)
    assert sharper.determined.all()
    assert sharper.redundant == 0


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda c, a: interval(c, a, [1.0]), r"weights: shape \(1,\) where \(11\) is needed"),
        (lambda c, a: interval(c, a, np.full(11, np.nan)), "weights: not a finite number in row 0"),
        (lambda c, a: weights_of_contacts(c, 11), "contact 11 where there are 11"),
        (lambda c, a: interval(c.select([0, 1]), a, [1, 1]), "11 reactions where there are 2 contacts"),
        (lambda c, a: least_energy(c, a, np.zeros(11)), "stiffness: 0 N/m at contact 0"),
        (lambda c, a: determinacy(c, 2), "disk index 4 where there are 2 disks"),
        (lambda c, a: interval(c, replace(a, status="failed", reason="no"), np.ones(11)), r"failed \(no\)"),
        (lambda c, a: interval(c, replace(a, reaction=a.reaction - 1e3), np.ones(11)), "pulls"),
    ],
)  # fmt: skip
def test_bad_input_has_a_clear_message(wrong, message):
    contacts, solution = corner()
    with pytest.raises(ValueError, match=message):
        wrong(contacts, solution)


def test_dissipation_leaves_the_same_contacts_open():
    """u⁺ is unique with dissipation too, so Cᵀλ is."""
    snapshot = disks_at(FLOWER, -SPEED * FLOWER, RADIUS, MASS)
    contacts = find_contacts(snapshot, tolerance=1e-9)
    solution = solve(snapshot, contacts, law=ContactLaw(dissipation=10.0), tolerance=1e-10)
    assert admissible_determinacy(contacts, solution).redundant == 1
    chosen = least_energy(contacts, solution)
    change = contacts.normal_matrix(7).T @ (chosen - solution.reaction)
    assert np.abs(change).max() < 1e-9 * chosen.max()
    assert np.linalg.norm(chosen) <= np.linalg.norm(solution.reaction) * (1 + 1e-12)


WALLS = Walls(start=[[-3, -0.6], [3.1, -3]], end=[[6, -0.6], [3.1, 9]])
SEEDS = st.integers(0, 10**6)


def packing(seed, n=25, side=6, walls=WALLS):
    """A touching triangular lattice with vacancies, pressed into a corner, more or less; its
    percussions."""
    rng = np.random.default_rng(seed)
    j, i = (k.ravel() for k in np.indices((side, side)))
    sites = np.column_stack([0.5 * i + 0.25 * (j % 2), -0.35 + 0.5 * np.sqrt(0.75) * j])
    velocity = rng.normal(size=(n, 2)) * rng.choice([0.1, 1.0]) + [1.5, -1.0]
    position = sites[rng.permutation(len(sites))[:n]]
    return crowd(position, velocity, walls, 10.0 ** rng.uniform(-1, 1, n))


@pytest.mark.long
@given(SEEDS, st.integers(5, 150))
def test_rank_and_determined_contacts_are_those_of_dense_algebra(seed, n):
    contacts, solution = packing(seed, n, side=13)
    known = determinacy(contacts, n)
    basis = null_space(contacts.normal_matrix(n).toarray().T)
    assert (known.rank, known.redundant) == (len(contacts) - basis.shape[1], basis.shape[1])
    np.testing.assert_array_equal(known.determined, (np.abs(basis) < 1e-9).all(1))
    sharper = admissible_determinacy(contacts, solution)
    assert sharper.redundant <= known.redundant
    assert sharper.determined[known.determined].all()


@given(SEEDS, st.integers(5, 100))
def test_the_orthogonal_factor_projects_and_solves(seed, n):
    rng = np.random.default_rng(seed)
    contacts, _ = packing(seed, n, side=11)
    weight = 10.0 ** rng.uniform(-1, 1, len(contacts))
    weighted = csr_array(diags_array(weight) @ contacts.normal_matrix(n))
    factor, matrix = factorise(contacts, n, weighted), weighted.toarray()
    if not len(contacts):
        return
    free = rng.normal(size=len(contacts))
    projected = factor.self_stress(free)
    basis = null_space(matrix.T)
    np.testing.assert_allclose(projected, basis @ (basis.T @ free), atol=1e-11)
    np.testing.assert_allclose(matrix @ factor.least_squares(free), free - projected, atol=1e-10)


@given(SEEDS)
def test_intervals_contain_every_admissible_percussion_and_are_attained(seed):
    """Contained: the solver's, the one of least energy, and a mixture. Attained: the ends are those
    of the other linear program, of self-stresses N α with λ + N α ≥ 0 in a dense basis N."""
    contacts, solution = packing(seed)
    rng = np.random.default_rng(seed)
    admissible = Equilibrium.of(contacts, solution)
    intervals = Intervals(admissible)
    chosen = least_energy(contacts, solution)
    carrying = np.zeros(len(contacts), dtype=bool)
    carrying[admissible.contact[admissible.carrying()]] = True
    assert not chosen[~carrying].any()
    determined = admissible_determinacy(contacts, solution).determined
    size = admissible.scale
    closed = np.flatnonzero(admissible.closed)
    basis = null_space(contacts.select(closed).normal_matrix(25).toarray().T)
    start = admissible.reaction[closed] / size
    for contact in rng.permutation(len(contacts))[:4].tolist():
        weights = np.eye(len(contacts))[contact]
        found = intervals.of(weights)
        assert found.status is not IntervalStatus.UNPROVEN
        assert found.gap <= 1e-8 * size
        assert found.lower <= found.upper + 1e-12 * size
        for reaction in (solution.reaction, chosen, 0.3 * chosen + 0.7 * solution.reaction):
            assert found.lower - 1e-6 * size <= reaction[contact] <= found.upper + 1e-6 * size
        for end, sign in ((found.lower, 1.0), (found.upper, -1.0)) if basis.shape[1] else ():
            aim = sign * (weights[closed] @ basis)
            other = linprog(aim, A_ub=-basis, b_ub=start, bounds=(None, None))
            if other.status == 0:
                wanted = size * (sign * other.fun + weights[closed] @ start)
                assert end == pytest.approx(wanted, abs=1e-6 * size)
            else:
                assert other.status == 3
                assert end == np.inf
        assert (found.width < 1e-7 * size) == determined[contact]
        assert carrying[contact] == (found.upper > 1e-7 * size)


@given(SEEDS)
def test_certificates_hold_for_other_loads_too(seed):
    """Any λ' ≥ 0 on the closed contacts: lower + lower_velocity·Δ ≤ Σ w λ' ≤ upper +
    upper_velocity·Δ."""
    contacts, solution = packing(seed, n=15, side=4)
    rng = np.random.default_rng(seed)
    admissible = Equilibrium.of(contacts, solution)
    weights = rng.normal(size=len(contacts))
    found = Intervals(admissible).of(weights)
    matrix = contacts.normal_matrix(15)
    for size in (1e-3, 1.0):
        other = np.where(admissible.closed, rng.exponential(size, len(contacts)), 0.0)
        change = (matrix.T @ (other - admissible.reaction)).reshape(-1, 2)
        value, slack = weights @ other, 1e-8 * (admissible.scale + size)
        if np.isfinite(found.upper):
            assert value <= found.upper + (found.upper_velocity * change).sum() + slack
        if np.isfinite(found.lower):
            assert value >= found.lower + (found.lower_velocity * change).sum() - slack


@given(SEEDS, st.booleans())
def test_least_energy_is_the_least_distance_of_lawson_and_hanson(seed, soft):
    contacts, solution = packing(seed, n=20, side=5)
    rng = np.random.default_rng(seed)
    stiffness = 10.0 ** rng.uniform(-1, 1, len(contacts)) if soft else None
    chosen = least_energy(contacts, solution, stiffness)
    admissible = Equilibrium.of(contacts, solution)
    closed = admissible.closed
    root = np.ones(closed.sum()) if stiffness is None else np.sqrt(stiffness[closed])
    matrix = contacts.select(closed).normal_matrix(20).toarray().T * root
    given_to = matrix @ (admissible.reaction[closed] / root)
    start = np.linalg.lstsq(matrix, given_to, rcond=None)[0]
    basis = null_space(matrix)
    # min ‖α‖ subject to N α ≥ −start, by the non-negative least squares of its dual
    size = np.abs(start).max(initial=0.0)
    if not size:
        assert not chosen.any()
        return
    system = np.vstack([basis.T, -start[None, :] / size])
    target = np.append(np.zeros(basis.shape[1]), 1.0)
    dual, _ = nnls(system, target)
    rest = system @ dual - target
    minimum = start - size * basis @ (rest[:-1] / rest[-1])
    np.testing.assert_allclose(chosen[closed], minimum * root, atol=1e-9 * (minimum * root).max())
    assert chosen[~closed].max(initial=0) == 0
