"""The bound of the velocity error: never below the true error, and not far above it."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from nscd import ContactLaw, Walls, find_contacts, solve
from tests.crowds import WALLS, disks_at, lattice, line
from tests.nscd.exact import distance, exact_velocity

# What a bound may be above the error where this is rounding (m/s, velocities of about 1 m/s).
ROUNDING = 1e-12


def chain(n):
    """A line of touching disks pushed against a wall: the residual understates the error most."""
    position = np.column_stack([0.25 + 0.5 * np.arange(n), np.zeros(n)])
    velocity = np.zeros((n, 2))
    velocity[-1] = [-1.0, 0.0]
    wall = Walls(start=[[0.0, -1.0]], end=[[0.0, 1.0]])
    return disks_at(position, velocity), wall


SMOOTH = {"tangential_dissipation": 0.0}
LAWS = {
    "inelastic": ContactLaw(),
    "restitution": ContactLaw(restitution=0.5),
    "nearly elastic": ContactLaw(restitution=0.99),
    "dissipative": ContactLaw(dissipation=3.0, **SMOOTH),
    "maintained": ContactLaw(maintained=True),
    "maintained, dissipative": ContactLaw(dissipation=1.0, maintained=True, **SMOOTH),
}


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())
@pytest.mark.parametrize(("seed", "decades"), [(0, 0.0), (1, 0.0), (2, 2.0), (3, 4.0)])
def test_the_bound_holds_against_exact_arithmetic(law, seed, decades):
    snapshot = lattice(seed, 12, decades, rows=4)
    contacts = find_contacts(snapshot, WALLS if seed % 2 else None, tolerance=1e-9)
    coefficients, _ = law.coefficients(contacts.inverse_mass(snapshot.mass))
    some = coefficients if coefficients.any() else None
    exact = exact_velocity(snapshot, contacts, snapshot.velocity, some, law.maintained)
    solvers = [("auto", 1e-8), ("interior_point", 1e-3), ("interior_point", 1e-6)]
    if not coefficients.any():
        solvers += itertools.product(("gauss_seidel", "projected_gradient"), (1e-2, 1e-5))
    for solver, tolerance in solvers:
        how = {"law": law, "solver": solver, "tolerance": tolerance}
        solution = solve(snapshot, contacts, **how, canonical=False)
        error = distance(snapshot, solution.right_velocity, exact)
        assert error <= solution.velocity_error, (solver, tolerance)
        # Â weighs more than M where contacts dissipate, by 1 + k w at most
        looser = np.sqrt(1 + (coefficients * contacts.inverse_mass(snapshot.mass)).max())
        assert solution.velocity_error <= 20 * looser * (error + solution.residual + ROUNDING)


@pytest.mark.parametrize("n", [10, 30, 60])
def test_the_bound_sees_what_the_residual_does_not(n):
    """On a chain Gauss–Seidel ends with an error of up to (n/π)² residuals, in its slowest mode; u⁺
    = 0 but for those that are pushed away."""
    snapshot, wall = chain(n)
    contacts = find_contacts(snapshot, wall, tolerance=1e-9)
    solution = solve(snapshot, contacts, solver="gauss_seidel", tolerance=1e-8, canonical=False)
    exact = solve(snapshot, contacts, tolerance=1e-12)
    assert np.abs(exact.right_velocity).max() < 1e-12
    error = np.sqrt((solution.right_velocity**2).sum() / n)
    assert error > 0.05 * n * solution.residual
    assert error <= solution.velocity_error <= 1.01 * error


@pytest.mark.parametrize(("n", "seed"), [(24, 10), (26, 1), (88, 10), (89, 4)])
def test_the_bound_holds_where_roundings_add_up(n, seed):
    """All gaps of a chain that is stopped are open by less than their rounding: u⁺ = 0 exactly, and
    the error of a disk is the sum of those in front of it."""
    snapshot, wall = chain(n)
    rng = np.random.default_rng([n, seed])
    mass = snapshot.mass if seed % 2 else rng.uniform(50, 100, n)
    snapshot = replace(snapshot, mass=mass)
    contacts = find_contacts(snapshot, wall, tolerance=1e-9)
    solution = solve(snapshot, contacts, solver="active_set", canonical=False)
    error = np.sqrt(mass @ (solution.right_velocity**2).sum(1) / mass.sum())
    assert 0 < error <= solution.velocity_error < 1e-12


@pytest.mark.parametrize("decades", [0.0, 1.0, 4.0])
def test_the_bound_holds_on_random_crowds(decades):
    """Against a solution to 10⁻¹⁴ by another solver, whose own bound is added."""
    for seed in range(40):
        snapshot = lattice(seed, 10 + seed % 14, decades, rows=4)
        contacts = find_contacts(snapshot, WALLS, tolerance=1e-9)
        for law in LAWS.values():
            sharp = solve(snapshot, contacts, law=law, solver="interior_point", tolerance=1e-14)
            found = solve(snapshot, contacts, law=law, tolerance=1e-4, canonical=False)
            distance = snapshot.mass[:, None] * (found.right_velocity - sharp.right_velocity) ** 2
            error = np.sqrt(distance.sum() / snapshot.mass.sum())
            assert error <= found.velocity_error + sharp.velocity_error
            assert sharp.velocity_error < 1e-7


def test_an_answer_that_is_none_has_a_large_bound():
    """A residual of one half: the bound says so, and is not more than the crowd's motion."""
    snapshot = lattice(5, 20, rows=4)
    contacts = find_contacts(snapshot, WALLS, tolerance=1e-9)
    found = solve(snapshot, contacts, solver="gauss_seidel", tolerance=0.5, canonical=False)
    sharp = solve(snapshot, contacts)
    distance = snapshot.mass[:, None] * (found.right_velocity - sharp.right_velocity) ** 2
    error = np.sqrt(distance.sum() / snapshot.mass.sum())
    assert 1e-3 < error <= found.velocity_error < 3.0


def test_what_needs_no_solver_is_known_to_rounding():
    snapshot = lattice(1, 12, rows=4)
    away = disks_at(snapshot.position, snapshot.position, snapshot.radius, snapshot.mass)
    contacts = find_contacts(away, tolerance=1e-9)
    assert solve(away, contacts).velocity_error == 0.0
    none = find_contacts(away, tolerance=0.0).select(np.zeros(0, dtype=int))
    assert solve(away, none).velocity_error == 0.0
    pair = line([75, 60], [2, 0])
    in_contact = find_contacts(pair, tolerance=1e-9)
    for law in (ContactLaw(), ContactLaw(restitution=0.5), ContactLaw(dissipation=1.0)):
        assert 0 < solve(pair, in_contact, law=law).velocity_error < 1e-13
