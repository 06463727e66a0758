"""The reconciliation of overlapping disks against closed forms, optimality conditions, another
optimiser."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize, nnls

from analysis.scene.real.separate import SPARE_M, OverlapError, reconcile
from analysis.scene.real.trajectory import read_heads
from nscd import Snapshot, Walls, find_contacts

EXCERPT = Path(__file__).resolve().parents[2] / "scenes" / "gate_excerpt.txt"
# What rounding to 10 nm and the spare gap may add.
DIGITS = 1e-7


def contacts_of(position, radius, walls=None, tolerance=DIGITS):
    n = len(position)
    disks = Snapshot(position=position, velocity=np.zeros((n, 2)), radius=radius, mass=np.ones(n))
    return find_contacts(disks, walls, tolerance=tolerance)


def test_disks_without_overlap_stay():
    position = np.array([[0.0, 0.0], [0.5, 0.0], [3.0, 1.0]])
    arranged = reconcile(position, np.full(3, 0.2))
    np.testing.assert_allclose(arranged.position, position, atol=1e-8)
    assert arranged.linearisations == 0


@given(st.floats(0.02, 0.39), st.floats(-np.pi, np.pi))
def test_two_disks_move_apart_by_half_the_overlap_each(distance, angle):
    along = np.array([np.cos(angle), np.sin(angle)])
    arranged = reconcile(np.array([[0.0, 0.0], distance * along]), np.full(2, 0.2))
    half = 0.5 * (0.4 - distance) * along
    np.testing.assert_allclose(arranged.position, [-half, distance * along + half], atol=DIGITS)


def test_three_in_a_row_share_the_overlaps():
    # least Σ|q' − q|² with q2' − q1' = q3' − q2' = 0.4: the middle one stays when the overlaps are
    # equal
    arranged = reconcile(np.array([[-0.3, 0.0], [0.0, 0.0], [0.3, 0.0]]), np.full(3, 0.2))
    np.testing.assert_allclose(
        arranged.position, [[-0.4, 0.0], [0.0, 0.0], [0.4, 0.0]], atol=DIGITS
    )


def test_unequal_overlaps_in_a_row_keep_the_centre_of_mass():
    # constraints at x = (c − 0.4, c, c + 0.4); the mean displacement vanishes
    positions = np.array([[0.0, 0.0], [0.2, 0.0], [0.5, 0.0]])
    arranged = reconcile(positions, np.full(3, 0.2))
    centre = positions[:, 0].mean()
    expected = [[centre - 0.4, 0.0], [centre, 0.0], [centre + 0.4, 0.0]]
    np.testing.assert_allclose(arranged.position, expected, atol=DIGITS)


def test_against_a_wall_and_a_neighbour():
    # wall at x = 0: the first goes to 0.2, the second, 0.4 farther, to 0.6
    walls = Walls(start=[[0.0, -1.0]], end=[[0.0, 1.0]])
    arranged = reconcile(np.array([[0.05, 0.0], [0.3, 0.0]]), np.full(2, 0.2), walls)
    np.testing.assert_allclose(arranged.position, [[0.2, 0.0], [0.6, 0.0]], atol=DIGITS)


def test_a_wall_between_two_people_is_not_crossed():
    walls = Walls(start=[[0.0, -1.0]], end=[[0.0, 1.0]])
    arranged = reconcile(np.array([[0.01, 0.0], [-0.01, 0.0]]), np.full(2, 0.2), walls)
    np.testing.assert_allclose(arranged.position, [[0.2, 0.0], [-0.2, 0.0]], atol=DIGITS)


def test_a_centre_is_not_pushed_through_the_door():
    # the second pushes the first, in the door y = 0, outwards; it stops at the line and the second
    # gives way
    walls = Walls(start=[[-2.0, 0.0], [0.25, 0.0]], end=[[-0.25, 0.0], [2.0, 0.0]])
    door, outward = Walls(start=[[-0.25, 0.0]], end=[[0.25, 0.0]]), np.array([0.0, -1.0])
    positions = np.array([[0.0, 0.02], [0.0, 0.32]])
    free = reconcile(positions, np.full(2, 0.2), walls).position
    assert free[0, 1] < 0
    fixed = reconcile(positions, np.full(2, 0.2), walls, door, outward).position
    np.testing.assert_allclose(fixed, [[0.0, 0.0], [0.0, 0.4]], atol=DIGITS)
    assert fixed[0, 1] >= 0


def test_radii_may_differ():
    arranged = reconcile(np.array([[0.0, 0.0], [0.3, 0.0]]), np.array([0.3, 0.1]))
    np.testing.assert_allclose(arranged.position, [[-0.05, 0.0], [0.35, 0.0]], atol=DIGITS)


def gate_heads():
    tracked = read_heads(EXCERPT, 405).position
    return tracked[tracked[:, 1] > 0]


def test_optimality_on_a_real_crowd():
    """No overlap, and each displacement is a non-negative sum of contact normals (KKT)."""
    positions, radius = gate_heads(), 0.18
    arranged = reconcile(positions, np.full(len(positions), radius)).position
    contacts = contacts_of(arranged, np.full(len(positions), radius))
    assert 0 <= contacts.gap.min() <= 2 * SPARE_M
    back = (positions - arranged).ravel()
    _, rest = nnls(contacts.normal_matrix(len(positions)).T.toarray(), back)
    assert rest < 1e-6 * np.linalg.norm(back)


def test_no_farther_than_another_optimiser():
    """SLSQP on the true, curved constraints, from the same heads."""
    positions, radius = gate_heads(), 0.18
    n = len(positions)
    arranged = reconcile(positions, np.full(n, radius)).position
    i, j = np.triu_indices(n, 1)
    near = np.hypot(*(positions[i] - positions[j]).T) < 1.2
    i, j = i[near], j[near]
    rows = np.arange(len(i))

    def spare(flat):
        return ((flat.reshape(n, 2)[i] - flat.reshape(n, 2)[j]) ** 2).sum(1) - (2 * radius) ** 2

    def slope(flat):
        difference = 2 * (flat.reshape(n, 2)[i] - flat.reshape(n, 2)[j])
        matrix = np.zeros((len(i), 2 * n))
        for axis in (0, 1):
            matrix[rows, 2 * i + axis] = difference[:, axis]
            matrix[rows, 2 * j + axis] = -difference[:, axis]
        return matrix

    flat = positions.ravel()
    other = minimize(
        lambda q: 0.5 * ((q - flat) ** 2).sum(),
        flat,
        jac=lambda q: q - flat,
        method="SLSQP",
        constraints={"type": "ineq", "fun": spare, "jac": slope},
        options={"maxiter": 200, "ftol": 1e-12},
    )
    assert other.success
    ours = 0.5 * ((arranged - positions) ** 2).sum()
    assert ours <= other.fun * (1 + 1e-5)


@pytest.mark.parametrize("seed", [117, 1098, 1215])
def test_a_slow_search_ends_too(seed):
    """Six people on less than a square metre, whose steps shrink by a thirtieth each."""
    positions, radius = np.random.default_rng(seed).uniform(0.0, 0.8, (6, 2)), np.full(6, 0.2)
    arranged = reconcile(positions, radius)
    assert arranged.linearisations > 100
    contacts = contacts_of(arranged.position, radius)
    assert 0 <= contacts.gap.min() <= 2 * SPARE_M
    back = (positions - arranged.position).ravel()
    _, rest = nnls(contacts.normal_matrix(6).T.toarray(), back)
    assert rest < 1e-6 * np.linalg.norm(back)


@settings(max_examples=20)
@given(st.integers(0, 10_000))
def test_random_crowds_between_walls_end_without_overlap(seed):
    rng = np.random.default_rng(seed)
    positions, radius = rng.uniform(0.1, 1.9, (8, 2)), rng.uniform(0.12, 0.22, 8)
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    walls = Walls(start=corners, end=np.roll(corners, -1, axis=0))
    arranged = reconcile(positions, radius, walls).position
    assert ((arranged > 0) & (arranged < 2)).all()
    contacts = contacts_of(arranged, radius, walls)
    assert contacts.gap.min(initial=0.0) >= 0


def test_no_room_says_so():
    corners = np.array([[0.0, 0.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]])
    walls = Walls(start=corners, end=np.roll(corners, -1, axis=0))
    with pytest.raises(OverlapError, match=r"no room for 2 disks of radius up to 0\.2 m"):
        reconcile(np.array([[0.2, 0.2], [0.3, 0.31]]), np.full(2, 0.2), walls)
