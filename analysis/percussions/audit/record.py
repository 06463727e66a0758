"""What momentum needs of contacts, and what contacts are listed, as arrays over all frames."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nscd import Snapshot, Walls, find_contacts
from nscd.arrays import Floats, Indices, Mask
from nscd.contacts import NO_WALLS, sum_at_disks

# Bodies this near, as a share of the smallest radius, may touch.
NEAR = 1e-3
# A wall is that of its number, and gives a normal, if the gap to it is at most this share of a radius.
BESIDE = 0.3
External = Callable[[Snapshot], ArrayLike] | ArrayLike | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Record:
    """Hold n bodies at f instants, and the k contacts listed, frame behind frame.

    times: (f,) s; momentum: (f,n,2) N·s, NaN where a body is not there; with `moved` mass times place, kg m
    external: (f,n,2) N, what is no contact, 0 where it was not `stated`
    turning: (f,n) kg m/s, m r times the spin of bodies of one disk
    unlisted: (2,f,n) whether a body touches another, or a wall, with no row for it
    frame, first, second: (k,) frame, and numbers of the bodies; second −1 of a wall or what is held
    force: (k,2) N, on the second; normal: (k,2) first→second, NaN where it is not known
    overlap: (k,2) as shares of both radii
    noise: N, what the digits of the text leave open in the force on a body
    signed: whether forces must be those on the second; else they may all be those on the first
    every_step: whether frames are all the steps of a simulation; step_s: s, of these, where it is known
    pace: by how much places change for what velocities say, and the share of it that this leaves"""

    times: Floats
    momentum: Floats
    mass: Floats
    external: Floats
    turning: Floats
    unlisted: Mask
    frame: Indices
    first: Indices
    second: Indices
    force: Floats
    normal: Floats
    overlap: Floats
    moved: bool
    stated: bool
    noise: float = 0.0
    signed: bool = True
    every_step: bool = False
    step_s: float | None = None
    pace: tuple[float, float] = (1.0, 0.0)

    @property
    def durations(self) -> Floats:
        """(i,) s, of the intervals over which momentum changes."""
        h = np.diff(self.times)
        return 0.5 * (h[1:] + h[:-1]) if self.moved else h

    def needed(self) -> Floats:
        """Give the mean force (i,n,2) N that contacts must have exerted on each body in each interval."""
        change, external = np.diff(self.momentum, axis=0), self.external[1:-1]
        if self.moved:
            change = np.diff(change / np.diff(self.times)[:, None, None], axis=0)
        else:
            external = 0.5 * (self.external[1:] + self.external[:-1])
        return np.asarray(change / self.durations[:, None, None] - external)

    def sums(self, on_second: Floats, on_first: Floats | None = None) -> Floats:
        """Sum what contacts (k,2) give their bodies, opposite where only one is given: (f,n,2)."""
        on_first = -on_second if on_first is None else on_first
        f, n, _ = self.momentum.shape
        one, two = self.frame * n + self.first, np.where(self.second < 0, -1, self.frame * n + self.second)
        return sum_at_disks(one, two, on_first, on_second, f * n).reshape(f, n, -1)


def record_of(
    snapshots: Sequence[Snapshot], contacts: Sequence[Any], external: External = None,
    walls: Walls | None = None, has_velocity: bool = True, **rest: Any,
) -> Record:  # fmt: skip
    """Collect snapshots and the contacts listed at each, see `audit`; rest: fields of `Record`.

    Raises ValueError for times that do not grow, and naming the frame and row of a contact of nobody."""
    times = np.array([one.time for one in snapshots])
    if len(snapshots) != len(contacts) or not len(times) or not (np.diff(times) > 0).all():
        raise ValueError("snapshots: growing times, and contacts of each, are needed")
    labels = [one.ids if one.bodies is None else one.bodies.ids[one.bodies.number] for one in snapshots]
    ids = np.unique(np.concatenate(labels))
    f, n = len(times), len(ids)
    momentum, active, position = np.zeros((3, f, n, 2))
    turning, mass, unlisted, parts = np.zeros((f, n)), np.zeros((f, n)), np.zeros((2, f, n), bool), []
    for frame, (now, table, label) in enumerate(zip(snapshots, contacts, labels, strict=True)):
        of, m = np.searchsorted(ids, label), now.mass[:, None]
        pushed = external(now) if callable(external) else 0.0 if external is None else external
        np.add.at(momentum[frame], of, m * (now.velocity if has_velocity else now.position))
        np.add.at(active[frame], of, np.broadcast_to(np.asarray(pushed, dtype=float), (len(of), 2)))
        np.add.at(mass[frame], of, now.mass)
        np.add.at(position[frame], of, m * now.position)
        turning[frame, of] = now.mass * now.radius * now.spin if now.bodies is None else 0.0
        listed = _listed(table, frame, now, walls or NO_WALLS)
        unlisted[:, frame] = _unlisted(now, walls, of, listed, n)
        parts.append((listed[0], of[listed[1]], np.where(listed[2] < 0, -1, of[listed[2]]), *listed[3:]))
    if not has_velocity and walls is not None and walls.period_x:
        way = np.diff(momentum / mass[..., None], axis=0).reshape(-1, 2)
        momentum[1:] = momentum[0] + np.cumsum(mass[1:, :, None] * walls.shortest(way).reshape(-1, n, 2), axis=0)  # fmt: skip
    momentum[mass == 0] = np.nan
    if has_velocity:
        rest["pace"] = _pace(times, momentum / mass[..., None], position / mass[..., None], walls or NO_WALLS)
    names = ("frame", "first", "second", "force", "normal", "overlap")
    columns: dict[str, Any] = {name: np.concatenate(each) for name, each in zip(names, zip(*parts, strict=True), strict=True)}
    return Record(times=times, momentum=momentum, mass=mass.max(axis=0), external=active, turning=turning,
                  unlisted=unlisted, moved=not has_velocity, stated=external is not None, **columns, **rest)  # fmt: skip


def _pace(times: Floats, velocity: Floats, position: Floats, walls: Walls) -> tuple[float, float]:
    """Fit how far bodies move to the mean of their velocities at both ends of each interval."""
    moved = walls.shortest(np.diff(position, axis=0).reshape(-1, 2)).ravel()
    message = (0.5 * (velocity[1:] + velocity[:-1]) * np.diff(times)[:, None, None]).ravel()
    moved, message = (x[np.isfinite(moved + message)] for x in (moved, message))
    if not (moved.any() and message.any()):
        return 1.0, 0.0
    pace = float(moved @ message / (message @ message))
    return pace, float(np.linalg.norm(moved - pace * message) / np.linalg.norm(moved))


def _listed(table: Any, frame: int, now: Snapshot, walls: Walls) -> tuple[Any, ...]:
    """Frame, disks, forces, normals and overlaps of the rows of a frame; those of walls as listed, or of the
    wall of that number."""
    named = isinstance(table, Mapping) or hasattr(table, "columns")
    get = {name: table[name] if named else getattr(table, name)
           for name in ("first", "second", "is_wall", "fx", "fy", "force", "normal", "overlap")
           if (name in table if named else hasattr(table, name))}  # fmt: skip
    first, second = (np.asarray(get[name], dtype=np.int64) for name in ("first", "second"))
    force = np.asarray(get["force"] if "force" in get else np.column_stack([get["fx"], get["fy"]]), dtype=float)
    wall, order = np.asarray(get.get("is_wall", 0 * first), dtype=bool), np.argsort(now.ids)
    both = np.searchsorted(now.ids, np.stack([first, np.where(wall, first, second)]), sorter=order)
    one, two = order[both.clip(max=len(order) - 1)]
    bad = (now.ids[one] != first) | ~(wall | (now.ids[two] == second)) | ((one == two) & ~wall)
    if (bad := bad | ~np.isfinite(force).all(axis=1)).any():
        k = int(np.argmax(bad))
        raise ValueError(f"contacts: frame {frame}, row {k}: {first[k]} and {second[k]} with {force[k]} N. "
                         "Two bodies that are there and a finite force are needed")  # fmt: skip
    way = walls.shortest(now.position[two] - now.position[one])
    length, radius = np.hypot(*way.T), now.radius[np.stack([one, two])]
    normal, overlap = way / np.maximum(length, 1e-300)[:, None], radius.sum(axis=0) - length
    overlap[wall] = np.asarray(get["overlap"], dtype=float)[wall] if "overlap" in get else 0.0
    normal[wall] = np.asarray(get["normal"], dtype=float)[wall] if "normal" in get else np.nan
    lacks = np.isnan(normal[:, 0]) | ("overlap" not in get)
    open_ = np.flatnonzero(wall & lacks & (second >= 1) & (second <= len(walls)))
    to = walls.nearest_point(now.position[one[open_]], second[open_] - 1) - now.position[one[open_]]
    far, inside = np.hypot(*to.T), radius[0, open_]
    on = (far <= (1 + BESIDE) * inside) & (far > 0)
    overlap[open_[on]], own = (inside - far)[on], normal[open_[on]]
    normal[open_[on]] = np.where(np.isnan(own), to[on] / far[on, None], own)
    return np.full(len(first), frame), one, np.where(wall, -1, two), force.reshape(-1, 2), normal, overlap[:, None] / radius.T


def _unlisted(
    now: Snapshot, walls: Walls | None, of: Indices, listed: tuple[Any, ...], n: int
) -> Mask:
    """Which bodies (2,n) touch another, or more walls than are listed, with no row for it."""
    found = find_contacts(now, walls, tolerance=NEAR * float(now.radius.min(initial=1.0)))
    _, first, second, *_ = listed
    wall, other = found.is_wall, np.where(found.is_wall, 0, found.second)
    keys = [np.minimum(a, b) * len(of) + np.maximum(a, b) for a, b in ((found.first, other), (first, second))]
    lone, missing = ~wall & ~np.isin(keys[0], keys[1][second >= 0]), np.zeros((2, n), bool)
    missing[0, of[found.first[lone]]] = missing[0, of[other[lone]]] = True
    touched, on_wall = (np.bincount(of[at], minlength=n) for at in (found.first[wall], first[second < 0]))
    missing[1] = touched > on_wall
    return missing
