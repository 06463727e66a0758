"""Continuum models of the crowd before an exit that opens, as fields under the same kernel as the
disks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from skfem import MeshTri1

from analysis.paper.continuum.bridge.crowd import (
    HALF_DOOR,
    KERNEL,
    MASS,
    SPEED,
    area,
    points,
    to_exit,
    toward_exit,
)
from nscd.arrays import Floats
from nscd.continuum.collision import collide
from nscd.continuum.medium import PERSON, TABLE_1, Medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.pressure import pressure
from nscd.continuum.rivals.first_order import first_order_flow
from nscd.continuum.rivals.frictional import frictional_flow
from nscd.continuum.room import Border, Room
from nscd.continuum.space import Space
from nscd.stress import smear

MESH = 0.3  # m
ARC = 90  # edges of each quarter of the crowd's round border


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Model:
    """A continuum answer: pressure (m,) N·s/m and right velocity (m,2) m/s at `points()` under
    KERNEL, the share of the kinetic energy that is kept, the load of the walls (N·s), and the
    warning of an answer that is not solved."""

    name: str
    pressure: Floats
    velocity: Floats
    kept: float
    wall_load: float
    warning: str = ""


@dataclass(frozen=True, eq=False)
class Crowd:
    """The continuum that a crowd of disks of size R (m) stands for: x < 0 within R of the exit, 45
    t evenly spread."""

    size: float

    @property
    def density(self) -> float:
        """kg/m²."""
        return MASS / area(self.size)

    @cached_property
    def mesh(self) -> MeshTri1:
        """Walls on x = 0, the exit in their middle, a free border at R."""
        angle = np.linspace(0.0, 0.5 * np.pi, ARC + 1)
        upper = np.column_stack([-np.sin(angle), np.cos(angle)]) * self.size + [0.0, HALF_DOOR]
        lower = np.column_stack([-np.cos(angle), -np.sin(angle)]) * self.size - [0.0, HALF_DOOR]
        outline = np.vstack([upper, lower, [[0.0, -HALF_DOOR], [0.0, HALF_DOOR]]])
        border: list[Border] = ["free"] * (len(outline) - 3)
        return mesh_of(Room(outline=outline, border=(*border, "wall", "exit", "wall")), MESH)

    @cached_property
    def space(self) -> Space:
        """P1 vector elements."""
        return Space(self.mesh)

    @cached_property
    def _places(self) -> tuple[Floats, Floats]:
        """Quadrature points (q,2) m and weights (q,) m²."""
        basis = self.space.basis
        where = np.ascontiguousarray(np.asarray(basis.global_coordinates()).reshape(2, -1).T)
        return where, np.asarray(basis.dx).ravel()

    @cached_property
    def _spread(self) -> Floats:
        """∫φ over the crowd at `points()` (m,)."""
        where, weight = self._places
        return smear(where, weight[:, None], KERNEL, points())[0][:, 0]

    def model(
        self, name: str, pressure: Floats, right: Floats, wall_load: float, warning: str = ""
    ) -> Model:
        """A model of pressure (q,) N·s/m and right velocity (q,2) m/s at the quadrature points."""
        where, weight = self._places
        values, _ = smear(
            where, weight[:, None] * np.column_stack([pressure, right]), KERNEL, points()
        )
        kept = float((weight * (right**2).sum(1)).sum() / (weight.sum() * SPEED**2))
        velocity = values[:, 1:] / self._spread[:, None]
        return Model(
            name=name,
            pressure=values[:, 0],
            velocity=velocity,
            kept=kept,
            wall_load=wall_load,
            warning=warning,
        )

    def blocked(self) -> Model:
        """Nobody moves: p = ρU(R − d) with the distance d from the exit, the solution of (20) for a
        shut door: u_d = −U∇d."""
        where, _ = self._places
        pressure = self.density * SPEED * (self.size - to_exit(where))
        return self.model(
            "nobody moves", pressure, np.zeros_like(where), self.density * SPEED * self.size**2
        )

    def unhindered(self) -> Model:
        """Everybody walks as they want: u⁺ = u⁻, no pressure."""
        where, weight = self._places
        return self.model("u⁺ = u⁻", np.zeros_like(weight), toward_exit(where), 0.0)

    def first_order(self) -> Model:
        """(20) in its complementarity form, for a given mass: ρu⁺ = ρu_d − ∇p, div u⁺ ≥ 0 ⟂ p ≥
        0."""
        flow = first_order_flow(self.mesh, toward_exit)
        pressure = self.density * flow.pressure
        warning = "" if flow.status == "solved" else f"(20): {flow.status}: {flow.reason}"
        return self._of_cells("(20)", pressure, pressure, flow.right_velocity, warning)

    def frictional(self, friction: float) -> Model:
        """(20) with internal friction s."""
        where, weight = self._places
        share = weight.reshape(self.mesh.nelements, -1, 1)
        desired = (share * toward_exit(where).reshape(*share.shape[:2], 2)).sum(1) / share.sum(1)
        flow = frictional_flow(self.mesh, self.density, desired, friction)
        p, a, _ = flow.stress.T
        name = f"(20), friction {friction:g}"
        warning = (
            ""
            if flow.status == "solved"
            else f"{name}: {flow.status}: residual {flow.residual:.1e}"
        )
        return self._of_cells(name, p, p - a, flow.right_velocity, warning)

    def _of_cells(
        self, name: str, pressure: Floats, across: Floats, right: Floats, warning: str
    ) -> Model:
        """A model of P1 pressure and P1 stress −Σ_xx across the walls (n,) N·s/m, and a right
        velocity (m,2) in the cells."""
        basis = self.space.scalar
        vertex = basis.nodal_dofs[0]
        values = np.zeros(basis.N)
        values[vertex] = pressure
        count = basis.dx.shape[1]
        ends = self.mesh.facets[:, (self.mesh.boundaries or {})["wall"]]
        length = np.hypot(*(self.mesh.p[:, ends[1]] - self.mesh.p[:, ends[0]]))
        load = float((length * across[ends].mean(0)).sum())
        return self.model(
            name,
            np.asarray(basis.interpolate(values)).ravel(),
            np.repeat(right, count, axis=0),
            load,
            warning,
        )

    def deformable(self, volume: float, surface: float = 0.0) -> Model:
        """(11) with k_v (kg) and k_s (kg/m)."""
        medium = Medium(
            density=self.density, volume_dissipation=volume, surface_dissipation=surface
        )
        answer = collide(self.space, medium, toward_exit)
        wall = self.space.wall
        # along +x: what the crowd gives to the walls
        reaction = answer.wall_percussion * wall.weight
        name = f"(11), k_v = {volume:,.0f} kg"
        return self.model(
            name,
            pressure(answer).ravel(),
            answer.right_field.reshape(2, -1).T,
            float(reaction @ wall.normal[:, 0]),
            "" if answer.status == "solved" else f"{name}: {answer.status}: {answer.reason}",
        )

    def table(self) -> Model:
        """(11) with the paper's Table 1, per person of 75 kg."""
        k_v, k_s = TABLE_1.volume_dissipation, TABLE_1.surface_dissipation
        return self.deformable(k_v * PERSON, k_s * PERSON)
