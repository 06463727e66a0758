"""Small crowds in one compiled call: from arrays to the certificate.

The steps are those of `climb` and `certify` for even masses without dissipation: islands, closed
forms, descent, active set, bound. What needs another rung is left to them."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from nscd.arrays import Floats
from nscd.bodies import Snapshot
from nscd.compiling import inner, kernel
from nscd.contacts import Contacts
from nscd.solvers.active_set import ROUNDS, _rounds
from nscd.solvers.cholesky.factor import factor_by_rows
from nscd.solvers.closed_form import answer_at_once
from nscd.solvers.closing import CLOSED, PENALTY
from nscd.solvers.projected_gradient import descend
from nscd.solvers.system import EVEN, System, add_reactions, approach
from nscd.solvers.task import Held
from nscd.solvers.thresholds import AT
from nscd.solvers.velocity_error import _by_factor

SWEEPS, STEADY, STEADY_SHARE = AT.few_sweeps, AT.steady, AT.steady_share
ISOSTATIC, REDUNDANT = AT.isostatic, AT.redundant
# To this share of the tolerance contacts are closed where no bound of the error is asked for.
SHARE_OF_TOLERANCE = 1e-3
# How a call ends.
SOLVED, OTHER, UNSETTLED = 0, 1, 2


class Small(NamedTuple):
    """Hold what the compiled call found.

    end: SOLVED; OTHER, where another rung serves, or a contact names no disk; UNSETTLED, where one is
        to start from here
    reaction: (k,) N·s, λ
    impulse: (k,2) N·s, λ n
    velocity: (n,2) m/s, u⁺
    disks: how many of them were not answered in closed form
    iterations: sweeps and rounds
    velocity_error, residual, momentum_error: as of `Percussions`
    energy, change, work: J, ½u⁻·Mu⁻, ½u⁺·Mu⁺ − ½u⁻·Mu⁻ and p·D(u⁺+u⁻)
    finite: whether every number is"""

    end: int
    reaction: Any
    impulse: Any
    velocity: Any
    disks: int
    iterations: int
    velocity_error: float
    residual: float
    momentum_error: float
    energy: float
    change: float
    work: float
    finite: bool


def solve_small(
    snapshot: Snapshot, contacts: Contacts, left: Floats, tolerance: float
) -> Small | None:
    """Solve k ≥ 1 contacts without dissipation for a left velocity (n,2) m/s.

    None where what underflowed was to be divided by."""
    try:
        small: Small = _solve(
            contacts.first, contacts.second, contacts.is_wall, contacts.normal, snapshot.mass, left, tolerance
        )  # fmt: skip
    except ZeroDivisionError:
        return None
    return small


@kernel
def _solve(
    first: Any, second: Any, is_wall: Any, normal: Any, mass: Any, left: Any, tolerance: float
) -> Any:
    k, n = len(first), len(mass)
    for c in range(k):
        if first[c] >= n or (second[c] >= n and not is_wall[c]):
            return _ended(OTHER, np.zeros(k), np.zeros((n, 2)), 0)
    whole = system_at(first, second, is_wall, normal, mass, left, np.zeros(k))
    end, reaction, velocity, disks, iterations, bound = reactions_of(
        whole, tolerance, np.bool_(True)
    )
    if end == SOLVED:
        return certified(whole, reaction, velocity, disks, iterations, bound)
    return _ended(end, reaction, velocity, iterations)


@inner(apart=True)
def reactions_of(whole: Any, tolerance: float, bounded: Any) -> Any:
    """Solve a system: how it ended, λ (k,), u⁺ (n,2), disks that were not answered in closed form,
    iterations, and where `bounded` √(Σ m |u − u⁺|²) at most (offsets are then to be 0)."""
    reaction, velocity = np.zeros(len(whole.first)), whole.free.copy()
    bound, rest, forest = answer_at_once(whole, reaction, velocity, bounded)
    end, iterations = SOLVED, 0
    if len(rest.contact):
        part = _part(whole, rest)
        w = part.inverse_mass
        if forest or w.max() > EVEN * w.min():
            end = OTHER
        else:
            end, iterations, own = _descend_and_close(
                part, rest, tolerance, bounded, reaction, velocity
            )
            bound = math.sqrt(bound * bound + own * own)
    return end, reaction, velocity, len(rest.disk), iterations, bound


@inner
def _ended(end: int, reaction: Any, velocity: Any, iterations: int) -> Any:
    """An answer that is none, but a start for another rung."""
    none = np.empty((0, 2))
    return Small(end, reaction, none, velocity, 0, iterations, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, False)


@inner(apart=True)
def system_at(
    first: Any, second: Any, is_wall: Any, normal: Any, mass: Any, left: Any, offset: Any
) -> Any:
    """State the whole problem, as the kernels take it."""
    k, n = len(first), len(mass)
    i, j, w = np.empty(k, np.int32), np.empty(k, np.int32), np.empty(k)
    there, back, none = np.empty((k, 2)), np.empty((k, 2)), np.zeros(k)
    for c in range(k):
        i[c], j[c] = first[c], -1 if is_wall[c] else second[c]
        w[c] = 1.0 / mass[i[c]] + (0.0 if is_wall[c] else 1.0 / mass[j[c]])
        for a in range(2):
            there[c, a], back[c, a] = normal[c, a], -normal[c, a]
    heavy, free, speed = np.empty((n, 2)), np.empty((n, 2)), 0.0
    for b in range(n):
        for a in range(2):
            heavy[b, a], free[b, a] = mass[b], left[b, a]
            speed = max(speed, abs(left[b, a]))
    scale = max(speed, TINY)
    return System(i, j, there, back, there, back, none, none, heavy, free, offset, w, scale)


TINY = float(np.finfo(float).tiny)


@inner
def _part(whole: Any, rest: Any) -> Any:
    """The problem of the contacts that are left, in the order in which they were given."""
    m, n = len(rest.contact), len(rest.disk)
    i, j, w, none = np.empty(m, np.int32), np.empty(m, np.int32), np.empty(m), np.zeros(m)
    offset = whole.offset[rest.contact]
    there, back, heavy, free = (
        np.empty((m, 2)), np.empty((m, 2)), np.empty((n, 2)), np.empty((n, 2)),
    )  # fmt: skip
    for r in range(m):
        c = rest.contact[r]
        i[r], w[r] = rest.number[whole.first[c]], whole.inverse_mass[c]
        j[r] = rest.number[whole.second[c]] if whole.second[c] >= 0 else -1
        for a in range(2):
            there[r, a], back[r, a] = whole.normal_first[c, a], whole.normal_second[c, a]
    speed = TINY
    for b in range(n):
        for a in range(2):
            heavy[b, a], free[b, a] = whole.mass[rest.disk[b], a], whole.free[rest.disk[b], a]
            speed = max(speed, abs(free[b, a]))
    return System(i, j, there, back, there, back, none, none, heavy, free, offset, w, speed)


@inner
def _ordered(part: Any, factor: Any) -> Any:
    """The same problem in elimination order."""
    there, back = part.normal_first[factor.contact], part.normal_second[factor.contact]
    i, j = factor.place[part.first[factor.contact]], part.second[factor.contact]
    for c in range(len(j)):
        if j[c] >= 0:
            j[c] = factor.place[j[c]]
    none = part.normal_weight
    return System(
        i, j, there, back, there, back, none, none, part.mass[factor.order], part.free[factor.order],
        part.offset[factor.contact], part.inverse_mass[factor.contact], part.scale,
    )  # fmt: skip


@inner(inline="always")
def _descend_and_close(
    part: Any, rest: Any, tolerance: float, bounded: bool, reaction: Any, velocity: Any
) -> Any:
    """Put λ and u⁺ of what is left among the others; how it ended, iterations, bound of the error.
    See `descend_and_close`."""
    n, k = len(part.mass), len(part.first)
    factor = factor_by_rows(n, part.first, part.second)
    system = _ordered(part, factor)
    steady = STEADY + int(STEADY_SHARE * k)
    pushed, u, iterations, settled = descend(system, tolerance, np.int64(SWEEPS), steady, ISOSTATIC)
    closed, v, count = np.empty(k, np.bool_), np.empty(k), 0
    approach(system, u, v)
    for c in range(k):
        closed[c] = system.inverse_mass[c] * pushed[c] > system.offset[c] - v[c]
        count += closed[c]
    share = count / (2 * n)
    end, bound = UNSETTLED, 0.0
    if (settled or share >= REDUNDANT) and not ISOSTATIC < share < REDUNDANT:
        theta = np.full(k, PENALTY * (1.0 / system.inverse_mass.max()))
        # contacts of a step need not be closed to rounding
        enough = CLOSED if bounded else max(CLOSED, SHARE_OF_TOLERANCE * tolerance)
        # numbers of NumPy: a literal would compile the kernel once more
        better, moved, done, error, exact = _rounds(
            system, factor, closed, theta, np.int64(ROUNDS), np.bool_(False), enough
        )
        iterations += done
        if exact and error <= tolerance:
            end, pushed, u = SOLVED, better, moved
            for c in range(k):
                theta[c] = theta[c] if closed[c] else 0.0
            if bounded:
                held, given = Held(theta, closed), np.empty((0, 2))
                square = _by_factor(system, factor, given, pushed, u, held, np.bool_(False))
                bound = math.sqrt(square)
    for c in range(k):
        reaction[rest.contact[factor.contact[c]]] = pushed[c]
    for i in range(n):
        for a in range(2):
            velocity[rest.disk[factor.order[i]], a] = u[i, a]
    return end, iterations, bound


@inner
def _larger(a: float, b: float) -> float:
    """The larger of two, or the one that is no number."""
    return a if a >= b or a != a else b


@inner(apart=True)
def certified(
    system: Any, reaction: Any, velocity: Any, disks: int, iterations: int, bound: float
) -> Any:
    """Recompute what an answer says of itself, from its reactions and velocities."""
    n, k = len(velocity), len(reaction)
    v, momentum, size, impulse = np.empty(k), np.zeros((n, 2)), np.zeros(n), np.empty((k, 2))
    approach(system, velocity, v)
    residual, finite = 0.0, True
    for c in range(k):
        residual = _larger(
            residual, abs(min(system.inverse_mass[c] * reaction[c], system.offset[c] - v[c]))
        )
        finite = finite and math.isfinite(reaction[c])
        size[system.first[c]] += abs(reaction[c])
        if system.second[c] >= 0:
            size[system.second[c]] += abs(reaction[c])
        for a in range(2):
            impulse[c, a] = reaction[c] * system.normal_first[c, a]
    add_reactions(system, reaction, 1.0, momentum)
    error = energy = change = mass = 0.0
    total = np.empty((n, 2))
    for i in range(n):
        m = system.mass[i, 0]
        mass += m
        for a in range(2):
            before, after = system.free[i, a], velocity[i, a]
            finite = finite and math.isfinite(after)
            off = abs(m * (after - before) + momentum[i, a])
            error = _larger(error, off / (m * system.scale + size[i]))
            energy += 0.5 * m * before * before
            change += 0.5 * m * (after - before) * (after + before)
            total[i, a] = after + before
    approach(system, total, v)
    work = 0.0
    for c in range(k):
        work += reaction[c] * v[c]
    return Small(
        SOLVED, reaction, impulse, velocity, disks, iterations, bound / math.sqrt(mass),
        residual / system.scale, error, energy, change, work, finite,
    )  # fmt: skip
