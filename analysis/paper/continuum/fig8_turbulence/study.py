"""Contact forces of the crowd turbulence (15)–(19) and of the collision (11) in one room, cell by
cell."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cache, cached_property

import numpy as np
from skfem import MeshTri1

from analysis.paper.continuum.exit_room import (
    BODY,
    DENSITY,
    EXIT,
    MESH,
    PERSON,
    SIDE,
    SURFACE,
    TIME_STEP,
    VOLUME,
    Map,
    map_of,
)
from nscd.arrays import Floats
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.left_velocity import Field, random_speeds, toward_exit
from nscd.continuum.medium import TABLE_1, Medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.pressure import BodyFields, body_fields, percussion_density, pressure
from nscd.continuum.rivals.cells import Cells
from nscd.continuum.rivals.density_laws import TurbulencePressure
from nscd.continuum.rivals.turbulence import (
    Congestion,
    TurbulenceLaw,
    TurbulenceStep,
    turbulence_step,
)
from nscd.continuum.room import Room, square_room
from nscd.continuum.space import Space
from nscd.stress import smear

FRICTION = TABLE_1.friction


class Case(StrEnum):
    """The left velocities of Fig. 8: (a) random, 1.7 ± 0.5 m/s; (b) 1.23 m/s; toward the exit."""

    RANDOM = "a"
    UNIFORM = "b"


class Pressing(StrEnum):
    """Where the pressure of the crowd turbulence comes from: (16) with Table 1, with c₂ that makes
    it continuous, with p = 0 on the exit, or from congestion above the yield density."""

    LAW = "(16)"
    CONTINUOUS = "(16), c₂ = 32.91"
    OPEN = "(16), 0 on the exit"
    CONGESTION = "congestion"


class Wall(StrEnum):
    """Where k_s acts: where the crowd presses the wall, everywhere as printed, nowhere; or as a
    fixed share of k_v."""

    PRESSED = "pressed"
    EVERYWHERE = "everywhere"
    NOWHERE = "nowhere"
    SHARE = "k_s = k_v/9"


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """What is computed for Fig. 8: room and mesh sides (m), order of the elements, seed of the
    random speeds; δt (s), β, pressure of the crowd turbulence; where k_s acts; whether k_v and k_s
    count people (Table 1 with ρ in people) or kilograms."""

    side: float = SIDE
    mesh: float = MESH
    order: int = 1
    seed: int = 1
    time_step: float = TIME_STEP
    friction: float = FRICTION
    pressing: Pressing = Pressing.LAW
    wall: Wall = Wall.PRESSED
    mixed_units: bool = False
    person: float = PERSON


def left_velocity(case: Case, room: Room, seed: int) -> Field:
    """u⁻ of a case; the random speeds are drawn for each person's place."""
    if case is Case.UNIFORM:
        return toward_exit(room, 1.23)
    direction = toward_exit(room, 1.0)
    return random_speeds(room, direction, mean=1.7, deviation=0.5, seed=seed, cell=DENSITY**-0.5)


@cache
def _mesh(side: float, size: float) -> tuple[Room, MeshTri1]:
    room = square_room(side, EXIT)
    return room, mesh_of(room, size)


@cache
def _space(side: float, size: float, order: int) -> Space:
    return Space(_mesh(side, size)[1], order)


@cache
def _step(case: Case, setting: Setting) -> TurbulenceStep:
    room, mesh = _mesh(setting.side, setting.mesh)
    law: TurbulencePressure | Congestion | Floats = TurbulencePressure()
    if setting.pressing is Pressing.CONTINUOUS:
        law = TurbulencePressure().continuous()
    elif setting.pressing is Pressing.CONGESTION:
        law = Congestion()
    elif setting.pressing is Pressing.OPEN:
        law = np.where(
            Cells(mesh).open, 0.0, setting.person * TurbulencePressure().pressure(DENSITY)
        )
    return turbulence_step(
        mesh,
        DENSITY,
        left_velocity(case, room, setting.seed),
        TurbulenceLaw(pressure=law, friction=setting.friction, mass_per_person=setting.person),
        time_step=setting.time_step,
    )


@dataclass(frozen=True, eq=False)
class Forces:
    """One case in one setting: the crowd turbulence solved once, (11) for each k_v that is asked
    for."""

    case: Case
    setting: Setting

    @cached_property
    def room(self) -> Room:
        """The square."""
        return _mesh(self.setting.side, self.setting.mesh)[0]

    @cached_property
    def space(self) -> Space:
        """Of (11)."""
        return _space(self.setting.side, self.setting.mesh, self.setting.order)

    @cached_property
    def map(self) -> Map:
        """Where body means are taken."""
        return map_of(self.room)

    @cached_property
    def area(self) -> Floats:
        """Of the cells (m,) m²."""
        return Cells(self.space.mesh).measure

    @cached_property
    def left(self) -> Field:
        """u⁻; random speeds are drawn for each person's place."""
        return left_velocity(self.case, self.room, self.setting.seed)

    @cached_property
    def turbulence(self) -> TurbulenceStep:
        """One step of the crowd turbulence, which knows nothing of (11)."""
        alone = replace(self.setting, wall=Wall.PRESSED, order=1, mixed_units=False)
        return _step(self.case, alone)

    @cached_property
    def theirs(self) -> Floats:
        """−δt∇·σ of the crowd turbulence in the cells (m,2) N·s/m²."""
        return self.turbulence.percussion_density

    @cached_property
    def theirs_on_bodies(self) -> Floats:
        """The same as means over a body (n,2)."""
        middle = np.ascontiguousarray(self.space.mesh.p[:, self.space.mesh.t].mean(1).T)
        weighted = self.area[:, None] * np.hstack([np.ones((len(middle), 1)), self.theirs])
        sums, _ = smear(middle, weighted, BODY, self.map.points)
        return sums[:, 1:] / sums[:, :1]

    def pair(self, volume: float) -> Pair:
        """(11) with this k_v beside the crowd turbulence."""
        setting = self.setting
        surface = {Wall.NOWHERE: 0.0, Wall.SHARE: volume * SURFACE / VOLUME}.get(
            setting.wall, SURFACE
        )
        crowd = Medium(
            density=DENSITY,
            volume_dissipation=volume,
            surface_dissipation=surface,
            mass_per_person=setting.person,
        )
        if setting.mixed_units:
            crowd = replace(crowd, density=DENSITY * setting.person, mass_per_person=None)
        everywhere = setting.wall is Wall.EVERYWHERE
        answer = collide(self.space, crowd, self.left, surface_everywhere=everywhere)
        weight = self.space.basis.dx
        ours = ((percussion_density(answer) * weight).sum(2) / weight.sum(1)).T
        return Pair(self, answer, ours)


@dataclass(frozen=True, eq=False)
class Pair:
    """The answer of (11), and its div σ in the cells (m,2) N·s/m², beside the crowd turbulence."""

    forces: Forces
    answer: CollisionAnswer
    ours: Floats

    @cached_property
    def bodies(self) -> BodyFields:
        """Of (11), as means over a body at the points of the map."""
        return body_fields(self.answer, BODY, self.forces.map.points)

    def moduli(self) -> float:
        """‖|F| − |F_t|‖/‖F_t‖ over the cells, in L²."""
        return self._share(np.hypot(*self.ours.T) - np.hypot(*self.forces.theirs.T))

    def vectors(self) -> float:
        """‖F − F_t‖/‖F_t‖ over the cells, in L²."""
        return self._share(np.hypot(*(self.ours - self.forces.theirs).T))

    def _share(self, difference: Floats) -> float:
        area, theirs = self.forces.area, self.forces.theirs
        return float(np.sqrt(area @ difference**2 / (area @ (theirs**2).sum(1))))

    def on_bodies(self) -> float:
        """‖|F| − |F_t|‖/‖F_t‖ of the means over a body, in L²."""
        area, theirs = self.forces.map.area, np.hypot(*self.forces.theirs_on_bodies.T)
        difference = np.hypot(*self.bodies.percussion_density.T) - theirs
        return float(np.sqrt(area @ difference**2 / (area @ theirs**2)))

    def _mean(self) -> float:
        """Mean over the room of ||F| − |F_t|| (N·s/m²)."""
        area = self.forces.area
        difference = np.abs(np.hypot(*self.ours.T) - np.hypot(*self.forces.theirs.T))
        return float(area @ difference / area.sum())

    def of_mean(self) -> float:
        """Mean difference over the mean of |F_t|."""
        area = self.forces.area
        return self._mean() * float(area.sum() / (area @ np.hypot(*self.forces.theirs.T)))

    def of_largest_cell(self) -> float:
        """Mean difference over the largest |F_t| in any cell, which is the mesh's."""
        return self._mean() / float(np.hypot(*self.forces.theirs.T).max())

    def of_largest_body(self) -> float:
        """Mean difference of the means over a body, over the largest of |F_t| among them."""
        area, theirs = self.forces.map.area, np.hypot(*self.forces.theirs_on_bodies.T)
        difference = np.abs(np.hypot(*self.bodies.percussion_density.T) - theirs)
        return float(area @ difference / area.sum() / theirs.max())

    def pressures(self) -> float:
        """‖p − δt p_t‖/‖δt p_t‖, p = −½ tr σ as means over a body, p_t from (16) at uniform
        density."""
        area, theirs = self.forces.map.area, self._their_pressure()
        return float(
            np.sqrt(area @ (self.bodies.pressure - theirs) ** 2 / (area.sum() * theirs**2))
        )

    def largest_pressures(self) -> float:
        """|max p − δt p_t|/δt p_t with the largest p over a body."""
        return abs(float(self.bodies.pressure.max()) / self._their_pressure() - 1)

    def largest_raw_pressures(self) -> float:
        """The same with the largest p in any triangle, which is the mesh's."""
        return abs(float(pressure(self.answer).max()) / self._their_pressure() - 1)

    def _their_pressure(self) -> float:
        """δt p_t (N·s/m)."""
        setting = self.forces.setting
        return setting.time_step * setting.person * float(TurbulencePressure().pressure(DENSITY))
