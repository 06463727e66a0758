"""Pictures of Fig. 9: maps of the pressures, their profiles, and the raw maximum."""

import numpy as np
from matplotlib.figure import Figure

from analysis.pages.drawing import BLACK, BLUE, GREEN, GREY, ORANGE
from analysis.pages.fields import draw_field, draw_room, rounded
from analysis.paper.continuum.exit_room import ROOM, map_of
from analysis.paper.continuum.fig9_exit_pressure.study import Fit, Pressures, RawMaxima


def maps(room: Pressures) -> Figure:
    """Draw (a) the proposed pressure, (b) (20) twice, (c) the relative error."""
    figure = Figure(figsize=(10.5, 8.6), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True, sharey=True).ravel()
    proposed, other = room.proposed.pressure, room.complementarity.pressure
    printed = room.printed.pressure
    top = rounded(float(np.quantile(np.concatenate([proposed, other]), 0.995)))
    shown = (
        ("(a) proposed, (11)", proposed, top),
        ("(b) first order, complementarity", other, top),
        ("(b) first order, as printed (its own scale)", printed, rounded(float(printed.max()))),
        ("(c) relative error", room.relative_error, 1.2),
    )
    for number, (axes, (name, values, most)) in enumerate(zip(panels, shown, strict=True)):
        drawn = draw_field(axes, map_of().mesh, values, most)
        draw_room(axes, ROOM)
        axes.set_title(name, fontsize=10)
        words = "|p − ρp₍₂₀₎| / largest p (–)" if number == 3 else "pressure (N·s/m)"
        figure.colorbar(drawn, ax=axes, label=words, shrink=0.9)
    for axes in panels[2:]:
        axes.set_xlabel("x (m)")
    for axes in panels[::2]:
        axes.set_ylabel("y (m)")
    return figure


def profiles(room: Pressures, fit: Fit) -> Figure:
    """Draw pressures against the distance from the middle of the exit, plain and logarithmic."""
    r, proposed, sink = room.radius, room.proposed.pressure, room.sink
    gaussian, first_order = fit.values, room.complementarity.pressure
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


def raw_maximum(raw: RawMaxima) -> Figure:
    """Draw the largest pressure, in any triangle and over a body, against the side."""
    figure = Figure(figsize=(8.0, 4.4), layout="constrained")
    axes = figure.add_subplot()
    side = np.array([row.size for row in raw.uniform])
    for rows, kind, marker in ((raw.uniform, "uniform", "o"), (raw.graded, "graded", "s")):
        sides = [row.size for row in rows]
        axes.plot(
            sides,
            [row.raw for row in rows],
            marker,
            ls=":",
            color=ORANGE,
            label=f"in any triangle, {kind}",
        )
        axes.plot(
            sides,
            [row.body for row in rows],
            marker,
            ls="-",
            color=BLUE,
            mfc="none",
            label=f"over a body, {kind}",
        )
    axes.plot(
        side,
        raw.uniform[0].raw * (side / side[0]) ** -0.5,
        "--",
        color=BLACK,
        lw=1,
        label="∝ side$^{-1/2}$",
    )
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="side of the triangles (m)",
        ylabel="largest pressure (N·s/m)",
    )
    axes.set_xticks(side, [f"{value:g}" for value in side], minor=False)
    axes.set_xticks([], minor=True)
    axes.invert_xaxis()
    axes.grid(alpha=0.3)
    figure.legend(loc="outside right center", fontsize=8)
    return figure
