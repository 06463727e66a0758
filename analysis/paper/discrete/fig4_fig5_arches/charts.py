"""Pictures of a pressed crowd: who moves, who carries what, and the engines beside the
percussions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from analysis.compare.comparison import Comparison
from analysis.pages.drawing import BLACK, BLUE, ORANGE, circles, contact_lines
from analysis.pages.names import engine_label
from analysis.pages.section import Picture
from analysis.paper.discrete.fig4_fig5_arches.pressed_crowd import NEIGHBOURHOOD_M, RING_M, Arch
from nscd.arrays import Floats


def snapshot_picture(arch: Arch, name: str) -> Picture:
    """Configuration, right velocities, and force on each person: vector sum and sum of
    magnitudes."""
    figure = Figure(figsize=(10.5, 11.0), layout="constrained")
    axes = figure.subplots(2, 2).ravel()
    speed = np.hypot(*arch.answer.right_velocity.T)
    panels = (
        ("(a) configuration and contact forces", None, "n·p/τ of a contact (N)"),
        ("(b) right velocity u⁺", speed, "speed (m/s)"),
        ("(c) force on each person: vector sum", arch.resultants(), "|Σ p|/τ (N)"),
        ("(c′) force on each person: sum of magnitudes", arch.carried(), "Σ |n·p|/τ (N)"),
    )
    for axis, (title, values, label) in zip(axes, panels, strict=True):
        shown = arch.normal_forces() if values is None else values[arch.inside()]
        norm = Normalize(0.0, float(np.quantile(shown, 0.99)))
        _draw_people(axis, arch, values, norm)
        axis.set_title(title, fontsize=10)
        figure.colorbar(
            ScalarMappable(norm, "viridis_r"), ax=axis, shrink=0.8, extend="max", label=label
        )
    _draw_forces(axes[0], arch)
    moving = speed > 0.05 * np.quantile(speed, 0.9)
    axes[1].quiver(
        *arch.snapshot.position[moving].T, *arch.answer.right_velocity[moving].T, angles="xy", scale_units="xy", scale=4.0,
        width=0.0025, color=BLACK,
    )  # fmt: skip
    for axis, values in zip(axes[2:], (arch.resultants(), arch.carried()), strict=True):
        most = arch.snapshot.position[arch.largest(values)]
        axis.annotate(
            "largest",
            most,
            (0.4, np.copysign(max(abs(most[1]) + 0.6, 1.6), most[1])),
            fontsize=9,
            arrowprops={"arrowstyle": "->", "color": BLACK, "lw": 1.5},
        )
    return Picture(
        name=name,
        figure=figure,
        caption="(a) The crowd and its percussions as forces p/τ. (b) Right velocities: arrows are a quarter of a second long. "
        "(c) Vector sum of the contact forces on each person: it balances the drive or accelerates, whatever the pressing. "
        " (c′) Sum of their normal magnitudes: how hard one is pressed. Colours end at the 99th percentile.",
    )


def _draw_people(axes: Axes, arch: Arch, values: Floats | None, norm: Normalize) -> None:
    disks = PatchCollection(circles(arch.snapshot), edgecolor="#777777", linewidth=0.3)
    if values is None:
        disks.set_facecolor("#F4F4F4")
    else:
        disks.set(array=values, cmap="viridis_r", norm=norm)
    axes.add_collection(disks)
    (x0, y0), (x1, y1) = arch.drive.door_start_m, arch.drive.door_end_m
    along = np.array([x1 - x0, y1 - y0])
    ends = np.array([[x0, y0], [x1, y1]])
    walls = np.stack([ends, ends + 50.0 * np.stack([-along, along])], axis=1)
    axes.add_collection(LineCollection(list(walls), colors=BLACK, linewidths=2.5))
    reach = arch.snapshot.position[arch.inside()]
    low, high = reach.min(0) - 0.5, np.maximum(reach.max(0), (1.5, -np.inf)) + 0.5
    axes.set(
        xlim=(low[0], high[0]),
        ylim=(low[1], high[1]),
        aspect="equal",
        xlabel="x (m)",
        ylabel="y (m)",
    )


def _draw_forces(axes: Axes, arch: Arch) -> None:
    lines, force = contact_lines(arch.snapshot, arch.contacts), arch.normal_forces()
    order, top = np.argsort(force), float(np.quantile(force, 0.99))
    axes.add_collection(
        LineCollection(
            list(lines[order]), array=force[order], cmap="viridis_r", norm=Normalize(0.0, top),
            linewidths=list(0.3 + 3.0 * np.clip(force[order] / top, 0.0, 1.2)),
        )
    )  # fmt: skip


def engines_picture(comparisons: Sequence[Comparison], name: str) -> Picture:
    """Sum of magnitudes at each person: percussions against each engine."""
    figure = Figure(figsize=(4.6 * len(comparisons), 5.0), layout="constrained")
    for number, comparison in enumerate(comparisons):
        axes = figure.add_subplot(1, len(comparisons), number + 1)
        penalty, rigid = (values / 1e3 for values in comparison.disk_sums())
        near = Arch.of(comparison.scene, comparison.snapshot).distance() <= NEIGHBOURHOOD_M
        top = 1.05 * float(max(penalty.max(), rigid.max()))
        axes.plot([0, top], [0, top], color=BLACK, lw=0.8, label="equal")
        axes.plot(
            penalty[~near],
            rigid[~near],
            "o",
            ms=3.5,
            mfc="none",
            mec=BLUE,
            mew=0.7,
            label="farther",
        )
        axes.plot(
            penalty[near],
            rigid[near],
            "s",
            ms=5,
            color=ORANGE,
            mec=BLACK,
            mew=0.5,
            label=f"within {NEIGHBOURHOOD_M:g} m of the exit",
        )
        axes.set(
            xlim=(0, top),
            ylim=(0, top),
            aspect="equal",
            xlabel="engine (kN)",
            ylabel="percussions, p/τ (kN)",
        )
        axes.set_title(engine_label(comparison), fontsize=10)
        axes.legend(fontsize=8, loc="upper left")
    caption = "Sum of the normal magnitudes at each person: penalty models against percussions on the same snapshot."
    return Picture(name=name, figure=figure, caption=caption)  # fmt: skip


def rings_picture(archs: dict[str, Arch]) -> Picture:
    figure = Figure(figsize=(10.5, 4.2), layout="constrained")
    panels = figure.subplots(1, 2)
    styles = {"unequal masses": ("s-", ORANGE, "."), "equal masses": ("o--", BLUE, "x")}
    for name, arch in archs.items():
        style, colour, dot = styles[name]
        ring, inside, distance = arch.rings(), arch.inside(), arch.distance()
        for axis, values in zip(
            panels, (np.hypot(*arch.answer.right_velocity.T), arch.carried() / 1e3), strict=True
        ):
            axis.plot(distance[inside], values[inside], dot, ms=3, color=colour, alpha=0.35)
            held = [r for r in range(int(ring.max()) + 1) if (ring == r).any()]
            axis.plot([(r + 0.5) * RING_M for r in held], [values[ring == r].mean() for r in held], style, color=colour,
                      mec=BLACK, label=f"{name}: mean of rings of {RING_M:g} m")  # fmt: skip
    for axis, label in zip(
        panels, ("right speed |u⁺| (m/s)", "sum of normal magnitudes (kN)"), strict=True
    ):
        axis.set(xlabel="distance from the middle of the exit (m)", ylabel=label, ylim=(0, None))
        axis.legend(fontsize=8, loc="upper right")
    caption = (
        "Speed on the right and force against the distance to the exit; small dots: each person."
    )
    return Picture(name="fig_5_rings", figure=figure, caption=caption)  # fmt: skip
