"""From contacts to fields: stress, wall traction, density and momentum of disks, coarse-grained.

Goldhirsch, Granular Matter 12 (2010) 239–252; walls: Weinhart, Thornton, Luding, Bokhove, Granular
Matter 14 (2012) 289–294. A disk counts as a point at its centre; a contact carries its percussion
along the branch ℓ from centre to centre, or from the centre to the contact point on a wall. With
percussions (N·s) stresses are in N·s/m, with forces (N) in N/m."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from nscd.arrays import Floats, Indices, read_only
from nscd.bodies import Snapshot
from nscd.contacts import Contacts

# below this length, in widths, a branch is a point: erf's difference would lose more than the
# midpoint does
SHORT = 1e-5
MOST_CELLS = 512


@dataclass(frozen=True, slots=True, kw_only=True)
class Kernel:
    """An isotropic kernel φ of unit integral in the plane; width w (m): its standard deviation
    along an axis.

    Gaussian: φ = exp(−r²/2w²)/(2πw²), cut where r > cutoff·w; what is cut is below exp(−cutoff²/2)
    of φ(0). compact: φ = 4/(πR²)·(1 − r²/R²)³ for r < R = √10 w, twice continuously differentiable,
    nothing to cut.

    Raises ValueError for a width that is not positive and finite, or a cutoff below 1.
    """

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
        """Beyond this distance (m) the kernel counts as zero."""
        return math.sqrt(10.0) * self.width if self.compact else self.cutoff * self.width

    @property
    def neglected(self) -> float:
        """Largest value (1/m²) that the kernel has beyond its reach."""
        return (
            0.0 if self.compact else math.exp(-0.5 * self.cutoff**2) / (2 * math.pi * self.width**2)
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StressField:
    """Coarse-grained contact stress at m points.

    stress Σ (m,2,2) N·s/m, negative in compression, Σ[:, a, b] = −Σ_c p_a ℓ_b ∫φ; divergence div Σ
    (m,2) N·s/m², from the closed form of the derivative; traction t (m,2) N·s/m², what walls give;
    truncation (N·s/m): bound on the error of Σ by the cut of the kernel. All per second less (N/m,
    N/m²) where forces were given."""

    stress: Floats
    divergence: Floats
    traction: Floats
    truncation: float

    @property
    def pressure(self) -> Floats:
        """−½ tr Σ (m,) N·s/m, positive in compression."""
        pressure: Floats = -0.5 * np.trace(self.stress, axis1=1, axis2=2)
        return pressure


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FlowField:
    """Coarse-grained motion at m points: density Σmφ (m,) kg/m², momentum Σmuφ (m,2) kg/(m s),
    their ratio velocity (m,2) m/s and its gradient (m,2,2) 1/s, gradient[:, a, b] = ∂u_a/∂x_b; both
    are NaN where no disk is within reach."""

    density: Floats
    momentum: Floats
    velocity: Floats
    gradient: Floats


def stress_field(
    snapshot: Snapshot, contacts: Contacts, impulse: ArrayLike, kernel: Kernel, at: ArrayLike
) -> StressField:
    """Stress, its divergence and wall traction at the points `at` (m,2) m, of impulses p (k,2) N·s
    or forces (k,2) N that the first body of each contact gives to the second.

    Σ(x) = −Σ_c p_c ⊗ ℓ_c ∫₀¹ φ(x − x_i − sℓ_c) ds, ℓ = x_j − x_i (wall: contact point − x_i), and
    t(x) = −Σ_wall p φ(x − x_contact). Exact for any kernel: Σ_i m_iΔu_iφ(x − x_i) = div Σ + t. The
    line integral is a difference of erf (Gaussian) or a polynomial (compact). No contacts: no
    stress.

    Raises ValueError for wrong shapes, non-finite numbers and contacts that name disks which do not
    exist."""
    points = read_only(at, (-1, 2), "at")
    p = read_only(impulse, (len(contacts), 2), "impulse")
    contacts.check_disks(len(snapshot))
    start, branch = snapshot.position[contacts.first], branches(snapshot, contacts)
    m = len(points)
    stress, divergence, traction = np.zeros((m, 2, 2)), np.zeros((m, 2)), np.zeros((m, 2))
    if m and len(contacts):
        cells = _cells(points, kernel.reach)
        arrays = (start, branch, p, contacts.is_wall, kernel.width, kernel.reach, kernel.compact)
        _add_contacts(points, *cells, *arrays, stress, divergence, traction)
    size = float((np.hypot(*p.T) * np.hypot(*branch.T)).sum())
    return StressField(
        stress=stress, divergence=divergence, traction=traction, truncation=kernel.neglected * size
    )


def branches(snapshot: Snapshot, contacts: Contacts) -> Floats:
    """ℓ of each contact (k,2) m: from the first centre to the second, or to the contact point of a
    wall."""
    end = contacts.point.copy()
    pairs = ~contacts.is_wall
    end[pairs] = snapshot.position[contacts.second[pairs]]
    branch: Floats = end - snapshot.position[contacts.first]
    return branch


def virial(snapshot: Snapshot, contacts: Contacts, impulse: ArrayLike) -> Floats:
    """∫Σ dx over the plane = −Σ_c p_c ⊗ ℓ_c, (2,2) N·s m (N m of forces). Raises ValueError as
    `stress_field` does."""
    p = read_only(impulse, (len(contacts), 2), "impulse")
    contacts.check_disks(len(snapshot))
    total: Floats = -p.T @ branches(snapshot, contacts)
    return total


def smear(
    position: ArrayLike, values: ArrayLike, kernel: Kernel, at: ArrayLike
) -> tuple[Floats, Floats]:
    """Σ_i values_i φ(x − x_i) at the points (m,2), shape (m,d), and its gradient (m,d,2), of values
    (n,d) at position (n,2) m.

    With a quadrature's points and weights × values it convolves a continuous field with the same
    kernel. Raises ValueError for wrong shapes and non-finite numbers."""
    points, where = read_only(at, (-1, 2), "at"), read_only(position, (-1, 2), "position")
    what = read_only(values, (len(where), -1), "values")
    field, gradient = (
        np.zeros((len(points), what.shape[1])),
        np.zeros((len(points), what.shape[1], 2)),
    )
    if len(points) and len(where):
        cells = _cells(points, kernel.reach)
        _add_points(
            points, *cells, where, what, kernel.width, kernel.reach, kernel.compact, field, gradient
        )
    return field, gradient


def flow_field(snapshot: Snapshot, velocity: ArrayLike, kernel: Kernel, at: ArrayLike) -> FlowField:
    """Density, momentum, velocity and its gradient at the points (m,2) m, of disks that move with
    velocity (n,2) m/s.

    ρ = Σmφ, ρu = Σmu_iφ, ∂u_a/∂x_b = (∂(ρu_a)/∂x_b − u_a ∂ρ/∂x_b)/ρ. Raises ValueError as `smear`
    does."""
    u = read_only(velocity, (len(snapshot), 2), "velocity")
    mass = snapshot.mass[:, None]
    field, slope = smear(snapshot.position, np.hstack([mass, mass * u]), kernel, at)
    density = np.where(field[:, 0] > 0, field[:, 0], np.nan)
    velocity_field = field[:, 1:] / density[:, None]
    gradient = slope[:, 1:] - velocity_field[:, :, None] * slope[:, :1]
    return FlowField(
        density=field[:, 0],
        momentum=field[:, 1:],
        velocity=velocity_field,
        gradient=gradient / density[:, None, None],
    )


def _cells(points: Floats, reach: float) -> tuple[Indices, Indices, int, int, float, float, float]:
    """Points sorted into square cells: order (m,), where each cell begins, cells along x and y,
    corner and side (m)."""
    low, extent = points.min(0), float(np.ptp(points, axis=0).max())
    side = max(reach, extent / MOST_CELLS)
    column, row = ((points - low) / side).astype(np.int64).T
    nx, ny = int(column.max()) + 1, int(row.max()) + 1
    key = column * ny + row
    order: Indices = np.argsort(key, kind="stable")
    begins = np.searchsorted(key[order], np.arange(nx * ny + 1))
    return order, begins, nx, ny, float(low[0]), float(low[1]), side


@njit(cache=True)
def _value(d2: float, width: float, compact: bool) -> float:
    if compact:
        inside = 1.0 - d2 / (10.0 * width * width)
        return 4.0 / (math.pi * 10.0 * width * width) * inside**3 if inside > 0.0 else 0.0
    return math.exp(-0.5 * d2 / (width * width)) / (2.0 * math.pi * width * width)


@njit(cache=True)
def _slope(d2: float, width: float, compact: bool) -> float:
    """∇φ(d) = slope · d."""
    if compact:
        inside = 1.0 - d2 / (10.0 * width * width)
        return -2.4 / (math.pi * 10.0 * width**4) * inside**2 if inside > 0.0 else 0.0
    return -_value(d2, width, False) / (width * width)


@njit(cache=True)
def _along(along: float, across: float, length: float, width: float, compact: bool) -> float:
    """∫₀¹ φ ds on a branch of this length, seen from a point that is `along` after its start and
    `across` beside it (m)."""
    if length < SHORT * width:
        return _value((along - 0.5 * length) ** 2 + across * across, width, compact)
    if compact:
        half2 = 10.0 * width * width - across * across
        if half2 <= 0.0:
            return 0.0
        half = math.sqrt(half2)
        a, b = max(-half, -along), min(half, length - along)
        if a >= b:
            return 0.0
        middle, reach = 0.5 * (a + b), 0.5 * (b - a)
        # Gauss–Legendre with 4 points is exact for this polynomial of degree 6
        total = 0.0
        for node, weight in (
            (0.33998104358485626, 0.6521451548625461),
            (0.8611363115940526, 0.34785484513745385),
        ):
            for side in (-1.0, 1.0):
                s = middle + side * node * reach
                total += weight * _value(s * s + across * across, width, True)
        return total * reach / length
    scale = 1.0 / (math.sqrt(2.0) * width)
    difference = math.erf(along * scale) - math.erf((along - length) * scale)
    height = math.exp(-((across * scale) ** 2)) / (2.0 * math.pi * width * width)
    return height * difference * width * math.sqrt(0.5 * math.pi) / length


@njit(cache=True)
def _window(low: float, high: float, side: float, count: int) -> tuple[int, int]:
    """First and last of `count` cells that the interval meets (m from the first cell); first >
    last: none."""
    return max(math.floor(low / side), 0), min(math.floor(high / side), count - 1)


@njit(cache=True)
def _add_contacts(
    points: Any, order: Any, begins: Any, nx: int, ny: int, x0: float, y0: float, side: float,
    start: Any, branch: Any, impulse: Any, is_wall: Any, width: float, reach: float, compact: bool,
    stress: Any, divergence: Any, traction: Any,
) -> None:  # fmt: skip
    for c in range(len(start)):
        sx, sy, lx, ly = start[c, 0], start[c, 1], branch[c, 0], branch[c, 1]
        px, py = impulse[c, 0], impulse[c, 1]
        if px == 0.0 and py == 0.0:
            continue
        length = math.sqrt(lx * lx + ly * ly)
        ex, ey = (lx / length, ly / length) if length > 0.0 else (1.0, 0.0)
        first, last = _window(
            min(sx, sx + lx) - reach - x0, max(sx, sx + lx) + reach - x0, side, nx
        )
        low, high = _window(min(sy, sy + ly) - reach - y0, max(sy, sy + ly) + reach - y0, side, ny)
        for column in range(first, last + 1):
            if low > high:
                break
            for place in range(begins[column * ny + low], begins[column * ny + high + 1]):
                k = order[place]
                dx, dy = points[k, 0] - sx, points[k, 1] - sy
                along, across = dx * ex + dy * ey, dy * ex - dx * ey
                beyond = max(0.0, -along, along - length)
                if across * across + beyond * beyond > reach * reach:
                    continue
                mean = _along(along, across, length, width, compact)
                stress[k, 0, 0] -= px * lx * mean
                stress[k, 0, 1] -= px * ly * mean
                stress[k, 1, 0] -= py * lx * mean
                stress[k, 1, 1] -= py * ly * mean
                # ℓ·∇ of the line integral is φ at the start less φ at the end
                end = _value((dx - lx) ** 2 + (dy - ly) ** 2, width, compact)
                change = _value(dx * dx + dy * dy, width, compact) - end
                divergence[k, 0] -= px * change
                divergence[k, 1] -= py * change
                if is_wall[c]:
                    traction[k, 0] -= px * end
                    traction[k, 1] -= py * end


@njit(cache=True)
def _add_points(
    points: Any, order: Any, begins: Any, nx: int, ny: int, x0: float, y0: float, side: float,
    where: Any, what: Any, width: float, reach: float, compact: bool, field: Any, gradient: Any,
) -> None:  # fmt: skip
    for i in range(len(where)):
        sx, sy = where[i, 0], where[i, 1]
        first, last = _window(sx - reach - x0, sx + reach - x0, side, nx)
        low, high = _window(sy - reach - y0, sy + reach - y0, side, ny)
        for column in range(first, last + 1):
            if low > high:
                break
            for place in range(begins[column * ny + low], begins[column * ny + high + 1]):
                k = order[place]
                dx, dy = points[k, 0] - sx, points[k, 1] - sy
                d2 = dx * dx + dy * dy
                if d2 > reach * reach:
                    continue
                value, slope = _value(d2, width, compact), _slope(d2, width, compact)
                for d in range(what.shape[1]):
                    field[k, d] += what[i, d] * value
                    gradient[k, d, 0] += what[i, d] * slope * dx
                    gradient[k, d, 1] += what[i, d] * slope * dy
