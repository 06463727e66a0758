"""Factors by fronts against SciPy's sparse LU of the same matrix, and the tree that they follow."""

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import spsolve

from analysis.library.families import FAMILIES
from nscd import ContactLaw
from nscd.problem import impact_problem
from nscd.solvers.cholesky import factor as factors
from nscd.solvers.cholesky.dissection import dissect
from nscd.solvers.system import system_of

LAWS = {
    2: ContactLaw(dissipation=0.7, tangential_dissipation=0.0),
    3: ContactLaw(dissipation=0.7, tangential_dissipation=0.5),
}


def matrix_of(system, theta):
    """Â + CᵀΘC of disks in elimination order."""
    n, d = system.mass.shape
    whole = sparse.diags_array(system.mass.ravel()).tocsr()
    for first, second, weight in (
        (system.normal_first, system.normal_second, theta + system.normal_weight),
        (system.tangent_first, system.tangent_second, system.tangent_weight),
    ):
        rows = sparse.lil_array((len(theta), n * d))
        for c in range(len(theta)):
            rows[c, system.first[c] * d + np.arange(d)] = first[c]
            if system.second[c] >= 0:
                rows[c, system.second[c] * d + np.arange(d)] = second[c]
        rows = rows.tocsr()
        whole += rows.T @ sparse.diags_array(weight) @ rows
    return whole.tocsc()


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("name", ["heap", "hexagonal"])
def test_the_factor_solves_whatever_was_in_the_store(name, d, monkeypatch):
    monkeypatch.setattr(factors, "MANY", 0)
    case = FAMILIES[name](200)
    problem = impact_problem(case.snapshot, case.contacts, case.left_velocity, LAWS[d])
    system, factor = system_of(problem)
    assert factor.many
    assert system.mass.shape[1] == d
    draw = np.random.default_rng(d)
    theta = 10.0 ** draw.uniform(-2, 2, len(system.first)) * problem.mass[0, 0]
    factor.fronts.store[:] = np.nan
    factor.fronts.work[:] = np.nan
    right = draw.normal(size=system.mass.shape)
    expected = spsolve(matrix_of(system, theta), right.ravel()).reshape(right.shape)
    for _ in range(2):
        assert factors.factorise(system, factor, theta)
        found = right.copy()
        factors.solve_factorised(factor, found)
        np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())


def test_separators_are_a_tree_that_holds_every_border():
    case = FAMILIES["heap"](300)
    first = case.contacts.first.astype(np.int32)
    second = np.where(case.contacts.is_wall, -1, case.contacts.second).astype(np.int32)
    ordering = dissect(case.snapshot.position, first, second, 8)
    n = len(ordering.order)
    np.testing.assert_array_equal(np.sort(ordering.order), np.arange(n))
    np.testing.assert_array_equal(ordering.order[ordering.place], np.arange(n))
    np.testing.assert_array_equal(ordering.node_first[1:], ordering.node_end[:-1])
    assert (ordering.node_first[0], ordering.node_end[-1]) == (0, n)
    assert (ordering.node_end >= ordering.node_first).all()
    above = ordering.node_parent
    assert ((above > np.arange(len(above))) | (above < 0)).all()
    # what a node reaches is eliminated by those above it
    node = np.searchsorted(ordering.node_end, np.arange(n), side="right")
    reached = [set() for _ in above]
    for s in range(len(above)):
        for k in range(ordering.node_first[s], ordering.node_end[s]):
            disk = ordering.order[k]
            for e in range(ordering.start[disk], ordering.start[disk + 1]):
                reached[s].add(int(ordering.place[ordering.neighbour[e]]))
        reached[s] = {k for k in reached[s] if k >= ordering.node_end[s]}
        up = set()
        t = above[s]
        while t >= 0:
            up.add(int(t))
            t = above[t]
        assert {int(node[k]) for k in reached[s]} <= up
        if above[s] >= 0:
            reached[above[s]] |= reached[s]
