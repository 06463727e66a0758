"""Fig. 10: the collision (11) for many densities, and the laws (M1), (M2), (L1), (L2) beside it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.compare.statistics import exponent
from analysis.paper.answers import Answer
from analysis.paper.continuum.exit_room import ROOM, body_pressure, map_of
from analysis.support.progress import Progress
from nscd.arrays import Floats
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.left_velocity import toward_exit
from nscd.continuum.medium import DENSITY, PERSON, TABLE_1, table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.rivals.density_laws import (
    ExponentialSpeed,
    KladekSpeed,
    PowerPressure,
    TurbulencePressure,
    crowd_pressure,
    measured_speed,
)
from nscd.continuum.space import Space

FREE_SPEED, GREATEST, STEP = TABLE_1.free_speed, TABLE_1.greatest_density, TABLE_1.time_step
DENSITIES = (0.5, 1.0, 2.0, 3.0, 3.5, 4.0, 5.0, 5.5, 6.0, 7.0, 8.0, GREATEST)  # people/m²


@dataclass(frozen=True, eq=False)
class Solved:
    """The answer of (11) for one density (people/m²) and one left speed (m/s)."""

    density: float
    speed: float
    answer: CollisionAnswer

    @cached_property
    def pressure(self) -> Floats:
        """(n,) N·s/m, p over a body at the map's points."""
        return body_pressure(self.answer)

    @property
    def largest(self) -> float:
        """N·s/m, the largest of them."""
        return float(self.pressure.max())

    @property
    def mean(self) -> float:
        """N·s/m, their mean over the room."""
        return float(np.average(self.pressure, weights=map_of().area))

    @cached_property
    def right_speed(self) -> Floats:
        """(q,) m/s, |u⁺| at the quadrature points."""
        return np.asarray(np.hypot(*self.answer.right_field.reshape(2, -1)))

    @property
    def mean_speed(self) -> float:
        """m/s, the mean of |u⁺| over the room."""
        return float(np.average(self.right_speed, weights=self.answer.space.weights))

    @cached_property
    def measured(self) -> float:
        """N/m, (M1) from |u⁺| measured at the map's points."""
        return PERSON * self._measured(printed=False)

    @cached_property
    def printed(self) -> float:
        """people/s², (M1) as printed, where V is not divided by Σf."""
        return self._measured(printed=True)

    def _measured(self, *, printed: bool) -> float:
        space = self.answer.space
        people = self.density * space.weights
        measured = measured_speed(
            space.points, self.right_speed, map_of().points, people=people, printed=printed
        )
        return float(crowd_pressure(self.density, measured))

    @property
    def power(self) -> float:
        """N/m, (M2)."""
        return PERSON * float(PowerPressure().pressure(self.density))

    @property
    def turbulence(self) -> float:
        """N/m, (16)."""
        return PERSON * float(TurbulencePressure().pressure(self.density))

    @property
    def laws(self) -> tuple[float, float]:
        """m/s, the speeds of (L1) and (L2)."""
        laws = (ExponentialSpeed(), KladekSpeed())
        return tuple(float(law.speed(self.density)) for law in laws)  # type: ignore[return-value]


@dataclass(frozen=True, eq=False)
class Densities:
    """All densities.

    free: with the free speed of Table 1 wanted.
    adapted: with the speed of (L2) wanted, but for the greatest density, where nobody walks and
        nothing is to be solved.
    """

    free: Sequence[Solved]
    adapted: Sequence[Solved]

    @property
    def here(self) -> Solved:
        """The one of the paper's other figures."""
        return next(solved for solved in self.free if solved.density == DENSITY)

    @property
    def exponent(self) -> float:
        """Of the density, with which the largest pressure grows."""
        return exponent(np.array(DENSITIES), np.array([solved.largest for solved in self.free]))

    def adapted_speed(self, density: float) -> float:
        """Mean speed (m/s) of (11) at a density where the speed of (L2) is wanted."""
        return next((s.mean_speed for s in self.adapted if s.density == density), 0.0)

    @property
    def factors(self) -> tuple[float, float]:
        """The largest pressure of (11) over δt, over those of (M1) and (M2)."""
        ours = self.here.largest / STEP
        return ours / self.here.measured, ours / self.here.power

    @property
    def answers(self) -> list[tuple[str, Answer]]:
        """All answers, named."""
        every = (*self.free, *self.adapted)
        return [(f"{s.density:g} people/m², {s.speed:g} m/s", s.answer) for s in every]


def densities(mesh: float, progress: Progress | None = None) -> Densities:
    """Solve (11) for every density, on a mesh of side `mesh` (m)."""
    space, slow = Space(mesh_of(ROOM, mesh)), KladekSpeed()

    def solved(density: float, speed: float) -> Solved:
        crowd = table_1_medium(density)
        return Solved(density, speed, collide(space, crowd, toward_exit(ROOM, speed)))

    free, adapted = [], []
    for number, density in enumerate(DENSITIES):
        free.append(solved(density, FREE_SPEED))
        if (speed := float(slow.speed(density))) > 0:
            adapted.append(solved(density, speed))
        if progress:
            progress("Fig. 10", (number + 1) / len(DENSITIES))
    return Densities(free, adapted)
