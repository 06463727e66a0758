"""The collision of a deformable crowd with its walls: problem (11) of the paper.

It is solved for w = u⁺ + u⁻, which is in H¹ although u⁻ need not be."""

import time
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sparse
from numpy.typing import ArrayLike
from skfem import BilinearForm, Functional, LinearForm
from skfem.helpers import ddot, dot, sym_grad

from nscd.arrays import Floats, Mask
from nscd.continuum.active_set import bounded_minimum, judged
from nscd.continuum.left_velocity import Field, checked
from nscd.continuum.medium import Medium, positive
from nscd.continuum.space import Space, density_at, nodal_values, values_at
from nscd.percussions import Status


@BilinearForm  # type: ignore[untyped-decorator]
def volume(u: Any, v: Any, x: Any) -> Any:
    """∫ρ u·v + k_v D(u):D(v)."""
    return x.rho * dot(u, v) + x.k_v * ddot(sym_grad(u), sym_grad(v))


@BilinearForm  # type: ignore[untyped-decorator]
def surface(u: Any, v: Any, x: Any) -> Any:
    """∫k_s u·v on a boundary."""
    return x.k_s * dot(u, v)


@LinearForm  # type: ignore[untyped-decorator]
def momentum(v: Any, x: Any) -> Any:
    """∫ρ u·v."""
    return x.rho * dot(x.u, v)


@LinearForm  # type: ignore[untyped-decorator]
def traction(v: Any, x: Any) -> Any:
    """∫r·v on a boundary."""
    return dot(x.r, v)


@Functional  # type: ignore[untyped-decorator]
def dissipated(x: Any) -> Any:
    """∫k_v |D(w)|²."""
    return x.k_v * ddot(sym_grad(x.w), sym_grad(x.w))


@Functional  # type: ignore[untyped-decorator]
def gain(x: Any) -> Any:
    """½∫ρ(|w − u|² − |u|²), the change of kinetic energy from u⁻ = u to u⁺ = w − u."""
    right = np.asarray(x.w) - x.u
    return 0.5 * x.rho * (dot(right, right) - dot(x.u, x.u))


@dataclass(frozen=True, slots=True, kw_only=True)
class EnergyBalance:
    """Say where the kinetic energy goes: change = volume + surface + wall + external.

    before: J, ½∫ρ|u⁻|².
    change: J, ½∫ρ(|u⁺|² − |u⁻|²).
    volume: J, −½k_v∫|D(w)|².
    surface: J, −½k_s∫|w|² where the wall dissipates.
    wall: J, −½∫μ w·n.
    external: J, ½∫r_ext·w."""

    before: float
    change: float
    volume: float
    surface: float
    wall: float
    external: float

    @property
    def error(self) -> float:
        """|change − the other terms|, as a share of the largest of all terms."""
        terms = (self.volume, self.surface, self.wall, self.external)
        largest = max(abs(self.before), abs(self.change), *map(abs, terms))
        return abs(self.change - sum(terms)) / largest if largest > 0 else 0.0


@dataclass(frozen=True, eq=False, kw_only=True)
class CollisionAnswer:
    """Hold the right velocity of a crowd, what its walls gave, and the certificate.

    velocity_sum: (nodes,d) m/s, w at space.nodes.
    left_velocity: (nodes,d) m/s, u⁻ at space.nodes.
    left_field: (d,elements,q) m/s, u⁻ at the quadrature points.
    density_field: (elements,q) kg/m², ρ there.
    wall_force: (c,) N·s ≥ 0, ∫μφ: the whole reaction that the node at space.wall gets.
    active: (c,), whether the crowd stays at the wall there, u⁺·n = 0.
    residual: dimensionless, the largest of |Aw − b + Cᵀr|_i / A_ii and
        |min(r_i/A_ii, g_i − (Cw)_i)| over ‖u⁻‖∞ (over ‖w‖∞ where u⁻ = 0), recomputed from the
        answer in the untransformed unknowns.
    energy: J.
    status, reason: solved where the residual is within the tolerance, else why not.
    iterations, seconds: of the active set; wall time."""

    space: Space
    medium: Medium
    velocity_sum: Floats
    left_velocity: Floats
    left_field: Floats
    density_field: Floats
    wall_force: Floats
    active: Mask
    residual: float
    energy: EnergyBalance
    status: Status
    reason: str
    iterations: int
    seconds: float

    @property
    def right_velocity(self) -> Floats:
        """(nodes,d) m/s, u⁺ = w − u⁻ at space.nodes; where u⁻ jumps, only as good as its value
        at the node."""
        return self.velocity_sum - self.left_velocity

    @property
    def wall_percussion(self) -> Floats:
        """(c,) N·s/m ≥ 0, μ at space.wall: the force of a node over the length that it stands for.

        Where μ is smooth its nodal values are of order about 3/2 (P1) and 2 (P2); the total force
        is of order 2 and 4."""
        return np.asarray(self.wall_force / self.space.wall.weight)

    @cached_property
    def unknowns(self) -> Floats:
        """w as the vector of degrees of freedom of space.basis."""
        vector = np.empty(self.space.basis.N)
        vector[self.space.components] = self.velocity_sum.T
        return vector

    @cached_property
    def sum_field(self) -> Any:
        """w and its gradient at the quadrature points (skfem DiscreteField)."""
        return self.space.basis.interpolate(self.unknowns)

    @property
    def right_field(self) -> Floats:
        """(d,elements,q) m/s, u⁺ at the quadrature points: right also where u⁻ is only in L²."""
        return np.asarray(np.asarray(self.sum_field) - self.left_field)


class _Problem:
    """min ½w·Aw − b·w subject to Cw ≤ g: A and its surface part, the push's part of b, b, g.

    rho (elements,q) kg/m² and u⁻ (d,elements,q) m/s are taken at the quadrature points."""

    def __init__(
        self,
        space: Space,
        medium: Medium,
        left_velocity: ArrayLike | Field,
        external: ArrayLike | Field | None,
        surface_everywhere: bool,
    ) -> None:
        mesh, basis = space.mesh, space.basis
        left, self.rho = checked(left_velocity, mesh), density_at(space, medium.rho)
        u = self.left = values_at(space, basis, left, "left_velocity")
        matrix = volume.assemble(basis, rho=self.rho, k_v=medium.k_v)
        self.surface: Any = None
        if medium.k_s > 0:
            edge: Any = space.border("wall")
            normals = np.asarray(edge.normals)
            approach = (values_at(space, edge, left, "left_velocity") * normals).sum(0)
            # a crowd that walks along the wall presses it with rounding of either sign
            pressed = surface_everywhere | (approach >= -1e-12 * np.abs(u).max())
            self.surface = surface.assemble(edge, k_s=medium.k_s * pressed)
            matrix = matrix + self.surface
        self.push = np.zeros(basis.N)
        if external is not None:
            free = space.border("free")
            if free is None:
                raise ValueError("external: the mesh has no boundary named free to push on")
            pushed = checked(external, mesh, "external")
            self.push = traction.assemble(free, r=values_at(space, free, pushed, "external"))
        self.space, self.medium, self.matrix = space, medium, sparse.csr_array(matrix)
        self.load = 2 * momentum.assemble(basis, rho=self.rho, u=u) + self.push
        self.nodes = nodal_values(space, left, "left_velocity")
        self.bound = (self.nodes[space.wall.node] * space.wall.normal).sum(1)

    def energy(self, w: Floats, force: Floats) -> EnergyBalance:
        """Balance the kinetic energy."""
        basis, rho, u = self.space.basis, self.rho, self.left
        field = basis.interpolate(w)
        lost = float(dissipated.assemble(basis, w=field, k_v=self.medium.k_v))
        return EnergyBalance(
            before=0.5 * float((rho * (u**2).sum(0) * basis.dx).sum()),
            change=float(gain.assemble(basis, rho=rho, u=u, w=field)),
            volume=-0.5 * lost,
            surface=-0.5 * float(w @ (self.surface @ w)) if self.surface is not None else 0.0,
            wall=-0.5 * float(force @ (self.space.constraints @ w)),
            external=0.5 * float(self.push @ w),
        )

    def residual(self, w: Floats, force: Floats) -> float:
        """The worst violation of Aw + Cᵀr = b and 0 ≤ r ⟂ g − Cw ≥ 0, as velocities (m/s)."""
        space, diagonal = self.space, self.matrix.diagonal()
        unbalanced = self.matrix @ w - self.load + space.constraints.T @ force
        stiffness = diagonal[space.components[:, space.wall.node]].max(0)
        room = self.bound - space.constraints @ w
        complementarity = np.abs(np.minimum(force / stiffness, room))
        return float(max((np.abs(unbalanced) / diagonal).max(), complementarity.max()))


def collide(
    space: Space,
    medium: Medium,
    left_velocity: ArrayLike | Field,
    *,
    external: ArrayLike | Field | None = None,
    surface_everywhere: bool = False,
    tolerance: float = 1e-9,
) -> CollisionAnswer:
    """Solve the collision (11).

    left_velocity: u⁻, (d,) m/s, (n,d) one per vertex, or a function of points (m,d) → (m,d).
    external: r_ext, N·s/m on the boundary "free", of the same kinds.
    surface_everywhere: whether k_s acts on all walls, as the paper prints it, which pulls at a
        crowd that leaves; else where u⁻·n ≥ 0.
    tolerance: dimensionless, of the residual.

    min ½a(w,w) − 2∫ρu⁻·w − ∫_Γf r_ext·w subject to w·n ≤ u⁻·n at the nodes of the walls, with
    a(w,v) = ∫ρw·v + k_v∫D(w):D(v) + k_s∫w·v: (11) multiplied out for w = u⁺ + u⁻.

    Raises ValueError naming the field for a wrong shape or value."""
    begin = time.perf_counter()
    positive(tolerance=tolerance)
    problem = _Problem(space, medium, left_velocity, external, surface_everywhere)
    left, nodes, bound = problem.left, problem.nodes, problem.bound
    frame, position = space.local
    # walls that the crowd presses or passes along: most of those that will hold it
    toward = bound >= -1e-9 * np.abs(nodes).max()
    local = sparse.csc_array(frame.T @ problem.matrix @ frame)
    solution = bounded_minimum(local, frame.T @ problem.load, position, bound, start=toward)
    w, force = frame @ solution.z, solution.multiplier
    size = max(float(np.abs(left).max()), float(np.abs(nodes).max()))
    residual = problem.residual(w, force) / (size or float(np.abs(w).max()) or 1.0)
    status, reason = judged(residual, tolerance, "the velocities", solution.unsettled)
    return CollisionAnswer(
        space=space,
        medium=medium,
        velocity_sum=w[space.components].T,
        left_velocity=nodes,
        left_field=left,
        density_field=problem.rho,
        wall_force=force,
        active=solution.active,
        residual=residual,
        energy=problem.energy(w, force),
        status=status,
        reason=reason,
        iterations=solution.iterations,
        seconds=time.perf_counter() - begin,
    )
