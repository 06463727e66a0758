"""Pictures of work against precision: numerical error, model error and both together, and cost
against size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from analysis.pages.drawing import (
    BLACK,
    BLUE,
    DARK_GREY,
    GREEN,
    GREY,
    GRID,
    ORANGE,
    PINK,
    SKY,
    VERMILION,
    YELLOW,
)
from analysis.pages.numbers import number
from analysis.work_precision.pareto import pareto_front
from analysis.work_precision.point import Point, PointStatus
from analysis.work_precision.window import Quantity

# Edges of what is too light for a thin line.
DARK = {GREY: DARK_GREY, YELLOW: "#6B6100"}
# Errors outside of this are drawn at its ends: above 1000 % is no answer, below 1e-13 is rounding.
LOWEST, HIGHEST = 1e-13, 10.0
WHOLE = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """How a method is drawn: label, colour, marker (a letter, or corners, 1 for a star, turn),
    line, marker size in points."""

    label: str
    colour: str
    marker: str | tuple[int, Literal[1], int]
    line: str
    size: float = 5.5

    @property
    def edge(self) -> str:
        """Colour of lines and edges."""
        return DARK.get(self.colour, self.colour)


LOOKS = {
    "lammps_hooke": Look(label="LAMMPS, linear", colour=BLUE, marker="o", line="-"),
    "lammps_hertz": Look(label="LAMMPS, Hertz", colour=ORANGE, marker="s", line="--"),
    "yade_hooke": Look(label="YADE, linear", colour=GREEN, marker="D", line=":"),
    "rigid_auto": Look(label="rigid, the product's choice", colour=BLACK, marker="^", line="-"),
    "rigid_interior_point": Look(
        label="rigid, interior point", colour=VERMILION, marker="v", line="--"
    ),
    "rigid_active_set": Look(label="rigid, active set", colour=PINK, marker="<", line="-."),
    "rigid_projected_gradient": Look(
        label="rigid, projected gradient", colour=SKY, marker=">", line=":"
    ),
    "rigid_gauss_seidel": Look(label="rigid, Gauss–Seidel", colour=GREY, marker="p", line="-"),
    "continuum_deformable": Look(
        label="continuum (11), deformable", colour=YELLOW, marker=(4, 1, 0), line="-", size=9
    ),
    "continuum_first_order": Look(
        label="continuum (20), first order", colour=YELLOW, marker=(6, 1, 0), line="--", size=9
    ),
    "first_order": Look(label="first-order model", colour=BLACK, marker="*", line="", size=9),
    "social_force": Look(label="social force", colour=VERMILION, marker="P", line="", size=9),
    "loehner_printed": Look(label="Löhner, as printed", colour=PINK, marker="X", line="", size=9),
    "loehner_text": Look(label="Löhner, cases exchanged", colour=SKY, marker="h", line="", size=9),
}


def look_of(point: Point) -> Look:
    """How a point's method is drawn; one that is not known here gets a plain look and its own
    name."""
    return LOOKS.get(point.key, Look(label=point.key, colour=GREY, marker="d", line="-"))


def work_precision_picture(points: Sequence[Point], quantity: Quantity, title: str) -> Figure:
    """Three panels for one quantity: numerical error against CPU time, model error against
    stiffness, and both together (their sum) against CPU time with the Pareto fronts. A cross: no
    answer, or one that is wrong by more than 100 %."""
    chosen = [p for p in points if p.quantity == quantity.name]
    figure = Figure(figsize=(15, 6.4), layout="constrained")
    numerical, model, total = figure.subplots(1, 3)
    _draw_cost(numerical, chosen, "numerical_error")
    numerical.set_ylabel("numerical error: from the method's own model")
    _draw_model(model, chosen)
    _draw_cost(total, chosen, "error_sum")
    total.set_ylabel("both errors together: from the rigid reference")
    limits = total.get_xlim()
    for some, colour, line in ((chosen, BLACK, "-"), (_soft(chosen), DARK_GREY, (0, (4, 2)))):
        front = pareto_front(some)
        if front:
            x, y = [_cost(p) for p in front], [_clipped(p.error_sum) for p in front]
            total.step(
                [*x, limits[1]], [*y, y[-1]], where="post", color=colour, lw=1.2, ls=line, zorder=1
            )
    total.set_xlim(limits)
    figure.suptitle(
        f"{title}: {quantity.words}; errors are rms, relative to the rigid rms", fontsize=12
    )
    figure.legend(handles=_handles(chosen), loc="outside lower center", ncols=5, frameon=False)
    return figure


def _draw_cost(axes: Axes, points: Sequence[Point], error: str) -> None:
    """One curve a method and stiffness; the stiffer, the darker."""
    curves: dict[tuple[str, float], list[Point]] = {}
    for point in points:
        if point.cpu_seconds is not None and (
            error == "error_sum" or point.numerical_bar is not None
        ):
            curves.setdefault((point.key, point.stiffness_N_per_m or 0.0), []).append(point)
    bars = [p.numerical_bar for p in points if p.numerical_bar and p.stiffness_N_per_m]
    softest, stiffest = _range(points)
    for (_, stiffness), curve in curves.items():
        look = look_of(curve[0])
        shade = _shade(look.colour, stiffness, softest, stiffest)
        sound = [p for p in curve if p.status == PointStatus.OK and getattr(p, error) is not None]
        # along the setting, not along the cost, so that a curve that turns back is seen
        sound.sort(key=lambda p: p.time_step_share or p.tolerance or p.mesh_side_m or 0.0)
        x, y = [_cost(p) for p in sound], [_clipped(getattr(p, error)) for p in sound]
        axes.plot(
            x, y, ls=look.line or "none", lw=0.8, color=look.edge, marker=look.marker, ms=look.size,
            mfc=shade, mec=look.edge, mew=0.8, zorder=3,
        )  # fmt: skip
        if error == "numerical_error" and curve[0].mesh_side_m is not None:
            # each continuum model has a bar of its own
            bar = [
                min(p.numerical_bar or 0.0, 0.9 * value) for p, value in zip(sound, y, strict=True)
            ]
            axes.errorbar(
                x, y, yerr=bar, ls="none", ecolor=look.edge, elinewidth=0.8, capsize=2, zorder=2
            )
        for point in curve:
            if point.status != PointStatus.OK:
                value = getattr(point, error)
                height = HIGHEST if value is None else _clipped(value)
                axes.plot(
                    _cost(point),
                    height,
                    marker="x",
                    ms=6,
                    mew=1.2,
                    color=look.edge,
                    zorder=4,
                    clip_on=False,
                )
    if bars and error == "numerical_error":
        axes.axhline(max(bars), color=BLACK, lw=0.8, ls=(0, (1, 3)), zorder=1)
    axes.axhline(WHOLE, color=GREY, lw=0.8, ls="--", zorder=0)
    axes.set(xscale="log", yscale="log", xlabel="CPU time (s)")
    low = min(
        (_clipped(getattr(p, error)) for p in points if getattr(p, error) is not None), default=1e-6
    )
    axes.set_ylim(0.3 * low, HIGHEST)
    _tidy(axes)


def _draw_model(axes: Axes, points: Sequence[Point]) -> None:
    """The converged model against the rigid reference: over stiffness, with the error bars; rivals
    as levels."""
    drawn: dict[str, dict[float, tuple[float, float]]] = {}
    levels: dict[str, Point] = {}
    for point in points:
        if point.model_error is None or point.method == "rigid":
            continue
        if point.stiffness_N_per_m is None:
            levels[point.key] = point
        else:
            drawn.setdefault(point.key, {})[point.stiffness_N_per_m] = (
                point.model_error,
                point.model_bar or 0.0,
            )
    for key, curve in drawn.items():
        look = LOOKS[key]
        x = np.array(sorted(curve))
        y = np.array([max(curve[k][0], LOWEST) for k in x])
        bar = np.array([min(curve[k][1], 0.99 * max(curve[k][0], LOWEST)) for k in x])
        # YADE and LAMMPS share the linear law: the smaller marker shows that the larger one is
        # below
        size = 4 if look.marker == "D" else 8
        axes.errorbar(
            x, y, yerr=bar, ls=look.line, color=look.edge, marker=look.marker, ms=size, mfc="white", mew=1.2, capsize=3,
        )  # fmt: skip
    shown = [p for p in levels.values() if p.model_error is not None and p.model_error > LOWEST]
    for place, point in enumerate(shown):
        look, value = look_of(point), point.model_error or 0.0
        axes.axhline(value, color=look.edge, lw=1, ls=(0, (5, 3)), zorder=1)
        # side by side, since some have nearly the same
        axes.errorbar(
            [0.97 - 0.06 * place], [value], yerr=min(point.model_bar or 0.0, 0.9 * value), capsize=3,
            transform=axes.get_yaxis_transform(), marker=look.marker, color=look.colour, mec=look.edge, ecolor=look.edge, ms=9,
        )  # fmt: skip
    axes.axhline(WHOLE, color=GREY, lw=0.8, ls="--", zorder=0)
    axes.set(xscale="log", yscale="log", xlabel="contact stiffness k (N/m)")
    if not drawn:
        # no engine is there: levels alone
        axes.set(xlim=(1.0, 10.0), xlabel="no soft contacts")
    axes.set_ylabel("model error: converged model from the rigid reference")
    values = [v for curve in drawn.values() for v, _ in curve.values()]
    values += [p.model_error or 0.0 for p in shown]
    if values:
        axes.set_ylim(10 ** np.floor(np.log10(min(values)) - 0.3), max(2.0, 2 * max(values)))
    _tidy(axes)


def scaling_picture(points: Sequence[Point], accuracy: float) -> Figure:
    """CPU time against the number of disks, one curve a method, each at its cheapest setting within
    the accuracy."""
    figure = Figure(figsize=(8, 5.6), layout="constrained")
    axes = figure.subplots()
    for key in dict.fromkeys(p.key for p in points):
        curve = sorted((p for p in points if p.key == key), key=lambda p: p.disks)
        look = look_of(curve[0])
        axes.plot(
            [p.disks for p in curve], [_cost(p) for p in curve], ls=look.line or ":", lw=1, color=look.edge,
            mfc=look.colour, marker=look.marker, ms=max(7, look.size), label=look.label,
        )  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="disks", ylabel="CPU time (s)")
    axes.set_title(
        f"cheapest setting with a numerical error of at most {100 * accuracy:g} %", fontsize=11
    )
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    _tidy(axes)
    sizes = sorted({p.disks for p in points})
    axes.set_xticks(sizes, [str(size) for size in sizes])
    axes.xaxis.set_minor_formatter(NullFormatter())
    return figure


def _handles(points: Sequence[Point]) -> list[Line2D]:
    present = dict.fromkeys(p.key for p in points)
    looks = [look for key, look in LOOKS.items() if key in present]
    looks += [
        look_of(next(p for p in points if p.key == key)) for key in present if key not in LOOKS
    ]
    handles = [
        Line2D(
            [], [], color=look.edge, mfc=look.colour, marker=look.marker, ms=max(6, look.size), ls=look.line or "none", lw=1,
            label=look.label,
        )
        for look in looks
    ]  # fmt: skip
    softest, stiffest = _range(points)
    if stiffest > softest:
        for stiffness in (softest, stiffest):
            shade = _shade(BLUE, stiffness, softest, stiffest)
            handles.append(
                Line2D(
                    [],
                    [],
                    color=BLUE,
                    marker="o",
                    mfc=shade,
                    ls="none",
                    label=f"fill: k = {number(stiffness)} N/m",
                )
            )
    handles.append(
        Line2D(
            [],
            [],
            color=BLACK,
            marker="x",
            ls="none",
            label="no answer, or wrong by more than 100 %",
        )
    )
    if stiffest > softest:
        handles.append(
            Line2D(
                [],
                [],
                color=BLACK,
                lw=0.8,
                ls=(0, (1, 3)),
                label="error bar of the soft references",
            )
        )
        handles.append(
            Line2D(
                [],
                [],
                color=DARK_GREY,
                lw=1.2,
                ls=(0, (4, 2)),
                label="Pareto front of soft contacts",
            )
        )
    handles.append(Line2D([], [], color=BLACK, lw=1.2, label="Pareto front of all methods"))
    return handles


def _soft(points: Sequence[Point]) -> list[Point]:
    return [p for p in points if p.stiffness_N_per_m is not None]


def _range(points: Sequence[Point]) -> tuple[float, float]:
    known = [p.stiffness_N_per_m for p in points if p.stiffness_N_per_m]
    return (min(known), max(known)) if known else (1.0, 1.0)


def _shade(
    colour: str, stiffness: float, softest: float, stiffest: float
) -> tuple[float, float, float]:
    """From white (softest) to the colour (stiffest, or no stiffness)."""
    share = 1.0
    if stiffness and stiffest > softest:
        share = float(np.log(stiffness / softest) / np.log(stiffest / softest))
    red, green, blue = (1 - share * (1 - part) for part in to_rgb(colour))
    return red, green, blue


def _clipped(value: float | None) -> float:
    return float(
        np.clip(np.nan_to_num(value if value is not None else np.inf, nan=HIGHEST), LOWEST, HIGHEST)
    )


def _cost(point: Point) -> float:
    """CPU seconds; NaN, which is not drawn, where they are not known."""
    return float("nan") if point.cpu_seconds is None else point.cpu_seconds


def _tidy(axes: Axes) -> None:
    axes.grid(True, which="major", color=GRID, lw=0.6)
    axes.set_axisbelow(True)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(numticks=9))
        axis.set_minor_formatter(NullFormatter())
