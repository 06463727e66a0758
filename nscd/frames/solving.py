"""Many snapshots in one compiled call: contacts, percussions and certificate of each, with the help
of the one before.

What a frame gives does not depend on the others but for rounding. A frame that is not answered here
is left to `find_contacts` and `solve`, which say why."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.bodies import Walls
from nscd.compiling import inner, kernel
from nscd.contacts import connected
from nscd.frames.touching import touch
from nscd.solvers.at_once import Near, answer, nothing_near
from nscd.solvers.small import certified, system_at

# There is room for so many contacts of a disk: not more than three are its own where none overlap.
MOST = 4
# The answer of the frame before helps where it has this share of the contacts.
ALIKE = 0.8
# A key has the id of the first disk so many times, and keys of walls are behind those of pairs.
NUMBERS, WALL = 1 << 31, 1 << 62
NO_WALLS = Walls(start=np.empty((0, 2)), end=np.empty((0, 2)))


class Disks(NamedTuple):
    """Hold the n disks of f frames, one frame behind the other.

    start: (f+1,) the first of each frame, and the end
    ids: (n,) below 2³¹, rising in each frame
    position, left: (n,2) m, m/s: u⁻, magnitudes of at most 10¹⁰⁰
    radius, mass: (n,) m, kg, positive"""

    start: Any
    ids: Any
    position: Any
    left: Any
    radius: Any
    mass: Any


class Asked(NamedTuple):
    """Say what is asked.

    gap: m, up to which disks are in contact, see `find_contacts`
    deepest: share of the smaller radius; a frame with deeper overlaps is not answered
    tolerance: see `solve`
    canonical: see `Search`"""

    gap: float
    deepest: float
    tolerance: float
    canonical: bool = True


class Found(NamedTuple):
    """Hold the k contacts of f frames, one frame behind the other, and what they carry.

    start: (f+1,) the first of each frame, and the end
    answered: (f,) whether a frame is; one that is not has no contacts here
    first, second: (k,) among the disks of all frames; number of a wall where is_wall (k,)
    normal, gap: (k,2), (k,) m
    reaction, impulse: (k,), (k,2) N·s
    residual, velocity_error: (f,), m/s"""

    start: Any
    answered: Any
    first: Any
    second: Any
    is_wall: Any
    normal: Any
    gap: Any
    reaction: Any
    impulse: Any
    residual: Any
    velocity_error: Any


def solve_frames(disks: Disks, walls: Walls | None, asked: Asked) -> Found | None:
    """Solve contacts without dissipation, each frame for itself, with their certificate.

    None where something that underflowed was to be divided by. Other threads go on meanwhile."""
    walls = NO_WALLS if walls is None else walls
    far = max(float(np.abs(ends).max(initial=0.0)) for ends in (walls.start, walls.end))
    try:
        found = Found(*_solve_all(disks, connected(walls), far, asked))
    except ZeroDivisionError:
        return None
    k = int(found.start[-1])
    return found._replace(
        first=found.first[:k], second=found.second[:k], is_wall=found.is_wall[:k],
        normal=found.normal[:k], gap=found.gap[:k], reaction=found.reaction[:k],
        impulse=found.impulse[:k],
    )  # fmt: skip


@kernel(nogil=True)
def _solve_all(disks: Any, segments: Any, far: float, asked: Any) -> Any:
    frames = len(disks.start) - 1
    found = _room(frames, MOST * len(disks.ids) + 64)
    keys, near = np.empty(0, np.int64), nothing_near()
    before, end = 0, 0
    for f in range(frames):
        a, b = disks.start[f], disks.start[f + 1]
        ids, mass, left = disks.ids[a:b], disks.mass[a:b], disks.left[a:b]
        one = touch(disks.position[a:b], disks.radius[a:b], segments, far, asked)
        count = len(one.gap)
        found.answered[f] = one.sound and end + count <= len(found.gap)
        if found.answered[f] and count > 0:
            now = _keys(one, ids)
            guess = _guess(now, keys, ids, disks.ids[before:a], near, left)
            system = system_at(
                one.first, one.second, one.is_wall, one.normal, mass, left, np.zeros(count)
            )
            reaction, velocity, chosen = answer(
                system, guess, asked.tolerance, asked.canonical, np.bool_(True)
            )
            said = certified(system, reaction, velocity, chosen.bound)
            # reactions that are not known to be canonical may depend on the frame before
            known = chosen.least or not asked.canonical
            solved = said.finite and max(said.residual, said.momentum_error) <= asked.tolerance
            if solved and known:
                _put(found, f, end, one, reaction, said, a)
                end += count
                keys, near, before = now, Near(reaction, velocity), a
            else:
                found.answered[f] = False
        if before != a:
            near = nothing_near()
        found.start[f + 1] = end
    return (
        found.start, found.answered, found.first, found.second, found.is_wall, found.normal, found.gap,
        found.reaction, found.impulse, found.residual, found.velocity_error,
    )  # fmt: skip


@inner
def _keys(one: Any, ids: Any) -> Any:
    """A number of each contact, from the ids of who touches: rising, as the contacts do."""
    keys = np.empty(len(one.gap), np.int64)
    for c in range(len(keys)):
        other = WALL + one.second[c] if one.is_wall[c] else ids[one.second[c]]
        keys[c] = NUMBERS * ids[one.first[c]] + other
    return keys


@inner
def _guess(keys: Any, earlier: Any, ids: Any, others: Any, near: Any, left: Any) -> Near:
    """The answer of the frame before for the contacts and disks of this one; none where few were
    there."""
    reaction, velocity = np.zeros(len(keys)), left.copy()
    if not len(near.reaction):
        return nothing_near()
    at, same, largest = 0, 0, 0.0
    for c in range(len(keys)):
        while at < len(earlier) and earlier[at] < keys[c]:
            at += 1
        if at < len(earlier) and earlier[at] == keys[c]:
            reaction[c] = near.reaction[at]
            largest = max(largest, reaction[c])
            same += 1
    if same < ALIKE * len(keys) or largest == 0.0:
        return nothing_near()
    at = 0
    for i in range(len(ids)):
        while at < len(others) and others[at] < ids[i]:
            at += 1
        if at < len(others) and others[at] == ids[i]:
            for a in range(2):
                velocity[i, a] = near.velocity[at, a]
    return Near(reaction, velocity)


@inner
def _put(found: Any, f: int, end: int, one: Any, reaction: Any, said: Any, disk: int) -> None:
    """Put the contacts of frame f, whose first disk is `disk`, behind the others."""
    for c in range(len(reaction)):
        row = end + c
        found.first[row], found.is_wall[row] = disk + one.first[c], one.is_wall[c]
        found.second[row] = one.second[c] if one.is_wall[c] else disk + one.second[c]
        found.gap[row], found.reaction[row] = one.gap[c], reaction[c]
        for a in range(2):
            found.normal[row, a], found.impulse[row, a] = one.normal[c, a], said.impulse[c, a]
    found.residual[f], found.velocity_error[f] = said.residual, said.velocity_error


@inner
def _room(frames: int, most: int) -> Found:
    return Found(
        np.zeros(frames + 1, np.int64), np.zeros(frames, np.bool_), np.empty(most, np.int64),
        np.empty(most, np.int64), np.empty(most, np.bool_), np.empty((most, 2)), np.empty(most),
        np.empty(most), np.empty((most, 2)), np.zeros(frames), np.zeros(frames),
    )  # fmt: skip
