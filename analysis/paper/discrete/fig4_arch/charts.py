"""Pictures of the arch: against the dissipation, over random arches, against their size."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.pages.drawing import BLACK, BLUE, GREY, ORANGE
from analysis.paper.discrete.fig4_arch.dissipation import EFFECTIVE_MASS, Trial
from analysis.paper.discrete.fig4_arch.random_crowds import Sample
from analysis.paper.discrete.pressed_crowd.arch import NEIGHBOURHOOD_M, RING_M

BIN_M = 0.5


def dissipation(trials: Sequence[Trial]) -> Figure:
    """Draw percussions and reactions against the dissipation k: along and across, along only."""
    figure = Figure(figsize=(10.5, 4.2), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    ticks = [0, 1, 10, 100, 1e3, 1e4]
    for axis, across in zip(axes, (True, False), strict=True):
        _forces(axis, [trial for trial in trials if trial.across == across])
        axis.axvline(EFFECTIVE_MASS, color=GREY, lw=1)
        at = {"xycoords": ("data", "axes fraction"), "fontsize": 8, "ha": "right", "rotation": 90}
        axis.annotate("m_eff", (EFFECTIVE_MASS, 0.5), **at)
        axis.set_xscale("symlog", linthresh=1.0)
        axis.set_xticks(ticks, ["0", "1", "10", "100", "1000", "10000"])
        axis.set(xlabel="dissipation k (kg)", xlim=(-0.1, 1.5e4))
        title = "k along and across the contacts (paper)" if across else "k along the normals only"
        axis.set_title(title, fontsize=10)
        axis.grid(alpha=0.3)
    axes[0].set(ylabel="force (kN)", ylim=(0, None))
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=6, fontsize=8)
    return figure


def _forces(axis: Axes, trials: Sequence[Trial]) -> None:
    series = (
        ("largest n·p/τ", [t.forces.max() for t in trials], "s-", ORANGE),
        ("95 % of n·p/τ", [np.quantile(t.forces, 0.95) for t in trials], "D-", BLUE),
        ("mean n·p/τ", [t.forces.mean() for t in trials], "o-", BLACK),
        ("largest λ/τ", [t.reactions.max() for t in trials], "s--", ORANGE),
        ("mean λ/τ", [t.reactions.mean() for t in trials], "o--", BLACK),
    )
    for label, values, style, colour in series:
        face = "none" if "--" in style else colour
        kilonewton, k = np.array(values) / 1e3, [trial.dissipation for trial in trials]
        axis.plot(k, kilonewton, style, color=colour, mfc=face, ms=5, label=label)


def seeds(crowds: Mapping[str, Sequence[Sample]]) -> Figure:
    """Draw where the maxima lie, and the sum of magnitudes against the distance, a row for each
    kind of crowd."""
    figure = Figure(figsize=(9.5, 3.2 * len(crowds) + 0.4), layout="constrained")
    rows = figure.subplots(len(crowds), 2, squeeze=False, sharex="col")
    for (places, profile), (kind, samples) in zip(rows, crowds.items(), strict=True):
        _places(places, samples)
        _profile(profile, samples)
        for axes in (places, profile):
            axes.set_title(f"{len(samples)} {kind}", fontsize=10)
    for axes in rows[-1]:
        axes.set_xlabel("distance from the middle of the exit (m)")
    rows[0, 0].legend(fontsize=8, loc="upper right")
    rows[0, 1].legend(fontsize=8)
    return figure


def _places(axes: Axes, samples: Sequence[Sample]) -> None:
    sums, vectors = [s.distance_m for s in samples], [s.resultant_distance_m for s in samples]
    bins = np.arange(0.0, max(sums + vectors) + BIN_M, BIN_M).tolist()
    filled: dict[str, Any] = {"color": BLUE, "edgecolor": BLACK, "alpha": 0.9}
    hatched: dict[str, Any] = {"color": "none", "edgecolor": ORANGE, "lw": 1.5, "hatch": "///"}
    axes.hist(sums, bins, **filled, label="largest sum of magnitudes")
    axes.hist(vectors, bins, **hatched, label="largest vector sum")
    axes.axvline(NEIGHBOURHOOD_M, color=BLACK, ls=":", label=f"{NEIGHBOURHOOD_M:g} m")
    axes.set_ylabel("crowds")
    axes.locator_params(axis="y", integer=True)
    axes.set_ylim(0, 1.45 * axes.get_ylim()[1])


def _profile(axes: Axes, samples: Sequence[Sample]) -> None:
    count = min(len(s.profile) for s in samples)
    values = np.array([s.profile[:count] for s in samples])
    ring = (np.arange(count) + 0.5) * RING_M
    axes.plot(ring, values.T, color=GREY, lw=0.7)
    mean, spread = np.nanmean(values, 0), np.nanstd(values, 0)
    label = "mean and standard deviation"
    axes.errorbar(ring, mean, spread, fmt="o-", color=BLUE, capsize=3, label=label)
    axes.set_ylabel("sum of magnitudes / mean")
    axes.set_ylim(bottom=0)


def sizes(samples: Sequence[Sample]) -> Figure:
    """Draw how mean, maximum and the place of the maximum change with the number of people."""
    figure = Figure(figsize=(9.5, 3.8), layout="constrained")
    forces, places = figure.subplots(1, 2)
    _error_bars(forces, samples, "largest_N", "s--", ORANGE, "largest sum of magnitudes")
    _error_bars(forces, samples, "mean_N", "o-", BLUE, "mean sum of magnitudes")
    _error_bars(forces, samples, "largest_resultant_N", "D:", BLACK, "largest vector sum")
    forces.set(yscale="log", ylabel="force (N)")
    forces.set_ylim(top=20 * forces.get_ylim()[1])
    _error_bars(places, samples, "reach_m", "^-.", BLUE, "farthest person")
    _error_bars(places, samples, "distance_m", "s--", ORANGE, "largest sum of magnitudes")
    _error_bars(places, samples, "resultant_distance_m", "D:", BLACK, "largest vector sum")
    places.set_ylabel("distance from the middle of the exit (m)")
    people = sorted({s.people for s in samples})
    for axes in (forces, places):
        axes.set(xscale="log", xlabel="people")
        axes.set_xticks(people, [str(n) for n in people])
        axes.set_xticks([], minor=True)
        axes.legend(fontsize=8, loc="upper left")
    return figure


def _error_bars(
    axes: Axes, samples: Sequence[Sample], name: str, style: str, colour: str, label: str
) -> None:
    people = sorted({s.people for s in samples})
    values = [np.array([getattr(s, name) for s in samples if s.people == n]) for n in people]
    mean, spread = [v.mean() for v in values], [v.std() for v in values]
    axes.errorbar(people, mean, spread, fmt=style, color=colour, capsize=3, ms=5, label=label)
