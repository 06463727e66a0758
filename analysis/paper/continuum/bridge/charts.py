"""Pictures of the bridge: trends with N, pressure against the distance from the exit, maps of the
pressure."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.pages.drawing import BLACK, BLUE, GREEN, GREY, LINES, MARKERS, ORANGE, PINK, SHADES
from analysis.paper.continuum.bridge.crowd import (
    HALF_DOOR,
    SPACING,
    WITHIN,
    Packing,
    points,
)
from analysis.paper.continuum.bridge.study import Size
from analysis.paper.continuum.exit_room import to_exit
from nscd.arrays import Floats

COLOURS = {Packing.TOUCHING: ORANGE, Packing.NEAR: GREEN, Packing.PRESSED: BLUE}
BAND = 0.5  # m


def trends(sizes: Sequence[Size]) -> Figure:
    """Against N: kinetic energy kept; distance of the pressure from (20), without and with
    friction; the part of Σ that is no pressure."""
    figure = Figure(figsize=(10.0, 7.4), layout="constrained")
    (kept, deviator), (smooth, rough) = figure.subplots(2, 2)
    last = sizes[-1]
    models = last.models
    _trend(kept, sizes, lambda size: size.kept)
    _trend(deviator, sizes, lambda size: size.deviator)
    _trend(smooth, sizes, lambda size: size.pressure_distance(size.models.first_order))
    _trend(rough, sizes, lambda size: size.pressure_distance(size.rough))
    _across(
        kept,
        [
            (m.name, m.kept)
            for m in (models.unhindered, models.first_order, last.rough, models.blocked)
        ],
    )
    _across(kept, [("(11), Table 1", models.table.kept)])
    _across(
        smooth,
        [(m.name, last.pressure_gap(m)) for m in (models.unhindered, models.blocked, last.rough)],
    )
    kept.set(ylim=(-0.05, 1.06), ylabel="kinetic energy kept")
    deviator.set(ylim=(0, None), ylabel="no pressure: ‖Σ + p1‖ / ‖Σ‖")
    smooth.set(ylim=(0, 1.06), ylabel="distance of p from (20)")
    rough.set(ylim=(0, 1.06), ylabel="distance of p from (20), best friction")
    handles, labels = kept.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=9)
    return figure


def _across(axes: Axes, levels: Sequence[tuple[str, float]]) -> None:
    """Lines across the axes, named beside them, where no data can be."""
    for words, value in levels:
        axes.axhline(value, color=BLACK, lw=0.8, ls=LINES[3])
        axes.annotate(
            words, (1.01, value), xycoords=("axes fraction", "data"), fontsize=8, va="center"
        )


def _trend(axes: Axes, sizes: Sequence[Size], number: Callable[[Size], Floats]) -> None:
    for place, packing in enumerate(dict.fromkeys(size.packing for size in sizes)):
        same = [size for size in sizes if size.packing == packing]
        values = [number(size) for size in same]
        error = [v.std(ddof=1) / np.sqrt(len(v)) if len(v) > 1 else 0.0 for v in values]
        axes.errorbar(
            [size.n for size in same],
            [v.mean() for v in values],
            yerr=error,
            color=COLOURS[packing],
            marker=MARKERS[place],
            ls=LINES[place],
            capsize=3,
            label=str(packing),
        )
    axes.set(xscale="log", xlabel="disks N in the same room")
    axes.margins(x=0.08)


def profiles(sizes: Sequence[Size]) -> Figure:
    """Mean pressure in bands of the distance from the exit, one panel a packing, with the continuum
    models."""
    kinds = list(dict.fromkeys(size.packing for size in sizes))
    figure = Figure(figsize=(11.0, 4.5), layout="constrained")
    panels = np.atleast_1d(figure.subplots(1, len(kinds), sharey=True))
    for axes, packing in zip(panels, kinds, strict=True):
        same = [size for size in sizes if size.packing == packing]
        shades = np.linspace(0.65, 0.0, len(same))
        for number, size in enumerate(same):
            mean = np.mean([s.stress.pressure for s in size.samples], axis=0)
            axes.plot(
                *_banded(mean),
                marker=MARKERS[number % len(MARKERS)],
                ms=4,
                lw=1,
                color=str(shades[number]),
                label=f"{size.n:,} disks",
            )
        models = same[-1].models
        for model, style, colour, words in (
            (models.first_order, "--", BLUE, "(20)"),
            (models.blocked, "-.", BLACK, "nobody moves"),
            (same[-1].rough, (0, (8, 2)), PINK, "(20), friction fitted to the largest N"),
            (models.table, ":", ORANGE, "(11), Table 1"),
            (same[-1].best, (0, (4, 1, 1, 1, 1, 1)), GREEN, "(11), $k_v$ fitted to the largest N"),
        ):
            axes.plot(*_banded(model.pressure), ls=style, lw=2, color=colour, label=words)
        axes.set(xlabel="distance from the exit (m)", title=str(packing), xlim=(0, WITHIN))
        axes.set_ylim(bottom=0)
    panels[0].set_ylabel("coarse-grained pressure (N·s/m)")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=8)
    return figure


def _banded(values: Floats) -> tuple[Floats, Floats]:
    """Middles of the bands (m) and the mean in each."""
    band = (to_exit(points()) / BAND).astype(np.int64)
    count = np.bincount(band)
    mean: Floats = np.bincount(band, values) / count
    middle: Floats = (np.arange(len(count), dtype=np.float64) + 0.5) * BAND
    return middle, mean


def pressure_maps(sizes: Sequence[Size]) -> Figure:
    """Pressure of one crowd of the smallest and of the largest N of each packing, and of continuum
    models."""
    kinds = list(dict.fromkeys(size.packing for size in sizes))
    shown: list[tuple[str, Floats]] = []
    for pick in (0, -1):
        for packing in kinds:
            size = [s for s in sizes if s.packing == packing][pick]
            shown.append((f"{packing}, N = {size.n:,}", size.samples[0].stress.pressure))
    last = sizes[-1]
    models = (last.models.first_order, last.rough, last.best)
    shown += [(model.name, model.pressure) for model in models[: len(kinds)]]
    figure = Figure(figsize=(9.5, 12.0), layout="constrained")
    panels = figure.subplots(3, len(kinds), squeeze=False, sharex=True, sharey=True).ravel()
    top = float(last.models.blocked.pressure.max())
    levels = np.linspace(0.0, np.ceil(top / 500) * 500, 13)
    x, y = np.unique(points()[:, 0]), np.unique(points()[:, 1])
    rows, columns = np.searchsorted(y, points()[:, 1]), np.searchsorted(x, points()[:, 0])
    for axes, (words, pressure) in zip(panels, shown, strict=True):
        grid = np.full((len(y), len(x)), np.nan)
        grid[rows, columns] = np.maximum(pressure, 0.0)
        drawn = axes.contourf(x, y, grid, levels=levels, cmap=SHADES, extend="max")
        axes.contour(x, y, grid, levels=levels[::2], colors="white", linewidths=0.4)
        for side in (-1, 1):
            axes.plot([0, 0], [side * HALF_DOOR, side * (WITHIN + HALF_DOOR)], color=BLACK, lw=2)
        axes.set_title(words.replace("k_v", "$k_v$"), fontsize=9)
        axes.set(aspect="equal", xlim=(-WITHIN, 3 * SPACING), facecolor=GREY)
    for axes in panels[-len(kinds) :]:
        axes.set_xlabel("x (m)")
    for axes in panels[:: len(kinds)]:
        axes.set_ylabel("y (m)")
    figure.colorbar(drawn, ax=panels.tolist(), label="pressure (N·s/m)", shrink=0.5)
    return figure
