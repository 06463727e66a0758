"""Bounded friction in the plane: the deviatoric stress that takes the most kinetic energy.

Paper (17) and (18), corrected."""

from __future__ import annotations

import importlib
from typing import NamedTuple

import numpy as np
import scipy.sparse as sparse

from nscd.arrays import Floats, Indices
from nscd.continuum.rivals.cells import Cells

MOST = 20_000  # gradient steps


class Friction(NamedTuple):
    """State the problem min ½ Σ_T |T|ρ_T |u − Dy/ρ|² over |y_i| ≤ b_i.

    vertex: (k,), where b_i = βδt p_i > 0; y_i = δt (S_xx, S_xy) there, ‖S_i‖_F = √2 |y_i|/δt.
    divergence: (2m,2k), D, which gives ∇·S in the m cells.
    bound: (k,) N·s/m, b.
    span: (k,) m, ∫|∇φ_i|.
    mass: (2m,) kg, |T|ρ_T.
    rho: (2m,) kg/m².
    start: (2m,) m/s, u.

    y and velocities are stacked: all first components, then all second ones.
    """

    vertex: Indices
    divergence: sparse.csr_array
    bound: Floats
    span: Floats
    mass: Floats
    rho: Floats
    start: Floats

    def velocity(self, y: Floats) -> Floats:
        """(2m,) m/s, u − Dy/ρ."""
        return np.asarray(self.start - (self.divergence @ y) / self.rho)

    def moment(self, y: Floats) -> Floats:
        """The energy's slope in −y, Σ_T |T| Dᵀv: how the crowd shears around each vertex."""
        return np.asarray(self.divergence.T @ (self.mass / self.rho * self.velocity(y)))

    def gap(self, y: Floats) -> float:
        """Σ_i b_i|m_i| − y_i·m_i, the energy at y less its minimum at most; ½Σ|T|ρ|v − exact|² is
        at most as large."""
        moment = self.moment(y)
        return max(float(self.bound @ np.hypot(*moment.reshape(2, -1)) - y @ moment), 0.0)

    def error_bound(self, y: Floats) -> float:
        """√(gap/∫½ρ|u|²), 0 for a crowd at rest."""
        energy = 0.5 * float(self.mass @ self.start**2)
        return float(np.sqrt(self.gap(y) / energy)) if energy > 0 else 0.0

    def shearing(self, y: Floats) -> float:
        """How fast the crowd shears around a vertex where friction could stop it (m/s): the largest
        c_i|y_i − Π_i(y_i + m_i/c_i)|/∫|∇φ_i|, m the moment, c_i the energy's curvature in y_i, Π_i
        the projection on |y_i| ≤ b_i."""
        squares = sparse.diags_array(self.mass / self.rho**2) @ self.divergence.power(2)
        curvature = np.asarray(squares.sum(0))
        step = curvature * (y - self._within(y + self.moment(y) / curvature))
        return float((np.hypot(*step.reshape(2, -1)) / self.span).max(initial=0.0))

    def by_gradient(self, aim: float) -> tuple[Floats, int]:
        """Accelerated projected gradient, restarted where it overshoots, until the crowd shears
        slower than `aim` (m/s), and its number of steps: O'Donoghue, Candès, Found. Comput. Math.
        15 (2015) 715–732, scaled vertex by vertex."""
        y = np.zeros(2 * len(self.vertex))
        if len(y) == 0:
            return y, 0
        scaled = sparse.diags_array(np.sqrt(self.mass) / self.rho) @ self.divergence
        hessian = sparse.csr_array(scaled.T @ scaled)
        # Gershgorin: the largest row sum of a vertex's two rows bounds the curvature
        rows = np.asarray(abs(hessian).sum(1)).reshape(2, -1).max(0)
        curvature = np.tile(rows, 2)
        load, ahead, momentum = self.moment(np.zeros_like(y)), y, 1.0
        for step in range(1, MOST + 1):
            new = self._within(ahead + (load - hessian @ ahead) / curvature)
            if momentum > 1 and float((curvature * (ahead - new)) @ (new - y)) > 0:
                momentum, ahead = 1.0, y
                continue
            following = 0.5 * (1 + np.sqrt(1 + 4 * momentum**2))
            ahead = new + (momentum - 1) / following * (new - y)
            y, momentum = new, following
            if step % 10 == 0 and self.shearing(y) <= aim:
                break
        return y, step

    def by_cone(self) -> tuple[Floats, int, str]:
        """Clarabel's solution, scaled into the bound, its iterations, and why it stopped short of
        a relative gap of 10⁻¹⁰ (empty if it did not). Raises ImportError where Clarabel is not
        installed."""
        try:
            clarabel = importlib.import_module("clarabel")
        except ImportError as missing:
            raise ImportError(
                "method 'conic' needs the solver Clarabel: "
                "pip install 'crowd-percussions[bench]' or pip install clarabel"
            ) from missing
        k = len(self.vertex)
        if k == 0:
            return np.zeros(0), 0, ""
        scaled = (
            sparse.diags_array(np.sqrt(self.mass) / self.rho)
            @ self.divergence
            @ sparse.diags_array(np.tile(self.bound, 2))
        )
        load = self.moment(np.zeros(2 * k)) * np.tile(self.bound, 2)
        unit = 1 / (float(np.abs(load).max()) or 1.0)
        # (1, y_i/b_i) in the cone of each vertex
        rows = np.concatenate([3 * np.arange(k) + 1, 3 * np.arange(k) + 2])
        matrix = sparse.csc_matrix(
            (-np.ones(2 * k), (rows, np.arange(2 * k))), shape=(3 * k, 2 * k)
        )
        right = np.zeros(3 * k)
        right[::3] = 1.0
        settings = clarabel.DefaultSettings()
        settings.verbose, settings.max_threads = False, 1
        # 0.99 of the way to the border, Clarabel's default, leaves the central path: rounding then
        # decides whether it stalls
        settings.max_step_fraction = 0.8
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-12
        # the tolerances of AlmostSolved
        settings.reduced_tol_gap_abs = settings.reduced_tol_gap_rel = 1e-10
        settings.reduced_tol_feas = 1e-10
        solver = clarabel.DefaultSolver(
            sparse.triu(unit * (scaled.T @ scaled)).tocsc(),
            -unit * load,
            matrix,
            right,
            [clarabel.SecondOrderConeT(3)] * k,
            settings,
        )
        answer = solver.solve()
        y: Floats = np.tile(self.bound, 2) * np.array(answer.x)
        solved = answer.status in (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved)
        stopped = "" if solved else f"Clarabel stopped: {answer.status}"
        return self._within(y), int(answer.iterations), stopped

    def _within(self, y: Floats) -> Floats:
        """The nearest y with |y_i| ≤ b_i."""
        size = np.hypot(*y.reshape(2, -1))
        share = self.bound / np.maximum(size, self.bound)
        return np.asarray(y * np.tile(share, 2))


def friction_problem(cells: Cells, rho: Floats, velocity: Floats, bound: Floats) -> Friction:
    """State the problem of one step.

    rho: (m,) kg/m², in the cells.
    velocity: (m,2) m/s, u in the cells.
    bound: (n,) N·s/m, βδt p at the vertices.
    """
    vertex = np.flatnonzero(bound > 0)
    gx, gy = (g[:, vertex] for g in cells.slopes)
    # ∇·S = (∂xSxx + ∂ySxy, ∂xSxy − ∂ySxx)
    divergence = sparse.csr_array(sparse.block_array([[gx, gy], [-gy, gx]]))
    return Friction(
        vertex=vertex,
        divergence=divergence,
        bound=bound[vertex],
        span=cells.span[vertex],
        mass=np.tile(cells.measure * rho, 2),
        rho=np.tile(rho, 2),
        start=velocity.T.ravel(),
    )
