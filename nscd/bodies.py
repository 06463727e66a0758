"""What a crowd is at one instant: disks and straight walls."""

from dataclasses import dataclass, field

import numpy as np

from nscd.arrays import LARGEST, Floats, Indices, number, read_only, whole_numbers
from nscd.segments import nearest_on_segment

_NO_IDS: Indices = np.empty(0, dtype=np.int64)
_NO_SPIN: Floats = np.empty(0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Snapshot:
    """Hold n disks at one instant.

    position: (n,2) m
    velocity: (n,2) m/s
    radius: (n,) m
    mass: (n,) kg
    ids: (n,) the numbers that people have in the files; 1…n where left out
    spin: (n,) rad/s; 0 where left out
    time: s
    drive: (n,2) N, the force with which each person walks, where it is known

    Raises ValueError naming the field for a wrong shape, what is not a finite number, a magnitude
    beyond 10¹⁰⁰ (or masses and radii below its inverse), a radius or mass that is not positive, and
    ids that are not whole numbers or occur twice.

    >>> Snapshot(
    ...     position=[[0, 0], [0.5, 0]],
    ...     velocity=[[1, 0], [0, 0]],
    ...     radius=[0.25, 0.25],
    ...     mass=[75, 75],
    ... )
    <Snapshot: 2 disks at 0 s>"""

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
            put(self, name, _positive(getattr(self, name), n, name))
        spin = np.zeros(n) if self.spin is _NO_SPIN else self.spin
        put(self, "spin", read_only(spin, (n,), "spin"))
        put(self, "time", number(self.time, "time", "a finite number of seconds"))
        if self.drive is not None:
            put(self, "drive", read_only(self.drive, (n, 2), "drive"))
        ids = whole_numbers(np.arange(1, n + 1) if self.ids is _NO_IDS else self.ids, (n,), "ids")
        # sorting is left out where they rise, as in every dump
        if not (ids[1:] > ids[:-1]).all() and len(np.unique(ids)) != n:
            raise ValueError("ids: one distinct integer per disk is needed")
        put(self, "ids", ids)

    @property
    def inertia(self) -> Floats:
        """Compute (n,) kg m², the moment of inertia m r²/2 of each disk about its centre."""
        inertia: Floats = 0.5 * self.mass * self.radius**2
        return inertia

    def __len__(self) -> int:
        return len(self.radius)

    def __repr__(self) -> str:
        return f"<Snapshot: {len(self)} disks at {self.time:g} s>"


def _positive(value: Floats, n: int, name: str) -> Floats:
    values = read_only(value, (n,), name)
    if n and not values.min() >= 1 / LARGEST:
        row = int(np.argmin(values))
        why = f"a disk needs a positive {name}"
        if values[row] > 0:
            why = f"at least {1 / LARGEST:g} can be computed with"
        raise ValueError(f"{name}: {values[row]:g} in row {row}; {why}")
    return values


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Walls:
    """Hold w straight fixed walls without thickness. A door is the space between two.

    start, end: (w,2) m

    Raises ValueError naming the field for a wrong shape, what is not a finite number, a magnitude
    beyond 10¹⁰⁰, or a wall of no length.

    >>> Walls(start=[[0, 0.5], [0, -3]], end=[[0, 3], [0, -0.5]])  # with a door of 1 m
    <Walls: 2>"""

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

    def __repr__(self) -> str:
        return f"<Walls: {len(self)}>"

    def nearest_point(self, position: Floats, wall: Indices) -> Floats:
        """Find the point (k,2) m of wall number wall[i] (k,) that is nearest to position[i] (k,2)
        m."""
        return nearest_on_segment(position, self.start[wall], self.end[wall])
