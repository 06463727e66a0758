"""The picture of 3.2.1: right velocities along chains, and the internal percussion for several
densities."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from analysis.pages.drawing import COLOURS, LINES, MARKERS
from nscd.arrays import Floats


def velocities(
    chains: Sequence[tuple[str, Floats, Floats, Floats]],
    percussions: Sequence[tuple[float, Floats, Floats]],
    wall: float,
) -> Figure:
    """(name, x, u⁺ by elements, u⁺ in closed form) and (density, x, r_int); the wall is at x =
    `wall` (m)."""
    figure = Figure(figsize=(10.5, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    for number, (name, x, found, closed) in enumerate(chains):
        left.plot(x, closed, LINES[number], color=COLOURS[number], lw=1.2)
        some = slice(number * 5, None, 20)
        left.plot(
            x[some],
            found[some],
            MARKERS[number],
            ls="none",
            ms=5,
            mfc="none",
            color=COLOURS[number],
            label=name,
        )
    left.set(ylabel="right velocity u⁺ (m/s)")
    left.legend(fontsize=8, loc="lower left")
    shades = np.linspace(0.7, 0.0, len(percussions))
    for number, (density, x, percussion) in enumerate(percussions):
        style = (*LINES, (0, (6, 1)))[number]
        right.plot(
            x,
            percussion,
            ls=style,
            color=str(shades[number]),
            lw=1.8,
            label=f"ρ = {density:g} people/m",
        )
    right.set(
        ylabel="internal percussion (N·s per kg of a person)", yscale="log", ylim=(1e-2, None)
    )
    right.legend(fontsize=8, loc="upper left")
    for axes in (left, right):
        axes.set(xlabel="x (m); the wall is at the right", xlim=(wall - 6, wall + 0.1))
        axes.grid(alpha=0.3)
    return figure
