"""Impulses over windows of time: what a pair or a wall received, never the force of one step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from nscd.arrays import Flags, Floats, Indices
from nscd.compiling import inner, kernel
from nscd.stepping.search import Neighbours


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WindowImpulses:
    """Hold the impulses of one window, of all that were pressed in it; f = impulse/duration.

    first: (m,) disk
    second: (m,) disk, or wall where is_wall (m,)
    normal, gap: (m,2) unit vector and (m,) m, of the last step in which the contact was pressed
    impulse: (m,2) N·s, of the first on the second
    steps: (m,) in how many steps it was pressed
    duration, end: s"""

    first: Indices
    second: Indices
    is_wall: Flags
    normal: Floats
    gap: Floats
    impulse: Floats
    steps: Indices
    duration: float
    end: float


class _Table(NamedTuple):
    """Places for contacts by open addressing; key (m,) is EMPTY where nobody is.

    count: (m,) steps in which it was pressed
    number: (m,5) normal and gap of the last of them, and the impulse"""

    key: Any
    count: Any
    number: Any


EMPTY = -1


def _empty(places: int) -> _Table:
    """A table of so many places, a power of two."""
    return _Table(
        np.full(places, EMPTY, np.int64), np.zeros(places, np.int64), np.zeros((places, 5))
    )


class WindowSums:
    """Sum the percussions of steps contact by contact until the window is closed."""

    def __init__(self, n: int, start: float = 0.0) -> None:
        self._n = n
        self._start = start
        self._used = 0
        self._table = _empty(1024)

    def add(self, near: Neighbours, reaction: Floats, friction: Floats | None = None) -> None:
        """Add the reactions, and frictions along (−n_y, n_x), (k,) N·s of one step at its
        neighbours."""
        places = len(self._table.key)
        while 2 * (self._used + len(reaction)) > places:
            places *= 2
        if places > len(self._table.key):
            old, self._table = self._table, _empty(places)
            _move(old, self._table)
        across = np.empty(0) if friction is None else friction
        self._used = _add(self._table, self._used, self._n, near, reaction, across)

    def close(self, end: float) -> WindowImpulses:
        """Give the impulses since the last window was closed (or the start); the next window
        begins."""
        table = self._table
        kept = np.flatnonzero(table.key != EMPTY)
        kept = kept[np.argsort(table.key[kept])]
        first, second = table.key[kept] >> BITS, table.key[kept] & ((1 << BITS) - 1)
        is_wall = second >= self._n
        number = table.number[kept]
        window = WindowImpulses(
            first=first,
            second=np.where(is_wall, second - self._n, second),
            is_wall=is_wall,
            normal=number[:, :2],
            gap=number[:, 2],
            impulse=number[:, 3:],
            steps=table.count[kept],
            duration=end - self._start,
            end=end,
        )
        self._table, self._used, self._start = _empty(len(table.key)), 0, end
        return window


# A disk, and the other disk or the wall behind all disks, are one number.
BITS = 31


@inner
def _place(key: Any, name: Any) -> int:
    """Where a name is, or would be."""
    last = len(key) - 1
    place = int((name ^ (name >> BITS) * 40503) * 40503 >> 7) & last
    while key[place] != EMPTY and key[place] != name:
        place = (place + 1) & last
    return place


@kernel
def _move(old: Any, new: Any) -> None:
    for a in range(len(old.key)):
        if old.key[a] != EMPTY:
            b = _place(new.key, old.key[a])
            new.key[b], new.count[b] = old.key[a], old.count[a]
            new.number[b] = old.number[a]


@kernel
def _add(table: Any, used: int, n: int, near: Any, reaction: Any, friction: Any) -> int:
    """Add a step to a table that has room; return how many places are used."""
    for c in range(len(reaction)):
        if not reaction[c] > 0.0:
            continue
        other = n + near.wall[c] if near.wall[c] >= 0 else near.second[c]
        name = (np.int64(near.first[c]) << BITS) | np.int64(other)
        place = _place(table.key, name)
        used += table.key[place] == EMPTY
        x, y, number = near.normal[c, 0], near.normal[c, 1], table.number[place]
        across = friction[c] if len(friction) else 0.0
        table.key[place] = name
        table.count[place] += 1
        number[0], number[1], number[2] = x, y, near.gap[c]
        number[3] += reaction[c] * x - across * y
        number[4] += reaction[c] * y + across * x
    return used
