"""The machine that a benchmark ran on, in words, and its memory bandwidth."""

import os
import platform
import time
from importlib.metadata import PackageNotFoundError, version

import numpy as np

from analysis.support.machine import machine

PACKAGES = ("numpy", "scipy", "piqp", "clarabel", "osqp", "qoco", "cvxopt", "qpalm", "proxsuite")


def describe() -> str:
    """Processor, cores, memory, system and versions, in two lines."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1024**3
    found = [f"{name} {number}" for name in PACKAGES if (number := _version(name))]
    return (
        f"{machine()}, {memory:.0f} GiB, {platform.machine()}.\n"
        f"Python {platform.python_version()}, {', '.join(found)}."
    )


def bandwidth() -> float:
    """Bytes per second that one core moves in a += b over arrays beyond any cache, best of five."""
    size = 1 << 25
    a, b = np.zeros(size), np.ones(size)
    best = np.inf
    for _ in range(5):
        started = time.perf_counter()
        a += b
        best = min(best, time.perf_counter() - started)
    return 3 * 8 * size / best


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
