"""Figure 10: pressure and speed against the density, by the proposed collision and by constitutive
laws."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.pages.section import Cell, Claim, Picture, Section, Table, Verdict
from analysis.paper.continuum.exit_room import (
    DENSITY,
    MESH,
    PERSON,
    ROOM,
    TIME_STEP,
    body_pressure,
    map_of,
    medium,
    solved,
)
from analysis.paper.continuum.fig10_density.charts import curves
from analysis.support.progress import Progress
from nscd.arrays import Floats
from nscd.continuum.collision import CollisionAnswer
from nscd.continuum.left_velocity import toward_exit
from nscd.continuum.medium import TABLE_1
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

FREE_SPEED, GREATEST = TABLE_1.free_speed, TABLE_1.greatest_density
DENSITIES = (0.5, 1.0, 2.0, 3.0, 3.5, 4.0, 5.0, 5.5, 6.0, 7.0, 8.0, GREATEST)
SHOWN = (1.0, 3.5, 5.5, 7.0, GREATEST)
# slower than this share of the free speed counts as congested
CONGESTED = 0.1
# pressures within this factor of each other belong on one axis
ONE_AXIS = 10.0


@dataclass(frozen=True, eq=False)
class Density:
    """The answer of (11) for one density (people/m²) and one left speed (m/s)."""

    density: float
    speed: float
    answer: CollisionAnswer

    @cached_property
    def pressure(self) -> Floats:
        """p over a body at the map's points (n,) N·s/m."""
        return body_pressure(self.answer)

    @property
    def mean_pressure(self) -> float:
        """Over the room (N·s/m)."""
        return float(np.average(self.pressure, weights=map_of().area))

    @cached_property
    def right_speed(self) -> Floats:
        """|u⁺| (q,) m/s at the quadrature points."""
        return np.asarray(np.hypot(*self.answer.right_field.reshape(2, -1)))

    @property
    def mean_speed(self) -> float:
        """Mean |u⁺| over the room (m/s)."""
        return float(
            np.average(self.right_speed, weights=np.asarray(self.answer.space.basis.dx).ravel())
        )

    def crowd_pressure(self, *, printed: bool) -> float:
        """(M1) from |u⁺| measured at the map's points, in people/s²; as printed V is not divided by
        Σf."""
        basis = self.answer.space.basis
        places = np.ascontiguousarray(np.asarray(basis.global_coordinates()).reshape(2, -1).T)
        people = self.density * np.asarray(basis.dx).ravel()
        measured = measured_speed(
            places, self.right_speed, map_of().points, people=people, printed=printed
        )
        return float(crowd_pressure(self.density, measured))


def build(progress: Progress | None = None, mesh: float = MESH) -> Section:
    """Figure 10 remade: what (11) gives for each density, beside (M1), (M2), (L1) and (L2)."""
    warnings: list[str] = []
    space = Space(mesh_of(ROOM, mesh))
    slow = KladekSpeed()
    free, adapted = [], []
    for number, density in enumerate(DENSITIES):
        free.append(_solve(space, density, FREE_SPEED, warnings))
        # at the greatest density (L2) is 0: nobody walks, and nothing is to be solved
        if (speed := float(slow.speed(density))) > 0:
            adapted.append(_solve(space, density, speed, warnings))
        if progress:
            progress("Fig. 10", (number + 1) / len(DENSITIES))
    at = np.array(DENSITIES)
    exponent = float(np.polyfit(np.log(at), np.log([d.pressure.max() for d in free]), 1)[0])
    last, adapted_last = free[-1], 0.0 if adapted[-1].density < GREATEST else adapted[-1].mean_speed
    laws, here = (ExponentialSpeed(), slow), next(d for d in free if d.density == DENSITY)
    return Section(
        number="10",
        title="Pressure and speed against the density",
        words=[
            "What the paper says: (a) plots the pressure of (M1), (M2) and of the proposed approach against the "
            "density on one axis; "
            "(b) plots the speed; complete congestion, which (L1) and (L2) give, does not occur in the proposed approach. "
            "It does not say which room, which left velocity, nor where pressure and speed are taken.",
            f"What is computed: the room of Fig. 8 with Table 1 and densities from {DENSITIES[0]:g} to {GREATEST:g} people/m². "
            f"Everybody wants {FREE_SPEED:g} m/s toward the exit (the free speed of Table 1), or, as a second "
            "reading, the speed that (L2) "
            "gives. Pressure is the largest over a body, and its mean over the room; speed is the mean of |u⁺|.",
            f"What is found in (a): −½ tr σ is a percussion for each length. Over δt = {TIME_STEP:g} s it is a pressure of "
            f"{free[-1].pressure.max() / TIME_STEP / 1e3:.0f} kN/m at {GREATEST:g} people/m², where (M2) gives "
            f"{PERSON * float(PowerPressure().pressure(GREATEST)):.0f} N/m. The largest pressure grows as ρ to the "
            f"power {exponent:.2f} (1/2 for a point exit), "
            "not as ρ² like (M2). The paper's curves can share an axis only as plain numbers per person, with the "
            "percussion not divided "
            f"by δt (middle picture): at {here.density:g} people/m² these numbers are {here.pressure.max() / PERSON:.3g} (11), "
            f"{here.crowd_pressure(printed=True):.3g} (M1 as printed) and "
            f"{float(PowerPressure().pressure(here.density)):.2g} (M2).",
            f"What is found in (b): with {FREE_SPEED:g} m/s wanted, the mean speed is {free[0].mean_speed:.2f} m/s "
            f"at {DENSITIES[0]:g} and "
            f"{last.mean_speed:.2f} m/s at {GREATEST:g} people/m². The density enters (11) only by h = √(k_v/ρ), "
            "which gets smaller as it grows, "
            "so that fewer people are stopped: the speed "
            f"{'rises' if last.mean_speed > free[0].mean_speed else 'falls'} with density. With the left speed of (L2) it is "
            f"{adapted_last:.2g} m/s at {GREATEST:g} people/m²: (11) has no fundamental diagram of its own; it is "
            "linear in the left velocity.",
        ],
        pictures=[
            Picture(
                name="fig_10_density",
                caption="(a) Pressures in one unit, with a logarithmic axis; the percussion of (11) over δt. Middle: "
                "numbers per "
                "person as they stand in the paper, where the percussion is not divided. (b) Mean speeds.",
                figure=curves(
                    at,
                    largest=np.array([d.pressure.max() for d in free]),
                    mean=np.array([d.mean_pressure for d in free]),
                    measured=np.array([d.crowd_pressure(printed=False) for d in free]),
                    printed=np.array([d.crowd_pressure(printed=True) for d in free]),
                    speed=np.array([d.mean_speed for d in free]),
                    adapted=(
                        np.array([d.density for d in adapted]),
                        np.array([d.mean_speed for d in adapted]),
                    ),
                ),
            )
        ],
        tables=[_table(free, adapted)],
        differs=[
            "The caption names the axes pressure and density, the text says that Fig. 10a shows pressure against the "
            "right velocity.",
            "σ is a percussion: divide by δt before it is put beside a pressure.",
            "(M1) is of Helbing et al. (2007), and V must be divided by Σf; as printed V itself is proportional to "
            "the density.",
            "(L1) and (L2) are printed as ρ(u); they are u(ρ). (L2)'s γ is Weidmann's 1.913 people/m², not the "
            "exponent of (M2).",
        ],
        claims=_claims(free, adapted_last, [float(law.speed(GREATEST)) for law in laws]),
        warnings=warnings,
    )


def _solve(space: Space, density: float, speed: float, warnings: list[str]) -> Density:
    what = f"{density:g} people/m², {speed:g} m/s"
    return Density(
        density, speed, solved(space, medium(density), toward_exit(ROOM, speed), warnings, what)
    )


def _claims(free: list[Density], adapted_last: float, laws: list[float]) -> list[Claim]:
    last = free[-1]
    moving = [last.mean_speed > CONGESTED * FREE_SPEED, adapted_last > CONGESTED * FREE_SPEED]
    stopped = all(speed < CONGESTED * FREE_SPEED for speed in laws)
    here = next(d for d in free if d.density == DENSITY)
    ours = here.pressure.max() / TIME_STEP
    one = [
        PERSON * here.crowd_pressure(printed=False),
        PERSON * float(PowerPressure().pressure(DENSITY)),
    ]
    apart = [ours / other for other in one]
    together = [1 / ONE_AXIS < ratio < ONE_AXIS for ratio in apart]
    return [
        Claim(
            where="Fig. 10a",
            statement="pressure versus density of (M1), (M2) and the proposed approach on one axis",
            verdict=Verdict.HOLDS
            if all(together)
            else Verdict.PARTLY
            if any(together)
            else Verdict.FAILS,
            reason=f"at {DENSITY:g} people/m² (11) gives {ours:.3g} N/m over δt = {TIME_STEP:g} s, (M1) {one[0]:.3g} "
            f"and (M2) {one[1]:.3g} N/m: "
            f"factors of {apart[0]:.3g} and {apart[1]:.3g}",
        ),
        Claim(
            where="3.2.4, Fig. 10b",
            statement="complete congestion is undesirable; this is consistent with the proposed approach, unlike the two laws",
            verdict=Verdict.FAILS
            if not (stopped and any(moving))
            else Verdict.HOLDS
            if all(moving)
            else Verdict.PARTLY,
            reason=f"at {GREATEST:g} people/m² (L1) gives {laws[0]:.2g} and (L2) {laws[1]:.2g} m/s; (11) "
            f"{last.mean_speed:.2f} m/s if "
            f"{FREE_SPEED:g} m/s are wanted, and {adapted_last:.2g} m/s if the speed of (L2) is: what is not "
            "congested is the left velocity "
            "that one puts in",
        ),
        Claim(
            where="3.2.4",
            statement="the speed also depends on the density",
            verdict=Verdict.HOLDS if last.mean_speed < free[0].mean_speed else Verdict.PARTLY,
            reason=f"for one left velocity the mean right speed goes from {free[0].mean_speed:.2f} to "
            f"{last.mean_speed:.2f} m/s as the density "
            f"goes from {DENSITIES[0]:g} to {GREATEST:g} people/m²: a denser crowd is slower in reality and in both laws",
        ),
    ]


def _table(free: list[Density], adapted: list[Density]) -> Table:
    rows: list[list[Cell]] = []
    for d in free:
        if d.density not in SHOWN:
            continue
        second = next((a.mean_speed for a in adapted if a.density == d.density), 0.0)
        rows.append(
            [
                d.density,
                float(d.pressure.max()) / TIME_STEP,
                d.mean_pressure / TIME_STEP,
                PERSON * d.crowd_pressure(printed=False),
                PERSON * d.crowd_pressure(printed=True),
                PERSON * float(PowerPressure().pressure(d.density)),
                PERSON * float(TurbulencePressure().pressure(d.density)),
                d.mean_speed,
                second,
                float(ExponentialSpeed().speed(d.density)),
                float(KladekSpeed().speed(d.density)),
                d.answer.residual,
                str(d.answer.status),
            ]
        )
    return Table(
        caption=f"Pressures in N/m (times {PERSON:g} kg where a law counts people) and speeds in m/s. (M1) from the "
        "right velocities of (11); "
        "as printed it has the unit of a pressure over m⁴.",
        head=["density (people/m²)", "(11)/δt, largest", "(11)/δt, mean", "(M1)", "(M1) as printed", "(M2)", "(16)",
              "speed: (11)", "(11), left speed of (L2)", "(L1)", "(L2)", "residual", "status"],
        rows=rows,
    )  # fmt: skip
