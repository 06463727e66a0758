"""Pictures of the chains: reactions along them, accuracy and cost against their length."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from analysis.pages.drawing import BLACK, COLOURS, GREY, LINES, MARKERS
from nscd.arrays import Floats


def percussions_along(
    chains: Sequence[tuple[bool, str, Floats, Floats]], printed: Floats
) -> Figure:
    """λ along chains (wall?, masses, by the solver, closed form), free left, against a wall right;
    `printed` what (5), (6) give for the equal masses on the right."""
    figure = Figure(figsize=(9.5, 4.0), layout="constrained")
    free, wall = figure.subplots(1, 2)
    for axes in (free, wall):
        mine = [chain for chain in chains if chain[0] == (axes is wall)]
        for number, (_, masses, solved, closed) in enumerate(mine):
            places = np.arange(1, len(solved) + 1)
            axes.plot(places, closed, LINES[number], color=COLOURS[number], lw=1.2)
            axes.plot(
                places,
                solved,
                MARKERS[number],
                ls="none",
                color=COLOURS[number],
                mfc="none" if number else COLOURS[number],
                label=f"{masses} masses",
            )
        n = max(len(chain[2]) for chain in mine)
        names = [f"{i}–{i + 1}" for i in range(1, n + 1)]
        if axes is wall:
            names[-1] = f"{n}–wall"
            axes.plot(
                np.arange(1, len(printed) + 1),
                printed,
                "x",
                ls=":",
                color=BLACK,
                label="(5), (6) as printed, equal",
            )
        axes.set_xticks(np.arange(1, n + 1), names, rotation=45, fontsize=8)
        axes.set(
            xlabel="contact",
            ylabel="reaction λ (N·s)",
            title="against a wall" if axes is wall else "free",
        )
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8, loc="upper left" if axes is wall else "lower center")
    return figure


def accuracy(kinds: Sequence[tuple[str, Floats]]) -> Figure:
    """Error of λ and CPU seconds against the length; rows of (n, error, seconds) for each kind of
    chain."""
    figure = Figure(figsize=(9.5, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    smallest = np.finfo(float).eps / 4
    for number, (words, rows) in enumerate(kinds):
        for axes, values in ((left, np.maximum(rows[:, 1], smallest)), (right, rows[:, 2])):
            axes.plot(
                rows[:, 0],
                values,
                MARKERS[number],
                ls=LINES[number],
                color=COLOURS[number],
                mfc="none" if number % 2 else COLOURS[number],
                label=words,
            )
    left.axhline(1e-10, color=GREY, lw=1.5, label="1e-10")
    left.set(ylabel="error of λ / largest λ (–)", ylim=(smallest / 2, 1e-9))
    right.set(ylabel="CPU time of solve (s)")
    for axes in (left, right):
        axes.set(xscale="log", yscale="log", xlabel="people in the chain")
        axes.grid(alpha=0.3)
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize=8)
    return figure
