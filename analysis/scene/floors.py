"""Floors and their walls, which are the sides less the doors; floors that other programs describe
(WKT, GeoJSON, trajectories of JuPedSim, scenarios of Vadere)."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from analysis.scene.scene import SceneError, Wall
from analysis.scene.waiting import ON_WALL_M, Doorway, Ends
from analysis.support.foreign import read_foreign
from analysis.support.reading import UnreadableError, begins, read_text
from nscd.arrays import Floats
from nscd.segments import dots, lengths


def walled(
    floor: shapely.Polygon,
    ways: Sequence[Doorway],
    barriers: Sequence[Ends] = (),
    names: Sequence[str] = (),
) -> tuple[tuple[Wall, ...], list[Floats], list[Doorway]]:
    """Build the walls of a floor: its sides less its doors, and barriers (both ends of each, m);
    return the unit vector out of each door and the doors on their sides too.

    names: of the walls; wall_1, wall_2, … where left out

    Raises SceneError for a door that is not on one side of the outline or overlaps another one."""
    rings = (floor.exterior, *floor.interiors)
    sides = [side for ring in rings for side in pairwise(np.asarray(ring.coords))]
    outer = list(sides[: len(floor.exterior.coords) - 1])
    outward, placed = [], []
    for way in ways:
        ends = np.asarray(way.ends, dtype=float)
        if not np.isfinite(ends).all() or not np.ptp(ends, axis=0).any():
            raise SceneError(f"door: {way.ends}. Two points are needed")
        side = next((one for one in outer if _on(one, ends)), None)
        if side is None:
            raise SceneError(f"door: {way.ends} m is not on one side of the room's outline")
        start, along = side[0], side[1] - side[0]
        at = np.sort(dots(ends - start, along) / dots(along, along))
        first, last = (start + share * along for share in at)
        # the floor is on the left of its sides
        outward.append(np.array([along[1], -along[0]]) / lengths(along))
        placed.append(replace(way, ends=(_point(first), _point(last))))
        if any(placed[-1].ends == other.ends for other in placed[:-1]):
            continue
        whole = next((i for i, one in enumerate(sides) if _on(one, ends)), None)
        if whole is None:
            raise SceneError(f"door: {way.ends} m overlaps another door")
        pieces = ((sides[whole][0], first), (last, sides[whole][1]))
        sides[whole : whole + 1] = [(a, b) for a, b in pieces if lengths(b - a) > ON_WALL_M]
    sides += [(start, end) for start, end in np.array(barriers).reshape(-1, 2, 2)]
    return walls_between(sides, names), outward, placed


def walls_between(sides: Iterable[Sequence[Any]], names: Sequence[str] = ()) -> tuple[Wall, ...]:
    """Name walls by both ends of each (m): wall_1, wall_2, … without names."""
    return tuple(
        Wall(name=names[i] if names else f"wall_{i + 1}", start_m=_point(a), end_m=_point(b))
        for i, (a, b) in enumerate(sides)
    )


def _on(side: tuple[Floats, Floats], ends: Floats) -> bool:
    """Whether both ends of a door are on a side."""
    distance = shapely.distance(shapely.LineString(side), shapely.points(ends))
    return bool(distance.max() <= ON_WALL_M)


def _point(place: Sequence[float] | Floats) -> tuple[float, float]:
    """Round a place (2,) m to a nanometre."""
    x, y = (round(float(each), 9) + 0.0 for each in place)
    return x, y


# Beyond it a floor is no room.
MOST_M = 1e4
# The longer side: less is a floor in degrees, more one in cm or mm, or no place of one crowd.
LEAST_SIDE_M, MOST_SIDE_M = 0.5, 2000.0
# Areas are collections of polygons of rings; each level of brackets is a call within GEOS.
MOST_NESTED = 100
SQLITE, HDF5 = b"SQLite format 3\0", b"\x89HDF\r\n\x1a\n"
# Corners of a circle.
CORNERS = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Floor:
    """Hold a floor that people can stand on, and its doors, where its file says.

    polygon: m, holes are pillars"""

    polygon: shapely.Polygon
    doors: tuple[Doorway, ...] = ()


class NoFloorError(SceneError):
    """A file that may hold a floor holds none."""


def read_floor(file: Path) -> Floor:
    """Read a floor in metres: WKT, GeoJSON, an SQLite trajectory of JuPedSim (the union of its
    walkable areas), HDF5 of JuPedSim or of the archive in Jülich, or a Vadere scenario. Raises
    SceneError naming the file and what is wrong, NoFloorError for a trajectory without one."""
    try:
        if begins(file, SQLITE):
            return _of_jupedsim(file)
        if begins(file, HDF5):
            return _of_hdf5(file)
        text = read_text(file).strip()
    except UnreadableError as error:
        raise SceneError(str(error)) from None
    try:
        if text.startswith("{"):
            return _of_json(text)
        # what is not a number is refused below
        with np.errstate(invalid="ignore"):
            return Floor(polygon=polygon_of(_of_wkt([text])))
    except (shapely.errors.GEOSException, json.JSONDecodeError, RecursionError) as error:
        raise SceneError(
            f"{file}: neither WKT nor GeoJSON nor a Vadere scenario: {error}"
        ) from None
    except SceneError as error:
        raise SceneError(f"{file}: {error}") from None
    except NotImplementedError:
        raise SceneError(f"{file}: area: curves are not read. Straight sides are needed") from None
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise SceneError(f"{file}: topography: {type(error).__name__}: {error}") from None


def _of_wkt(texts: Sequence[str]) -> shapely.Geometry:
    """The union of areas. Raises SceneError for those within each other that deep that GEOS would
    end the process."""
    for text in texts:
        signs = np.frombuffer(text.encode(), np.uint8)
        depth = np.cumsum((signs == ord("(")).astype(int) - (signs == ord(")")))
        if depth.max(initial=0) > MOST_NESTED:
            raise SceneError(f"area: more than {MOST_NESTED} brackets within each other")
    return shapely.union_all([shapely.from_wkt(text) for text in texts])


def polygon_of(area: Any) -> shapely.Polygon:
    """Make one polygon of what describes a floor: a shapely geometry, or what has one as
    `polygon`."""
    shape = getattr(area, "polygon", area)
    if not (np.abs(shapely.get_coordinates(shape)) <= MOST_M).all():
        raise SceneError(f"area: coordinates in m within ±{MOST_M:g} are needed")
    shape = shapely.union_all(shapely.get_parts(shape))
    if not isinstance(shape, shapely.Polygon) or shape.is_empty:
        raise SceneError(f"area: one polygon in one piece is needed, not {shape.geom_type}")
    if not shape.is_valid:
        raise SceneError(f"area: {shapely.is_valid_reason(shape)}")
    x0, y0, x1, y1 = shape.bounds
    if not LEAST_SIDE_M <= max(x1 - x0, y1 - y0) <= MOST_SIDE_M:
        raise SceneError(
            f"area: {x1 - x0:.4g} m by {y1 - y0:.4g} m. Coordinates in m (not in degrees, cm or mm) "
            f"of a floor from {LEAST_SIDE_M:g} to {MOST_SIDE_M:g} m long are needed"
        )
    return shapely.force_2d(shape.simplify(0.0))


def _of_jupedsim(file: Path) -> Floor:
    """The union of the areas of a file; the first of one of version 1."""
    found = read_foreign(file, "sqlite", ["metadata", "geometry"]).below
    if not {"metadata", "geometry"} <= found.keys() or not found["geometry"].texts("wkt"):
        raise NoFloorError(f"{file}: no geometry of JuPedSim: tables metadata and geometry")
    areas = found["geometry"].texts("wkt")
    said = dict(zip(found["metadata"].texts("key"), found["metadata"].texts("value"), strict=True))
    if (version := said.get("version")) not in ("1", "2"):
        raise SceneError(f"{file}: metadata: version {version}. 1 or 2 is read")
    return _polygon_in(file, areas[:1] if version == "1" else areas)


def _of_hdf5(file: Path) -> Floor:
    """The area in the attribute wkt_geometry of the file."""
    found = read_foreign(file, "hdf5", [".", "frame_geometry"]).below
    area = found["."].attributes.get("wkt_geometry")
    if not isinstance(area, str):
        raise NoFloorError(f"{file}: no geometry: attribute wkt_geometry")
    if "frame_geometry" in found:
        raise SceneError(f"{file}: frame_geometry: a floor that changes is not read")
    return _polygon_in(file, [area])


def _polygon_in(file: Path, areas: Sequence[str]) -> Floor:
    try:
        return Floor(polygon=polygon_of(_of_wkt(areas)))
    except NotImplementedError:
        raise SceneError(f"{file}: geometry: curves are not read") from None
    except (shapely.errors.GEOSException, SceneError) as error:
        raise SceneError(f"{file}: geometry: {error}") from None


def _of_json(text: str) -> Floor:
    content = json.loads(text)
    scenario = content.get("scenario", content.get("vadere", content))
    if "topography" in scenario:
        return _of_vadere(scenario["topography"])
    with np.errstate(invalid="ignore"):
        return Floor(polygon=polygon_of(shapely.from_geojson(text)))


def _of_vadere(topography: dict[str, Any]) -> Floor:
    """The bounds less their border, the obstacles and the targets; a target is a door where the
    floor that has the sources meets it, and a source is where people wait for it."""
    said, bounds = topography["attributes"], topography["attributes"]["bounds"]
    edge = float(said.get("boundingBoxWidth", 0.5)) if said.get("bounded", True) else 0.0
    x, y = float(bounds["x"]), float(bounds["y"])
    right, top = x + float(bounds["width"]), y + float(bounds["height"])
    floor = shapely.box(x + edge, y + edge, right - edge, top - edge)
    obstacles = [_shape("obstacle", one) for one in topography.get("obstacles", ())]
    targets = {int(one["id"]): _shape("target", one) for one in topography.get("targets", ())}
    floor = floor.difference(shapely.union_all([*obstacles, *targets.values()]))
    sources = topography.get("sources", ())
    starts = [_shape("source", one) for one in sources]
    parts = [part for part in shapely.get_parts(floor) if part.area > 0]
    reached = [part for part in parts if any(part.intersects(start) for start in starts)] or parts
    polygon = polygon_of(shapely.union_all(reached))
    doors = []
    for source, start in zip(sources, starts, strict=True):
        number = _target(source, targets)
        ends = _door(polygon, targets[number], number)
        doors.append(Doorway(ends=ends, share=_people(source), start=start))
    return Floor(polygon=polygon, doors=tuple(doors))


def _target(source: dict[str, Any], targets: dict[int, shapely.Geometry]) -> int:
    ids = [int(one) for one in source.get("targetIds", ())]
    if len(ids) != 1 or ids[0] not in targets:
        raise SceneError(f"source {source.get('id')}: targetIds: {ids}. One target is needed")
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


def _door(floor: shapely.Polygon, target: shapely.Geometry, number: int) -> Any:
    """The longest side of the outline that is also a side of a target."""
    shared = floor.exterior.intersection(target.boundary)
    lines = [
        part
        for part in shapely.get_parts(shapely.line_merge(shared))
        if part.geom_type == "LineString" and part.length > ON_WALL_M
    ]
    sides = [
        shapely.LineString(pair) for line in lines for pair in pairwise(line.simplify(0.0).coords)
    ]
    if not sides:
        raise SceneError(
            f"target {number}: it does not lie at the outline of the floor of the sources, as a door does"
        )
    start, end = max(sides, key=lambda side: side.length).coords
    return tuple(start), tuple(end)
