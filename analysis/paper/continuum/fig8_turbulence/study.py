"""Fig. 8: errors against k_v, every reading of the error, and how the rival depends on δt."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from analysis.paper.answers import unsolved
from analysis.paper.continuum.exit_room import EXIT, SIDE
from analysis.paper.continuum.fig8_turbulence.forces import (
    Case,
    Pair,
    left_velocity,
)
from analysis.paper.continuum.fig8_turbulence.readings import Compared, Reading, Tried, readings
from analysis.support.progress import Progress
from nscd.arrays import Floats
from nscd.continuum.medium import DENSITY, TABLE_1
from nscd.continuum.mesh import mesh_of
from nscd.continuum.rivals.turbulence import StepDependence, TurbulenceLaw, time_step_dependence
from nscd.continuum.room import square_room

VOLUMES = (1.0, 2.0, 4.0, 9.0, 16.0, 25.0, 50.0, 100.0, 200.0)  # k_v
CURVE_STEPS = (0.001, 0.01, 0.1)  # s
STEPS = (0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3)  # s


class Curve(NamedTuple):
    """An error against k_v.

    volumes: (k,) k_v, per person.
    errors: (2,k) of cases a and b.
    """

    name: str
    volumes: Sequence[float]
    errors: Floats

    def at(self, case: Case) -> dict[float, float]:
        """The errors of a case by k_v."""
        return dict(zip(self.volumes, self.errors[list(Case).index(case)].tolist(), strict=True))

    def best(self, case: Case) -> float:
        """The k_v with the least error of a case."""
        errors = self.at(case)
        return min(errors, key=errors.__getitem__)


@dataclass(frozen=True, kw_only=True, eq=False)
class Turbulence:
    """What was found.

    curves: errors against k_v.
    tried: the readings, the plain one first.
    steps: of the crowd turbulence, case (b).
    pairs: both forces with Table 1 in each case.
    """

    curves: Sequence[Curve]
    tried: Sequence[Tried]
    steps: Sequence[StepDependence]
    pairs: dict[Case, Pair]
    warnings: Sequence[str]

    @property
    def main(self) -> Curve:
        """The relative difference in L² for the δt of Table 1."""
        return self.curves[CURVE_STEPS.index(TABLE_1.time_step)]

    @property
    def grown(self) -> float:
        """Largest mean force over the least, of all steps."""
        forces = [step.force for step in self.steps]
        return max(forces) / min(forces)

    @property
    def settled(self) -> float:
        """The mean force of the shortest step over that of the next: 1 where there is a limit."""
        return self.steps[0].force / self.steps[1].force

    @property
    def best(self) -> Tried:
        """The reading with the least error, of those that half the mesh leaves as they are."""
        return min((t for t in self.tried if t.settled), key=lambda t: float(t.errors.min()))

    @property
    def raw(self) -> Tried:
        """The reading over the largest force in any triangle."""
        return next(t for t in self.tried if t.reading.measure is Pair.of_largest_cell)


def turbulence(mesh: float, progress: Progress | None = None) -> Turbulence:
    """Compare both forces in every way, on meshes of side `mesh` (m) and half of it."""
    every = readings(mesh)
    compared = Compared(every[0].setting)
    curves = _curves(compared)
    tried = []
    for number, reading in enumerate(every):
        if progress:
            progress("readings of Fig. 8", number / len(every))
        tried.append(compared.tried(reading))
    steps = _steps(2 * mesh)
    named = [(f"crowd turbulence, δt = {step.time_step:g} s", step) for step in steps]
    return Turbulence(
        curves=curves,
        tried=tried,
        steps=steps,
        pairs={
            case: compared.known[case, compared.plain].pair(TABLE_1.volume_dissipation)
            for case in Case
        },
        warnings=[*compared.warnings, *unsolved(named)],
    )


def _curves(compared: Compared) -> list[Curve]:
    plain, few = compared.plain, VOLUMES[::2]
    found = []
    for step in CURVE_STEPS:
        reading = Reading(
            words=f"L², δt = {step:g} s",
            measure=Pair.of_moduli,
            setting=replace(plain, time_step=step),
        )
        found.append(Curve(reading.words, VOLUMES, compared.errors(reading, VOLUMES)))
    cell = Reading(
        words="mean over the largest in any triangle", measure=Pair.of_largest_cell, setting=plain
    )
    for size, volumes in ((plain.mesh, VOLUMES), (0.5 * plain.mesh, few)):
        errors = compared.errors(cell, volumes, half=size < plain.mesh)
        found.append(Curve(f"{cell.words} ({size:g} m)", volumes, errors))
    return found


def _steps(size: float) -> list[StepDependence]:
    room = square_room(SIDE, EXIT)
    left = left_velocity(Case.UNIFORM, room, 1)
    return time_step_dependence(mesh_of(room, size), DENSITY, left, TurbulenceLaw(), STEPS)
