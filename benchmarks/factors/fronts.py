"""How fast one front is eliminated: this product's kernel, its kernel before (see `--before`), and
the matrix product of the BLAS at the same size."""

from __future__ import annotations

import importlib.util
import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from scipy.linalg import cholesky

from nscd.solvers.cholesky.elimination import PANEL, eliminate

# Pivots and other rows.
FRONTS = (
    (4, 12), (8, 16), (10, 24), (16, 32), (24, 64), (40, 120), (80, 200), (120, 400), (250, 700), (500, 1000)
)  # fmt: skip
TIMES, FLOPS = 25, 1e7


def rows(before: Path | None) -> list[str]:
    """A row of the table for each size of front."""
    old = None if before is None else _older(before)
    return [_row(pivots, rest, old) for pivots, rest in FRONTS]


HEADING = (
    "| pivots + others | kernel before | kernel | dgemm of as many rows | share of dgemm"
    " | LLᵀ against the matrix |\n|---|---|---|---|---|---|"
)


def _row(pivots: int, rest: int, old: Any) -> str:
    size = pivots + rest
    half = np.random.default_rng(size).normal(size=(size, size + 3))
    matrix = half @ half.T + np.eye(size)
    flops = float(sum((size - q) ** 2 for q in range(pivots)))
    given, update = in_chunks(matrix, pivots)
    front, count = np.empty_like(given), max(1, int(FLOPS / flops))
    calls = {
        "new": lambda n: _eliminations(front, given, update, pivots, rest, n),
        "copies": lambda n: _copies(front, given, n),
        "dgemm": lambda n: _products(matrix, matrix, np.empty_like(matrix), n),
    }
    if old is not None:
        panel, others = matrix[:pivots].ravel(), matrix[pivots:, pivots:].ravel()
        one, two = np.empty_like(panel), np.empty_like(others)
        work = np.empty(old[1] * size)
        calls["old"] = lambda n: old[0](one, panel, two, others, work, (size, pivots, n))
        calls["old copies"] = lambda n: _copies(one, panel, n) + _copies(two, others, n)
    often = {name: count for name in calls} | {"dgemm": max(1, int(FLOPS / (2 * size**3)))}
    seconds = _fastest(calls, often)
    new = flops / (seconds["new"] - seconds["copies"])
    dgemm = 2 * size**3 / seconds["dgemm"]
    error = _error(given, update, matrix, pivots)
    said = f"{flops / (seconds['old'] - seconds['old copies']) / 1e9:.1f}" if old else "–"
    return (
        f"| {pivots} + {rest} | {said} | {new / 1e9:.1f} | {dgemm / 1e9:.1f} | {new / dgemm:.2f}"
        f" | {error:.0e} |"
    )


def _fastest(calls: dict[str, Callable[[int], Any]], often: dict[str, int]) -> dict[str, float]:
    """CPU seconds of one of each, the least of many times that take turns."""
    least = dict.fromkeys(calls, np.inf)
    for _ in range(TIMES):
        for name, call in calls.items():
            started = time.process_time()
            call(often[name])
            least[name] = min(least[name], (time.process_time() - started) / often[name])
    return least


@njit
def _eliminations(front, given, update, pivots, rest, times):  # type: ignore[no-untyped-def]
    for _ in range(times):
        front[:] = given
        eliminate(front, 0, update, pivots, rest)


@njit
def _copies(to, given, times):  # type: ignore[no-untyped-def]
    for _ in range(times):
        to[:] = given
    return 0


@njit
def _products(a, b, c, times):  # type: ignore[no-untyped-def]
    for _ in range(times):
        np.dot(a, b, c)


def _older(path: Path) -> Any:
    """Eliminations by the kernel of an older revision, and the columns of its work space."""
    # from a copy: kernels are kept beside the file, and these are no others' to find
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(shutil.copy(path, folder))
        found = importlib.util.spec_from_file_location("older_elimination", copy)
        assert found is not None
        assert found.loader is not None
        module = importlib.util.module_from_spec(found)
        found.loader.exec_module(module)
        return _older_eliminations(module), module.COLUMNS


def _older_eliminations(module: Any) -> Any:
    old = njit(module.eliminate.py_func, fastmath=True)

    @njit
    def run(one, panel, two, others, work, how):  # type: ignore[no-untyped-def]
        size, pivots, times = how
        for _ in range(times):
            one[:] = panel
            two[:] = others
            old(one, two, work, size, pivots)

    # compiled while its file is there
    run(np.ones(1), np.ones(1), np.empty(0), np.empty(0), np.empty(module.COLUMNS), (1, 1, 1))
    return run


def in_chunks(matrix: Any, pivots: int) -> tuple[Any, int]:
    """A front as `eliminate` takes it, at an address that is a multiple of 64 bytes, and where its
    update begins."""
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
    return front, panel.size


def _height(pivots: int) -> int:
    return -(-pivots // 4) * 4 if pivots <= PANEL else -(-pivots // 8) * 8


def _error(given: Any, update: int, matrix: Any, pivots: int) -> float:
    """max|LLᵀ − A| / max|A| over the rows that are eliminated."""
    front, size = given.copy(), len(matrix)
    assert eliminate(front, 0, update, pivots, size - pivots)
    wide, height = -(-pivots // 8), _height(pivots)
    rows = front[:update].reshape(-1, height, 8).transpose(1, 0, 2).reshape(height, -1)
    upper = np.triu(rows[:pivots, :pivots])
    np.fill_diagonal(upper, 1 / np.diag(upper))
    beside = rows[:pivots, 8 * wide : 8 * wide + size - pivots]
    product = upper.T @ np.hstack([upper, beside])
    assert np.allclose(upper, cholesky(matrix[:pivots, :pivots]))
    return float(np.abs(product - matrix[:pivots]).max() / np.abs(matrix).max())
