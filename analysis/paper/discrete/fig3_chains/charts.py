"""Pictures of the chains: reactions along them, accuracy and cost against their length."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.pages.drawing import BLACK, COLOURS, GREY, LINES, MARKERS
from analysis.paper.discrete.fig3_chains.study import Trial


def percussions_along(shown: Sequence[Trial]) -> Figure:
    """Draw λ along chains, solver and closed form: free left, against a wall right."""
    figure = Figure(figsize=(9.5, 4.0), layout="constrained")
    free, wall = figure.subplots(1, 2)
    for axes in (free, wall):
        mine = [trial for trial in shown if trial.chain.wall == (axes is wall)]
        _along(axes, mine)
        n = len(mine[0].answer.reaction)
        names = [f"{i}–{i + 1}" for i in range(1, n + 1)]
        if axes is wall:
            names[-1] = f"{n}–wall"
            printed, _ = mine[0].chain.as_printed()
            label = "(5), (6) as printed, equal"
            axes.plot(range(1, n), printed, "x", ls=":", color=BLACK, label=label)
        axes.set_xticks(range(1, n + 1), names, rotation=45, fontsize=8)
        axes.set(xlabel="contact", ylabel="reaction λ (N·s)")
        axes.set_title("against a wall" if axes is wall else "free")
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8, loc="upper left" if axes is wall else "lower center")
    return figure


def _along(axes: Axes, trials: Sequence[Trial]) -> None:
    for number, trial in enumerate(trials):
        colour, places = COLOURS[number], np.arange(1, len(trial.answer.reaction) + 1)
        axes.plot(places, trial.chain.closed_form()[0], LINES[number], color=colour, lw=1.2)
        axes.plot(
            places,
            trial.answer.reaction,
            MARKERS[number],
            color=colour,
            mfc="none" if number else colour,
            label=f"{trial.chain.words[1]} masses",
        )


def accuracy(trials: Sequence[Trial]) -> Figure:
    """Draw the error of λ and the CPU seconds against the length, a line for each kind of chain."""
    figure = Figure(figsize=(9.5, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    smallest = np.finfo(float).eps / 4
    kinds = dict.fromkeys(trial.chain.words for trial in trials)
    for number, kind in enumerate(kinds):
        mine = [trial for trial in trials if trial.chain.words == kind]
        people = [len(trial.chain.mass) for trial in mine]
        errors = [max(trial.reaction_error, smallest) for trial in mine]
        for axes, values in ((left, errors), (right, [trial.cpu for trial in mine])):
            axes.plot(
                people,
                values,
                MARKERS[number],
                ls=LINES[number],
                color=COLOURS[number],
                mfc="none" if number % 2 else COLOURS[number],
                label=", ".join(kind),
            )
    left.axhline(1e-10, color=GREY, lw=1.5, label="10⁻¹⁰")
    left.set(ylabel="error of λ / largest λ (–)", ylim=(smallest / 2, 1e-9))
    right.set(ylabel="CPU time of solve (s)")
    for axes in (left, right):
        axes.set(xscale="log", yscale="log", xlabel="people in the chain")
        axes.grid(alpha=0.3)
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize=8)
    return figure
