"""Arches before a door: who holds one, and for how long."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from analysis.dumps.windows import Window
from analysis.scene.scene import Scene
from nscd.arrays import Floats, Indices

# The force (N) below which two bodies hardly touch.
LEAST_N = 10.0
# An arch is made of people within half the door's width and so many mean diameters of its middle.
DIAMETERS = 2.0
# Ends of walls this near (m) to an end of the door flank it.
AT_POST_M = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Arch:
    """Name who holds an arch, and when.

    start, end: s, of the first and the last window between two frames in which it was seen"""

    people: frozenset[int]  # ids
    start: float
    end: float

    @property
    def lifetime(self) -> float:
        """Give how long it was seen (s)."""
        return self.end - self.start


def arches_of(scene: Scene, frames: Sequence[Window]) -> tuple[Arch, ...]:
    """Follow the arches before the door of a scene, window by window: one lives as long as the same
    people form it in windows that follow each other. None where the door has no walls beside it."""
    found: list[Arch] = []
    for window in frames:
        people = arch_in(scene, window)
        if not people:
            continue
        last = found[-1] if found else None
        if last and last.people == people and window.start - last.end < 0.5 * window.duration:
            found[-1] = Arch(people=people, start=last.start, end=window.end)
        else:
            found.append(Arch(people=people, start=window.start, end=window.end))
    return tuple(found)


def share_of(window: Window, arches: Sequence[Arch]) -> float:
    """Give the share of a window's time in which an arch stood."""
    stood = (min(window.end, arch.end) - max(window.start, arch.start) for arch in arches)
    return sum(time for time in stood if time > 0) / window.duration


def arch_in(scene: Scene, window: Window) -> frozenset[int]:
    """Find the shortest chain of people who press each other, and whose ends press the walls on
    either side of the door; empty where there is none near the door. Of several doors the own of
    the drive is looked at.

    Its length is that of the line from one end of the door through the centres to the other end."""
    drive = scene.drive
    if drive is None:
        return frozenset()
    posts = np.array(drive.door)
    flanks = [_flanking(scene, post) for post in posts]
    now, n = window.now, len(window.now)
    reach = 0.5 * np.hypot(*(posts[1] - posts[0])) + DIAMETERS * 2 * now.radius.mean()
    near = np.hypot(*(now.position - posts.mean(0)).T) <= reach
    near &= (now.position - posts[0]) @ np.array(drive.outward) < 0
    presses = window.force > LEAST_N
    first = np.searchsorted(now.ids, window.keys[:, 0])
    second = np.searchsorted(now.ids, np.where(window.is_wall, now.ids[0], window.keys[:, 1]))
    pairs = presses & ~window.is_wall & near[first] & near[second]
    rows, columns = [first[pairs]], [second[pairs]]
    lengths = [_distance(now.position[first[pairs]], now.position[second[pairs]])]
    for side, (post, walls) in enumerate(zip(posts, flanks, strict=True)):
        on = presses & window.is_wall & near[first] & np.isin(window.keys[:, 1], walls)
        who = np.unique(first[on])
        rows.append(who)
        columns.append(np.full(len(who), n + side))
        lengths.append(_distance(now.position[who], post))
    return _shortest(np.concatenate(rows), np.concatenate(columns), np.concatenate(lengths), window)


def _shortest(rows: Indices, columns: Indices, lengths: Floats, window: Window) -> frozenset[int]:
    """Who is on the shortest way between the two ends of the door, which follow the people."""
    n = len(window.now)
    graph = csr_array((lengths, (rows, columns)), shape=(n + 2, n + 2))
    length, before = dijkstra(graph, directed=False, indices=n, return_predecessors=True)
    if not np.isfinite(length[n + 1]):
        return frozenset()
    chain, at = [], int(before[n + 1])
    while at != n:
        chain.append(int(window.now.ids[at]))
        at = int(before[at])
    return frozenset(chain)


def _flanking(scene: Scene, post: Floats) -> Indices:
    """Numbers, from 1, of the walls that end at an end of the door."""
    walls = scene.wall_segments()
    ends = [_distance(end, post) <= AT_POST_M for end in (walls.start, walls.end)]
    return np.flatnonzero(ends[0] | ends[1]) + 1


def _distance(places: Floats, other: Floats) -> Floats:
    return np.asarray(np.hypot(*(places - other).T))
