"""(20) with internal friction: a crowd that may spread but not close up.

It resists shear in proportion to its pressure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu
from skfem import MeshTri1

from nscd.arrays import Flags, Floats
from nscd.continuum.certificate import judged
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
    cells = Cells(mesh)
    unknown = _unknown(cells, friction)
    along_x, along_y = cells.slopes
    divergence = sparse.vstack(
        [sparse.hstack([-along_x, along_x, along_y]), sparse.hstack([-along_y, -along_y, along_x])]
    ).tocsr()
    at = np.flatnonzero(unknown)
    operator = divergence[:, at]
    weight = sparse.diags_array(np.tile(cells.measure, 2))
    hessian = sparse.csc_array(operator.T @ weight @ operator) / density
    load = operator.T @ (weight @ desired.T.ravel())
    # one scale for p, a and b of a vertex, so that the nearest point of the cone stays a closed
    # form
    scale = np.tile((along_x.power(2) + along_y.power(2)).T @ cells.measure / density, 3)[at]

    def project(values: Floats) -> Floats:
        whole = np.zeros(unknown.size)
        whole[at] = values
        return _into_cone(whole.reshape(3, -1), friction).ravel()[at]

    def residual_of(x: Floats) -> float:
        step = x - project(x - (hessian @ x + load) / scale)
        speed = float(np.abs(desired).max()) or 1.0
        return float(np.abs(step * scale / np.tile(cells.span, 3)[at]).max()) / speed

    factor = splu(sparse.csc_array(hessian + sparse.diags_array(PENALTY * scale)))
    x, y = np.zeros(len(at)), np.zeros(len(at))
    residual, iteration = np.inf, 0
    while residual > tolerance and iteration < MOST:
        for _ in range(CHECK):
            mixed = OVER * factor.solve(PENALTY * scale * (x - y) - load) + (1 - OVER) * x
            x = project(mixed + y)
            y += mixed - x
        iteration += CHECK
        residual = residual_of(x)
    stress = np.zeros(unknown.size)
    stress[at] = x
    status, reason = judged(residual, tolerance, "the stress", "")
    return FrictionalFlow(
        stress=stress.reshape(3, -1).T,
        right_velocity=desired + (divergence @ stress).reshape(2, -1).T / density,
        residual=residual,
        iterations=iteration,
        status=status,
        reason=reason,
    )


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
