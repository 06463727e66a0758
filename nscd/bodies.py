"""What a crowd is at one instant: disks, alone or several to a rigid body, and straight walls."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nscd import _core
from nscd.arrays import (
    LARGEST,
    Floats,
    Frozen,
    Index32,
    Indices,
    number,
    read_only,
    whole_numbers,
)
from nscd.segments import dots, lengths, nearest_on_segment

_LEFT_OUT: Any = np.empty(0, dtype=np.int64)
# Disks of one body hang together that are nearer than this share of the smaller radius.
NEAR = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bodies(Frozen):
    """Hold b rigid bodies of one or several disks; `Snapshot.joined` makes them.

    number: (n,) the body of each disk, 0…b−1
    ids: (b,) their numbers in the files, rising
    mass: (b,) kg
    centre: (b,2) m, of mass
    inertia: (b,) kg m², about the centre"""

    number: Index32
    ids: Indices
    mass: Floats
    centre: Floats
    inertia: Floats

    def __post_init__(self) -> None:
        set_field, b = object.__setattr__, len(self.ids)
        number = whole_numbers(self.number, (-1,), "number").astype(np.int32)
        if number.size and not 0 <= number.min() <= number.max() < b:
            raise ValueError(f"number: a body that does not exist, where there are {b}")
        number.flags.writeable = False
        set_field(self, "number", number)
        set_field(self, "ids", whole_numbers(self.ids, (b,), "ids"))
        for name, shape in (("mass", (b,)), ("centre", (b, 2)), ("inertia", (b,))):
            set_field(self, name, read_only(getattr(self, name), shape, name))

    def __len__(self) -> int:
        return len(self.mass)

    def as_core_arguments(self, mass: Floats) -> tuple[Index32, Floats, Floats, Floats]:
        """Give what the core is told of them, with masses (b,) kg."""
        return self.number, self.centre, mass, self.inertia

    def mean(self, values: Floats, mass: Floats) -> Floats:
        """Compute (b,2) the mean of what disks of masses (n,) kg have, (n,2) in any unit."""
        base = np.empty((len(self), 2))
        base[self.number[::-1]] = values[::-1]  # the first disk's: exact where a body is one disk
        fraction = mass / np.bincount(self.number, mass)[self.number]
        change = fraction[:, None] * (values - base[self.number])
        return base + np.column_stack([np.bincount(self.number, part) for part in change.T])

    def motion(self, snapshot: Snapshot, velocity: Floats) -> Floats:
        """Compute (b,3) m/s, m/s, rad/s: the centres' velocities and the spins of bodies whose disks
        have velocities (n,2) m/s, in the mean of their masses, and the snapshot's spins."""
        spin = np.empty(len(self))
        spin[self.number] = snapshot.spin
        return np.column_stack([self.mean(velocity, snapshot.mass), spin])

    def of_disks(self, motion: Floats, position: Floats) -> Floats:
        """Compute (n,2) m/s of disks at (n,2) m, v + ω × (x − c) of the motion (b,3) of bodies."""
        off, mine = position - self.centre[self.number], motion[self.number]
        return mine[:, :2] + mine[:, 2:] * np.column_stack([-off[:, 1], off[:, 0]])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Snapshot(Frozen):
    """Hold n disks at one instant.

    position: (n,2) m
    velocity: (n,2) m/s; 0 where left out
    radius: (n,) m
    mass: (n,) kg
    ids: (n,) the numbers that people have in the files; 1…n where left out
    spin: (n,) rad/s; 0 where left out
    time: s
    drive: (n,2) N, the force with which each person walks, where it is known
    bodies: which disks are one rigid body, see `joined`; none where each is alone

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
    velocity: Floats = field(default_factory=lambda: _LEFT_OUT)
    radius: Floats
    mass: Floats
    ids: Indices = field(default_factory=lambda: _LEFT_OUT)
    spin: Floats = field(default_factory=lambda: _LEFT_OUT)
    time: float = 0.0
    drive: Floats | None = None
    bodies: Bodies | None = None

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        set_field(self, "position", read_only(self.position, (-1, 2), "position"))
        n = len(self.position)
        velocity = np.zeros((n, 2)) if self.velocity is _LEFT_OUT else self.velocity
        set_field(self, "velocity", read_only(velocity, (n, 2), "velocity"))
        for name in ("radius", "mass"):
            set_field(self, name, _positive(getattr(self, name), n, name))
        spin = np.zeros(n) if self.spin is _LEFT_OUT else self.spin
        set_field(self, "spin", read_only(spin, (n,), "spin"))
        set_field(self, "time", number(self.time, "time", "A finite number of seconds"))
        if self.drive is not None:
            set_field(self, "drive", read_only(self.drive, (n, 2), "drive"))
        ids = whole_numbers(np.arange(1, n + 1) if self.ids is _LEFT_OUT else self.ids, (n,), "ids")
        # sorting is left out where they rise, as in every dump
        if not (ids[1:] > ids[:-1]).all() and len(np.unique(ids)) != n:
            raise ValueError("ids: one distinct integer per disk is needed")
        set_field(self, "ids", ids)
        if self.bodies is not None and len(self.bodies.number) != n:
            raise ValueError(f"bodies: of {len(self.bodies.number)} disks where there are {n}")

    def joined(self, body: ArrayLike, *, inertia: ArrayLike | None = None) -> Snapshot:
        """Join disks to rigid bodies: each has the mass of its disks, about their centre of mass.

        body: (n,) the number of the body of each disk
        inertia: (b,) kg m² of the bodies by rising number; Σ m (r²/2 + |x − c|²) where left out

        Disks get the velocities of the rigid motion with the same momentum and their spin. Raises
        ValueError for a body whose disks do not hang together or spin differently, and for an
        inertia that is not positive."""
        ids, index = np.unique(whole_numbers(body, (len(self),), "body"), return_inverse=True)
        own, b = np.ones(len(ids)), len(ids)
        centre = np.zeros((b, 2))
        of = Bodies(number=index.astype(np.int32), ids=ids, mass=own, centre=centre, inertia=own)
        of = replace(of, centre=of.mean(self.position, self.mass))
        off = self.position - of.centre[index]
        moment = self.inertia + self.mass * dots(off, off)
        total, moments = (np.bincount(index, part).astype(float) for part in (self.mass, moment))
        if inertia is not None:
            moments = read_only(inertia, (b,), "inertia")
        if b and not moments.min() > 0:
            worst = int(np.argmin(moments))
            raise ValueError(f"body {ids[worst]}: inertia {moments[worst]:g}. More than 0 is needed")
        of = replace(of, mass=total, inertia=moments)
        self._check_whole(of)
        moving = of.of_disks(of.motion(self, self.velocity), self.position)
        return replace(self, velocity=moving, bodies=of)

    def _check_whole(self, of: Bodies) -> None:
        """Raise ValueError for a body whose disks do not hang together, or spin differently."""
        order = np.argsort(of.number, kind="stable")
        ends = []
        for cycle in range(1, int(np.bincount(of.number).max(initial=0))):
            one, other = order[:-cycle], order[cycle:]
            both = of.number[one] == of.number[other]
            one, other = one[both], other[both]
            if (uneven := self.spin[one] != self.spin[other]).any():
                which = of.ids[of.number[one[uneven][0]]]
                raise ValueError(f"spin: disks of body {which} turn differently")
            minimum = np.minimum(self.radius[one], self.radius[other])
            gap = lengths(self.position[one] - self.position[other])
            near = gap - self.radius[one] - self.radius[other] <= NEAR * minimum
            ends.append(np.column_stack([one[near], other[near]]).astype(np.int32))
        pairs = np.concatenate(ends) if ends else np.empty((0, 2), np.int32)
        label = _core.components(len(self), *np.ascontiguousarray(pairs.T))
        parts = np.unique(np.column_stack([of.number, label]), axis=0)[:, 0]
        if len(parts) > len(of):
            which = of.ids[parts[:-1][parts[1:] == parts[:-1]][0]]
            raise ValueError(f"body {which}: its disks do not hang together")

    def need_disks(self, who: str) -> None:
        """Raise ValueError, naming who needs it, where bodies have several disks."""
        if self.compound is not None:
            raise ValueError(f"{who}: bodies of several disks, and it is for disks")

    @property
    def compound(self) -> Bodies | None:
        """Give the bodies, but none where they are the disks."""
        of = self.bodies
        same = of is None or (
            len(of) == len(self)
            and (
                np.array_equal(of.mass[of.number], self.mass)
                and np.array_equal(of.inertia[of.number], self.inertia)
                and np.array_equal(of.centre[of.number], self.position)
            )
        )
        return None if same else of

    @property
    def centres(self) -> Floats:
        """Give (n,2) m, the centre of the body of each disk, where a drive acts."""
        return self.position if self.bodies is None else self.bodies.centre[self.bodies.number]

    @property
    def inertia(self) -> Floats:
        """Compute (n,) kg m², the moment of inertia m r²/2 of each disk about its centre."""
        inertia: Floats = 0.5 * self.mass * (self.radius * self.radius)
        return inertia

    def __len__(self) -> int:
        return len(self.radius)

    def __repr__(self) -> str:
        return f"<Snapshot: {len(self)} disks at {self.time:g} s>"


def _positive(value: Floats, n: int, name: str) -> Floats:
    values = read_only(value, (n,), name)
    if n and not values.min() >= 1 / LARGEST:
        row = int(np.argmin(values))
        why = f"A disk needs a positive {name}"
        if values[row] > 0:
            why = f"At least {1 / LARGEST:g} can be computed with"
        raise ValueError(f"{name}: {values[row]:g} in row {row}. {why}")
    return values


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Walls(Frozen):
    """Hold w straight fixed walls without thickness. A door is the space between two.

    start, end: (w,2) m
    period_x: m, two places along x that are one: who leaves at the one comes in at the other

    Raises ValueError naming the field for a wrong shape, what is not a finite number, a magnitude
    beyond 10¹⁰⁰, a wall of no length, or a period that does not rise.

    >>> Walls(start=[[0, 0.5], [0, -3]], end=[[0, 3], [0, -0.5]])  # with a door of 1 m
    <Walls: 2>"""

    start: Floats
    end: Floats
    period_x: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if self.period_x is not None:
            low, high = read_only(self.period_x, (2,), "period_x").tolist()
            if not low < high:
                raise ValueError(f"period_x: {low:g} to {high:g} m. Two that rise are needed")
            object.__setattr__(self, "period_x", (low, high))
        object.__setattr__(self, "start", read_only(self.start, (-1, 2), "start"))
        object.__setattr__(self, "end", read_only(self.end, (len(self.start), 2), "end"))
        length = lengths(self.end - self.start)
        if (length == 0).any():
            raise ValueError(f"end: wall {int(np.argmin(length))} has no length")

    def __len__(self) -> int:
        return len(self.start)

    def __bool__(self) -> bool:
        return len(self) > 0 or self.period_x is not None

    def __repr__(self) -> str:
        return f"<Walls: {len(self)}>"

    def within(self, position: Floats) -> Floats:
        """Give the places (n,2) m within the period that are those at (n,2) m."""
        if not self.period_x:
            return position
        low, high = self.period_x
        turns = np.floor((position[:, 0] - low) / (high - low))
        return position - np.outer(turns * (high - low), [1.0, 0.0])

    def shortest(self, way: Floats) -> Floats:
        """Give ways (k,2) m from one place to another the shorter way round, where there is a
        period."""
        if not self.period_x:
            return way
        period = self.period_x[1] - self.period_x[0]
        return way - np.outer(period * np.round(way[:, 0] / period), [1.0, 0.0])

    def nearest_point(self, position: Floats, wall: Indices) -> Floats:
        """Find the point (k,2) m of wall number wall[i] (k,) that is nearest to position[i] (k,2)
        m."""
        return nearest_on_segment(position, self.start[wall], self.end[wall])
