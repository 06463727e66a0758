"""Pictures of the report: data → Figure, one function per chart."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from analysis.compare.comparison import FORCE, Comparison
from analysis.compare.statistics import statistics
from analysis.pages.drawing import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    LINES,
    MARKERS,
    NARROW_IN,
    ORANGE,
    PALE_BLUE,
    add_scale,
    contact_lines,
    draw_disks,
    draw_forces,
    draw_vectors,
    draw_walls,
    frame,
    size_of,
)
from analysis.pages.names import engine_label, engine_name
from analysis.scene.scene import Scene
from nscd.arrays import Floats


def scene_picture(scene: Scene) -> Figure:
    """Draw the initial state: disks, walls, the door, and who moves or walks where."""
    snapshot, drive = scene.snapshot, scene.drive
    shown = snapshot.position
    if drive and drive.goals:
        shown = np.concatenate([shown, *(exit_.door for exit_ in drive.doors)])
    size = size_of(shown, float(snapshot.radius.max()), 1)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    draw_disks(axes, snapshot, PALE_BLUE)
    draw_walls(axes, _walls(scene))
    velocity = (
        drive.desired_velocity(snapshot.position, snapshot.ids) if drive else snapshot.velocity
    )
    moving = np.hypot(*velocity.T) > 0
    if moving.any():
        x, v = snapshot.position[moving], velocity[moving]
        label = "desired direction" if drive else "velocity at the start"
        length = 1.5 * snapshot.radius.mean() / np.hypot(*velocity.T).max()
        draw_vectors(axes, x, length * v, color=ORANGE, width=0.003, label=label)
    if drive:
        for number, exit_ in enumerate(drive.doors):
            (x0, y0), (x1, y1) = exit_.door
            name = None if number else "door"
            axes.plot([x0, x1], [y0, y1], color=GREEN, lw=3, ls=":", label=name)
    if axes.get_legend_handles_labels()[0]:
        figure.legend(loc="outside lower center", ncols=3, fontsize=8)
    frame(axes, shown, float(snapshot.radius.max()))
    return figure


def force_networks(comparisons: Sequence[Comparison], *, narrow: bool = False) -> Figure:
    """Draw the contact forces of each engine and of the rigid model on the same snapshot, side by
    side or, for a telephone, below each other.

    Width and shade grow with the normal force, on one scale."""
    parts = [(engine_label(c), c, c.match.normal_parts()[0]) for c in comparisons]
    first = comparisons[0]
    snapshot_of = f"Percussions on the {engine_name(first.record.engine)} snapshot"
    parts.append((snapshot_of, first, first.match.normal_parts()[1]))
    view = _lines(comparisons[0]).reshape(-1, 2)
    radius = float(comparisons[0].snapshot.radius.max())
    size = size_of(view, radius, len(parts), narrow=narrow)
    figure = Figure(figsize=size, layout="constrained")
    every = np.concatenate([force[force > 0] for _, _, force in parts])
    top = float(np.quantile(every, 0.99)) if len(every) else 1.0
    norm = Normalize(0.0, top)
    for number, (label, comparison, force) in enumerate(parts):
        axes = figure.add_subplot(*_grid(len(parts), narrow), number + 1)
        snapshot = comparison.snapshot
        draw_disks(axes, snapshot)
        draw_walls(axes, _walls(comparison.scene))
        draw_forces(axes, _lines(comparison), force, norm)
        axes.set_title(label, fontsize=10)
        frame(axes, view, float(snapshot.radius.max()))
    unit = comparisons[0].unit
    quantity = "normal contact force" if unit == FORCE else "normal contact impulse"
    add_scale(figure, figure.axes, norm, f"{quantity} ({unit})", narrow=narrow)
    return figure


def carried_maps(comparison: Comparison, *, narrow: bool = False) -> Figure:
    """Draw what each disk carries, the sum of the magnitudes of its normal forces.

    Penalty and rigid, on one scale."""
    sums = comparison.disk_sums()
    lines = _lines(comparison).reshape(-1, 2)
    size = size_of(lines, float(comparison.snapshot.radius.max()), 2, narrow=narrow)
    figure = Figure(figsize=size, layout="constrained")
    norm = Normalize(0.0, float(np.quantile(np.concatenate(sums), 0.995)) or 1.0)
    labels = (engine_label(comparison), "Percussions")
    for axes, label, values in zip(figure.subplots(*_grid(2, narrow)), labels, sums, strict=True):
        snapshot = comparison.snapshot
        draw_disks(axes, snapshot, values=values, norm=norm)
        draw_walls(axes, _walls(comparison.scene))
        axes.set_title(label, fontsize=10)
        frame(axes, lines, float(snapshot.radius.max()))
    words = f"sum of normal magnitudes ({comparison.unit})"
    add_scale(figure, figure.axes, norm, words, narrow=narrow)
    return figure


def scatter(comparisons: Sequence[Comparison], *, narrow: bool = False) -> Figure:
    """Draw rigid against penalty, contact by contact; filled where mechanics determines the rigid
    force."""
    columns = 1 if narrow else min(len(comparisons), 4)
    rows = -(-len(comparisons) // columns)
    figure = Figure(figsize=(3.9 * columns, 3.9 * rows + 0.4), layout="constrained")
    for number, comparison in enumerate(comparisons):
        axes = figure.add_subplot(rows, columns, number + 1)
        penalty, rigid = comparison.match.normal_parts()
        fixed = comparison.match.determined
        top = 1.05 * max(float(penalty.max()), float(rigid.max()), 1e-12)
        low = min(0.0, 1.05 * float(penalty.min()), 1.05 * float(rigid.min()))
        axes.plot([low, top], [low, top], color=BLACK, lw=0.8, label="equal")
        axes.plot(
            penalty[~fixed], rigid[~fixed], "o", ms=4, mfc="none", mec=ORANGE, mew=0.8,
            label="not determined, or in one model only",
        )  # fmt: skip
        axes.plot(penalty[fixed], rigid[fixed], "s", ms=2.5, color=BLUE, label="determined")
        unit = comparison.unit
        axes.set(xlim=(low, top), ylim=(low, top), aspect="equal", title=engine_label(comparison))
        axes.set_xlabel(f"penalty ({'contact force' if unit == FORCE else '∫f dt'}, {unit})")
        axes.set_ylabel(f"rigid ({'p/τ' if unit == FORCE else 'percussion p'}, {unit})")
        axes.title.set_fontsize(10)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    ncols = 1 if narrow else 3
    figure.legend(handles, labels, loc="outside lower center", ncols=ncols, fontsize=8)
    return figure


def distributions(comparisons: Sequence[Comparison], *, narrow: bool = False) -> Figure:
    """Draw the share of contacts whose normal force exceeds f, over its mean.

    The penalty model of each run, and the rigid one."""
    figure = Figure(figsize=(NARROW_IN, 3.6) if narrow else (6.5, 4.0), layout="constrained")
    axes = figure.add_subplot()
    for number, comparison in enumerate(comparisons):
        penalty, rigid = comparison.match.normal_parts()
        colour, width = COLOURS[number % 4], 3.0 / (number + 1)
        label, had = engine_label(comparison), penalty[comparison.match.in_penalty]
        _exceedance(axes, had, label, color=colour, lw=width)
        if not number:
            label, had = "percussions on the same snapshot", rigid[comparison.match.in_rigid]
            _exceedance(axes, had, label, color=BLACK, ls="--", lw=1.2)
    axes.set(yscale="log", xlabel="normal force / its mean over pressed contacts")
    axes.set_ylabel("share of pressed contacts beyond")
    axes.grid(alpha=0.3)
    if axes.lines:
        axes.legend(fontsize=7)
    else:
        axes.text(0.5, 0.5, "too few contacts", ha="center", transform=axes.transAxes)
    return figure


def stiffness_study(comparisons: Sequence[Comparison], *, narrow: bool = False) -> Figure:
    """Draw the relative difference of rigid and penalty forces against the stiffness.

    With a guide of the slope of 1/k."""
    figure = Figure(figsize=(NARROW_IN, 3.6) if narrow else (6.5, 4.0), layout="constrained")
    axes = figure.add_subplot()
    engines = sorted({c.record.engine for c in comparisons})
    kinds = (
        ("contact", "all contacts", BLUE),
        ("determined", "determined contacts", ORANGE),
        ("disk_sum", "sum at each disk", GREEN),
    )
    stiffness = np.array(sorted({c.scene.contact.stiffness_N_per_m for c in comparisons}))
    for row, engine in enumerate(engines):
        chosen = sorted(
            (c for c in comparisons if c.record.engine == engine),
            key=lambda c: c.scene.contact.stiffness_N_per_m,
        )
        for kind, words, colour in kinds:
            values = [statistics(c)[f"{kind}_relative_difference"] for c in chosen]
            x = [c.scene.contact.stiffness_N_per_m for c in chosen]
            axes.plot(
                x, values, MARKERS[row], ls=LINES[row], color=colour,
                mfc="none" if row else colour, label=f"{engine_name(engine)}: {words}",
            )  # fmt: skip
    first = [
        v for line in axes.lines if np.isfinite(v := np.asarray(line.get_ydata())[0]) and v > 0
    ]
    if first and len(stiffness) > 1:
        guide = max(first) * stiffness[0] / stiffness
        axes.plot(stiffness, guide, color=GREY, lw=1, label="slope −1")
    axes.set(xscale="log", yscale="log", xlabel="stiffness k (N/m)")
    axes.set_ylabel("rms(rigid − penalty) / rms(penalty)")
    axes.grid(alpha=0.3, which="both")
    axes.legend(fontsize=7)
    return figure


def _exceedance(axes: Axes, force: Floats, label: str, **look: Any) -> None:
    pressed = np.sort(force[force > 1e-9 * force.max(initial=0.0)])
    if len(pressed) > 1:
        beyond = 1.0 - np.arange(len(pressed)) / len(pressed)
        axes.step(pressed / pressed.mean(), beyond, label=label, **look)


def _grid(panels: int, narrow: bool) -> tuple[int, int]:
    """Rows and columns of so many panels."""
    return (panels, 1) if narrow else (1, panels)


def _lines(comparison: Comparison) -> Floats:
    return contact_lines(comparison.snapshot, comparison.match.contacts)


def _walls(scene: Scene) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    return [(wall.start_m, wall.end_m) for wall in scene.walls]
