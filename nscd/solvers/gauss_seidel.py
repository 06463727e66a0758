"""Projected Gauss–Seidel: what the field uses; kept as the baseline, with its known slow
contraction."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from nscd.solvers.system import System

CHECK = 10


def gauss_seidel(system: System, tolerance: float, most: int = 200_000) -> tuple[Any, Any, int]:
    """Reactions λ ≥ 0 (k,) N·s, velocities (n,2) in elimination order, and sweeps, to natural-map
    residual ≤ tolerance.

    Contact by contact λ ← max(0, λ + (Cu − b)/w), with u updated at once. On a chain of n disks
    against a wall it contracts by cos²(π/(2n)) a sweep."""
    reaction, velocity, sweeps = _sweep(
        system.first, system.second, system.normal_first, system.mass, system.free, system.offset, system.inverse_mass,
        tolerance * system.scale, most,
    )  # fmt: skip
    return reaction, velocity, int(sweeps)


@njit(cache=True)
def _sweep(
    first: Any,
    second: Any,
    normal: Any,
    mass: Any,
    free: Any,
    offset: Any,
    w: Any,
    tolerance: float,
    most: int,
) -> Any:
    k = len(first)
    reaction, u = np.zeros(k), free.copy()
    for sweep in range(1, most + 1):
        error = 0.0
        for c in range(k):
            i, j = first[c], second[c]
            x, y = normal[c, 0], normal[c, 1]
            v = x * u[i, 0] + y * u[i, 1] - offset[c]
            if j >= 0:
                v -= x * u[j, 0] + y * u[j, 1]
            error = max(error, abs(min(w[c] * reaction[c], -v)))
            change = max(reaction[c] + v / w[c], 0.0) - reaction[c]
            if change == 0.0:
                continue
            reaction[c] += change
            u[i, 0] -= x * change / mass[i, 0]
            u[i, 1] -= y * change / mass[i, 0]
            if j >= 0:
                u[j, 0] += x * change / mass[j, 0]
                u[j, 1] += y * change / mass[j, 0]
        # the error was measured along the sweep; where it is small the whole is measured before
        # stopping
        if error <= tolerance:
            worst = 0.0
            for c in range(k):
                i, j = first[c], second[c]
                v = normal[c, 0] * u[i, 0] + normal[c, 1] * u[i, 1] - offset[c]
                if j >= 0:
                    v -= normal[c, 0] * u[j, 0] + normal[c, 1] * u[j, 1]
                worst = max(worst, abs(min(w[c] * reaction[c], -v)))
            if worst <= tolerance:
                return reaction, u, sweep
    return reaction, u, most
