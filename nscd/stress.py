"""From contacts to fields: stress, wall traction, density and momentum of disks, coarse-grained.

Goldhirsch, Granular Matter 12 (2010) 239–252; walls: Weinhart, Thornton, Luding, Bokhove, Granular
Matter 14 (2012) 289–294. A disk counts as a point at its centre; a contact carries its percussion
along the branch ℓ from centre to centre, or from the centre to the contact point on a wall. With
percussions (N·s) stresses are in N·s/m, with forces (N) in N/m."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from nscd.arrays import Floats, read_only
from nscd.bodies import Snapshot
from nscd.compiling import inner, kernel
from nscd.contacts import Contacts
from nscd.smearing import Kernel, cells_of, smear, value_at, window

__all__ = [
    "FlowField", "Kernel", "StressField", "branches", "flow_field", "smear", "stress_field",
    "virial",
]  # fmt: skip

# below this length, in widths, a branch is a point: erf's difference would lose more than the
# midpoint does
SHORT = 1e-5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StressField:
    """Hold the coarse-grained contact stress at m points.

    stress: (m,2,2) N·s/m, Σ[:, a, b] = −Σ_c p_a ℓ_b ∫φ, negative in compression
    divergence: (m,2) N·s/m², div Σ, from the closed form of the derivative
    traction: (m,2) N·s/m², t, what walls give
    truncation: N·s/m, bound on the error of Σ by the cut of the kernel

    All per second (N/m, N/m²) where forces were given."""

    stress: Floats
    divergence: Floats
    traction: Floats
    truncation: float

    @property
    def pressure(self) -> Floats:
        """Compute −½ tr Σ (m,) N·s/m, positive in compression."""
        pressure: Floats = -0.5 * np.trace(self.stress, axis1=1, axis2=2)
        return pressure


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FlowField:
    """Hold the coarse-grained motion at m points.

    density: (m,) kg/m², Σmφ
    momentum: (m,2) kg/(m s), Σmuφ
    velocity: (m,2) m/s, their ratio
    gradient: (m,2,2) 1/s, gradient[:, a, b] = ∂u_a/∂x_b

    Velocity and gradient are NaN where no disk is within reach."""

    density: Floats
    momentum: Floats
    velocity: Floats
    gradient: Floats


def stress_field(
    snapshot: Snapshot, contacts: Contacts, impulse: ArrayLike, kernel: Kernel, at: ArrayLike
) -> StressField:
    """Compute stress, its divergence and wall traction at points.

    impulse: (k,2) N·s, p, or forces (k,2) N, that the first body of each contact gives to the
        second
    at: (m,2) m

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
        loads = Loads(start, branch, p, contacts.is_wall)
        out = Fields(stress, divergence, traction)
        _add_contacts(cells_of(points, kernel.reach), loads, kernel.weight, out)
    size = float((np.hypot(*p.T) * np.hypot(*branch.T)).sum())
    return StressField(
        stress=stress, divergence=divergence, traction=traction, truncation=kernel.neglected * size
    )


def branches(snapshot: Snapshot, contacts: Contacts) -> Floats:
    """Compute ℓ (k,2) m from the first centre to the second, or to the contact point of a wall."""
    end = contacts.point.copy()
    pairs = ~contacts.is_wall
    end[pairs] = snapshot.position[contacts.second[pairs]]
    branch: Floats = end - snapshot.position[contacts.first]
    return branch


def virial(snapshot: Snapshot, contacts: Contacts, impulse: ArrayLike) -> Floats:
    """Compute ∫Σ dx over the plane = −Σ_c p_c ⊗ ℓ_c, (2,2) N·s m, or N m of forces.

    impulse: (k,2) N·s or N

    Raises ValueError as `stress_field` does."""
    p = read_only(impulse, (len(contacts), 2), "impulse")
    contacts.check_disks(len(snapshot))
    total: Floats = -p.T @ branches(snapshot, contacts)
    return total


def flow_field(snapshot: Snapshot, velocity: ArrayLike, kernel: Kernel, at: ArrayLike) -> FlowField:
    """Compute density, momentum, velocity and its gradient at points, of disks that move.

    velocity: (n,2) m/s
    at: (m,2) m

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


class Loads(NamedTuple):
    """Hold branches: start (k,2) m, branch ℓ (k,2) m, impulse p (k,2) N·s, is_wall (k,)."""

    start: Any
    branch: Any
    impulse: Any
    is_wall: Any


class Fields(NamedTuple):
    """Hold what is added to: stress (m,2,2), divergence (m,2), traction (m,2)."""

    stress: Any
    divergence: Any
    traction: Any


@inner
def _along(along: float, across: float, length: float, width: float, compact: bool) -> float:
    """∫₀¹ φ ds on a branch of this length, seen from a point that is `along` after its start and
    `across` beside it (m)."""
    if length < SHORT * width:
        return value_at((along - 0.5 * length) ** 2 + across * across, width, compact)
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
                total += weight * value_at(s * s + across * across, width, True)
        return total * reach / length
    scale = 1.0 / (math.sqrt(2.0) * width)
    difference = math.erf(along * scale) - math.erf((along - length) * scale)
    height = math.exp(-((across * scale) ** 2)) / (2.0 * math.pi * width * width)
    return height * difference * width * math.sqrt(0.5 * math.pi) / length


@kernel
def _add_contacts(cells: Any, loads: Any, weight: Any, out: Any) -> None:
    points, order, begins, nx, ny, x0, y0, side = cells
    start, branch, impulse, is_wall = loads
    width, reach, compact = weight
    stress, divergence, traction = out
    for c in range(len(start)):
        sx, sy, lx, ly = start[c, 0], start[c, 1], branch[c, 0], branch[c, 1]
        px, py = impulse[c, 0], impulse[c, 1]
        if px == 0.0 and py == 0.0:
            continue
        length = math.sqrt(lx * lx + ly * ly)
        ex, ey = (lx / length, ly / length) if length > 0.0 else (1.0, 0.0)
        first, last = window(min(sx, sx + lx) - reach - x0, max(sx, sx + lx) + reach - x0, side, nx)
        low, high = window(min(sy, sy + ly) - reach - y0, max(sy, sy + ly) + reach - y0, side, ny)
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
                end = value_at((dx - lx) ** 2 + (dy - ly) ** 2, width, compact)
                change = value_at(dx * dx + dy * dy, width, compact) - end
                divergence[k, 0] -= px * change
                divergence[k, 1] -= py * change
                if is_wall[c]:
                    traction[k, 0] -= px * end
                    traction[k, 1] -= py * end
