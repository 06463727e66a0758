"""Contacts against a brute-force search, and what find_contacts refuses."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscd import Snapshot, Walls, find_contacts, solve
from tests.crowds import disks_at


@given(st.integers(0, 10**6))
def test_pairs_are_those_of_a_brute_force_search(seed):
    rng = np.random.default_rng(seed)
    n, tolerance = 40, 0.05
    position, radius = rng.uniform(0, 3, (n, 2)), rng.uniform(0.02, 0.3, n)
    snapshot = Snapshot(
        position=position, velocity=np.zeros((n, 2)), radius=radius, mass=np.ones(n)
    )
    contacts = find_contacts(snapshot, tolerance=tolerance)
    found = set(zip(contacts.first.tolist(), contacts.second.tolist(), strict=True))
    expected = {
        (i, j)
        for i in range(n)
        for j in range(i + 1, n)
        if np.linalg.norm(position[i] - position[j]) - radius[i] - radius[j] <= tolerance
    }
    assert found == expected


@given(st.floats(-2, 4), st.floats(-2, 2))
def test_wall_gap_is_the_distance_to_the_segment(x, y):
    """Sampled distance to the segment from (0,0) to (2,0), ends included."""
    snapshot = Snapshot(position=[[x, y]], velocity=[[0, 0]], radius=[0.1], mass=[1])
    samples = np.column_stack([np.linspace(0, 2, 20001), np.zeros(20001)])
    distance = np.hypot(*(samples - [x, y]).T).min()
    if distance < 1e-3:
        return
    contacts = find_contacts(snapshot, Walls(start=[[0, 0]], end=[[2, 0]]), tolerance=10.0)
    assert contacts.gap[0] == pytest.approx(distance - 0.1, abs=1e-5)
    np.testing.assert_allclose(
        np.array([x, y]) + distance * contacts.normal[0], [np.clip(x, 0, 2), 0], atol=2e-4
    )


def test_what_is_refused():
    two, one = disks_at([[0, 0], [0, 0]], radius=1), disks_at([[0, 0]], radius=1)
    apart = disks_at([[0, 0], [2, 0]], radius=1)
    line = Walls(start=[[5, 5], [-1, 0]], end=[[6, 5], [1, 0]])
    contacts = find_contacts(apart, tolerance=1e-9)
    for call, says in (
        (lambda: find_contacts(two, tolerance=0), "disk 1 and disk 2 coincide"),
        (lambda: find_contacts(one, line, tolerance=0), "disk 1 and wall 2 coincide"),
        (lambda: find_contacts(two, tolerance=np.nan), "tolerance"),
        (lambda: disks_at([[0, 0], [3, 0]], radius=[1, 0]), "radius: 0 in row 1"),
        (lambda: disks_at([[0, 0]], [np.nan, 0]), "velocity: not a finite number in row 0"),
        (lambda: solve(apart, contacts, left_velocity=np.full((2, 2), np.inf)), "left_velocity"),
        (lambda: solve(apart, contacts, tolerance=1e-20), "tolerance"),
        (lambda: solve(apart, contacts, solver="magic"), "unknown 'magic'"),
        (lambda: solve(one, contacts), "disk index 1 where there are 1 disks"),
    ):
        with pytest.raises(ValueError, match=says):
            call()


@given(st.integers(0, 10**6), st.floats(0, 2 * np.pi), st.floats(-1e5, 1e5))
def test_disks_that_touch_touch_at_no_tolerance(seed, angle, shift):
    """Pairs at a distance of r₁ + r₂ but for the rounding of coordinates, anywhere, and a wall."""
    first, second = np.random.default_rng(seed).uniform(0.1, 0.4, 2)
    along = np.array([np.cos(angle), np.sin(angle)])
    start = np.array([shift, -shift / 3])
    pair = Snapshot(
        position=[start, start + (first + second) * along],
        velocity=np.zeros((2, 2)),
        radius=[first, second],
        mass=[1, 1],
    )
    across = np.array([-along[1], along[0]])
    corner = start - first * along
    wall = Walls(start=[corner - across], end=[corner + across])
    contacts = find_contacts(pair, wall, tolerance=0.0)
    assert contacts.is_wall.tolist() == [False, True]
    apart = Snapshot(
        position=[start, start + (first + second + 1e-9) * along],
        velocity=np.zeros((2, 2)),
        radius=[first, second],
        mass=[1, 1],
    )
    assert not len(find_contacts(apart, tolerance=0.0))


def test_coordinates_in_whose_rounding_gaps_are_lost_are_refused():
    pair = Snapshot(position=[[0, 0], [0.5, 0]], velocity=np.zeros((2, 2)), radius=[0.25] * 2, mass=[1, 1])  # fmt: skip
    with pytest.raises(ValueError, match=r"^end: 1e.200 in row 0"):
        Walls(start=[[0, -1]], end=[[0, 1e200]])
    with pytest.raises(ValueError, match=r"^walls: end: coordinates up to 1e.12 m"):
        find_contacts(pair, Walls(start=[[0, -1]], end=[[0, 1e12]]), tolerance=0)
    far = Snapshot(position=[[1e12, 0]], velocity=[[0, 0]], radius=[0.25], mass=[1])
    with pytest.raises(ValueError, match=r"^position: coordinates up to 1e.12 m"):
        find_contacts(far, tolerance=0)
