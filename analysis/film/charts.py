"""Pictures of a film: its headline numbers over time, and the frame that carries most."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from analysis.exposure.counts import limits_of_people
from analysis.film.frame import ENGINE, HEADLINES, RIGID, Frame, Reel
from analysis.film.summary import JUMP, band, jumps, unit_of
from analysis.pages.drawing import (
    BLUE,
    COLOURS,
    GREY,
    LINES,
    NARROW_IN,
    VERMILION,
    add_scale,
    contact_lines,
    draw_disks,
    draw_forces,
    draw_walls,
    frame,
    size_of,
)
from analysis.pages.numbers import significant
from analysis.percussions.setting import FORCE

# Shades of what the mechanics leaves open, and of the band of all radii.
FAINT, FAINTER = 0.35, 0.15
# Labels of limits are at least this share of the axis apart.
BETWEEN = 0.08


def draw_series(reels: Sequence[Reel], *, narrow: bool = False) -> Figure:
    """Draw each headline number over time, those of two units apart: of runs every model, of a
    filmed crowd the middle radius within the band of all; crosses where percussions are not solved;
    narrow: for a telephone."""
    panels = {
        (key, unit_of(reel, model, key)): None
        for key in HEADLINES
        for reel in reels
        for model in reel.models
        if any(key in one.values.get(model, {}) for one in reel.frames)
    }
    size = (NARROW_IN if narrow else 8.0, 2.2 * len(panels) + 1.0)
    figure = Figure(figsize=size, layout="constrained")
    every = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (key, unit) in zip(every, panels, strict=True):
        if reels[0].radius is not None:
            _draw_radii(axes, reels, key)
        else:
            _draw_models(axes, reels, key, unit)
        title = HEADLINES[key].title.replace(" of the", "\nof the").replace(" within", "\nwithin")
        axes.set_ylabel(f"{title} ({unit})", fontsize=8)
        axes.set_ylim(bottom=0)
        axes.grid(alpha=0.3)
        if key == "contact_largest" and unit == FORCE:
            _draw_limits(axes, key)
        # an empty line that is not clipped would upset the layout
        for bad in ([one.time for one in reel.unsolved] for reel in reels if reel.unsolved):
            axes.plot(bad, np.zeros(len(bad)), "x", color=VERMILION, clip_on=False, zorder=5)
    every[-1].set_xlabel("time (s)")
    named = {name: line for axes in every for line, name in
             zip(*axes.get_legend_handles_labels(), strict=True)}  # fmt: skip
    figure.legend(named.values(), named.keys(), fontsize=8, ncols=1 if narrow else 2,
                  loc="outside upper center")  # fmt: skip
    return figure


def _draw_radii(axes: Axes, reels: Sequence[Reel], key: str) -> None:
    """The middle radius; what the mechanics leaves open; the band of all radii."""
    spans = [_series(reel, RIGID, key) for reel in reels]
    time, middle, low, high = spans[len(spans) // 2]
    shared = sorted({t for span in spans for t in span[0]})
    lowest, highest = (
        [pick(span[k][list(span[0]).index(t)] for span in spans if t in span[0]) for t in shared]
        for k, pick in ((2, min), (3, max))
    )
    radii = [reel.radius for reel in reels if reel.radius]
    if len(reels) > 1:
        label = f"radii {min(radii):g} to {max(radii):g} m"
        axes.fill_between(shared, lowest, highest, color=BLUE, alpha=FAINTER, lw=0, label=label)
    if np.any(high > low):
        axes.fill_between(time, low, high, color=BLUE, alpha=FAINT, lw=0,
                          label="all admissible forces")  # fmt: skip
    reel = reels[len(reels) // 2]
    axes.plot(time, middle, color=BLUE, lw=1.2, label=reel.title)
    jumped = {n for n, share in jumps(reel)[key].items() if abs(share) > JUMP}
    at = [frame.time for frame in reel.frames if frame.number in jumped]
    label = f"jumps since the frame before, {reel.title}"
    axes.plot(at, middle[np.isin(time, at)], "o", mfc="none", ms=4, color=VERMILION, label=label)


def _draw_models(axes: Axes, reels: Sequence[Reel], key: str, unit: str) -> None:
    """Every model of every run that has the unit, percussions dashed."""
    for reel, colour in zip(reels, cycle(COLOURS), strict=False):
        for model, line in zip(reel.models, LINES, strict=False):
            if unit_of(reel, model, key) != unit:
                continue
            time, value, low, high = _series(reel, model, key)
            label = reel.title if model == ENGINE else f"percussions, at the places of {reel.title}"
            axes.plot(time, value, color=colour, ls=line, lw=1.2, label=label)
            if np.any(high > low):
                axes.fill_between(time, low, high, color=colour, alpha=FAINT, lw=0)


def _series(reel: Reel, model: str, key: str) -> tuple[np.ndarray, ...]:
    """Times and values with their ends, of the frames that have the number."""
    unsolved = reel.unsolved if model == RIGID else []
    rows = [
        (one.time, one.values[model][key].value, *band(one.values[model][key]))
        for one in reel.frames
        if one not in unsolved and key in one.values.get(model, {})
    ]
    return tuple(np.array(rows, dtype=np.float64).reshape(-1, 4).T)


def _draw_limits(axes: Axes, key: str) -> None:
    """The limits of a force on a person, as far as the axis goes."""
    top, labelled = axes.get_ylim()[1], -np.inf
    for limit in limits_of_people():
        if limit.quantity != key or limit.number > top:
            continue
        axes.axhline(limit.number, color=GREY, lw=0.8, ls=":")
        if limit.number - labelled > BETWEEN * top:
            labelled = limit.number
            words = f"{significant(limit.number, 4)} N"
            place = 1.005, limit.number / top
            axes.text(*place, words, fontsize=6, va="center", transform=axes.transAxes)


def draw_still(reel: Reel, shown: Frame, *, narrow: bool = False) -> Figure:
    """Draw one frame: people, walls, and what the contacts carry in the last model; narrow: for a
    telephone."""
    model = reel.models[-1]
    assert shown.found is not None
    assert shown.match is not None
    now, size = shown.found.snapshot, shown.size(model)
    walls = [(wall.start_m, wall.end_m) for wall in reel.scene.walls]
    points = np.concatenate([now.position, *(np.array(wall) for wall in walls)])
    margin = float(now.radius.max())
    figure = Figure(figsize=size_of(points, margin, 1, narrow=narrow), layout="constrained")
    axes = figure.subplots()
    norm = Normalize(0, float(size.max(initial=0.0)) or 1.0)
    draw_disks(axes, now)
    draw_walls(axes, walls)
    draw_forces(axes, contact_lines(now, shown.match.contacts), size, norm)
    frame(axes, points, margin)
    add_scale(figure, axes, norm, f"per contact ({shown.unit(model)})", narrow=narrow)
    return figure
