"""A quick look at the percussions of a snapshot."""

from __future__ import annotations

from typing import Any

import numpy as np

from analysis.percussions.setting import Solved

WIDEST = 5.0  # points


def plot(found: Solved, axes: Any = None) -> Any:
    """Draw disks, walls and contacts, whose width and shade grow with what they carry (in the
    `unit` of the answer), into matplotlib axes (new ones where left out); return the axes."""
    from matplotlib import pyplot
    from matplotlib.collections import LineCollection, PatchCollection
    from matplotlib.patches import Circle

    if axes is None:
        axes = pyplot.figure(layout="constrained").add_subplot()
    snapshot, contacts = found.snapshot, found.contacts
    disks = [
        Circle((x, y), r) for (x, y), r in zip(snapshot.position, snapshot.radius, strict=True)
    ]
    axes.add_collection(
        PatchCollection(disks, facecolor="#F2F2F2", edgecolor="#888888", linewidth=0.3)
    )
    walls = found.setting.walls
    if walls is not None and len(walls):
        segments = list(np.stack([walls.start, walls.end], axis=1))
        axes.add_collection(LineCollection(segments, colors="black", linewidths=2))
    if len(contacts):
        size = np.hypot(*found.pressing.T)
        start, end = snapshot.position[contacts.first], contacts.point.copy()
        pairs = ~contacts.is_wall
        end[pairs] = snapshot.position[contacts.second[pairs]]
        lines = LineCollection(
            list(np.stack([start, end], axis=1)),
            array=size,
            cmap="viridis_r",
            linewidths=list(0.2 + WIDEST * size / (size.max() or 1.0)),
        )
        axes.add_collection(lines)
        what = "contact force" if found.unit == "N" else "percussion"
        axes.figure.colorbar(lines, ax=axes, label=f"{what} ({found.unit})", shrink=0.8)
    reach = 2 * float(snapshot.radius.max(initial=0.5))
    low, high = snapshot.position.min(0) - reach, snapshot.position.max(0) + reach
    axes.set(
        xlim=(low[0], high[0]),
        ylim=(low[1], high[1]),
        aspect="equal",
        xlabel="x (m)",
        ylabel="y (m)",
    )
    axes.set_title(f"{found.answer.status}, residual {found.answer.residual:.0e}", fontsize=9)
    return axes
