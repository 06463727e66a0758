"""Pictures of Fig. 8: the error against k_v, and maps of the two contact forces."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from analysis.pages.drawing import BLACK, COLOURS, GREY, LINES, MARKERS
from analysis.pages.fields import draw_field, draw_room, rounded
from analysis.paper.continuum.fig8_turbulence.forces import Case, Pair
from analysis.paper.continuum.fig8_turbulence.study import Curve

NAMES = {Case.RANDOM: "(a) random, 1.7 ± 0.5 m/s", Case.UNIFORM: "(b) uniform, 1.23 m/s"}


def error_curves(curves: Sequence[Curve]) -> Figure:
    """Draw errors against k_v for both cases, with the paper's 10⁻² and its k_v ≥ 4."""
    figure = Figure(figsize=(10.0, 4.8), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, case in zip(panels, Case, strict=True):
        for number, curve in enumerate(curves):
            axes.plot(
                curve.volumes,
                list(curve.at(case).values()),
                marker=MARKERS[number],
                ls=LINES[number % len(LINES)],
                color=(*COLOURS, BLACK)[number],
                mfc="none" if number > 2 else None,
                label=curve.name,
            )
        axes.axhspan(10**-2.5, 10**-1.5, color=GREY, alpha=0.45, lw=0, label="order of 10⁻²")
        axes.axvline(4.0, color=BLACK, lw=0.8, ls=":")
        axes.annotate(
            "$k_v = 4$", (4.2, 0.98), xycoords=("data", "axes fraction"), fontsize=8, va="top"
        )
        axes.set(
            xscale="log",
            yscale="log",
            xlabel="volume dissipation $k_v$ (per person)",
            title=NAMES[case],
        )
        axes.grid(alpha=0.3)
    panels[0].set_ylabel("difference from the crowd turbulence (–)")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, fontsize=8)
    return figure


def force_maps(pairs: dict[Case, Pair]) -> Figure:
    """Draw |F| of the crowd turbulence, of (11), and their difference, over a body, on one scale
    per row."""
    figure = Figure(figsize=(10.5, 7.0), layout="constrained")
    for row, (case, pair) in zip(
        figure.subplots(2, 3, sharex=True, sharey=True), pairs.items(), strict=True
    ):
        theirs, ours = pair.forces.theirs_on_bodies, pair.ours_on_bodies
        top = rounded(float(np.quantile(np.concatenate([theirs, ours]), 0.99)))
        shown = (
            ("crowd turbulence", theirs),
            ("proposed, (11)", ours),
            ("difference", np.abs(ours - theirs)),
        )
        for axes, (name, values) in zip(row, shown, strict=True):
            drawn = draw_field(axes, pair.forces.map.mesh, values, top)
            draw_room(axes, pair.forces.room)
            axes.set_title(f"{NAMES[case][:3]} {name}", fontsize=10)
        row[0].set_ylabel("y (m)")
        figure.colorbar(drawn, ax=row.tolist(), label="|F| (N·s/m²)", shrink=0.8)
    for axes in row:
        axes.set_xlabel("x (m)")
    return figure
