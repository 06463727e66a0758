"""Crowds of the benchmark's families: solved to the tolerance whichever rung takes them, and by the
least energy."""

import numpy as np
import pytest
from scipy.optimize import nnls

from benchmarks.problems.families import FAMILIES
from nscd import solve

CASES = [
    ("heap", 300),
    ("jammed", 300),
    ("hexagonal", 300),
    ("masses", 300),
    ("heap", 3500),
    ("hexagonal", 2500),
]


@pytest.fixture(scope="module", params=CASES, ids=lambda case: f"{case[0]}-{case[1]}")
def solved(request):
    family, size = request.param
    case = FAMILIES[family](size)
    return case, solve(
        case.snapshot, case.contacts, left_velocity=case.left_velocity, tolerance=1e-10
    )


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


def test_velocities_are_those_of_non_negative_least_squares(solved):
    """u⁺ is the M-projection of u⁻: min ½|M^½u⁻ − M^−½Cᵀλ|², λ ≥ 0, by Lawson and Hanson, with a
    trace of ridge since they need independent columns."""
    case, found = solved
    if len(case.snapshot) > 300 or case.name == "masses":
        pytest.skip("dense; and masses over six orders are beyond its rounding")
    C = case.contacts.normal_matrix(len(case.snapshot)).toarray()
    root = np.repeat(np.sqrt(case.snapshot.mass), 2)
    ridge = 1e-6 / root.max() * np.eye(len(C))
    aim = np.concatenate([root * case.left_velocity.ravel(), np.zeros(len(C))])
    other, _ = nnls(np.vstack([(C / root).T, ridge]), aim, maxiter=50 * len(C))
    velocity = case.left_velocity.ravel() - C.T @ other / root**2
    np.testing.assert_allclose(found.right_velocity.ravel(), velocity, atol=1e-6)


def test_reactions_have_the_least_energy(solved):
    """Least Σλ² among λ' ≥ 0 with the same momentum: non-negative least squares with the momentum
    weighted up."""
    case, found = solved
    if len(case.snapshot) > 300 or case.name == "masses":
        pytest.skip("dense")
    C = case.contacts.normal_matrix(len(case.snapshot)).toarray()
    may = -(C @ found.right_velocity.ravel()) <= 1e-10
    stiff = 1e5
    momentum = stiff * C[may].T @ found.reaction[may]
    rows = np.vstack([stiff * C[may].T, np.eye(may.sum())])
    least, _ = nnls(rows, np.concatenate([momentum, np.zeros(may.sum())]), maxiter=50 * may.sum())
    np.testing.assert_allclose(found.reaction[may], least, atol=1e-6 * least.max())
    assert not found.reaction[~may].any()
