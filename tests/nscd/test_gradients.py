"""Gradients against closed forms and central differences of solved impacts; refused without margin."""

import dataclasses

import numpy as np
import pytest

from nscd import ContactLaw, Snapshot, Walls, find_contacts, solve
from nscd.gradients import NoGradientError, gradient
from tests.crowds import disks_at

# A slanted floor, and a post that is touched at its upper end.
START, END = [[-0.4, -0.3], [1.85, -1.5]], [[1.5, -0.35], [1.85, -0.35]]


def crowd(seed):
    """16 people, loosely in rows, who press to the lower right."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(4), np.arange(4))
    anchor = 0.6 * np.column_stack([x.ravel(), y.ravel()]) + rng.normal(0, 0.04, (16, 2))
    left = rng.normal([0.6, -1.0], 0.4, (16, 2))
    return Snapshot(
        position=anchor, velocity=left, radius=rng.uniform(0.26, 0.3, 16),
        mass=rng.uniform(60, 90, 16), spin=rng.normal(0, 1, 16),
    )  # fmt: skip


def solved(disks, walls, law):
    contacts = find_contacts(disks, walls, tolerance=0.15)
    return solve(disks, contacts, law=law, tolerance=1e-12)


def number(solution, weights):
    u, w, p = weights
    return (u * solution.right_velocity).sum() + w @ solution.right_spin + (p * solution.impulse).sum()


def differences(disks, walls, law, weights, step=1e-5):
    """Central differences by every entry of what a gradient has."""
    names = "position", "radius", "velocity", "spin"
    arguments = {name: np.array(getattr(disks, name)) for name in names}
    arguments |= {"start": np.array(walls.start), "end": np.array(walls.end)}

    def at(changed):
        parts = {name: changed[name] for name in names}
        room = Walls(start=changed["start"], end=changed["end"])
        return number(solved(dataclasses.replace(disks, **parts), room, law), weights)

    found = {}
    for name, values in arguments.items():
        slope = np.zeros(values.size)
        for entry in range(values.size):
            ends = []
            for way in (step, -step):
                moved = values.copy().ravel()
                moved[entry] += way
                ends.append(at(arguments | {name: moved.reshape(values.shape)}))
            slope[entry] = (ends[0] - ends[1]) / (2 * step)
        found[name] = slope.reshape(values.shape)
    return found


@pytest.mark.parametrize(("friction", "seed"), [(0.0, 1), (0.0, 2), (0.1, 3), (0.3, 5)])
def test_gradients_are_those_of_central_differences(friction, seed):
    """To 1e-6 of the largest, of a number that has all velocities and impulses."""
    disks, walls, law = crowd(seed), Walls(start=START, end=END), ContactLaw(friction=friction)
    solution = solved(disks, walls, law)
    rng, n, k = np.random.default_rng(9), 16, len(solution.contacts)
    weights = rng.normal(size=(n, 2)), rng.normal(size=n), 0.1 * rng.normal(size=(k, 2))
    found = gradient(solution, walls, velocity=weights[0], spin=weights[1], impulse=weights[2])
    wanted = differences(disks, walls, law, weights)
    before = {"velocity": "left_", "spin": "left_", "start": "wall_", "end": "wall_"}
    for name, slope in wanted.items():
        mine = getattr(found, before.get(name, "") + name)
        assert mine == pytest.approx(slope, abs=1e-6 * np.abs(slope).max() + 1e-9), name
        assert name == "radius" or np.abs(slope).max() > 0.1
    assert (np.abs(wanted["radius"]).max() > 0.1) == (friction > 0)
    assert (np.abs(wanted["end"]).max(1) > 0.1).all()
    assert not wanted["start"][1].any()


@pytest.fixture
def pair():
    """Two equal disks in a row that press a wall."""
    disks = disks_at([[-0.75, 0.0], [-0.25, 0.0]], [[2.0, 0.0], [1.0, 0.0]], mass=75.0)
    return disks, Walls(start=[[0.0, -1.0]], end=[[0.0, 1.0]])


def test_a_row_against_a_wall_has_the_gradients_of_its_sums(pair):
    """p of the wall is Σ m u⁻; of the first contact m u⁻ of the first; u⁺ along the wall is free."""
    disks, walls = pair
    solution = solve(disks, find_contacts(disks, walls, tolerance=1e-9))
    for contact, behind in ((1, [75.0, 75.0]), (0, [75.0, 0.0])):
        weight = np.zeros((2, 2))
        weight[contact, 0] = 1.0
        found = gradient(solution, walls, impulse=weight)
        assert found.left_velocity == pytest.approx(np.column_stack([behind, [0, 0]]), abs=1e-9)
        assert found.position == pytest.approx(np.zeros((2, 2)), abs=1e-9)
    upwards = gradient(solution, walls, velocity=[[0.0, 1.0], [0.0, 0.0]])
    # the push of the pair turns with its line: m u⁻ = 150 N·s over 0.5 m, of 75 kg
    assert upwards.position[:, 1] == pytest.approx([4.0, -4.0])


def test_a_sliding_disk_has_the_friction_of_its_push():
    """u⁺_x = u_x − μ|u_y| on a floor, while it slides."""
    disk = disks_at([[0.0, 0.25]], [[3.0, -1.0]], mass=75.0)
    floor = Walls(start=[[-1.0, 0.0]], end=[[1.0, 0.0]])
    solution = solve(disk, find_contacts(disk, floor, tolerance=1e-9), law=ContactLaw(friction=0.2))
    found = gradient(solution, floor, velocity=[[1.0, 0.0]])
    assert solution.right_velocity[0, 0] == pytest.approx(2.8)
    assert found.left_velocity[0] == pytest.approx([1.0, 0.2])


def refused_cases():
    floor = Walls(start=[[-1.0, 0.0]], end=[[1.0, 0.0]])
    resting = disks_at([[0.0, 0.25]], [[1.0, 0.0]], mass=75.0)
    rolling = disks_at([[0.0, 0.25]], [[0.6, -1.0]], mass=75.0)
    at_end = disks_at([[1.0, 0.25]], [[0.0, -1.0]], mass=75.0)
    frictional, plain = ContactLaw(friction=0.2), ContactLaw()
    hexagon = [[0.0, 0.25], [0.5, 0.25], [0.25, 0.25 + 0.25 * np.sqrt(3)]]
    return [
        (resting, floor, plain, "contact 0, of 1 and wall 1, is between open and closed"),
        (rolling, floor, frictional, "contact 0, of 1 and wall 1, is between sticking and sliding"),
        (at_end, floor, plain, "contact 0, of 1 and wall 1, is at the end of the wall"),
        (disks_at(hexagon, [0.0, -1.0], mass=75.0), floor, ContactLaw(friction=0.5), "not unique"),
    ]


@pytest.mark.parametrize(("disks", "walls", "law", "words"), refused_cases())
def test_what_has_no_gradient_is_refused_by_name(disks, walls, law, words):
    solution = solve(disks, find_contacts(disks, walls, tolerance=1e-9), law=law, tolerance=1e-10)
    with pytest.raises(NoGradientError, match=words):
        gradient(solution, walls, velocity=np.ones((len(disks), 2)))


def test_dissipation_and_loose_answers_are_refused(pair):
    disks, walls = pair
    contacts = find_contacts(disks, walls, tolerance=1e-9)
    rebound = solve(disks, contacts, law=ContactLaw(restitution=0.5))
    with pytest.raises(ValueError, match="its contacts dissipate"):
        gradient(rebound, walls)
    loose = dataclasses.replace(solve(disks, contacts), residual=1e-4)
    with pytest.raises(ValueError, match="give solve a smaller tolerance"):
        gradient(loose, walls)
