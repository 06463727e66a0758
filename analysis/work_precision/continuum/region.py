"""The region that a crowd of disks fills, as a room of the continuum."""

from __future__ import annotations

import numpy as np
import shapely

from analysis.scene.scene import Scene
from nscd.arrays import Floats
from nscd.continuum.room import Border, Room, room_of_walls

# In mean radii: a free border may run this far from the exact one, and so much wider the hall is
# taken for that long.
SIMPLER = 0.15
# Edges of a quarter of a circle.
ARC = 8
# Lengths below this share of the hall's extent are rounding.
ROUNDING = 1e-9


def crowd_room(scene: Scene) -> Room:
    """Draw the region: the hall, less every place where one more disk of mean radius would fit: the
    disks and what is beyond the walls, closed (in the sense of morphology) by a mean radius. Holes
    in the crowd are filled; pillars are not.

    Its edges are "exit" on the door, "wall" on a wall, and "free" elsewhere, drawn to 0.15 mean
    radii. Raises ValueError for a scene without a drive, whose walls and door enclose no hall,
    whose crowd is not in one piece or touches no wall."""
    if scene.drive is None:
        raise ValueError("it is for a crowd that a drive presses, and this is an impact")
    disks, drive = scene.snapshot, scene.drive
    if drive.goals:
        raise ValueError("it is for a crowd with one door, and this one has several")
    enclosed = room_of_walls(scene.wall_segments(), exits=[[drive.door_start_m, drive.door_end_m]])
    hall = shapely.Polygon(enclosed.outline, enclosed.pillars)
    radius = float(disks.radius.mean())
    margin = SIMPLER * radius
    # a little apart from the walls, so that where nobody stands no sliver is left on them
    wider = hall.buffer(margin, join_style="mitre")
    beyond = hall.buffer(4.0 * radius, join_style="mitre").difference(wider)
    bodies = shapely.buffer(shapely.points(disks.position), disks.radius, quad_segs=ARC)
    taken = shapely.union_all([*bodies, beyond])
    closed = taken.buffer(radius, quad_segs=ARC).buffer(-radius, quad_segs=ARC)
    parts = [
        part
        for part in shapely.get_parts(closed.simplify(margin).intersection(hall))
        if part.geom_type == "Polygon" and shapely.contains_xy(part, disks.position).any()
    ]
    if len(parts) != 1:
        raise ValueError(f"the crowd is in {len(parts)} pieces; one is needed")
    region = shapely.Polygon(parts[0].exterior).intersection(hall)
    if region.geom_type != "Polygon" or not shapely.contains_xy(region, disks.position).all():
        raise ValueError("the crowd is not in one piece")
    outline = np.array(region.exterior.coords)[:-1]
    return Room(
        outline=outline,
        border=_border(outline, enclosed),
        pillars=tuple(np.array(ring.coords)[:-1] for ring in region.interiors),
    )


def _border(outline: Floats, hall: Room) -> tuple[Border, ...]:
    """What each edge (v,) of the outline lies on."""
    near = ROUNDING * float(np.ptp(hall.outline, axis=0).max())
    middle = shapely.points(0.5 * (outline + np.roll(outline, -1, axis=0)))
    kinds: list[Border] = ["free"] * len(outline)
    for kind in ("wall", "exit"):
        lines = shapely.multilinestrings(list(hall.pieces(kind)))
        for edge in np.flatnonzero(shapely.distance(middle, lines) <= near):
            kinds[edge] = kind
    return tuple(kinds)
