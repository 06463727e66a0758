"""Pictures of the four disks: velocities by law, and against the dissipation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.pages.drawing import BLACK, BLUE, COLOURS, GREY, MARKERS, ORANGE
from nscd.arrays import Floats

HATCHES = ("", "///", "...", "xxx")


def four_disk_restitution(e: float) -> float:
    """(u²⁺ − u¹⁺)/U of four equal disks with k of a pair's e: max(0, (5e−1)/(5−e)), from (k −
    ¾m)/(k + ¾m)."""
    return max(0.0, (5 * e - 1) / (5 - e))


def after_impact(laws: Sequence[tuple[str, Floats]]) -> Figure:
    """Bars of u⁺/U (n,) of each disk, a group for each law."""
    figure = Figure(figsize=(8.0, 0.45 * len(laws) + 1.4), layout="constrained")
    axes = figure.add_subplot()
    disks = len(laws[0][1])
    height = 0.8 / disks
    rows = np.arange(len(laws), dtype=float)
    for disk in range(disks):
        axes.barh(
            rows + (disk - 0.5 * (disks - 1)) * height,
            [velocity[disk] for _, velocity in laws],
            height,
            color=COLOURS[disk],
            hatch=HATCHES[disk],
            edgecolor=BLACK,
            linewidth=0.5,
            label=f"disk {disk + 1}",
        )
    axes.axvline(0, color=BLACK, lw=0.8)
    axes.set_yticks(rows, [law for law, _ in laws], fontsize=8)
    axes.set_ylim(len(laws) - 0.4, -0.6)
    axes.set_xlabel("velocity after the impact / velocity of disk 1 before it (–)")
    axes.grid(axis="x", alpha=0.3)
    figure.legend(
        *axes.get_legend_handles_labels(), loc="outside upper center", ncols=disks, fontsize=8
    )
    return figure


def against_dissipation(
    sweep: tuple[Floats, Floats, Floats],
    heavy: float,
    light: float,
    restitution: Sequence[Sequence[float]],
) -> Figure:
    """Left: u⁺/U against k/m, four disks and a pair, with both thresholds and k/m = heavy and light
    marked.

    Right: what the asked restitution becomes: rows of (e, k, pair, four disks, …).
    """
    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    _velocities(left, sweep, heavy, light)
    table = np.array(restitution, dtype=float)
    line = np.linspace(0, 1, 201)
    right.plot(line, line, "-", color=GREY, label="e asked")
    right.plot(
        line,
        [four_disk_restitution(float(e)) for e in line],
        "--",
        color=BLACK,
        label="(5e−1)/(5−e), or 0",
    )
    right.plot(table[:, 0], table[:, 2], MARKERS[0], color=BLUE, label="percussions, pair")
    right.plot(table[:, 0], table[:, 3], MARKERS[1], color=ORANGE, label="percussions, four disks")
    right.plot(table[:, 0], table[:, 5], "x", color=BLACK, label="Newton's law, four disks")
    right.set(xlabel="restitution e that k stands for in a pair (–)", ylabel="(u²⁺ − u¹⁺) / U (–)")
    right.legend(fontsize=8)
    right.grid(alpha=0.3)
    return figure


def _velocities(
    axes: Axes, sweep: tuple[Floats, Floats, Floats], heavy: float, light: float
) -> None:
    ratio, four, pair = sweep
    axes.plot(ratio, four[:, 0], "-", color=BLUE, label="four disks: disk 1")
    axes.plot(ratio, four[:, 1:].mean(1), "--", color=ORANGE, label="four disks: disks 2–4")
    axes.plot(ratio, pair[:, 0], ":", color=BLUE, label="pair: disk 1")
    axes.plot(ratio, pair[:, 1], "-.", color=ORANGE, label="pair: disk 2")
    for place, words in ((0.75, "k = ¾m"), (0.5, "k = ½m")):
        axes.axvline(place, color=BLACK, lw=0.8, ls="-" if place == 0.75 else ":")
        side = "left" if place == 0.75 else "right"
        shift = 1.08 if place == 0.75 else 0.93
        axes.text(place * shift, -0.72, words, fontsize=8, ha=side)
    for place, marker, words in (
        (heavy, "D", "k = 10 kg, m = 75 kg"),
        (light, "v", "k = 10 kg, m = 1 kg"),
    ):
        values = [np.interp(np.log(place), np.log(ratio), four[:, disk]) for disk in (0, 1)]
        axes.plot([place] * 2, values, marker, ls="none", mfc="white", mec=BLACK, ms=7, label=words)
    axes.set(xscale="log", ylim=(-1.05, 1.45), xlabel="k/m (–)", ylabel="u⁺/U (–)")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7, ncols=2, loc="upper left")
