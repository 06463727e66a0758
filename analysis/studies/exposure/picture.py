"""The plan of a room with the load drawn along its walls."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from analysis.pages import drawing
from analysis.pages.numbers import two
from analysis.scene.scene import Scene
from analysis.studies.exposure.positions import profile
from analysis.studies.exposure.walls import OnWalls, outlines_of


def draw_loads(scene: Scene, moments: Sequence[OnWalls]) -> Figure:
    """Draw the plan with the load along its walls, on the side that people are not on: the mean of all
    moments, paler what 90 % of them stay below, and the largest metre with its place."""
    found, outlines = profile(scene, moments), outlines_of(scene)
    mean, high, every = found["mean_kN_per_m"], found["high_kN_per_m"], np.column_stack([found["x_m"], found["y_m"]])
    worst = max((outlines.line_loads(*on)[1] for on in moments), key=lambda one: one.load)
    doors = scene.drive.gates if scene.drive else []
    shown = np.concatenate([scene.snapshot.position, every, *map(np.array, doors)])
    top = float(high.max(initial=0.0)) or 1.0
    people = scene.snapshot.position.mean(0) if len(scene.snapshot) else np.zeros(2)
    unit = 0.12 * float(np.ptp(shown, axis=0).max()) / top  # m per kN/m
    figure, (axes,) = drawing.panels(*drawing.size_of(shown, 0.3 * unit * top))
    for n in np.unique(found["outline"][high > 0.005 * top]).tolist():
        mine = found["outline"] == n
        position = every[mine]
        way = np.gradient(position, axis=0)
        normal = np.column_stack([-way[:, 1], way[:, 0]]) / np.maximum(np.hypot(*way.T), 1e-12)[:, None]
        normal *= np.sign(((position - people) * normal).sum(1) + 1e-12)[:, None]
        for load, colour in ((high[mine], drawing.PALE_BAR), (mean[mine], drawing.BLUE)):
            band = np.concatenate([position, (position + unit * load[:, None] * normal)[::-1]])
            axes.add_patch(Polygon(band, color=colour, lw=0))
    axes.plot(*scene.snapshot.position.T, ".", ms=2, color=drawing.GREY, label="people at the start")
    drawing.draw_walls(axes, [(wall.start_m, wall.end_m) for wall in scene.walls])
    for (x0, y0), (x1, y1) in doors:
        axes.plot([x0, x1], [y0, y1], color=drawing.GREEN, lw=2, ls=":", label="door")
    for colour, label in ((drawing.BLUE, "mean load"), (drawing.PALE_BAR, "95 % of moments are below")):
        axes.plot([], [], lw=6, color=colour, label=label)
    if worst.outline >= 0:
        label = f"largest metre: {two(1e-3 * worst.load)} kN/m"
        axes.plot(*worst.point, "o", mfc="none", ms=9, color=drawing.ALARM, label=label)
    drawing.frame(axes, shown, 0.6 * unit * top)
    axes.set_title(f"the widest band is {two(top)} kN/m", fontsize=8)
    drawing.legend_below(figure, axes, 3, fontsize=7)
    return figure
