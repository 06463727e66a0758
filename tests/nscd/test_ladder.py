"""Every rung of the ladder gives the same velocities; islands, guesses and trees change the cost,
not the answer."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscd import ContactLaw, Walls, _core, find_contacts, solve
from nscd.indeterminacy.nearest import least_energy
from nscd.solve import SOLVERS
from tests.crowds import WALLS, disks_at, lattice, line


def solution_of(snapshot, walls=WALLS, **keywords):
    contacts = find_contacts(snapshot, walls, tolerance=1e-9)
    return contacts, solve(snapshot, contacts, tolerance=1e-9, **keywords)


@given(st.integers(0, 10**6))
def test_every_solver_gives_the_same_velocities(seed):
    snapshot = lattice(seed)
    _, reference = solution_of(snapshot, solver="interior_point")
    assert reference.status == "solved"
    for solver in SOLVERS:
        _, found = solution_of(snapshot, solver=solver)
        if solver == "active_set" and found.status != "solved":
            continue  # it may cycle where contacts are redundant; it then says so
        assert found.status == "solved", (solver, found.reason)
        np.testing.assert_allclose(found.right_velocity, reference.right_velocity, atol=1e-6)


@given(st.integers(0, 10**6))
def test_islands_equal_the_whole(seed):
    """Two crowds far apart, solved together, are solved as each alone."""
    one, two = lattice(seed), lattice(seed + 1)
    there = disks_at(np.add(two.position, [100.0, 0.0]), two.velocity, two.radius, two.mass)
    parts = ("position", "velocity", "radius", "mass")
    both = disks_at(*(np.concatenate([getattr(o, p) for o in (one, there)]) for p in parts))
    _, full = solution_of(both, None)
    alone = np.concatenate([solution_of(part, None)[1].right_velocity for part in (one, two)])
    np.testing.assert_allclose(full.right_velocity, alone, atol=1e-7)


@given(st.integers(0, 10**6), st.floats(0, 0.1))
def test_warm_equals_cold(seed, change):
    snapshot = lattice(seed, decades=1.0)
    rng = np.random.default_rng(seed)
    contacts, before = solution_of(snapshot)
    left = snapshot.velocity + change * rng.normal(size=snapshot.velocity.shape)
    cold = solve(snapshot, contacts, left_velocity=left, tolerance=1e-9)
    warm = solve(snapshot, contacts, left_velocity=left, tolerance=1e-9, guess=before)
    assert warm.status == cold.status == "solved"
    np.testing.assert_allclose(warm.right_velocity, cold.right_velocity, atol=1e-6)


@given(st.integers(0, 10**6), st.integers(2, 40), st.booleans())
def test_trees_equal_the_interior_point(seed, n, wall):
    """A random branching tree of touching disks, each touching its parent only."""
    rng = np.random.default_rng(seed)
    position = [np.zeros(2)]
    while len(position) < n:
        angle = rng.uniform(0, 2 * np.pi)
        towards = np.array([np.cos(angle), np.sin(angle)])
        site = position[rng.integers(len(position))] + 0.5 * towards
        if min(np.hypot(*(site - other)) for other in position) > 0.5 - 1e-12:
            position.append(site)
    position = np.array(position)
    snapshot = disks_at(position, rng.normal(size=(n, 2)), mass=rng.uniform(1, 100, n))
    lowest = position[:, 1].min() - 0.25
    walls = Walls(start=[[-50, lowest]], end=[[50, lowest]]) if wall else None
    contacts, found = solution_of(snapshot, walls)
    if len(contacts) == 0:
        return
    assert found.status == "solved", found.reason
    assert found.solver in ("tree", "closed_form", "interior_point")
    _, reference = solution_of(snapshot, walls, solver="interior_point")
    np.testing.assert_allclose(found.right_velocity, reference.right_velocity, atol=1e-6)
    size = max(reference.reaction.max(), 1.0)
    np.testing.assert_allclose(found.reaction, reference.reaction, atol=1e-5 * size)


@pytest.mark.parametrize("size", [0.0, 1e-170, 1e-120])
@pytest.mark.parametrize("solver", SOLVERS)
def test_no_speed_is_no_error(size, solver):
    snapshot = lattice(3)
    contacts = find_contacts(snapshot, WALLS, tolerance=1e-9)
    found = solve(snapshot, contacts, left_velocity=size * snapshot.velocity, solver=solver)
    assert found.status == "solved"
    assert np.abs(found.right_velocity).max() <= 100 * size


@pytest.mark.parametrize("lost", [1e-3, 1e-6, 1e-9, 1e-12, 1e-14, 1e-15])
def test_nearly_elastic_answers_are_right_or_said_to_be_inaccurate(lost):
    """Five in a row: k = m_eff (2 − lost)/lost magnifies the rounding of u; sums do not close."""
    snapshot = line(np.full(5, 75.0), [2.0, 0, 0, 0, -1.0])
    contacts = find_contacts(snapshot, tolerance=1e-9)
    found = solve(snapshot, contacts, law=ContactLaw(restitution=1 - lost), tolerance=1e-8)
    # lost → 0: u⁺ + u⁻ is the same for all, 2/5 m/s with the momentum of 1 kg m/s per kg
    limit = 0.4 - snapshot.velocity[:, 0]
    wrong = np.abs(found.right_velocity[:, 0] - limit).max()
    assert (found.status == "solved") == (lost > 1e-8)
    assert wrong < 5 * lost or found.status == "inaccurate"


@pytest.mark.parametrize(
    ("seed", "law"),
    [(1, ContactLaw(restitution=0.99)), (24, ContactLaw(maintained=True))]
    + [(seed, ContactLaw(dissipation=1e6, tangential_dissipation=0.0)) for seed in (1, 17, 56)],
)
def test_masses_far_apart_are_solved_whatever_the_law(seed, law):
    """Masses 1 : 10⁶ pressed into each other: k up to 10⁶ times a mass, W nearly singular."""
    rng = np.random.default_rng(seed)
    position, velocity = rng.uniform(-1.5, 1.5, (40, 2)), rng.normal(size=(40, 2))
    radius, mass = rng.uniform(0.18, 0.25, 40), 10.0 ** rng.uniform(0, 6, 40)
    snapshot = disks_at(position, velocity, radius, mass)
    wall = Walls(start=[[-9.0, -1.6]], end=[[9.0, -1.6]]) if seed % 2 else None
    contacts = find_contacts(snapshot, wall, tolerance=0.02)
    found = solve(snapshot, contacts, law=law, canonical=False)
    assert found.status == "solved", found.reason


def test_first_order_solvers_refuse_dissipation():
    snapshot = lattice(3)
    contacts = find_contacts(snapshot, WALLS, tolerance=1e-9)
    with pytest.raises(ValueError, match="without dissipation"):
        solve(snapshot, contacts, law=ContactLaw(dissipation=1.0), solver="projected_gradient")


@given(st.integers(0, 10**6))
def test_reactions_are_those_of_least_energy(seed):
    """The default λ is the least-norm one of all admissible percussions (an independent method:
    the interior point)."""
    snapshot = lattice(seed, decades=1.0)
    contacts, found = solution_of(snapshot)
    assert found.canonical
    reference = least_energy(contacts, found)
    size = max(reference.max(initial=0.0), 1e-9)
    np.testing.assert_allclose(found.reaction, reference, atol=1e-6 * size)
    _, other = solution_of(snapshot, canonical=False)
    np.testing.assert_allclose(other.right_velocity, found.right_velocity, atol=1e-7)
    assert (found.reaction**2).sum() <= (other.reaction**2).sum() * (1 + 1e-9)


def test_the_path_ends_at_once_at_what_is_no_number():
    snapshot = lattice(3)
    contacts = find_contacts(snapshot, WALLS, tolerance=1e-9)
    free = np.array(snapshot.velocity)
    parts = contacts.first, contacts.second, contacts.is_wall, contacts.normal
    crowd = snapshot.position, snapshot.radius, snapshot.mass, snapshot.velocity
    path = {"free": free, "solver": _core.Solver.INTERIOR_POINT}
    valid = _core.solve_impact(*parts, *crowd, **path)
    assert valid.finite
    assert valid.iterations > 0
    free[7, 1] = np.nan
    broken = _core.solve_impact(*parts, *crowd, **path)
    assert not broken.finite
    assert broken.iterations <= 2
