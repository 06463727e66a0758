"""Smearing: values at points become fields, by an isotropic kernel."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from nscd.arrays import Floats, read_only
from nscd.compiling import inner, kernel

# Cells along the longer side of the points, at most.
MOST_CELLS = 512


@dataclass(frozen=True, slots=True, kw_only=True)
class Kernel:
    """Set an isotropic kernel φ of unit integral in the plane.

    width: m, w, its standard deviation along an axis
    compact: φ = 4/(πR²)·(1 − r²/R²)³ for r < R = √10 w, twice continuously differentiable,
        nothing to cut; otherwise the Gaussian φ = exp(−r²/2w²)/(2πw²)
    cutoff: in widths, where the Gaussian is cut; what is cut is below exp(−cutoff²/2) of φ(0)

    Raises ValueError for a width that is not positive and finite, or a cutoff below 1."""

    width: float
    compact: bool = False
    cutoff: float = 6.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.width) and self.width > 0):
            raise ValueError(f"width: {self.width} m; a kernel needs a positive width")
        if not (np.isfinite(self.cutoff) and self.cutoff >= 1):
            raise ValueError(f"cutoff: {self.cutoff} widths; at least 1 is needed")

    @property
    def reach(self) -> float:
        """Compute the distance (m) beyond which the kernel counts as zero."""
        return math.sqrt(10.0) * self.width if self.compact else self.cutoff * self.width

    @property
    def weight(self) -> Weight:
        """Give the kernel as the compiled loops take it."""
        return Weight(self.width, self.reach, self.compact)

    @property
    def neglected(self) -> float:
        """Compute the largest value (1/m²) that the kernel has beyond its reach."""
        return (
            0.0 if self.compact else math.exp(-0.5 * self.cutoff**2) / (2 * math.pi * self.width**2)
        )


class Weight(NamedTuple):
    """Hold a kernel for compiled loops: width and reach (m), and which of the two it is."""

    width: float
    reach: float
    compact: bool


class Cells(NamedTuple):
    """Hold points sorted into square cells.

    points: (m,2) m
    order: (m,)
    begins: where each cell begins in it
    nx, ny: cells along x and y
    x0, y0: m, their corner
    side: m, of a cell"""

    points: Any
    order: Any
    begins: Any
    nx: int
    ny: int
    x0: float
    y0: float
    side: float


def smear(
    position: ArrayLike, values: ArrayLike, kernel: Kernel, at: ArrayLike
) -> tuple[Floats, Floats]:
    """Compute Σ_i values_i φ(x − x_i), shape (m,d), and its gradient (m,d,2) at points.

    position: (n,2) m, x_i
    values: (n,d)
    at: (m,2) m, x

    With a quadrature's points and weights × values it convolves a continuous field with the same
    kernel. Raises ValueError for wrong shapes and non-finite numbers."""
    points, where = read_only(at, (-1, 2), "at"), read_only(position, (-1, 2), "position")
    what = read_only(values, (len(where), -1), "values")
    field, gradient = (
        np.zeros((len(points), what.shape[1])),
        np.zeros((len(points), what.shape[1], 2)),
    )
    if len(points) and len(where):
        _add_points(cells_of(points, kernel.reach), where, what, kernel.weight, field, gradient)
    return field, gradient


def cells_of(points: Floats, reach: float) -> Cells:
    """Sort points (m,2) m into cells at least as large as the reach (m) of a kernel."""
    low, extent = points.min(0), float(np.ptp(points, axis=0).max())
    side = max(reach, extent / MOST_CELLS)
    column, row = ((points - low) / side).astype(np.int64).T
    nx, ny = int(column.max()) + 1, int(row.max()) + 1
    key = column * ny + row
    order = np.argsort(key, kind="stable")
    begins = np.searchsorted(key[order], np.arange(nx * ny + 1))
    return Cells(points, order, begins, nx, ny, float(low[0]), float(low[1]), side)


@inner
def value_at(d2: float, width: float, compact: bool) -> float:
    """Compute φ (1/m²) at the squared distance d2 (m²) from its middle."""
    if compact:
        inside = 1.0 - d2 / (10.0 * width * width)
        return 4.0 / (math.pi * 10.0 * width * width) * inside**3 if inside > 0.0 else 0.0
    return math.exp(-0.5 * d2 / (width * width)) / (2.0 * math.pi * width * width)


@inner
def _slope(d2: float, width: float, compact: bool) -> float:
    """∇φ(d) = slope · d."""
    if compact:
        inside = 1.0 - d2 / (10.0 * width * width)
        return -2.4 / (math.pi * 10.0 * width**4) * inside**2 if inside > 0.0 else 0.0
    return -value_at(d2, width, False) / (width * width)


@inner
def window(low: float, high: float, side: float, count: int) -> tuple[int, int]:
    """Find the first and last of `count` cells that an interval (m from the first) meets; none:
    first > last."""
    return max(math.floor(low / side), 0), min(math.floor(high / side), count - 1)


@kernel
def _add_points(cells: Any, where: Any, what: Any, weight: Any, field: Any, gradient: Any) -> None:
    points, order, begins, nx, ny, x0, y0, side = cells
    width, reach, compact = weight
    for i in range(len(where)):
        sx, sy = where[i, 0], where[i, 1]
        first, last = window(sx - reach - x0, sx + reach - x0, side, nx)
        low, high = window(sy - reach - y0, sy + reach - y0, side, ny)
        for column in range(first, last + 1):
            if low > high:
                break
            for place in range(begins[column * ny + low], begins[column * ny + high + 1]):
                k = order[place]
                dx, dy = points[k, 0] - sx, points[k, 1] - sy
                d2 = dx * dx + dy * dy
                if d2 > reach * reach:
                    continue
                value, slope = value_at(d2, width, compact), _slope(d2, width, compact)
                for d in range(what.shape[1]):
                    field[k, d] += what[i, d] * value
                    gradient[k, d, 0] += what[i, d] * slope * dx
                    gradient[k, d, 1] += what[i, d] * slope * dy
