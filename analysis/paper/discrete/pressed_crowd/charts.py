"""Pictures of a pressed crowd: who moves, who carries what, and the engines beside it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from analysis.compare.comparison import Comparison
from analysis.pages.drawing import (
    BLACK,
    BLUE,
    ORANGE,
    PALE,
    add_scale,
    contact_lines,
    draw_disks,
    draw_forces,
    draw_vectors,
    draw_walls,
)
from analysis.pages.names import engine_label
from analysis.paper.discrete.pressed_crowd.arch import NEIGHBOURHOOD_M, Arch
from nscd.arrays import Floats


def snapshot(arch: Arch) -> Figure:
    """Draw configuration, right velocities, and force on each person: vector sum and sum of
    magnitudes."""
    figure = Figure(figsize=(10.5, 11.0), layout="constrained")
    axes = figure.subplots(2, 2).ravel()
    position, velocity = arch.snapshot.position, arch.answer.right_velocity
    forces, speed = arch.normal_forces(), np.hypot(*velocity.T)
    panels = (
        ("(a) configuration and contact forces", None, "n·p/τ of a contact (N)"),
        ("(b) right velocity u⁺", speed, "speed (m/s)"),
        ("(c) force on each person: vector sum", arch.resultants(), "|Σ p|/τ (N)"),
        ("(c′) force on each person: sum of magnitudes", arch.carried(), "Σ |n·p|/τ (N)"),
    )
    for axis, (title, values, label) in zip(axes, panels, strict=True):
        shown = forces if values is None else values[arch.inside()]
        norm = Normalize(0.0, float(np.quantile(shown, 0.99)))
        _draw_people(axis, arch, values, norm)
        if values is None:
            draw_forces(axis, contact_lines(arch.snapshot, arch.contacts), forces, norm)
        axis.set_title(title, fontsize=10)
        add_scale(figure, axis, norm, label)
    moving = speed > 0.05 * np.quantile(speed, 0.9)
    draw_vectors(axes[1], position[moving], velocity[moving] / 4, width=0.0025, color=BLACK)
    for axis, values in zip(axes[2:], (arch.resultants(), arch.carried()), strict=True):
        most = position[arch.largest(values)]
        axis.annotate(
            "largest",
            most,
            (0.4, np.copysign(max(abs(most[1]) + 0.6, 1.6), most[1])),
            fontsize=9,
            arrowprops={"arrowstyle": "->", "color": BLACK, "lw": 1.5},
        )
    return figure


def _draw_people(axes: Axes, arch: Arch, values: Floats | None, norm: Normalize) -> None:
    draw_disks(axes, arch.snapshot, PALE, values=values, norm=norm)
    ends = np.array([arch.drive.door_start_m, arch.drive.door_end_m])
    along = 50.0 * (ends[1] - ends[0])
    draw_walls(axes, [(ends[0], ends[0] - along), (ends[1], ends[1] + along)])
    reach = arch.snapshot.position[arch.inside()]
    low, high = reach.min(0) - 0.5, np.maximum(reach.max(0), (1.5, -np.inf)) + 0.5
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    axes.set(xlabel="x (m)", ylabel="y (m)")


def engines(comparisons: Sequence[Comparison]) -> Figure:
    """Draw the sum of magnitudes at each person: percussions against each engine."""
    figure = Figure(figsize=(4.6 * len(comparisons), 5.0), layout="constrained")
    for number, comparison in enumerate(comparisons):
        axes = figure.add_subplot(1, len(comparisons), number + 1)
        penalty, rigid = (values / 1e3 for values in comparison.disk_sums())
        near = Arch.of(comparison.scene, comparison.snapshot).distance() <= NEIGHBOURHOOD_M
        top = 1.05 * float(max(penalty.max(), rigid.max()))
        axes.plot([0, top], [0, top], color=BLACK, lw=0.8, label="equal")
        far: dict[str, Any] = {
            "ms": 3.5,
            "mfc": "none",
            "mec": BLUE,
            "mew": 0.7,
            "label": "farther",
        }
        axes.plot(penalty[~near], rigid[~near], "o", **far)
        label = f"within {NEIGHBOURHOOD_M:g} m of the exit"
        close: dict[str, Any] = {"ms": 5, "color": ORANGE, "mec": BLACK, "mew": 0.5, "label": label}
        axes.plot(penalty[near], rigid[near], "s", **close)
        axes.set(xlim=(0, top), ylim=(0, top), aspect="equal")
        axes.set(xlabel="engine (kN)", ylabel="percussions, p/τ (kN)")
        axes.set_title(engine_label(comparison), fontsize=10)
        axes.legend(fontsize=8, loc="upper left")
    return figure
