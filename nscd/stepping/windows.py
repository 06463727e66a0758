"""Impulses over windows of time: what a pair or a wall received, never the force of one step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscd.arrays import Flags, Floats, Indices
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


class WindowSums:
    """Sum the percussions of steps contact by contact until the window is closed."""

    def __init__(self, n: int, start: float = 0.0) -> None:
        self._n = n
        self._start = start
        self._parts: list[tuple[Indices, Floats, Floats]] = []

    def add(self, near: Neighbours, reaction: Floats, friction: Floats | None = None) -> None:
        """Add the reactions, and frictions along (−n_y, n_x), (k,) N·s of one step at its
        neighbours."""
        pressed = np.flatnonzero(reaction > 0)
        first = near.first[pressed].astype(np.int64)
        other = np.where(
            near.wall[pressed] >= 0, self._n + near.wall[pressed], near.second[pressed]
        )
        normal = near.normal[pressed]
        impulse = reaction[pressed][:, None] * normal
        if friction is not None:
            along = np.column_stack([-normal[:, 1], normal[:, 0]])
            impulse += friction[pressed][:, None] * along
        numbers = np.column_stack([normal, near.gap[pressed], impulse])
        self._parts.append((first, other.astype(np.int64), numbers))

    def close(self, end: float) -> WindowImpulses:
        """Give the impulses since the last window was closed (or the start); the next window
        begins."""
        first = np.concatenate([part[0] for part in self._parts] or [np.empty(0, np.int64)])
        other = np.concatenate([part[1] for part in self._parts] or [np.empty(0, np.int64)])
        numbers = np.concatenate([part[2] for part in self._parts] or [np.empty((0, 5))])
        # a disk is never its own neighbour, so the key is one of a pair or of a disk and a wall
        span = int(other.max(initial=0)) + 1
        keys, place, steps = np.unique(
            first * span + other, return_inverse=True, return_counts=True
        )
        impulse = np.zeros((len(keys), 2))
        np.add.at(impulse, place, numbers[:, 3:])
        last = np.empty(len(keys), np.int64)
        last[place] = np.arange(len(place))
        second = keys % span
        is_wall = second >= self._n
        window = WindowImpulses(
            first=keys // span,
            second=np.where(is_wall, second - self._n, second),
            is_wall=is_wall,
            normal=numbers[last, :2],
            gap=numbers[last, 2],
            impulse=impulse,
            steps=steps.astype(np.int64),
            duration=end - self._start,
            end=end,
        )
        self._parts, self._start = [], end
        return window
