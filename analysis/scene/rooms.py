"""A scene of one's own: a room, its door, and a crowd before it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from pydantic import ValidationError

from analysis.scene.anthropometry import Varied, apart
from analysis.scene.scene import (
    Analysis,
    ContactModel,
    Drive,
    Room,
    Run,
    Scene,
    SceneError,
    Wall,
    first_problem,
)
from analysis.support.reading import UnreadableError, read_text
from nscd import Snapshot, Walls
from nscd.arrays import Floats
from nscd.stepping import StepError

# Share of the floor that disks cover where they wait: dense, and still without order.
COVER = 0.6
# They cannot be placed at random above it.
MOST_COVER = 0.6
# Disks put one after the other at random can cover 0.547.
PUT_COVER = 0.42
ON_WALL_M = 1e-6
# More people than these take minutes; more of the others is no crowd.
MOST_PEOPLE, MOST_PUSH_N, MOST_S, MOST_M = 5000, 1e5, 1e5, 1e4
TRIES, HALVINGS = 20_000, 40
RESTITUTION = 0.1

Door = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Crowd:
    """Describe a crowd that waits before a door.

    people: how many
    radius, mass: m and kg, the means, where `varied` does not bring its own
    varied: how people differ, and the seed of all that is random
    push: N, of a person of mean mass who is held
    speed: m/s, desired; without it push τ/m̄ with τ = 0.5 s
    """

    people: int
    radius: float = 0.2
    mass: float = 75.0
    varied: Varied = field(default_factory=lambda: Varied(radius_share=0.1))
    push: float = 150.0
    speed: float | None = None


def room(
    name: str, length: float, width: float, door: float, crowd: Crowd, duration: float = 10.0
) -> Scene:
    """Make a scene of a rectangular room x < 0, `length` by `width` (m), whose door of width `door`
    (m) is in the middle of the side x = 0. Raises SceneError as `from_geometry` does.

    >>> small = room("small", 4.0, 3.0, 0.8, Crowd(people=20))
    >>> len(small.snapshot), [wall.name for wall in small.walls]
    (20, ['wall_1', 'wall_2', 'wall_3', 'wall_4', 'wall_5'])
    """
    if not (length > 0 and width > 0):
        raise SceneError(f"room: {length:g} m by {width:g} m; positive lengths are needed")
    if not 0 < door <= width:
        raise SceneError(f"door: {door:g} m; more than 0 and at most the side of {width:g} m")
    box = shapely.box(-length, -0.5 * width, 0.0, 0.5 * width)
    return from_geometry(name, box, ((0.0, -0.5 * door), (0.0, 0.5 * door)), crowd, duration)


def from_geometry(name: str, area: Any, door: Door, crowd: Crowd, duration: float = 10.0) -> Scene:
    """Make a scene of the floor that people can stand on.

    area: a shapely polygon, or what has one as `polygon` (PedPy's WalkableArea); holes are pillars
    door: its ends, m, on one side of the outline
    duration: s, to simulate

    People wait at the places nearest to the door, at random (`crowd.varied.seed`) and pushed apart
    until none overlap.

    Raises SceneError for a door that is not on the outline, for a crowd that does not fit, and for
    lengths that are not positive."""
    _check(crowd, duration)
    floor = shapely.geometry.polygon.orient(_polygon(area))
    walls, outward, door = _walls(floor, door)
    radius, mass = _bodies(crowd)
    position = _places(floor, door, radius, crowd.varied.seed)
    snapshot = Snapshot(
        position=position, velocity=np.zeros_like(position), radius=radius, mass=mass
    )
    shut = np.array([*((wall.start_m, wall.end_m) for wall in walls), door])
    try:
        snapshot = apart(snapshot, Walls(start=shut[:, 0], end=shut[:, 1]))
    except StepError as error:
        raise SceneError(f"people: {error}") from None
    drive = _drive(crowd, float(mass.mean()), door, outward)
    try:
        parts = Room(
            title=f"{crowd.people} people before a door of {np.hypot(*np.subtract(*door)):.3g} m",
            source="percussions new",
            walls=walls,
            drive=drive,
            contact=ContactModel(stiffness_N_per_m=1e6, restitution=RESTITUTION),
            run=Run(duration_s=duration, frames=max(1, round(10 * duration))),
            analysis=Analysis(kind="driven", time_s=duration),
        )
    except ValidationError as error:
        raise SceneError(first_problem(error)) from None
    notes = f"""{crowd.people} people of radius {radius.mean():.3f} ± {radius.std():.3f} m and mass
{mass.mean():.1f} ± {mass.std():.1f} kg, who push with {crowd.push:g} N, wait at random places
before a door (seed {crowd.varied.seed}). Disks cover {_cover(radius, floor):.0%} of the floor."""
    if hidden := _hidden(snapshot.position, floor, door):
        notes += f"\n{hidden} of them have a wall between them and the door, and push against it."
    scene = Scene.of(parts, name=name, notes=notes, snapshot=snapshot)
    scene.check(name)
    return scene


def read_area(file: Path) -> shapely.Polygon:
    """Read the floor of a WKT or GeoJSON file, in metres, as PedPy and JuPedSim take it. Raises
    SceneError naming the file."""
    try:
        text = read_text(file).strip()
    except UnreadableError as error:
        raise SceneError(str(error)) from None
    try:
        # what is not a number is refused below
        with np.errstate(invalid="ignore"):
            shape = shapely.from_geojson(text) if text.startswith("{") else shapely.from_wkt(text)
    except shapely.errors.GEOSException as error:
        raise SceneError(f"{file}: neither WKT nor GeoJSON: {error}") from None
    try:
        return _polygon(shape)
    except SceneError as error:
        raise SceneError(f"{file}: {error}") from None


def _check(crowd: Crowd, duration: float) -> None:
    """Raise SceneError for what would take for ever, or is no crowd."""
    for name, number, most in (
        ("people", crowd.people, MOST_PEOPLE),
        ("push", crowd.push, MOST_PUSH_N),
        ("duration", duration, MOST_S),
    ):
        if not 0 < number <= most:
            raise SceneError(f"{name}: {number:g}; above 0 and at most {most:g} is needed")


def _polygon(area: Any) -> shapely.Polygon:
    """One polygon of what describes a floor."""
    shape = getattr(area, "polygon", area)
    if not (np.abs(shapely.get_coordinates(shape)) <= MOST_M).all():
        raise SceneError(f"area: coordinates in m within ±{MOST_M:g} are needed")
    shape = shapely.union_all(shapely.get_parts(shape))
    if not isinstance(shape, shapely.Polygon) or shape.is_empty:
        raise SceneError(f"area: one polygon is needed, not {shape.geom_type}")
    if not shape.is_valid:
        raise SceneError(f"area: {shapely.is_valid_reason(shape)}")
    return shapely.force_2d(shape.simplify(0.0))


def _walls(floor: shapely.Polygon, door: Door) -> tuple[tuple[Wall, ...], Floats, Door]:
    """The sides of a floor but for its door, the unit vector out of the door, and the door on its
    side."""
    sides = list(_sides(floor))
    outer = len(floor.exterior.coords) - 1
    ends = np.asarray(door, dtype=float)
    if not np.isfinite(ends).all() or not np.ptp(ends, axis=0).any():
        raise SceneError(f"door: {door}; two points are needed")
    number = next((i for i, side in enumerate(sides[:outer]) if _on(side, ends)), None)
    if number is None:
        raise SceneError(f"door: {door} m is not on one side of the room's outline")
    start, end = sides[number]
    along = end - start
    length = float(np.hypot(*along))
    at = np.sort((ends - start) @ along / length**2)
    first, last = (start + share * along for share in at)
    rest = [(a, b) for a, b in ((start, first), (last, end)) if np.hypot(*(b - a)) > ON_WALL_M]
    sides[number : number + 1] = rest
    walls = tuple(
        Wall(name=f"wall_{i}", start_m=_point(a), end_m=_point(b))
        for i, (a, b) in enumerate(sides, 1)
    )
    # the floor is on the left of its sides
    return walls, np.array([along[1], -along[0]]) / length, (_point(first), _point(last))


def _on(side: tuple[Floats, Floats], ends: Floats) -> bool:
    """Whether both ends of a door are on a side."""
    distance = shapely.distance(shapely.LineString(side), shapely.points(ends))
    return bool(distance.max() <= ON_WALL_M)


def _sides(floor: shapely.Polygon) -> Iterator[tuple[Floats, Floats]]:
    """Both ends of each side, those of the outline first."""
    for ring in (floor.exterior, *floor.interiors):
        yield from pairwise(np.asarray(ring.coords))


def _point(place: Floats) -> tuple[float, float]:
    x, y = (round(float(each), 9) + 0.0 for each in place)
    return x, y


def _bodies(crowd: Crowd) -> tuple[Floats, Floats]:
    """Radii (n,) m and masses (n,) kg."""
    try:
        return crowd.varied.bodies(crowd.radius, crowd.mass, crowd.people)
    except ValueError as error:
        raise SceneError(f"people: {error}") from None


def _cover(radius: Floats, floor: shapely.Geometry) -> float:
    """Share of a floor that disks cover."""
    return float(np.pi * (radius**2).sum() / floor.area)


def _places(floor: shapely.Polygon, door: Door, radius: Floats, seed: int) -> Floats:
    """Random places (n,2) m nearest to the door, of which the disks cover COVER. Disks that are
    somewhat smaller are put one after the other where they overlap none, until all are there."""
    cover, inside = _cover(radius, floor), floor.buffer(-float(radius.max()))
    if cover > MOST_COVER or inside.is_empty:
        raise SceneError(
            f"people: {len(radius)} of mean radius {radius.mean():.3g} m would cover {cover:.0%} of "
            f"the floor; at most {MOST_COVER:.0%} can be placed"
        )
    area = _before(inside, door, cover / COVER * floor.area)
    random = np.random.default_rng([seed, 5])
    place = np.empty((len(radius), 2))
    share = np.sqrt(PUT_COVER / max(COVER, _cover(radius, area)))
    shapely.prepare(area)
    for person, own in enumerate(radius):
        apart_from = share * (radius[:person] + own)
        for _ in range(TRIES):
            place[person] = random.uniform(area.bounds[:2], area.bounds[2:])
            near = np.hypot(*(place[:person] - place[person]).T) < apart_from
            if not near.any() and shapely.contains_xy(area, *place[person]):
                break
        else:
            raise SceneError(f"people: no place is left for person {person + 1} of {len(radius)}")
    return place


def _before(floor: shapely.Geometry, door: Door, size: float) -> shapely.Geometry:
    """The part of a floor of so many m² that is nearest to the door, or all of it."""
    line = shapely.LineString(door)
    least, most = 0.0, float(shapely.hausdorff_distance(line, floor)) + line.length
    for _ in range(HALVINGS):
        middle = 0.5 * (least + most)
        smaller = floor.intersection(line.buffer(middle)).area < size
        least, most = (middle, most) if smaller else (least, middle)
    return floor.intersection(line.buffer(most))


def _hidden(position: Floats, floor: shapely.Polygon, door: Door) -> int:
    """How many people at (n,2) m would leave the floor on their straight way to the door."""
    ways = shapely.shortest_line(shapely.points(position), shapely.LineString(door))
    return int((~shapely.covers(floor.buffer(ON_WALL_M), ways)).sum())


def _drive(crowd: Crowd, mass: float, door: Door, outward: Floats) -> Drive:
    """The drive that gives the push, with the speed or the usual relaxation time."""
    given: dict[str, Any] = {"push_N": crowd.push}
    if crowd.speed is not None:
        given["speed_m_per_s"] = crowd.speed
    ends = {"door_start_m": door[0], "door_end_m": door[1], "outward": _point(outward)}
    try:
        means = {"means": lambda: (crowd.radius, mass)}
        return Drive.model_validate(given | ends, context=means)
    except ValidationError as error:
        raise SceneError(f"drive: {first_problem(error)}") from None
