"""Crowd turbulence of Golas, Narain and Lin (paper (15)–(19), corrected): pressure and friction.

Phys. Rev. E 90 (2014) 042816. σ = pI + S acts with the force −∇·σ for δt. p comes first, from a law
or from congestion; then S, symmetric and traceless, minimises the kinetic energy
∫|ρv − δt∇p − δt∇·S|²/(2ρ) under ‖S‖_F ≤ √2 β p: a convex problem with a unique v⁺. (p and S at once
would be convex too, but friction would then buy the pressure that it needs.)"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike
from skfem import Mesh

from nscd.arrays import Flags, Floats, read_only
from nscd.continuum.active_set import judged
from nscd.continuum.left_velocity import Field
from nscd.continuum.medium import PERSON, TABLE_1
from nscd.continuum.rivals.bounded_friction import Friction, friction_problem
from nscd.continuum.rivals.cells import Cells
from nscd.continuum.rivals.density_laws import TurbulencePressure
from nscd.continuum.rivals.first_order import pressure_of
from nscd.percussions import Status

Method = Literal["gradient", "conic"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Congestion:
    """Press only where the crowd would get denser than the greatest density within the step.

    greatest_density: ρ_max, people/m².

    0 ≤ p ⟂ δt ∇·v⁺ + max(ρ_max/ρ − 1, 0) ≥ 0 and v⁺·n ≤ 0 on walls, without friction; where
    ρ ≥ ρ_max it is the complementarity form of (20) with δt p/ρ in place of p (Narain et al., ACM
    Trans. Graph. 28 (2009) 122).

    Raises ValueError for a density that is not positive.
    """

    greatest_density: float = TABLE_1.yield_density

    def __post_init__(self) -> None:
        _positive("greatest_density", self.greatest_density)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TurbulenceLaw:
    """Say how a crowd of the turbulence model presses and rubs.

    pressure: a law g(ρ) of (16), a Congestion, or p (n,) ≥ 0 N/m at the vertices. A given p does
        not know of walls: with a law v⁺·n ≤ 0 is left to later steps, in which the density there
        has grown.
    friction: β.
    mass_per_person: kg.

    Raises ValueError for a negative friction or a mass that is not positive.
    """

    pressure: TurbulencePressure | Congestion | Floats = field(default_factory=TurbulencePressure)
    friction: float = TABLE_1.friction
    mass_per_person: float = PERSON

    def __post_init__(self) -> None:
        _positive("mass_per_person", self.mass_per_person)
        if not (np.isfinite(self.friction) and self.friction >= 0):
            raise ValueError(f"friction: {self.friction:g}; it cannot be negative")


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
    status, reason: solved where the residual is within the tolerance, else why not.
    """

    mesh: Mesh
    time_step: float
    pressure: Floats
    deviator: Floats
    left_velocity: Floats
    pressed_velocity: Floats
    right_velocity: Floats
    density: Floats
    sliding: Flags
    residual: float
    error_bound: float
    status: Status
    reason: str
    method: str
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
    method: Method = "gradient",
    tolerance: float = 1e-5,
) -> TurbulenceStep:
    """Take one time step of the crowd turbulence.

    density: people/m², one number or (n,) one per vertex.
    velocity: v, (2,) m/s, (n,2) one per vertex, (m,2) one per cell, or a function of points.
    time_step: δt, s.
    method: "gradient", accelerated projected gradient with restarts (O'Donoghue, Candès, Found.
        Comput. Math. 15 (2015) 715–732), scaled vertex by vertex; or "conic", the interior-point
        solver Clarabel, which must be installed.

    p and S are P1, v⁺ constant in each cell, so that v⁺ = v − (δt/ρ)(∇p + ∇·S) is exact and the
    bound holds everywhere if at the vertices. S = 0 on exits and free borders (p is what is given
    there); on walls S is bounded as inside, which makes a wall as rough as the crowd.

    Raises ValueError naming the field for a wrong shape or value and for a mesh as `Cells` refuses
    it or not of triangles; ImportError, with what to install, where "conic" lacks Clarabel.
    """
    begin = time.perf_counter()
    _refuse(mesh, method, time_step, tolerance)
    cells, people = Cells(mesh), _people(density, mesh.nvertices)
    rho = law.mass_per_person * people[mesh.t].mean(0)
    left = cells.mean_velocity(velocity, "velocity")
    p, closing, unsettled = _pressing(law, cells, people, left, time_step)
    pressed = left - (time_step / rho)[:, None] * cells.gradient(p)
    bound = law.friction * time_step * np.where(cells.open, 0.0, p)
    problem = friction_problem(cells, rho, pressed, bound)
    speed = float(max(np.abs(left).max(), np.abs(pressed).max())) or 1.0
    y, iterations, stopped = (
        problem.by_cone() if method == "conic" else (*problem.by_gradient(tolerance * speed), "")
    )
    error_bound = problem.error_bound(y)
    slow = np.minimum(problem.shearing(y) / speed, error_bound)
    residual = float(np.maximum(slow, closing / speed))
    status, reason = judged(residual, tolerance, "the stress", unsettled)
    if status is Status.SOLVED and stopped:
        status, reason = Status.INACCURATE, stopped
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
        method=method,
        iterations=iterations,
        seconds=time.perf_counter() - begin,
        **_at_vertices(problem, y, time_step, mesh.nvertices),
    )


def _refuse(mesh: Mesh, method: str, time_step: float, tolerance: float) -> None:
    """Raise ValueError for what no step can be taken with."""
    _positive("time_step", time_step)
    _positive("tolerance", tolerance)
    if method not in get_args(Method):
        raise ValueError(f"method: unknown {method!r}; there are: {', '.join(get_args(Method))}")
    if mesh.dim() != 2:
        raise ValueError("mesh: friction needs the plane; triangles are needed")


def _positive(name: str, value: float) -> None:
    if not (np.isfinite(value) and value > 0):
        raise ValueError(f"{name}: {value:g}; a positive number is needed")


def _people(density: ArrayLike, n: int) -> Floats:
    """(n,) people/m² at the vertices."""
    people = read_only(np.full(n, density) if np.ndim(density) == 0 else density, (n,), "density")
    if people.min() <= 0:
        raise ValueError(f"density: {people.min():g}; a crowd needs a positive density everywhere")
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
        raise ValueError(f"pressure: {p.min():g} N/m; people push, they do not pull")
    return p, 0.0, ""


def _at_vertices(problem: Friction, y: Floats, time_step: float, n: int) -> dict[str, Any]:
    """S at all vertices, and where it is at its bound."""
    deviator, sliding = np.zeros((n, 2)), np.zeros(n, dtype=bool)
    deviator[problem.vertex] = y.reshape(2, -1).T / time_step
    sliding[problem.vertex] = np.hypot(*y.reshape(2, -1)) >= (1 - 1e-6) * problem.bound
    return {"deviator": deviator, "sliding": sliding}


class StepDependence(NamedTuple):
    """Hold means over the room for one time step.

    time_step: s.
    percussion, force: N·s/m² and N/m², means of the moduli of the two densities.
    energy_left: share of the kinetic energy.
    sliding: share of the vertices off the open border where friction is at its bound.
    """

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
    (ρ ≥ ρ_max) does not depend on δt. Raises as `turbulence_step`.
    """
    cells, rows = Cells(mesh), []
    area = cells.measure
    for time_step in time_steps:
        step = turbulence_step(mesh, density, velocity, law, time_step=time_step)
        percussion = float(area @ np.hypot(*step.percussion_density.T) / area.sum())
        before, after = (
            float((area * step.density) @ (v**2).sum(1))
            for v in (step.left_velocity, step.right_velocity)
        )
        rows.append(
            StepDependence(
                time_step=time_step,
                percussion=percussion,
                force=percussion / time_step,
                energy_left=after / before if before > 0 else 1.0,
                sliding=float(step.sliding[~cells.open].mean()),
                residual=step.residual,
                status=step.status,
                reason=step.reason,
            )
        )
    return rows
