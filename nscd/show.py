"""Percussions as a table and as a picture. pandas and matplotlib are imported when first asked
for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from nscd.arrays import Floats, Indices
from nscd.bodies import Snapshot, Walls
from nscd.contacts import Contacts

if TYPE_CHECKING:
    import pandas as pd

    from nscd.solve_frames import FrameSolutions

WIDEST = 5.0  # points
# Rows of a table in a notebook.
SHOWN = 10


def arrays(
    ids: Indices,
    contacts: Contacts | FrameSolutions,
    reaction: Floats,
    impulse: Floats,
    window: float | None = None,
) -> dict[str, Floats | Indices]:
    """Name the columns (k,) of k contacts between disks with ids (n,), with units in the names.

    reaction: (k,) N·s
    impulse: (k,2) N·s
    window: s, of forces impulse/window; without it there are none

    first, second are the ids of disks; of a wall, which is_wall says, second is its number from
    1."""
    wall = contacts.is_wall
    second = np.where(wall, contacts.second + 1, ids[np.where(wall, 0, contacts.second)])
    named = {
        "first": ids[contacts.first],
        "second": second,
        "is_wall": wall.astype(int),
        "nx": contacts.normal[:, 0],
        "ny": contacts.normal[:, 1],
        "gap_m": contacts.gap,
        "reaction_Ns": reaction,
        "impulse_x_Ns": impulse[:, 0],
        "impulse_y_Ns": impulse[:, 1],
    }
    if window is not None:
        force = impulse / window
        named |= {"force_x_N": force[:, 0], "force_y_N": force[:, 1], "force_N": np.hypot(*force.T)}
    return named


def as_frame(cells: Mapping[str, Any]) -> pd.DataFrame:
    """Return columns, each an array or a list of k, as a data frame. Raises ImportError without
    pandas."""
    try:
        import pandas as pd
    except ModuleNotFoundError:
        raise ModuleNotFoundError(
            'data frames need pandas: pip install "crowd-percussions[real]", or pip install pandas',
            name="pandas",
        ) from None
    # without rows a list has no type: pandas would make it, and what is joined to it, numbers
    settings = {
        name: cell if len(cell) else np.array(cell, dtype=getattr(cell, "dtype", object))
        for name, cell in cells.items()
    }
    return pd.DataFrame(settings)


def as_html(title: str, frame: pd.DataFrame) -> str:
    """Return the head of a data frame as HTML, for notebooks."""
    head = frame.head(SHOWN).to_html(index=False, float_format=lambda number: f"{number:.4g}")
    more = f"<p>… {len(frame)} contacts in all</p>" if len(frame) > SHOWN else ""
    return f"<p>{title}</p>{head}{more}"


def contact_lines(snapshot: Snapshot, contacts: Contacts) -> Floats:
    """Return lines from the first disk's centre to the second's, or to the wall, (k,2,2) m; across
    the end of a period they lead out of it."""
    end = contacts.point.copy()
    pairs = ~contacts.is_wall
    beyond = contacts.gap[pairs] + snapshot.radius[contacts.second[pairs]]
    end[pairs] += beyond[:, None] * contacts.normal[pairs]
    return np.stack([snapshot.position[contacts.first], end], axis=1)


def draw(
    snapshot: Snapshot,
    contacts: Contacts,
    size: Floats,
    *,
    label: str,
    title: str,
    walls: Walls | None = None,
    axes: Any = None,
) -> Any:
    """Draw disks, walls and contacts, whose width and shade grow with `size` (k,) from 0 on, as `label` says,
    into matplotlib axes (new ones where left out); return the axes."""
    from matplotlib import pyplot
    from matplotlib.collections import LineCollection, PatchCollection
    from matplotlib.patches import Circle

    if axes is None:
        axes = pyplot.figure(layout="constrained").add_subplot()
    disks = [
        Circle((x, y), r) for (x, y), r in zip(snapshot.position, snapshot.radius, strict=True)
    ]
    axes.add_collection(
        PatchCollection(disks, facecolor="#F2F2F2", edgecolor="#888888", linewidth=0.3)
    )
    if walls is not None and len(walls):
        segments = list(np.stack([walls.start, walls.end], axis=1))
        axes.add_collection(LineCollection(segments, colors="black", linewidths=2))
    if len(contacts):
        lines = LineCollection(
            list(contact_lines(snapshot, contacts)),
            array=size,
            cmap="viridis_r",
            linewidths=list(0.2 + WIDEST * size / (size.max() or 1.0)),
        )
        lines.set_clim(0.0, float(size.max()) or 1.0)
        axes.add_collection(lines)
        axes.figure.colorbar(lines, ax=axes, label=label, shrink=0.8)
    reach = 2 * float(snapshot.radius.max(initial=0.5))
    ends = snapshot.position if len(snapshot) else np.zeros((1, 2))
    low, high = ends.min(0) - reach, ends.max(0) + reach
    axes.set(
        xlim=(low[0], high[0]),
        ylim=(low[1], high[1]),
        aspect="equal",
        xlabel="x (m)",
        ylabel="y (m)",
    )
    axes.set_title(title, fontsize=9)
    return axes
