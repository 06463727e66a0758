"""What floor plans of other programs state: floors, obstacles, walls and doors, by their roles (WKT,
GeoJSON, floors of crowd:it)."""

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
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
# Corners and walls this near are one.
MEET_M = 1e-8
# What plans call their parts, without blanks and numbers.
WORDS = {
    "floor": "floor walkable walkablearea area room corridor hall space accessible",
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
class PlanPart:
    """Hold a polygon, line or point of a plan.

    where: its name in messages
    role: floor, obstacle or door; None where the plan does not say
    width: m, of a door that is a point"""

    where: str
    shape: shapely.Geometry
    role: str | None = None
    width: float | None = None


@dataclass(slots=True)
class Plan:
    """Hold the parts of a plan, areas that are on its floor, and what of its file is not used."""

    parts: list[PlanPart] = field(default_factory=list)
    inside: list[shapely.Polygon] = field(default_factory=list)
    unused: list[str] = field(default_factory=list)

    def floor(self, file: Path, own_doors: bool) -> Floor:
        """Build the floor: its areas, or what walls enclose, less obstacles, with the walls that
        stand on it. Says in one line what of the file is not used.

        own_doors: whether doors of the plan are those that people go to

        Raises SceneError for what a plan leaves open."""
        positions = shapely.get_coordinates([part.shape for part in self.parts], include_z=True)
        heights = positions[np.isfinite(positions[:, 2]), 2]
        self.unused += ["heights"] if len(heights) else []
        if len(heights) and np.ptp(heights) > ON_WALL_M:
            raise SceneError(
                f"area: heights from {heights.min():g} to {heights.max():g} m. One storey is needed"
            )
        doors = [part for part in self.parts if part.role == "door"]
        if not own_doors:
            self.unused += [f"{part.where} (a door)" for part in doors]
        areas, obstacles, walls = _sorted(self.parts)
        gaps = [one.shape for one in doors if one.shape.geom_type == "LineString"]
        if len(areas) > 1:
            self.unused.append("sides between its areas")
        area = shapely.union_all(areas) if areas else _enclosed(walls, gaps, self.inside)
        used = [one.shape for one in doors if own_doors and one.shape.geom_type == "Polygon"]
        polygon = polygon_of(shapely.difference(area, shapely.union_all([*obstacles, *used])))
        ways = []
        for part in doors if own_doors else ():
            if (ends := door_of(polygon, part)) is not None:
                ways.append(Doorway(ends=ends))
            elif part.shape.geom_type == "Polygon":
                raise SceneError(f"{part.where}: an exit off the outline. Give --door x,y,x,y")
            else:
                self.unused.append(f"{part.where} (a door within the floor)")
        note_unused(file, "of the plan", self.unused)
        return Floor(polygon=polygon, doors=tuple(ways), barriers=_barriers(walls, polygon, gaps))


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
    return shapely.force_2d(shape.simplify(MEET_M))


def _sorted(parts: Sequence[PlanPart]) -> tuple[list[Any], list[Any], list[Any]]:
    """The areas, the obstacles and the walls. Raises SceneError where a part may be either."""
    shapes = [part for part in parts if part.shape.geom_type == "Polygon"]
    plain = [part for part in shapes if part.role is None]
    areas = [part for part in shapes if part.role == "floor"]
    if areas and plain:
        raise SceneError(f"{plain[0].where}: a polygon beside a floor. {HOW}")
    alike = np.array([part.shape for part in plain], dtype=object)
    for inner, outer in shapely.STRtree(alike).query(alike, predicate="covered_by").T:
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
    lines = [part for part in parts if part.shape.geom_type == "LineString"]
    walls = [part.shape for part in lines if part.role != "door"]
    return [part.shape for part in (*areas, *plain)], obstacles, walls


def _enclosed(walls: Sequence[Any], gaps: Sequence[Any], inside: Sequence[Any]) -> shapely.Geometry:
    """What walls and the gaps in them enclose, less the pillars, which are polygons within another
    one without a gap or an area `inside`. Raises SceneError where they do not close."""
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
    reached = [one for one in parts if any(one.covers(area) for area in inside)]
    return shapely.union_all(reached or parts)


def _barriers(
    walls: Sequence[shapely.Geometry], polygon: shapely.Polygon, gaps: Sequence[Any]
) -> tuple[Ends, ...]:
    """Both ends of the walls that stand on a floor, less its sides and the gaps in them."""
    pairs = [pair for line in walls for pair in pairwise(shapely.get_coordinates(line).tolist())]
    rim = polygon.boundary.buffer(MEET_M)
    there = shapely.union_all([rim, *[gap.buffer(ON_WALL_M, cap_style="flat") for gap in gaps]])
    sides = shapely.linestrings(pairs) if pairs else []
    pieces = shapely.get_parts(shapely.difference(shapely.intersection(sides, polygon), there))
    ends = [(one.coords[0], one.coords[-1]) for one in pieces if one.length > ON_WALL_M]
    return tuple(
        ((round(x0, 7), round(y0, 7)), (round(x1, 7), round(y1, 7))) for (x0, y0), (x1, y1) in ends
    )


def door_of(floor: shapely.Polygon, part: PlanPart) -> Ends | None:
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


def longest_shared(floor: shapely.Polygon, part: PlanPart) -> Ends | None:
    """The longest side of the outline that is also a side of a polygon."""
    sides = shapely.linestrings(list(pairwise(floor.exterior.coords)))
    shared = shapely.line_merge(shapely.intersection(sides, part.shape.boundary))
    longest = max(shapely.get_parts(shared), key=shapely.length, default=None)
    if longest is None or longest.length <= ON_WALL_M:
        return None
    return longest.coords[0], longest.coords[-1]


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
            plan.parts.append(PlanPart(where=where, shape=one))
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
    understood = {"type", "features", "geometry", "properties", "coordinates", "geometries"}
    plan.unused += [key for key in content if key not in understood]
    for number, feature in enumerate(features, start=1):
        where = f"feature {number}"
        stated = (feature.get("properties") or {}) if isinstance(feature, dict) else None
        if not isinstance(stated, dict):
            raise SceneError(f"{where}: it is no feature of GeoJSON")
        plan.unused += [f"{key} of features" for key in feature if key not in understood | {"id"}]
        if feature.get("geometry") is None:
            plan.unused.append(f"{where} (without a geometry)")
            continue
        try:
            shape = shapely.from_geojson(json.dumps(feature["geometry"]))
        except shapely.errors.GEOSException:
            raise SceneError(f"{where}: its geometry is not one of GeoJSON") from None
        role, used = _role(where, stated)
        storeys |= {str(stated[key]) for key in STOREYS if stated.get(key) is not None}
        width = next((stated[key] for key in WIDTHS if role == "door" and key in stated), None)
        if width is not None and not (type(width) in (int, float) and 0 < width <= MOST_M):
            raise SceneError(f"{where}: width: {width!r}. A number above 0, in m, is needed")
        used |= {*STOREYS, *(WIDTHS if role == "door" else ())}
        plan.unused += [f"property {key}" for key in stated if key not in used]
        for one in pieces(shape):
            if role is None and one.geom_type == "Point":
                plan.unused.append(f"{where} (a point)")
                continue
            if role is None and one.geom_type == "LineString" and stated:
                raise SceneError(f"{where}: a line that may be a wall or none. {HOW}")
            plan.parts.append(PlanPart(where=where, shape=one, role=role, width=width))
    if len(storeys) > 1:
        raise SceneError(f"area: storeys {', '.join(sorted(storeys))}. One storey is needed")
    return plan


def _role(where: str, properties: dict[str, Any]) -> tuple[str | None, set[str]]:
    """The role of a feature and the properties that say it."""
    found: set[str] = set()
    used: set[str] = set()
    for key, value in properties.items():
        flag = ROLES.get(_word(key)) if value not in (False, None, 0, "", "no", "false") else None
        role = ROLES.get(_word(value)) if key.lower() in KINDS else None
        role = role or (flag if flag != "floor" else None)
        if role:
            used.add(key)
            found.add(role)
    if len(found) > 1:
        raise SceneError(f"{where}: its properties say {' and '.join(sorted(found))}. {HOW}")
    if not found and (role := ROLES.get(_word(properties.get(NAME)))):
        return role, {*used, NAME}
    return next(iter(found), None), used


def _word(text: Any) -> str:
    """A word without blanks, numbers and single letters."""
    letters = re.findall("[a-z]+", text.lower()) if isinstance(text, str) else []
    return "".join(each for each in letters if len(each) > 1)


def of_xml(root: ElementTree.Element) -> Plan:
    """Plan of a floor of crowd:it: its walls, and its zones as places where people are."""
    if root.tag != "floor":
        raise SceneError(
            f"<{root.tag}>: not read. WKT, GeoJSON, floors of crowd:it, trajectories of JuPedSim and "
            "scenarios of Vadere are"
        )
    plan = Plan()
    for one in root.iterfind("layer/*"):
        where = f"{one.tag} {one.get('id')}"
        try:
            points = [(float(at.attrib["x"]), float(at.attrib["y"])) for at in one.iter("point")]
            if one.tag == "wall":
                line = shapely.LineString(points + points[:1] * (one.get("closed") == "true"))
                plan.parts.append(PlanPart(where=where, shape=line))
                continue
            if one.tag == "wunderZone" and len(points) > 2:
                plan.inside.append(shapely.Polygon(points))
        except (KeyError, ValueError, shapely.errors.GEOSException):
            raise SceneError(f"{where}: points <point x y> are needed") from None
        plan.unused.append(where)
    _fill(plan.parts, plan.inside)
    return plan


def _fill(parts: list[PlanPart], inside: Sequence[shapely.Polygon]) -> None:
    """Make obstacles of the closed walls of crowd:it, but of the outline and of those around an area
    `inside`. Raises SceneError for closed walls apart from each other, with none around them."""
    faces = shapely.get_parts(shapely.polygonize([shapely.union_all([p.shape for p in parts])]))
    filled = shapely.union_all([shapely.Polygon(face.exterior) for face in faces])
    constrained = inside and all(shapely.covers(shapely.get_parts(filled), one).any() for one in inside)
    if filled.geom_type == "MultiPolygon" and not constrained:
        x0, y0, x1, y1 = filled.bounds
        raise SceneError(
            "walls: closed ones are solid, and what lies between these has no outline. Add a closed "
            f"wall around the floor, as from ({x0:g}, {y0:g}) to ({x1:g}, {y1:g}) m"
        )
    rings = [shapely.Polygon(part.shape) if part.shape.is_ring else None for part in parts]
    outline = max((one for one in rings if one), key=shapely.area, default=shapely.Polygon())
    for i, one in enumerate(rings):
        if one is None or one.equals(outline) or any(one.covers(zone) for zone in inside):
            continue
        if outline.covers(one.representative_point()):  # it may stick out by rounding
            parts[i] = replace(parts[i], shape=one, role="obstacle")
