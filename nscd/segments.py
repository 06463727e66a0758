"""Products and lengths of vectors, and nearest points of straight segments."""

import numpy as np

from nscd.arrays import Floats

# A nearest point that is nearer to an end than this (m) is the end: over the joint of two walls in
# line, rounding would put it into both.
ROUNDING_M = 1e-12


def dots(a: Floats, b: Floats) -> Floats:
    """Multiply vectors (…,2), for every processor alike, as products with `@` are not."""
    return np.asarray((a * b).sum(-1))


def lengths(vectors: Floats) -> Floats:
    """Compute the lengths of vectors (…,2), for every processor alike, as those of hypot are not."""
    return np.sqrt(dots(vectors, vectors))


def nearest_on_segment(points: Floats, start: Floats, end: Floats) -> Floats:
    """Find the point of a segment that is nearest to each of some points.

    points (n,2) m; start, end (2,) m: one segment for all of them, or (n,2): one each. Returns
    (n,2) m: start + s·(end − start) with s = (x − start)·(end − start)/|end − start|² cut to [0,
    1]. A segment without length is its start."""
    along = end - start
    square = dots(along, along)
    fraction = dots(points - start, along) / np.where(square > 0, square, 1.0)
    nearest: Floats = start + np.clip(fraction, 0.0, 1.0)[:, None] * along
    return nearest
