"""The dense elimination of a front against LAPACK's Cholesky factorisation."""

import numpy as np
import pytest
from scipy.linalg import cholesky

from nscd._core import PANEL, eliminate


def in_chunks(matrix, pivots):
    """The numbers of a front."""
    rest = len(matrix) - pivots
    height = -(-pivots // 4) * 4 if pivots <= PANEL else -(-pivots // 8) * 8
    wide, more = -(-pivots // 8), -(-rest // 8)
    rows = np.zeros((height, 8 * (wide + more)))
    rows[:pivots, :pivots] = np.triu(matrix[:pivots, :pivots])
    rows[:pivots, 8 * wide : 8 * wide + rest] = matrix[:pivots, pivots:]
    panel = rows.reshape(height, wide + more, 8).transpose(1, 0, 2)
    others = np.zeros((8 * more, 8 * more))
    others[:rest, :rest] = np.triu(matrix[pivots:, pivots:])
    update = [others[: 8 * c + 8, 8 * c : 8 * c + 8].ravel() for c in range(more)]
    return np.concatenate([panel.ravel(), *update])


def from_chunks(front, size, pivots):
    """Lᵀ of the pivots (pivots, size), and the upper half of the Schur complement."""
    rest = size - pivots
    wide, more = -(-pivots // 8), -(-rest // 8)
    height = -(-pivots // 4) * 4 if pivots <= PANEL else -(-pivots // 8) * 8
    at = 8 * (wide + more) * height
    rows = front[:at].reshape(wide + more, height, 8).transpose(1, 0, 2).reshape(height, -1)
    upper = np.triu(rows[:pivots, :pivots])
    np.fill_diagonal(upper, 1.0 / np.diag(upper))
    others = np.zeros((8 * more, 8 * more))
    for c in range(more):
        others[: 8 * c + 8, 8 * c : 8 * c + 8] = front[at : at + 64 * (c + 1)].reshape(-1, 8)
        at += 64 * (c + 1)
    beside = rows[:pivots, 8 * wide : 8 * wide + rest]
    return np.hstack([upper, beside]), np.triu(others[:rest, :rest])


@pytest.mark.parametrize(
    ("size", "pivots"),
    [(1, 1), (5, 2), (8, 3), (23, 23), (90, 31), (153, PANEL), (300, PANEL + 1), (700, 600)],
)
def test_rows_of_the_factor_and_the_schur_complement(size, pivots):
    half = np.random.default_rng(size).normal(size=(size, size + 3))
    matrix = half @ half.T + np.eye(size)
    factor = cholesky(matrix)
    front = in_chunks(matrix, pivots)
    assert eliminate(front, pivots, size - pivots)
    rows, others = from_chunks(front, size, pivots)
    scale = np.abs(matrix).max()
    np.testing.assert_allclose(rows, factor[:pivots], atol=1e-12 * scale)
    left = matrix[pivots:, pivots:] - factor[:pivots, pivots:].T @ factor[:pivots, pivots:]
    np.testing.assert_allclose(others, np.triu(left), atol=1e-12 * scale)


@pytest.mark.parametrize(("size", "wrong"), [(7, 4), (7, 5), (7, 6), (PANEL + 9, PANEL + 3)])
@pytest.mark.parametrize("value", [-1.0, 0.0, np.nan])
def test_an_indefinite_matrix_is_refused(size, wrong, value):
    matrix = np.eye(size)
    matrix[wrong, wrong] = value
    assert not eliminate(in_chunks(matrix, size), size, 0)


def test_a_tiny_matrix_is_no_indefinite_one():
    front = in_chunks(1e-250 * np.eye(6), 4)
    assert eliminate(front, 4, 2)
    rows, _ = from_chunks(front, 6, 4)
    np.testing.assert_allclose(np.diag(rows[:, :4]), 1e-125)
