"""Pictures of Fig. 9: maps of the pressures, and their profiles."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from analysis.pages.drawing import BLACK, BLUE, GREEN, GREY, ORANGE
from analysis.pages.fields import draw_field, draw_room, rounded
from analysis.paper.continuum.exit_room import ROOM, map_of
from nscd.arrays import Floats
from nscd.continuum.rivals.first_order import PlaceEquation


def maps(proposed: Floats, first_order: dict[PlaceEquation, Floats], error: Floats) -> Figure:
    """(a) the proposed pressure, (b) (20) twice, (c) the relative error, all (n,) at the map's
    points."""
    figure = Figure(figsize=(10.5, 8.6), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True, sharey=True).ravel()
    mesh = map_of().mesh
    comp, printed = (
        first_order[equation] for equation in (PlaceEquation.COMPLEMENTARITY, PlaceEquation.PRINTED)
    )
    top = rounded(float(np.quantile(np.concatenate([proposed, comp]), 0.995)))
    shown = (
        ("(a) proposed, (11)", proposed, top),
        ("(b) first order, complementarity", comp, top),
        ("(b) first order, as printed (its own scale)", printed, rounded(float(printed.max()))),
        ("(c) relative error", error, 1.2),
    )
    for number, (axes, (name, values, most)) in enumerate(zip(panels, shown, strict=True)):
        drawn = draw_field(axes, mesh, values, most)
        draw_room(axes, ROOM)
        axes.set_title(name, fontsize=10)
        words = "|p − ρp₍₂₀₎| / largest p (–)" if number == 3 else "pressure (N·s/m)"
        figure.colorbar(drawn, ax=axes, label=words, shrink=0.9)
    for axes in panels[2:]:
        axes.set_xlabel("x (m)")
    for axes in panels[::2]:
        axes.set_ylabel("y (m)")
    return figure


def profiles(
    r: Floats, proposed: Floats, gaussian: Floats, sink: Floats, first_order: Floats
) -> Figure:
    """Pressures (n,) against the distance r (n,) from the middle of the exit, with plain and with
    logarithmic axes."""
    figure = Figure(figsize=(10.5, 4.6), layout="constrained")
    order = np.argsort(r)
    for axes in figure.subplots(1, 2):
        axes.plot(r, first_order, ".", ms=2.5, color=GREY, label="(20), complementarity, times ρ")
        axes.plot(r, proposed, "x", ms=3, mew=0.6, color=BLUE, label="(11)")
        axes.plot(
            r[order], gaussian[order], "--", lw=2, color=ORANGE, label="best Gaussian of (11)"
        )
        axes.plot(
            r[order], sink[order], "-", lw=1.4, color=BLACK, label="(11), point exit, closed form"
        )
        axes.set(xlabel="distance from the middle of the exit (m)", ylabel="pressure (N·s/m)")
        axes.grid(alpha=0.3)
    logarithmic = figure.axes[1]
    far = r[order][r[order] > 2]
    logarithmic.plot(far, sink[order][-1] * far[-1] / far, ":", lw=1.8, color=GREEN, label="∝ 1/r")
    logarithmic.set(xscale="log", yscale="log", xlim=(0.05, None), ylim=(30, None))
    handles, labels = logarithmic.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=8)
    return figure
