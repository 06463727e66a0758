"""Small crowds: the certificate of an answer computed again, and which method gives it. Crowds of
the benchmark's families: solved to the tolerance whichever rung takes them, and by the least
energy."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls

from benchmarks.problems.families import FAMILIES
from nscd import Walls, find_contacts, solve
from tests.crowds import part_of_a_lattice

WALLS = Walls(start=[[-1, -0.25]], end=[[9, -0.25]])


@settings(max_examples=40)
@given(
    st.integers(0, 10**6), st.integers(2, 40), st.floats(0.15, 1.0), st.floats(0.0, 2.0),
    st.booleans(),
)  # fmt: skip
def test_what_an_answer_says_of_itself_is_so(seed, n, selected, decades, canonical):
    """The law and the certificate, computed again from impulses and velocities."""
    snapshot = part_of_a_lattice(seed, n, selected, decades)
    contacts = find_contacts(snapshot, WALLS, tolerance=1e-9)
    found = solve(snapshot, contacts, tolerance=1e-10, canonical=canonical)
    assert found.status == "solved"
    before, after, mass = snapshot.velocity, found.right_velocity, snapshot.mass[:, None]
    np.testing.assert_allclose(found.impulse, found.reaction[:, None] * contacts.normal, atol=1e-15)
    scale, weight = np.abs(before).max(), contacts.inverse_mass(snapshot.mass)
    error = np.minimum(weight * found.reaction, -contacts.approach_velocity(after))
    assert found.residual == pytest.approx(np.abs(error).max(initial=0.0) / scale, abs=1e-14)
    off = mass * (after - before) - contacts.momentum_change(found.impulse, n)
    received = contacts.sum_at_disks(found.reaction, n)
    fraction = np.abs(off).max(1) / (snapshot.mass * scale + received)
    assert found.momentum_error == pytest.approx(fraction.max(), abs=1e-14)
    energy = 0.5 * (mass * (after**2 - before**2)).sum()
    assert found.energy_change == pytest.approx(energy, abs=1e-12 * (mass * before**2).sum())
    assert found.energy_change <= 1e-9 * (mass * before**2).sum()


@pytest.mark.parametrize(
    ("n", "selected", "decades", "solver", "why"),
    [
        (12, 0.2, 0.0, "tree", "form trees"),
        (64, 0.6, 0.0, "active_set", "descent found the closed contacts"),
        (64, 0.85, 0.0, "interior_point", "does not find the closed contacts"),
        (64, 0.85, 2.0, "interior_point", "masses far apart"),
    ],
)
def test_each_rung_is_taken(n, selected, decades, solver, why):
    """Everybody walks to the middle."""
    still = part_of_a_lattice(4, n, selected, decades)
    inward = still.position.mean(0) - still.position
    snapshot = dataclasses.replace(still, velocity=inward)
    contacts = find_contacts(snapshot, WALLS, tolerance=1e-9)
    solution = solve(snapshot, contacts, tolerance=1e-10)
    assert solution.status == "solved"
    assert solution.solver == solver
    assert why in solution.choice
    assert solution.canonical


CASES = [(family, 300) for family in ("heap", "jammed", "hexagonal", "masses")]
CASES += [("heap", 3500), ("hexagonal", 2500)]
# The oracles are dense, and masses over six orders are beyond their rounding.
DENSE = pytest.mark.parametrize("solved", CASES[:3], indirect=True, ids="{0[0]}-{0[1]}".format)


@pytest.fixture(scope="module", params=CASES, ids="{0[0]}-{0[1]}".format)
def solved(request):
    family, size = request.param
    case = FAMILIES[family](size)
    arguments = {"left_velocity": case.left_velocity, "tolerance": 1e-10}
    return case, solve(case.snapshot, case.contacts, **arguments)


def test_solved_and_said_so(solved):
    case, found = solved
    assert found.status == "solved", found.reason
    assert found.canonical
    # by products of our own with the sparse rows, not by the solver's residual
    C = case.contacts.normal_matrix(len(case.snapshot))
    approach = C @ found.right_velocity.ravel()
    w = case.contacts.inverse_mass(case.snapshot.mass)
    assert np.abs(np.minimum(w * found.reaction, -approach)).max() <= 1e-10 * 2.0
    momentum = case.snapshot.mass[:, None] * (found.right_velocity - case.left_velocity)
    rest = momentum.ravel() + C.T @ found.reaction
    received = np.abs(C).T @ found.reaction + np.repeat(2.0 * case.snapshot.mass, 2)
    assert np.abs(rest / received).max() <= 1e-9


@DENSE
def test_velocities_are_those_of_non_negative_least_squares(solved):
    """u⁺ is the M-projection of u⁻: min ½|M^½u⁻ − M^−½Cᵀλ|², λ ≥ 0, by Lawson and Hanson, with a
    trace of ridge since they need independent columns."""
    case, found = solved
    C = case.contacts.normal_matrix(len(case.snapshot)).toarray()
    root = np.repeat(np.sqrt(case.snapshot.mass), 2)
    ridge = 1e-6 / root.max() * np.eye(len(C))
    aim = np.concatenate([root * case.left_velocity.ravel(), np.zeros(len(C))])
    other, _ = nnls(np.vstack([(C / root).T, ridge]), aim, maxiter=50 * len(C))
    velocity = case.left_velocity.ravel() - C.T @ other / root**2
    np.testing.assert_allclose(found.right_velocity.ravel(), velocity, atol=1e-6)


@DENSE
def test_reactions_have_the_least_energy(solved):
    """Least Σλ² among λ' ≥ 0 with the same momentum, by non-negative least squares."""
    case, found = solved
    C = case.contacts.normal_matrix(len(case.snapshot)).toarray()
    may = -(C @ found.right_velocity.ravel()) <= 1e-10
    stiff = 1e5
    momentum = stiff * C[may].T @ found.reaction[may]
    rows = np.vstack([stiff * C[may].T, np.eye(may.sum())])
    minimum, _ = nnls(rows, np.concatenate([momentum, np.zeros(may.sum())]), maxiter=50 * may.sum())
    np.testing.assert_allclose(found.reaction[may], minimum, atol=1e-6 * minimum.max())
    assert not found.reaction[~may].any()
