"""Contacts against a brute-force search, and what find_contacts refuses. Whatever is given: a
finite answer, one that says it is none, or one line that names the field."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscd import ContactLaw, Contacts, Snapshot, Walls, find_contacts, solve
from tests.crowds import disks_at
from tests.refusals import refusals


@given(st.integers(0, 10**6))
def test_pairs_are_those_of_a_brute_force_search(seed):
    rng = np.random.default_rng(seed)
    n, tolerance = 40, 0.05
    position, radius = rng.uniform(0, 3, (n, 2)), rng.uniform(0.02, 0.3, n)
    snapshot = disks_at(position, radius=radius)
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
    snapshot = disks_at([[x, y]], radius=0.1)
    samples = np.column_stack([np.linspace(0, 2, 20001), np.zeros(20001)])
    distance = np.hypot(*(samples - [x, y]).T).min()
    if distance < 1e-3:
        return
    contacts = find_contacts(snapshot, Walls(start=[[0, 0]], end=[[2, 0]]), tolerance=10.0)
    assert contacts.gap[0] == pytest.approx(distance - 0.1, abs=1e-5)
    nearest = np.array([x, y]) + distance * contacts.normal[0]
    np.testing.assert_allclose(nearest, [np.clip(x, 0, 2), 0], atol=2e-4)


SAME, ONE = disks_at([[0, 0], [0, 0]], radius=1), disks_at([[0, 0]], radius=1)
APART = disks_at([[0, 0], [2, 0]], radius=1)
NEAR = find_contacts(APART, tolerance=1e-9)
LINE = Walls(start=[[5, 5], [-1, 0]], end=[[6, 5], [1, 0]])
FAR = Walls(start=[[0, -1]], end=[[0, 1e12]])
test_what_is_refused = refusals(
    (lambda: find_contacts(SAME, tolerance=0), "disk 1 and disk 2 coincide"),
    (lambda: find_contacts(ONE, LINE, tolerance=0), "disk 1 and wall 2 coincide"),
    (lambda: find_contacts(SAME, tolerance=np.nan), "tolerance"),
    (lambda: disks_at([[0, 0], [3, 0]], radius=[1, 0]), "radius: 0 in row 1"),
    (lambda: disks_at([[0, 0]], [np.nan, 0]), "velocity: not a finite number in row 0"),
    (lambda: solve(APART, NEAR, left_velocity=np.full((2, 2), np.inf)), "left_velocity"),
    (lambda: solve(APART, NEAR, tolerance=1e-20), "tolerance"),
    (lambda: solve(APART, NEAR, solver="magic"), "unknown 'magic'"),
    (lambda: solve(ONE, NEAR), "disk index 1 where there are 1 disks"),
    # coordinates in whose rounding gaps are lost
    (lambda: Walls(start=[[0, -1]], end=[[0, 1e200]]), r"^end: 1e.200 in row 0"),
    (lambda: find_contacts(ONE, FAR, tolerance=0), r"^walls: end: coordinates up to 1e.12 m"),
    (lambda: find_contacts(disks_at([[1e12, 0]]), tolerance=0), r"^position: .* up to 1e.12 m"),
)


@given(st.integers(0, 10**6), st.floats(0, 2 * np.pi), st.floats(-1e5, 1e5))
def test_disks_that_touch_touch_at_no_tolerance(seed, angle, shift):
    """Pairs at a distance of r₁ + r₂ but for the rounding of coordinates, anywhere, and a wall."""
    first, second = np.random.default_rng(seed).uniform(0.1, 0.4, 2)
    along = np.array([np.cos(angle), np.sin(angle)])
    start = np.array([shift, -shift / 3])
    pair = disks_at([start, start + (first + second) * along], radius=[first, second])
    across = np.array([-along[1], along[0]])
    corner = start - first * along
    wall = Walls(start=[corner - across], end=[corner + across])
    contacts = find_contacts(pair, wall, tolerance=0.0)
    assert contacts.is_wall.tolist() == [False, True]
    difference = disks_at([start, start + (first + second + 1e-9) * along], radius=[first, second])
    assert not len(find_contacts(difference, tolerance=0.0))


NONSENSE = [
    None, "a", b"x", "12", {}, [], [None, 1], ["1", "2"], 1j, [1j, 2], object(), [[1, 2], [3]],
    float("nan"), float("inf"), 1e300, [1e300, 1], 10**400, [10**30, 1],
    np.zeros((3, 3)), np.array(["1", "2"]), np.datetime64("2020-01-01"), lambda: 0,
]  # fmt: skip
PAIR = {"position": [[0, 0], [0.5, 0]], "velocity": [[2, 0], [0, 0]], "radius": [0.25] * 2, "mass": [75, 60]}  # fmt: skip
TWO = Snapshot(**PAIR)
TOUCHING = find_contacts(TWO, tolerance=0)
LAWS = [
    ContactLaw(), ContactLaw(restitution=0.5), ContactLaw(dissipation=1.0), ContactLaw(maintained=True),
    ContactLaw(dissipation=1.0, tangential_dissipation=0.0),
]  # fmt: skip
ABSURD = [ContactLaw(dissipation=1e90), ContactLaw(restitution=1 - 1e-16)]
SOLVERS = ["auto", "interior_point", "active_set", "gauss_seidel", "projected_gradient"]


def refused(field, attempt):
    """A value that is no value for the field is refused in one line that begins with its name."""
    with pytest.raises(ValueError, match=rf"^(\w+, )?{field}\b.") as why:
        attempt()
    assert len(str(why.value)) < 160
    assert "\n" not in str(why.value)


@pytest.mark.parametrize("value", NONSENSE, ids=lambda v: repr(v)[:20])
def test_nonsense_is_refused_by_the_name_of_the_field(value):
    for field in ("position", "velocity", "radius", "mass", "ids", "spin"):
        refused(field, lambda f=field: Snapshot(**{**PAIR, f: value}))
    for field in ("time", "drive") if value is not None else ():
        refused(field, lambda f=field: Snapshot(**{**PAIR, f: value}))
    ends = {"start": [[1, 1], [2, 1]], "end": [[1, 2], [2, 2]]}
    for field in ends:
        refused(field, lambda f=field: Walls(**{**ends, f: value}))
    law = ["dissipation", "friction", "maintained"]
    for field in [*law, "restitution", "tangential_dissipation"] if value is not None else law:
        refused(field, lambda f=field: ContactLaw(**{f: value}))
    given_ones = {f: getattr(TOUCHING, f) for f in ("first", "second", "is_wall", "normal", "gap", "point")}  # fmt: skip
    for field in given_ones:
        refused(field, lambda f=field: Contacts(**{**given_ones, f: value}))
    refused("tolerance", lambda: find_contacts(TWO, tolerance=value))
    refused("snapshot", lambda: find_contacts(value, tolerance=0))
    refused("snapshot", lambda: solve(value, TOUCHING))
    refused("contacts", lambda: solve(TWO, value))
    for field in ("tolerance", "solver", "canonical"):
        refused(field, lambda f=field: solve(TWO, TOUCHING, **{f: value}))
    for field in ("left_velocity", "law", "guess") if value is not None else ():
        refused(field, lambda f=field: solve(TWO, TOUCHING, **{f: value}))
    if value is not None:
        refused("walls", lambda: find_contacts(TWO, value, tolerance=0))


@given(st.integers(0, 10**6), st.sampled_from([1, 10, 50, 95]), st.sampled_from(LAWS + ABSURD))
def test_answers_are_finite_or_said_to_be_failed(seed, decades, law):
    """Chains and lattices with masses and velocities over 190 decades, which underflow."""
    rng = np.random.default_rng(seed)
    n, shift = int(rng.integers(2, 9)), 0.25 * (seed % 2)
    rows = [[0.5 * i + shift * j, 0.5 * np.sqrt(0.75) * j] for j in range(3) for i in range(n)]
    velocity = rng.normal(size=(n, 2)) * 10.0 ** rng.uniform(-decades, decades)
    snapshot = disks_at(rows[:n], velocity, mass=10.0 ** rng.uniform(-decades, decades, n))
    contacts = find_contacts(snapshot, Walls(start=[[-9, -0.25]], end=[[99, -0.25]]), tolerance=0)
    for solver in SOLVERS if law is LAWS[0] else SOLVERS[:3]:
        solution = solve(snapshot, contacts, law=law, solver=solver)
        values = [getattr(solution, name) for name in solution.__slots__]
        numbers = [v for v in values if isinstance(v, float | np.ndarray)]
        assert solution.status == "failed" or all(np.isfinite(v).all() for v in numbers)
        assert solution.reason or solution.status == "solved"


def test_ids_and_masses_out_of_reach_are_refused():
    for ids in ([1e19, 2], [2.7, 1], [np.nan, 1], [1, 1]):
        refused("ids", lambda ids=ids: Snapshot(**{**PAIR, "ids": ids}))
    for mass in (1e300, 1e-300):
        refused("mass", lambda mass=mass: Snapshot(**{**PAIR, "mass": [mass, 1.0]}))


def test_no_answer_with_infinite_numbers_is_solved():
    refused("left_velocity", lambda: solve(TWO, TOUCHING, left_velocity=[[0, 1e308], [0, 0]]))
    solution = solve(TWO, TOUCHING, left_velocity=[[1e99, 0], [0, 0]])
    assert solution.status == "solved"
    np.testing.assert_allclose(solution.impulse, [[1e99 * 75 * 60 / 135, 0]])


@pytest.mark.parametrize("law", LAWS)
def test_the_active_set_takes_dissipation(law):
    """Three disks on a wall, one pressing the others apart, with spins that friction needs."""
    position = [[0, 0], [0.5, 0], [0.25, 0.25 * np.sqrt(3)]]
    snapshot = disks_at(position, [[1, 0], [-1, 0], [0, -1]])
    contacts = find_contacts(snapshot, Walls(start=[[-9, -0.25]], end=[[9, -0.25]]), tolerance=1e-9)
    assert len(contacts) == 5
    other = solve(snapshot, contacts, law=law, solver="interior_point")
    solution = solve(snapshot, contacts, law=law, solver="active_set")
    assert solution.status == other.status == "solved"
    np.testing.assert_allclose(solution.right_velocity, other.right_velocity, atol=1e-8)
