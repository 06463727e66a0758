"""What every picture shares: the palette, disks, walls, contact lines, sizes and frames.

The colours are Okabe and Ito's, which the colour-blind tell apart; markers, dashes or hatches
repeat what they say. Shades of a quantity run from light (little) to dark (much) in every picture.
"""

import textwrap
from collections.abc import Iterable, Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.colorbar import Colorbar
from matplotlib.colors import LinearSegmentedColormap, Normalize, to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from analysis.scene.scene import Scene
from nscd import Snapshot
from nscd.arrays import Floats, Mask

BLUE, ORANGE, GREEN, PINK = "#0072B2", "#E69F00", "#009E73", "#CC79A7"
SKY, VERMILION, YELLOW, BLACK = "#56B4E9", "#D55E00", "#F0E442", "#000000"
# edges and quiet lines, levels, the grid, disks that carry no value
DARK_GREY, GREY, GRID, PALE = "#666666", "#BBBBBB", "#E5E5E5", "#F2F2F2"
# faces of disks that wait, walk or push; words in yellow
WHITE, PALE_BLUE, PALER_BLUE, PALE_ORANGE = "#FFFFFF", "#DDEAF3", "#EEF3F7", "#F6D9A8"
DARK_YELLOW = "#6B6100"
COLOURS = (BLUE, ORANGE, GREEN, PINK)
EVERY_COLOUR = (BLACK, *COLOURS, SKY, VERMILION, GREY, DARK_GREY)
MARKERS = "osD^v"
LINES = ("-", "--", ":", "-.")
SHADES = "viridis_r"
# Of ranges as a page of style.html draws them: the wide bar, and limits.
PALE_BAR, ALARM = "#B5D3E7", "#B00020"
# Of people: below all limits pale and cold; from limit to limit warmer and darker.
BELOW, ABOVE = "#C6DBEF", ("#FDC086", "#E6550D", "#7F0000")
# Inches: so wide a picture has words on a telephone as large as those beside it.
NARROW_IN = 4.4


def above_colours(count: int) -> list[str]:
    """Give the colours of people below all of so many limits, above the first, and so on."""
    above = LinearSegmentedColormap.from_list("above", ABOVE)
    return [BELOW, *(to_hex(above(fraction)) for fraction in np.linspace(0, 1, count))]


def circles(snapshot: Snapshot, chosen: Mask | None = None) -> list[Circle]:
    """Make circles of the disks, or of the chosen ones (n,)."""
    shown = np.ones(len(snapshot), dtype=bool) if chosen is None else chosen
    positions = zip(snapshot.position[shown], snapshot.radius[shown], strict=True)
    return [Circle((x, y), r) for (x, y), r in positions]


def draw_disks(
    axes: Axes,
    snapshot: Snapshot,
    colour: str | Sequence[str] = PALE,
    *,
    values: Floats | None = None,
    norm: Normalize | None = None,
) -> None:
    """Draw the disks in one colour, in one each, or in the shades of `values` (n,)."""
    # of a body of several disks the outline only
    for edge in (DARK_GREY,) if snapshot.compound is None else (DARK_GREY, "none"):
        disks = PatchCollection(circles(snapshot), edgecolor=edge, linewidth=0.3)
        if values is None:
            disks.set_facecolor(colour)
        else:
            disks.set(array=values, cmap=SHADES, norm=norm)
        axes.add_collection(disks)


def draw_walls(axes: Axes, walls: Iterable[Sequence[Sequence[float]]]) -> None:
    """Draw walls, each from its start to its end (m)."""
    lines = [np.asarray(wall, dtype=float) for wall in walls]
    label = "wall" if lines else None
    axes.add_collection(LineCollection(lines, colors=BLACK, linewidths=2.5, label=label))


def draw_forces(axes: Axes, lines: Floats, force: Floats, norm: Normalize) -> None:
    """Draw lines (k,2,2) m whose width and shade grow with the force (k,); the largest on top."""
    order = np.argsort(force)
    widths = 0.2 + 4.0 * np.clip(force[order] / (norm.vmax or 1.0), 0.0, 1.2)
    drawn = LineCollection(list(lines[order]), linewidths=list(widths), cmap=SHADES, norm=norm)
    drawn.set_array(force[order])
    axes.add_collection(drawn)


def draw_vectors(axes: Axes, start: Floats, vectors: Floats, **style: Any) -> None:
    """Draw arrows of vectors (n,2) m that begin at points (n,2) m; style: what `quiver` takes."""
    axes.quiver(*start.T, *vectors.T, angles="xy", scale_units="xy", scale=1, **style)


def add_scale(figure: Figure, axes: Axes | Sequence[Axes], norm: Normalize, label: str) -> Colorbar:
    """Add the scale of the shades at the right, open above, since few values may lie beyond."""
    shades = ScalarMappable(norm, SHADES)
    bar: Colorbar = figure.colorbar(
        shades, ax=axes, shrink=0.75, aspect=30, extend="max", label=label
    )
    return bar


def size_of(points: Floats, margin: float) -> tuple[float, float]:
    """Return the figure size (inches) for one panel that shows points (n,2) m and a margin (m)."""
    width, height = points.max(0) - points.min(0) + 4 * margin
    tall = np.clip(6.3 * height / width + 1.3, 2.2, 6.5)
    broad = (tall - 1.3) * width / height + 0.7
    return float(min(max(broad, 2.6), 11.0) + 1.0), float(tall)


def frame(axes: Axes, points: Floats, margin: float) -> None:
    """Show these points (n,2) m and a margin (m) round them, at equal scale."""
    low, high = points.min(0) - 2 * margin, points.max(0) + 2 * margin
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    axes.set(xlabel="x (m)", ylabel="y (m)")
    axes.tick_params(labelsize=8)


def label(
    axes: Axes, x: str = "", y: str = "", title: str = "", *, log: str = "", legend: Any = "",
    size: float = 8, **more: Any,
) -> None:  # fmt: skip
    """Label a panel: its axes, a title, a legend at a place; log: the axes that are logarithmic, as "xy";
    more: limits and what else `Axes.set` takes."""
    scales = {f"{axis}scale": "log" for axis in log}
    axes.set(**scales, **({"xlabel": x} if x else {}), **({"ylabel": y} if y else {}), **more)
    if title:
        axes.set_title(title, fontsize=10)
    if legend:
        axes.legend(fontsize=size, loc=legend)


def ticks_at(axes: Axes, values: Iterable[float]) -> None:
    """Have ticks at these values of x alone, logarithmic or not."""
    axes.set_xticks(list(values), [f"{value:g}" for value in values], minor=False)
    axes.set_xticks([], minor=True)


def legend_below(
    figure: Figure,
    axes: Axes | Iterable[Axes],
    columns: int,
    fontsize: int = 8,
    *,
    anchor: Literal["outside lower center", "outside upper center"] = "outside lower center",
) -> None:
    """Name the lines of one or of several axes, each name once, below all axes."""
    every = [axes] if isinstance(axes, Axes) else axes
    named = {
        name: line
        for one in every
        for line, name in zip(*one.get_legend_handles_labels(), strict=True)
    }
    figure.legend(named.values(), named.keys(), loc=anchor, ncols=columns, fontsize=fontsize)


def shade(
    axes: Axes, x: Floats, low: Floats, high: Floats, colour: str, alpha: float, **style: Any
) -> None:
    """Shade the band between two curves; style: what `fill_between` takes."""
    axes.fill_between(x, low, high, color=colour, alpha=alpha, lw=0, **style)


def panels(
    width: float, height: float, rows: int = 1, columns: int = 1, *, grid: str = "", **shared: Any
) -> tuple[Figure, list[Any]]:
    """Make a figure (inches) and its panels (Axes), row by row.

    grid: "major" or "both" for lines at these ticks; shared: what `subplots` takes"""
    figure = Figure(figsize=(width, height), layout="constrained")
    every = list(figure.subplots(rows, columns, squeeze=False, **shared).ravel())
    for axes in every if grid else ():
        axes.grid(alpha=0.3, which=grid)
    return figure, every


def for_telephone(figure: Figure) -> None:
    """Turn a figure that was drawn into one for a telephone: panels below each other, each with the
    labels and ticks that it shared; words in short lines, the legend below. One without panels stays
    as it is."""
    rows: dict[tuple[int, int], list[Axes]] = {}
    for axes in figure.axes:
        if anchor := axes.get_subplotspec():
            rows.setdefault((anchor.rowspan.start, anchor.colspan.start), []).append(axes)
    shown = {at: rows[at] for at in sorted(rows) if any(one.axison for one in rows[at])}
    if not shown:
        return
    sizes = [grouped[0].get_window_extent().size for grouped in shown.values()]
    heights = [(NARROW_IN - 0.8) * np.clip(high / width, 0.45, 1.5) + 0.8 for width, high in sizes]
    grid = figure.add_gridspec(len(shown), 1, height_ratios=heights)
    for number, ((row, column), combined) in enumerate(shown.items()):
        beside, *_ = shown[min(at for at in shown if at[0] == row)]
        below, *_ = shown[max(at for at in shown if at[1] == column)]
        for axes in combined:
            axes.set_ylabel(textwrap.fill(axes.get_ylabel() or beside.get_ylabel(), 32))
            axes.set_xlabel(textwrap.fill(axes.get_xlabel() or below.get_xlabel(), 36))
            axes.set_title(textwrap.fill(axes.get_title(), 36), fontsize=9)
            axes.tick_params(labelbottom=True)
            side: Any = axes.yaxis.get_label_position()
            if side != "right":
                axes.tick_params(labelleft=True)
            axes.set_subplotspec(grid[number])
    if figure.get_suptitle():
        figure.suptitle(textwrap.fill(figure.get_suptitle(), 44), fontsize=10)
    lines = 0
    for legend in list(figure.legends):
        names, handles = [one.get_text() for one in legend.get_texts()], legend.legend_handles
        columns = max(1, int(50 / (max(map(len, names)) + 6)))
        lines += -(-len(names) // columns)
        style: dict[str, Any] = {"ncols": columns, "title": legend.get_title().get_text() or None}
        legend.remove()
        style |= {"handles": handles, "labels": names, "loc": "outside lower center", "fontsize": 8}
        figure.legend(**style)
    figure.set_size_inches(NARROW_IN, sum(heights) + 0.18 * lines + 0.2)
    figure.draw_without_rendering()  # panels of equal scale find their place the second time


def lead(axes: Axes, words: str, point: Any, position: Any, colour: str, **style: Any) -> None:
    """Write words at a place (shares of the axes) and lead a thin line to their point."""
    line = {"arrowstyle": "-", "color": colour, "lw": 0.5, "alpha": 0.6}
    arguments = {"textcoords": "axes fraction", "color": colour, "arrowprops": line} | style
    axes.annotate(words, point, xytext=position, **arguments)


def line_style(number: int, *, hollow: bool = False) -> dict[str, Any]:
    """Give colour, marker and dashes of the curve of this number; hollow: whether its marks are."""
    colour = COLOURS[number]
    face = "none" if hollow else colour
    return {"color": colour, "marker": MARKERS[number], "ls": LINES[number], "mfc": face}


def label_outer(every: Iterable[Axes]) -> None:
    """Label a grid of panels at its foot and at its left."""
    for axes in every:
        anchor: Any = axes.get_subplotspec()
        if anchor.is_last_row():
            axes.set_xlabel("x (m)")
        if anchor.is_first_col():
            axes.set_ylabel("y (m)")


def scene_picture(scene: Scene) -> Figure:
    """Draw the initial state: disks, walls, the door, and who moves or walks where."""
    snapshot, drive = scene.snapshot, scene.drive
    lines = [*((wall.start_m, wall.end_m) for wall in scene.walls), *(drive.gates if drive else ())]
    shown = np.concatenate([snapshot.position, *map(np.array, lines)])
    size = size_of(shown, float(snapshot.radius.max()))
    figure, (axes,) = panels(*size)
    draw_disks(axes, snapshot, PALE_BLUE)
    draw_walls(axes, lines[: len(scene.walls)])
    velocity = (
        drive.desired_velocity(snapshot.position, snapshot.ids, snapshot.time, snapshot.radius)
        if drive
        else snapshot.velocity
    )
    moving = np.hypot(*velocity.T) > 0
    if moving.any():
        x, v = snapshot.position[moving], velocity[moving]
        label = "desired direction" if drive else "velocity at the start"
        length = 1.5 * snapshot.radius.mean() / np.hypot(*velocity.T).max()
        draw_vectors(axes, x, length * v, color=ORANGE, width=0.003, label=label)
    if drive:
        for number, ((x0, y0), (x1, y1)) in enumerate(drive.gates):
            name = None if number else "door"
            axes.plot([x0, x1], [y0, y1], color=GREEN, lw=3, ls=":", label=name)
    if axes.get_legend_handles_labels()[0]:
        legend_below(figure, axes, 3)
    frame(axes, shown, float(snapshot.radius.max()))
    return figure
