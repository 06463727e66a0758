"""Floors and their walls, which are the sides less the doors; floors of files of other programs."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from analysis.scene.plan_roles import Floor, of_geojson, of_shape, of_xml, polygon_of
from analysis.scene.scene import SceneError, Wall
from analysis.scene.vadere import of_vadere
from analysis.scene.waiting import ON_WALL_M, Doorway, Ends
from analysis.support.foreign import read_foreign
from analysis.support.reading import UnreadableError, begins, parsed_xml, read_text
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
        first, last = (start + fraction * along for fraction in at)
        # the floor is on the left of its sides
        outward.append(np.array([along[1], -along[0]]) / lengths(along))
        placed.append(replace(way, ends=(_point(first), _point(last))))
        if any(placed[-1].ends == other.ends for other in placed[:-1]):
            continue
        full = next((i for i, one in enumerate(sides) if _on(one, ends)), None)
        if full is None:
            raise SceneError(f"door: {way.ends} m overlaps another door")
        pieces = ((sides[full][0], first), (last, sides[full][1]))
        sides[full : full + 1] = [(a, b) for a, b in pieces if lengths(b - a) > ON_WALL_M]
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


def _point(position: Sequence[float] | Floats) -> tuple[float, float]:
    """Round a place (2,) m to a nanometre."""
    x, y = (round(float(each), 9) + 0.0 for each in position)
    return x, y


# Areas are collections of polygons of rings; each level of brackets is a call within GEOS.
MOST_NESTED = 100
SQLITE, HDF5 = b"SQLite format 3\0", b"\x89HDF\r\n\x1a\n"


class NoFloorError(SceneError):
    """A file that may hold a floor holds none."""


def read_floor(file: Path, *, own_doors: bool = True) -> Floor:
    """Read a floor in metres: WKT, GeoJSON, an SQLite trajectory of JuPedSim (the union of its
    walkable areas), HDF5 of JuPedSim or of the archive in Jülich, a Vadere scenario or a
    floor of crowd:it. Raises SceneError naming the file and what is wrong, NoFloorError for a
    trajectory without one.

    own_doors: whether doors and targets of the file are those of the floor"""
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
            return _of_json(file, text, own_doors)
        if text.startswith("<"):
            return of_xml(parsed_xml(file, text)).floor(file, own_doors)
        # what is not a number is refused below
        with np.errstate(invalid="ignore"):
            return of_shape(_of_wkt([text])[0]).floor(file, own_doors)
    except (shapely.errors.GEOSException, json.JSONDecodeError, RecursionError) as error:
        raise SceneError(
            f"{file}: neither WKT, GeoJSON, XML nor a Vadere scenario: {error}"
        ) from None
    except SceneError as error:
        raise SceneError(f"{file}: {error}") from None
    except NotImplementedError:
        raise SceneError(f"{file}: area: curves are not read. Straight sides are needed") from None
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise SceneError(f"{file}: {type(error).__name__}: {error}") from None


def _of_wkt(texts: Sequence[str]) -> list[shapely.Geometry]:
    """The areas of texts. Raises SceneError for those within each other that deep that GEOS would
    end the process."""
    for text in texts:
        signs = np.frombuffer(text.encode(), np.uint8)
        depth = np.cumsum((signs == ord("(")).astype(int) - (signs == ord(")")))
        if depth.max(initial=0) > MOST_NESTED:
            raise SceneError(f"area: more than {MOST_NESTED} brackets within each other")
    return [shapely.from_wkt(text) for text in texts]


def _of_jupedsim(file: Path) -> Floor:
    """The union of the areas of a file; the first of one of version 1."""
    found = read_foreign(file, "sqlite", ["metadata", "geometry", "frame_data"]).below
    if not {"metadata", "geometry"} <= found.keys() or not found["geometry"].texts("wkt"):
        raise NoFloorError(f"{file}: no geometry of JuPedSim: tables metadata and geometry")
    areas = found["geometry"].texts("wkt")
    stated = dict(zip(found["metadata"].texts("key"), found["metadata"].texts("value"), strict=True))
    if (version := stated.get("version")) not in ("1", "2"):
        raise SceneError(f"{file}: metadata: version {version}. 1 or 2 is read")
    numbers, of_frames = found["geometry"].below.get("hash"), found.get("frame_data")
    if version == "2" and numbers is not None and of_frames is not None:
        stood = np.asarray(of_frames.below["geometry_hash"].values)
        used = np.isin(np.asarray(numbers.values), stood)
        areas = [area for area, one in zip(areas, used, strict=True) if one] or areas
        if used.any() and len({*areas}) > 1:
            raise SceneError(f"{file}: frame_data: a floor that changes is not read")
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
        return Floor(polygon=polygon_of(shapely.union_all(_of_wkt(areas))))
    except NotImplementedError:
        raise SceneError(f"{file}: geometry: curves are not read") from None
    except (shapely.errors.GEOSException, SceneError) as error:
        raise SceneError(f"{file}: geometry: {error}") from None


def _of_json(file: Path, text: str, own_doors: bool) -> Floor:
    content = json.loads(text)
    scenario = content.get("scenario", content.get("vadere", content))
    if "topography" in scenario:
        try:
            return of_vadere(file, scenario, own_doors)
        except SceneError:
            raise
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise SceneError(f"topography: {type(error).__name__}: {error}") from None
    with np.errstate(invalid="ignore"):
        return of_geojson(content).floor(file, own_doors)
