"""A step without friction in one compiled call: neighbours, restitution, solution, certificate.

What it does not solve is left to the ladder of solvers."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.compiling import inner, kernel
from nscd.solvers.at_once import CLOSED_FORM, Chosen, answer, nothing_near
from nscd.solvers.projected_gradient import MARGIN, MOST_SWEEPS, descend
from nscd.solvers.small import certified, system_at
from nscd.solvers.system import System, approach
from nscd.stepping.search import Neighbours, find

# Accelerated gradient serves from this tolerance on: the exact solvers are for tighter ones.
LOOSE = 1e-6
# What gave the answer where no rung of the ladder did.
GRADIENT = -1
# A step is repeated so often, at most, with a larger margin.
REPEATS = 20
# Disks are taken to be faster than before by this share of the fastest one.
LIKELY = 0.01


class Bodies(NamedTuple):
    """Hold what a step moves, as the kernels take it.

    position, velocity: (n,2) m, m/s
    free: (n,2) m/s, the velocities without contacts
    radius: (n,) m
    mass: (n,) kg, with what the drive adds
    segments: the walls"""

    position: Any
    velocity: Any
    free: Any
    radius: Any
    mass: Any
    segments: Any


class Stepped(NamedTuple):
    """Hold what a step found.

    neighbours: its k candidates for contact
    reaction: (k,) N·s
    velocity: (n,2) m/s, u⁺
    error: dimensionless, the residual or the imbalance of momentum, recomputed
    iterations: of the solver
    rung: what gave the answer, of the numbers of `nscd.solvers.at_once`, or GRADIENT
    repeats: how often contacts were missed"""

    neighbours: Neighbours
    reaction: Any
    velocity: Any
    error: float
    iterations: int
    rung: int
    repeats: int


@kernel
def stepped(bodies: Any, step: float, restitution: float, gained: float, tolerance: float) -> Any:
    """Make a step of `step` s without friction; a contact that closed no faster than
    twice `gained` m/s, what the drive gives in a step, does not rebound."""
    margin = 2.0 * step * max(fastest(bodies.free), fastest(bodies.velocity))
    repeats = -1
    while True:
        repeats += 1
        near = find(bodies.position, bodies.radius, bodies.segments, margin)
        if len(near.gap) == 0:
            return Stepped(near, near.gap, bodies.free.copy(), 0.0, 0, CLOSED_FORM, repeats)
        system = system_at(
            near.first, near.second, near.wall >= 0, near.normal, bodies.mass, bodies.free, near.gap / step
        )  # fmt: skip
        if restitution > 0.0:
            _rebound(system, bodies.velocity, restitution, gained)
        reaction, velocity, sweeps, rung, error = _solved(system, bodies.velocity, tolerance)
        needed = 2.0 * step * fastest(velocity)
        if repeats == REPEATS or not missed(bodies, velocity, step, margin):
            return Stepped(near, reaction, velocity, error, sweeps, rung, repeats)
        margin = needed


@kernel
def missed(bodies: Any, velocity: Any, step: float, margin: float) -> bool:
    """Tell whether velocities (n,2) m/s would close within a step (s) a gap beyond the margin (m)
    within which contacts were looked for."""
    needed = 2.0 * step * fastest(velocity)
    if needed <= margin:
        return False
    near = find(bodies.position, bodies.radius, bodies.segments, needed)
    for c in range(len(near.gap)):
        i, j = near.first[c], near.second[c]
        x, y = velocity[i, 0], velocity[i, 1]
        if j >= 0:
            x, y = x - velocity[j, 0], y - velocity[j, 1]
        closing = step * (near.normal[c, 0] * x + near.normal[c, 1] * y)
        if near.gap[c] > margin and closing > near.gap[c]:
            return True
    return False


@kernel
def freed(velocity: Any, desired: Any, share: float, gain: Any) -> Any:
    """Velocities (n,2) m/s after a step without contacts, (u + g + a u_d)/(1 + a), and the largest
    component (m/s) of what they gained. Where nobody drives, desired is empty."""
    free, most = np.empty_like(velocity), 0.0
    for i in range(len(velocity)):
        for a in range(2):
            free[i, a] = velocity[i, a] + gain[a]
            if len(desired):
                free[i, a] = (free[i, a] + share * desired[i, a]) / (1.0 + share)
            most = max(most, abs(free[i, a] - velocity[i, a]))
    return free, most


@inner(inline="always")
def _solved(system: Any, before: Any, tolerance: float) -> Any:
    """λ (k,), u⁺ (n,2), iterations, what gave them and error: first without the contacts that disks as
    fast as before could not close; with all of them where that is not the answer of all."""
    # numbers of NumPy: a literal would compile a kernel once more
    k, error, sweeps, rung = len(system.first), 0.0, 0, CLOSED_FORM
    reaction, velocity = np.zeros(k), system.free
    for attempt in range(2):
        chosen = _likely(system, before) if attempt == 0 else np.arange(k)
        part = _restricted(system, chosen)
        if len(chosen) == 0:
            continue
        if tolerance >= LOOSE:
            pushed, velocity, done, _ = descend(
                part, MARGIN * tolerance, np.int64(MOST_SWEEPS), np.int64(-1), np.inf
            )
            by = Chosen(GRADIENT, len(velocity), done, False, 0.0)
        else:
            pushed, velocity, by = answer(
                part, nothing_near(), tolerance, np.bool_(False), np.bool_(False)
            )
        sweeps, rung = sweeps + by.iterations, by.rung
        reaction = np.zeros(k)
        reaction[chosen] = pushed
        found = certified(system, reaction, velocity, 0.0)
        error = max(found.residual, found.momentum_error) if found.finite else np.inf
        if error <= tolerance:
            break
    return reaction, velocity, sweeps, rung, error


@inner
def _likely(system: Any, before: Any) -> Any:
    """The contacts whose gap two disks close that go towards each other as fast as before, or as
    without contacts."""
    n, slack = len(before), LIKELY * system.scale
    speed = np.empty(n)
    for i in range(n):
        free = np.hypot(system.free[i, 0], system.free[i, 1])
        speed[i] = max(np.hypot(before[i, 0], before[i, 1]), free)
    chosen, count = np.empty(len(system.first), np.int64), 0
    for c in range(len(chosen)):
        i, j = system.first[c], system.second[c]
        closing = speed[i] + (speed[j] if j >= 0 else 0.0)
        if system.offset[c] <= closing + slack:
            chosen[count] = c
            count += 1
    return chosen[:count]


@inner
def _restricted(system: Any, chosen: Any) -> Any:
    """The system of some of its contacts."""
    s = system
    none = s.normal_weight[chosen]
    there, back = s.normal_first[chosen], s.normal_second[chosen]
    return System(
        s.first[chosen], s.second[chosen], there, back, there, back, none, none, s.mass, s.free,
        s.offset[chosen], s.inverse_mass[chosen], s.scale,
    )  # fmt: skip


@kernel
def fastest(velocity: Any) -> float:
    """Find the largest speed (m/s) of velocities (n,d), spins left out."""
    square = 0.0
    for i in range(len(velocity)):
        square = max(square, velocity[i, 0] ** 2 + velocity[i, 1] ** 2)
    return float(np.sqrt(square))


@inner
def _rebound(system: Any, velocity: Any, restitution: float, gained: float) -> None:
    """C u⁺ ≤ −e v⁻ for contacts that close within the step with v⁻ > 2 `gained`."""
    k = len(system.first)
    before, closing = np.empty(k), np.empty(k)
    approach(system, velocity, before)
    approach(system, system.free, closing)
    for c in range(k):
        if closing[c] >= system.offset[c] and before[c] > max(2.0 * gained, 0.0):
            system.offset[c] = min(system.offset[c], -restitution * before[c])
