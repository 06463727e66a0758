"""Pictures of the push in a corridor: the network, the decay, the wave and the impulses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.figure import Figure

from analysis.pages.drawing import (
    BLACK,
    BLUE,
    COLOURS,
    LINES,
    MARKERS,
    ORANGE,
    circles,
    contact_lines,
)
from analysis.pages.names import ENGINE_NAMES
from analysis.paper.discrete.fig2_corridor.push import Push, first_arrivals
from analysis.scene.scene import Scene
from nscd import Contacts, Percussions
from nscd.arrays import Flags, Floats


def network(scene: Scene, contacts: Contacts, answer: Percussions, local: Flags) -> Figure:
    """Above: who pushes; middle: percussions, width ∝ |p|, local dashed; below: right
    velocities."""
    figure = Figure(figsize=(8.5, 8.6), layout="constrained")
    before, middle, after = figure.subplots(3, 1, sharex=True)
    snapshot = scene.snapshot
    pushing = np.hypot(*snapshot.velocity.T) > 0
    for axes in (before, middle, after):
        for chosen, colour, hatch in ((~pushing, "#EEF3F7", ""), (pushing, "#F6D9A8", "////")):
            disks = circles(snapshot, chosen)
            axes.add_collection(
                PatchCollection(
                    disks, facecolor=colour, edgecolor="#777777", linewidth=0.5, hatch=hatch
                )
            )
        axes.add_collection(
            LineCollection(
                [(w.start_m, w.end_m) for w in scene.walls], colors=BLACK, linewidths=2.5
            )
        )
        axes.set(
            xlim=(-0.6, snapshot.position[:, 0].max() + 0.6),
            ylim=(-1.25, 1.25),
            aspect="equal",
            ylabel="y (m)",
        )
    after.set_xlabel("x (m)")
    before.set_title("left velocities", fontsize=10)
    _arrows(before, snapshot.position, snapshot.velocity, 0.2)
    lines = contact_lines(snapshot, contacts)
    size = np.hypot(*answer.impulse.T)
    carries = size > 1e-6 * size.max()
    for chosen, colour, style, words in (
        (carries & ~local, BLUE, "solid", "non-local"),
        (carries & local, BLACK, (0, (2, 1)), "local (a pushing disk takes part)"),
    ):
        middle.add_collection(
            LineCollection(
                list(lines[chosen]),
                linewidths=list(7 * size[chosen] / size.max()),
                colors=colour,
                linestyles=[style],
                label=words,
                capstyle="butt",
            )
        )
    handles = [
        middle.plot([], [], color=c, ls=s, lw=3, label=w)[0]
        for c, s, w in (
            (BLUE, "-", "non-local"),
            (BLACK, (0, (2, 1)), "local (a pushing disk takes part)"),
        )
    ]
    middle.set_title(f"percussions; the widest is {size.max():.0f} N·s", fontsize=10)
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=8)
    after.set_title("right velocities (arrows four times as long as above)", fontsize=10)
    _arrows(after, snapshot.position, answer.right_velocity, 0.8)
    return figure


def _arrows(axes: Axes, position: Floats, velocity: Floats, metres_per_speed: float) -> None:
    moving = np.hypot(*velocity.T) > 1e-6
    axes.quiver(
        *position[moving].T,
        *(metres_per_speed * velocity[moving]).T,
        angles="xy",
        scale_units="xy",
        scale=1,
        color=BLACK,
        width=0.003,
    )


def decay(
    distance: Floats,
    flux: Floats,
    columns: Floats,
    largest: Floats,
    soft: Sequence[tuple[str, Floats]],
) -> Figure:
    """Left: momentum along x passed through each gap between columns (m,) N·s: percussions, the
    closed form of columns that move as one, soft contacts. Right: the largest percussion in it."""
    figure = Figure(figsize=(9.5, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(distance, flux, MARKERS[0], color=BLACK, label="percussions")
    left.plot(distance, columns, "-", color=BLACK, lw=1, label="(5), (6) for whole columns")
    for number, (label, values) in enumerate(soft):
        left.plot(
            distance,
            values,
            MARKERS[number + 1],
            ls=LINES[number + 1],
            color=COLOURS[number],
            mfc="none",
            ms=5,
            label=label,
        )
    left.set(xlabel="distance from the pushing column (m)", ylabel="impulse along x (N·s)")
    left.set_ylim(
        0, 1.3 * max(float(values.max()) for values in (flux, columns, *(v for _, v in soft)))
    )
    left.legend(fontsize=8)
    right.plot(distance, largest, MARKERS[0], ls="-", color=BLUE)
    right.set(
        xlabel="distance from the pushing column (m)", ylabel="largest percussion in the gap (N·s)"
    )
    right.set_ylim(bottom=0)
    for axes in (left, right):
        axes.grid(alpha=0.3)
    return figure


def wave(pushes: Sequence[Push], closed_form: Floats) -> Figure:
    """Left: first arrival in each column against the distance. Right: front speed against
    stiffness, with the long-wave speed of the springs."""
    figure = Figure(figsize=(10.0, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    stiffnesses = sorted({push.stiffness for push in pushes})
    restitutions = sorted({push.restitution for push in pushes})
    for push in pushes:
        if push.engine != pushes[0].engine:
            continue
        x, first = first_arrivals(push.comparison.snapshot.position[:, 0], push.arrival)
        number, kind = stiffnesses.index(push.stiffness), restitutions.index(push.restitution)
        later = first > 0
        left.plot(
            x[later] - x[0],
            first[later],
            MARKERS[number],
            ls=LINES[kind],
            color=COLOURS[number],
            mfc="none" if kind else COLOURS[number],
            ms=4,
            label=f"k = {push.stiffness:.0e} N/m, e = {push.restitution:g}",
        )
    left.set(
        yscale="log", xlabel="distance from the pushing column (m)", ylabel="first arrival (s)"
    )
    handles, labels = left.get_legend_handles_labels()
    left.legend(handles, labels, fontsize=7, loc="lower right")
    left.set_title(f"{ENGINE_NAMES[pushes[0].engine]}; percussions arrive at once", fontsize=10)
    kinds = sorted({(push.engine, push.restitution) for push in pushes})
    for number, (engine, restitution) in enumerate(kinds):
        chosen = [p for p in pushes if (p.engine, p.restitution) == (engine, restitution)]
        right.plot(
            [p.stiffness for p in chosen],
            [p.speed for p in chosen],
            MARKERS[number],
            ms=10 - 2 * number,
            mfc="none",
            color=COLOURS[number],
            label=f"{ENGINE_NAMES[engine]}, e = {restitution:g}",
        )
    right.plot(stiffnesses, closed_form, "-", color=BLACK, lw=1, label="long waves, d √(K/m), ∝ √k")
    right.set(
        xscale="log", yscale="log", xlabel="stiffness k (N/m)", ylabel="speed of the front (m/s)"
    )
    right.legend(fontsize=8)
    for axes in (left, right):
        axes.grid(alpha=0.3, which="both")
    return figure


def impulses(
    stiffness: Sequence[Push], damping: Sequence[Push], difference: Sequence[Floats]
) -> Figure:
    """∫f dt against p contact by contact for runs of falling restitution, and the difference
    against k and ζ.

    difference: rows of (value, relative difference) for the stiffness runs and for the damping
    runs."""
    figure = Figure(figsize=(11.0, 3.9), layout="constrained")
    cloud, by_stiffness, by_damping = figure.subplots(1, 3)
    top = 0.0
    for number, push in enumerate((damping[0], damping[-1])):
        soft, rigid = push.comparison.match.normal_parts()
        top = max(top, float(rigid.max()), float(soft.max()))
        cloud.plot(
            rigid,
            soft,
            MARKERS[number],
            ms=4,
            mfc="none" if number == 0 else BLUE,
            mec=ORANGE if number == 0 else BLUE,
            label=f"e = {push.restitution:g} (ζ = {push.comparison.record.damping_ratio:.2g})",
        )
    cloud.plot([0, top], [0, top], "-", color=BLACK, lw=0.8, label="equal")
    cloud.set(xlabel="percussion p (N·s)", ylabel="∫f dt (N·s)", aspect="equal")
    engines = sorted({push.engine for push in stiffness})
    for number, engine in enumerate(engines):
        at = np.array([push.engine == engine for push in stiffness])
        by_stiffness.plot(
            *difference[0][at].T,
            MARKERS[number],
            ls=LINES[number],
            ms=9 - 4 * number,
            mfc="none",
            color=COLOURS[number],
            label=f"{ENGINE_NAMES[engine]}, e = {stiffness[0].restitution:g}",
        )
    by_stiffness.set(
        xscale="log", xlabel="stiffness k (N/m)", ylabel="rms(∫f dt − p) / rms(∫f dt) (–)"
    )
    by_stiffness.set_ylim(0, 1.15 * difference[0][:, 1].max())
    by_damping.plot(
        *difference[1].T,
        MARKERS[0],
        ls="-",
        color=BLUE,
        label=f"{ENGINE_NAMES[damping[0].engine]}, k = {damping[0].stiffness:.0e} N/m",
    )
    by_damping.set(xscale="log", yscale="log", xlabel="damping ratio ζ (–)")
    by_damping.set_ylabel("rms(∫f dt − p) / rms(∫f dt) (–)")
    for axes in (cloud, by_stiffness, by_damping):
        axes.grid(alpha=0.3, which="both")
        axes.legend(fontsize=7)
    return figure
