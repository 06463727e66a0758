"""The dense elimination of a front against LAPACK's Cholesky factorisation."""

import numpy as np
import pytest
from scipy.linalg import cholesky

from nscd.solvers.cholesky.elimination import COLUMNS, LARGE, eliminate


@pytest.mark.parametrize(
    ("size", "pivots"),
    [(1, 1), (5, 2), (23, 23), (90, 31), (LARGE - 1, 77), (LARGE, 600), (LARGE + 87, 141)],
)
def test_rows_of_the_factor_and_the_schur_complement(size, pivots):
    half = np.random.default_rng(size).normal(size=(size, size + 3))
    matrix = half @ half.T + np.eye(size)
    factor = cholesky(matrix)
    panel = matrix[:pivots].ravel().copy()
    others = matrix[pivots:, pivots:].ravel().copy()
    assert eliminate(panel, others, np.empty(COLUMNS * size), size, pivots)
    scale = np.abs(matrix).max()
    np.testing.assert_allclose(
        np.triu(panel.reshape(pivots, size)), factor[:pivots], atol=1e-12 * scale
    )
    left = matrix[pivots:, pivots:] - factor[:pivots, pivots:].T @ factor[:pivots, pivots:]
    rest = others.reshape(size - pivots, size - pivots)
    np.testing.assert_allclose(np.triu(rest), np.triu(left), atol=1e-12 * scale)


@pytest.mark.parametrize("size", [7, LARGE + 1])
def test_an_indefinite_matrix_is_refused(size):
    matrix = np.eye(size)
    matrix[4, 4] = -1.0
    assert not eliminate(matrix.ravel(), np.empty(0), np.empty(COLUMNS * size), size, size)
