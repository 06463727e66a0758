"""Performance profiles as a picture."""

import numpy as np
from matplotlib.figure import Figure

from analysis.library.score import Scores
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
)

COLOURS = (BLACK, BLUE, ORANGE, GREEN, PINK, SKY, VERMILION, GREY, DARK_GREY)
DASHES = ("-", "--", "-.", ":")
# The longest ratio that is drawn.
MOST = 1e4


def profile_picture(scores: Scores) -> Figure:
    """Draw the profiles without friction and with it, those with the most right answers first."""
    figure = Figure(figsize=(11, 6.5), layout="constrained", dpi=150)
    panels = figure.subplots(1, 2, sharey=True)
    ratios = np.logspace(0, np.log10(MOST), 400)
    for panel, friction in zip(panels, (False, True), strict=True):
        some = scores.of(friction)
        count = len(some.problems)
        panel.set_title(f"{'with' if friction else 'without'} friction: {count} problems")
        panel.set_xlabel("times the CPU seconds of the fastest")
        panel.grid(True, color=GRID, lw=0.6)
        panel.set_xscale("log")
        panel.set(ylim=(0, 1.03), xlim=(0.9, MOST))
        if not count:
            continue
        shares = some.profiles(ratios)
        for name, share in zip(some.solvers, shares, strict=True):
            if not share.any():
                continue
            number = scores.solvers.index(name)
            panel.step(
                ratios,
                share,
                where="post",
                color=COLOURS[number % len(COLOURS)],
                ls=DASHES[number // len(COLOURS) % len(DASHES)],
                lw=1.8,
                label=name,
            )
        panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=3, fontsize=8)
    panels[0].set_ylabel("share of the problems answered rightly")
    return figure
