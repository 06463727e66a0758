"""Projected Gauss–Seidel: what the field uses; kept as the baseline, with its known slow
contraction."""

from __future__ import annotations

from typing import Any

import numpy as np

from nscd.compiling import kernel
from nscd.solvers.task import Answer, Task

MOST_SWEEPS = 200_000
# The solver stops a little before the tolerance, so that rounding does not carry it beyond.
MARGIN = 0.9


def gauss_seidel(task: Task) -> Answer:
    """Sweep over the contacts of a crowd without dissipation until the residual is within the
    tolerance.

    Contact by contact λ ← max(0, λ + (Cu − b)/w), with u updated at once. On a chain of n disks
    against a wall it contracts by cos²(π/(2n)) a sweep."""
    task.refuse_dissipation("gauss_seidel")
    system = task.system
    reaction, velocity, sweeps = _sweep(system, MARGIN * task.tolerance * system.scale, MOST_SWEEPS)
    return task.answer(reaction, velocity, int(sweeps))


@kernel
def _sweep(system: Any, tolerance: float, most: int) -> Any:
    first, second, normal, mass = system.first, system.second, system.normal_first, system.mass
    free, offset, w = system.free, system.offset, system.inverse_mass
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
