"""Contact forces of the crowd turbulence (15)–(19) and of the collision (11), cell by cell."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cache, cached_property

import numpy as np
from skfem import MeshTri1

from analysis.paper.answers import Answer
from analysis.paper.continuum.exit_room import BODY, EXIT, MESH, SIDE, Map, map_of
from nscd.arrays import Floats
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.left_velocity import Field, random_speeds, toward_exit
from nscd.continuum.medium import DENSITY, PERSON, TABLE_1, table_1_medium
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


class Case(StrEnum):
    """The left velocities of Fig. 8: (a) random, 1.7 ± 0.5 m/s; (b) 1.23 m/s; toward the exit."""

    RANDOM = "a"
    UNIFORM = "b"


class Pressing(StrEnum):
    """Where the pressure of the crowd turbulence comes from.

    (16) with Table 1, with a c₂ that makes it continuous, with p = 0 on the exit; or congestion
    above the yield density.
    """

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
    """What is computed for Fig. 8.

    side, mesh: m, of the room and of the triangles.
    order: of the elements.
    seed: of the random speeds.
    time_step: s, δt of the crowd turbulence.
    friction, pressing: β of the crowd turbulence and the source of its pressure.
    wall: where k_s acts.
    mixed_units: whether k_v and k_s count kilograms where ρ counts people in kilograms.
    person: kg.
    """

    side: float = SIDE
    mesh: float = MESH
    order: int = 1
    seed: int = 1
    time_step: float = TABLE_1.time_step
    friction: float = TABLE_1.friction
    pressing: Pressing = Pressing.LAW
    wall: Wall = Wall.PRESSED
    mixed_units: bool = False
    person: float = PERSON


def left_velocity(case: Case, room: Room, seed: int) -> Field:
    """Make u⁻ of a case; the random speeds are drawn for each person's place."""
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
    law = TurbulencePressure()
    at_rest = np.where(Cells(mesh).open, 0.0, setting.person * law.pressure(DENSITY))
    pressures: dict[Pressing, TurbulencePressure | Congestion | Floats] = {
        Pressing.LAW: law,
        Pressing.CONTINUOUS: law.continuous(),
        Pressing.OPEN: at_rest,
        Pressing.CONGESTION: Congestion(),
    }
    return turbulence_step(
        mesh,
        DENSITY,
        left_velocity(case, room, setting.seed),
        TurbulenceLaw(
            pressure=pressures[setting.pressing],
            friction=setting.friction,
            mass_per_person=setting.person,
        ),
        time_step=setting.time_step,
    )


@dataclass(frozen=True, eq=False)
class Forces:
    """One case in one setting: the crowd turbulence, and (11) for each k_v that is asked for."""

    case: Case
    setting: Setting
    pairs: dict[float, Pair] = field(default_factory=dict)

    @cached_property
    def room(self) -> Room:
        """The square."""
        return _mesh(self.setting.side, self.setting.mesh)[0]

    @cached_property
    def space(self) -> Space:
        """Of (11)."""
        return _space(self.setting.side, self.setting.mesh, self.setting.order)

    @property
    def map(self) -> Map:
        """Where body means are taken."""
        return map_of(self.room)

    @cached_property
    def area(self) -> Floats:
        """(m,) m² of the cells."""
        return Cells(self.space.mesh).measure

    @cached_property
    def turbulence(self) -> TurbulenceStep:
        """One step of the crowd turbulence, which knows nothing of (11)."""
        alone = replace(self.setting, wall=Wall.PRESSED, order=1, mixed_units=False)
        return _step(self.case, alone)

    @cached_property
    def theirs(self) -> Floats:
        """(m,) N·s/m², |−δt∇·σ| of the crowd turbulence in the cells."""
        return np.asarray(np.hypot(*self.turbulence.percussion_density.T))

    @cached_property
    def theirs_on_bodies(self) -> Floats:
        """(n,) N·s/m², the modulus of its mean over a body."""
        middle = np.ascontiguousarray(self.space.mesh.p[:, self.space.mesh.t].mean(1).T)
        density = np.hstack([np.ones((len(middle), 1)), self.turbulence.percussion_density])
        sums, _ = smear(middle, self.area[:, None] * density, BODY, self.map.points)
        return np.asarray(np.hypot(*(sums[:, 1:] / sums[:, :1]).T))

    @property
    def their_pressure(self) -> float:
        """N·s/m, δt p_t from (16)."""
        p = self.setting.person * float(TurbulencePressure().pressure(DENSITY))
        return self.setting.time_step * p

    def pair(self, volume: float) -> Pair:
        """Solve (11) with this k_v, and set it beside the crowd turbulence."""
        if volume not in self.pairs:
            self.pairs[volume] = self._pair(volume)
        return self.pairs[volume]

    def _pair(self, volume: float) -> Pair:
        setting, k_s = self.setting, TABLE_1.surface_dissipation
        surface = {Wall.NOWHERE: 0.0, Wall.SHARE: volume * k_s / TABLE_1.volume_dissipation}
        crowd = table_1_medium(
            volume=volume, surface=surface.get(setting.wall, k_s), person=setting.person
        )
        if setting.mixed_units:
            crowd = replace(crowd, density=DENSITY * setting.person, mass_per_person=None)
        left = left_velocity(self.case, self.room, setting.seed)
        everywhere = setting.wall is Wall.EVERYWHERE
        answer = collide(self.space, crowd, left, surface_everywhere=everywhere)
        weight = self.space.basis.dx
        ours = ((percussion_density(answer) * weight).sum(2) / weight.sum(1)).T
        return Pair(self, answer, ours)

    @property
    def answers(self) -> list[tuple[str, Answer]]:
        """All answers so far, named."""
        where = f"case {self.case}, {self.setting}"
        pairs = [(f"(11), k_v = {k:g}, {where}", pair.answer) for k, pair in self.pairs.items()]
        return [(f"crowd turbulence, {where}", self.turbulence), *pairs]


@dataclass(frozen=True, eq=False)
class Pair:
    """The answer of (11) beside the crowd turbulence.

    vectors: (m,2) N·s/m², div σ of (11) in the cells.
    """

    forces: Forces
    answer: CollisionAnswer
    vectors: Floats

    @cached_property
    def ours(self) -> Floats:
        """(m,) N·s/m², its modulus."""
        return np.asarray(np.hypot(*self.vectors.T))

    @cached_property
    def _fields(self) -> BodyFields:
        return body_fields(self.answer, BODY, self.forces.map.points)

    @property
    def ours_on_bodies(self) -> Floats:
        """(n,) N·s/m², the modulus of the mean over a body at the points of the map."""
        return np.asarray(np.hypot(*self._fields.percussion_density.T))

    def of_moduli(self) -> float:
        """‖|F| − |F_t|‖/‖F_t‖ over the cells, in L²."""
        return _share(self.ours - self.forces.theirs, self.forces.theirs, self.forces.area)

    def of_vectors(self) -> float:
        """‖F − F_t‖/‖F_t‖ over the cells, in L²."""
        difference = self.vectors - self.forces.turbulence.percussion_density
        return _share(np.hypot(*difference.T), self.forces.theirs, self.forces.area)

    def on_bodies(self) -> float:
        """‖|F| − |F_t|‖/‖F_t‖ of the means over a body, in L²."""
        theirs = self.forces.theirs_on_bodies
        return _share(self.ours_on_bodies - theirs, theirs, self.forces.map.area)

    def _mean(self) -> float:
        """N·s/m², mean over the room of ||F| − |F_t||."""
        return _mean(np.abs(self.ours - self.forces.theirs), self.forces.area)

    def of_mean(self) -> float:
        """Mean difference over the mean of |F_t|."""
        return self._mean() / _mean(self.forces.theirs, self.forces.area)

    def of_largest_cell(self) -> float:
        """Mean difference over the largest |F_t| in any cell, which is the mesh's."""
        return self._mean() / float(self.forces.theirs.max())

    def of_largest_body(self) -> float:
        """Mean difference of the means over a body, over the largest of |F_t| among them."""
        theirs = self.forces.theirs_on_bodies
        difference = np.abs(self.ours_on_bodies - theirs)
        return _mean(difference, self.forces.map.area) / float(theirs.max())

    def of_pressures(self) -> float:
        """‖p − δt p_t‖/‖δt p_t‖ in L², p = −½ tr σ over a body, p_t from (16)."""
        p, theirs = self._fields.pressure, self.forces.their_pressure
        return _share(p - theirs, np.full(len(p), theirs), self.forces.map.area)

    def of_largest_pressures(self) -> float:
        """|max p − δt p_t|/δt p_t with the largest p over a body."""
        return abs(float(self._fields.pressure.max()) / self.forces.their_pressure - 1)

    def of_raw_pressures(self) -> float:
        """The same with the largest p in any triangle, which is the mesh's."""
        return abs(float(pressure(self.answer).max()) / self.forces.their_pressure - 1)


def _share(difference: Floats, of: Floats, area: Floats) -> float:
    """‖difference‖/‖of‖ in L²."""
    return float(np.sqrt(area @ difference**2 / (area @ of**2)))


def _mean(values: Floats, area: Floats) -> float:
    return float(area @ values / area.sum())
