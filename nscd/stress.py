"""From contacts to fields: stress, wall traction, density and momentum of disks, coarse-grained.

Goldhirsch, Granular Matter 12 (2010) 239–252; walls: Weinhart, Thornton, Luding, Bokhove, Granular
Matter 14 (2012) 289–294. A disk, or a body of several, counts as a point at its centre; a contact
carries its percussion along the branch ℓ from centre to centre, or to the contact point on a wall. With
percussions (N·s) stresses are in N·s/m, with forces (N) in N/m."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from nscd import _core
from nscd.arrays import Floats, number, read_only
from nscd.bodies import Snapshot
from nscd.contacts import Contacts

__all__ = [
    "FlowField",
    "Kernel",
    "StressField",
    "branches",
    "coarse_grain",
    "flow_field",
    "stress_field",
    "virial",
]  # fmt: skip


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
        if not number(self.width, "width", "A positive width (m)") > 0:
            raise ValueError(f"width: {self.width} m. A kernel needs a positive width")
        if not number(self.cutoff, "cutoff", "At least 1 width") >= 1:
            raise ValueError(f"cutoff: {self.cutoff} widths. At least 1 is needed")

    @property
    def reach(self) -> float:
        """Compute the distance (m) beyond which the kernel counts as zero."""
        return math.sqrt(10.0) * self.width if self.compact else self.cutoff * self.width

    @property
    def neglected(self) -> float:
        """Compute the largest value (1/m²) that the kernel has beyond its reach."""
        return (
            0.0 if self.compact else math.exp(-0.5 * self.cutoff**2) / (2 * math.pi * self.width**2)
        )


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


def coarse_grain(
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
    found = _core.coarse_grain(points, where, what, kernel.width, kernel.reach, kernel.compact)
    return found.field, found.gradient.reshape(*found.field.shape, 2)


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
    start, branch = _centres(snapshot)[contacts.first], branches(snapshot, contacts)
    found = _core.coarse_grain_stress(
        points, start, branch, p, contacts.is_wall, kernel.width, kernel.reach, kernel.compact
    )
    size = float((np.hypot(*p.T) * np.hypot(*branch.T)).sum())
    return StressField(
        stress=found.stress.reshape(-1, 2, 2),
        divergence=found.divergence,
        traction=found.traction,
        truncation=kernel.neglected * size,
    )


def branches(snapshot: Snapshot, contacts: Contacts) -> Floats:
    """Compute ℓ (k,2) m from the first centre to the second, or to the contact point of a wall."""
    end, centre = contacts.point.copy(), _centres(snapshot)
    pairs = ~contacts.is_wall
    end[pairs] = centre[contacts.second[pairs]]
    branch: Floats = end - centre[contacts.first]
    return branch


def _centres(snapshot: Snapshot) -> Floats:
    """Where (n,2) m each disk, or the body that it is joined to, has its centre of mass."""
    compound = snapshot.compound
    return snapshot.position if compound is None else compound.centre[compound.number]


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

    ρ = Σmφ, ρu = Σmu_iφ, ∂u_a/∂x_b = (∂(ρu_a)/∂x_b − u_a ∂ρ/∂x_b)/ρ. Raises ValueError as `coarse_grain`
    does."""
    u = read_only(velocity, (len(snapshot), 2), "velocity")
    mass = snapshot.mass[:, None]
    field, slope = coarse_grain(snapshot.position, np.hstack([mass, mass * u]), kernel, at)
    density = np.where(field[:, 0] > 0, field[:, 0], np.nan)
    velocity_field = field[:, 1:] / density[:, None]
    gradient = slope[:, 1:] - velocity_field[:, :, None] * slope[:, :1]
    return FlowField(
        density=field[:, 0],
        momentum=field[:, 1:],
        velocity=velocity_field,
        gradient=gradient / density[:, None, None],
    )
