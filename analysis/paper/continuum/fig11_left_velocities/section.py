"""Figure 11: right velocity and pressure for two left velocities, uniform and random."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.pages.section import Cell, Claim, Picture, Section, Table, Verdict
from analysis.paper.continuum.exit_room import (
    DENSITY,
    MESH,
    ROOM,
    SURFACE,
    VOLUME,
    body_mean,
    body_pressure,
    map_of,
    medium,
    solved,
    to_exit,
)
from analysis.paper.continuum.fig11_left_velocities.charts import maps
from analysis.support.progress import Progress
from nscd.arrays import Floats
from nscd.continuum.collision import CollisionAnswer
from nscd.continuum.left_velocity import Field, random_speeds, toward_exit
from nscd.continuum.mesh import mesh_of
from nscd.continuum.space import Space

MEAN, DEVIATION = 1.34, 0.26  # m/s
SEEDS = (1, 2, 3)
OUTFLOWS = (1.0, 2.0, 4.0, 6.0, 8.0, 9.0, 12.0)  # k_v for which the flow through the exit is asked
STOPPED = 0.01  # of the desired speed: slower counts as cancelled
ALIKE = 0.95  # cosine between two velocity fields that have the same form
NEAR = 1.0  # m


@dataclass(frozen=True, eq=False)
class Run:
    """One left velocity and the answer of (11)."""

    name: str
    left_velocity: Field
    answer: CollisionAnswer

    @cached_property
    def left(self) -> Floats:
        """u⁻ over a body (n,2) m/s."""
        return body_mean(self.answer.space, np.moveaxis(self.answer.left_field, 0, -1))

    @cached_property
    def right(self) -> Floats:
        """u⁺ over a body (n,2) m/s."""
        return body_mean(self.answer.space, np.moveaxis(self.answer.right_field, 0, -1))

    @cached_property
    def pressure(self) -> Floats:
        """p over a body (n,) N·s/m."""
        return body_pressure(self.answer)

    @property
    def largest_from_exit(self) -> float:
        """Distance (m) of the largest pressure from the exit."""
        return float(to_exit(map_of().points[[self.pressure.argmax()]])[0])

    @property
    def near_and_far(self) -> tuple[float, float]:
        """Mean pressure (N·s/m) within NEAR of the exit and beyond."""
        near, area = to_exit(map_of().points) <= NEAR, map_of().area
        return tuple(float(np.average(self.pressure[c], weights=area[c])) for c in (near, ~near))  # type: ignore[return-value]

    def on_walls(self) -> tuple[float, float, float, float]:
        """Largest u⁺·n on the walls, root mean square of u⁺·n and of u⁺·t there (m/s), share of the
        walls that hold somebody; n out of the room."""
        wall, w = self.answer.space.wall, self.answer.right_velocity
        right = w[wall.node]
        normal = (right * wall.normal).sum(1)
        along = right[:, 1] * wall.normal[:, 0] - right[:, 0] * wall.normal[:, 1]
        share = wall.weight / wall.weight.sum()
        return (
            float(normal.max()),
            float(np.sqrt(share @ normal**2)),
            float(np.sqrt(share @ along**2)),
            float(share[self.answer.active].sum()),
        )

    def cosine(self) -> float:
        """∫u⁺·u⁻/(‖u⁺‖‖u⁻‖) of the means over a body: ±1 for fields of one form."""
        area = map_of().area
        product = float(area @ (self.left * self.right).sum(1))
        return product / float(
            np.sqrt((area @ (self.left**2).sum(1)) * (area @ (self.right**2).sum(1)))
        )

    def kept(self) -> float:
        """Kinetic energy that is left, of that before."""
        return 1 + self.answer.energy.change / self.answer.energy.before

    def outflow(self) -> float:
        """Mean u⁺·n on the exit (m/s), with u⁻ as it is just inside."""
        edge = self.answer.space.border("exit")
        assert edge is not None
        w, normals = np.asarray(edge.interpolate(self.answer.unknowns)), np.asarray(edge.normals)
        inside = np.asarray(edge.global_coordinates()) - 1e-9 * normals
        left = self.left_velocity(inside.reshape(2, -1).T).T.reshape(inside.shape)
        return float((((w - left) * normals).sum(0) * edge.dx).sum() / edge.dx.sum())

    def compressed(self) -> float:
        """Share of the room where div u⁺ = div w − div u⁻ < 0; for a u⁻ that is smooth away from
        the exit."""
        basis, step = self.answer.space.basis, 1e-5
        places = np.asarray(basis.global_coordinates())
        points = places.reshape(2, -1).T
        rate = np.zeros(len(points))
        for k in range(2):
            shift = step * np.eye(2)[k]
            rate += (self.left_velocity(points + shift) - self.left_velocity(points - shift))[
                :, k
            ] / (2 * step)
        gradient = np.asarray(self.answer.sum_field.grad)
        divergence = gradient[0, 0] + gradient[1, 1] - rate.reshape(places.shape[1:])
        return float(basis.dx[divergence < 0].sum() / basis.dx.sum())


def uniform(
    space: Space, warnings: list[str], volume: float = VOLUME, surface: float = SURFACE
) -> Run:
    """Everybody wants MEAN toward the exit."""
    left = toward_exit(ROOM, MEAN)
    answer = solved(
        space, medium(volume=volume, surface=surface), left, warnings, f"uniform, k_v = {volume:g}"
    )
    return Run("uniform", left, answer)


def random(space: Space, seed: int, warnings: list[str]) -> Run:
    """One speed, MEAN ± DEVIATION, for each person's place."""
    left = random_speeds(
        ROOM, toward_exit(ROOM, 1.0), mean=MEAN, deviation=DEVIATION, seed=seed, cell=DENSITY**-0.5
    )
    return Run(
        f"random, draw {seed}",
        left,
        solved(space, medium(), left, warnings, f"random, draw {seed}"),
    )


def echo(even: Run, run: Run) -> tuple[float, float]:
    """What the random part of the left velocity, δu⁻ = u⁻ − u⁻_uniform, becomes: ∫δu⁺·δu⁻/∫|δu⁻|²,
    and the correlation ∫δu⁺·δu⁻/(‖δu⁺‖‖δu⁻‖), both on one mesh."""
    weight = run.answer.space.basis.dx
    before = run.answer.left_field - even.answer.left_field
    after = run.answer.right_field - even.answer.right_field
    both, one, two = (
        float(((a * b).sum(0) * weight).sum())
        for a, b in ((before, after), (before, before), (after, after))
    )
    return both / one, both / np.sqrt(one * two)


def build(progress: Progress | None = None, mesh: float = MESH) -> Section:
    """Figure 11 remade: right velocity and pressure for a uniform and for random left
    velocities."""
    warnings: list[str] = []
    space = Space(mesh_of(ROOM, mesh))
    even = uniform(space, warnings)
    drawn = [random(space, seed, warnings) for seed in SEEDS]
    echoes = [echo(even, run) for run in drawn]
    flows = [(k, uniform(space, warnings, volume=k)) for k in OUTFLOWS]
    held = uniform(space, warnings, surface=0.0)
    h = medium().length
    share, correlation = (float(np.mean(values)) for values in zip(*echoes, strict=True))
    return Section(
        number="11",
        title="Right velocity and pressure for two left velocities",
        words=[
            "What the paper says: the right velocity vanishes at the border of the room, the pressure is largest "
            "around the exit; "
            "a uniform left velocity gives a right velocity of the same form, a random one a random one.",
            f"What is computed: the room of Fig. 8 with Table 1; left velocities toward the exit of {MEAN:g} m/s, and random, "
            f"{MEAN:g} ± {DEVIATION:g} m/s with one draw for each person's place ({len(SEEDS)} draws). Maps show "
            "means over a body.",
            f"What is found: people do not go through walls (largest u⁺·n {_zero(even.on_walls()[0])} m/s), but they "
            "slide along "
            f"them at {even.on_walls()[2]:.2f} m/s (root mean square), and leave those behind them. Table 1 keeps "
            f"{even.kept():.0%} of the kinetic energy. div u⁺ < 0 on {even.compressed():.0%} of the room: people still "
            "close up, since (11) has no condition between people like the one at the walls.",
            f"On the exit itself the mean outward velocity is {even.outflow():+.2f} m/s of the {MEAN:g} wanted"
            + (
                ": through an exit that nothing blocks people move inward on average"
                if even.outflow() < 0
                else ""
            )
            + f". The third table gives it for other k_v; without k_s it is {held.outflow():+.2f} m/s.",
            "A random left velocity gives a random right velocity, but what becomes of it? The random part comes "
            "back multiplied "
            f"by {share:+.2f} (correlation {correlation:+.2f}). In a mode of wave number q, (11) multiplies by (1 − "
            "h²q²)/(1 + h²q²), and with "
            f"h = {h:.2f} m everything shorter than 2πh = {2 * np.pi * h:.1f} m changes its sign: neighbours who "
            "differ in speed "
            "exchange it, as in an elastic impact.",
        ],
        pictures=[
            Picture(
                name="fig_11_left_velocities",
                caption="Right velocity (arrows; 1 m for 2 m/s) and pressure over a body, for a uniform left "
                f"velocity of {MEAN:g} m/s "
                f"(above) and a random one of {MEAN:g} ± {DEVIATION:g} m/s (below).",
                figure=maps(
                    [(run.name, run.left, run.right, run.pressure) for run in (even, drawn[0])]
                ),
            )
        ],
        tables=[_table([even, *drawn]), _echo_table(echoes), _outflow_table(flows)],
        differs=[
            "e_d is printed as (x − P)/|x − P|: away from the exit.",
            "k_s acts only on walls that people press; as printed it also pulls at those who leave.",
            "Where the left velocity points to the exit it is not in H¹ (its gradient is 1/r at the jambs); u⁺ = w − "
            "u⁻ jumps with "
            "it, w does not.",
        ],
        claims=_claims(even, drawn, share, correlation),
        warnings=warnings,
    )


def _zero(value: float) -> str:
    return "0" if abs(value) < 1e-9 else f"{value:.2g}"


def _claims(even: Run, drawn: list[Run], share: float, correlation: float) -> list[Claim]:
    largest, normal, along, holds = even.on_walls()
    stopped = [root < STOPPED * MEAN for root in (normal, along)]
    inside = all(run.on_walls()[0] < STOPPED * MEAN for run in (even, *drawn))
    near = [run.largest_from_exit < NEAR for run in (even, *drawn)]
    cosine = even.cosine()
    return [
        Claim(
            where="3.2.4, Fig. 11",
            statement="the right-velocity is canceled at the boundary of the domain, which reflects the condition of "
            "non-interpenetration with the wall",
            verdict=Verdict.HOLDS if all(stopped) else Verdict.PARTLY if inside else Verdict.FAILS,
            reason=f"nobody enters a wall (largest u⁺·n {_zero(largest)} m/s), and {holds:.0%} of the walls hold "
            "somebody; but on all walls "
            f"u⁺·n is {normal:.2f} and u⁺·t {along:.2f} m/s (root mean square): people leave walls and slide along them",
        ),
        Claim(
            where="3.2.4, Fig. 11b, d",
            statement="the pressure is maximal around the exit, as for the microscopic case",
            verdict=Verdict.HOLDS if all(near) else Verdict.PARTLY if any(near) else Verdict.FAILS,
            reason="largest pressure over a body "
            + ", ".join(
                f"{run.largest_from_exit:.2f} m from the exit ({run.name})"
                for run in (even, *drawn)
            ),
        ),
        Claim(
            where="3.2.4, Fig. 11a",
            statement="for a left-velocity chosen uniformly, the right-velocity keeps the same form",
            verdict=Verdict.HOLDS
            if cosine > ALIKE
            else Verdict.PARTLY
            if cosine > 0.5
            else Verdict.FAILS,
            reason=f"the cosine between u⁺ and u⁻ as fields is {cosine:.2f} (1: the same form)",
        ),
        Claim(
            where="3.2.4, Fig. 11c",
            statement="for a random left-velocity, we find a random right-velocity",
            verdict=Verdict.HOLDS if abs(share) > 0.2 else Verdict.FAILS,
            reason=f"the random part comes back times {share:+.2f}, correlation {correlation:+.2f} (mean of "
            f"{len(drawn)} draws)",
        ),
    ]


def _table(runs: list[Run]) -> Table:
    rows: list[list[Cell]] = []
    for run in runs:
        largest, normal, along, holds = run.on_walls()
        near, far = run.near_and_far
        rows.append([run.name, run.kept(), run.cosine(), max(largest, 0.0), normal, along, holds, run.outflow(),
                     float(run.pressure.max()), run.largest_from_exit, near, far, run.answer.residual,
                     str(run.answer.status)])  # fmt: skip
    return Table(
        caption="The runs of Fig. 11. On walls: largest u⁺·n, root mean squares of u⁺·n and u⁺·t, share of the walls that hold "
        "somebody. p over a body.",
        head=["left velocity", "energy kept", "cosine of u⁺, u⁻", "walls: largest u⁺·n (m/s)", "walls: u⁺·n (m/s)",
              "walls: u⁺·t (m/s)", "walls: holding", "u⁺·n on the exit (m/s)", "largest p (N·s/m)", "from the exit (m)",
              f"p within {NEAR:g} m", f"p beyond {NEAR:g} m", "residual", "status"],
        rows=rows,
    )  # fmt: skip


def _echo_table(echoes: list[tuple[float, float]]) -> Table:
    return Table(
        caption="What becomes of the random part of the left velocity: ∫δu⁺·δu⁻/∫|δu⁻|² and the correlation.",
        head=["draw", "multiplied by", "correlation"],
        rows=[
            [seed, share, correlation]
            for seed, (share, correlation) in zip(SEEDS, echoes, strict=True)
        ],
    )


def _outflow_table(flows: list[tuple[float, Run]]) -> Table:
    return Table(
        caption="Uniform left velocity: mean outward velocity on the exit, energy kept, and where people close up, "
        "for other k_v.",
        head=["k_v (per person)", "u⁺·n on the exit (m/s)", "energy kept", "share of the room with div u⁺ < 0", "status"],
        rows=[
            [k, run.outflow(), run.kept(), run.compressed(), str(run.answer.status)] for k, run in flows
        ],
    )  # fmt: skip
