"""The collision of a deformable crowd with its walls: problem (11) of the paper, solved for w = u⁺
+ u⁻."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sparse
from numpy.typing import ArrayLike

from nscd.arrays import Flags, Floats
from nscd.continuum import forms
from nscd.continuum.active_set import bounded_minimum
from nscd.continuum.forms import density_at, nodal_values, values_at
from nscd.continuum.left_velocity import Field, checked
from nscd.continuum.medium import Medium
from nscd.continuum.space import Space
from nscd.percussions import Status


@dataclass(frozen=True, slots=True, kw_only=True)
class EnergyBalance:
    """Where the kinetic energy goes, in J: change = volume + surface + wall + external.

    change ½∫ρ(|u⁺|² − |u⁻|²); volume −½k_v∫|D(w)|²; surface −½k_s∫|w|² where the wall dissipates;
    wall −½∫μ w·n; external ½∫r_ext·w. before: ½∫ρ|u⁻|²."""

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
    """The right velocity of a crowd and what its walls gave, with the certificate.

    velocity_sum w (nodes,d) m/s at space.nodes; left_velocity u⁻ (nodes,d) m/s there; left_field u⁻
    (d,elements,q) m/s and density_field ρ (elements,q) kg/m² at the quadrature points; wall_force r
    (c,) N·s ≥ 0: the whole reaction that the node at space.wall gets, ∫μφ; active (c,): the crowd
    stays at the wall there, u⁺·n = 0.

    residual: the largest of |Aw − b + Cᵀr|_i / A_ii and |min(r_i/A_ii, g_i − (Cw)_i)|, over ‖u⁻‖∞
    (over ‖w‖∞ where u⁻ = 0), recomputed from the answer in the untransformed unknowns. status:
    solved where it is within the tolerance."""

    space: Space
    medium: Medium
    velocity_sum: Floats
    left_velocity: Floats
    left_field: Floats
    density_field: Floats
    wall_force: Floats
    active: Flags
    residual: float
    energy: EnergyBalance
    status: Status
    reason: str
    iterations: int
    seconds: float

    @property
    def right_velocity(self) -> Floats:
        """u⁺ = w − u⁻ (nodes,d) m/s at space.nodes; where u⁻ jumps, only as good as its value at
        the node."""
        return self.velocity_sum - self.left_velocity

    @property
    def wall_percussion(self) -> Floats:
        """μ (c,) N·s/m ≥ 0 at space.wall, lumped: the force of a node over the length that it
        stands for.

        Where μ is smooth its nodal values are of order about 3/2 (P1) and 2 (P2); the total force
        is of order 2 and 4."""
        percussion: Floats = self.wall_force / self.space.wall.weight
        return percussion

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
        """u⁺ (d,elements,q) m/s at the quadrature points: right also where u⁻ is only in L²."""
        field: Floats = np.asarray(self.sum_field) - self.left_field
        return field


def collide(
    space: Space,
    medium: Medium,
    left_velocity: ArrayLike | Field,
    *,
    external: ArrayLike | Field | None = None,
    surface_everywhere: bool = False,
    tolerance: float = 1e-9,
) -> CollisionAnswer:
    """Solve min ½a(w,w) − 2∫ρu⁻·w − ∫_Γf r_ext·w subject to w·n ≤ u⁻·n on the walls, with a(w,v) =
    ∫ρw·v + k_v∫D(w):D(v) + k_s∫w·v, the last over the walls where u⁻·n ≥ 0 (surface_everywhere:
    over all walls, as the paper prints it, which pulls at a crowd that leaves). It is (11)
    multiplied out for w = u⁺ + u⁻, which is in H¹ although u⁻ need not be. The walls' condition
    holds at the nodes.

    left_velocity u⁻: a vector (d,) m/s, one a vertex (n,d), or a function of points (m,d) → (m,d).
    external r_ext: the same kinds, (N·s/m) on the boundary "free". Raises ValueError naming the
    field for a wrong shape or value."""
    begin = time.perf_counter()
    mesh, basis = space.mesh, space.basis
    if not tolerance > 0:
        raise ValueError(f"tolerance: {tolerance}; a positive number is needed")
    left, rho = checked(left_velocity, mesh), density_at(space, medium.rho)
    u = values_at(space, basis, left, "left_velocity")
    matrix = forms.volume.assemble(basis, rho=rho, k_v=medium.k_v)
    load = forms.momentum.assemble(basis, rho=rho, u=u)
    surface: Any = None
    if medium.k_s > 0:
        edge = space.border("wall")
        approach = (values_at(space, edge, left, "left_velocity") * np.asarray(edge.normals)).sum(0)  # type: ignore[union-attr]
        # a crowd that walks along the wall presses it with rounding of either sign
        pressed = (
            np.ones_like(approach) if surface_everywhere else approach >= -1e-12 * np.abs(u).max()
        )
        surface = forms.surface.assemble(edge, k_s=medium.k_s * pressed)
        matrix = matrix + surface
    push = np.zeros(basis.N)
    if external is not None:
        free = space.border("free")
        if free is None:
            raise ValueError("external: the mesh has no boundary named free to push on")
        pushed = checked(external, mesh, "external")
        push = forms.traction.assemble(free, r=values_at(space, free, pushed, "external"))
    left_nodes = nodal_values(space, left, "left_velocity")
    bound = (left_nodes[space.wall.node] * space.wall.normal).sum(1)
    frame, place = space.local
    local = sparse.csc_array(frame.T @ matrix @ frame)
    # walls that the crowd presses or passes along: most of those that will hold it
    toward = bound >= -1e-9 * np.abs(left_nodes).max()
    answer = bounded_minimum(local, frame.T @ (2 * load + push), place, bound, start=toward)
    w, force = frame @ answer.z, answer.multiplier
    energy = EnergyBalance(
        before=0.5 * float((rho * (u**2).sum(0) * basis.dx).sum()),
        change=float(forms.gain.assemble(basis, rho=rho, u=u, w=basis.interpolate(w))),
        volume=-0.5
        * float(forms.dissipated.assemble(basis, w=basis.interpolate(w), k_v=medium.k_v)),
        surface=-0.5 * float(w @ (surface @ w)) if surface is not None else 0.0,
        wall=-0.5 * float(force @ (space.constraints @ w)),
        external=0.5 * float(push @ w),
    )
    size = (
        max(float(np.abs(u).max()), float(np.abs(left_nodes).max()))
        or float(np.abs(w).max())
        or 1.0
    )
    residual = _residual(space, sparse.csr_array(matrix), 2 * load + push, w, force, bound) / size
    status, reason = Status.SOLVED, ""
    if not np.isfinite(residual):
        status, reason = Status.FAILED, "the velocities are not finite numbers"
    elif residual > tolerance:
        what = (
            ""
            if answer.settled
            else f"; the active set did not settle in {answer.iterations} iterations"
        )
        status, reason = Status.INACCURATE, f"residual {residual:.1e} above {tolerance:.1e}{what}"
    return CollisionAnswer(
        space=space,
        medium=medium,
        velocity_sum=w[space.components].T,
        left_velocity=left_nodes,
        left_field=u,
        density_field=rho,
        wall_force=force,
        active=answer.active,
        residual=float(residual),
        energy=energy,
        status=status,
        reason=reason,
        iterations=answer.iterations,
        seconds=time.perf_counter() - begin,
    )


def _residual(
    space: Space, matrix: Any, load: Floats, w: Floats, force: Floats, bound: Floats
) -> float:
    """The worst violation of Aw + Cᵀr = b and 0 ≤ r ⟂ g − Cw ≥ 0, as velocities (m/s)."""
    diagonal = matrix.diagonal()
    stationarity = np.abs(matrix @ w - load + space.constraints.T @ force) / diagonal
    stiffness = diagonal[space.components[:, space.wall.node]].max(0)
    complementarity = np.abs(np.minimum(force / stiffness, bound - space.constraints @ w))
    return float(max(stationarity.max(), complementarity.max()))
