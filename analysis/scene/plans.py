"""What floor plans of other programs state: floors, obstacles, walls and doors, by their roles (WKT,
GeoJSON, XML of JuPedSim and crowd:it)."""

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import shapely

from analysis.scene.scene import SceneError
from analysis.scene.waiting import ON_WALL_M, Doorway, Ends
from analysis.support.reading import note_unused

# Beyond it a floor is no room.
MOST_M = 1e4
# The longer side: less is a floor in degrees, more one in cm or mm, or no place of one crowd.
LEAST_SIDE_M, MOST_SIDE_M = 0.5, 2000.0
# A door drawn this near to the outline is on it.
SNAP_M = 0.01
# What plans call their parts, without blanks and numbers.
WORDS = {
    "floor": "floor walkable walkablearea area room corridor hall space accessible polygon",
    "obstacle": "obstacle obstacles pillar column wall walls barrier partition fence furniture hole",
    "door": "door doorway exit gate entrance emergencyexit mainentrance",
}
ROLES = {word: role for role, words in WORDS.items() for word in words.split()}
# Properties that say what a feature is; the last one only where no other does.
KINDS, NAME = ("type", "kind", "class", "role", "category", "usage"), "name"
GEOJSON = ("FeatureCollection", "Feature", "GeometryCollection", "Polygon", "MultiPolygon")
STOREYS = ("level", "storey", "story")
WIDTHS = ("width_m", "width")
HOW = "Give it the property type: floor, obstacle, wall or door"


@dataclass(frozen=True, slots=True, kw_only=True)
class Floor:
    """Hold a floor that people can stand on, and its doors, where its file says.

    polygon: m, holes are pillars
    barriers: both ends (m) of walls on it without thickness"""

    polygon: shapely.Polygon
    doors: tuple[Doorway, ...] = ()
    barriers: tuple[Ends, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """Hold a polygon, line or point of a plan.

    where: its name in messages
    role: floor, obstacle, door or opening (between two rooms); None where the plan does not say
    width: m, of a door that is a point"""

    where: str
    shape: shapely.Geometry
    role: str | None = None
    width: float | None = None


@dataclass(slots=True)
class Plan:
    """Hold the parts of a plan, points that are on its floor, and what of its file is not used."""

    parts: list[Part] = field(default_factory=list)
    inside: list[shapely.Point] = field(default_factory=list)
    unused: list[str] = field(default_factory=list)

    def floor(self, file: Path, own_doors: bool) -> Floor:
        """Build the floor: its areas, or what walls enclose, less obstacles, with the walls that
        stand on it. Says in one line what of the file is not used.

        own_doors: whether doors of the plan are those that people go to

        Raises SceneError for what a plan leaves open."""
        self._check_heights([part.shape for part in self.parts])
        doors = [part for part in self.parts if part.role == "door"]
        if not own_doors:
            self.unused += [f"{part.where} (a door)" for part in doors]
        areas, obstacles, walls = _sorted(self.parts)
        lines = [part.shape for part in self.parts if part.role in ("door", "opening")]
        if len(areas) > 1:
            self.unused.append("sides between its areas")
        area = shapely.union_all(areas) if areas else _enclosed(walls, lines, self.inside)
        taken = [one.shape for one in doors if own_doors and one.shape.geom_type == "Polygon"]
        polygon = polygon_of(shapely.difference(area, shapely.union_all([*obstacles, *taken])))
        ways = []
        for part in doors if own_doors else ():
            if (ends := door_of(polygon, part)) is not None:
                ways.append(Doorway(ends=ends))
            elif part.shape.geom_type == "Polygon":
                raise SceneError(f"{part.where}: an exit off the outline. Give --door x,y,x,y")
            else:
                self.unused.append(f"{part.where} (a door within the floor)")
        note_unused(file, "of the plan", self.unused)
        gaps = [one for one in lines if one.geom_type == "LineString"]
        return Floor(
            polygon=polygon, doors=tuple(ways), barriers=tuple(_standing(walls, polygon, gaps))
        )

    def _check_heights(self, shapes: Sequence[shapely.Geometry]) -> None:
        heights = shapely.get_coordinates(shapes, include_z=True)[:, 2]
        heights = heights[np.isfinite(heights)]
        if len(heights) and np.ptp(heights) > ON_WALL_M:
            raise SceneError(
                f"area: heights from {heights.min():g} to {heights.max():g} m. One storey is needed"
            )
        self.unused += ["heights"] if len(heights) else []


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


def _sorted(parts: Sequence[Part]) -> tuple[list[Any], list[Any], list[Any]]:
    """The areas, the obstacles and the walls. Raises SceneError where a part may be either."""
    shapes = [part for part in parts if part.shape.geom_type == "Polygon"]
    plain = [part for part in shapes if part.role is None]
    areas = [part for part in shapes if part.role == "floor"]
    if areas and plain:
        raise SceneError(f"{plain[0].where}: a polygon beside a floor. {HOW}")
    plain_shapes = np.array([part.shape for part in plain], dtype=object)
    within = shapely.STRtree(plain_shapes).query(plain_shapes, predicate="covered_by")
    for inner, outer in within.T:
        if inner != outer:
            raise SceneError(
                f"{plain[inner].where}: it lies within {plain[outer].where}. Pillars are holes, or "
                "have the property type: obstacle"
            )
    for part in parts:
        if not np.isfinite(shapely.get_coordinates(part.shape)).all():
            raise SceneError(f"{part.where}: a coordinate is no number")
        if part.shape.geom_type == "Polygon" and not part.shape.is_valid:
            raise SceneError(f"{part.where}: {shapely.is_valid_reason(part.shape)}")
        if part.role == "floor" and part.shape.geom_type != "Polygon":
            raise SceneError(f"{part.where}: a floor is a polygon, not a {part.shape.geom_type}")
        if part.role == "obstacle" and part.shape.geom_type == "Point":
            raise SceneError(f"{part.where}: an obstacle is a polygon or a line, not a point")
    obstacles = [part.shape for part in shapes if part.role == "obstacle"]
    walls = [
        part.shape
        for part in parts
        if part.role in (None, "obstacle") and part.shape.geom_type == "LineString"
    ]
    return [part.shape for part in (*areas, *plain)], obstacles, walls


def _enclosed(walls: Sequence[Any], gaps: Sequence[Any], inside: Sequence[Any]) -> shapely.Geometry:
    """What walls and the gaps in them enclose, less the pillars, which are polygons within another
    one without a gap or a point `inside`. Raises SceneError where they do not close."""
    lines = shapely.union_all(shapely.force_2d([*walls, *gaps]))
    faces, _, dangles, _ = shapely.polygonize_full([lines])
    faces = shapely.get_parts(faces)
    if not len(faces):
        ends = shapely.get_coordinates(dangles)
        where = f"the walls are open at ({ends[0, 0]:g}, {ends[0, 1]:g}) m" if len(ends) else "none"
        raise SceneError(f"area: a floor is needed, as a polygon or between closed walls: {where}")
    tree = shapely.STRtree([shapely.Polygon(face.exterior) for face in faces])
    within = {one for one, other in tree.query(faces, predicate="covered_by").T if one != other}
    stood = {*tree.query(inside, predicate="within")[1]} if inside else set()
    stood |= {i for i in within if any(faces[i].exterior.covers(gap) for gap in gaps)}
    floor = shapely.union_all([f for i, f in enumerate(faces) if i not in within or i in stood])
    parts = shapely.get_parts(floor)
    reached = [one for one in parts if any(one.covers(point) for point in inside)]
    return shapely.union_all(reached or parts)


def _standing(
    walls: Sequence[shapely.Geometry], polygon: shapely.Polygon, gaps: Sequence[Any]
) -> Iterator[Ends]:
    """Both ends of the walls that stand on a floor, less its sides and the gaps in them."""
    pairs = [pair for line in walls for pair in pairwise(shapely.get_coordinates(line).tolist())]
    if not pairs:
        return
    sides = shapely.linestrings(pairs)
    sides = sides[shapely.length(sides) > 0]
    rim = polygon.boundary.buffer(ON_WALL_M)
    cut = shapely.union_all([gap.buffer(ON_WALL_M, cap_style="flat") for gap in gaps])
    shapely.prepare(polygon)
    for side, whole in zip(sides, shapely.contains_properly(polygon, sides), strict=True):
        rest = side if whole else side.intersection(polygon)
        for there in (cut,) if whole else (rim, cut):
            # what only ends there is whole
            less = rest.difference(there)
            rest = less if rest.length - less.length > 1e3 * ON_WALL_M else rest
        for piece in shapely.get_parts(rest):
            if piece.length > 10 * ON_WALL_M:
                first, last = piece.coords[0], piece.coords[-1]
                yield (first[0], first[1]), (last[0], last[1])


def door_of(floor: shapely.Polygon, part: Part) -> Ends | None:
    """The ends of a door on the outline of a floor: of a line on it, of a point with a width, or the
    longest side that is also one of a polygon; None for a door within the floor."""
    if part.shape.geom_type == "Polygon":
        return longest_shared(floor, part)
    points = shapely.points(shapely.get_coordinates(part.shape)[[0, -1]])
    if part.shape.geom_type == "Point" and part.width is None:
        raise SceneError(f"{part.where}: a door needs a width. Give it width_m, or a line")
    for pair in pairwise(floor.exterior.coords):
        side = shapely.LineString(pair)
        if shapely.distance(side, points).max() <= SNAP_M:
            at = shapely.line_locate_point(side, points)
            if part.width is not None and part.shape.geom_type == "Point":
                at = at + 0.5 * part.width * np.array([-1.0, 1.0])
            if at.min() >= 0 and at.max() <= side.length:
                start, end = (side.interpolate(each) for each in at)
                return (start.x, start.y), (end.x, end.y)
    if part.shape.geom_type == "LineString" and floor.covers(part.shape):
        return None
    x, y = shapely.get_coordinates(part.shape)[0]
    raise SceneError(f"{part.where}: a door at ({x:g}, {y:g}) m is not on one side of the outline")


def longest_shared(floor: shapely.Polygon, part: Part) -> Ends | None:
    """The longest side of the outline that is also a side of a polygon."""
    shared = floor.exterior.intersection(part.shape.boundary)
    lines = [
        each
        for each in shapely.get_parts(shapely.line_merge(shared))
        if each.geom_type == "LineString" and each.length > ON_WALL_M
    ]
    sides = [
        shapely.LineString(pair) for line in lines for pair in pairwise(line.simplify(0.0).coords)
    ]
    if not sides:
        return None
    (x0, y0), (x1, y1) = max(sides, key=lambda side: side.length).coords
    return (x0, y0), (x1, y1)


def pieces(shape: shapely.Geometry) -> Iterator[shapely.Geometry]:
    """Give the polygons, lines and points of a geometry."""
    if shape.geom_type == "LinearRing":
        yield shapely.LineString(shape.coords)
    elif not hasattr(shape, "geoms"):
        yield shape
    else:
        for each in shape.geoms:
            yield from pieces(each)


def of_shape(shape: shapely.Geometry) -> Plan:
    """Plan of a geometry without properties: polygons are floors, lines walls."""
    plan = Plan()
    for number, one in enumerate(pieces(shape), start=1):
        where = f"{one.geom_type.upper()} {number}"
        if one.geom_type == "Point":
            plan.unused.append(where)
        else:
            plan.parts.append(Part(where=where, shape=one))
    return plan


def of_geojson(content: dict[str, Any]) -> Plan:
    """Plan of GeoJSON. Raises SceneError naming the feature whose part of it is not clear."""
    if (kind := content.get("type")) not in GEOJSON:
        raise SceneError(f"type: {kind!r}. GeoJSON or a scenario of Vadere is needed")
    crs = json.dumps(content.get("crs"))
    if re.search(r"CRS84|EPSG:+(4326|4258)\b", crs):
        raise SceneError("crs: coordinates in degrees. A projection in metres is needed")
    features = [content] if kind == "Feature" else [{"geometry": content}]
    if kind == "FeatureCollection":
        features = content.get("features", ())
    plan, storeys = Plan(), set()
    known = {"type", "features", "geometry", "properties", "coordinates", "geometries"}
    plan.unused += [key for key in content if key not in known]
    for number, feature in enumerate(features, start=1):
        where = f"feature {number}"
        said = (feature.get("properties") or {}) if isinstance(feature, dict) else None
        if not isinstance(said, dict):
            raise SceneError(f"{where}: it is no feature of GeoJSON")
        plan.unused += [f"{key} of features" for key in feature if key not in known | {"id"}]
        if feature.get("geometry") is None:
            plan.unused.append(f"{where} (without a geometry)")
            continue
        try:
            shape = shapely.from_geojson(json.dumps(feature["geometry"]))
        except shapely.errors.GEOSException:
            raise SceneError(f"{where}: its geometry is not one of GeoJSON") from None
        role, used = _role(where, said)
        storeys |= {str(said[key]) for key in STOREYS if said.get(key) is not None}
        width = next((said[key] for key in WIDTHS if role == "door" and key in said), None)
        used |= {*STOREYS, *(WIDTHS if role == "door" else ())}
        plan.unused += [f"property {key}" for key in said if key not in used]
        for one in pieces(shape):
            if role is None and one.geom_type == "Point":
                plan.unused.append(f"{where} (a point)")
                continue
            if role is None and one.geom_type == "LineString" and said:
                raise SceneError(f"{where}: a line that may be a wall or none. {HOW}")
            plan.parts.append(Part(where=where, shape=one, role=role, width=_width(where, width)))
    if len(storeys) > 1:
        raise SceneError(f"area: storeys {', '.join(sorted(storeys))}. One storey is needed")
    return plan


def _width(where: str, width: Any) -> float | None:
    if width is None:
        return None
    if isinstance(width, bool) or not isinstance(width, int | float) or not 0 < width <= MOST_M:
        raise SceneError(f"{where}: width: {width!r}. A number above 0, in m, is needed")
    return float(width)


def _role(where: str, said: dict[str, Any]) -> tuple[str | None, set[str]]:
    """The role of a feature and the properties that say it (or its kind, in other words)."""
    found, used = set(), set()
    for key, value in said.items():
        flag = ROLES.get(_word(key)) if value not in (False, None, 0, "", "no", "false") else None
        role = ROLES.get(_word(value)) if key.lower() in KINDS else None
        role = role or (flag if flag != "floor" else None)
        if key.lower() in KINDS or role:
            used.add(key.lower() if key.lower() in KINDS else key)
        found |= {role} if role else set()
    if len(found) > 1:
        raise SceneError(f"{where}: its properties say {' and '.join(sorted(found))}. {HOW}")
    if not found and (role := ROLES.get(_word(said.get(NAME)))):
        return role, {*used, NAME}
    return next(iter(found), None), used


def _word(text: Any) -> str:
    """A word without blanks, numbers and single letters."""
    letters = re.findall("[a-z]+", text.lower()) if isinstance(text, str) else []
    return "".join(each for each in letters if len(each) > 1)


def of_xml(root: ElementTree.Element) -> Plan:
    """Plan of a floor of crowd:it, or of a geometry of JuPedSim with rooms. Raises SceneError for
    other files, stairs and several storeys."""
    if root.tag == "floor":
        return _of_crowdit(root)
    if root.tag == "geometry" and root.find("rooms") is not None:
        return _of_rooms(root)
    raise SceneError(
        f"<{root.tag}>: no floor. Read are <floor> of crowd:it and <geometry> of JuPedSim, with rooms"
    )


def _line(where: str, element: ElementTree.Element, tag: str, keys: tuple[str, str]) -> Any:
    try:
        points = [tuple(float(one.attrib[key]) for key in keys) for one in element.findall(tag)]
        return shapely.LineString(points)
    except (KeyError, ValueError, shapely.errors.GEOSException):
        raise SceneError(f"{where}: two points <{tag} {keys[0]} {keys[1]}> are needed") from None


def _number(where: str, element: ElementTree.Element, key: str) -> float:
    try:
        return float(element.get(key) or 0.0)
    except ValueError:
        raise SceneError(f"{where}: {key}: {element.get(key)!r} is no number") from None


def _of_crowdit(root: ElementTree.Element) -> Plan:
    """Walls; named zones are where people are, whatever they do there."""
    plan = Plan()
    for layer in root.findall("layer"):
        for one in layer:
            where, keys = f"{one.tag} {one.get('id')}", ("x", "y")
            if one.tag == "wall":
                line = _line(where, one, "point", keys)
                ring = [*line.coords, *(line.coords[:1] if one.get("closed") == "true" else ())]
                plan.parts.append(Part(where=where, shape=shapely.LineString(ring)))
                continue
            plan.unused.append(where)
            if one.tag == "wunderZone" and len(one.findall("point")) > 2:
                zone = shapely.Polygon(_line(where, one, "point", keys).coords)
                plan.inside.append(zone.representative_point())
    return plan


# Elements and attributes of a geometry of JuPedSim.
ROOMS = (
    "geometry unit rooms room id zpos subroom class A_x B_y C_z polygon vertex px py obstacles "
    "obstacle crossings crossing transitions transition room1_id room2_id"
)


def _of_rooms(root: ElementTree.Element) -> Plan:
    """Walls of all rooms, obstacles, and crossings and transitions between rooms or out of them."""
    if (unit := root.get("unit", "m")) != "m":
        raise SceneError(f"geometry: unit {unit!r}. Metres are needed")
    plan, heights, keys = Plan(), set(), ("px", "py")
    for room in root.iterfind("rooms/room"):
        for sub in room.findall("subroom"):
            where = f"room {room.get('id')}, subroom {sub.get('id')}"
            slope = [_number(where, sub, key) for key in ("A_x", "B_y")]
            if any(slope) or "stair" in sub.get("class", "").lower():
                raise SceneError(f"{where}: stairs. One storey is needed")
            heights.add(_number(where, room, "zpos") + _number(where, sub, "C_z"))
            for one in sub.iterfind("polygon"):
                plan.parts.append(Part(where=where, shape=_line(where, one, "vertex", keys)))
            for one in sub.iterfind("obstacles/obstacle/polygon"):
                ring = shapely.Polygon(_line(f"{where}, obstacle", one, "vertex", keys).coords)
                plan.parts.append(Part(where=f"{where}, obstacle", shape=ring, role="obstacle"))
    if len(heights) > 1:
        raise SceneError(f"geometry: heights {sorted(heights)} m. One storey is needed")
    for one in [*root.iterfind(".//crossing"), *root.iterfind("transitions/transition")]:
        where = f"{one.tag} {one.get('id')}"
        out = one.tag == "transition" and "-1" in (one.get("room1_id"), one.get("room2_id"))
        shape = _line(where, one, "vertex", keys)
        plan.parts.append(Part(where=where, shape=shape, role="door" if out else "opening"))
    known = ROOMS.split()
    plan.unused += [f"<{one.tag}>" for one in root.iter() if one.tag not in known]
    plan.unused += [key for one in root.iter() for key in one.attrib if key not in known]
    return plan
