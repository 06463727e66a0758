"""Nearest points of straight segments, and how walls meet."""

from typing import NamedTuple

import numpy as np

from nscd.arrays import Flags, Floats, Index32

# Ends of walls that are nearer to each other than this (m) are one point.
SAME_POINT_M = 1e-9
# A nearest point that is nearer to an end than this (m) is the end: over the joint of two walls in
# line, rounding would put it into both.
ROUNDING_M = 1e-12


class Segments(NamedTuple):
    """Connected walls as the core takes them.

    start, along: (w,2) m
    vertex: (w,2) numbers of their two ends, the same where walls meet
    inner: (w,2) whether the end lies within another wall"""

    start: Floats
    along: Floats
    vertex: Index32
    inner: Flags


def nearest_on_segment(points: Floats, start: Floats, end: Floats) -> Floats:
    """Find the point of a segment that is nearest to each of some points.

    points (n,2) m; start, end (2,) m: one segment for all of them, or (n,2): one each. Returns
    (n,2) m: start + s·(end − start) with s = (x − start)·(end − start)/|end − start|² cut to [0,
    1]. A segment without length is its start."""
    along = end - start
    square = _dot(along, along)
    share = _dot(points - start, along) / np.where(square > 0, square, 1.0)
    nearest: Floats = start + np.clip(share, 0.0, 1.0)[:, None] * along
    return nearest


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(a @ b if b.ndim == 1 else (a * b).sum(1))


def connect(start: Floats, end: Floats) -> Segments:
    """Find where walls from start to end, both (w,2) m, meet: at their ends, or an end within
    another wall."""
    count = len(start)
    ends = np.stack([start, end], axis=1).reshape(-1, 2)
    vertex = np.arange(2 * count)
    for number in range(2 * count):
        apart = np.hypot(*(ends[:number] - ends[number]).T)
        if number and apart.min() <= SAME_POINT_M:
            vertex[number] = vertex[int(np.argmin(apart))]
    inner = np.zeros(2 * count, dtype=bool)
    for number in range(count):
        distance = np.hypot(*(nearest_on_segment(ends, start[number], end[number]) - ends).T)
        own = (vertex == vertex[2 * number]) | (vertex == vertex[2 * number + 1])
        inner |= (distance <= SAME_POINT_M) & ~own
    return Segments(
        np.array(start, dtype=np.float64),
        np.array(end - start, dtype=np.float64),
        vertex.reshape(-1, 2).astype(np.int32),
        inner.reshape(-1, 2),
    )
