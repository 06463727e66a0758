"""What a crowd is at one instant: disks and straight walls."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from nscd.arrays import Floats, Indices, read_only
from nscd.segments import nearest_on_segment

_NO_IDS: Indices = np.empty(0, dtype=np.int64)
_NO_SPIN: Floats = np.empty(0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Snapshot:
    """Disks at one instant.

    position (n,2) m; velocity (n,2) m/s; radius (n,) m; mass (n,) kg; ids (n,) the numbers that
    people have in the files (default 1…n); spin (n,) rad/s (default 0); time s; drive (n,2) N: the
    force with which each person walks, where it is known. The moment of inertia of a disk is m
    r²/2.

    Raises ValueError naming the field for a wrong shape, a non-finite value, a radius or mass that
    is not positive, or an id that occurs twice."""

    position: Floats
    velocity: Floats
    radius: Floats
    mass: Floats
    ids: Indices = field(default_factory=lambda: _NO_IDS)
    spin: Floats = field(default_factory=lambda: _NO_SPIN)
    time: float = 0.0
    drive: Floats | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "position", read_only(self.position, (-1, 2), "position"))
        n = len(self.position)
        put(self, "velocity", read_only(self.velocity, (n, 2), "velocity"))
        for name in ("radius", "mass"):
            values = read_only(getattr(self, name), (n,), name)
            if not (values > 0).all():
                row = int(np.argmin(values > 0))
                raise ValueError(
                    f"{name}: {values[row]:g} in row {row}; a disk needs a positive {name}"
                )
            put(self, name, values)
        put(
            self,
            "spin",
            read_only(np.zeros(n) if self.spin is _NO_SPIN else self.spin, (n,), "spin"),
        )
        if self.drive is not None:
            put(self, "drive", read_only(self.drive, (n, 2), "drive"))
        ids = np.array(np.arange(1, n + 1) if self.ids is _NO_IDS else self.ids, dtype=np.int64)
        if ids.shape != (n,) or len(np.unique(ids)) != n:
            raise ValueError("ids: one distinct integer a disk is needed")
        ids.flags.writeable = False
        put(self, "ids", ids)

    @property
    def inertia(self) -> Floats:
        """Moment of inertia of each disk about its centre, m r²/2 (kg m²), shape (n,)."""
        inertia: Floats = 0.5 * self.mass * self.radius**2
        return inertia

    def __len__(self) -> int:
        return len(self.radius)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Walls:
    """Straight fixed walls without thickness: start (w,2) m, end (w,2) m. A door is the space
    between two.

    Raises ValueError naming the field for a wrong shape, a non-finite value or a wall of no length.
    """

    start: Floats
    end: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", read_only(self.start, (-1, 2), "start"))
        object.__setattr__(self, "end", read_only(self.end, (len(self.start), 2), "end"))
        length = np.hypot(*(self.end - self.start).T)
        if (length == 0).any():
            raise ValueError(f"end: wall {int(np.argmin(length))} has no length")

    def __len__(self) -> int:
        return len(self.start)

    def nearest_point(self, position: Floats, wall: Indices) -> Floats:
        """The point of wall number wall[i] that is nearest to position[i]; shapes (k,2), (k,) →
        (k,2) m."""
        return nearest_on_segment(position, self.start[wall], self.end[wall])
