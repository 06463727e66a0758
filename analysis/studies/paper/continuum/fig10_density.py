"""Fig. 10: pressure and speed against the density, by the collision (11) and by the laws (M1), (M2),
(L1), (L2)."""

from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from analysis.pages.drawing import BLACK, BLUE, GREEN, ORANGE, PINK, panels
from analysis.pages.section import Cell, Section, Verdict
from analysis.pages.words import Words
from analysis.studies.paper.continuum.exit_room import MESH, ROOM, body_pressure, map_of
from analysis.studies.paper.solutions import unsolved
from analysis.support.parallel import Progress
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.left_velocity import toward_exit
from nscd.continuum.medium import DENSITY, PERSON, TABLE_1, table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.rivals import density_laws
from nscd.continuum.space import Space

FREE_SPEED, GREATEST, STEP = TABLE_1.free_speed, TABLE_1.greatest_density, TABLE_1.time_step
DENSITIES = (0.5, 1.0, 2.0, 3.0, 3.5, 4.0, 5.0, 5.5, 6.0, 7.0, 8.0, GREATEST)  # people/m²
SHOWN = (1.0, 3.5, 5.5, 7.0, GREATEST)  # people/m², the rows of the table
CONGESTED = 0.1  # of the free speed: slower counts as congested
ONE_AXIS = 10.0  # pressures within this factor of each other belong on one axis


class Solved(NamedTuple):
    """(11) for one density (people/m²) with the free speed of Table 1 wanted, and the laws.

    largest, mean: N·s/m, p over a body, at most and on average over the room.
    power, turbulence: N/m, (M2) and (16).
    mean_speed, laws: m/s, mean |u⁺| over the room; (L1) and (L2)."""

    density: float
    largest: float
    mean: float
    measured: float  # N/m, (M1) from |u⁺| at the map's points
    printed: float  # people/s², (M1) as printed, where V is not divided by Σf
    power: float
    turbulence: float
    mean_speed: float
    laws: tuple[float, float]
    solution: CollisionAnswer


def mean_speed(solution: CollisionAnswer) -> float:
    """Average |u⁺| over the room, m/s."""
    speed = np.hypot(*solution.right_field.reshape(2, -1))
    return float(np.average(speed, weights=solution.space.weights))


def solved(density: float, solution: CollisionAnswer) -> Solved:
    """Read pressures and speeds from an answer, and set the laws beside them."""
    space, pressure = solution.space, body_pressure(solution)
    speed = np.hypot(*solution.right_field.reshape(2, -1))
    inputs, people = (space.points, speed, map_of().points), density * space.weights
    speeds = (
        density_laws.measured_speed(*inputs, people=people, printed=printed)
        for printed in (False, True)
    )
    measured, printed = (float(density_laws.crowd_pressure(density, v)) for v in speeds)
    here = float(pressure.max()), float(np.average(pressure, weights=map_of().area))
    turbulent = density_laws.TurbulencePressure().pressure(density)
    models = density_laws.power_pressure(density), turbulent
    power, turbulence = (PERSON * float(value) for value in models)
    laws = float(density_laws.exponential_speed(density)), float(density_laws.kladek_speed(density))
    pressures = PERSON * measured, printed, power, turbulence
    return Solved(density, *here, *pressures, mean_speed(solution), laws, solution)


def curves(free: list[Solved], adapted: dict[float, float]) -> Figure:
    """Draw pressures in one unit, as plain numbers, and speeds, against the density."""
    figure, (forces, numbers, speeds) = panels(13.0, 4.8, 1, 3, grid="major")
    density, largest, mean, measured, printed = map(np.array, list(zip(*free, strict=True))[:5])
    fine = np.linspace(density[0], density[-1], 200)
    hollow = {"mfc": "none", "color": BLUE}
    forces.plot(density, largest / STEP, "o-", color=BLUE, label="(11) over δt, largest")
    forces.plot(density, mean / STEP, "o--", **hollow, label="(11) over δt, mean")
    forces.plot(density, measured, "s-.", color=ORANGE, label="(M1)")
    forces.plot(fine, PERSON * density_laws.power_pressure(fine), "-", color=BLACK, label="(M2)")
    forces.set(yscale="log", ylabel="pressure (N/m)", title="(a) in one unit")
    numbers.plot(density, largest / PERSON, "o-", color=BLUE, label="(11), largest, not divided")
    numbers.plot(density, mean / PERSON, "o--", **hollow, label="(11), mean, not divided")
    numbers.plot(density, printed, "D:", color=PINK, label="(M1) as printed")
    numbers.plot(fine, density_laws.power_pressure(fine), "-", color=BLACK, label="(M2)")
    numbers.set(ylabel="number per person, units mixed", title="(a) as plain numbers")
    speed = [s.mean_speed for s in free]
    speeds.plot(density, speed, "o-", color=BLUE, label="(11), 2 m/s wanted")
    walking = list(adapted), list(adapted.values())
    speeds.plot(*walking, "^--", mfc="none", color=GREEN, label="(11), speed of (L2) wanted")
    speeds.plot(fine, density_laws.exponential_speed(fine), "-.", color=ORANGE, lw=2, label="(L1)")
    speeds.plot(fine, density_laws.kladek_speed(fine), "-", color=BLACK, label="(L2)")
    speeds.set(ylabel="speed (m/s)", title="(b) mean speed", ylim=(-0.05, None))
    for axes in (forces, numbers, speeds):
        axes.set_xlabel("density (people/m²)")
        axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)
    return figure


def build(progress: Progress | None = None, mesh: float = MESH) -> Section:
    """Build Fig. 10: what (11) gives for each density, beside (M1), (M2), (L1) and (L2)."""
    space = Space(mesh_of(ROOM, mesh))
    solutions = []

    def collided(density: float, speed: float) -> CollisionAnswer:
        solution = collide(space, table_1_medium(density), toward_exit(ROOM, speed))
        solutions.append((f"{density:g} people/m², {speed:g} m/s", solution))
        return solution

    free = [solved(density, collided(density, FREE_SPEED)) for density in DENSITIES]
    if progress:
        progress("Fig. 10", 0.5)
    wanted = {density: float(density_laws.kladek_speed(density)) for density in DENSITIES}
    adapted = {d: mean_speed(collided(d, speed)) for d, speed in wanted.items() if speed > 0}
    first, last = free[0], free[-1]
    here = next(s for s in free if s.density == DENSITY)
    factors = [here.largest / STEP / other for other in (here.measured, here.power)]
    stopped, slow = adapted.get(GREATEST, 0.0), CONGESTED * FREE_SPEED
    walks = Verdict.of(last.mean_speed > slow, stopped > slow)
    words = Words(__name__, first=first, last=last, here=here, adapted=stopped)
    return words.section(
        "10",
        pictures={"fig_10_density": curves(free, adapted)},
        tables={"densities": [_row(s, adapted) for s in free if s.density in SHOWN]},
        claims={
            "one_axis": Verdict.of(*(1 / ONE_AXIS < factor < ONE_AXIS for factor in factors)),
            "congestion": walks if max(last.laws) < slow else Verdict.FAILS,
            "speed": Verdict.of(
                last.mean_speed != first.mean_speed, last.mean_speed < first.mean_speed
            ),
        },
        warnings=unsolved(solutions),
    )


def _row(s: Solved, adapted: dict[float, float]) -> list[Cell]:
    pressures = s.largest / STEP, s.mean / STEP, s.measured, PERSON * s.printed
    speeds = s.mean_speed, adapted.get(s.density, 0.0), *s.laws
    ended = s.solution.residual, str(s.solution.status)
    return [s.density, *pressures, s.power, s.turbulence, *speeds, *ended]
