"""Parts of the outlines of walls, beside doors and round corners, and their load; per metre: line_loads in outline.py."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from analysis.dumps.windows import Window
from analysis.scene.drive import Exit
from analysis.scene.fields import Point
from analysis.scene.scene import Scene
from analysis.scene.schema import Wall
from analysis.studies.exposure.outline import Outlines
from nscd import Walls
from nscd.arrays import Floats, Indices

# A wall begins beside a door within so much (m) of its end, and is looked at so far (m) from there.
AT_DOOR_M, LOOK_M = 0.1, 0.05
SIDES, CORNER = ("left", "right"), "corner"


class OnWalls(NamedTuple):
    """Hold the k contacts of a window with walls."""

    wall: Indices  # (k,) from 0
    position: Floats  # (k,2) m, of the disks
    force: Floats  # (k,) N


def outlined(scene: Scene, window: Window) -> OnWalls:
    """Give the contacts with walls of a window, of disks where people have several."""
    window = window.disks or window
    on = window.is_wall
    index = window.now.position[np.searchsorted(window.now.ids, window.keys[on, 0])]
    return OnWalls(window.keys[on, 1] - 1, index, window.force[on])


def outlines_of(scene: Scene) -> Outlines:
    """Join the walls of a scene."""
    return _outlines(scene.walls, scene.period_x_m)


@functools.lru_cache(maxsize=4)
def _outlines(walls: tuple[Wall, ...], period: Point | None) -> Outlines:
    ends = np.array([(wall.start_m, wall.end_m) for wall in walls]).reshape(-1, 2, 2)
    return Outlines.of(Walls(start=ends[:, 0], end=ends[:, 1], period_x=period))


@dataclass(frozen=True, slots=True)
class Stretch:
    """Name a part of an outline: from one arc length to a higher one (m), over `over_m` of wall, and
    the arc length (m) where it is said to be."""

    name: str
    outline: int
    at: float
    low: float
    high: float
    over_m: float


def loads_on(scene: Scene, windows: Sequence[OnWalls], parts: Sequence[Stretch]) -> Floats:
    """Give the mean load (t,p) kN/m on parts of outlines in each window."""
    outlines = outlines_of(scene)
    low, high, over = np.array([(one.low, one.high, one.over_m) for one in parts]).reshape(-1, 3).T
    of = np.array([one.outline for one in parts], dtype=int)
    found = np.zeros((len(windows), len(parts)))
    for row, on in zip(found, windows, strict=True):
        arc, outline = outlines.arcs(on.wall, on.position), outlines.number[on.wall]
        for number in np.intersect1d(outline, of).tolist():
            here, mine = of == number, outline == number
            total = outlines.sums(arc[mine], on.force[mine], low[here], high[here], number)
            row[here] = 1e-3 * total / over[here]
    return found


def beside_doors(scene: Scene) -> list[Stretch]:
    """Find the metre of wall beside each door, left and right of who walks out: along the outline
    from the end of the door, round corners too. None where the door ends at no wall."""
    outlines, found = outlines_of(scene), list[Stretch]()
    doors = [one for one in scene.drive.doors if one.has_door] if scene.drive else []
    doors = list({one.door: one for one in doors}.values())
    for number, one in enumerate(doors, start=1):
        for side, post, other in _posts(one):
            if at := _from_post(outlines, post, post - other, np.array(one.outward)):
                name = f"{side} of door {number}" if len(doors) > 1 else f"{side} of the door"
                found.append(Stretch(name, *at))
    return found


def _posts(one: Exit) -> Iterator[tuple[str, Floats, Floats]]:
    """The left and the right end of a door with the other one."""
    ends, (x, y) = np.array(one.door), one.outward
    left = int(np.argmax(ends @ [-y, x]))
    for side, post in zip(SIDES, (left, 1 - left), strict=True):
        yield side, ends[post], ends[1 - post]


def _from_post(
    outlines: Outlines, post: Floats, away: Floats, outward: Floats
) -> tuple[int, float, float, float, float] | None:
    """Outline, place, ends and length of the metre that begins at an end of a door: away from the
    door, and rather inside than outside."""
    best: tuple[float, int, float, int] | None = None
    away = away / np.hypot(*away)
    for outline, arc in outlines.nearest(post, AT_DOOR_M):
        for way in (1, -1):
            ahead = np.array(outlines.point(outline, arc + way * LOOK_M))
            step = ahead - outlines.point(outline, arc)
            if (size := float(np.hypot(*step))) > 0.1 * LOOK_M:
                score = round(float(step @ (away - 0.5 * outward)) / size, 6)
                if best is None or score > best[0]:
                    best = score, outline, arc, way
    if best is None:
        return None
    _, outline, arc, way = best
    return outline, arc, *outlines.metre_from(outline, arc, way)


def at_corners(scene: Scene) -> list[Stretch]:
    """Give the metre round each corner, half of it on either side."""
    outlines = outlines_of(scene)
    return [
        Stretch(f"{CORNER} {number}", outline, arc, *outlines.metre(outline, arc))
        for number, (outline, arc) in enumerate(outlines.corners(), start=1)
    ]
