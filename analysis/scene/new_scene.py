"""A scene of one's own: a room, its doors, and a crowd before them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely
from pydantic import ValidationError

from analysis.scene.anthropometry import Varied, separated
from analysis.scene.drive import Goal
from analysis.scene.floor_files import walled
from analysis.scene.law import LAWS
from analysis.scene.named_crowds import CROWDS, keys_of
from analysis.scene.plan_roles import polygon_of
from analysis.scene.scene import Drive, Scene, SceneError, first_problem
from analysis.scene.schema import Analysis, ContactModel, Room, Run
from analysis.scene.waiting import (
    MOST_COVER,
    ON_WALL_M,
    Doorway,
    Ends,
    counts_of,
    cover_of,
    positions_of,
)
from nscd import Snapshot, Walls
from nscd.arrays import Floats, Indices
from nscd.segments import lengths
from nscd.stepping import StepError

# More people than these take minutes; more of the others is no crowd.
MOST_PEOPLE, MOST_PUSH_N, MOST_S = 5000, 1e5, 1e5
# m, kg: nobody is larger.
MOST_RADIUS_M, MOST_MASS_KG = 1.0, 1000.0
RESTITUTION = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Crowd:
    """Describe a crowd that waits before doors.

    people: how many
    radius, mass: m and kg, the means, where `varied` does not bring its own
    varied: how people differ, and the seed of all that is random
    push: N, of a person of mean mass who is held
    speed, relaxation: m/s, desired, and s, τ. Without a speed it is push τ/m̄, without τ that is
        0.5 s, or m̄ speed/push. With both they give the push.
    law, friction: of the contacts, as in a scene
    does: waiting, pressing or pushing (`CROWDS`); who waits or presses has a speed, a τ and a share
        of push of that name, in place of the push"""

    people: int
    radius: float = 0.2
    mass: float = 75.0
    varied: Varied = field(default_factory=lambda: Varied(radius_share=0.1))
    push: float = 150.0
    speed: float | None = None
    relaxation: float | None = None
    law: str = "hooke"
    friction: float = 0.0
    does: str = "pushing"


@dataclass(frozen=True, slots=True, kw_only=True)
class Inside:
    """Describe what stands on a floor.

    blocks: x, y of two opposite corners each (m): rectangles where nobody can be, such as a pillar
        or a thick wall
    barriers: both ends of each (m): straight walls without thickness, with people on both sides"""

    blocks: Sequence[tuple[float, float, float, float]] = ()
    barriers: Sequence[Ends] = ()

    def cut(self, floor: Any) -> Any:
        """Take the blocks out of a floor. Raises SceneError for one without an area."""
        holes = []
        for x0, y0, x1, y1 in self.blocks:
            if not (x0 != x1 and y0 != y1):
                raise SceneError(
                    f"block: {x0:g},{y0:g},{x1:g},{y1:g}. Two opposite corners are needed"
                )
            holes.append(shapely.box(min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)))
        return floor.difference(shapely.union_all(holes)) if holes else floor


def room(
    name: str,
    length: float,
    width: float,
    door: float | Sequence[Doorway],
    crowd: Crowd,
    duration: float = 10.0,
    inside: Inside | None = None,
) -> Scene:
    """Make a scene of a rectangular room −length < x < 0, `length` by `width` (m), y from −width/2
    to width/2.

    door: width (m) of one in the middle of the side x = 0, or doors (`opposing` gives those of two
        streams)
    inside: blocks and barriers

    Raises SceneError as `from_geometry` does.

    >>> small = room("small", 4.0, 3.0, 0.8, Crowd(people=20))
    >>> len(small.snapshot), [wall.name for wall in small.walls]
    (20, ['wall_1', 'wall_2', 'wall_3', 'wall_4', 'wall_5'])
    """
    if not (length > 0 and width > 0):
        raise SceneError(f"room: {length:g} m by {width:g} m. Positive lengths are needed")
    if isinstance(door, int | float):
        if not 0 < door <= width:
            raise SceneError(f"door: {door:g} m. It needs 0 to the side of {width:g} m")
        door = [Doorway(ends=((0.0, -0.5 * door), (0.0, 0.5 * door)))]
    box = shapely.box(-length, -0.5 * width, 0.0, 0.5 * width)
    return from_geometry(name, box, door, crowd, duration, inside)


def from_geometry(
    name: str,
    area: Any,
    doors: Ends | Sequence[Doorway],
    crowd: Crowd,
    duration: float = 10.0,
    inside: Inside | None = None,
) -> Scene:
    """Make a scene of the floor that people can stand on.

    area: a shapely polygon, or what has one as `polygon` (PedPy's WalkableArea); holes are pillars
    doors: the ends of one, m, on one side of the outline; or several, each with its share of the
        crowd
    duration: s, to simulate
    inside: blocks and barriers

    People wait near the door that they go to, where no wall is between as far as there is room, at
    random (`crowd.varied.seed`) and pushed apart until none overlap. Ids go door by door.

    Raises SceneError for a door that is not on the outline or that nobody goes to, for a crowd that
    does not fit, and for lengths that are not positive."""
    for what, number, maximum in (
        ("people", crowd.people, MOST_PEOPLE),
        ("push", crowd.push, MOST_PUSH_N),
        ("radius", crowd.radius, MOST_RADIUS_M),
        ("mass", crowd.mass, MOST_MASS_KG),
        ("duration", duration, MOST_S),
    ):
        if not 0 < number <= maximum:
            raise SceneError(f"{what}: {number:g}. Above 0 and at most {maximum:g} is needed")
    if crowd.does not in CROWDS:
        raise SceneError(f"crowd: unknown {crowd.does!r}. There are: {', '.join(CROWDS)}")
    inside = inside or Inside()
    floor = shapely.geometry.polygon.orient(polygon_of(inside.cut(polygon_of(area))))
    ways = [way if isinstance(way, Doorway) else Doorway(ends=way) for way in _several(doors)]
    barriers = list(inside.barriers)
    walls, outward, ways = walled(floor, ways, barriers)
    snapshot, going = _crowd(crowd, floor, ways, barriers)
    shut = np.array([*((wall.start_m, wall.end_m) for wall in walls), *(way.ends for way in ways)])
    try:
        snapshot = separated(snapshot, Walls(start=shut[:, 0], end=shut[:, 1]))
    except StepError as error:
        raise SceneError(f"people: {error}") from None
    widths = " and ".join(f"{lengths(np.subtract(*way.ends)):.3g} m" for way in ways)
    contact = {"law": crowd.law, "friction": crowd.friction, "restitution": RESTITUTION}
    if crowd.law not in LAWS or not LAWS[crowd.law].own_stiffness:
        contact["stiffness_N_per_m"] = 1e6
    before = f"a door of {widths}" if len(ways) == 1 else f"doors of {widths}"
    try:
        stated = Room(
            title=f"{crowd.people} people before {before}",
            source="percussions new",
            walls=walls,
            drive=_drive(crowd, float(snapshot.mass.mean()), ways, outward, going),
            contact=ContactModel.model_validate(contact),
            run=Run(duration_s=duration, frames=max(1, round(10 * duration))),
            analysis=Analysis(kind="driven", time_s=duration),
        )
    except ValidationError as error:
        raise SceneError(first_problem(error)) from None
    notes = _notes(crowd, snapshot, floor, ways, going)
    scene = Scene.of(stated, name=name, notes=notes, snapshot=snapshot).round_walls()
    scene.check(name)
    return scene


def _several(doors: Any) -> list[Any]:
    """One pair of ends, or several doors, as a list."""
    try:
        return [doors] if np.shape(np.asarray(doors, dtype=float)) == (2, 2) else list(doors)
    except (TypeError, ValueError):
        return list(doors)


def _crowd(
    crowd: Crowd, floor: shapely.Polygon, ways: Sequence[Doorway], barriers: Sequence[Ends]
) -> tuple[Snapshot, Indices]:
    """The disks where they wait, in the order of their doors, and the door (n,) of each."""
    try:
        radius, mass = crowd.varied.bodies(crowd.radius, crowd.mass, crowd.people)
    except ValueError as error:
        raise SceneError(f"people: {error}") from None
    if (cover := cover_of(radius, floor)) > MOST_COVER or floor.buffer(-radius.max()).is_empty:
        raise SceneError(
            f"people: {len(radius)} of mean radius {radius.mean():.3g} m would cover {cover:.0%} of "
            f"the floor. At most {MOST_COVER:.0%} can be placed"
        )
    if barriers and not floor.buffer(ON_WALL_M).covers(shapely.MultiLineString(list(barriers))):
        raise SceneError("barrier: a part of it is not on the floor")
    counts = counts_of(ways, crowd.people)
    position = positions_of(floor, barriers, ways, counts, radius, crowd.varied.seed)
    snapshot = Snapshot(position=position, radius=radius, mass=mass)
    return snapshot, np.repeat(np.arange(len(ways)), counts)


def _stood_on(snapshot: Snapshot, floor: shapely.Polygon) -> float:
    """The area (m²) of the floor within the outline of the crowd."""
    outline = shapely.MultiPoint(snapshot.position).convex_hull
    return float(outline.buffer(float(snapshot.radius.mean())).intersection(floor).area)


def _notes(
    crowd: Crowd,
    snapshot: Snapshot,
    floor: shapely.Polygon,
    ways: Sequence[Doorway],
    going: Indices,
) -> str:
    radius, mass = snapshot.radius, snapshot.mass
    where = "before a door" if len(ways) == 1 else f"before {len(ways)} doors"
    push = crowd.push
    if crowd.speed is not None and crowd.relaxation is not None:
        push = float(mass.mean()) * crowd.speed / crowd.relaxation
    named = CROWDS[crowd.does]
    pushing = f"{named.label} ({named.does})" if named.drive else f"push with {push:g} N"
    notes = f"""{crowd.people} people of radius {radius.mean():.3f} ± {radius.std():.3f} m and mass
{mass.mean():.1f} ± {mass.std():.1f} kg, {pushing}. They wait at random places
{where} (seed {crowd.varied.seed}). Disks cover {cover_of(radius, floor):.0%} of the floor.
Where they stand there are {len(radius) / _stood_on(snapshot, floor):.2g} people per m²."""
    if len(ways) > 1:
        counts = np.bincount(going, minlength=len(ways))
        to = [f"{count} go to door {number}" for number, count in enumerate(counts, start=1)]
        notes += f"\n{', '.join(to)}."
    return notes


def _drive(
    crowd: Crowd, mass: float, ways: Sequence[Doorway], outward: Sequence[Floats], going: Indices
) -> Drive:
    """The drive that gives the push, with the speed or the usual relaxation time: to the first door,
    and to the others those who go there."""
    requested = {"speed_m_per_s": crowd.speed, "relaxation_time_s": crowd.relaxation}
    arguments: dict[str, Any] = keys_of(crowd.does)
    arguments |= {key: value for key, value in requested.items() if value is not None}
    if not {"speed_m_per_s", "relaxation_time_s"} <= arguments.keys():
        arguments["push_N"] = crowd.push
    first, *others = (
        {
            "door_start_m": way.ends[0],
            "door_end_m": way.ends[1],
            "outward": tuple(out.round(9) + 0.0),
        }
        for way, out in zip(ways, outward, strict=True)
    )
    goals = []
    for number, ends in enumerate(others, start=1):
        ids = np.flatnonzero(going == number) + 1
        goals.append(Goal(people=(int(ids[0]), int(ids[-1])), **ends))
    try:
        means = {"means": lambda: (crowd.radius, mass)}
        return Drive.model_validate(arguments | first | {"goals": goals}, context=means)
    except ValidationError as error:
        raise SceneError(f"drive: {first_problem(error)}") from None
