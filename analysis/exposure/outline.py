"""Joined walls as outlines with an arc length, so that a load per metre does not depend on the pieces
in which a plan draws them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from nscd import Walls
from nscd.arrays import Floats, Indices

# Ends of walls this near (m) are one joint.
JOINT_M = 1e-6
# Of more than two walls at a joint those go on that turn by less than this (sine).
STRAIGHT = 1e-6
# The stretch of an outline (m) on which a line load is taken.
STRETCH_M = 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outlines:
    """Give w walls their places on outlines.

    number: (w,) the outline of each wall
    arc: (w,) m, arc length at its start; forward: (w,) ±1, whether arc length grows to its end
    length: (o,) m; closed: (o,) whether the end of the outline is its start"""

    walls: Walls
    number: Indices
    arc: Floats
    forward: Indices
    length: Floats
    closed: Sequence[bool]

    @classmethod
    def of(cls, walls: Walls) -> Outlines:
        """Join walls at their ends: two that meet there alone, or go on straight among several."""
        joined = _joints(walls)
        size = np.hypot(*(walls.end - walls.start).T)
        number, arc = np.full(len(walls), -1), np.zeros(len(walls))
        forward = np.ones(len(walls), dtype=int)
        length: list[float] = []
        closed: list[bool] = []
        # open outlines from an end of theirs, then those without an end
        ends = [end for end in range(2 * len(walls)) if end not in joined]
        for first in itertools.chain(ends, range(0, 2 * len(walls), 2)):
            if number[first // 2] >= 0:
                continue
            total = 0.0
            at: int | None = first
            while at is not None and number[wall := at // 2] < 0:
                number[wall], backward = len(length), at % 2
                arc[wall] = total + backward * size[wall]
                forward[wall] = 1 - 2 * backward
                total += float(size[wall])
                at = joined.get(at ^ 1)
            length.append(total)
            closed.append(at == first)
        return cls(walls=walls, number=number, arc=arc, forward=forward,
                   length=np.array(length), closed=closed)  # fmt: skip

    def arcs(self, wall: Indices, position: Floats) -> Floats:
        """Give the arc length (k,) m of the points of walls next to positions (k,2) m."""
        start, way = self.walls.start[wall], (self.walls.end - self.walls.start)[wall]
        size = np.sqrt((way**2).sum(1))
        along = np.clip(((position - start) * way).sum(1) / size, 0.0, size)
        arcs: Floats = self.arc[wall] + self.forward[wall] * along
        return arcs

    def line_loads(self, wall: Indices, position: Floats, force: Floats) -> Floats:
        """Compute for each of w walls the largest mean load (N/m) of all stretches of 1 m, or of a
        shorter whole outline, that hold a contact on it.

        wall, position, force: of k contacts (k,) the wall, (k,2) m the position and (k,) N"""
        found = np.zeros(len(self.walls))
        arc, outline = self.arcs(wall, position), self.number[wall]
        for number in np.unique(outline):
            mine = np.flatnonzero(outline == number)
            mine = mine[np.argsort(arc[mine], kind="stable")]
            stretch, place = min(STRETCH_M, float(self.length[number])), arc[mine]
            if self.closed[number] and stretch < self.length[number]:
                place, mine = np.append(place, place + self.length[number]), np.tile(mine, 2)
            sums = np.concatenate([[0.0], np.cumsum(force[mine])])
            # rounding of arc lengths is no reason to lose a contact
            ends = np.searchsorted(place, place + stretch + JOINT_M, side="right")
            for first, end in enumerate(ends.tolist()):
                load = (sums[end] - sums[first]) / stretch
                np.maximum.at(found, wall[mine[first:end]], load)
        return found


def _joints(walls: Walls) -> dict[int, int]:
    """Which end goes on at which, 2 w for the start of wall w and 2 w + 1 for its end."""
    ends = np.stack([walls.start, walls.end], axis=1).reshape(-1, 2)
    if walls.period_x is not None:
        low, high = walls.period_x
        ends[:, 0] -= np.where(np.abs(ends[:, 0] - high) <= JOINT_M, high - low, 0.0)
    way = np.repeat(walls.end - walls.start, 2, axis=0)
    way[1::2] *= -1  # away from the joint
    way /= np.sqrt((way**2).sum(1))[:, None]
    near = cKDTree(ends).query_pairs(JOINT_M, output_type="ndarray") if len(ends) else ends
    meeting = np.bincount(near.astype(int).ravel(), minlength=len(ends))
    joined: dict[int, int] = {}
    for one, other in near.astype(int).tolist():
        turn = abs(way[one, 0] * way[other, 1] - way[one, 1] * way[other, 0])
        straight = turn < STRAIGHT and way[one] @ way[other] < 0
        alone = meeting[one] == meeting[other] == 1
        if one // 2 != other // 2 and (alone or straight) and not {one, other} & joined.keys():
            joined |= {one: other, other: one}
    return joined
