"""Whatever is given: a finite answer, one that says it is none, or one line that names the
field."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscd import ContactLaw, Contacts, Snapshot, Walls, find_contacts, solve

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
    """Chains and lattices with masses and velocities over up to 190 decades; kernels divide by what
    underflows."""
    rng = np.random.default_rng(seed)
    n, shift = int(rng.integers(2, 9)), 0.25 * (seed % 2)
    rows = [[0.5 * i + shift * j, 0.5 * np.sqrt(0.75) * j] for j in range(3) for i in range(n)]
    snapshot = Snapshot(
        position=rows[:n],
        velocity=rng.normal(size=(n, 2)) * 10.0 ** rng.uniform(-decades, decades),
        radius=np.full(n, 0.25),
        mass=10.0 ** rng.uniform(-decades, decades, n),
    )
    contacts = find_contacts(snapshot, Walls(start=[[-9, -0.25]], end=[[99, -0.25]]), tolerance=0)
    for solver in SOLVERS if law is LAWS[0] else SOLVERS[:3]:
        answer = solve(snapshot, contacts, law=law, solver=solver)
        values = [getattr(answer, name) for name in answer.__slots__]
        numbers = [v for v in values if isinstance(v, float | np.ndarray)]
        assert answer.status == "failed" or all(np.isfinite(v).all() for v in numbers)
        assert answer.reason or answer.status == "solved"


def test_no_answer_with_infinite_numbers_is_solved():
    refused("left_velocity", lambda: solve(TWO, TOUCHING, left_velocity=[[0, 1e308], [0, 0]]))
    for ids in ([1e19, 2], [2.7, 1], [np.nan, 1], [1, 1]):
        refused("ids", lambda ids=ids: Snapshot(**{**PAIR, "ids": ids}))
    for mass in (1e300, 1e-300):
        refused("mass", lambda mass=mass: Snapshot(**{**PAIR, "mass": [mass, 1.0]}))
    answer = solve(TWO, TOUCHING, left_velocity=[[1e99, 0], [0, 0]])
    assert answer.status == "solved"
    np.testing.assert_allclose(answer.impulse, [[1e99 * 75 * 60 / 135, 0]])


@pytest.mark.parametrize("law", LAWS)
def test_the_active_set_takes_dissipation(law):
    """Three disks on a wall, one pressing the others apart, with spins where friction needs
    them."""
    snapshot = Snapshot(
        position=[[0, 0], [0.5, 0], [0.25, 0.25 * np.sqrt(3)]],
        velocity=[[1, 0], [-1, 0], [0, -1]],
        radius=[0.25] * 3,
        mass=[75.0] * 3,
    )
    contacts = find_contacts(snapshot, Walls(start=[[-9, -0.25]], end=[[9, -0.25]]), tolerance=1e-9)
    assert len(contacts) == 5
    other = solve(snapshot, contacts, law=law, solver="interior_point")
    answer = solve(snapshot, contacts, law=law, solver="active_set")
    assert answer.status == other.status == "solved"
    np.testing.assert_allclose(answer.right_velocity, other.right_velocity, atol=1e-8)
