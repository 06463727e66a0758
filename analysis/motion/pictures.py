"""Pictures of crowds in motion: people, walls and forces, model by model."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.motion.ensemble import Ensemble
from analysis.motion.series import Series
from analysis.pages.drawing import COLOURS, GRID, LINES, NARROW_IN
from nscd.arrays import Floats


def motion_picture(ensembles: Sequence[Ensemble], *, narrow: bool = False) -> Figure:
    """Draw people through the door and load on the walls against time, and how forces are spread:
    the median of the crowds and, as a band, where nine in ten of them are; for a telephone below
    each other."""
    size = (NARROW_IN, 9.0) if narrow else (11.0, 3.6)
    figure = Figure(figsize=size, layout="constrained")
    people, walls, spread = figure.subplots(*((3, 1) if narrow else (1, 3)))
    _bands(people, ensembles, lambda series: series.evacuated)
    people.set(xlabel="time (s)", ylabel="people through the door", title="flow")
    _bands(walls, ensembles, lambda series: 1e-3 * series.values["walls"])
    walls.set(xlabel="time (s)", ylabel="load on all walls (kN)", title="load on walls")
    for number, ensemble in enumerate(ensembles):
        share, force = _exceedance(ensemble)
        spread.semilogy(force, share, LINES[number % 4], color=COLOURS[number % 4])
    spread.set(
        xlabel="contact force / mean contact force",
        ylabel="share of contacts above",
        title="spread of forces",
        ylim=(1e-4, 1.5),
    )
    for axes in (people, walls, spread):
        axes.grid(color=GRID)
    figure.legend(
        *people.get_legend_handles_labels(),
        loc="outside lower center",
        ncols=1 if narrow else 3,
        fontsize=8,
    )
    return figure


def _bands(axes: Axes, ensembles: Sequence[Ensemble], of: Callable[[Series], Floats]) -> None:
    for number, ensemble in enumerate(ensembles):
        colour, line = COLOURS[number % 4], LINES[number % 4]
        values = np.stack([of(series) for series in ensemble.series])
        time = ensemble.series[0].time
        low, middle, high = np.quantile(values, [0.05, 0.5, 0.95], axis=0)
        axes.fill_between(time, low, high, color=colour, alpha=0.15, linewidth=0)
        axes.plot(time, middle, line, color=colour, label=ensemble.title)
    axes.set_ylim(bottom=0)


def _exceedance(ensemble: Ensemble) -> tuple[Floats, Floats]:
    """The share of contact forces of all windows that count above a multiple of their mean."""
    forces = np.concatenate(
        [
            force
            for series in ensemble.series
            for force, counts in zip(series.forces, series.last(ensemble.last_s), strict=True)
            if counts
        ]
        or [np.ones(1)]
    )
    share = np.geomspace(1.0, 1e-4, 60)
    return share, np.quantile(forces / forces.mean(), 1 - share)
