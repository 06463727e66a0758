"""What accuracy costs: residual and error of u⁺ against CPU seconds, for tolerances from loose to
tight."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from cases import Case
from contest.compete import Outcome
from matplotlib.figure import Figure

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

TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
# marker and dashes tell the lines apart without colour
COLOURS = (BLACK, BLUE, ORANGE, GREEN, PINK, SKY, VERMILION, GREY, DARK_GREY)
MARKERS = "osD^v<>Px"
DASHES = ("-", "--", "-.", ":")


def picture(cases: Sequence[tuple[Case, Sequence[Outcome]]], path: Path) -> None:
    """Save as PNG: one column a case; the residual above, the error of u⁺ below. The error is
    against the most exact answer of all solvers; below 1e-16 it is drawn at 1e-16."""
    figure = Figure(figsize=(5.5 * len(cases), 8), layout="constrained", dpi=150)
    panels = figure.subplots(2, len(cases), sharex="col", sharey="row", squeeze=False)
    for column, (case, outcomes) in enumerate(cases):
        scale = float(np.abs(case.left_velocity).max())
        every = [a for outcome in outcomes for a in outcome.attempts]
        if not every:
            continue
        exact = min(every, key=lambda a: a.residual).velocity
        for number, outcome in enumerate(outcomes):
            attempts = [a for a in outcome.attempts if np.isfinite(a.residual)]
            if not attempts:
                continue
            seconds = [a.seconds for a in attempts]
            errors = [float(np.abs(a.velocity - exact).max()) / scale for a in attempts]
            for panel, values in zip(
                panels[:, column], ([a.residual for a in attempts], errors), strict=True
            ):
                panel.loglog(
                    seconds,
                    np.maximum(values, 1e-16),
                    color=COLOURS[number % len(COLOURS)],
                    marker=MARKERS[number % len(MARKERS)],
                    ls=DASHES[number % len(DASHES)],
                    ms=5,
                    lw=2 if number == 0 else 1.2,
                    label=f"{outcome.solver}"
                    + (f" ({attempts[0].variant})" if attempts[0].variant else ""),
                )
        panels[0, column].set_title(
            f"{case.name}: {len(case.snapshot)} disks, {len(case.contacts)} contacts"
        )
        panels[1, column].set_xlabel("CPU seconds")
    panels[0, 0].set_ylabel("residual, recomputed")
    panels[1, 0].set_ylabel("error of u⁺ / ‖u⁻‖∞")
    for panel in panels.flat:
        panel.grid(True, which="major", color=GRID, lw=0.6)
    handles = {}
    for panel in panels[0]:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3, fontsize=8)
    figure.savefig(path)
