"""The load along the walls of runs: the worst metre and its place, and a profile along every outline."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from analysis.pages.numbers import two
from analysis.scene.scene import Scene
from analysis.studies.exposure.loads import RunLoads
from analysis.studies.exposure.outline import Worst
from analysis.studies.exposure.walls import (
    CORNER,
    OnWalls,
    Stretch,
    at_corners,
    beside_doors,
    loads_on,
    outlines_of,
)
from analysis.support.columns import Columns
from analysis.support.files import write_columns, write_rows
from nscd.arrays import Floats, Indices

# Along an outline a load is told every so many metres.
EVERY_M = 0.1
# Of moments: 90 % lie between.
ENDS = (0.05, 0.95)


def worst_metres(run: RunLoads) -> list[Worst]:
    """Give of each window the largest mean load (N/m) on any metre of joined walls, with its place;
    outline −1 where nothing presses on a wall."""
    outlines = outlines_of(run.scene)
    return [outlines.line_loads(*on)[1] for on in run.on_walls]


def profile(scene: Scene, moments: Sequence[OnWalls]) -> dict[str, Floats]:
    """Take the load along the outlines of a scene's walls over moments, of one run or of replicates: of the
    metre about each place, every 0.1 m and at corners, as the columns ALONG; `wall` is a number from 0."""
    outlines, parts = outlines_of(scene), list[Stretch]()
    corners = outlines.corners()
    for outline, length in enumerate(outlines.length.tolist()):
        arc = np.linspace(0.0, length, max(2, round(length / EVERY_M) + 1))
        arc = np.unique(np.append(arc, [at for n, at in corners if n == outline]))
        parts += [Stretch("", outline, at, *outlines.metre(outline, at)) for at in arc.tolist()]
    on = [np.flatnonzero(outlines.number == n) for n in range(len(outlines.length))]
    where = [(one.outline, one.at, *outlines.point(one.outline, one.at),
              outlines.wall_at(one.outline, one.at, on[one.outline])) for one in parts]  # fmt: skip
    number, arc, x, y, wall = np.array(where).reshape(-1, 5).T
    loads = loads_on(scene, moments, parts)
    low, high = np.quantile(loads, ENDS, axis=0)
    return {"outline": number.astype(int), "arc_m": arc, "x_m": x, "y_m": y, "wall": wall.astype(int),
            "low_kN_per_m": low, "mean_kN_per_m": loads.mean(0), "high_kN_per_m": high}  # fmt: skip


def moments_of(runs: Sequence[RunLoads], last_s: float = np.inf) -> list[OnWalls]:
    """Give the contacts with walls in the windows that begin in the last `last_s` of each run."""
    last = [run.last(min(last_s, float(run.time[-1]))) for run in runs]
    return [on for run, some in zip(runs, last, strict=True)
            for on, counts in zip(run.on_walls, some, strict=True) if counts]  # fmt: skip


def place_words(run: RunLoads) -> str:
    """Say where and when the largest metre of a run is; nothing where nobody presses on a wall."""
    found = worst_metres(run)
    if not run.scene.walls:
        return ""
    at = int(np.argmax([one.load for one in found]))
    load, outline, arc, (x, y), wall = found[at]
    if outline < 0:
        return ""
    words_of_position = f"x = {x:.2f} m, y = {y:.2f} m on {run.scene.walls[wall].name}, {arc:.2f} m along outline {outline}"
    return f"{two(1e-3 * load)} kN/m at {run.time[at]:.4g} s, {words_of_position}"


ALONG = Columns("along")
PLACES = Columns("places")


def write_along(run: RunLoads, folder: Path) -> list[Path]:
    """Write exposure_outline.csv (the load along each outline) and exposure_places.csv (the worst
    metre, beside doors and round loaded corners, window by window); return them.

    Columns: docs/columns.md."""
    names = np.array([*(wall.name for wall in run.scene.walls), ""])
    found, paths = profile(run.scene, run.on_walls), [folder / f"exposure_{one}.csv" for one in ("outline", "places")]
    write_columns(paths[0], found | {"wall": names[found["wall"]]})
    write_rows(paths[1], PLACES, _position_rows(run, names))
    return paths


def _position_rows(run: RunLoads, names: Indices) -> Iterator[list[object]]:
    outlines = outlines_of(run.scene)
    parts = beside_doors(run.scene) + at_corners(run.scene)
    loads, where = loads_on(run.scene, run.on_walls, parts), list[list[object]]()
    shown = [load.any() or CORNER not in one.name for load, one in zip(loads.T, parts, strict=True)]
    for one in parts:
        on = np.flatnonzero(outlines.number == one.outline)
        wall = outlines.wall_at(one.outline, 0.5 * (one.low + one.high), on)
        position = outlines.point(one.outline, one.at)
        where.append([one.name, one.outline, one.at, *position, names[wall]])
    moments = zip(run.time.tolist(), run.duration.tolist(), strict=True)
    for moment, load, maximum in zip(moments, loads.tolist(), worst_metres(run), strict=True):
        at = [maximum.outline, maximum.arc, *maximum.point] if maximum.outline >= 0 else [""] * 4
        yield [*moment, "worst metre", 1e-3 * maximum.load, *at, names[maximum.wall]]
        for n in np.flatnonzero(shown).tolist():
            yield [*moment, where[n][0], load[n], *where[n][1:]]
