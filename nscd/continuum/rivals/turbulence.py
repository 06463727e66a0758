"""Crowd turbulence of Golas, Narain and Lin (paper (15)–(19), corrected): pressure and friction.

Phys. Rev. E 90 (2014) 042816. σ = pI + S acts with the force −∇·σ for δt. p comes first, from a law
or from congestion; then S, symmetric and traceless, minimises the kinetic energy
∫|ρv − δt∇p − δt∇·S|²/(2ρ) under ‖S‖_F ≤ √2 β p: a convex problem with a unique v⁺. (p and S at once
would be convex too, but friction would then buy the pressure that it needs.)"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sparse
from numpy.typing import ArrayLike
from skfem import Mesh

from nscd.arrays import Floats, Mask, number, numbers, read_only
from nscd.continuum.active_set import judged
from nscd.continuum.left_velocity import Field
from nscd.continuum.medium import PERSON, TABLE_1, positive
from nscd.continuum.rivals.cells import Cells
from nscd.continuum.rivals.density_laws import TurbulencePressure
from nscd.continuum.rivals.first_order import pressure_of
from nscd.percussions import Status

MOST = 20_000  # gradient steps


@dataclass(frozen=True, slots=True, kw_only=True)
class Congestion:
    """Press only where the crowd would get denser than the greatest density within the step.

    greatest_density: ρ_max, people/m².

    0 ≤ p ⟂ δt ∇·v⁺ + max(ρ_max/ρ − 1, 0) ≥ 0 and v⁺·n ≤ 0 on walls, without friction; where
    ρ ≥ ρ_max it is the complementarity form of (20) with δt p/ρ in place of p (Narain et al., ACM
    Trans. Graph. 28 (2009) 122).

    Raises ValueError for a density that is not positive."""

    greatest_density: float = TABLE_1.yield_density

    def __post_init__(self) -> None:
        positive(greatest_density=self.greatest_density)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TurbulenceLaw:
    """Say how a crowd of the turbulence model presses and rubs.

    pressure: a law g(ρ) of (16), a Congestion, or p (n,) ≥ 0 N/m at the vertices. A given p does
        not know of walls: with a law v⁺·n ≤ 0 is left to later steps, in which the density there
        has grown.
    friction: β.
    mass_per_person: kg.

    Raises ValueError for a negative friction or a mass that is not positive."""

    pressure: TurbulencePressure | Congestion | Floats = field(default_factory=TurbulencePressure)
    friction: float = TABLE_1.friction
    mass_per_person: float = PERSON

    def __post_init__(self) -> None:
        positive(mass_per_person=self.mass_per_person)
        if number(self.friction, "friction") < 0:
            raise ValueError(f"friction: {self.friction:g}. It cannot be negative")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TurbulenceStep:
    """Hold a crowd after one time step, on a mesh of n vertices and m cells.

    pressure: (n,) N/m, p.
    deviator: (n,2) N/m, S_xx = −S_yy and S_xy.
    left_velocity, right_velocity: (m,2) m/s, v and v⁺.
    pressed_velocity: (m,2) m/s, u = v − (δt/ρ)∇p, without friction.
    density: (m,) kg/m².
    sliding: (n,), whether ‖S‖_F is at its bound.
    residual: dimensionless, the smaller of two certificates recomputed from S, each a velocity over
        the size of u: how fast the crowd still shears around a vertex where friction could stop it
        (`Friction.shearing`), and error_bound; with congestion at least p's own closing speed.
    error_bound: dimensionless, √(gap/∫½ρ|u|²) ≥ ‖v⁺ − exact‖/‖u‖ (L², weighted with ρ) for this p,
        from the duality gap: sure, but, as a square root, far above the error where that is small.
    status, reason: solved where the residual is within the tolerance, else why not."""

    mesh: Mesh
    time_step: float
    pressure: Floats
    deviator: Floats
    left_velocity: Floats
    pressed_velocity: Floats
    right_velocity: Floats
    density: Floats
    sliding: Mask
    residual: float
    error_bound: float
    status: Status
    reason: str
    iterations: int
    seconds: float

    @property
    def percussion_density(self) -> Floats:
        """(m,2) N·s/m², −δt∇·σ = ρ(v⁺ − v), comparable with div σ of (11)."""
        return self.density[:, None] * (self.right_velocity - self.left_velocity)

    @property
    def force(self) -> Floats:
        """(m,2) N/m², −∇·σ: (19) with its sign."""
        return self.percussion_density / self.time_step


def turbulence_step(
    mesh: Mesh,
    density: ArrayLike,
    velocity: ArrayLike | Field,
    law: TurbulenceLaw,
    *,
    time_step: float,
    tolerance: float = 1e-5,
) -> TurbulenceStep:
    """Take one time step of the crowd turbulence.

    density: people/m², one number or (n,) one per vertex.
    velocity: v, (2,) m/s, (n,2) one per vertex, (m,2) one per cell, or a function of points.
    time_step: δt, s.

    p and S are P1, v⁺ constant in each cell, so that v⁺ = v − (δt/ρ)(∇p + ∇·S) is exact and the
    bound holds everywhere if at the vertices. S = 0 on exits and free borders (p is what is given
    there); on walls S is bounded as inside, which makes a wall as rough as the crowd.

    Raises ValueError naming the field for a wrong shape or value and for a mesh as `Cells` refuses
    it or not of triangles."""
    begin = time.perf_counter()
    positive(time_step=time_step, tolerance=tolerance)
    if mesh.dim() != 2:
        raise ValueError("mesh: friction needs the plane. Triangles are needed")
    cells, people = Cells(mesh), _people(density, mesh.nvertices)
    rho = law.mass_per_person * people[mesh.t].mean(0)
    left = cells.mean_velocity(velocity, "velocity")
    p, closing, unsettled = _pressing(law, cells, people, left, time_step)
    pressed = left - (time_step / rho)[:, None] * cells.gradient(p)
    bound = law.friction * time_step * np.where(cells.open, 0.0, p)
    problem = Friction(cells, rho, pressed, bound)
    speed = float(max(np.abs(left).max(), np.abs(pressed).max())) or 1.0
    y, iterations = problem.by_gradient(tolerance * speed)
    error_bound = problem.error_bound(y)
    slow = np.minimum(problem.shearing(y) / speed, error_bound)
    residual = float(np.maximum(slow, closing / speed))
    status, reason = judged(residual, tolerance, "the stress", unsettled)
    return TurbulenceStep(
        mesh=mesh,
        time_step=time_step,
        pressure=p,
        left_velocity=left,
        pressed_velocity=pressed,
        right_velocity=problem.velocity(y).reshape(2, -1).T,
        density=rho,
        residual=residual,
        error_bound=error_bound,
        status=status,
        reason=reason,
        iterations=iterations,
        seconds=time.perf_counter() - begin,
        **problem.at_vertices(y, time_step),
    )


def _people(density: ArrayLike, n: int) -> Floats:
    """(n,) people/m² at the vertices."""
    values = numbers(density, "density")
    people = read_only(values if values.ndim else np.full(n, values), (n,), "density")
    if people.min() <= 0:
        raise ValueError(f"density: {people.min():g}. A crowd needs a positive density everywhere")
    return people


def _pressing(
    law: TurbulenceLaw, cells: Cells, people: Floats, left: Floats, time_step: float
) -> tuple[Floats, float, str]:
    """p (n,) N/m, the speed (m/s) at which a congested crowd still closes up, and what did not
    settle."""
    if isinstance(law.pressure, Congestion):
        gap = np.maximum(law.pressure.greatest_density / people - 1.0, 0.0) / time_step
        rho = law.mass_per_person * people[cells.mesh.t].mean(0)
        load = cells.moment(left) - cells.integral(gap)
        found = pressure_of(cells, 1 / rho, load, pulls=False)
        return found.pressure / time_step, found.closing, found.unsettled
    if isinstance(law.pressure, TurbulencePressure):
        # a law that jumps below 0 (c₂ > 32.91) would pull
        return law.mass_per_person * np.maximum(law.pressure.pressure(people), 0.0), 0.0, ""
    p = read_only(law.pressure, (len(people),), "pressure")
    if p.min() < 0:
        raise ValueError(f"pressure: {p.min():g} N/m. People push, they do not pull")
    return p, 0.0, ""


class Friction:
    """State the problem min ½ Σ_T |T|ρ_T |u − Dy/ρ|² over |y_i| ≤ b_i.

    rho: (m,) kg/m², in the cells.
    velocity: (m,2) m/s, u in the cells.
    bound: (n,) N·s/m, βδt p at the vertices.

    vertex: (k,), where b_i = βδt p_i > 0; y_i = δt (S_xx, S_xy) there, ‖S_i‖_F = √2 |y_i|/δt.
    divergence: (2m,2k), D, which gives ∇·S in the m cells. span: (k,) m, ∫|∇φ_i|. mass: (2m,) kg,
    |T|ρ_T. y and velocities are stacked: all first components, then all second ones."""

    def __init__(self, cells: Cells, rho: Floats, velocity: Floats, bound: Floats) -> None:
        self.vertices = len(bound)
        vertex = self.vertex = np.flatnonzero(bound > 0)
        gx, gy = (g[:, vertex] for g in cells.slopes)
        # ∇·S = (∂xSxx + ∂ySxy, ∂xSxy − ∂ySxx)
        self.divergence = sparse.csr_array(sparse.block_array([[gx, gy], [-gy, gx]]))
        self.bound, self.span, self.start = bound[vertex], cells.span[vertex], velocity.T.ravel()
        self.mass, self.rho = np.tile(cells.measure * rho, 2), np.tile(rho, 2)

    def at_vertices(self, y: Floats, time_step: float) -> dict[str, Any]:
        """S at all vertices, and where it is at its bound."""
        deviator, sliding = np.zeros((self.vertices, 2)), np.zeros(self.vertices, dtype=bool)
        deviator[self.vertex] = y.reshape(2, -1).T / time_step
        sliding[self.vertex] = np.hypot(*y.reshape(2, -1)) >= (1 - 1e-6) * self.bound
        return {"deviator": deviator, "sliding": sliding}

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
        hessian = sparse.csr_array(self._scaled.T @ self._scaled)
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

    @property
    def _scaled(self) -> sparse.csr_array:
        """(2m,2k), √(|T|ρ_T) D/ρ: the Hessian of the energy is its transpose times itself."""
        return sparse.diags_array(np.sqrt(self.mass) / self.rho) @ self.divergence

    def _within(self, y: Floats) -> Floats:
        """The nearest y with |y_i| ≤ b_i."""
        size = np.hypot(*y.reshape(2, -1))
        fraction = self.bound / np.maximum(size, self.bound)
        return np.asarray(y * np.tile(fraction, 2))


class StepDependence(NamedTuple):
    """Hold means over the room for one time step.

    time_step: s.
    percussion, force: N·s/m² and N/m², means of the moduli of the two densities.
    energy_left: share of the kinetic energy.
    sliding: share of the vertices off the open border where friction is at its bound."""

    time_step: float
    percussion: float
    force: float
    energy_left: float
    sliding: float
    residual: float
    status: Status
    reason: str


def time_step_dependence(
    mesh: Mesh,
    density: ArrayLike,
    velocity: ArrayLike | Field,
    law: TurbulenceLaw,
    time_steps: Sequence[float],
) -> list[StepDependence]:
    """Take `turbulence_step` from the same state for several δt (s).

    A law bounds forces, not percussions: friction slides everywhere where δt is short, with a force
    that does not depend on it, and stops all that it can where δt is long, with a percussion that
    does not; in between both change with δt. The percussion of a crowd that is congested everywhere
    (ρ ≥ ρ_max) does not depend on δt. Raises as `turbulence_step`."""
    cells, rows = Cells(mesh), []
    area = cells.measure
    for time_step in time_steps:
        step = turbulence_step(mesh, density, velocity, law, time_step=time_step)
        percussion = float(area @ np.hypot(*step.percussion_density.T) / area.sum())
        before, after = (
            float((area * step.density) @ (v**2).sum(1))
            for v in (step.left_velocity, step.right_velocity)
        )
        retained = after / before if before > 0 else 1.0
        sliding = float(step.sliding[~cells.open].mean())
        ended = step.residual, step.status, step.reason
        force = percussion / time_step
        rows.append(StepDependence(time_step, percussion, force, retained, sliding, *ended))
    return rows
