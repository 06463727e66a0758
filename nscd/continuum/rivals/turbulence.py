"""Crowd turbulence of Golas, Narain and Lin (paper (15)–(19), corrected): a time step with pressure
and bounded friction.

Phys. Rev. E 90 (2014) 042816. σ = pI + S acts with the force −∇·σ for δt. p comes first, from a law
or from congestion; then S, symmetric and traceless, minimises the kinetic energy ∫|ρv − δt∇p −
δt∇·S|²/(2ρ) under ‖S‖_F ≤ √2 β p: a convex problem with a unique v⁺. (p and S at once would be
convex too, but friction would then buy the pressure that it needs.)"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike
from skfem import Mesh

from nscd.arrays import Flags, Floats, read_only
from nscd.continuum.left_velocity import Field
from nscd.continuum.rivals.bounded_friction import friction_problem
from nscd.continuum.rivals.cells import Cells
from nscd.continuum.rivals.density_laws import TurbulencePressure
from nscd.continuum.rivals.first_order import pressure_of
from nscd.percussions import Status

Method = Literal["gradient", "conic"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Congestion:
    """p ≥ 0 that acts only where the crowd would get denser than greatest_density ρ_max (people/m²)
    within the step:

    0 ≤ p ⟂ δt ∇·v⁺ + max(ρ_max/ρ − 1, 0) ≥ 0 and v⁺·n ≤ 0 on walls, without friction; where ρ ≥
    ρ_max it is the complementarity form of (20) with δt p/ρ in place of p (Narain et al., ACM
    Trans. Graph. 28 (2009) 122). Raises ValueError for a density that is not positive."""

    greatest_density: float = 5.5

    def __post_init__(self) -> None:
        if not (np.isfinite(self.greatest_density) and self.greatest_density > 0):
            raise ValueError(
                f"greatest_density: {self.greatest_density:g}; a positive number is needed"
            )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TurbulenceStep:
    """A crowd after one time step, on a mesh of n vertices and m cells.

    pressure p (n,) N/m; deviator (n,2) N/m, S_xx = −S_yy and S_xy; left_velocity v and
    right_velocity v⁺ (m,2) m/s, and pressed_velocity v − (δt/ρ)∇p (m,2), without friction; density
    ρ (m,) kg/m²; sliding (n,): ‖S‖_F is at its bound.

    residual: the smaller of two certificates recomputed from S, each a velocity over the size of u
    = v − (δt/ρ)∇p: how fast the crowd still shears around a vertex where friction could stop it
    (`Friction.shearing`), and error_bound; with congestion at least p's own closing speed. status:
    solved where it is within the tolerance; reason where it is not. error_bound: √(gap/∫½ρ|u|²) ≥
    ‖v⁺ − exact‖/‖u‖ (L², weighted with ρ) for this p, from the duality gap: sure, but, as a square
    root, far above the error where that is small."""

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
        """−δt∇·σ = ρ(v⁺ − v) (m,2) N·s/m², comparable with div σ of (11)."""
        return self.density[:, None] * (self.right_velocity - self.left_velocity)

    @property
    def force(self) -> Floats:
        """−∇·σ (m,2) N/m², (19) with its sign."""
        return self.percussion_density / self.time_step


def turbulence_step(
    mesh: Mesh,
    density: ArrayLike,
    velocity: ArrayLike | Field,
    *,
    mass_per_person: float,
    time_step: float,
    pressure: TurbulencePressure | Congestion | ArrayLike,
    friction: float = 0.75,
    method: Method = "gradient",
    tolerance: float = 1e-5,
) -> TurbulenceStep:
    """One time step δt (s) of a crowd of ρ people/m² (one number or one a vertex (n,)) with the
    velocity v, a vector (2,) m/s, one a vertex (n,2) or a cell (m,2), or a function of points.

    pressure: a law g(ρ) of (16), a Congestion, or p (n,) ≥ 0 in N/m. friction: β. p and S are P1,
    v⁺ constant in each cell, so that v⁺ = v − (δt/ρ)(∇p + ∇·S) is exact and the bound holds
    everywhere if at the vertices. S = 0 on exits and free borders (p is what is given there); on
    walls S is bounded as inside, which makes a wall as rough as the crowd. A given p does not know
    of walls: with a law v⁺·n ≤ 0 is left to later steps, in which the density there has grown.

    method "gradient": accelerated projected gradient with restarts (O'Donoghue, Candès, Found.
    Comput. Math. 15 (2015) 715–732), scaled vertex by vertex; "conic": the interior-point solver
    Clarabel, which must be installed.

    Raises ValueError naming the field for a wrong shape or value and for a mesh as `Cells` refuses
    it or not of triangles; ImportError, with what to install, where "conic" lacks Clarabel."""
    begin = time.perf_counter()
    for name, value in (
        ("mass_per_person", mass_per_person),
        ("time_step", time_step),
        ("tolerance", tolerance),
    ):
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name}: {value:g}; a positive number is needed")
    if not (np.isfinite(friction) and friction >= 0):
        raise ValueError(f"friction: {friction:g}; it cannot be negative")
    if method not in get_args(Method):
        raise ValueError(f"method: unknown {method!r}; there are: {', '.join(get_args(Method))}")
    if mesh.dim() != 2:
        raise ValueError("mesh: friction needs the plane; triangles are needed")
    cells, n = Cells(mesh), mesh.nvertices
    people = read_only(np.full(n, density) if np.ndim(density) == 0 else density, (n,), "density")
    if people.min() <= 0:
        raise ValueError(f"density: {people.min():g}; a crowd needs a positive density everywhere")
    rho = mass_per_person * people[mesh.t].mean(0)
    left = cells.mean_velocity(velocity, "velocity")
    closing, settled = 0.0, True
    if isinstance(pressure, Congestion):
        gap = np.maximum(pressure.greatest_density / people - 1.0, 0.0) / time_step
        load = cells.moment(left) - cells.integral(gap)
        found = pressure_of(cells, 1 / rho, load, pulls=False)
        p, settled = found.pressure / time_step, found.settled
        closing = found.closing
    elif isinstance(pressure, TurbulencePressure):
        # a law that jumps below 0 (c₂ > 32.91) would pull
        p = mass_per_person * np.maximum(pressure.pressure(people), 0.0)
    else:
        p = read_only(pressure, (n,), "pressure")
        if p.min() < 0:
            raise ValueError(f"pressure: {p.min():g} N/m; people push, they do not pull")
    pressed = left - (time_step / rho)[:, None] * cells.gradient(p)
    problem = friction_problem(
        cells, rho, pressed, friction * time_step * np.where(cells.open, 0.0, p)
    )
    energy = 0.5 * float(cells.measure @ (rho * (pressed**2).sum(1)))
    speed = float(max(np.abs(left).max(), np.abs(pressed).max())) or 1.0
    y, iterations = (
        problem.by_cone() if method == "conic" else problem.by_gradient(tolerance * speed)
    )
    error_bound = float(np.sqrt(problem.gap(y) / energy)) if energy > 0 else 0.0
    residual = float(
        np.maximum(np.minimum(problem.shearing(y) / speed, error_bound), closing / speed)
    )
    status, reason = Status.SOLVED, ""
    if not np.isfinite(residual):
        status, reason = Status.FAILED, "the stress is not a finite number"
    elif residual > tolerance:
        what = "" if settled else "; the active set of the pressure did not settle"
        status, reason = Status.INACCURATE, f"residual {residual:.1e} above {tolerance:.1e}{what}"
    deviator, sliding = np.zeros((n, 2)), np.zeros(n, dtype=bool)
    deviator[problem.vertex] = y.reshape(2, -1).T / time_step
    sliding[problem.vertex] = np.hypot(*y.reshape(2, -1)) >= (1 - 1e-6) * problem.bound
    return TurbulenceStep(
        mesh=mesh,
        time_step=time_step,
        pressure=p,
        deviator=deviator,
        left_velocity=left,
        pressed_velocity=pressed,
        right_velocity=problem.velocity(y).reshape(2, -1).T,
        density=rho,
        sliding=sliding,
        residual=residual,
        error_bound=error_bound,
        status=status,
        reason=reason,
        method=method,
        iterations=iterations,
        seconds=time.perf_counter() - begin,
    )


class StepDependence(NamedTuple):
    """One time step (s): means over the room of |percussion density| (N·s/m²) and |force| (N/m²),
    the share of the kinetic energy that is left, and the share of the vertices off the open border
    where friction slides; residual and status."""

    time_step: float
    percussion: float
    force: float
    energy_left: float
    sliding: float
    residual: float
    status: Status


def time_step_dependence(
    mesh: Mesh,
    density: ArrayLike,
    velocity: ArrayLike | Field,
    time_steps: Sequence[float],
    *,
    mass_per_person: float,
    pressure: TurbulencePressure | Congestion | ArrayLike,
    friction: float = 0.75,
    method: Method = "gradient",
) -> list[StepDependence]:
    """What `turbulence_step` gives for several δt (s) from the same state.

    A law bounds forces, not percussions: friction slides everywhere where δt is short, with a force
    that does not depend on it, and stops all that it can where δt is long, with a percussion that
    does not; in between both change with δt. The percussion of a crowd that is congested everywhere
    (ρ ≥ ρ_max) does not depend on δt. Raises as `turbulence_step`."""
    cells, rows = Cells(mesh), []
    area = cells.measure
    for time_step in time_steps:
        step = turbulence_step(
            mesh,
            density,
            velocity,
            mass_per_person=mass_per_person,
            time_step=time_step,
            pressure=pressure,
            friction=friction,
            method=method,
        )
        percussion = float(area @ np.hypot(*step.percussion_density.T) / area.sum())
        before, after = (
            float((area * step.density) @ (v**2).sum(1))
            for v in (step.left_velocity, step.right_velocity)
        )
        rows.append(
            StepDependence(
                time_step,
                percussion,
                percussion / time_step,
                after / before if before > 0 else 1.0,
                float(step.sliding[~cells.open].mean()),
                step.residual,
                step.status,
            )
        )
    return rows
