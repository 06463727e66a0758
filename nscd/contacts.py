"""Contacts of a snapshot, and the maps between disk velocities and contact velocities."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from nscd import _core
from nscd.arrays import (
    Floats,
    Frozen,
    Index32,
    Indices,
    Mask,
    instance,
    mask,
    number,
    read_only,
    whole_numbers,
)
from nscd.bodies import Bodies, Snapshot, Walls
from nscd.segments import dots, lengths

if TYPE_CHECKING:
    from scipy.sparse import csr_array

# Normals may be off unit length by this: files have few digits.
UNIT = 1e-6
# Coordinates up to so many of the smallest radius: gaps are then known to 10⁻⁶ of it.
FARTHEST = 1e9
# So many pairs take about 1 GB.
MAX_PAIRS = _core.MAX_PAIRS
NO_WALLS = Walls(start=np.empty((0, 2)), end=np.empty((0, 2)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Contacts(Frozen):
    """Hold the k contacts of a snapshot, disk–disk and disk–wall.

    first: (k,) index of a disk
    second: (k,) index of the other disk, or of the wall where is_wall (k,) is true
    normal: (k,2) unit vector from first to second, or into the wall
    gap: (k,) m, negative where they overlap
    point: (k,2) m, where the surface of the first disk touches

    Raises ValueError naming the field for wrong shapes, non-finite numbers, normals that are not
    unit vectors, negative indices or a disk in contact with itself."""

    first: Indices
    second: Indices
    is_wall: Mask
    normal: Floats
    gap: Floats
    point: Floats

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        set_field(self, "normal", read_only(self.normal, (-1, 2), "normal"))
        k = len(self.normal)
        set_field(self, "gap", read_only(self.gap, (k,), "gap"))
        set_field(self, "point", read_only(self.point, (k, 2), "point"))
        for name in ("first", "second"):
            set_field(self, name, whole_numbers(getattr(self, name), (k,), name))
        set_field(self, "is_wall", mask(self.is_wall, (k,), "is_wall"))
        if k and min(self.first.min(), self.second.min()) < 0:
            raise ValueError("first, second: negative index")
        if np.any((self.first == self.second) & ~self.is_wall):
            raise ValueError("second: a disk in contact with itself")
        off = np.abs(lengths(self.normal) - 1)
        if k and off.max() > UNIT:
            raise ValueError(f"normal: row {int(np.argmax(off))} is not a unit vector")

    def __len__(self) -> int:
        return len(self.gap)

    def __repr__(self) -> str:
        walls = int(self.is_wall.sum())
        return f"<Contacts: {len(self) - walls} of two disks, {walls} with a wall>"

    def select(self, keep: Mask | Indices) -> Contacts:
        """Choose contacts by a mask (k,) or by indices, in that order."""
        names = ("first", "second", "is_wall", "normal", "gap", "point")
        return Contacts(**{name: getattr(self, name)[keep] for name in names})

    def check_disks(self, n: int) -> None:
        """Raise ValueError if a contact names a disk beyond the n that there are."""
        highest = max(self.first.max(initial=-1), self.second[~self.is_wall].max(initial=-1))
        if highest >= n:
            raise ValueError(f"contacts: disk index {highest} where there are {n} disks")

    def check_once(self) -> None:
        """Raise ValueError where two disks have two contacts, or a disk has two with one point of one
        wall: each would carry a part of the percussion."""
        pairs, low, high = ~self.is_wall, self.first, self.second
        if (turned := pairs & (low > high)).any():
            low, high = np.where(turned, high, low), np.where(turned, low, high)
        keys = (self.is_wall.astype(np.int64) << 62) + (low << 31) + high
        if (keys[1:] > keys[:-1]).all():  # as `find_contacts` lists them
            return
        order = np.lexsort((*self.point.T, keys))
        same = pairs[order[1:]] | (np.abs(np.diff(self.normal[order], axis=0)) <= UNIT).all(1)
        if (same := same & (np.diff(keys[order]) == 0)).any():
            one, other = sorted(order[int(np.argmax(same)) :][:2].tolist())
            raise ValueError(f"contacts: row {other} is the contact of row {one} again")

    @property
    def tangent(self) -> Floats:
        """Turn the normal a quarter to the left: t = (−n_y, n_x), (k,2)."""
        return np.column_stack([-self.normal[:, 1], self.normal[:, 0]])

    def deformation_velocity(self, velocity: Floats) -> Floats:
        """Compute D(u) = u_i − u_j at each contact, walls at rest, without spins.

        velocity: (n,2) m/s, or (n,…); returns (k,2) m/s"""
        difference = velocity[self.first]
        pairs = ~self.is_wall
        difference[pairs] -= velocity[self.second[pairs]]
        return difference

    def approach_velocity(self, velocity: Floats) -> Floats:
        """Compute v = n·D(u) = C u, positive where the contact closes (paper eq. (2)).

        velocity: (n,2) m/s; returns (k,) m/s"""
        approach: Floats = dots(self.normal, self.deformation_velocity(velocity))
        return approach

    def momentum_change(self, impulse: Floats, n: int) -> Floats:
        """Compute −Dᵀp, what impulses change the momentum of each of n disks by.

        impulse: (k,2) N·s, given by first to second; returns (n,2) N·s"""
        return self.sum_at_disks(-impulse, n, on_second=impulse)

    def sum_at_disks(self, on_first: Floats, n: int, *, on_second: Floats | None = None) -> Floats:
        """Sum at each of n disks what it has of its contacts.

        on_first: (k,…) any unit, what the first disk of a contact has of it
        on_second: (k,…) what the second has; the same where left out; a wall takes its part away
        Returns (n,…) in the same unit."""
        second = np.where(self.is_wall, -1, self.second)
        return sum_at_disks(
            self.first, second, on_first, on_first if on_second is None else on_second, n
        )

    def normal_matrix(self, n: int) -> csr_array:
        """Assemble C of v = C u with u = (u₁x, u₁y, u₂x, …): sparse (k, 2n)."""
        return self.rows(self.normal, -self.normal, n)

    def rows(self, on_first: Floats, on_second: Floats, n: int) -> csr_array:
        """Assemble (k, w·n), sparse, of rows that have (k,w) at the first and at the second of n disks;
        nothing at a wall."""
        from scipy.sparse import csr_array  # slow to import, and few need it

        (k, width), pairs = on_first.shape, ~self.is_wall
        disks = np.concatenate([self.first, self.second[pairs]])
        row = np.concatenate([np.arange(k), np.flatnonzero(pairs)])
        columns = width * disks[:, None] + np.arange(width)
        values = np.concatenate([on_first, on_second[pairs]]).ravel()
        indices = np.repeat(row, width), columns.ravel()
        return csr_array((values, indices), shape=(k, width * n))

    def islands(self, n: int) -> Index32:
        """Number (n,) the islands of the contact graph of n disks, which walls do not join."""
        second = np.where(self.is_wall, -1, self.second).astype(np.int32)
        return _core.components(n, self.first.astype(np.int32), second)

    def inverse_mass(self, mass: Floats) -> Floats:
        """Compute w = 1/m_i + 1/m_j (k,) 1/kg of masses (n,) kg, a wall's being infinite.

        It is the diagonal of the Delassus operator."""
        w: Floats = 1.0 / mass[self.first]
        pairs = ~self.is_wall
        w[pairs] += 1.0 / mass[self.second[pairs]]
        return w


def sum_at_disks(
    first: Indices | Index32, second: Indices | Index32, on_first: Floats, on_second: Floats, n: int
) -> Floats:
    """Sum at each of n disks what it has of its contacts: on_first, on_second (k,…) → (n,…)."""
    pairs = second >= 0
    both = second[pairs]
    if on_first.ndim == 1:
        total = np.bincount(first, on_first, n) + np.bincount(both, on_second[pairs], n)
        return np.asarray(total, dtype=np.float64)
    sums = np.empty((n, on_first.shape[1]))
    for axis in range(on_first.shape[1]):
        sums[:, axis] = np.bincount(first, on_first[:, axis], n)
        sums[:, axis] += np.bincount(both, on_second[pairs, axis], n)
    return sums


def find_contacts(snapshot: Snapshot, walls: Walls | None = None, *, tolerance: float) -> Contacts:
    """Find all contacts with a gap of at most `tolerance`: pairs of disks by (first, second), then
    walls by (disk, wall).

    tolerance: m; gaps that are zero but for the rounding of coordinates count at any tolerance

    The gap of a pair is |x_j − x_i| − r_i − r_j, that of a wall the distance to the nearest point
    of its segment less r. Walls that meet are one body: a disk has one contact for each nearest
    point of it, one along walls in line and at a corner that points at it, two in a corner that it
    sits in.

    Raises ValueError naming the field for a tolerance that is negative or not finite; for
    coordinates beyond 10⁹ of the smallest radius, in whose rounding gaps are lost; for more pairs
    within reach than memory should hold; and where two centres, or a centre and a wall, coincide,
    since such a contact has no normal.

    >>> one = Snapshot(position=[[-0.25, 0]], velocity=[[1, 0]], radius=[0.25], mass=[75])
    >>> contacts = find_contacts(one, Walls(start=[[0, -1]], end=[[0, 1]]), tolerance=1e-6)
    >>> contacts.is_wall.tolist(), contacts.normal.tolist(), contacts.gap.tolist()
    ([True], [[1.0, 0.0]], [0.0])"""
    instance(snapshot, Snapshot, "snapshot")
    if walls is not None:
        instance(walls, Walls, "walls")
    if number(tolerance, "tolerance", "A length ≥ 0 m") < 0:
        raise ValueError(f"tolerance: {tolerance} m. A length ≥ 0 is needed")
    tolerance += _rounding(snapshot, walls)
    found = _core.find_contact_pairs(
        snapshot.position, snapshot.radius, connected(walls or NO_WALLS), tolerance,
        None if snapshot.bodies is None else snapshot.bodies.number,
    )  # fmt: skip
    if found.pairs < 0:
        reach = 2 * float(snapshot.radius.max()) + tolerance
        raise ValueError(
            f"tolerance: more than {MAX_PAIRS:g} pairs of disks are within {reach:g} m of each "
            "other, the largest diameter and the tolerance"
        )
    first, second = found.first, found.second
    if len(at := np.flatnonzero(found.distance == 0)):
        row = int(at[0])
        pair = row < found.pairs
        other = f"disk {snapshot.ids[second[row]]}" if pair else f"wall {second[row] + 1}"
        raise ValueError(
            f"position: disk {snapshot.ids[first[row]]} and {other} coincide. "
            "Their contact has no normal"
        )
    normal = found.vector / found.distance[:, None]
    return Contacts(
        first=first,
        second=second,
        is_wall=np.arange(len(first)) >= found.pairs,
        normal=normal,
        gap=found.gap,
        point=snapshot.position[first] + snapshot.radius[first, None] * normal,
    )


def of_bodies(bodies: Bodies | None, contacts: Contacts) -> Contacts:
    """Give the contacts of disks as those of their bodies, where they have some."""
    if bodies is None:
        return contacts
    disk = np.where(contacts.is_wall, 0, contacts.second)
    second = np.where(contacts.is_wall, contacts.second, bodies.number[disk])
    return replace(contacts, first=bodies.number[contacts.first].astype(np.int64), second=second)


def levers(snapshot: Snapshot, contacts: Contacts) -> tuple[Floats, Floats]:
    """Compute the levers (k,2) m of n and of t about the centres of both bodies of each contact, with
    the sign of their rows in C and T; 0 at a wall. Without bodies a disk's are 0 and its radius."""
    along, across = np.zeros((len(contacts), 2)), np.zeros((len(contacts), 2))
    off = np.zeros_like(snapshot.position)
    if snapshot.bodies is not None:
        off = snapshot.position - snapshot.bodies.centre[snapshot.bodies.number]
    pairs, (nx, ny) = ~contacts.is_wall, contacts.normal.T
    ends = (contacts.first, 1.0), (np.where(pairs, contacts.second, contacts.first), -1.0)
    for side, (disk, sign) in enumerate(ends):
        x, y = off[disk].T
        along[:, side] = sign * (x * ny - y * nx)
        across[:, side] = snapshot.radius[disk] + sign * (x * nx + y * ny)
    along[~pairs, 1] = across[~pairs, 1] = 0.0
    return along, across


def inverse_masses(snapshot: Snapshot, contacts: Contacts) -> Floats:
    """Compute w (k,) 1/kg, the diagonal of the Delassus operator: 1/m and lever² over inertia of both
    disks, or bodies."""
    compound = snapshot.compound
    if compound is None:
        return contacts.inverse_mass(snapshot.mass)
    of, along = of_bodies(compound, contacts), levers(snapshot, contacts)[0]
    other = np.where(of.is_wall, of.first, of.second)
    square = along * along
    turning = square[:, 0] / compound.inertia[of.first] + square[:, 1] / compound.inertia[other]
    return of.inverse_mass(compound.mass) + turning


def _rounding(snapshot: Snapshot, walls: Walls | None) -> float:
    """What gaps may be wrong by (m), from the size of coordinates.

    Raises ValueError where that is no small share of the smallest radius."""
    largest, whose = float(np.abs(snapshot.position).max(initial=0.0)), "position"
    for name in ("start", "end") if walls is not None else ():
        there = float(np.abs(getattr(walls, name)).max(initial=0.0))
        if there > largest:
            largest, whose = there, f"walls: {name}"
    smallest = float(snapshot.radius.min(initial=np.inf))
    if largest > FARTHEST * smallest:
        raise ValueError(
            f"{whose}: coordinates up to {largest:g} m. Beyond {FARTHEST:g} of the smallest "
            f"radius, {smallest:g} m, gaps are lost in rounding"
        )
    return 4 * float(np.finfo(float).eps) * largest


@functools.lru_cache(maxsize=8)
def connected(walls: Walls) -> _core.Walls:
    """Tell how walls meet, found once: the frames of a film have the same ones."""
    low, high = walls.period_x or (0.0, 0.0)
    return _core.Walls(np.column_stack([walls.start, walls.end]), low, high - low)
