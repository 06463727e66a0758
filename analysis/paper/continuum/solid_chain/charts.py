"""The picture of 3.2.1: right velocities along chains, and the internal percussion for several
densities."""

import numpy as np
from matplotlib.figure import Figure

from analysis.pages.drawing import COLOURS, LINES, MARKERS
from analysis.paper.continuum.solid_chain.study import LENGTH, Chains


def velocities(found: Chains) -> Figure:
    """Draw u⁺ along the chains by elements and in closed form, and r_int for several densities."""
    figure = Figure(figsize=(10.5, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    for number, trial in enumerate(found.trials):
        x = trial.x
        left.plot(x, trial.chain.right_velocity(x), LINES[number], color=COLOURS[number], lw=1.2)
        some = slice(number * 5, None, 20)
        left.plot(
            x[some],
            trial.right[some],
            MARKERS[number],
            ls="none",
            ms=5,
            mfc="none",
            color=COLOURS[number],
            label=trial.name.replace("k_s", "$k_s$"),
        )
    left.set(ylabel="right velocity u⁺ (m/s)")
    left.legend(fontsize=8, loc="lower left")
    shades = np.linspace(0.7, 0.0, len(found.dense))
    for number, trial in enumerate(found.dense):
        style = (*LINES, (0, (6, 1)))[number]
        right.plot(
            trial.x,
            trial.chain.internal_percussion(trial.x),
            ls=style,
            color=str(shades[number]),
            lw=1.8,
            label=f"{trial.name} people/m",
        )
    right.set(
        ylabel="internal percussion (N·s per kg of a person)", yscale="log", ylim=(1e-2, None)
    )
    right.legend(fontsize=8, loc="upper left")
    for axes in (left, right):
        axes.set(xlabel="x (m); the wall is at the right", xlim=(LENGTH - 6, LENGTH + 0.1))
        axes.grid(alpha=0.3)
    return figure
