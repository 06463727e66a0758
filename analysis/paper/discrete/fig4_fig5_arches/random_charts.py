"""Tables and pictures of random arches: where the maxima lie, and how forces grow with the number
of people."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.pages.drawing import BLACK, BLUE, GREY, ORANGE
from analysis.pages.section import Cell, Picture, Table
from analysis.paper.discrete.fig4_fig5_arches.pressed_crowd import NEIGHBOURHOOD_M, RING_M
from analysis.paper.discrete.fig4_fig5_arches.random_crowds import Sample


def seeds_table(samples: Sequence[Sample], caption: str) -> Table:
    """Mean, spread and range of each quantity over arches of one size."""
    quantities = (
        ("mean sum of normal magnitudes (N)", [s.mean_N for s in samples]),
        ("largest sum of normal magnitudes (N)", [s.largest_N for s in samples]),
        ("width of its interval (N)", [s.upper_N - s.lower_N for s in samples]),
        ("its distance from the middle of the exit (m)", [s.distance_m for s in samples]),
        ("its angle from the axis of the exit, size (°)", [abs(s.angle_degrees) for s in samples]),
        ("largest contact force (N)", [s.largest_contact_N for s in samples]),
        ("its distance (m)", [s.contact_distance_m for s in samples]),
        ("largest vector sum (N)", [s.largest_resultant_N for s in samples]),
        ("its distance (m)", [s.resultant_distance_m for s in samples]),
        ("redundant contacts", [float(s.redundant) for s in samples]),
        ("largest overlap / mean diameter", [s.overlap_share for s in samples]),
    )
    rows: list[Sequence[Cell]] = [
        (name, *(float(f(values)) for f in (np.mean, np.std, np.min, np.median, np.max)))
        for name, values in quantities
    ]
    head = ("quantity", "mean", "standard deviation", "least", "median", "largest")
    return Table(caption=caption, head=head, rows=rows)


def sizes_table(samples: Sequence[Sample]) -> Table:
    """Means over the arches of each number of people."""
    rows: list[Sequence[Cell]] = []
    for people in sorted({s.people for s in samples}):
        same = [s for s in samples if s.people == people]

        def mean(name: str, same: list[Sample] = same) -> float:
            return float(np.mean([getattr(s, name) for s in same]))

        largest = [s.largest_N for s in same]
        rows.append(
            (
                people, len(same), mean("reach_m"), mean("contacts") / people, mean("mean_N"), float(np.mean(largest)),
                float(np.std(largest)), mean("distance_m"), mean("largest_resultant_N"), mean("resultant_distance_m"),
                mean("redundant"), mean("overlap_share"), sum(s.solved for s in same),
            )
        )  # fmt: skip
    head = (
        "people", "arches", "farthest person (m)", "contacts a person", "mean sum of magnitudes (N)", "largest (N)",
        "standard deviation (N)", "its distance (m)", "largest vector sum (N)", "its distance (m)", "redundant contacts",
        "largest overlap / diameter", "solved",
    )  # fmt: skip
    return Table(caption="Means over random arches, by number of people", head=head, rows=rows)


def seeds_picture(samples: Sequence[Sample]) -> Picture:
    """Where the maxima lie, and the sum of magnitudes against the distance, over arches of one
    size."""
    figure = Figure(figsize=(9.5, 3.8), layout="constrained")
    places, profile = figure.subplots(1, 2)
    sums, vectors = [s.distance_m for s in samples], [s.resultant_distance_m for s in samples]
    bins = np.arange(0.0, max(sums + vectors) + 0.5, 0.5)
    places.hist(
        sums, bins, color=BLUE, edgecolor=BLACK, alpha=0.9, label="largest sum of magnitudes"
    )
    places.hist(
        vectors,
        bins,
        color="none",
        edgecolor=ORANGE,
        lw=1.5,
        hatch="///",
        label="largest vector sum",
    )
    places.axvline(NEIGHBOURHOOD_M, color=BLACK, ls=":", label=f"{NEIGHBOURHOOD_M:g} m")
    places.set(xlabel="distance from the middle of the exit (m)", ylabel="arches")
    places.set_ylim(0, 1.45 * places.get_ylim()[1])
    places.legend(fontsize=8, loc="upper right")
    count = min(len(s.profile) for s in samples)
    values = np.array([s.profile[:count] for s in samples])
    ring = (np.arange(count) + 0.5) * RING_M
    profile.plot(ring, values.T, color=GREY, lw=0.7)
    profile.errorbar(
        ring, np.nanmean(values, 0), np.nanstd(values, 0), fmt="o-", color=BLUE, capsize=3,
        label="mean and standard deviation",
    )  # fmt: skip
    profile.set(
        xlabel="distance from the middle of the exit (m)",
        ylabel="sum of magnitudes / mean of the arch",
    )
    profile.set_ylim(bottom=0)
    profile.legend(fontsize=8)
    return Picture(
        name="fig_4_seeds",
        figure=figure,
        caption=f"{len(samples)} random arches of {samples[0].people} people. Left: distance of the person who carries most, "
        "as the sum of normal magnitudes (filled) and as the vector sum (hatched). Right: mean of the sum of magnitudes in "
        "rings of 1 m; grey: each arch.",
    )


def sizes_picture(samples: Sequence[Sample]) -> Picture:
    """How mean, maximum and the place of the maximum change with the number of people."""
    figure = Figure(figsize=(9.5, 3.8), layout="constrained")
    forces, places = figure.subplots(1, 2)
    _error_bars(forces, samples, "largest_N", "s--", ORANGE, "largest sum of magnitudes")
    _error_bars(forces, samples, "mean_N", "o-", BLUE, "mean sum of magnitudes")
    _error_bars(forces, samples, "largest_resultant_N", "D:", BLACK, "largest vector sum")
    forces.set(yscale="log", xlabel="people", ylabel="force (N)")
    forces.set_ylim(top=20 * forces.get_ylim()[1])
    forces.legend(fontsize=8, loc="upper left")
    people = sorted({s.people for s in samples})
    for axes in (forces, places):
        axes.set_xscale("log")
        axes.set_xticks(people, [str(n) for n in people])
        axes.set_xticks([], minor=True)
    _error_bars(places, samples, "reach_m", "^-.", BLUE, "farthest person")
    _error_bars(places, samples, "distance_m", "s--", ORANGE, "largest sum of magnitudes")
    _error_bars(places, samples, "resultant_distance_m", "D:", BLACK, "largest vector sum")
    places.set(xlabel="people", ylabel="distance from the middle of the exit (m)")
    places.legend(fontsize=8, loc="upper left")
    return Picture(
        name="fig_4_sizes",
        figure=figure,
        caption="Means and standard deviations over random arches at the same density: forces, and where the largest are.",
    )


def _error_bars(
    axes: Axes, samples: Sequence[Sample], name: str, style: str, colour: str, label: str
) -> None:
    people = sorted({s.people for s in samples})
    values = [np.array([getattr(s, name) for s in samples if s.people == n]) for n in people]
    mean, spread = [v.mean() for v in values], [v.std() for v in values]
    axes.errorbar(people, mean, spread, fmt=style, color=colour, capsize=3, ms=5, label=label)
