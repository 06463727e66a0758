"""(20) with internal friction: a crowd that may spread but not close up.

It resists shear in proportion to its pressure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu
from skfem import MeshTri1

from nscd.arrays import Flags, Floats
from nscd.continuum.active_set import judged
from nscd.continuum.rivals.cells import Cells
from nscd.percussions import Status

PENALTY = 0.02  # of the operator's diagonal
OVER = 1.6  # over-relaxation
CHECK = 20  # iterations from one residual to the next
MOST = 5000


class FrictionalFlow(NamedTuple):
    """Hold what (20) with friction gives.

    stress: (n,3) N·s/m, p, a, b at the vertices, Σ = −p1 + [[a, b], [b, −a]].
    right_velocity: (m,2) m/s, u⁺ in the cells.
    residual: dimensionless, of the optimality conditions, recomputed from the stress, over the
        largest desired speed.
    status, reason: solved where the residual is within the tolerance, else why not.
    """

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

    Raises ValueError for friction outside [0, 1) and walls that do not lie along y.
    """
    if not 0 <= friction < 1:
        raise ValueError(f"friction: {friction}; 0 ≤ s < 1 is needed")
    problem = _Problem(Cells(mesh), density, desired, friction)
    x, iterations = problem.minimum(tolerance)
    residual, stress = problem.residual(x), problem.whole(x)
    status, reason = judged(residual, tolerance, "the stress", "")
    return FrictionalFlow(
        stress=stress.reshape(3, -1).T,
        right_velocity=desired + (problem.divergence @ stress).reshape(2, -1).T / density,
        residual=residual,
        iterations=iterations,
        status=status,
        reason=reason,
    )


class _Problem:
    """Minimise ½x·Hx + b·x over the cone, x being the p, a and b that are unknown at vertices.

    divergence: (2m,3n), div Σ in the cells of p, a and b at all vertices.
    scale: (u,), one for p, a and b of a vertex, so that the nearest point of the cone stays a
        closed form.
    """

    def __init__(self, cells: Cells, density: float, desired: Floats, friction: float) -> None:
        x, y = cells.slopes
        unknown, self.friction = _unknown(cells, friction), friction
        self.at, self.size = np.flatnonzero(unknown), unknown.size
        self.divergence = sparse.vstack(
            [sparse.hstack([-x, x, y]), sparse.hstack([-y, -y, x])]
        ).tocsr()
        operator = self.divergence[:, self.at]
        weight = sparse.diags_array(np.tile(cells.measure, 2))
        self.hessian = sparse.csc_array(operator.T @ weight @ operator) / density
        self.load = operator.T @ (weight @ desired.T.ravel())
        slopes = (x.power(2) + y.power(2)).T @ cells.measure / density
        self.scale, self.span = np.tile(slopes, 3)[self.at], np.tile(cells.span, 3)[self.at]
        self.speed = float(np.abs(desired).max()) or 1.0

    def whole(self, x: Floats) -> Floats:
        """Fill in the zeros of all vertices, (3n,)."""
        stress = np.zeros(self.size)
        stress[self.at] = x
        return stress

    def project(self, x: Floats) -> Floats:
        """Find the nearest point of the cone."""
        return _into_cone(self.whole(x).reshape(3, -1), self.friction).ravel()[self.at]

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


def _unknown(cells: Cells, friction: float) -> Flags:
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
