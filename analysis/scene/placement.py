"""Is a crowd inside its room: overlaps, walls and doors of an initial state."""

from itertools import pairwise

import numpy as np
import shapely

from nscd import Snapshot, Walls, find_contacts
from nscd.arrays import Floats
from nscd.segments import lengths

# An overlap below this share of the smaller radius is rounding or reconciliation, not a mistake.
OVERLAP = 1e-6


def check_room(snapshot: Snapshot, walls: Walls, doors: Walls | None) -> list[str]:
    """Raise ValueError naming the disks for an overlap with a disk or a wall, or for a disk outside
    a closed room or within a pillar; return warnings."""
    tolerance = OVERLAP * snapshot.radius.min()
    contacts = find_contacts(snapshot, walls, tolerance=tolerance)
    if len(contacts) and contacts.gap.min() < -tolerance:
        worst = int(np.argmin(contacts.gap))
        first, second = snapshot.ids[contacts.first[worst]], contacts.second[worst]
        other = f"wall {second + 1}" if contacts.is_wall[worst] else f"disk {snapshot.ids[second]}"
        raise ValueError(f"disk {first} and {other} overlap by {-contacts.gap[worst]:.3g} m")
    if rooms := rooms_of(snapshot.position, walls, doors):
        inside = shapely.contains_xy(shapely.union_all(rooms), snapshot.position)
        if not inside.all():
            disk = int(np.argmin(inside))
            x, y = snapshot.position[disk]
            raise ValueError(f"disk {snapshot.ids[disk]} at ({x:g}, {y:g}) m is outside the walls")
    warnings = []
    if doors is not None:
        width = float(lengths(doors.end - doors.start).min())
        widest = 2 * float(snapshot.radius.max())
        if width < widest:
            warnings.append(
                f"the door ({width:g} m) is narrower than the widest disk ({widest:g} m)"
            )
    return warnings


def rooms_of(position: Floats, walls: Walls, doors: Walls | None) -> list[shapely.Polygon]:
    """Find the polygons that walls and doors bound around people at (n,2) m, pillars being holes.

    A pillar is a polygon within another one, or one that has neither a door nor anybody
    inside."""
    lines, gates = _lines(walls), [] if doors is None else _lines(doors)
    faces = shapely.get_parts(shapely.polygonize([*lines, *gates]))
    full = [shapely.Polygon(face.exterior) for face in faces]
    return [
        face
        for face, shape in zip(faces, full, strict=True)
        if not any(other is not shape and other.contains_properly(shape) for other in full)
        and (
            any(face.boundary.contains(gate) for gate in gates)
            or shapely.contains_xy(shape, position).any()
        )
    ]


def _lines(segments: Walls) -> list[shapely.LineString]:
    lines = [shapely.LineString(pair) for pair in zip(segments.start, segments.end, strict=True)]
    for end in segments.period_x or ():  # a room is shut where a period ends
        there = np.unique([y for line in lines for x, y in line.coords if x == end])
        lines += [shapely.LineString([(end, y0), (end, y1)]) for y0, y1 in pairwise(there)]
    return lines
