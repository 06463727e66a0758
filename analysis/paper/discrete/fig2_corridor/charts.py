"""Pictures of the push in a corridor: the network, the decay, the wave and the impulses."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.figure import Figure

from analysis.pages import numbers
from analysis.pages.drawing import (
    BLACK,
    BLUE,
    COLOURS,
    DARK_GREY,
    LINES,
    MARKERS,
    ORANGE,
    PALE_ORANGE,
    PALER_BLUE,
    circles,
    contact_lines,
    draw_vectors,
    draw_walls,
)
from analysis.pages.names import ENGINE_NAMES
from analysis.paper.discrete.fig2_corridor.final import Final
from analysis.paper.discrete.fig2_corridor.push import Push
from analysis.paper.discrete.fig2_corridor.study import Corridor, soft_flux
from analysis.scene.scene import Scene
from nscd.arrays import Floats

KINDS: Sequence[tuple[str, str, Any]] = (
    ("non-local", BLUE, "-"),
    ("local (a pushing disk takes part)", BLACK, (0, (2, 1))),
)
RESTING, PUSHING = PALER_BLUE, PALE_ORANGE
DIFFERENCE = "rms(∫f dt − p) / rms(∫f dt) (–)"


def network(corridor: Corridor) -> Figure:
    """Draw who pushes above; percussions, width ∝ |p|, local dashed; right velocities below."""
    figure = Figure(figsize=(8.5, 8.6), layout="constrained")
    before, middle, after = figure.subplots(3, 1, sharex=True)
    snapshot, answer, size = corridor.scene.snapshot, corridor.found.answer, corridor.size
    for axes in (before, middle, after):
        _draw_corridor(axes, corridor)
    after.set_xlabel("x (m)")
    before.set_title("left velocities", fontsize=10)
    _arrows(before, snapshot.position, snapshot.velocity, 0.2)
    lines = contact_lines(snapshot, corridor.found.contacts)
    for chosen, (_, colour, style) in zip((~corridor.local, corridor.local), KINDS, strict=True):
        shown = corridor.carries & chosen
        middle.add_collection(
            LineCollection(
                list(lines[shown]),
                linewidths=list(7 * size[shown] / size.max()),
                colors=colour,
                linestyles=[style],
                capstyle="butt",
            )
        )
    handles = [middle.plot([], [], color=c, ls=s, lw=3, label=words)[0] for words, c, s in KINDS]
    middle.set_title(f"percussions; the widest is {size.max():.0f} N·s", fontsize=10)
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=8)
    after.set_title("right velocities (arrows four times as long as above)", fontsize=10)
    _arrows(after, snapshot.position, answer.right_velocity, 0.8)
    return figure


def final(finals: Sequence[Final], scene: Scene) -> Figure:
    """Draw where everybody is at the end, a panel for each model; outlines: where they began."""
    figure = Figure(figsize=(8.5, 2.7 * len(finals)), layout="constrained")
    panels = figure.subplots(len(finals), 1, sharex=True, squeeze=False)[:, 0]
    style: dict[str, Any] = {"edgecolor": DARK_GREY, "linewidth": 0.5}
    for axes, one in zip(panels, finals, strict=True):
        now = replace(scene.snapshot, position=one.position)
        for chosen, colour, hatch in ((one.resting, RESTING, ""), (~one.resting, PUSHING, "////")):
            disks = circles(now, chosen)
            axes.add_collection(PatchCollection(disks, facecolor=colour, hatch=hatch, **style))
        before = circles(scene.snapshot)
        outline = PatchCollection(before, facecolor="none", edgecolor=BLUE, lw=0.6, ls=":")
        axes.add_collection(outline)
        draw_walls(axes, [(wall.start_m, wall.end_m) for wall in scene.walls])
        low, high = one.position[:, 0].min() - 0.6, one.position[:, 0].max() + 0.6
        axes.set(xlim=(low, high), ylim=(-1.25, 1.25), aspect="equal", ylabel="y (m)")
        axes.set_title(one.model, fontsize=10)
    panels[-1].set_xlabel("x (m)")
    return figure


def _draw_corridor(axes: Axes, corridor: Corridor) -> None:
    snapshot = corridor.scene.snapshot
    for chosen, colour, hatch in (
        (corridor.resting, RESTING, ""),
        (~corridor.resting, PUSHING, "////"),
    ):
        style: dict[str, Any] = {"facecolor": colour, "edgecolor": DARK_GREY, "linewidth": 0.5}
        axes.add_collection(PatchCollection(circles(snapshot, chosen), hatch=hatch, **style))
    draw_walls(axes, [(wall.start_m, wall.end_m) for wall in corridor.scene.walls])
    end = snapshot.position[:, 0].max() + 0.6
    axes.set(xlim=(-0.6, end), ylim=(-1.25, 1.25), aspect="equal", ylabel="y (m)")


def _arrows(axes: Axes, position: Floats, velocity: Floats, metres_per_speed: float) -> None:
    moving = np.hypot(*velocity.T) > 1e-6
    shown = metres_per_speed * velocity[moving]
    draw_vectors(axes, position[moving], shown, color=BLACK, width=0.003)


def decay(corridor: Corridor) -> Figure:
    """Draw the momentum along x that goes through each gap between columns (percussions, the closed
    form of columns that move as one, soft contacts), and the largest percussion in it."""
    figure = Figure(figsize=(9.5, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    gaps = corridor.gaps
    left.plot(gaps.distance, gaps.flux, MARKERS[0], color=BLACK, label="percussions")
    words = "(5), (6) for whole columns"
    left.plot(gaps.distance, gaps.columns, "-", color=BLACK, lw=1, label=words)
    top = max(gaps.flux.max(), gaps.columns.max())
    for number, push in enumerate(corridor.damped[1::2]):
        values = soft_flux(push)
        top = max(top, values.max())
        style = {"ls": LINES[number + 1], "color": COLOURS[number], "mfc": "none", "ms": 5}
        label = f"LAMMPS, ζ = {push.damping:.2g}"
        left.plot(gaps.distance, values, MARKERS[number + 1], label=label, **style)
    left.set(ylabel="impulse along x (N·s)", ylim=(0, 1.3 * top))
    left.legend(fontsize=8)
    right.plot(gaps.distance, gaps.largest, MARKERS[0], ls="-", color=BLUE)
    right.set_ylabel("largest percussion in the gap (N·s)")
    right.set_ylim(bottom=0)
    for axes in (left, right):
        axes.set_xlabel("distance from the pushing column (m)")
        axes.grid(alpha=0.3)
    return figure


def wave(corridor: Corridor) -> Figure:
    """Draw the first arrival in each column against the distance, and the front's speed against the
    stiffness, with the long-wave speed of the springs."""
    figure = Figure(figsize=(10.0, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    stiffnesses = sorted({push.stiffness for push in corridor.waves})
    _arrivals(left, [p for p in corridor.waves if p.engine == corridor.waves[0].engine])
    kinds = sorted({(push.engine, push.restitution) for push in corridor.waves})
    for number, (engine, restitution) in enumerate(kinds):
        chosen = [p for p in corridor.waves if (p.engine, p.restitution) == (engine, restitution)]
        right.plot(
            [p.stiffness for p in chosen],
            [p.speed for p in chosen],
            MARKERS[number],
            ms=10 - 2 * number,
            mfc="none",
            color=COLOURS[number],
            label=f"{ENGINE_NAMES[engine]}, e = {restitution:g}",
        )
    closed = [corridor.long_wave(stiffness) for stiffness in stiffnesses]
    right.plot(stiffnesses, closed, "-", color=BLACK, lw=1, label="long waves, d √(K/m), ∝ √k")
    right.set(xscale="log", yscale="log", xlabel="stiffness k (N/m)")
    right.set_ylabel("speed of the front (m/s)")
    right.legend(fontsize=8)
    for axes in (left, right):
        axes.grid(alpha=0.3, which="both")
    return figure


def _arrivals(axes: Axes, pushes: Sequence[Push]) -> None:
    stiffnesses = sorted({push.stiffness for push in pushes})
    restitutions = sorted({push.restitution for push in pushes})
    for push in pushes:
        x, first = push.first_arrivals
        number, kind = stiffnesses.index(push.stiffness), restitutions.index(push.restitution)
        later = first > 0
        axes.plot(
            x[later] - x[0],
            first[later],
            MARKERS[number],
            ls=LINES[kind],
            color=COLOURS[number],
            mfc="none" if kind else COLOURS[number],
            ms=4,
            label=f"k = {numbers.number(push.stiffness)} N/m, e = {push.restitution:g}",
        )
    axes.set(yscale="log", xlabel="distance from the pushing column (m)")
    axes.set_ylabel("first arrival (s)")
    axes.legend(fontsize=7, loc="lower right")
    axes.set_title(f"{ENGINE_NAMES[pushes[0].engine]}; percussions arrive at once", fontsize=10)


def impulses(corridor: Corridor) -> Figure:
    """Draw ∫f dt against p contact by contact for the least and the most damping, and their
    difference against k and ζ."""
    figure = Figure(figsize=(11.0, 3.9), layout="constrained")
    cloud, by_stiffness, by_damping = figure.subplots(1, 3)
    _cloud(cloud, (corridor.damped[0], corridor.damped[-1]))
    for number, engine in enumerate(sorted({push.engine for push in corridor.inelastic})):
        mine = [push for push in corridor.inelastic if push.engine == engine]
        by_stiffness.plot(
            [push.stiffness for push in mine],
            [push.difference for push in mine],
            MARKERS[number],
            ls=LINES[number],
            ms=9 - 4 * number,
            mfc="none",
            color=COLOURS[number],
            label=f"{ENGINE_NAMES[engine]}, e = {mine[0].restitution:g}",
        )
    top = max(push.difference for push in corridor.inelastic)
    by_stiffness.set(xscale="log", xlabel="stiffness k (N/m)", ylim=(0, 1.15 * top))
    damped = corridor.damped
    label = f"{ENGINE_NAMES[damped[0].engine]}, k = {numbers.number(damped[0].stiffness)} N/m"
    values = [[push.damping for push in damped], [push.difference for push in damped]]
    by_damping.plot(*values, MARKERS[0], ls="-", color=BLUE, label=label)
    by_damping.set(xscale="log", yscale="log", xlabel="damping ratio ζ (–)")
    for axes in (by_stiffness, by_damping):
        axes.set_ylabel(DIFFERENCE)
    for axes in (cloud, by_stiffness, by_damping):
        axes.grid(alpha=0.3, which="both")
        axes.legend(fontsize=7)
    return figure


def _cloud(axes: Axes, pushes: Sequence[Push]) -> None:
    top = 0.0
    for number, push in enumerate(pushes):
        soft, rigid = push.comparison.match.normal_parts()
        top = max(top, float(rigid.max()), float(soft.max()))
        axes.plot(
            rigid,
            soft,
            MARKERS[number],
            ms=4,
            mfc="none" if number == 0 else BLUE,
            mec=ORANGE if number == 0 else BLUE,
            label=f"e = {push.restitution:g} (ζ = {push.damping:.2g})",
        )
    axes.plot([0, top], [0, top], "-", color=BLACK, lw=0.8, label="equal")
    axes.set(xlabel="percussion p (N·s)", ylabel="∫f dt (N·s)", aspect="equal")
