"""Factors by fronts against SciPy's sparse LU of the same matrix, and the tree that they follow."""

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import spsolve

from benchmarks.problems.families import FAMILIES
from nscd import _core


def matrix_of(first, second, rows, weights, mass):
    """M + Σ wᵀ r rᵀ over rows (k,2d) of the two disks of each contact."""
    n, d = mass.shape
    whole = sparse.diags_array(mass.ravel()).tocsr()
    for row, weight in zip(rows, weights, strict=True):
        matrix = sparse.lil_array((len(weight), n * d))
        for c in range(len(weight)):
            matrix[c, first[c] * d + np.arange(d)] = row[c, :d]
            if second[c] >= 0:
                matrix[c, second[c] * d + np.arange(d)] = row[c, d:]
        matrix = matrix.tocsr()
        whole += matrix.T @ sparse.diags_array(weight) @ matrix
    return whole.tocsc()


@pytest.mark.parametrize(("fronts", "threads"), [(False, 1), (True, 1), (True, 2)])
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("name", ["heap", "hexagonal"])
def test_the_factor_solves(name, d, fronts, threads):
    """By rows, by fronts, and by fronts of which two threads work on eight pieces."""
    case = FAMILIES[name](200)
    crowd, contacts, draw = case.snapshot, case.contacts, np.random.default_rng(d)
    k, wall = len(contacts), contacts.is_wall
    first = contacts.first.astype(np.int32)
    second = np.where(wall, -1, contacts.second).astype(np.int32)
    other = np.where(wall, 0.0, crowd.radius[np.where(wall, 0, second)])
    levers = np.column_stack([crowd.radius[first], other])
    mass = np.column_stack([crowd.mass, crowd.mass, crowd.inertia])[:, :d].copy()
    along, across = np.full(k, 0.7), np.full(k, 0.5 if d == 3 else 0.0)
    theta = 10.0 ** draw.uniform(-2, 2, k) * mass[0, 0]
    normal, none = np.array(contacts.normal), np.zeros((k, 1))
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
    rows = [
        np.hstack([normal, none, -normal, none]),
        np.hstack([tangent, levers[:, :1], -tangent, levers[:, 1:]]),
    ]
    if d == 2:
        rows = [np.hstack([row[:, :2], row[:, 3:5]]) for row in rows]
    right = draw.normal(size=mass.shape)
    matrix = matrix_of(first, second, rows, [theta + along, across], mass)
    expected = spsolve(matrix, right.ravel()).reshape(right.shape)
    factor = _core.Factor(
        first, second, normal, levers, np.array(crowd.position), mass, along, across, fronts, threads,
        100 if threads > 1 else 10**9,
    )  # fmt: skip
    for _ in range(2):
        assert factor.factorise(theta)
        found = factor.solve(right)
        np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())


def test_separators_are_a_tree_that_holds_every_border():
    case = FAMILIES["heap"](300)
    first = case.contacts.first.astype(np.int32)
    second = np.where(case.contacts.is_wall, -1, case.contacts.second).astype(np.int32)
    order, node_first, node_end, above = _core.dissect(case.snapshot.position, first, second, 8)
    n, place = len(order), np.argsort(order)
    np.testing.assert_array_equal(np.sort(order), np.arange(n))
    np.testing.assert_array_equal(node_first[1:], node_end[:-1])
    assert (node_first[0], node_end[-1]) == (0, n)
    assert (node_end >= node_first).all()
    assert ((above > np.arange(len(above))) | (above < 0)).all()
    # what a node reaches is eliminated by those above it
    node = np.searchsorted(node_end, np.arange(n), side="right")
    reached = [set() for _ in above]
    for a, b, other in zip(place[first], place[second], second, strict=True):
        if other >= 0:
            reached[node[min(a, b)]].add(int(max(a, b)))
    for s in range(len(above)):
        reached[s] = {k for k in reached[s] if k >= node_end[s]}
        up = set()
        t = above[s]
        while t >= 0:
            up.add(int(t))
            t = above[t]
        assert {int(node[k]) for k in reached[s]} <= up
        if above[s] >= 0:
            reached[above[s]] |= reached[s]
