"""The first-order macroscopic crowd: the pressure of paper (20), as complementarity and as printed,
and (20) with internal friction, of a crowd that resists shear in proportion to its pressure."""

import enum
import time
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.sparse as sparse
from numpy.typing import ArrayLike
from scipy.sparse.linalg import splu
from skfem import Mesh, MeshTri1

from nscd.arrays import Floats, Mask
from nscd.continuum.active_set import bounded_minimum, factorised, judged
from nscd.continuum.left_velocity import Field
from nscd.continuum.medium import positive
from nscd.continuum.rivals.cells import Cells
from nscd.percussions import Status

# of the alternating directions with friction: share of the operator's diagonal, over-relaxation,
# iterations from one residual to the next and at most
PENALTY, OVER, CHECK, MOST = 0.02, 1.6, 20, 5000


class PlaceEquation(enum.StrEnum):
    """Choose how (20) is read; p = 0 on exits and free borders in all three.

    complementarity: p ≥ 0, −Δp ≥ −∇·u_d, ∂ₙp ≥ u_d·n on walls, equalities where p > 0: what a
        crowd does that can be pressed but not pulled.
    equality: −Δp = −∇·u_d, ∂ₙp = u_d·n: walls and people also pull (p < 0).
    printed: −Δp = −∇·u_d, ∂ₙp = 0, so that a crowd that walks into a wall goes through it."""

    COMPLEMENTARITY = "complementarity"
    EQUALITY = "equality"
    PRINTED = "printed"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FirstOrderFlow:
    """Hold what (20) gives on a mesh of n vertices and m cells.

    pressure: (n,) m²/s, p, P1: times a uniform density (kg/m²) it is a percussion per length
        (N·s/m) like −½ tr σ of (11), and that over δt a pressure (N/m).
    desired_velocity: (m,d) m/s, the mean of u_d in the cells.
    right_velocity: (m,d) m/s, u⁺ = u_d − ∇p.
    pressed: (n,), the vertices with p > 0 (all but the open border in the two equalities).
    residual: dimensionless, the largest |min(p_i/c_i, r_i)| (|r_i| for an equality) over ‖u_d‖∞,
        recomputed from p; r_i = (∫∇p·∇φ_i − b_i)/∫|∇φ_i| is the speed at which the crowd closes up
        around vertex i, c_i the p that changes it by one.
    status, reason: solved where the residual is within the tolerance, else why not."""

    mesh: Mesh
    equation: PlaceEquation
    pressure: Floats
    desired_velocity: Floats
    right_velocity: Floats
    pressed: Mask
    residual: float
    status: Status
    reason: str
    iterations: int
    seconds: float


def first_order_flow(
    mesh: Mesh,
    desired_velocity: ArrayLike | Field,
    *,
    equation: PlaceEquation | str = PlaceEquation.COMPLEMENTARITY,
    tolerance: float = 1e-9,
) -> FirstOrderFlow:
    """Solve (20) with P1 elements.

    desired_velocity: u_d, (d,) m/s, (n,d) one per vertex, a function of points (m,d) → (m,d), or
        (m,d) one per cell, which gives no values on walls and so not the printed form.
    equation: how (20) is read.
    tolerance: dimensionless, of the residual.

    Find p, 0 on exits and free borders, with ∫∇p·∇q = b(q) for all q, or ∫∇p·∇(q − p) ≥ b(q − p)
    for all q ≥ 0 (complementarity: an obstacle problem, by a primal-dual active set), where
    b(q) = ∫u_d·∇q, less ∫u_d·n q over the walls as printed. The complementarity makes u⁺ the
    velocity nearest to u_d in L² among those with ∇·u⁺ ≥ 0 and u⁺·n ≤ 0 on walls, so that
    ∫|u_d|² = ∫|u⁺|² + ∫|∇p|² (Maury, Roudneff-Chupin, Santambrogio, Math. Models Methods Appl. Sci.
    20 (2010) 1787–1821).

    Raises ValueError naming the field for a wrong shape or value, an unknown equation, or a mesh as
    `Cells` refuses it."""
    begin = time.perf_counter()
    if equation not in list(PlaceEquation):
        raise ValueError(f"equation: unknown {equation!r}. There are: {', '.join(PlaceEquation)}")
    positive(tolerance=tolerance)
    equation, cells = PlaceEquation(equation), Cells(mesh)
    pulls = equation is not PlaceEquation.COMPLEMENTARITY
    desired = cells.mean_velocity(desired_velocity, "desired_velocity")
    load = cells.moment(desired)
    if equation is PlaceEquation.PRINTED:
        load = load - cells.wall_flux(desired_velocity, "desired_velocity")
    found = pressure_of(cells, np.ones(mesh.nelements), load, pulls=pulls)
    p = found.pressure
    residual = found.closing / (float(np.abs(desired).max()) or 1.0)
    status, reason = judged(residual, tolerance, "the pressure", found.unsettled)
    return FirstOrderFlow(
        mesh=mesh,
        equation=equation,
        pressure=p,
        desired_velocity=desired,
        right_velocity=desired - cells.gradient(p),
        pressed=~cells.open if pulls else p > 0,
        residual=residual,
        status=status,
        reason=reason,
        iterations=found.iterations,
        seconds=time.perf_counter() - begin,
    )


class Pressed(NamedTuple):
    """Hold a pressure p.

    pressure: (n,).
    closing: m/s, the speed at which a vertex still closes up or is pressed without need.
    iterations: of the active set.
    unsettled: what to say where the active set did not settle, else empty."""

    pressure: Floats
    closing: float
    iterations: int
    unsettled: str


def pressure_of(cells: Cells, weight: Floats, load: Floats, *, pulls: bool) -> Pressed:
    """Minimise ½∫w|∇p|² − b·p over P1 fields p that are 0 on the open border.

    weight: (m,), w.
    load: (n,), b.
    pulls: whether p may be negative.

    closing is the largest |min(p_i A_ii/c_i, r_i/c_i)|, |r_i/c_i| if it pulls, with r = Ap − b and
    c_i = ∫|∇φ_i|."""
    matrix, inside = cells.stiffness(weight), np.flatnonzero(~cells.open)
    # rows of the identity where p = 0 is given
    keep = sparse.diags_array((~cells.open).astype(np.float64))
    open_cells = sparse.diags_array(cells.open.astype(np.float64))
    inner = sparse.csc_array(keep @ matrix @ keep + open_cells)
    inner.eliminate_zeros()
    if pulls:
        p, iterations, unsettled = factorised(inner).solve(keep @ load), 1, ""
    else:
        # the active set bounds from above, so z = −p ≤ 0
        start, maximum = np.zeros(len(inside), dtype=bool), np.zeros(len(inside))
        found = bounded_minimum(inner, -(keep @ load), inside, maximum, start=start)
        p = np.where(cells.open, 0.0, 0.0 - found.z)
        iterations, unsettled = found.iterations, found.unsettled
    closing = ((matrix @ p - load) / cells.span)[inside]
    if not pulls:
        closing = np.minimum((p * matrix.diagonal() / cells.span)[inside], closing)
    return Pressed(p, float(np.abs(closing).max(initial=0.0)), iterations, unsettled)


class FrictionalFlow(NamedTuple):
    """Hold what (20) with friction gives.

    stress: (n,3) N·s/m, p, a, b at the vertices, Σ = −p1 + [[a, b], [b, −a]].
    right_velocity: (m,2) m/s, u⁺ in the cells.
    residual: dimensionless, of the optimality conditions, recomputed from the stress, over the
        largest desired speed.
    status, reason: solved where the residual is within the tolerance, else why not."""

    stress: Floats
    right_velocity: Floats
    residual: float
    iterations: int
    status: Status
    reason: str


def frictional_flow(
    mesh: MeshTri1, density: float, desired: Floats, friction: float, *, tolerance: float = 1e-4
) -> FrictionalFlow:
    """Solve (20) with internal friction by alternating directions (ADMM), with one factorisation.

    density: kg/m².
    desired: (m,2) m/s, u_d in the cells.
    friction: 0 ≤ s < 1.
    tolerance: dimensionless, of the residual: that of a step of projected gradient at each vertex,
        as a velocity.

    min ½∫|ρu_d + div Σ|²/ρ over P1 stresses Σ = −p1 + S with ‖S‖_F ≤ √2·s·p, p ≥ 0;
    ρu⁺ = ρu_d + div Σ. Walls lie along y and are smooth: S_xy = 0 there; Σ = 0 on exits and free
    borders. It is (17) and (18) of the paper with the pressure of complementarity in place of (16);
    s = 0 is (20). Its dual: u⁺ is the velocity nearest to u_d among those that spread at least as
    much as they shear, div u ≥ s·√((∂ₓuₓ − ∂_yu_y)² + (∂ₓu_y + ∂_yuₓ)²).

    Raises ValueError for friction outside [0, 1) and walls that do not lie along y."""
    if not 0 <= friction < 1:
        raise ValueError(f"friction: {friction}. 0 ≤ s < 1 is needed")
    problem = _Frictional(Cells(mesh), density, desired, friction)
    x, iterations = problem.minimum(tolerance)
    residual, stress = problem.residual(x), problem.full(x)
    status, reason = judged(residual, tolerance, "the stress", "")
    return FrictionalFlow(
        stress=stress.reshape(3, -1).T,
        right_velocity=desired + (problem.divergence @ stress).reshape(2, -1).T / density,
        residual=residual,
        iterations=iterations,
        status=status,
        reason=reason,
    )


class _Frictional:
    """Minimise ½x·Hx + b·x over the cone, x being the p, a and b that are unknown at vertices.

    divergence: (2m,3n), div Σ in the cells of p, a and b at all vertices.
    scale: (u,), one for p, a and b of a vertex, so that the nearest point of the cone stays a
        closed form."""

    def __init__(self, cells: Cells, density: float, desired: Floats, friction: float) -> None:
        x, y = cells.slopes
        unknown, self.friction = _unknown(cells, friction), friction
        self.at, self.size = np.flatnonzero(unknown), unknown.size
        self.divergence = sparse.csr_array(sparse.block_array([[-x, x, y], [-y, -y, x]]))
        operator = self.divergence[:, self.at]
        weight = sparse.diags_array(np.tile(cells.measure, 2))
        self.hessian = sparse.csc_array(operator.T @ weight @ operator) / density
        self.load = operator.T @ (weight @ desired.T.ravel())
        slopes = (x.power(2) + y.power(2)).T @ cells.measure / density
        self.scale, self.span = np.tile(slopes, 3)[self.at], np.tile(cells.span, 3)[self.at]
        self.speed = float(np.abs(desired).max()) or 1.0

    def full(self, x: Floats) -> Floats:
        """Fill in the zeros of all vertices, (3n,)."""
        stress = np.zeros(self.size)
        stress[self.at] = x
        return stress

    def project(self, x: Floats) -> Floats:
        """Find the nearest point of the cone."""
        return _into_cone(self.full(x).reshape(3, -1), self.friction).ravel()[self.at]

    def residual(self, x: Floats) -> float:
        """Measure a step of projected gradient as a velocity, over the largest desired speed."""
        step = x - self.project(x - (self.hessian @ x + self.load) / self.scale)
        return float(np.abs(step * self.scale / self.span).max()) / self.speed

    def minimum(self, tolerance: float) -> tuple[Floats, int]:
        """Alternate directions until the residual is within the tolerance, MOST times at most."""
        penalty = PENALTY * self.scale
        factor = splu(sparse.csc_array(self.hessian + sparse.diags_array(penalty)))
        x, y = np.zeros(len(self.at)), np.zeros(len(self.at))
        iteration = 0
        while iteration == 0 or (self.residual(x) > tolerance and iteration < MOST):
            for _ in range(CHECK):
                mixed = OVER * factor.solve(penalty * (x - y) - self.load) + (1 - OVER) * x
                x = self.project(mixed + y)
                y += mixed - x
            iteration += CHECK
        return x, iteration


def _unknown(cells: Cells, friction: float) -> Mask:
    """Which of p, a and b are unknown at the vertices, (3,n)."""
    mesh = cells.mesh
    walls = mesh.facets[:, (mesh.boundaries or {})["wall"]]
    if np.abs(np.diff(mesh.p[0, walls], axis=0)).max() > 1e-9 * np.ptp(mesh.p):
        raise ValueError("mesh: a wall does not lie along y")
    unknown = np.tile(~cells.open, (3, 1))
    unknown[2, walls] = False
    if friction == 0:
        unknown[1:] = False
    return unknown


def _into_cone(z: Floats, friction: float) -> Floats:
    """Nearest point (3,v) with |(a, b)| ≤ s p, p ≥ 0."""
    p, size = z[0], np.hypot(z[1], z[2])
    inside, polar = size <= friction * p, friction * size <= -p
    onto = (p + friction * size) / (1 + friction**2)
    near = np.where(inside, p, np.where(polar, 0.0, onto))
    shrink = np.where(inside, 1.0, friction * near / np.where(size > 0, size, 1.0))
    return np.stack([near, shrink * z[1], shrink * z[2]])
