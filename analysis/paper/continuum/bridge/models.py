"""Continuum models of the crowd before an exit that opens, under the same kernel as the disks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from skfem import MeshTri1

from analysis.paper.answers import Answer
from analysis.paper.continuum.bridge.crowd import (
    HALF_DOOR,
    KERNEL,
    MASS,
    SPEED,
    area,
    points,
    toward_exit,
)
from analysis.paper.continuum.exit_room import to_exit
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
VOLUMES = 10.0 ** np.arange(2.0, 4.51, 0.25)  # kg, among which k_v is fitted
FRICTIONS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Model:
    """A continuum answer.

    law: in words, without its parameter.
    friction, volume: the parameter s or k_v (kg), of a law that has one.
    pressure: (m,) N·s/m at `points()` under KERNEL.
    velocity: (m,2) m/s, u⁺ there.
    kept: share of the kinetic energy.
    wall_load: N·s.
    answer: of the solver; None for what is known without one.
    """

    law: str
    friction: float | None = None
    volume: float | None = None
    pressure: Floats
    velocity: Floats
    kept: float
    wall_load: float
    answer: Answer | None

    @property
    def name(self) -> str:
        """The law and its parameter."""
        if self.friction is not None:
            return f"{self.law}, friction {self.friction:g}"
        return self.law if self.volume is None else f"{self.law}, k_v = {self.volume:,.0f} kg"


@dataclass(frozen=True, eq=False)
class Crowd:
    """The continuum that a crowd of disks stands for: x < 0 within `size` of the exit, 45 t.

    size: m, R.
    """

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
    def _spread(self) -> Floats:
        """(m,), ∫φ over the crowd at `points()`."""
        return smear(self.space.points, self.space.weights[:, None], KERNEL, points())[0][:, 0]

    def _model(
        self,
        law: str,
        pressure: Floats,
        right: Floats,
        wall_load: float,
        answer: Answer | None = None,
        **parameter: float,
    ) -> Model:
        """A model of pressure (q,) N·s/m and right velocity (q,2) m/s at the quadrature points."""
        weight = self.space.weights
        columns = weight[:, None] * np.column_stack([pressure, right])
        values, _ = smear(self.space.points, columns, KERNEL, points())
        return Model(
            law=law,
            pressure=values[:, 0],
            velocity=values[:, 1:] / self._spread[:, None],
            kept=float((weight * (right**2).sum(1)).sum() / (weight.sum() * SPEED**2)),
            wall_load=wall_load,
            answer=answer,
            **parameter,
        )

    def blocked(self) -> Model:
        """Nobody moves: p = ρU(R − d) with the distance d from the exit, the solution of (20) for a
        shut door: u_d = −U∇d."""
        where, push = self.space.points, self.density * SPEED
        p = push * (self.size - to_exit(where))
        return self._model("nobody moves", p, np.zeros_like(where), push * self.size**2)

    def unhindered(self) -> Model:
        """Everybody walks as they want: u⁺ = u⁻, no pressure."""
        where = self.space.points
        return self._model("u⁺ = u⁻", np.zeros(len(where)), toward_exit(where), 0.0)

    def first_order(self) -> Model:
        """(20) in its complementarity form, for a given mass: ρu⁺ = ρu_d − ∇p, div u⁺ ≥ 0 ⟂ p ≥
        0."""
        flow = first_order_flow(self.mesh, toward_exit)
        p = self.density * flow.pressure
        return self._of_cells((p, p), flow.right_velocity, flow)

    def frictional(self, friction: float) -> Model:
        """(20) with internal friction s."""
        where, weight = self.space.points, self.space.weights
        share = weight.reshape(self.mesh.nelements, -1, 1)
        desired = (share * toward_exit(where).reshape(*share.shape[:2], 2)).sum(1) / share.sum(1)
        flow = frictional_flow(self.mesh, self.density, desired, friction)
        p, a, _ = flow.stress.T
        return self._of_cells((p, p - a), flow.right_velocity, flow, friction=friction)

    def _of_cells(
        self, stress: tuple[Floats, Floats], right: Floats, answer: Answer, **parameter: float
    ) -> Model:
        """A model of P1 pressure and stress −Σ_xx across the walls (n,) N·s/m, and a right velocity
        (m,2) in the cells."""
        basis, (p, across) = self.space.scalar, stress
        values = np.zeros(basis.N)
        values[basis.nodal_dofs[0]] = p
        ends = self.mesh.facets[:, (self.mesh.boundaries or {})["wall"]]
        length = np.hypot(*(self.mesh.p[:, ends[1]] - self.mesh.p[:, ends[0]]))
        return self._model(
            "(20)",
            np.asarray(basis.interpolate(values)).ravel(),
            np.repeat(right, basis.dx.shape[1], axis=0),
            float((length * across[ends].mean(0)).sum()),
            answer,
            **parameter,
        )

    def deformable(self, volume: float, surface: float = 0.0) -> Model:
        """(11) with k_v (kg) and k_s (kg/m)."""
        medium = Medium(
            density=self.density, volume_dissipation=volume, surface_dissipation=surface
        )
        answer = collide(self.space, medium, toward_exit)
        # along +x: what the crowd gives to the walls
        load = float(answer.wall_force @ self.space.wall.normal[:, 0])
        right = answer.right_field.reshape(2, -1).T
        return self._model("(11)", pressure(answer).ravel(), right, load, answer, volume=volume)

    def table(self) -> Model:
        """(11) with the paper's Table 1, per person of 75 kg."""
        k_v, k_s = TABLE_1.volume_dissipation, TABLE_1.surface_dissipation
        return self.deformable(k_v * PERSON, k_s * PERSON)


@dataclass(frozen=True, kw_only=True, eq=False)
class Models:
    """The continuum models of one crowd.

    first_order, blocked, unhindered: (20), nobody moves, everybody walks freely.
    table, deformable: (11) with Table 1, and with each of VOLUMES.
    frictional: (20) with each of FRICTIONS.
    """

    first_order: Model
    blocked: Model
    unhindered: Model
    table: Model
    deformable: Sequence[Model]
    frictional: Sequence[Model]

    @classmethod
    def of(cls, crowd: Crowd) -> Models:
        """Solve them all."""
        return cls(
            first_order=crowd.first_order(),
            blocked=crowd.blocked(),
            unhindered=crowd.unhindered(),
            table=crowd.table(),
            deformable=[crowd.deformable(float(volume)) for volume in VOLUMES],
            frictional=[crowd.frictional(friction) for friction in FRICTIONS],
        )

    @property
    def answers(self) -> list[tuple[str, Answer]]:
        """All answers, named."""
        every = (self.first_order, self.table, *self.deformable, *self.frictional)
        return [(m.name, m.answer) for m in every if m.answer is not None]
