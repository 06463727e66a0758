"""Fields in a room as pictures: filled contours, walls and exits, arrows."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.tri import Triangulation
from skfem import MeshTri1

from analysis.pages.drawing import BLACK, ORANGE, SHADES, draw_vectors
from nscd.arrays import Floats
from nscd.continuum.room import Border, Room

LEVELS = 13
BORDERS: dict[Border, tuple[str, float, str]] = {
    "wall": (BLACK, 2, "-"),
    "exit": (ORANGE, 3, ":"),
    "free": (BLACK, 1, "--"),
}
WIDTHS = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)


def rounded(top: float) -> float:
    """Round up to the next number that has 12 equal bands of a round width."""
    band = max(top, 1e-300) / (LEVELS - 1)
    unit = 10.0 ** np.floor(np.log10(band))
    width = next(width for width in WIDTHS if width * unit >= band * (1 - 1e-9))
    return float((LEVELS - 1) * unit * width)


def draw_field(axes: Axes, mesh: MeshTri1, values: Floats, top: float) -> Any:
    """Draw values at the vertices (n,) in bands between 0 and `top`, with lines between every
    second; return what a colour bar takes."""
    triangles = Triangulation(mesh.p[0], mesh.p[1], mesh.t.T)
    levels = np.linspace(0.0, top, LEVELS)
    # less than a thousandth below 0 is rounding of the picture
    below, above = bool(values.min() < -1e-3 * top), bool(values.max() > top)
    extend = ("both" if above else "min") if below else "max" if above else "neither"
    if not below:
        values = np.maximum(values, 0.0)
    drawn = axes.tricontourf(triangles, values, levels=levels, cmap=SHADES, extend=extend)
    axes.tricontour(triangles, values, levels=levels[::2], colors="white", linewidths=0.4)
    axes.set_aspect("equal")
    return drawn


def draw_room(axes: Axes, room: Room) -> None:
    """Draw walls black, exits dotted, free borders dashed."""
    for kind, (colour, width, line) in BORDERS.items():
        for ends in room.pieces(kind):
            axes.plot(*np.stack(ends).T, color=colour, lw=width, ls=line, solid_capstyle="butt")
    axes.set_aspect("equal")


def draw_map(axes: Axes, room: Room, mesh: MeshTri1, values: Floats, top: float, title: str) -> Any:
    """Draw a field in its room, with a title; return what a colour bar takes."""
    drawn = draw_field(axes, mesh, values, top)
    draw_room(axes, room)
    axes.set_title(title, fontsize=10)
    return drawn


def draw_arrows(axes: Axes, mesh: MeshTri1, vectors: Floats, spacing: float, scale: float) -> None:
    """Draw arrows of vectors at the vertices.

    vectors: (n,2)
    spacing: m, about one arrow in each square of this side
    scale: m per unit of the vectors
    """
    cell = np.floor(mesh.p.T / spacing).astype(int)
    _, chosen = np.unique(cell, axis=0, return_index=True)
    start = mesh.p[:, chosen].T
    draw_vectors(axes, start, scale * vectors[chosen], width=0.0035, color=BLACK)
