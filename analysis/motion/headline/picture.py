"""The picture of a first screen: who bears how much, beside the limits of people."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure

from analysis.exposure.counts import limits_of_people
from analysis.exposure.loads import loads_of
from analysis.motion.ensemble import Ensemble
from analysis.pages.drawing import NARROW_IN, SHADES, draw_disks, draw_walls, frame
from analysis.scene.scene import Scene
from nscd.arrays import Flags, Floats

QUANTITY = "contact_largest"
# Of the picture: it stands beside words.
WIDE_IN = 6.5


def loads_picture(
    scene: Scene,
    models: Sequence[Ensemble],
    files: tuple[Path, ...] = (),
    *,
    narrow: bool = False,
) -> Figure:
    """Draw crowd 0 in its last window by the first and the last model, people shaded by their
    largest contact force between the limits of that quantity; files: of further limits; narrow: for
    a telephone."""
    shown = [models[0], models[-1]] if len(models) > 1 else list(models)
    ends = [model.series[0].final for model in shown]
    windows = [window for window in ends if window is not None]
    loads = [loads_of(scene, window).person[QUANTITY] for window in windows]
    known = limits_of_people(files)
    limits = sorted({one.number for one in known if one.quantity == QUANTITY})
    top = max(max(float(load.max(initial=0.0)) for load in loads), 1.5 * limits[-1])
    steps = [0.0, *limits, float(f"{top:.1g}")]
    norm = BoundaryNorm(steps, 256)
    inside = [_inside(scene, window.now.position) for window in windows]
    places = np.concatenate([w.now.position[i] for w, i in zip(windows, inside, strict=True)])
    margin = float(scene.snapshot.radius.max())
    width, height = np.ptp(places, axis=0)
    # below each other where that makes the better use of half a screen
    rows = len(shown) if narrow or width > height else 1
    wide = NARROW_IN if narrow else WIDE_IN
    tall = np.clip(0.75 * wide * height / width * rows**2 / len(shown), 3.0, 7.0)
    figure = Figure(figsize=(wide, float(tall) + 0.6 * rows), layout="constrained")
    every = figure.subplots(rows, len(shown) // rows, squeeze=False).ravel()
    for axes, model, window, load in zip(every, shown, windows, loads, strict=True):
        draw_disks(axes, window.now, values=load, norm=norm)
        draw_walls(axes, [(wall.start_m, wall.end_m) for wall in scene.walls])
        frame(axes, places, margin)
        axes.set_title(model.title, fontsize=9)
    bar = figure.colorbar(
        ScalarMappable(norm, mpl.colormaps[SHADES]),
        ax=list(every),
        ticks=steps[:-1],
        spacing="uniform",
        shrink=0.8,
        label="largest contact force of a person (N)",
    )
    bar.ax.set_yticklabels([f"{step:,.0f}".replace(",", "\u202f") for step in steps[:-1]])
    return figure


def _inside(scene: Scene, position: Floats) -> Flags:
    """Who has not passed the line of the door."""
    drive = scene.drive
    assert drive is not None
    inside: Flags = (position - np.array(drive.door_start_m)) @ np.array(drive.outward) < 0
    return inside
