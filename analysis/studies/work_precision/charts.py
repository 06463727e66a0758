"""Pictures of a chart: error against cost, and cost against size."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from analysis.pages import drawing
from analysis.studies.work_precision.point import Point, PointStatus, front, pareto_front
from analysis.studies.work_precision.window import Quantity
from nscd.arrays import Floats

# Edges of what is too light for a thin line.
DARK = {drawing.GREY: drawing.DARK_GREY, drawing.YELLOW: drawing.DARK_YELLOW}
# Least distance of two labels at the side of a panel, as a share of its height.
APART = 0.05


@dataclass(frozen=True, slots=True)
class CurveStyle:
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


CURVE_STYLES = {
    "lammps_hooke": CurveStyle("LAMMPS, linear", drawing.BLUE, "o", "-"),
    "lammps_hertz": CurveStyle("LAMMPS, Hertz", drawing.ORANGE, "s", "--"),
    "yade_hooke": CurveStyle("YADE, linear", drawing.GREEN, "D", ":"),
    "rigid_auto": CurveStyle("rigid, the product's choice", drawing.BLACK, "^", "-"),
    "rigid_interior_point": CurveStyle("rigid, interior point", drawing.VERMILION, "v", "--"),
    "rigid_active_set": CurveStyle("rigid, active set", drawing.PINK, "<", "-."),
    "rigid_projected_gradient": CurveStyle("rigid, projected gradient", drawing.SKY, ">", ":"),
    "rigid_gauss_seidel": CurveStyle("rigid, Gauss–Seidel", drawing.GREY, "p", "-"),
    "continuum_deformable": CurveStyle("continuum (11), deformable", drawing.YELLOW, (4, 1, 0), "-", 9),
    "continuum_first_order": CurveStyle(
        "continuum (20), first order", drawing.YELLOW, (6, 1, 0), "--", 9
    ),
    "first_order": CurveStyle("first-order model", drawing.BLACK, "*", "", 9),
    "social_force": CurveStyle("social force", drawing.VERMILION, "P", "", 9),
    "loehner_printed": CurveStyle("Löhner, as printed", drawing.PINK, "X", "", 9),
    "loehner_text": CurveStyle("Löhner, cases exchanged", drawing.SKY, "h", "", 9),
}


def style_of(point: Point) -> CurveStyle:
    """Choose how a point's method is drawn; one that is not known here gets a plain look and its
    own name."""
    return CURVE_STYLES.get(point.key, CurveStyle(point.key, drawing.GREY, "d", "-"))


# The name of a curve: x and y where it ends, words, colour.
Label = tuple[float, float, str, str]


def label_curves(axes: Axes, labels: Iterable[Label]) -> None:
    """Write the names of curves at the right side of a panel, each led to the end of its curve."""
    found = sorted(labels, key=lambda label: label[1])
    low, high = np.log(axes.get_ylim())
    ends = (np.log([y for _, y, *_ in found]) - low) / (high - low)
    for (x, y, words, colour), height in zip(found, spread(ends, APART), strict=True):
        beside = {"fontsize": 9, "va": "center", "annotation_clip": False}
        drawing.lead(axes, words, (x, y), (1.03, height), colour, **beside)


def spread(positions: Floats, difference: float) -> Floats:
    """Move rising places (k,) within 0 and 1 so far that all are `difference`, up first; what would be
    beyond 1 comes down again."""
    found = np.clip(positions, 0.0, 1.0)
    for i in range(1, len(found)):
        found[i] = max(found[i], found[i - 1] + difference)
    for i in reversed(range(len(found))):
        found[i] = min(found[i], 1.0 - difference * (len(found) - 1 - i))
    return found


def tidy(axes: Axes) -> None:
    """Give logarithmic axes a quiet grid and few ticks."""
    axes.grid(True, which="major", color=drawing.GRID, lw=0.6)
    axes.set_axisbelow(True)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(numticks=9))
        axis.set_minor_formatter(NullFormatter())


# Errors outside of this are drawn at its ends: above 1000 % is no answer, below 1e-13 is rounding.
LOWEST, HIGHEST = 1e-13, 10.0
WHOLE = 1.0
DOTS, DASHES = (0, (1, 3)), (0, (4, 2))
Error = Callable[[Point], float | None]
_numerical: Error = attrgetter("numerical_error")
_sum: Error = attrgetter("error_sum")


def total_picture(points: Sequence[Point], quantity: Quantity) -> Figure:
    """Draw the sum of both errors of one quantity against CPU time, with the Pareto fronts."""
    figure, (axes,) = drawing.panels(7.0, 4.6)
    _draw_total(axes, [p for p in points if p.quantity == quantity.name])
    return figure


def _draw_total(axes: Axes, points: Sequence[Point]) -> None:
    _draw_cost(axes, points, _sum)
    _draw_fronts(axes, points)
    axes.set_ylabel("sum of both errors")


def work_precision_picture(points: Sequence[Point], quantity: Quantity, title: str) -> Figure:
    """Draw three panels for one quantity: numerical error against CPU time, model error against
    stiffness, and both together (their sum) against CPU time with the Pareto fronts. A cross: no
    answer, or one that is wrong by more than 100 %."""
    chosen = [p for p in points if p.quantity == quantity.name]
    figure, (numerical, model, total) = drawing.panels(17, 6, 1, 3)
    _draw_cost(numerical, [p for p in chosen if p.numerical_bar is not None], _numerical)
    numerical.set_title("Numerical error: what a finer setting buys")
    numerical.set_ylabel("error from the method's own model")
    bars = [p.numerical_bar for p in chosen if p.numerical_bar and p.stiffness_N_per_m]
    if bars:
        numerical.axhline(max(bars), color=drawing.BLACK, lw=0.8, ls=DOTS, zorder=1)
    _draw_model(model, chosen)
    model.set_title("Model error: what no finer setting helps against")
    model.set_ylabel("error of the converged model, from the rigid one")
    _draw_total(total, chosen)
    total.set_title("Both together: what accuracy costs")
    figure.suptitle(f"{title}: {quantity.words} (errors: rms over the rigid rms)", fontsize=12)
    handles = _handles(bool(bars))
    figure.legend(handles=handles, loc="outside lower center", ncols=6, frameon=False)
    return figure


def _draw_cost(axes: Axes, points: Sequence[Point], error: Error) -> None:
    """Draw every setting as a small dot and, of each method, the settings that no cheaper one
    beats as a curve with its name."""
    labels = []
    for curve in _by_method([p for p in points if p.cpu_seconds is not None]):
        style = style_of(curve[0])
        valid = [p for p in curve if p.status == PointStatus.OK and error(p) is not None]
        x, y = [_cost(p) for p in valid], [_clipped(error(p)) for p in valid]
        axes.plot(x, y, ls="none", marker=".", ms=4, color=style.edge, alpha=0.35, zorder=2)
        best = front(valid, _cost, error)
        x, y = [_cost(p) for p in best], [_clipped(error(p)) for p in best]
        axes.plot(
            x, y, ls=style.line or "none", lw=1.2, color=style.edge, marker=style.marker,
            ms=style.size, mfc=style.colour, mec=style.edge, mew=0.8, zorder=3,
        )  # fmt: skip
        if best:
            labels.append((x[-1], y[-1], style.label, style.edge))
        if curve[0].mesh_side_m is not None and error is _numerical:
            # each continuum model has a bar of its own
            bar = [min(p.numerical_bar or 0.0, 0.9 * v) for p, v in zip(best, y, strict=True)]
            axes.errorbar(x, y, yerr=bar, ls="none", ecolor=style.edge, elinewidth=0.8, capsize=2)
        for point in curve:
            if point.status != PointStatus.OK:
                axes.plot(
                    _cost(point), _clipped(error(point)), marker="x", ms=6, mew=1.2,
                    color=style.edge, zorder=4, clip_on=False,
                )  # fmt: skip
    axes.axhline(WHOLE, color=drawing.GREY, lw=0.8, ls="--", zorder=0)
    drawing.label(axes, "CPU time (s)", log="xy")
    finite = [_clipped(value) for p in points if (value := error(p)) is not None]
    axes.set_ylim(0.3 * min(finite, default=1e-6), HIGHEST)
    label_curves(axes, labels)
    tidy(axes)


def _draw_fronts(axes: Axes, points: Sequence[Point]) -> None:
    limits = axes.get_xlim()
    soft = [p for p in points if p.stiffness_N_per_m is not None]
    for some, colour, line in ((points, drawing.BLACK, "-"), (soft, drawing.DARK_GREY, DASHES)):
        if best := pareto_front(some):
            x = [*(_cost(p) for p in best), limits[1]]
            y = [_clipped(p.error_sum) for p in best]
            axes.step(x, [*y, y[-1]], where="post", color=colour, lw=0.8, ls=line, zorder=1)
    axes.set_xlim(limits)


def _draw_model(axes: Axes, points: Sequence[Point]) -> None:
    """Draw the converged model against the rigid reference: over stiffness, with the error bars;
    rivals as levels."""
    labels, heights = [], []
    for curve in _by_method(points):
        style = style_of(curve[0])
        converged = [p for p in curve if p.method != "rigid" and (p.model_error or 0.0) > LOWEST]
        by_stiffness = {p.stiffness_N_per_m: p for p in converged}
        if not by_stiffness:
            continue
        if None in by_stiffness:
            error = by_stiffness[None].model_error or 0.0
            bar = min(by_stiffness[None].model_bar or 0.0, 0.9 * error)
            axes.axhline(error, color=style.edge, lw=1, ls=DASHES, zorder=1)
            axes.axhspan(error - bar, error + bar, color=style.colour, alpha=0.15, lw=0)
            labels.append((error, style))
            heights.append(error)
            continue
        x = sorted(k for k in by_stiffness if k is not None)
        y = [by_stiffness[k].model_error or 0.0 for k in x]
        bars = [min(by_stiffness[k].model_bar or 0.0, 0.99 * v) for k, v in zip(x, y, strict=True)]
        # YADE and LAMMPS share the linear law: the smaller marker shows that the larger is below
        axes.errorbar(
            x, y, yerr=bars, ls=style.line, color=style.edge, marker=style.marker,
            ms=4 if style.marker == "D" else 8, mfc="white", mew=1.2, capsize=3,
        )  # fmt: skip
        labels.append((y[-1], style))
        heights += y
    axes.axhline(WHOLE, color=drawing.GREY, lw=0.8, ls="--", zorder=0)
    drawing.label(axes, "contact stiffness k (N/m)", log="xy")
    if not any(p.stiffness_N_per_m for p in points):
        # no engine is there: levels alone
        axes.set(xlim=(1.0, 10.0), xlabel="no soft contacts")
    if heights:
        low = 10 ** np.floor(np.log10(min(heights)) - 0.3)
        axes.set_ylim(low, max(2.0, 2 * max(heights)))
    end = axes.get_xlim()[1]
    label_curves(axes, [(end, error, appearance.label, appearance.edge) for error, appearance in labels])
    tidy(axes)


def scaling_picture(points: Sequence[Point], accuracy: float) -> Figure:
    """Draw CPU time against the number of disks, one curve per method, each at its cheapest setting
    within the accuracy."""
    figure, (axes,) = drawing.panels(8, 5.2)
    labels = []
    for points_of_one in _by_method(points):
        curve = sorted(points_of_one, key=lambda p: p.disks)
        style = style_of(curve[0])
        x, y = [p.disks for p in curve], [_cost(p) for p in curve]
        axes.plot(
            x, y, ls=style.line or ":", lw=1, color=style.edge, mfc=style.colour,
            marker=style.marker, ms=max(7, style.size),
        )  # fmt: skip
        labels.append((x[-1], y[-1], style.label, style.edge))
    title = f"cheapest setting with a numerical error of at most {100 * accuracy:g} %"
    drawing.label(axes, "disks", "CPU time (s)", title, log="xy")
    tidy(axes)
    drawing.ticks_at(axes, sorted({p.disks for p in points}))
    label_curves(axes, labels)
    return figure


def _handles(bars: bool) -> list[Line2D]:
    handles = [
        Line2D([], [], color=drawing.DARK_GREY, marker=".", ls="none", label="other settings"),
        Line2D(
            [],
            [],
            color=drawing.BLACK,
            marker="x",
            ls="none",
            label="no answer, or wrong by > 100 %",
        ),
        Line2D([], [], color=drawing.BLACK, lw=0.8, label="Pareto front of all methods"),
    ]
    if bars:
        soft, bar = "Pareto front of soft contacts", "error bar of soft references"
        handles.append(Line2D([], [], color=drawing.DARK_GREY, lw=0.8, ls=DASHES, label=soft))
        handles.append(Line2D([], [], color=drawing.BLACK, lw=0.8, ls=DOTS, label=bar))
    return handles


def _by_method(points: Sequence[Point]) -> Iterator[list[Point]]:
    """The points of each method (and law, solver), in the order of their first."""
    for key in dict.fromkeys(p.key for p in points):
        yield [p for p in points if p.key == key]


def _clipped(value: float | None) -> float:
    """Between LOWEST and HIGHEST, which also stands for no value."""
    shown = HIGHEST if value is None or np.isnan(value) else value
    return float(np.clip(shown, LOWEST, HIGHEST))


def _cost(point: Point) -> float:
    """CPU seconds; NaN, which is not drawn, where they are not known."""
    return float("nan") if point.cpu_seconds is None else point.cpu_seconds
