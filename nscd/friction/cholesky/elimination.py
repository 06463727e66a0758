"""Dense elimination of the first rows of a symmetric matrix: the arithmetic of a front.

A front is kept in chunks of eight columns, row after row within a chunk, so that what is read
together lies together. The pivots' columns begin a chunk and the others begin one; what is beyond
the last column of either is zero. Only the upper half counts; what is below the diagonal within a
chunk that crosses it is overwritten with anything.

panel: the rows that are eliminated, `height` of them in each chunk, first the chunks of the
    pivots, then those of the others; row q of chunk c begins at (c · height + q) · 8
update: the others; chunk c has the 8 (c + 1) rows that reach it, and begins at 32 c (c + 1)"""

from __future__ import annotations

from typing import Any

import numpy as np

from nscd.compiling import inner, kernel
from nscd.compiling.vectors import less, load, spread, spread_from, store, times

# So many rows are eliminated before those after them are updated: what they leave to eight columns
# fits into the innermost cache.
PANEL = 96


@inner
def chunks(columns: int) -> int:
    """Count the chunks of some columns."""
    return (columns + 7) >> 3


@inner
def height_of(pivots: int) -> int:
    """Count the rows of a panel: blocks of four, or of eight where they are updated by eight."""
    return (pivots + 3) & ~3 if pivots <= PANEL else (pivots + 7) & ~7


@inner
def update_size(rest: int) -> int:
    """Count the numbers of an update."""
    return 32 * chunks(rest) * (chunks(rest) + 1)


@kernel(apart=True)
def eliminate(F: Any, panel: int, update: int, pivots: int, rest: int) -> bool:
    """Eliminate the pivots of the front whose panel and update begin there in F.

    Lᵀ is left in the panel with its diagonal inverted, the Schur complement in the update. Returns
    False where a pivot is not positive."""
    height, wide, more = height_of(pivots), chunks(pivots), chunks(rest)
    stride = 8 * height
    for q in range(pivots, height):
        F[panel + (q >> 3) * stride + 8 * q + (q & 7)] = 1.0
    for first in range(0, height, PANEL):
        last = min(first + PANEL, height)
        for row in range(first, last, 4):
            if not _eliminate_four(F, panel, height, first, row, wide + more):
                return False
        end = min(last, pivots)
        if last < height:
            for j in range(last >> 3, wide + more):
                with_j = panel + j * stride
                for i in range(last >> 3, min(j + 1, wide)):
                    _subtract_eight(F, with_j + 64 * i, panel + i * stride, with_j, first, end)
        others = panel + wide * stride
        for j in range(more):
            to, with_j = update + 32 * j * (j + 1), others + j * stride
            for i in range(j + 1):
                _subtract_eight(F, to + 64 * i, others + i * stride, with_j, first, end)
    return True


@inner
def _subtract_eight(F: Any, to: int, left: int, right: int, first: int, end: int) -> None:
    """Subtract Σ leftᵀ · right over rows first … end from eight rows of a chunk."""
    y0, y1, y2, y3 = load(F, to), load(F, to + 8), load(F, to + 16), load(F, to + 24)
    y4, y5, y6, y7 = load(F, to + 32), load(F, to + 40), load(F, to + 48), load(F, to + 56)
    for k in range(first, end):
        x, a = load(F, right + 8 * k), left + 8 * k
        y0 = less(y0, spread_from(F, a), x)
        y1 = less(y1, spread_from(F, a + 1), x)
        y2 = less(y2, spread_from(F, a + 2), x)
        y3 = less(y3, spread_from(F, a + 3), x)
        y4 = less(y4, spread_from(F, a + 4), x)
        y5 = less(y5, spread_from(F, a + 5), x)
        y6 = less(y6, spread_from(F, a + 6), x)
        y7 = less(y7, spread_from(F, a + 7), x)
    store(F, to, y0)
    store(F, to + 8, y1)
    store(F, to + 16, y2)
    store(F, to + 24, y3)
    store(F, to + 32, y4)
    store(F, to + 40, y5)
    store(F, to + 48, y6)
    store(F, to + 56, y7)


@inner
def _eliminate_four(F: Any, panel: int, height: int, first: int, row: int, count: int) -> bool:
    """Update four rows of a panel by those from `first` on, and eliminate them."""
    stride, own = 8 * height, row >> 3
    left = panel + own * stride + (row & 7)
    _subtract_four(F, panel + own * stride, left, first, row)
    diagonal = left + 8 * row
    factor = _factor_of_four(F, diagonal)
    if not factor[0] > 0.0:
        return False
    _scale_four(F, panel + own * stride + 8 * row, factor)
    for q in range(4):
        F[diagonal + 9 * q] = factor[q]
    c = own + 1
    if (count - c) & 1:
        _subtract_four(F, panel + c * stride, left, first, row)
        _scale_four(F, panel + c * stride + 8 * row, factor)
        c += 1
    while c < count:
        _subtract_and_scale(F, panel + c * stride, stride, left, first, row, factor)
        c += 2
    return True


@inner
def _subtract_four(F: Any, right: int, left: int, first: int, row: int) -> None:
    """Subtract Σ leftᵀ · right over rows first … row from four rows of the same chunk."""
    to = right + 8 * row
    y0, y1, y2, y3 = load(F, to), load(F, to + 8), load(F, to + 16), load(F, to + 24)
    for k in range(first, row):
        x, a = load(F, right + 8 * k), left + 8 * k
        y0 = less(y0, spread_from(F, a), x)
        y1 = less(y1, spread_from(F, a + 1), x)
        y2 = less(y2, spread_from(F, a + 2), x)
        y3 = less(y3, spread_from(F, a + 3), x)
    store(F, to, y0)
    store(F, to + 8, y1)
    store(F, to + 16, y2)
    store(F, to + 24, y3)


@inner
def _factor_of_four(F: Any, at: int) -> Any:
    """The Cholesky factor of four rows and columns: its inverted diagonal, then what is above it by
    rows; the first is 0 where there is none."""
    no = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    # square roots last, so that nothing waits for them
    p, a01, a02, a03 = F[at], F[at + 1], F[at + 2], F[at + 3]
    if not p > 0.0:
        return no
    r0 = 1.0 / p
    m1, m2, m3 = a01 * r0, a02 * r0, a03 * r0
    p, a12, a13 = F[at + 9] - m1 * a01, F[at + 10] - m1 * a02, F[at + 11] - m1 * a03
    if not p > 0.0:
        return no
    r1 = 1.0 / p
    q2, q3 = a12 * r1, a13 * r1
    p, a23 = F[at + 18] - m2 * a02 - q2 * a12, F[at + 19] - m2 * a03 - q2 * a13
    if not p > 0.0:
        return no
    r2 = 1.0 / p
    p = F[at + 27] - m3 * a03 - q3 * a13 - a23 * r2 * a23
    if not p > 0.0:
        return no
    i0, i1, i2, i3 = np.sqrt(r0), np.sqrt(r1), np.sqrt(r2), np.sqrt(1.0 / p)
    return i0, i1, i2, i3, a01 * i0, a02 * i0, a03 * i0, a12 * i1, a13 * i1, a23 * i2


@inner
def _scale_four(F: Any, at: int, factor: Any) -> None:
    """Multiply four rows of a chunk by the inverse of the transposed factor."""
    i0, i1, i2, i3, e01, e02, e03, e12, e13, e23 = factor
    x0 = times(load(F, at), spread(i0))
    x1 = times(less(load(F, at + 8), spread(e01), x0), spread(i1))
    x2 = less(less(load(F, at + 16), spread(e02), x0), spread(e12), x1)
    x2 = times(x2, spread(i2))
    x3 = less(less(load(F, at + 24), spread(e03), x0), spread(e13), x1)
    x3 = times(less(x3, spread(e23), x2), spread(i3))
    store(F, at, x0)
    store(F, at + 8, x1)
    store(F, at + 16, x2)
    store(F, at + 24, x3)


@inner
def _subtract_and_scale(
    F: Any, one: int, stride: int, left: int, first: int, row: int, factor: Any
) -> None:
    """Both for two chunks, sixteen columns, at a time."""
    two = one + stride
    i0, i1, i2, i3, e01, e02, e03, e12, e13, e23 = factor
    at, to = one + 8 * row, two + 8 * row
    x0, x1, x2, x3 = load(F, at), load(F, at + 8), load(F, at + 16), load(F, at + 24)
    y0, y1, y2, y3 = load(F, to), load(F, to + 8), load(F, to + 16), load(F, to + 24)
    for k in range(first, row):
        x, y, a = load(F, one + 8 * k), load(F, two + 8 * k), left + 8 * k
        f = spread_from(F, a)
        x0, y0 = less(x0, f, x), less(y0, f, y)
        f = spread_from(F, a + 1)
        x1, y1 = less(x1, f, x), less(y1, f, y)
        f = spread_from(F, a + 2)
        x2, y2 = less(x2, f, x), less(y2, f, y)
        f = spread_from(F, a + 3)
        x3, y3 = less(x3, f, x), less(y3, f, y)
    x0, y0 = times(x0, spread(i0)), times(y0, spread(i0))
    x1, y1 = less(x1, spread(e01), x0), less(y1, spread(e01), y0)
    x1, y1 = times(x1, spread(i1)), times(y1, spread(i1))
    x2, y2 = less(x2, spread(e02), x0), less(y2, spread(e02), y0)
    x2, y2 = less(x2, spread(e12), x1), less(y2, spread(e12), y1)
    x2, y2 = times(x2, spread(i2)), times(y2, spread(i2))
    x3, y3 = less(x3, spread(e03), x0), less(y3, spread(e03), y0)
    x3, y3 = less(x3, spread(e13), x1), less(y3, spread(e13), y1)
    x3, y3 = less(x3, spread(e23), x2), less(y3, spread(e23), y2)
    x3, y3 = times(x3, spread(i3)), times(y3, spread(i3))
    store(F, at, x0)
    store(F, at + 8, x1)
    store(F, at + 16, x2)
    store(F, at + 24, x3)
    store(F, to, y0)
    store(F, to + 8, y1)
    store(F, to + 16, y2)
    store(F, to + 24, y3)
