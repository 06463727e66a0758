"""What accuracy costs: residual and error of u⁺ against CPU seconds, for tolerances from loose to
tight."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from cases import Case
from contest.compete import Outcome
from matplotlib.figure import Figure

from analysis.pages.drawing import EVERY_COLOUR, GRID

TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
# marker and dashes tell the lines apart without colour
MARKERS = "osD^v<>Px"
DASHES = ("-", "--", "-.", ":")


def picture(cases: Sequence[tuple[Case, Sequence[Outcome]]], path: Path) -> None:
    """Save as PNG: one column a case; the residual above, the error of u⁺ below. The error is
    against the most exact answer of all solvers; below 1e-16 it is drawn at 1e-16."""
    figure = Figure(figsize=(5.5 * len(cases), 8), layout="constrained", dpi=150)
    panels = figure.subplots(2, len(cases), sharex="col", sharey="row", squeeze=False)
    handles = {}
    for (above, below), (case, outcomes) in zip(panels.T, cases, strict=True):
        every = [a for outcome in outcomes for a in outcome.attempts]
        if not every:
            continue
        scale = float(np.abs(case.left_velocity).max())
        exact = min(every, key=lambda a: a.residual).velocity
        for number, outcome in enumerate(outcomes):
            attempts = [a for a in outcome.attempts if np.isfinite(a.residual)]
            if not attempts:
                continue
            variant = f" ({attempts[0].variant})" if attempts[0].variant else ""
            look = {
                "color": EVERY_COLOUR[number % len(EVERY_COLOUR)],
                "marker": MARKERS[number % len(MARKERS)],
                "ls": DASHES[number % len(DASHES)],
                "lw": 1.2 if number else 2,
            }
            seconds, residuals = [a.seconds for a in attempts], [a.residual for a in attempts]
            errors = [float(np.abs(a.velocity - exact).max()) / scale for a in attempts]
            for panel, values in ((above, residuals), (below, errors)):
                (drawn,) = panel.loglog(seconds, np.maximum(values, 1e-16), ms=5, **look)
            handles.setdefault(outcome.solver + variant, drawn)
        above.set_title(f"{case.name}: {len(case.snapshot)} disks, {len(case.contacts)} contacts")
        below.set_xlabel("CPU seconds")
    panels[0, 0].set_ylabel("residual, recomputed")
    panels[1, 0].set_ylabel("error of u⁺ / ‖u⁻‖∞")
    for panel in panels.flat:
        panel.grid(True, which="major", color=GRID, lw=0.6)
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3, fontsize=8)
    figure.savefig(path)
