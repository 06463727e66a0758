"""The bridge from contacts to stress: percussions of ever more disks in the same room before a 1 m
exit that opens, and the continuum models that they approach, under the same kernel."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.pages import drawing
from analysis.pages.numbers import NONE, decimals
from analysis.pages.section import Cell, Section
from analysis.pages.words import Words
from analysis.scene.packing import heap, press
from analysis.studies.paper.continuum.exit_room import EXIT, ROOM, to_exit
from analysis.studies.paper.solutions import HasStatus, grouped, unsolved
from analysis.support.parallel import Progress
from nscd import Snapshot, Walls, find_contacts, solve
from nscd.arrays import Floats
from nscd.continuum import left_velocity
from nscd.continuum.collision import collide
from nscd.continuum.medium import PERSON, TABLE_1, Medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.pressure import pressure
from nscd.continuum.rivals.cells import Cells
from nscd.continuum.rivals.first_order import first_order_flow, frictional_flow
from nscd.continuum.room import Border, Room
from nscd.continuum.space import Space
from nscd.stress import Kernel, coarse_grain, flow_field, stress_field

HALF_DOOR = 0.5 * EXIT  # m
SPEED = 2.0  # m/s, toward the nearest point of the exit
toward_exit = left_velocity.toward_exit(ROOM, SPEED)
PEOPLE, RADIUS = 600, 0.215  # how many of which mean radius (m) make up the crowd's mass and size
MASS = PERSON * PEOPLE
KERNEL = Kernel(width=0.4, compact=True)
SPACING = 0.25  # m, of the points where fields are compared
WITHIN = 7.25  # m of the exit, where these points lie; crowds end at 7.8 to 8 m
SOFTNESS = 0.02
NEAR = 0.2  # of the mean radius
MESH = 0.3  # m
ARC = 90  # edges of each quarter of the crowd's round border
VOLUMES = 10.0 ** np.arange(2.0, 4.51, 0.25)  # kg, among which k_v is fitted
FRICTIONS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4)
BAND = 0.5  # m, of the profiles


class Packing(StrEnum):
    """Which disks count as touching, and how they came to stand."""

    TOUCHING = "touching"
    NEAR = "near"
    PRESSED = "pressed"


COLOURS = {
    Packing.TOUCHING: drawing.ORANGE,
    Packing.NEAR: drawing.GREEN,
    Packing.PRESSED: drawing.BLUE,
}

Plan = Mapping[Packing, Mapping[int, int]]
"""How many crowds (seeds 1, 2, …) of each packing and N."""

# a large crowd averages over its own disorder, so that few of them say as much as many small ones
PLAN: Plan = {
    Packing.TOUCHING: {600: 8, 2400: 6, 10_000: 4, 40_000: 2},
    Packing.NEAR: {600: 8, 2400: 4, 10_000: 3, 40_000: 1},
    Packing.PRESSED: {600: 8, 2400: 4, 10_000: 3, 40_000: 1},
}


def points() -> Floats:
    """Where fields are compared, (m,2) m: a square grid within 7.25 m of the exit."""
    axis = np.arange(0.5 * SPACING, WITHIN + 2 * HALF_DOOR, SPACING)
    both_ways = np.concatenate([-axis[::-1], axis])
    grid = np.stack(np.meshgrid(-axis, both_ways, indexing="ij"), -1).reshape(-1, 2)
    return grid[to_exit(grid) <= WITHIN]


def area(size: float) -> float:
    """Of x < 0 within `size` (m) of the exit, m²."""
    return 0.5 * np.pi * size**2 + 2 * HALF_DOOR * size


def crowd_size(position: Floats) -> float:
    """R (m) of a crowd of even density: half of it stands on half the area, within the median
    distance of the exit."""
    full = 2 * area(float(np.median(to_exit(position))))
    return float((np.sqrt((2 * HALF_DOOR) ** 2 + 2 * np.pi * full) - 2 * HALF_DOOR) / np.pi)


class Sample:
    """One crowd: its answer, and its fields at `points` by KERNEL.

    n disks of mean radius 0.215 m·√(600/n) and 45 t in all, masses ∝ r², packed before the shut
    door, which is open when they walk; their percussions with k = 0. touching: a heap just as it
    was grown, contacts where disks touch; near: the same heap, gaps up to 0.2 mean radii count as
    contacts; pressed: soft disks at rest against the shut door, contacts where they overlap.

    size: m, R: the crowd fills x < 0 within R of the exit
    coordination: contacts per disk, 2k/n on average
    pressure: (m,) N·s/m, of the percussions' stress Σ; velocity: (m,2) m/s, u⁺
    deviator: ‖Σ + p1‖/‖Σ‖, what is not pressure
    dissipative: R² of Σ = k D(w), w = u⁺ + u⁻, through the origin: 1 − ‖Σ − kD(w)‖²/‖Σ‖² with the
        best k ≥ 0
    compression: how much of the compression that people want is left, ∫(div u⁺)₋/∫(div u⁻)₋
    retained: Σm|u⁺|²/Σm|u⁻|², which for k = 0 is also Σmu⁺·u⁻/Σm|u⁻|²
    wall_load: kN·s, Σ of the walls' percussions along x"""

    def __init__(self, packing: Packing, n: int, seed: int) -> None:
        mean, self.seed = RADIUS * np.sqrt(PEOPLE / n), seed
        position, radius = heap(n, seed, mean, HALF_DOOR)
        if packing is Packing.PRESSED:
            position, rested = press(position, radius, HALF_DOOR, SOFTNESS)
            if not rested:
                raise RuntimeError(f"{n} pressed disks did not come to rest (seed {seed})")
        within = {Packing.TOUCHING: 1e-9, Packing.NEAR: NEAR * mean, Packing.PRESSED: 0.0}
        mass, left = MASS * radius**2 / (radius**2).sum(), toward_exit(position)
        snapshot = Snapshot(position=position, velocity=left, radius=radius, mass=mass)
        far = 2.0 * float(np.abs(position).max())
        ends = np.array([[[0, -far], [0, HALF_DOOR]], [[0, -HALF_DOOR], [0, far]]])
        walls = Walls(start=ends[0], end=ends[1])
        contacts = find_contacts(snapshot, walls, tolerance=within[packing])
        # where λ is not unique its choice moves the pressure by less than a thousandth: the
        # cheapest will do
        solution = self.solution = solve(snapshot, contacts, canonical=False)
        self.size, self.coordination = crowd_size(position), 2 * len(contacts) / n
        at, right = points(), solution.right_velocity
        before, after = (float((mass[:, None] * u**2).sum()) for u in (left, right))
        self.retained = after / before
        self.wall_load = float(solution.impulse[contacts.is_wall, 0].sum()) / 1e3
        stress = stress_field(snapshot, contacts, solution.impulse, KERNEL, at)
        flow, wanted = (flow_field(snapshot, u, KERNEL, at) for u in (right, left))
        self.pressure, self.velocity = stress.pressure, flow.velocity
        sigma, total = stress.stress, flow.gradient + wanted.gradient
        rest = sigma + stress.pressure[:, None, None] * np.eye(2)
        self.deviator = float(np.linalg.norm(rest) / np.linalg.norm(sigma))
        rate = 0.5 * (total + total.transpose(0, 2, 1))
        along = max(float((sigma * rate).sum()), 0.0)
        self.dissipative = along**2 / float((sigma**2).sum() * (rate**2).sum())
        closing, wish = (
            float(np.maximum(-np.trace(u.gradient, axis1=1, axis2=2), 0.0).sum())
            for u in (flow, wanted)
        )
        self.compression = closing / wish


class Model(NamedTuple):
    """A continuum answer: pressure (m,) N·s/m and u⁺ (m,2) m/s at `points()` under KERNEL."""

    name: str  # the law and its parameter
    pressure: Floats
    velocity: Floats
    retained: float  # share of the kinetic energy
    wall_load: float  # N·s
    solution: HasStatus | None = None  # of the solver; None for what is known without one
    parameter: float = 0.0  # the friction s or k_v (kg) of a law that has one


class FittedCrowd:
    """The continuum that a crowd of disks stands for: x < 0 within `size` (m, R) of the exit, 45 t.

    density: kg/m²; mesh: walls on x = 0, the exit in their middle, a free border at R; space: its
    P1 vector elements."""

    def __init__(self, size: float) -> None:
        self.size, self.density = size, MASS / area(size)
        angle = np.linspace(0.0, 0.5 * np.pi, ARC + 1)
        upper = np.column_stack([-np.sin(angle), np.cos(angle)]) * size + [0.0, HALF_DOOR]
        lower = np.column_stack([-np.cos(angle), -np.sin(angle)]) * size - [0.0, HALF_DOOR]
        outline = np.vstack([upper, lower, [[0.0, -HALF_DOOR], [0.0, HALF_DOOR]]])
        border: list[Border] = ["free"] * (len(outline) - 3)
        self.mesh = mesh_of(Room(outline=outline, border=(*border, "wall", "exit", "wall")), MESH)
        self.space = Space(self.mesh)
        # ∫φ over the crowd at `points()`, (m,)
        self._spread = coarse_grain(self.space.points, self.space.weights[:, None], KERNEL, points())[0]

    def model(self, name: str, pressure: Floats, right: Floats, load: float, *more: Any) -> Model:
        """A model of pressure (q,) N·s/m and right velocity (q,2) m/s at the quadrature points."""
        weight = self.space.weights
        columns = weight[:, None] * np.column_stack([pressure, right])
        values, _ = coarse_grain(self.space.points, columns, KERNEL, points())
        selected = float((weight * (right**2).sum(1)).sum() / (weight.sum() * SPEED**2))
        return Model(name, values[:, 0], values[:, 1:] / self._spread, selected, load, *more)

    def of_cells(self, name: str, pressure: Floats, across: Floats, flow: Any, *more: Any) -> Model:
        """A model of P1 pressure and stress −Σ_xx across the walls (n,) N·s/m, and of a flow with a
        right velocity in the cells."""
        basis = self.space.scalar
        values = np.zeros(basis.N)
        values[basis.nodal_dofs[0]] = pressure
        ends = self.mesh.facets[:, (self.mesh.boundaries or {})["wall"]]
        length = np.hypot(*(self.mesh.p[:, ends[1]] - self.mesh.p[:, ends[0]]))
        load = float((length * across[ends].mean(0)).sum())
        p = np.asarray(basis.interpolate(values)).ravel()
        right = np.repeat(flow.right_velocity, basis.dx.shape[1], axis=0)
        return self.model(name, p, right, load, flow, *more)

    def collided(self, volume: float, surface: float = 0.0) -> Model:
        """(11) with k_v (kg) and k_s (kg/m)."""
        arguments = {"volume_dissipation": volume, "surface_dissipation": surface}
        solution = collide(self.space, Medium(density=self.density, **arguments), toward_exit)
        # along +x: what the crowd gives to the walls
        load = float(solution.wall_force @ self.space.wall.normal[:, 0])
        right, p = solution.right_field.reshape(2, -1).T, pressure(solution).ravel()
        return self.model(f"(11), k~v~ = {volume:,.0f} kg", p, right, load, solution, volume)

    def with_wall_friction(self, friction: float) -> Model:
        """(20) with an internal friction s."""
        desired = Cells(self.mesh).mean_velocity(toward_exit, "toward_exit")
        flow = frictional_flow(self.mesh, self.density, desired, friction)
        p, a, _ = flow.stress.T
        return self.of_cells(f"(20), friction {friction:g}", p, p - a, flow, friction)


class Models(NamedTuple):
    """The models of one crowd.

    first_order: (20) in its complementarity form, for a given mass: ρu⁺ = ρu_d − ∇p, div u⁺ ≥ 0 ⟂ p
    ≥ 0; blocked: p = ρU(R − d) with the distance d from the exit, the solution of (20) for a shut
    door, u_d = −U∇d; table: (11) with the paper's Table 1, per person of 75 kg"""

    first_order: Model
    blocked: Model  # nobody moves
    unhindered: Model  # everybody walks as they want: u⁺ = u⁻, no pressure
    table: Model
    deformable: list[Model]  # (11) with each k_v of VOLUMES
    frictional: list[Model]  # (20) with each internal friction s of FRICTIONS

    @property
    def every(self) -> list[Model]:
        """All of them."""
        return [*self[:4], *self.deformable, *self.frictional]

    @classmethod
    def of(cls, crowd: FittedCrowd) -> Models:
        """Solve all models of a crowd."""
        where, push, size = crowd.space.points, crowd.density * SPEED, crowd.size
        rest, flow = np.zeros_like(where), first_order_flow(crowd.mesh, toward_exit)
        shut, p = push * (size - to_exit(where)), crowd.density * flow.pressure
        table = TABLE_1.volume_dissipation, TABLE_1.surface_dissipation
        return cls(
            first_order=crowd.of_cells("(20)", p, p, flow),
            blocked=crowd.model("nobody moves", shut, rest, push * size**2),
            unhindered=crowd.model("u⁺ = u⁻", rest[:, 0], toward_exit(where), 0.0),
            table=crowd.collided(*(PERSON * value for value in table)),
            deformable=[crowd.collided(float(volume)) for volume in VOLUMES],
            frictional=[crowd.with_wall_friction(s) for s in FRICTIONS],
        )


@dataclass(frozen=True, eq=False)
class Size:
    """All crowds of one packing and one N, against the continuum models of that packing's crowd:
    shares and distances, one number per crowd, (s,)."""

    packing: Packing
    n: int
    samples: Sequence[Sample]
    models: Models

    def pressure_distance(self, model: Model) -> Floats:
        """‖p − p_model‖/‖p_(20)‖ of each crowd, L² over the points."""
        return np.array([self.pressure_gap(model, s) for s in self.samples])

    def pressure_gap(self, model: Model, other: Sample | Model | None = None) -> float:
        """‖p_model − p‖/‖p_(20)‖ of one crowd or model; of (20) by default."""
        reference = self.models.first_order
        away = np.linalg.norm(model.pressure - (other or reference).pressure)
        return float(away / np.linalg.norm(reference.pressure))

    def velocity_distance(self, model: Model) -> Floats:
        """‖u⁺ − u⁺_model‖/‖u⁻‖ of each crowd, L² over the points."""
        scale = np.linalg.norm(self.models.unhindered.velocity)
        away = [np.linalg.norm(s.velocity - model.velocity) for s in self.samples]
        return np.asarray(np.array(away) / scale)

    def _nearest_pressure(self, models: Sequence[Model]) -> Model:
        return min(models, key=lambda model: float(self.pressure_distance(model).mean()))

    @cached_property
    def best(self) -> Model:
        """(11) with the k_v, among VOLUMES, whose pressure is nearest to the crowds'."""
        return self._nearest_pressure(self.models.deformable)

    @cached_property
    def frictional_fit(self) -> Model:
        """(20) with the friction, 0 or among FRICTIONS, whose pressure is nearest to the
        crowds'."""
        return self._nearest_pressure([self.models.first_order, *self.models.frictional])

    @property
    def shown(self) -> list[Model]:
        """The models of the table, with what is fitted among them."""
        return [*self.models[:4], self.best, self.frictional_fit]

    @property
    def nearest(self) -> Model:
        """The one of the models shown to which pressure and velocity together are nearest."""
        distances = (self.pressure_distance, self.velocity_distance)
        return min(self.shown, key=lambda model: sum(float(far(model).mean()) for far in distances))

    def each(self, name: str) -> Floats:
        """One quantity of every crowd, (s,…)."""
        return np.array([getattr(s, name) for s in self.samples])

    @property
    def spread(self) -> float:
        """Root mean square distance of a crowd's pressure from their mean, over ‖p_(20)‖; NaN for a
        single crowd."""
        if len(self.samples) < 2:
            return np.nan
        variance = self.each("pressure").var(axis=0, ddof=1).sum()
        return float(np.sqrt(variance) / np.linalg.norm(self.models.first_order.pressure))

    @property
    def warnings(self) -> list[str]:
        """The crowds that are not solved."""
        name = f"{self.packing}, N = {self.n}, seed"
        return unsolved((f"{name} {s.seed}", s.solution) for s in self.samples)


def study(plan: Plan = PLAN, progress: Progress | None = None) -> list[Size]:
    """Solve all crowds of the plan, by packing and N, and the continuum of each packing's mean
    size R."""
    total = sum(n * count for sizes in plan.values() for n, count in sizes.items())
    done, models, found = 0, dict[float, Models](), list[Size]()
    for packing, counts in plan.items():
        crowds: dict[int, list[Sample]] = {n: [] for n in counts}
        for n in (n for n, count in counts.items() for _ in range(count)):
            crowds[n].append(Sample(packing, n, 1 + len(crowds[n])))
            done += n
            if progress:
                progress("crowds", done / total)
        # to the centimetre: `touching` and `near` are the same heaps
        size = round(float(np.mean([s.size for same in crowds.values() for s in same])), 2)
        if size not in models:
            models[size] = Models.of(FittedCrowd(size))
        found += [Size(packing, n, same, models[size]) for n, same in crowds.items()]
    return found


def by_packing(sizes: Sequence[Size]) -> dict[Packing, list[Size]]:
    """The sizes of each packing."""
    return grouped(sizes, attrgetter("packing"))


def trends(sizes: Sequence[Size]) -> Figure:
    """Against N: kinetic energy kept; distance of the pressure from (20), without and with
    friction; the part of Σ that is no pressure."""
    figure, (selected, deviator, smooth, frictional_axes) = drawing.panels(10.0, 7.4, 2, 2)
    last = sizes[-1]
    models = last.models
    _trend(selected, sizes, lambda size: size.each("retained"))
    _trend(deviator, sizes, lambda size: size.each("deviator"))
    _trend(smooth, sizes, lambda size: size.pressure_distance(size.models.first_order))
    _trend(frictional_axes, sizes, lambda size: size.pressure_distance(size.frictional_fit))
    free, flow, blocked = models.unhindered, models.first_order, models.blocked
    levels = [(m.name, m.retained) for m in (free, flow, last.frictional_fit, blocked)]
    _across(selected, [*levels, ("(11), Table 1", models.table.retained)])
    _across(smooth, [(m.name, last.pressure_gap(m)) for m in (free, blocked, last.frictional_fit)])
    selected.set(ylim=(-0.05, 1.06), ylabel="kinetic energy kept")
    deviator.set(ylim=(0, None), ylabel="no pressure: ‖Σ + p1‖ / ‖Σ‖")
    smooth.set(ylim=(0, 1.06), ylabel="distance of p from (20)")
    frictional_axes.set(ylim=(0, 1.06), ylabel="distance of p from (20), best friction")
    drawing.legend_below(figure, selected, 3, 9)
    return figure


def _across(axes: Axes, levels: Sequence[tuple[str, float]]) -> None:
    """Lines across the axes, named beside them, where no data can be."""
    anchor = ("axes fraction", "data")
    for words, value in levels:
        axes.axhline(value, color=drawing.BLACK, lw=0.8, ls=drawing.LINES[3])
        axes.annotate(words, (1.01, value), xycoords=anchor, fontsize=8, va="center")


def _trend(axes: Axes, sizes: Sequence[Size], number: Callable[[Size], Floats]) -> None:
    for index, (packing, same) in enumerate(by_packing(sizes).items()):
        values = [number(size) for size in same]
        bars, means = map(standard_error, values), [v.mean() for v in values]
        style: dict[str, Any] = {"marker": drawing.MARKERS[index], "ls": drawing.LINES[index]}
        style |= {"color": COLOURS[packing], "capsize": 3, "label": str(packing)}
        axes.errorbar([size.n for size in same], means, yerr=list(bars), **style)
    axes.set(xscale="log", xlabel="disks N in the same room")
    axes.margins(x=0.08)


def profiles(sizes: Sequence[Size]) -> Figure:
    """Mean pressure in bands of the distance from the exit, one panel a packing, with the continuum
    models."""
    kinds = by_packing(sizes)
    figure, every = drawing.panels(11.0, 4.5, 1, len(kinds), sharey=True)
    for axes, (packing, same) in zip(every, kinds.items(), strict=True):
        shades = np.linspace(0.65, 0.0, len(same))
        for number, size in enumerate(same):
            mean = size.each("pressure").mean(0)
            mark = {"marker": drawing.MARKERS[number], "ms": 4, "lw": 1}
            appearance = mark | {"color": str(shades[number])}
            axes.plot(*_banded(mean), **appearance, label=f"{size.n:,} disks")
        models, last, dashes = same[-1].models, same[-1], (0, (4, 1, 1, 1, 1, 1))
        fitted = "fitted to the largest N"
        for model, style, colour, words in (
            (models.first_order, "--", drawing.BLUE, "(20)"),
            (models.blocked, "-.", drawing.BLACK, "nobody moves"),
            (last.frictional_fit, (0, (8, 2)), drawing.PINK, f"(20), friction {fitted}"),
            (models.table, ":", drawing.ORANGE, "(11), Table 1"),
            (last.best, dashes, drawing.GREEN, f"(11), $k_v$ {fitted}"),
        ):
            axes.plot(*_banded(model.pressure), ls=style, lw=2, color=colour, label=words)
        limits: dict[str, Any] = {"xlim": (0, WITHIN), "ylim": (0, None)}
        drawing.label(axes, "distance from the exit (m)", title=str(packing), **limits)
    drawing.label(every[0], y="coarse-grained pressure (N·s/m)")
    drawing.legend_below(figure, every[0], 3)
    return figure


def _banded(values: Floats) -> tuple[Floats, Floats]:
    """Middles of the bands (m) and the mean in each."""
    band = (to_exit(points()) / BAND).astype(np.int64)
    count = np.bincount(band)
    middle: Floats = (np.arange(len(count), dtype=np.float64) + 0.5) * BAND
    return middle, np.bincount(band, values) / count


def pressure_maps(sizes: Sequence[Size]) -> Figure:
    """Pressure of one crowd of the smallest and of the largest N of each packing, and of continuum
    models."""
    kinds, last = by_packing(sizes), sizes[-1]
    picked = [(packing, same[pick]) for pick in (0, -1) for packing, same in kinds.items()]
    shown = [(f"{packing}, N = {size.n:,}", size.samples[0].pressure) for packing, size in picked]
    models = (last.models.first_order, last.frictional_fit, last.best)
    shown += [(model.name, model.pressure) for model in models[: len(kinds)]]
    figure, every = drawing.panels(9.5, 12.0, 3, len(kinds), sharex=True, sharey=True)
    top = float(last.models.blocked.pressure.max())
    levels = np.linspace(0.0, np.ceil(top / 500) * 500, 13)
    x, y = np.unique(points()[:, 0]), np.unique(points()[:, 1])
    rows, columns = np.searchsorted(y, points()[:, 1]), np.searchsorted(x, points()[:, 0])
    for axes, (words, values) in zip(every, shown, strict=True):
        grid = np.full((len(y), len(x)), np.nan)
        grid[rows, columns] = np.maximum(values, 0.0)
        drawn = axes.contourf(x, y, grid, levels=levels, cmap=drawing.SHADES, extend="max")
        axes.contour(x, y, grid, levels=levels[::2], colors="white", linewidths=0.4)
        for side in (-HALF_DOOR, HALF_DOOR):
            axes.plot([0, 0], [side, side + np.copysign(WITHIN, side)], color=drawing.BLACK, lw=2)
        axes.set_title(words.replace("k~v~", "$k_v$"), fontsize=9)
        axes.set(aspect="equal", xlim=(-WITHIN, 3 * SPACING), facecolor=drawing.GREY)
    drawing.label_outer(every)
    figure.colorbar(drawn, ax=every, label="pressure (N·s/m)", shrink=0.5)
    return figure


def build(progress: Progress | None = None, plan: Plan = PLAN) -> Section:
    """Build the study: crowds of every packing and size, and the continuum models."""
    sizes = study(plan, progress)
    ordered = [sorted(same, key=lambda size: size.n) for same in by_packing(sizes).values()]
    words = Words(
        __name__,
        **{"kernel": KERNEL, "both": both, "near": NEAR, "within": WITHIN},
        ends=[(same[0], same[-1]) for same in ordered],
    )
    models = [model for size in sizes for model in size.models.every]
    inexact = {*unsolved((m.name, m.solution) for m in models if m.solution is not None)}
    return words.section(
        "bridge",
        pictures={
            "bridge_trends": trends(sizes),
            "bridge_profiles": profiles(sizes),
            "bridge_maps": pressure_maps(sizes),
        },
        tables={
            "fields": [*map(_crowds, sizes), *map(_model, sizes[-1].shown)],
            "distances": [_distances(size) for size in sizes],
        },
        warnings=[*(line for size in sizes for line in size.warnings), *sorted(inexact)],
    )


def both(values: Floats, digits: int = 2) -> str:
    """Write mean ± standard error; the value alone of a single crowd."""
    mean = decimals(float(values.mean()), digits)
    return f"{mean} ± {decimals(standard_error(values), digits)}" if len(values) > 1 else mean


def standard_error(values: Floats) -> float:
    """Of the mean of values (s,); 0 of a single one."""
    return float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else 0.0


def _crowds(size: Size) -> list[Cell]:
    coordination = float(size.each("coordination").mean())
    wanted = {"retained": 3, "wall_load": 1, "deviator": 3, "dissipative": 3, "compression": 3}
    selected, load, *fractions = (both(size.each(name), positions) for name, positions in wanted.items())
    spread = size.spread if len(size.samples) > 1 else NONE
    status = "not all solved" if size.warnings else "solved"
    crowd = str(size.packing), size.n, len(size.samples), coordination
    return [*crowd, selected, load, spread, *fractions, status]


def _model(model: Model) -> list[Cell]:
    fractions = [decimals(model.retained, 3), decimals(model.wall_load / 1e3, 1)]
    solved = model.solution is None or model.solution.status == "solved"
    status = "solved" if solved else "not solved"
    return [model.name, NONE, NONE, NONE, *fractions, *[NONE] * 4, status]


def _distances(size: Size) -> list[Cell]:
    m = size.models
    pressing = [m.first_order, size.frictional_fit, m.blocked, m.table, size.best]
    moving = [m.first_order, size.frictional_fit, m.blocked, m.unhindered, m.table, size.best]
    pressures = [both(size.pressure_distance(model)) for model in pressing]
    velocities = [both(size.velocity_distance(model)) for model in moving]
    fitted = [size.frictional_fit.parameter, size.best.parameter]
    return [str(size.packing), size.n, *pressures, *fitted, *velocities]
