"""How fast one front is eliminated, and the matrix product of the BLAS at the same size."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.linalg import cholesky

from benchmarks.machine import head, line
from nscd._core import PANEL, eliminate

# Pivots and other rows.
FRONTS = (
    (4, 12), (8, 16), (10, 24), (16, 32), (24, 64), (40, 120), (80, 200), (120, 400), (250, 700), (500, 1000)
)  # fmt: skip
TIMES, FLOPS = 25, 1e7
NOTHING = np.empty(0)


def rows() -> list[str]:
    """A row of the table for each size of front."""
    return [_row(pivots, rest) for pivots, rest in FRONTS]


HEADING = head(
    "pivots + others", "kernel", "dgemm of as many rows", "share of dgemm", "LLᵀ against the matrix"
)


def _row(pivots: int, rest: int) -> str:
    size = pivots + rest
    half = np.random.default_rng(size).normal(size=(size, size + 3))
    matrix = half @ half.T + np.eye(size)
    flops = float(sum((size - q) ** 2 for q in range(pivots)))
    given = in_chunks(matrix, pivots)
    front, count = np.empty_like(given), max(1, int(FLOPS / flops))
    calls = {
        "new": lambda n: _eliminations(front, given, pivots, rest, n),
        "copies": lambda n: _copies(front, given, n),
        "dgemm": lambda n: _products(matrix, matrix, np.empty_like(matrix), n),
    }
    often = {name: count for name in calls} | {"dgemm": max(1, int(FLOPS / (2 * size**3)))}
    seconds = _fastest(calls, often)
    new = flops / (seconds["new"] - seconds["copies"])
    dgemm = 2 * size**3 / seconds["dgemm"]
    error = _error(given, matrix, pivots)
    rates = f"{new / 1e9:.1f}", f"{dgemm / 1e9:.1f}", f"{new / dgemm:.2f}"
    return line([f"{pivots} + {rest}", *rates, f"{error:.0e}"])


def _fastest(calls: dict[str, Callable[[int], Any]], often: dict[str, int]) -> dict[str, float]:
    """CPU seconds of one of each, the least of many times that take turns."""
    least = dict.fromkeys(calls, np.inf)
    for _ in range(TIMES):
        for name, call in calls.items():
            started = time.process_time()
            call(often[name])
            least[name] = min(least[name], (time.process_time() - started) / often[name])
    return least


def _eliminations(front: Any, given: Any, pivots: int, rest: int, times: int) -> None:
    for _ in range(times):
        front[:] = given
        eliminate(front, pivots, rest)


def _copies(to: Any, given: Any, times: int) -> None:
    """The same without its arithmetic: a front of no pivots is a call and a copy."""
    for _ in range(times):
        to[:] = given
        eliminate(NOTHING, 0, 0)


def _products(a: Any, b: Any, c: Any, times: int) -> None:
    for _ in range(times):
        np.dot(a, b, c)


def in_chunks(matrix: Any, pivots: int) -> Any:
    """A front as `eliminate` takes it, at an address that is a multiple of 64 bytes."""
    rest = len(matrix) - pivots
    wide, more, height = -(-pivots // 8), -(-rest // 8), _height(pivots)
    panel = np.zeros((height, 8 * (wide + more)))
    panel[:pivots, :pivots] = np.triu(matrix[:pivots, :pivots])
    panel[:pivots, 8 * wide : 8 * wide + rest] = matrix[:pivots, pivots:]
    others = np.zeros((8 * more, 8 * more))
    others[:rest, :rest] = matrix[pivots:, pivots:]
    parts = [panel.reshape(height, wide + more, 8).transpose(1, 0, 2).ravel()]
    parts += [others[: 8 * c + 8, 8 * c : 8 * c + 8].ravel() for c in range(more)]
    numbers = np.concatenate(parts)
    room = np.empty(len(numbers) + 7)
    front = room[-(room.ctypes.data // 8) % 8 :][: len(numbers)]
    front[:] = numbers
    return front


def _height(pivots: int) -> int:
    return -(-pivots // 4) * 4 if pivots <= PANEL else -(-pivots // 8) * 8


def _error(given: Any, matrix: Any, pivots: int) -> float:
    """max|LLᵀ − A| / max|A| over the rows that are eliminated."""
    front, size = given.copy(), len(matrix)
    assert eliminate(front, pivots, size - pivots)
    wide, height = -(-pivots // 8), _height(pivots)
    update = 8 * height * (wide + -((pivots - size) // 8))
    rows = front[:update].reshape(-1, height, 8).transpose(1, 0, 2).reshape(height, -1)
    upper = np.triu(rows[:pivots, :pivots])
    np.fill_diagonal(upper, 1 / np.diag(upper))
    beside = rows[:pivots, 8 * wide : 8 * wide + size - pivots]
    product = upper.T @ np.hstack([upper, beside])
    assert np.allclose(upper, cholesky(matrix[:pivots, :pivots]))
    return float(np.abs(product - matrix[:pivots]).max() / np.abs(matrix).max())
