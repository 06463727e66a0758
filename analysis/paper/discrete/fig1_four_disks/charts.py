"""Pictures of the four disks: velocities by law, and against the dissipation."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.pages.drawing import BLACK, BLUE, COLOURS, GREY, MARKERS, ORANGE
from analysis.paper.discrete.fig1_four_disks.study import (
    LIGHT,
    MASS,
    PRINTED_K,
    FourDisks,
    Impact,
    four_disk_restitution,
)

HATCHES = ("", "///", "...", "xxx")


def after_impact(impacts: list[Impact]) -> Figure:
    """Draw bars of u⁺/U of each disk, a group for each law."""
    figure = Figure(figsize=(8.0, 0.45 * len(impacts) + 1.4), layout="constrained")
    axes = figure.add_subplot()
    disks = len(impacts[0].mass)
    height = 0.8 / disks
    rows = np.arange(len(impacts), dtype=float)
    for disk in range(disks):
        axes.barh(
            rows + (disk - 0.5 * (disks - 1)) * height,
            [impact.after[disk] / impact.before[0] for impact in impacts],
            height,
            color=COLOURS[disk],
            hatch=HATCHES[disk],
            edgecolor=BLACK,
            linewidth=0.5,
            label=f"disk {disk + 1}",
        )
    axes.axvline(0, color=BLACK, lw=0.8)
    axes.set_yticks(rows, [impact.law for impact in impacts], fontsize=8)
    axes.set_ylim(len(impacts) - 0.4, -0.6)
    axes.set_xlabel("velocity after the impact / velocity of disk 1 before it (–)")
    axes.grid(axis="x", alpha=0.3)
    figure.legend(
        *axes.get_legend_handles_labels(), loc="outside upper center", ncols=disks, fontsize=8
    )
    return figure


def against_dissipation(disks: FourDisks) -> Figure:
    """Draw u⁺/U against k/m, with both readings of the printed k, and the restitution obtained."""
    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    _velocities(left, disks)
    e, _, pair, four, _, newton, _ = np.array(disks.restitutions).T
    line = np.linspace(0, 1, 201)
    closed = [four_disk_restitution(float(x)) for x in line]
    right.plot(line, line, "-", color=GREY, label="e asked")
    right.plot(line, closed, "--", color=BLACK, label="(5e−1)/(5−e), or 0")
    right.plot(e, pair, MARKERS[0], color=BLUE, label="percussions, pair")
    right.plot(e, four, MARKERS[1], color=ORANGE, label="percussions, four disks")
    right.plot(e, newton, "x", color=BLACK, label="Newton's law, four disks")
    right.set(xlabel="restitution e that k stands for in a pair (–)", ylabel="(u²⁺ − u¹⁺) / U (–)")
    right.legend(fontsize=8)
    right.grid(alpha=0.3)
    return figure


def _velocities(axes: Axes, disks: FourDisks) -> None:
    ratio, four, pair = disks.ratios, disks.four, disks.pair
    axes.plot(ratio, four[:, 0], "-", color=BLUE, label="four disks: disk 1")
    axes.plot(ratio, four[:, 1:].mean(1), "--", color=ORANGE, label="four disks: disks 2–4")
    axes.plot(ratio, pair[:, 0], ":", color=BLUE, label="pair: disk 1")
    axes.plot(ratio, pair[:, 1], "-.", color=ORANGE, label="pair: disk 2")
    for place, words, style, side, shift in (
        (0.75, "k = ¾m", "-", "left", 1.08),
        (0.5, "k = ½m", ":", "right", 0.93),
    ):
        axes.axvline(place, color=BLACK, lw=0.8, ls=style)
        axes.text(place * shift, -0.72, words, fontsize=8, ha=side)
    for mass, marker in ((MASS, "D"), (LIGHT, "v")):
        place = PRINTED_K / mass
        values = [np.interp(np.log(place), np.log(ratio), four[:, disk]) for disk in (0, 1)]
        label = f"k = {PRINTED_K:g} kg, m = {mass:g} kg"
        axes.plot([place] * 2, values, marker, ls="none", mfc="white", mec=BLACK, ms=7, label=label)
    axes.set(xscale="log", ylim=(-1.05, 1.45), xlabel="k/m (–)", ylabel="u⁺/U (–)")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7, ncols=2, loc="upper left")
