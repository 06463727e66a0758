"""Impulses over windows of time: what a pair or a wall received, never the force of one step."""

from dataclasses import dataclass

import numpy as np

from nscd import _core
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
        self._sums = _core.WindowSums(n)

    def add(self, near: Neighbours, reaction: Floats, friction: Floats | None = None) -> None:
        """Add the reactions, and frictions along (−n_y, n_x), (k,) N·s of one step at its
        neighbours."""
        self._sums.add(*near, reaction, friction)

    def close(self, end: float) -> WindowImpulses:
        """Give the impulses since the last window was closed (or the start); the next window
        begins."""
        first, second, normal, gap, impulse, steps = self._sums.close()
        is_wall = second >= self._n
        window = WindowImpulses(
            first=first,
            second=np.where(is_wall, second - self._n, second),
            is_wall=is_wall,
            normal=normal,
            gap=gap,
            impulse=impulse,
            steps=steps,
            duration=end - self._start,
            end=end,
        )
        self._start = end
        return window
