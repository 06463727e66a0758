"""The picture of Fig. 11: right velocity and pressure side by side."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from analysis.pages.fields import draw_arrows, draw_field, draw_room, rounded
from analysis.paper.continuum.exit_room import ROOM, map_of
from analysis.paper.continuum.fig11_left_velocities.study import Run

ARROWS, LENGTH = 0.6, 0.5  # m between arrows, m for each m/s


def maps(runs: Sequence[Run]) -> Figure:
    """Draw |u⁺| with arrows, and p, of each run."""
    figure = Figure(figsize=(10.5, 4.6 * len(runs)), layout="constrained")
    rows = np.atleast_2d(figure.subplots(len(runs), 2, sharex=True, sharey=True))
    mesh = map_of().mesh
    fastest = rounded(max(float(np.quantile(np.hypot(*run.right.T), 0.99)) for run in runs))
    most = rounded(max(float(np.quantile(run.pressure, 0.995)) for run in runs))
    for number, (row, run) in enumerate(zip(rows, runs, strict=True)):
        speed, press = row
        drawn = draw_field(speed, mesh, np.hypot(*run.right.T), fastest)
        figure.colorbar(drawn, ax=speed, label="|u⁺| (m/s)", shrink=0.9)
        draw_arrows(speed, mesh, run.right, ARROWS, LENGTH)
        drawn = draw_field(press, mesh, run.pressure, most)
        figure.colorbar(drawn, ax=press, label="pressure (N·s/m)", shrink=0.9)
        for axes, letter, what in (
            (speed, "ac"[number], "right velocity"),
            (press, "bd"[number], "pressure"),
        ):
            draw_room(axes, ROOM)
            axes.set_title(
                f"({letter}) {what}, {run.name.split(',')[0]} left velocity", fontsize=10
            )
            axes.set(xlim=(-10.3, 0.6), ylim=(-5.3, 5.3))
        speed.set_ylabel("y (m)")
    for axes in rows[-1]:
        axes.set_xlabel("x (m)")
    return figure
