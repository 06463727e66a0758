"""Why the largest pressure in any triangle is not published: it grows with every refinement, its
mean over a body does not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from analysis.pages.drawing import BLACK, BLUE, ORANGE
from analysis.pages.section import Cell, Picture, Table
from analysis.paper.continuum.exit_room import BODY, ROOM, medium
from nscd.continuum.left_velocity import toward_exit
from nscd.continuum.pressure import LargestPressure, largest_pressures

HALVINGS = 3
# means over a body that change by more than this share at the last halving have not settled
SETTLED = 0.03


def raw_maximum(speed: float, size: float, warnings: list[str]) -> tuple[Table, Picture, list[str]]:
    """Largest pressures on uniform meshes of the sides 2·size, size, … and on graded ones, with
    people who want `speed` (m/s).

    The table, the picture and the words; a warning where the mean over a body has not settled.
    """
    sizes = [2 * size / 2**k for k in range(HALVINGS + 1)]
    left = toward_exit(ROOM, speed)
    uniform = largest_pressures(ROOM, medium(), left, BODY, sizes, grading=1.0)
    graded = largest_pressures(ROOM, medium(), left, BODY, sizes[:-1], grading=0.4)
    last = graded[-1].body / graded[-2].body - 1
    if abs(last) > SETTLED:
        warnings.append(
            f"the mean over a body still changes by {last:.1%} at the last halving of the mesh"
        )
    rows: list[list[Cell]] = [
        [kind, row.size, row.unknowns, row.raw, row.body]
        for kind, some in (("uniform", uniform), ("graded to the jambs", graded))
        for row in some
    ]
    table = Table(
        caption="Largest pressure of (11) in any triangle and as a mean over a body, on ever finer meshes. On meshes "
        "graded to the "
        "jambs the smallest triangles are smaller, so that the raw maximum is larger still.",
        head=[
            "mesh",
            "side (m)",
            "unknowns",
            "largest in any triangle (N·s/m)",
            "largest over a body (N·s/m)",
        ],
        rows=rows,
    )
    picture = Picture(
        name="fig_9_raw_maximum",
        caption="The largest pressure in any triangle on uniform meshes grows as the side to the power −1/2 (line), "
        "because the stress "
        "has no limit at a jamb, and faster on meshes graded to the jambs. The mean over a body settles, first on "
        "graded meshes.",
        figure=_drawn(uniform, graded),
    )
    words = [
        f"Why no raw maximum is published: on uniform meshes of {sizes[0]:g} to {sizes[-1]:g} m the largest pressure "
        "in any triangle is "
        f"{_list([row.raw for row in uniform])} N·s/m, a factor of {_growth(uniform):.2f} for each halving (√2 = "
        "1.41), without a "
        f"limit; over a body it is {_list([row.body for row in uniform])}. On meshes graded to the jambs, which the "
        "page uses, it is "
        f"{_list([row.raw for row in graded])} in any triangle and {_list([row.body for row in graded])} over a "
        "body. A largest pressure without a length over which it is "
        "averaged is a statement on the mesh."
    ]
    return table, picture, words


def _growth(rows: Sequence[LargestPressure]) -> float:
    """Mean factor of the raw maximum for each halving."""
    return float((rows[-1].raw / rows[0].raw) ** (1 / (len(rows) - 1)))


def _list(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.0f}" for value in values)


def _drawn(uniform: Sequence[LargestPressure], graded: Sequence[LargestPressure]) -> Figure:
    figure = Figure(figsize=(8.0, 4.4), layout="constrained")
    axes = figure.add_subplot()
    side = np.array([row.size for row in uniform])
    for rows, kind, marker in ((uniform, "uniform", "o"), (graded, "graded", "s")):
        sides = [row.size for row in rows]
        axes.plot(
            sides,
            [row.raw for row in rows],
            marker,
            ls=":",
            color=ORANGE,
            label=f"in any triangle, {kind}",
        )
        axes.plot(
            sides,
            [row.body for row in rows],
            marker,
            ls="-",
            color=BLUE,
            mfc="none",
            label=f"over a body, {kind}",
        )
    axes.plot(
        side,
        uniform[0].raw * (side / side[0]) ** -0.5,
        "--",
        color=BLACK,
        lw=1,
        label="∝ side$^{-1/2}$",
    )
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="side of the triangles (m)",
        ylabel="largest pressure (N·s/m)",
    )
    axes.set_xticks(side, [f"{value:g}" for value in side], minor=False)
    axes.set_xticks([], minor=True)
    axes.invert_xaxis()
    axes.grid(alpha=0.3)
    figure.legend(loc="outside right center", fontsize=8)
    return figure
