"""Fig. 9: pressure before the exit by the collision (11) and by the first-order model (20), and the
largest pressure on ever finer meshes."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import curve_fit

from analysis.pages import drawing
from analysis.pages.fields import draw_map, rounded
from analysis.pages.section import Cell, Section, Verdict
from analysis.pages.words import Words
from analysis.studies.paper.continuum import exit_room
from analysis.studies.paper.solutions import unsolved
from analysis.support.parallel import Progress
from nscd.arrays import Floats
from nscd.continuum.closed_forms import point_sink
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.left_velocity import toward_exit
from nscd.continuum.medium import table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.pressure import LargestPressure, largest_pressures
from nscd.continuum.rivals.cells import Cells
from nscd.continuum.rivals.first_order import FirstOrderFlow, PlaceEquation, first_order_flow
from nscd.continuum.space import Space

SPEED = 1.7  # m/s
CROWD = table_1_medium()
NEAR, FAR, AT_EXIT = 1.0, 3.0, 0.3  # m from the exit
HALVINGS = 3
GAUSSIAN = 0.95  # R² below this: the shape is not called a Gaussian
MINIMAL = 0.25  # a pressure below this share of the largest is called minimal
SETTLED = 0.03  # change of a mean over a body at the last halving: more has not settled


class Field(NamedTuple):
    """A pressure (n,) N·s/m over a body at the map's points, and the answer that it is of."""

    name: str
    pressure: Floats
    solution: CollisionAnswer | FirstOrderFlow

    @property
    def largest(self) -> float:
        """N·s/m."""
        return float(self.pressure.max())

    @property
    def from_exit(self) -> float:
        """m, the distance of the largest from the exit."""
        return exit_room.from_exit(self.pressure)

    def band(self, minimum: float, maximum: float = np.inf) -> float:
        """Average over the points between these distances (m) from the exit, N·s/m."""
        distance = exit_room.to_exit(exit_room.map_of().points)
        inside = (distance >= minimum) & (distance <= maximum)
        return float(np.average(self.pressure[inside], weights=exit_room.map_of().area[inside]))

    @property
    def at_exit(self) -> float:
        """Mean within AT_EXIT of the exit, as a share of the largest."""
        return self.band(0.0, AT_EXIT) / self.largest

    @property
    def speeds(self) -> tuple[float, ...]:
        """m/s, mean |u⁺| of (20) over the triangles within NEAR of the exit, and beyond FAR."""
        assert isinstance(self.solution, FirstOrderFlow)
        mesh, speed = self.solution.mesh, np.hypot(*self.solution.right_velocity.T)
        far, area = exit_room.to_exit(mesh.p[:, mesh.t].mean(1).T), Cells(mesh).measure
        parts = (far <= NEAR, far >= FAR)
        return tuple(float(np.average(speed[some], weights=area[some])) for some in parts)


class Fit(NamedTuple):
    """A Gaussian A exp(−r²/2s²) of the distance r from the exit's middle.

    height, width: A, N·s/m, and s, m."""

    height: float
    width: float
    values: Floats  # (n,) N·s/m at the map's points
    explained: float  # R² at the points that it was fitted to


def radius() -> Floats:
    """Distance (n,) m of the map's points from the middle of the exit."""
    return np.asarray(np.hypot(*exit_room.map_of().points.T))


def gaussian(pressure: Floats, within: float = np.inf) -> Fit:
    """Fit a Gaussian to a pressure (n,) at the map's points with r ≤ `within` (m)."""
    r = radius()
    chosen = r <= within

    def shape(r: Floats, a: float, s: float) -> Floats:
        return np.asarray(a * np.exp(-(r**2) / (2 * s**2)))

    weight, start = exit_room.map_of().area[chosen] ** -0.5, (pressure.max(), 1.0)
    best, _ = curve_fit(shape, r[chosen], pressure[chosen], p0=start, sigma=weight)
    values = shape(r, *best)
    return Fit(float(best[0]), float(best[1]), values, explained(pressure, values, within))


def explained(pressure: Floats, values: Floats, within: float = np.inf) -> float:
    """R² = 1 − Σ(p − values)²/Σ(p − mean)², weighted by area, at the points with r ≤ `within`."""
    inside = radius() <= within
    p, area = pressure[inside], exit_room.map_of().area[inside]
    mean = area @ p / area.sum()
    return float(1 - area @ (p - values[inside]) ** 2 / (area @ (p - mean) ** 2))


def solve_room(mesh: float) -> tuple[Field, dict[PlaceEquation, Field]]:
    """Solve (11), and (20) in its three forms, times ρ, on one mesh of side `mesh` (m)."""
    space, left = Space(mesh_of(exit_room.ROOM, mesh)), toward_exit(exit_room.ROOM, SPEED)
    solution = collide(space, CROWD, left)
    first_order = {}
    for equation in PlaceEquation:
        flow = first_order_flow(space.mesh, left, equation=equation)
        values = np.zeros(space.scalar.N)
        values[space.scalar.nodal_dofs[0]] = CROWD.rho * flow.pressure
        pressure = exit_room.body_mean(space, np.asarray(space.scalar.interpolate(values)))
        first_order[equation] = Field(f"ρ·(20), {equation}", pressure, flow)
    return Field("(11)", exit_room.body_pressure(solution), solution), first_order


RawMaxima = Mapping[str, Sequence[LargestPressure]]
"""Largest pressures, in any triangle and over a body, on ever finer meshes, by their kind."""


def raw_maxima(size: float) -> RawMaxima:
    """Take largest pressures on meshes of the sides 2·size, size, … (m)."""
    sizes = [2 * size / 2**k for k in range(HALVINGS + 1)]
    inputs = exit_room.ROOM, CROWD, toward_exit(exit_room.ROOM, SPEED), exit_room.BODY
    uniform = largest_pressures(*inputs, sizes, grading=1.0)
    graded = largest_pressures(*inputs, sizes[:-1], grading=0.4)
    return {"uniform": uniform, "graded to the jambs": graded}


def maps(proposed: Floats, other: Floats, printed: Floats) -> Figure:
    """Draw (a) the proposed pressure, (b) (20) twice, (c) |p − ρp of (20)| over the largest p."""
    figure, every = drawing.panels(10.5, 8.6, 2, 2, sharex=True, sharey=True)
    top = rounded(float(np.quantile(np.concatenate([proposed, other]), 0.995)))
    own, unit = rounded(float(printed.max())), "pressure (N·s/m)"
    error, of = np.abs(proposed - other) / proposed.max(), "|p − ρp₍₂₀₎| / largest p (–)"
    shown = (
        ("(a) proposed, (11)", proposed, top, unit),
        ("(b) first order, complementarity", other, top, unit),
        ("(b) first order, as printed (its own scale)", printed, own, unit),
        ("(c) relative error", error, 1.2, of),
    )
    for axes, (name, values, maximum, words) in zip(every, shown, strict=True):
        drawn = draw_map(axes, exit_room.ROOM, exit_room.map_of().mesh, values, maximum, name)
        figure.colorbar(drawn, ax=axes, label=words, shrink=0.9)
    drawing.label_outer(every)
    return figure


def profiles(proposed: Floats, first_order: Floats, fitted: Floats, sink: Floats) -> Figure:
    """Draw pressures against the distance from the middle of the exit, plain and logarithmic."""
    figure, (plain, logarithmic) = drawing.panels(10.5, 4.6, 1, 2, grid="major")
    r = radius()
    order = np.argsort(r)
    for axes in (plain, logarithmic):
        for values, style, width, colour, label in (
            (first_order, ".", 0.0, drawing.GREY, "(20), complementarity, times ρ"),
            (proposed, "x", 0.0, drawing.BLUE, "(11)"),
            (fitted, "--", 2.0, drawing.ORANGE, "best Gaussian of (11)"),
            (sink, "-", 1.4, drawing.BLACK, "(11), point exit, closed form"),
        ):
            appearance = {"lw": width, "ms": 2.5, "mew": 0.6, "color": colour, "label": label}
            axes.plot(r[order], values[order], style, **appearance)
        axes.set(xlabel="distance from the middle of the exit (m)", ylabel="pressure (N·s/m)")
    far = r[order][r[order] > 2]
    falling = sink[order][-1] * far[-1] / far
    logarithmic.plot(far, falling, ":", lw=1.8, color=drawing.GREEN, label="∝ 1/r")
    logarithmic.set(xscale="log", yscale="log", xlim=(0.05, None), ylim=(30, None))
    drawing.legend_below(figure, logarithmic, 3)
    return figure


def raw_maximum(raw: RawMaxima) -> Figure:
    """Draw the largest pressure, in any triangle and over a body, against the side."""
    figure, (axes,) = drawing.panels(8.0, 4.4, grid="major")
    uniform, _ = raw.values()
    for (kind, rows), marker in zip(raw.items(), "os", strict=True):
        side, _, largest, body = map(np.array, zip(*rows, strict=True))
        name = kind.split()[0]
        any_triangle, over_body = f"in any triangle, {name}", f"over a body, {name}"
        axes.plot(side, largest, f"{marker}:", color=drawing.ORANGE, label=any_triangle)
        axes.plot(side, body, f"{marker}-", color=drawing.BLUE, mfc="none", label=over_body)
    side = np.array([row.size for row in uniform])
    slope = uniform[0].raw * (side / side[0]) ** -0.5
    axes.plot(side, slope, "--", color=drawing.BLACK, lw=1, label="∝ side$^{-1/2}$")
    drawing.label(axes, "side of the triangles (m)", "largest pressure (N·s/m)", log="xy")
    drawing.ticks_at(axes, side)
    axes.invert_xaxis()
    figure.legend(loc="outside right center", fontsize=8)
    return figure


def build(progress: Progress | None = None, mesh: float = exit_room.MESH) -> Section:
    """Build Fig. 9: maps and profiles of both pressures, the Gaussian tried, the raw maximum."""
    proposed, first_order = solve_room(mesh)
    complementarity = first_order[PlaceEquation.COMPLEMENTARITY]
    printed, p = first_order[PlaceEquation.PRINTED], proposed.pressure
    if progress:
        progress("Fig. 9", 0.4)
    raw, fit, r = raw_maxima(1.25 * mesh), gaussian(p), radius()
    *_, before, last = raw["graded to the jambs"]
    # relative change of the mean over a body at the last halving
    unsettled = last.body / before.body - 1
    exact = point_sink(np.append(r, 0.0), SPEED, float(CROWD.rho), CROWD.k_v)
    words = Words(
        __name__,
        **{"proposed": proposed, "complementarity": complementarity, "printed": printed},
        **{"fit": fit, "close": gaussian(p, FAR), "unsettled": unsettled},
        explained=explained(p, exact[:-1]),
    )
    warnings = unsolved(
        [("(11)", proposed.solution), *((f"(20), {e}", f.solution) for e, f in first_order.items())]
    )
    if abs(unsettled) > SETTLED:
        warnings.append(words.text("unsettled"))
    return words.section(
        "9",
        pictures={
            "fig_9_maps": maps(p, complementarity.pressure, printed.pressure),
            "fig_9_profile": profiles(p, complementarity.pressure, fit.values, exact[:-1]),
            "fig_9_raw_maximum": raw_maximum(raw),
        },
        tables={
            "pressures": [_row(field) for field in (proposed, *first_order.values())],
            "maxima": [[kind, *row] for kind, rows in raw.items() for row in rows],
        },
        claims=verdicts(proposed, complementarity, printed),
        warnings=warnings,
    )


def verdicts(proposed: Field, *both: Field) -> dict[str, Verdict]:
    """Judge what the paper says of Fig. 9; both: (20) as complementarity and as printed."""
    concentrated = proposed.band(0.0, NEAR) > 2 * proposed.band(FAR) and proposed.from_exit < NEAR
    fits = (gaussian(proposed.pressure, within).explained for within in (np.inf, FAR))
    return {
        "gaussian": Verdict.of(*(fit > GAUSSIAN for fit in fits)),
        "concentrated": Verdict.of(concentrated),
        "minimal": Verdict.of(*(f.at_exit < MINIMAL and f.from_exit > AT_EXIT for f in both)),
        "fastest": Verdict.of(*(f.speeds[0] > f.speeds[1] for f in both)),
    }


def _row(field: Field) -> list[Cell]:
    means = [float(field.pressure.min()), field.band(0.0, NEAR), field.band(FAR)]
    a = field.solution
    return [field.name, field.largest, field.from_exit, *means, a.residual, str(a.status)]
