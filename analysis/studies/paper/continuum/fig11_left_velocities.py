"""Fig. 11: right velocity and pressure by the collision (11) for two left velocities, uniform and
random."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from analysis.pages.drawing import label_outer, panels
from analysis.pages.fields import draw_arrows, draw_map, rounded
from analysis.pages.section import Section, Verdict
from analysis.pages.words import Words
from analysis.studies.paper.continuum import exit_room
from analysis.studies.paper.solutions import unsolved
from analysis.support.parallel import Progress
from nscd.arrays import Floats
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.left_velocity import Field, random_speeds, toward_exit
from nscd.continuum.medium import DENSITY, table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.space import Space

MEAN, DEVIATION = 1.34, 0.26  # m/s
SEEDS = (1, 2, 3)
OUTFLOWS = (1.0, 2.0, 4.0, 6.0, 8.0, 9.0, 12.0)  # k_v for which the flow through the exit is asked
NEAR = 1.0  # m
ROUNDING = 1e-9  # m/s
ARROWS, LENGTH = 0.6, 0.5  # m between arrows, m for each m/s
STOPPED = 0.01  # of the desired speed: slower counts as cancelled
ALIKE, SOMEHOW = 0.95, 0.5  # cosine between two fields that have the same form, or something of it
RANDOM = 0.2  # of the random part that comes back


class Case(NamedTuple):
    """The answer of (11) for one left velocity, as a row of the table.

    largest, normal, along: m/s, on walls the largest u⁺·n (n out of the room), and root mean
        squares of u⁺·n and u⁺·t.
    peak, from_exit: the largest p over a body (N·s/m), and its distance (m) from the exit.
    near, far: N·s/m, mean p within NEAR of the exit and beyond."""

    name: str
    retained: float  # share of the kinetic energy
    cosine: float  # ∫u⁺·u⁻/(‖u⁺‖‖u⁻‖) of the means over a body: ±1 for fields of one form
    largest: float
    normal: float
    along: float
    holding: float  # share of the walls that hold somebody
    outflow: float  # m/s, mean u⁺·n on the exit
    peak: float
    from_exit: float
    near: float
    far: float
    residual: float
    status: str


class Fields(NamedTuple):
    """Means over a body at the n points of the map: u⁺ (n,2) m/s and p (n,) N·s/m."""

    right: Floats
    pressure: Floats


def measured(name: str, solution: CollisionAnswer, left: Field) -> tuple[Case, Fields]:
    """Measure what people do at the walls, on the exit and in the room."""
    before, right = (
        exit_room.body_mean(solution.space, np.moveaxis(field, 0, -1))
        for field in (solution.left_field, solution.right_field)
    )
    pressure, area = exit_room.body_pressure(solution), exit_room.map_of().area
    pairs = (before, right), (before, before), (right, right)
    both, one, two = (float(area @ (a * b).sum(1)) for a, b in pairs)
    wall = solution.space.wall
    u = solution.right_velocity[wall.node]
    normal = (u * wall.normal).sum(1)
    along = u[:, 1] * wall.normal[:, 0] - u[:, 0] * wall.normal[:, 1]
    fraction = wall.weight / wall.weight.sum()
    near = exit_room.to_exit(exit_room.map_of().points) <= NEAR
    form = energy_fraction(solution), both / float(np.sqrt(one * two))
    largest = float(normal.max()) if normal.max() > ROUNDING else 0.0
    across, aside = (float(np.sqrt(fraction @ part**2)) for part in (normal, along))
    holding, flow = float(fraction[solution.active].sum()), outflow(solution, left)
    peak = float(pressure.max()), exit_room.from_exit(pressure)
    by, far = (float(np.average(pressure[at], weights=area[at])) for at in (near, ~near))
    ended = solution.residual, str(solution.status)
    walls = largest, across, aside, holding, flow
    run = Case(name, *form, *walls, *peak, by, far, *ended)
    return run, Fields(right, pressure)


def energy_fraction(solution: CollisionAnswer) -> float:
    """Share of the kinetic energy that is left."""
    return 1 + solution.energy.change / solution.energy.before


def outflow(solution: CollisionAnswer, left: Field) -> float:
    """Average u⁺·n on the exit, m/s, with u⁻ as it is just inside."""
    edge = solution.space.border("exit")
    assert edge is not None
    w, normals = np.asarray(edge.interpolate(solution.unknowns)), np.asarray(edge.normals)
    inside = np.asarray(edge.global_coordinates()) - 1e-9 * normals
    before = left(inside.reshape(2, -1).T).T.reshape(inside.shape)
    return float((((w - before) * normals).sum(0) * edge.dx).sum() / edge.dx.sum())


def compressed(solution: CollisionAnswer, left: Field) -> float:
    """Share of the room where div u⁺ = div w − div u⁻ < 0; for a u⁻ that is smooth away from the
    exit."""
    space, gradient = solution.space, np.asarray(solution.sum_field.grad)
    along_x, along_y = exit_room.slopes(left, space.points, 1e-5)
    divergence = (gradient[0, 0] + gradient[1, 1]).ravel() - along_x[:, 0] - along_y[:, 1]
    return float(space.weights[divergence < 0].sum() / space.weights.sum())


def echo(even: CollisionAnswer, drawn: CollisionAnswer) -> tuple[float, float]:
    """Say what becomes of the random part of a left velocity, δu⁻ = u⁻ − u⁻_uniform:
    ∫δu⁺·δu⁻/∫|δu⁻|² and ∫δu⁺·δu⁻/(‖δu⁺‖‖δu⁻‖)."""
    weight = drawn.space.basis.dx
    before, after = drawn.left_field - even.left_field, drawn.right_field - even.right_field
    both, one, two = (
        float(((a * b).sum(0) * weight).sum())
        for a, b in ((before, after), (before, before), (after, after))
    )
    return both / one, both / float(np.sqrt(one * two))


def maps(named: Sequence[tuple[str, Fields]]) -> Figure:
    """Draw |u⁺| with arrows, and p, of each run."""
    shape = 10.5, 4.6 * len(named), len(named), 2
    figure, every = panels(*shape, sharex=True, sharey=True)
    mesh = exit_room.map_of().mesh
    fastest = rounded(max(float(np.quantile(np.hypot(*f.right.T), 0.99)) for _, f in named))
    maximum = rounded(max(float(np.quantile(f.pressure, 0.995)) for _, f in named))
    rows = zip(every[::2], every[1::2], ("ab", "cd"), named, strict=True)
    for speed, press, letters, (name, fields) in rows:
        for axes, letter, what, unit, values, top in (
            (speed, letters[0], "right velocity", "|u⁺| (m/s)", np.hypot(*fields.right.T), fastest),
            (press, letters[1], "pressure", "pressure (N·s/m)", fields.pressure, maximum),
        ):
            title = f"({letter}) {what}, {name} left velocity"
            drawn = draw_map(axes, exit_room.ROOM, mesh, values, top, title)
            figure.colorbar(drawn, ax=axes, label=unit, shrink=0.9)
            axes.set(xlim=(-10.3, 0.6), ylim=(-5.3, 5.3))
        draw_arrows(speed, mesh, fields.right, ARROWS, LENGTH)
    label_outer(every)
    return figure


def build(progress: Progress | None = None, mesh: float = exit_room.MESH) -> Section:
    """Build Fig. 11: right velocity and pressure for uniform and random left velocities."""
    space = Space(mesh_of(exit_room.ROOM, mesh))
    way, toward = (toward_exit(exit_room.ROOM, speed) for speed in (1.0, MEAN))
    drawn: dict[str, float] = {"mean": MEAN, "deviation": DEVIATION, "cell": DENSITY**-0.5}
    lefts: dict[str, Field] = {"uniform": toward}
    for seed in SEEDS:
        lefts[f"random, draw {seed}"] = random_speeds(exit_room.ROOM, way, seed=seed, **drawn)
    crowd = table_1_medium()
    solutions = {name: collide(space, crowd, left) for name, left in lefts.items()}
    flows = {k: collide(space, table_1_medium(volume=k), toward) for k in OUTFLOWS}
    found = {name: measured(name, solutions[name], left) for name, left in lefts.items()}
    runs = [run for run, _ in found.values()]
    even, slow = runs[0], STOPPED * MEAN
    echoes = [echo(solutions["uniform"], solutions[run.name]) for run in runs[1:]]
    fraction, correlation = np.mean(echoes, axis=0).tolist()
    words = Words(__name__, runs=runs, even=even, share=fraction, correlation=correlation)
    named = {f"uniform, k_v = {k:g}": solution for k, solution in flows.items()}
    shown = (("uniform", found["uniform"][1]), ("random", found[runs[1].name][1]))
    return words.section(
        "11",
        pictures={"fig_11_left_velocities": maps(shown)},
        tables={
            "runs": runs,
            "echoes": [[seed, *one] for seed, one in zip(SEEDS, echoes, strict=True)],
            "outflows": [
                [k, outflow(a, toward), energy_fraction(a), compressed(a, toward), str(a.status)]
                for k, a in flows.items()
            ],
        },
        claims={
            "cancelled": Verdict.of(
                max(even.normal, even.along) < slow, all(run.largest < slow for run in runs)
            ),
            "maximal": Verdict.of(*(run.from_exit < NEAR for run in runs)),
            "same_form": Verdict.of(even.cosine > ALIKE, even.cosine > SOMEHOW),
            "random": Verdict.of(abs(fraction) > RANDOM),
        },
        warnings=unsolved([*solutions.items(), *named.items()]),
    )
