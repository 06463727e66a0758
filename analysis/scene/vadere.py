"""Scenarios of Vadere: the floor, where people wait, and where they go."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from analysis.scene.plans import Floor, Part, longest_shared, polygon_of
from analysis.scene.scene import SceneError
from analysis.scene.waiting import ON_WALL_M, Doorway
from analysis.support.reading import note_unused

# Corners of a circle.
CORNERS = 16
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
    """Build the floor of a scenario: the bounds less their border and the obstacles. A target where
    people leave is a door where it meets the outline, or else the line of its side before its
    source; a source is where people wait for it. Says in one line what is not used.

    own_doors: whether people go to the targets

    Raises SceneError for a target where nobody leaves, for several in a row, and for what changes
    who leaves."""
    topography = scenario["topography"]
    said, bounds = topography["attributes"], topography["attributes"]["bounds"]
    edge = float(said.get("boundingBoxWidth", 0.5)) if said.get("bounded", True) else 0.0
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
    targets = {int(one["id"]): one for one in topography.get("targets", ())}
    ground, floor = _reached(ground, starts), ground
    if changing := [key for key in CHANGING if topography.get(key)]:
        raise SceneError(f"{changing[0]}: they change where people go. Give --door x,y,x,y")
    goals = [_target(source, targets, ground) for source in sources]
    shapes = {number: _shape("target", targets[number]) for number in goals}
    outer = [one for one in shapes.values() if one.distance(ground.exterior) <= ON_WALL_M]
    polygon = _reached(floor.difference(shapely.union_all(outer)), starts)
    doors = []
    for source, start, number in zip(sources, starts, goals, strict=True):
        part = Part(where=f"target {number}", shape=shapes[number])
        way: dict[str, Any] = {"share": _people(source), "start": start, "spread": True}
        if ends := longest_shared(polygon, part):
            doors.append(Doorway(ends=ends, **way))
        else:
            doors.append(_line_before(part, start, polygon, way))
    return Floor(polygon=polygon, doors=tuple(doors))


def _reached(floor: shapely.Geometry, starts: list[shapely.Geometry]) -> shapely.Polygon:
    """The part of a floor with the sources."""
    parts = [part for part in shapely.get_parts(floor) if part.area > 0]
    return polygon_of(
        shapely.union_all(
            [part for part in parts if any(part.intersects(start) for start in starts)] or parts
        )
    )


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
    sides = shapely.linestrings(list(pairwise(floor.exterior.coords)))
    side = sides[int(np.argmin(shapely.distance(sides, target).round(6)))]
    at = shapely.line_locate_point(side, shapely.points(shapely.get_coordinates(target)))
    ends = (side.interpolate(each) for each in (at.min(), at.max()))
    return "--door=" + ",".join(f"{each:.9g}" for end in ends for each in (end.x, end.y))


def _target(
    source: dict[str, Any], targets: dict[int, dict[str, Any]], floor: shapely.Polygon
) -> int:
    """The target of a source. Raises SceneError where it has not one where people leave."""
    ids = [int(one) for one in source.get("targetIds", ())]
    where = f"source {source.get('id')}: targetIds: {ids}"
    if not ids or ids[-1] not in targets:
        raise SceneError(f"{where}. One target is needed, or --door x,y,x,y")
    last = targets[ids[-1]]
    instead = f"Give {_instead(floor, _shape('target', last))}, for example"
    if len(ids) > 1:
        raise SceneError(f"{where}. One target is read, not several in a row. {instead}")
    absorber = last.get("absorber") or {"enabled": last.get("absorbing", True)}
    if not absorber.get("enabled", True):
        raise SceneError(f"target {ids[0]}: nobody leaves there (absorber). {instead}")
    return ids[0]


def _people(source: dict[str, Any]) -> float:
    """How many people a source gives, as far as it says."""
    spawner = source.get("spawner", {})
    said = (
        spawner.get("constraintsElementsMax"),
        source.get("maxSpawnNumberTotal"),
        spawner.get("eventElementCount"),
        source.get("spawnNumber"),
    )
    return next((float(each) for each in said if each is not None and float(each) > 0), 1.0)


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


def _line_before(
    part: Part, start: shapely.Geometry, floor: shapely.Polygon, way: dict[str, Any]
) -> Doorway:
    """The line where people leave at a target within a floor: its longest side, or that of the box
    round a circle, which has all of their source before it."""
    corners, found = len(part.shape.exterior.coords) - 1, []
    hull = shapely.box(*part.shape.bounds) if corners == CORNERS else part.shape.convex_hull
    for first, last in pairwise(np.array(shapely.geometry.polygon.orient(hull).exterior.coords)):
        along = (last - first) / np.hypot(*(last - first))
        into = np.array([-along[1], along[0]])
        if ((shapely.get_coordinates(start) - first) @ into).max() > ON_WALL_M:
            continue
        line = shapely.LineString([first, last])
        on = max(shapely.get_parts(line.intersection(floor)), key=shapely.length, default=None)
        if on is not None and on.length > ON_WALL_M:
            found.append((round(on.length, 6), -round(line.distance(start), 6), on, into))
    if not found:
        raise SceneError(
            f"{part.where}: no side of it has its source before it. Give "
            f"{_instead(floor, part.shape)}, for example"
        )
    *_, on, into = max(found, key=lambda each: each[:2])
    (x0, y0), (x1, y1) = on.coords
    return Doorway(ends=((x0, y0), (x1, y1)), outward=(float(into[0]), float(into[1])), **way)
