"""What bodies did, and the contact forces that are said to have done it, as arrays over all frames."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nscd import Snapshot, Walls, find_contacts
from nscd.arrays import Flags, Floats, Indices
from nscd.contacts import NO_WALLS

# Bodies this near, as a share of the smallest radius, may touch.
NEAR = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rows:
    """Hold the k contacts that are listed, all frames behind each other.

    frame: (k,); first, second: (k,) row of the body, second −1 where it is a wall or held
    force: (k,2) N, on the second
    normal: (k,2) first→second, NaN where it is not known"""

    frame: Indices
    first: Indices
    second: Indices
    force: Floats
    normal: Floats

    def sums(self, shape: tuple[int, ...], forces: Floats, ends: str = "both") -> Floats:
        """Sum forces (k,2) at bodies: (frames, bodies, 2) N. `ends` both, first or second: of which
        bodies of a pair."""
        total = np.zeros((shape[0] * shape[1], 2))
        pairs = self.second >= 0
        for place, sign, some in (
            (self.first, -1.0, ~pairs if ends == "second" else pairs | ~pairs),
            (self.second, 1.0, pairs & (ends != "first")),
        ):
            at = self.frame[some] * shape[1] + place[some]
            for axis in (0, 1):
                added = sign * forces[some, axis]
                total[:, axis] += np.bincount(at, added, minlength=len(total))
        return total.reshape(shape[0], shape[1], 2)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Record:
    """Hold n bodies at f instants, and the contacts that are listed.

    times: (f,) s; ids: (n,); mass, radius: (n,) kg, m
    momentum: (f,n,2) N·s, NaN where a body is not there; where velocities are not known they are
        those of the positions between two frames, and `moved` is true
    spin: (f,n) rad/s; external: (f,n,2) N, what is not a contact; stated: whether it was given
    body: (n,) number from 0 of the rigid body of each disk, where some are joined
    steps: (f,) of the simulation, where they are known
    noise: N, what the digits of the text leave open in the force on a body"""

    times: Floats
    ids: Indices
    mass: Floats
    radius: Floats
    momentum: Floats
    spin: Floats
    external: Floats
    stated: bool
    moved: bool
    rows: Rows
    snapshots: Sequence[Snapshot]
    walls: Walls | None
    body: Indices | None = None
    steps: tuple[int, ...] | None = None
    noise: float = 0.0

    @property
    def base(self) -> int:
        """Give how many frames the middle of the first interval is later than frame 0."""
        return int(self.moved)

    @property
    def durations(self) -> Floats:
        """(i,) s of the intervals over which momentum changes."""
        h = np.diff(self.times)
        return 0.5 * (h[1:] + h[:-1]) if self.moved else h

    def needed(self) -> Floats:
        """Give the mean force (i,n,2) N that contacts must have exerted on each body in each interval:
        its change of momentum, less what is external."""
        if self.moved:
            change, external = np.diff(self.momentum[:-1], axis=0), self.external[1:-1]
        else:
            change = np.diff(self.momentum, axis=0)
            external = 0.5 * (self.external[1:] + self.external[:-1])
        return self.joined(change / self.durations[:, None, None] - external)

    def joined(self, values: Floats) -> Floats:
        """Sum values (…,n,2) of disks over the disks of each rigid body."""
        if self.body is None:
            return values
        total = np.zeros((len(values), self.body.max() + 1, 2))
        np.add.at(total, (slice(None), self.body), values)
        return total

    def unlisted(self) -> tuple[Flags, Flags]:
        """Find which bodies (f,n) touch another, or a wall, with no row for it."""
        f, n = len(self.times), len(self.ids)
        pairs, walls = np.zeros((2, f, n), dtype=bool)
        rows, held = self.rows, self.rows.second < 0
        on_wall = np.zeros((f, n), dtype=int)
        np.add.at(on_wall, (rows.frame[held], rows.first[held]), 1)
        low, high = np.minimum(rows.first, rows.second), np.maximum(rows.first, rows.second)
        listed = (rows.frame * n + low) * n + high
        for frame, now in enumerate(self.snapshots):
            near = NEAR * float(now.radius.min(initial=np.inf))
            found = find_contacts(now, self.walls, tolerance=near if np.isfinite(near) else 0.0)
            row = np.searchsorted(self.ids, now.ids)
            one, wall = row[found.first], found.is_wall
            two = row[np.where(wall, 0, found.second)]
            key = (frame * n + np.minimum(one, two)) * n + np.maximum(one, two)
            open_pair = ~wall & ~np.isin(key, listed[rows.frame == frame])
            pairs[frame, one[open_pair]] = pairs[frame, two[open_pair]] = True
            walls[frame] = np.bincount(one[wall], minlength=n) > on_wall[frame]
        return pairs, walls


def record_of(
    snapshots: Sequence[Snapshot],
    contacts: Sequence[Any],
    *,
    external: Callable[[Snapshot], ArrayLike] | ArrayLike | None = None,
    walls: Walls | None = None,
    has_velocity: bool = True,
    **rest: Any,
) -> Record:
    """Collect snapshots (their times growing) and the contacts listed at each, see `audit`.

    external: N, what else acts: (n,2), (2,) for all, or a function of a snapshot; None: not known

    Raises ValueError naming the frame of a contact of nobody, and of a force that is not finite."""
    if len(snapshots) != len(contacts):
        raise ValueError(f"contacts: of {len(contacts)} frames where there are {len(snapshots)}")
    times = np.array([one.time for one in snapshots])
    if not (np.diff(times) > 0).all():
        raise ValueError("snapshots: their times must grow")
    ids = np.unique(np.concatenate([one.ids for one in snapshots] or [np.zeros(0, np.int64)]))
    shape = (len(snapshots), len(ids))
    place, moving, acting = np.full((3, *shape, 2), np.nan)
    spin, mass, radius = np.full(shape, np.nan), *np.ones((2, len(ids)))
    for frame, now in enumerate(snapshots):
        row = np.searchsorted(ids, now.ids)
        place[frame, row], moving[frame, row], spin[frame, row] = now.position, now.velocity, now.spin
        mass[row], radius[row] = now.mass, now.radius
        pushed = external(now) if callable(external) else 0.0 if external is None else external
        acting[frame, row] = np.broadcast_to(np.asarray(pushed, dtype=float), (len(row), 2))
    if not has_velocity:
        h, step = np.diff(times)[:, None, None], np.diff(place, axis=0)
        step = (walls or NO_WALLS).shortest(step.reshape(-1, 2)).reshape(step.shape)
        moving[:-1], moving[-1:] = step / h, np.nan
    rows = [_rows(one, frame, ids, place[frame], walls) for frame, one in enumerate(contacts)]
    names, body = ("frame", "first", "second", "force", "normal"), None
    if snapshots[0].bodies is not None and len(snapshots[0]) == len(ids):
        body = np.unique(snapshots[0].bodies.number, return_inverse=True)[1]
    return Record(
        times=times, ids=ids, mass=mass, radius=radius, momentum=mass[:, None] * moving, spin=spin,
        external=acting, stated=external is not None, moved=not has_velocity, snapshots=snapshots,
        walls=walls, body=body, rows=Rows(**{n: np.concatenate([one[n] for one in rows]) for n in names}), **rest,
    )  # fmt: skip


def column(table: Any, name: str) -> Any:
    """Take a column of a table, by name, or an attribute; None where there is none."""
    if isinstance(table, Mapping) or hasattr(table, "columns"):
        return np.asarray(table[name]) if name in table else None
    return getattr(table, name, None)


def _rows(
    table: Any, frame: int, ids: Indices, place: Floats, walls: Walls | None
) -> dict[str, Any]:
    """The contacts of a frame, with normals from the bodies; those of walls from the table."""
    first, second = (np.asarray(column(table, name), dtype=np.int64) for name in ("first", "second"))
    force, normal, wall = (column(table, name) for name in ("force", "normal", "is_wall"))
    if force is None:
        force = np.column_stack([column(table, "fx"), column(table, "fy")])
    force = np.asarray(force, dtype=float).reshape(-1, 2)
    held = np.zeros(len(first), dtype=bool) if wall is None else np.asarray(wall, dtype=bool)
    there = ~np.isnan(place[:, 0])
    one, two = (np.searchsorted(ids, each).clip(max=len(ids) - 1) for each in (first, second))
    bad = (ids[one] != first) | ~there[one] | (~held & ((ids[two] != second) | ~there[two]))
    bad |= ~np.isfinite(force).all(axis=1) | (~held & (first == second))
    if bad.any():
        k = int(np.argmax(bad))
        raise ValueError(
            f"contacts: frame {frame}, row {k}: {first[k]} and {second[k]}, force {force[k]}. Bodies that "
            "are there and a finite force are needed"
        )
    way = (walls or NO_WALLS).shortest(place[two] - place[one])
    n = way / np.maximum(np.hypot(*way.T), 1e-300)[:, None]
    n[held] = np.nan if normal is None else np.asarray(normal, dtype=float)[held]
    return {"frame": np.full(len(first), frame), "first": one, "second": np.where(held, -1, two),
            "force": force, "normal": n}  # fmt: skip


def frames_of(table: Any, times: Iterable[float]) -> list[Any]:
    """Split a table (pandas) with a column time_s by the times of frames, s."""
    when, parts = np.asarray(table["time_s"], dtype=float), []
    for time in times:
        parts.append(table[np.isclose(when, time, rtol=1e-9, atol=1e-12)])
    if (lost := len(table) - sum(map(len, parts))) > 0:
        raise ValueError(f"time_s: {lost} rows are at no instant of the bodies")
    return parts
