"""How each method looks on a chart, and what its curves have in common."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter

from analysis.pages.drawing import (
    BLACK,
    BLUE,
    DARK_GREY,
    DARK_YELLOW,
    GREEN,
    GREY,
    GRID,
    ORANGE,
    PINK,
    SKY,
    VERMILION,
    YELLOW,
)
from analysis.work_precision.point import Point

# Edges of what is too light for a thin line.
DARK = {GREY: DARK_GREY, YELLOW: DARK_YELLOW}
# Least distance of two labels at the side of a panel, as a share of its height.
APART = 0.05


@dataclass(frozen=True, slots=True)
class Look:
    """How a method is drawn: label, colour, marker (a letter, or corners, 1 for a star, turn),
    line, marker size in points."""

    label: str
    colour: str
    marker: str | tuple[int, Literal[1], int]
    line: str
    size: float = 5.5

    @property
    def edge(self) -> str:
        """Colour of lines and edges."""
        return DARK.get(self.colour, self.colour)


LOOKS = {
    "lammps_hooke": Look("LAMMPS, linear", BLUE, "o", "-"),
    "lammps_hertz": Look("LAMMPS, Hertz", ORANGE, "s", "--"),
    "yade_hooke": Look("YADE, linear", GREEN, "D", ":"),
    "rigid_auto": Look("rigid, the product's choice", BLACK, "^", "-"),
    "rigid_interior_point": Look("rigid, interior point", VERMILION, "v", "--"),
    "rigid_active_set": Look("rigid, active set", PINK, "<", "-."),
    "rigid_projected_gradient": Look("rigid, projected gradient", SKY, ">", ":"),
    "rigid_gauss_seidel": Look("rigid, Gauss–Seidel", GREY, "p", "-"),
    "continuum_deformable": Look("continuum (11), deformable", YELLOW, (4, 1, 0), "-", 9),
    "continuum_first_order": Look("continuum (20), first order", YELLOW, (6, 1, 0), "--", 9),
    "first_order": Look("first-order model", BLACK, "*", "", 9),
    "social_force": Look("social force", VERMILION, "P", "", 9),
    "loehner_printed": Look("Löhner, as printed", PINK, "X", "", 9),
    "loehner_text": Look("Löhner, cases exchanged", SKY, "h", "", 9),
}


def look_of(point: Point) -> Look:
    """Choose how a point's method is drawn; one that is not known here gets a plain look and its
    own name."""
    return LOOKS.get(point.key, Look(point.key, GREY, "d", "-"))


class Label(NamedTuple):
    """The name of a curve and where it ends."""

    x: float
    y: float
    text: str
    colour: str


def label_curves(axes: Axes, labels: Iterable[Label]) -> None:
    """Write the names of curves at the right side of a panel, each led to the end of its curve."""
    found = sorted(labels, key=lambda label: label.y)
    low, high = np.log(axes.get_ylim())
    heights = [float(np.clip((np.log(label.y) - low) / (high - low), 0, 1)) for label in found]
    for i in range(1, len(heights)):
        heights[i] = max(heights[i], heights[i - 1] + APART)
    # what has been pushed beyond the top comes down again
    most = 1.0
    for i in reversed(range(len(heights))):
        heights[i] = min(heights[i], most)
        most = heights[i] - APART
    for label, height in zip(found, heights, strict=True):
        axes.annotate(
            label.text,
            xy=(label.x, label.y),
            xytext=(1.03, height),
            textcoords="axes fraction",
            color=label.colour,
            fontsize=9,
            va="center",
            arrowprops={"arrowstyle": "-", "color": label.colour, "lw": 0.5, "alpha": 0.6},
            annotation_clip=False,
        )


def tidy(axes: Axes) -> None:
    """Give logarithmic axes a quiet grid and few ticks."""
    axes.grid(True, which="major", color=GRID, lw=0.6)
    axes.set_axisbelow(True)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(numticks=9))
        axis.set_minor_formatter(NullFormatter())
