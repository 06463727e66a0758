"""The families of contact problems are what they say."""

import numpy as np
import pytest

from analysis.scene.packing import REST
from benchmarks.cases import accuracy
from benchmarks.problems.families import DOOR, FAMILIES, chain, heap, jammed, pressed
from nscd import solve

SIZE = 300


@pytest.fixture(scope="module")
def grown():
    return heap(SIZE)


def test_every_family_is_what_was_asked_for():
    for name, make in FAMILIES.items():
        case = make(40)
        assert case.name == name
        assert len(case.snapshot) == (55 if name == "gate" else 40)
        assert case.left_velocity.shape == case.snapshot.position.shape
        again = make(40)
        assert np.array_equal(case.snapshot.position, again.snapshot.position)


def test_heap_touches_without_overlap_and_is_nearly_isostatic(grown):
    # where the arch meets the wall, its last disk may lie in another
    assert np.sort(grown.contacts.gap)[1] > -1e-12
    assert 0 <= 2 * SIZE - len(grown.contacts) < 0.02 * 2 * SIZE
    # each rests on two others, or on one and the wall
    pairs = ~grown.contacts.is_wall
    ends = np.concatenate([grown.contacts.first, grown.contacts.second[pairs]])
    assert (np.bincount(ends, minlength=SIZE) >= 2).all()


def test_left_velocity_is_two_metres_a_second_to_the_door(grown):
    position, velocity = grown.snapshot.position, grown.left_velocity
    assert np.hypot(*velocity.T) == pytest.approx(2.0)
    reached = position + velocity * (-position[:, 0] / velocity[:, 0])[:, None]
    assert np.all(np.abs(reached[:, 1]) < DOOR + 1e-9)


def test_jammed_disks_rest_under_their_overlaps():
    case = jammed(SIZE)
    contacts, push = case.contacts, 75.0 * 2.0 / 0.5
    assert contacts.gap.max() <= 0
    assert -contacts.gap.min() < 0.1 * case.snapshot.radius.min()
    force = 1e6 * np.sqrt(SIZE / 594) * -contacts.gap
    drive = push * case.left_velocity / 2.0
    balance = drive + contacts.momentum_change(force[:, None] * contacts.normal, SIZE)
    assert np.abs(balance).max() < 1.01 * REST * force.mean()


def test_pressed_disks_overlap_and_keep_the_door_that_their_seed_gives():
    for seed, walls in ((1, 2), (2, 1)):
        case = pressed(SIZE, seed)
        # displacements of 10 mm alone would leave half of the contacts apart
        assert (case.contacts.gap < -1e-6).mean() > 0.5
        assert len(case.walls) == walls
        found = solve(case.snapshot, case.contacts, left_velocity=case.left_velocity)
        assert found.status == "solved"


def test_accuracy_of_a_closed_form():
    # λ between i and i+1 is the momentum of all before it, u⁺ = 0
    case = chain(50)
    order = np.argsort(case.contacts.point[:, 0])
    reaction = np.empty(50)
    reaction[order] = 75.0 * 2.0 * np.arange(1, 51)
    assert accuracy(case, reaction).residual < 1e-12
    wrong = reaction.copy()
    wrong[order[10]] += 1.5  # two disks get 0.02 m/s more or less: this contact opens by 0.04
    assert accuracy(case, wrong).residual == pytest.approx(0.02, rel=1e-9)


def test_own_velocity_must_keep_momentum():
    case = chain(50)
    at_rest = np.zeros(100)
    # with λ = 0 standing still has no residual, but it loses all momentum
    assert accuracy(case, np.zeros(50), at_rest).residual == pytest.approx(1.0)
