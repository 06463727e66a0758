"""Outlines of joined walls: a load is a line density along them, whatever the pieces in which a plan
draws them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from scipy.spatial import cKDTree

from nscd import Walls
from nscd.arrays import Floats, Indices, Mask

# Walls with so small a gap (m) between their ends, or beside each other, are joined: no person
# presses through it.
GAP_M = 0.01
# Pieces of one straight side are this near (m) to one line, and turn less from it (sine of a degree).
FLAT_M, PARALLEL = 1e-3, 0.0175
# Rounding of places and arc lengths (m).
ROUNDING_M = 1e-6
# The stretch of an outline (m) on which a line load is taken.
STRETCH_M = 1.0
# A side that turns by less (cosine of 20 degrees) makes no corner.
BENT = np.cos(np.radians(20.0))


class Worst(NamedTuple):
    """Say where the largest mean load on any metre of walls is: the point is its centre of force."""

    load: float  # N/m
    outline: int
    arc: float  # m
    point: tuple[float, float]  # m
    wall: int  # of the piece that bears most of it there; -1 where nothing presses


NOWHERE = Worst(0.0, -1, float("nan"), (float("nan"), float("nan")), -1)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outlines:
    """Give w walls their places on outlines, which begin at their lower left end; closed ones run
    against the clock.

    number: (w,) the outline of each wall
    arc: (w,) m, arc length at its start; forward: (w,) ±1, whether arc length grows to its end
    side: (w,2) m, the arc lengths of the straight side that it is a piece of
    length: (o,) m; closed: (o,) whether the end of the outline is its start
    alone: (o,) whether it touches no other
    arcs_at, points: of each outline the arc lengths (p,) m and places (p,2) m of its ends and corners,
        twice where walls with a gap are joined"""

    walls: Walls
    number: Indices
    arc: Floats
    forward: Indices
    side: Floats
    length: Floats
    closed: Mask
    alone: Mask
    arcs_at: list[Floats]
    points: list[Floats]

    @classmethod
    def of(cls, walls: Walls) -> Outlines:
        """Join pieces in one line that overlap or meet to sides, and sides at their ends; of more
        than two ends the straightest two. Where one ends before another that goes on, its outline
        ends, and its stretch is a metre, be it shorter."""
        if not len(walls):
            none = np.zeros(0)
            return cls(walls=walls, number=none.astype(int), arc=none, forward=none.astype(int),
                       side=none.reshape(0, 2), length=none, closed=none > 0, alone=none > 0, arcs_at=[], points=[])  # fmt: skip
        of, sides = _sides(walls)
        chains = sorted((_turned(*one, sides) for one in _chains(sides, walls.period_x)),
                        key=lambda one: _rank(_begin(one[0], sides)))  # fmt: skip
        size = np.hypot(*(sides[:, 1] - sides[:, 0]).T)
        number, first, ahead = (np.zeros(len(sides), dtype=int) for _ in range(3))
        begins = np.zeros(len(sides))
        arcs_at, points = [], []
        for n, (chain, _) in enumerate(chains):
            side, backward = np.array(chain).T
            after = np.cumsum(size[side])
            number[side], begins[side] = n, after - size[side]
            first[side], ahead[side] = backward, 1 - 2 * backward
            arcs_at.append(np.column_stack([after - size[side], after]).ravel())
            ends = np.where(backward[:, None, None] == 1, sides[side, ::-1], sides[side])
            points.append(ends.reshape(-1, 2))
        way = (sides[:, 1] - sides[:, 0]) / size[:, None]
        length = np.array([one[-1] for one in arcs_at])
        from_start = ((walls.start - sides[of, first[of]]) * way[of]).sum(1) * ahead[of]
        along = ((walls.end - walls.start) * way[of]).sum(1) * ahead[of]
        return cls(walls=walls, number=number[of], arc=begins[of] + from_start,
                   forward=np.where(along < 0, -1, 1), length=length,
                   side=np.column_stack([begins, begins + size])[of],
                   closed=np.array([closed for _, closed in chains]),
                   alone=~_attached(sides, number, len(chains)),
                   arcs_at=arcs_at, points=points)  # fmt: skip

    def arcs(self, wall: Indices, position: Floats) -> Floats:
        """Give the arc length (k,) m next to positions (k,2) m on the sides of these walls: who slides from
        a piece to the next within a window is where he is."""
        start, way = self.walls.start[wall], (self.walls.end - self.walls.start)[wall]
        along = ((position - start) * way).sum(1) / np.sqrt((way**2).sum(1))
        return np.asarray(np.clip(self.arc[wall] + self.forward[wall] * along, *self.side[wall].T))

    def point(self, outline: int, arc: float) -> tuple[float, float]:
        """Give the place (m) of an arc length (m) of an outline."""
        at = arc % self.length[outline] if self.closed[outline] else arc
        arcs, points = self.arcs_at[outline], self.points[outline]
        return float(np.interp(at, arcs, points[:, 0])), float(np.interp(at, arcs, points[:, 1]))

    def nearest(self, point: Floats, within: float) -> list[tuple[int, float]]:
        """List the outlines with a place within so many metres of a point, and the arc length (m) of
        the nearest one, the nearest outlines first."""
        found = []
        for n, (arcs, points) in enumerate(zip(self.arcs_at, self.points, strict=True)):
            start, end = points[::2], points[1::2]
            way = end - start
            fraction = np.clip(((point - start) * way).sum(1) / (way**2).sum(1), 0.0, 1.0)
            away = np.hypot(*(start + fraction[:, None] * way - point).T)
            side = int(np.argmin(np.round(away, 6)))
            if away[side] <= within:
                arc = arcs[2 * side] + fraction[side] * (arcs[2 * side + 1] - arcs[2 * side])
                found.append((round(float(away[side]), 6), n, float(arc)))
        return [(n, arc) for _, n, arc in sorted(found)]

    @property
    def stretch(self) -> Floats:
        """(o,) m: on how much of each outline a line load is taken."""
        return np.where(self.alone, np.minimum(self.length, STRETCH_M), STRETCH_M)

    def metre(self, outline: int, arc: float) -> tuple[float, float, float]:
        """Give the ends (m) of the metre about an arc length (m), moved inward at the ends of an
        outline, and the length (m) over which its load is spread."""
        low, over = arc - 0.5 * STRETCH_M, float(self.stretch[outline])
        if not self.closed[outline]:
            low = min(max(low, 0.0), max(float(self.length[outline]) - STRETCH_M, 0.0))
        return low, low + min(STRETCH_M, float(self.length[outline])), over

    def metre_from(self, outline: int, arc: float, way: int) -> tuple[float, float, float]:
        """Give the same of the metre that begins at an arc length (m) and goes up (1) or down (−1)."""
        low, high = sorted((arc, arc + way * STRETCH_M))
        if self.closed[outline]:
            return low, high, float(self.stretch[outline])
        low, high = max(low, 0.0), min(high, float(self.length[outline]))
        return low, high, high - low if self.alone[outline] else STRETCH_M

    def corners(self) -> list[tuple[int, float]]:
        """List the corners, by outline and arc length (m): where two sides meet at 20 degrees or more."""
        found = []
        for n, (arcs, points) in enumerate(zip(self.arcs_at, self.points, strict=True)):
            way = points[1::2] - points[::2]
            way /= np.sqrt((way**2).sum(1))[:, None]
            turns = (way[1:] * way[:-1]).sum(1) < BENT
            if self.closed[n] and len(way) > 1 and way[0] @ way[-1] < BENT:
                found.append((n, 0.0))
            found += [(n, float(arc)) for arc in arcs[2::2][turns]]
        return found

    def line_loads(self, wall: Indices, position: Floats, force: Floats) -> tuple[Floats, Worst]:
        """Compute for each of w walls the largest mean load (N/m) of all stretches that hold a contact
        on it, and the largest of all with its place.

        wall, position, force: of k contacts (k,) the wall, (k,2) m the position and (k,) N"""
        found, worst, at = np.zeros(len(self.walls)), NOWHERE, wall[:0]
        arc, outline = self.arcs(wall, position), self.number[wall]
        for number in np.unique(outline).tolist():
            mine = np.flatnonzero(outline == number)
            mine = mine[np.argsort(arc[mine], kind="stable")]
            stretch, length, location = float(self.stretch[number]), float(self.length[number]), arc[mine]
            if self.closed[number] and stretch < length:
                location, mine = np.append(location, location + length), np.tile(mine, 2)
            size = force[mine]
            sums, moments = (np.append(0.0, np.cumsum(one)) for one in (size, size * location))
            # a stretch begins with each contact; rounding of arc lengths is no reason to lose one
            ends = np.searchsorted(location, location + stretch + ROUNDING_M, side="right")
            load = (sums[ends] - sums[: len(ends)]) / stretch
            maximum = np.zeros(len(ends))
            for first, end in enumerate(ends.tolist()):
                np.maximum(maximum[first:end], load[first], out=maximum[first:end])
            np.maximum.at(found, wall[mine], maximum)
            best = int(np.argmax(load > load.max() * (1 - 1e-9)))  # of equal ones the first
            if load[best] > worst.load * (1 + 1e-9):
                centre = (moments[ends[best]] - moments[best]) / (load[best] * stretch)
                centre = float(centre % length if self.closed[number] else centre)
                worst, at = Worst(float(load[best]), number, centre, (0.0, 0.0), 0), wall[mine[best : ends[best]]]
        if worst.outline >= 0:
            there = self.point(worst.outline, worst.arc), self.wall_at(worst.outline, worst.arc, at)
            worst = worst._replace(point=there[0], wall=there[1])
        return found, worst

    def wall_at(self, outline: int, arc: float, among: Indices) -> int:
        """Name the wall, one of some on an outline, that is next to an arc length (m)."""
        begin = self.arc[among]
        ends = np.sort([begin, begin + self.forward[among] * self.sizes[among]], axis=0)
        positions = np.array([arc, arc - self.length[outline]])[:, None]
        away = np.maximum(np.maximum(ends[0] - positions, positions - ends[1]), 0.0).min(0)
        return int(among[np.argmin(np.round(away, 6))])

    @property
    def sizes(self) -> Floats:
        """(w,) m: how long each wall is."""
        return np.asarray(np.hypot(*(self.walls.end - self.walls.start).T))

    def sums(self, arc: Floats, force: Floats, low: Floats, high: Floats, outline: int) -> Floats:
        """Sum the forces (k,) N at arc lengths (k,) m of an outline between low and high (p,) m, the
        ends included, round the joint of a closed one."""
        if self.closed[outline]:
            length = float(self.length[outline])
            arc, force = np.concatenate([arc - length, arc, arc + length]), np.tile(force, 3)
            high = np.minimum(high, low + length - 3 * ROUNDING_M)  # each once
        order = np.argsort(arc, kind="stable")
        total = np.append(0.0, np.cumsum(force[order]))
        first = np.searchsorted(arc[order], low - ROUNDING_M, side="left")
        last = np.searchsorted(arc[order], high + ROUNDING_M, side="right")
        return np.asarray(total[last] - total[first])


def _sides(walls: Walls) -> tuple[Indices, Floats]:
    """The straight side (w,) of each wall, and the ends (s,2,2) of the sides: pieces in one line that
    overlap or have no more than a gap between them, gathered from the longest on."""
    size = np.hypot(*(walls.end - walls.start).T)
    of, sides = np.full(len(walls), -1), list[Floats]()
    for seed in np.argsort(-np.round(size, 6), kind="stable").tolist():
        if of[seed] >= 0:
            continue
        free, origin = np.flatnonzero(of < 0), walls.start[seed]
        along = (walls.end[seed] - origin) / size[seed]
        ends = np.stack([walls.start[free], walls.end[free]]) - origin
        off = ends @ np.array([-along[1], along[0]])
        flat = np.abs(off).max(0) <= FLAT_M
        flat = np.flatnonzero(flat & (np.abs(off[1] - off[0]) <= PARALLEL * size[free]))
        low, high = np.sort((ends @ along)[:, flat], axis=0)
        order = np.argsort(low, kind="stable")
        difference = low[order][1:] > np.maximum.accumulate(high[order])[:-1] + GAP_M
        group = np.append(0, np.cumsum(difference))
        mine = order[group == group[free[flat][order] == seed]]
        of[free[flat[mine]]] = len(sides)
        reach = np.array([low[mine].min(), high[mine].max()])
        sides.append(origin + reach[:, None] * along)
    return of, np.array(sides)


Chain = list[tuple[int, int]]


def _chains(sides: Floats, period: tuple[float, float] | None) -> Iterator[tuple[Chain, bool]]:
    """Follow joined sides, each with 1 where it is walked backward, and whether they close."""
    joined, visited = _joints(sides, period), set[int]()
    ends = [end for end in range(2 * len(sides)) if end not in joined]
    for first in [*ends, *range(0, 2 * len(sides), 2)]:
        chain: Chain = []
        at: int | None = first
        while at is not None and at // 2 not in visited:
            visited.add(at // 2)
            chain.append(divmod(at, 2))
            at = joined.get(at ^ 1)
        if chain:
            yield chain, at == first


def _joints(sides: Floats, period: tuple[float, float] | None) -> dict[int, int]:
    """Which end goes on at which, 2 s for the start of side s and 2 s + 1 for its end: those that
    meet before those with a gap, the straightest and then the nearest first."""
    ends = sides.reshape(-1, 2).copy()
    far = ends.reshape(-1, 2, 2)[:, ::-1].reshape(-1, 2).copy()
    way = far - ends  # away from the joint
    way /= np.sqrt((way**2).sum(1))[:, None]
    if period is not None:
        low, high = period
        ends[:, 0] -= np.where(np.abs(ends[:, 0] - high) <= GAP_M, high - low, 0.0)
    near = cKDTree(ends).query_pairs(GAP_M, output_type="ndarray").astype(int)
    one, other = near.T
    distance = np.hypot(*(ends[one] - ends[other]).T)
    distance = np.where(distance <= ROUNDING_M, 0.0, distance)
    turn = np.round((way[one] * way[other]).sum(1), 9)
    middle = np.round(far[one] + far[other], 6)  # of equal ones whatever their order in the plan
    joined: dict[int, int] = {}
    for pair in np.lexsort([middle[:, 1], middle[:, 0], turn, distance]).tolist():
        a, b = near[pair].tolist()
        own = a // 2 == b // 2 and period is None
        if not own and not {a, b} & joined.keys():
            joined |= {a: b, b: a}
    return joined


def _rank(point: Floats) -> tuple[float, ...]:
    """How far to the upper right a point is: in a direction that few walls have, so that a small gap
    changes no order."""
    return float(np.round(point @ [1.0, 0.618], 6)), float(np.round(point[0], 6))


def _begin(chain: Chain, sides: Floats) -> Floats:
    side, backward = chain[0]
    return np.asarray(sides[side, backward])


def _turned(chain: Chain, closed: bool, sides: Floats) -> tuple[Chain, bool]:
    """Let a chain begin at its lower left end, and a closed one run against the clock."""
    back = [(side, 1 - backward) for side, backward in reversed(chain)]
    if not closed:
        return min(chain, back, key=lambda one: _rank(_begin(one, sides))), False
    x, y = np.array([sides[side, backward] for side, backward in chain]).T
    if (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() < 0:
        chain = back
    first = min(range(len(chain)), key=lambda n: _rank(sides[chain[n]]))
    return chain[first:] + chain[:first], True


def _attached(sides: Floats, number: Indices, count: int) -> Mask:
    """Which outlines (o,) touch another."""
    lines = shapely.linestrings(sides)
    one, other = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=GAP_M)
    found = np.zeros(count, dtype=bool)
    found[number[one[number[one] != number[other]]]] = True
    return found
