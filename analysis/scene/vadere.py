"""Scenarios of Vadere: the floor, where people wait, and where they go."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from analysis.scene.plan_roles import Floor, PlanPart, longest_shared, polygon_of
from analysis.scene.scene import SceneError
from analysis.scene.waiting import Doorway
from analysis.support.reading import note_unused

# Corners of a circle.
CORNERS = 16
# A door is no narrower, where one is proposed.
NARROW_M = 0.5
# They change who leaves and where.
CHANGING = ("targetChangers", "absorbingAreas", "teleporter")
USED = {"attributes", "obstacles", "targets", "sources"}
USED_OF = {
    "attributes": {"bounds", "boundingBoxWidth", "bounded"},
    "targets": {"id", "shape", "absorbing", "absorber"},
    "sources": {"id", "shape", "targetIds", "spawnNumber", "maxSpawnNumberTotal", "spawner"},
    "obstacles": {"id", "shape"},
    "spawner": {"constraintsElementsMax", "eventElementCount"},
}


def of_vadere(file: Path, scenario: dict[str, Any], own_doors: bool) -> Floor:
    """Build the floor of a scenario: the bounds less their border, the obstacles, and the targets of
    its sources, which are doors. A source is where people wait. Says in one line what is not used.

    own_doors: whether people go to the targets

    Raises SceneError, with doors to give instead, for a target off the outline or where nobody
    leaves, for several in a row, and for what changes who leaves."""
    topography = scenario["topography"]
    stated, bounds = topography["attributes"], topography["attributes"]["bounds"]
    edge = float(stated.get("boundingBoxWidth", 0.5)) if stated.get("bounded", True) else 0.0
    x, y = float(bounds["x"]), float(bounds["y"])
    right, top = x + float(bounds["width"]), y + float(bounds["height"])
    obstacles = [_shape("obstacle", one) for one in topography.get("obstacles", ())]
    ground = shapely.box(x + edge, y + edge, right - edge, top - edge)
    ground = ground.difference(shapely.union_all(obstacles))
    sources = topography.get("sources", ())
    starts = [_shape("source", one) for one in sources]
    note_unused(file, "of the scenario", _unused(scenario, own_doors))
    if not own_doors:
        return Floor(polygon=_reached(ground, starts))
    goals = [[int(one) for one in source.get("targetIds", ())] for source in sources]
    targets = {int(one["id"]): one for one in topography.get("targets", ())}
    last = [ids[-1] for ids in goals if ids and ids[-1] in targets]
    shapes = {number: _shape("target", targets[number]) for number in last}
    neighbours = [_instead(_reached(ground, starts), one) for one in shapes.values()]
    instead = f"Give {' '.join(dict.fromkeys(neighbours)) or '--door x,y,x,y'}, for example"
    if changing := [key for key in CHANGING if topography.get(key)]:
        raise SceneError(f"{changing[0]}: they change where people go. {instead}")
    polygon = _reached(ground.difference(shapely.union_all([*shapes.values()])), starts)
    doors = []
    for source, start, ids in zip(sources, starts, goals, strict=True):
        if len(ids) != 1 or ids[0] not in shapes:
            where = f"source {source.get('id')}: targetIds: {ids}"
            raise SceneError(f"{where}. One target is needed, not several in a row. {instead}")
        target, where = targets[ids[0]], f"target {ids[0]}"
        absorber = target.get("absorber") or {"enabled": target.get("absorbing", True)}
        if not absorber.get("enabled", True):
            raise SceneError(f"{where}: nobody leaves there (absorber). {instead}")
        ends = longest_shared(polygon, PlanPart(where=where, shape=shapes[ids[0]]))
        if ends is None:
            raise SceneError(f"{where}: it does not lie at the outline, as a door does. {instead}")
        doors.append(Doorway(ends=ends, share=_people(source), start=start, spread=True))
    return Floor(polygon=polygon, doors=tuple(doors))


def _reached(floor: shapely.Geometry, starts: list[shapely.Geometry]) -> shapely.Polygon:
    """The part of a floor with the sources."""
    parts = [part for part in shapely.get_parts(floor) if part.area > 0]
    reached = [part for part in parts if any(part.intersects(start) for start in starts)]
    return polygon_of(shapely.union_all(reached or parts))


def _unused(scenario: dict[str, Any], own_doors: bool) -> list[str]:
    """What of a scenario changes nothing, and is not empty."""
    topography = scenario["topography"]
    names = [key for key in scenario if key != "topography" and scenario[key]]
    names += [key for key in topography if key not in USED and topography[key]]
    names += [] if own_doors else [key for key in ("targets", "sources") if topography.get(key)]
    for kind in ("attributes", "obstacles", "targets", "sources")[: 4 if own_doors else 2]:
        entries = topography.get(kind, ())
        for one in [entries] if kind == "attributes" else entries:
            names += [f"{key} of {kind}" for key in one if key not in USED_OF[kind]]
            spawner = one.get("spawner") or {}
            names += [f"{key} of sources" for key in spawner if key not in USED_OF["spawner"]]
    return names


def _instead(floor: shapely.Polygon, target: shapely.Geometry) -> str:
    """The door that stands for a target on the nearest side of the outline, as an option."""
    corners = shapely.points(shapely.get_coordinates(target))
    found = []
    for pair in pairwise(floor.exterior.coords):
        side = shapely.LineString(pair)
        at = shapely.line_locate_point(side, corners)
        ends = [*side.interpolate(at.min()).coords[0], *side.interpolate(at.max()).coords[0]]
        found.append((np.ptp(at) < NARROW_M, round(side.distance(target), 6), ends))
    return "--door=" + ",".join(f"{each:.10g}" for each in min(found)[2])


def _people(source: dict[str, Any]) -> float:
    """How many people a source gives, as far as it says."""
    spawner = source.get("spawner", {})
    stated = (
        spawner.get("constraintsElementsMax"),
        source.get("maxSpawnNumberTotal"),
        spawner.get("eventElementCount"),
        source.get("spawnNumber"),
    )
    return next((float(each) for each in stated if each is not None and float(each) > 0), 1.0)


def _shape(kind: str, one: dict[str, Any]) -> shapely.Geometry:
    shape, form = one["shape"], one["shape"].get("type")
    if form == "RECTANGLE":
        x, y = float(shape["x"]), float(shape["y"])
        found = shapely.box(x, y, x + float(shape["width"]), y + float(shape["height"]))
    elif form == "POLYGON":
        found = shapely.Polygon([(float(p["x"]), float(p["y"])) for p in shape["points"]])
    elif form == "CIRCLE":
        middle = shapely.Point(float(shape["center"]["x"]), float(shape["center"]["y"]))
        found = middle.buffer(float(shape["radius"]), quad_segs=CORNERS // 4)
    else:
        raise SceneError(f"{kind} {one.get('id')}: shape {form!r}, not RECTANGLE, POLYGON, CIRCLE")
    if not found.is_valid or found.is_empty:
        raise SceneError(f"{kind} {one.get('id')}: {shapely.is_valid_reason(found)}")
    return found
