"""Small crowds in one compiled call: from arrays to the certificate.

The steps are those of `climb` and `certify` without dissipation and without a guess."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from nscd.arrays import LARGEST, Floats
from nscd.bodies import Snapshot
from nscd.compiling import inner, kernel
from nscd.contacts import Contacts
from nscd.solvers.at_once import TINY, answer, nothing_near
from nscd.solvers.canonical import larger
from nscd.solvers.system import System, add_reactions, approach


class Small(NamedTuple):
    """Hold what the compiled call found.

    reaction: (k,) N·s, λ
    impulse: (k,2) N·s, λ n
    velocity: (n,2) m/s, u⁺
    rung, disks, iterations, least: as of `Chosen`
    velocity_error, residual, momentum_error: as of `Percussions`
    energy, change, work: J, ½u⁻·Mu⁻, ½u⁺·Mu⁺ − ½u⁻·Mu⁻ and p·D(u⁺+u⁻)"""

    reaction: Any
    impulse: Any
    velocity: Any
    rung: int
    disks: int
    iterations: int
    least: bool
    velocity_error: float
    residual: float
    momentum_error: float
    energy: float
    change: float
    work: float


class Certified(NamedTuple):
    """Hold what an answer says of itself: see `Small`.

    finite: whether every number is"""

    impulse: Any
    velocity_error: float
    residual: float
    momentum_error: float
    energy: float
    change: float
    work: float
    finite: bool


def solve_small(
    snapshot: Snapshot, contacts: Contacts, left: Floats, tolerance: float, canonical: bool
) -> Small | None:
    """Solve k ≥ 1 contacts without dissipation for a left velocity (n,2) m/s.

    canonical: whether λ is to be the one of least energy where it is not unique

    None where the ladder is to give the answer, or to refuse to: where a contact names no disk, a
    velocity is no number of at most 10¹⁰⁰, the error is beyond the tolerance, or what underflowed
    was to be divided by."""
    try:
        answered, *found = _solve(
            contacts.first, contacts.second, contacts.is_wall, contacts.normal, snapshot.mass, left,
            tolerance, canonical,
        )  # fmt: skip
    except ZeroDivisionError:
        return None
    return Small(*found) if answered else None


@kernel
def _solve(
    first: Any, second: Any, is_wall: Any, normal: Any, mass: Any, left: Any, tolerance: float,
    least: Any,
) -> Any:  # fmt: skip
    """Whether this is an answer, and a `Small`, as a plain tuple, which reaches Python sooner."""
    k, n = len(first), len(mass)
    sound = True
    for c in range(k):
        sound = sound and first[c] < n and (second[c] < n or is_wall[c])
    for i in range(n):
        for a in range(2):
            sound = sound and abs(left[i, a]) <= LARGEST
    if not sound:
        none, nothing = np.empty(0), np.empty((0, 2))
        return False, none, nothing, nothing, 0, 0, 0, False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    whole = system_at(first, second, is_wall, normal, mass, left, np.zeros(k))
    reaction, velocity, chosen = answer(whole, nothing_near(), tolerance, least, np.bool_(True))
    said = certified(whole, reaction, velocity, chosen.bound)
    answered = said.finite and max(said.residual, said.momentum_error) <= tolerance
    return (
        answered, reaction, said.impulse, velocity, chosen.rung, chosen.disks, chosen.iterations,
        chosen.least, said.velocity_error, said.residual, said.momentum_error, said.energy,
        said.change, said.work,
    )  # fmt: skip


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


@kernel(apart=True)
def certified(system: Any, reaction: Any, velocity: Any, bound: float) -> Any:
    """Recompute what an answer says of itself, from its reactions and velocities."""
    n, k = len(velocity), len(reaction)
    v, momentum, size, impulse = np.empty(k), np.zeros((n, 2)), np.zeros(n), np.empty((k, 2))
    approach(system, velocity, v)
    residual, finite = 0.0, True
    for c in range(k):
        residual = larger(
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
            error = larger(error, off / (m * system.scale + size[i]))
            energy += 0.5 * m * before * before
            change += 0.5 * m * (after - before) * (after + before)
            total[i, a] = after + before
    approach(system, total, v)
    work = 0.0
    for c in range(k):
        work += reaction[c] * v[c]
    finite = finite and math.isfinite(residual + error + energy + change + work + bound)
    return Certified(
        impulse,
        bound / math.sqrt(mass),
        residual / system.scale,
        error,
        energy,
        change,
        work,
        finite,
    )
