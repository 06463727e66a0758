"""What a scene file holds besides its disks: walls, drive, contact law, run, analysis, and what was
done to the heads of a real crowd."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    PrivateAttr,
    Strict,
    TypeAdapter,
    ValidationInfo,
    WithJsonSchema,
    field_validator,
    model_validator,
)

from analysis.scene.law import AS_HERTZ, LAWS, NOMINAL, Elastic, Law, hertz_stiffness
from analysis.scene.way import Way, way_of
from nscd import Snapshot, Walls, _core
from nscd.arrays import Flags, Floats, Indices
from nscd.stepping import Arms

# Engines do not read numbers whose squares or quotients underflow.
SMALLEST = 1e-100


# strict: neither `true` nor "1.0" is a number
Number = Annotated[float, Strict(), Field(allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0)]
Count = Annotated[int, Strict(), Field(ge=1)]
# beyond this, distances leave double precision
Length = Annotated[Number, Field(ge=-1e30, le=1e30)]
Point = tuple[Length, Length]


def _rising(ends: Point) -> Point:
    if not ends[0] < ends[1]:
        raise ValueError(f"from {ends[0]:g} to {ends[1]:g} m. The first must be less")
    return ends


Period = Annotated[Point, AfterValidator(_rising)]


def _file_name(name: str) -> str:
    if not re.fullmatch(r"[^./\\\x00-\x1f][^/\\\x00-\x1f]{0,99}", name):
        raise ValueError(f"{name!r} is not the name of a file in one folder")
    return name


# It becomes a part of paths, and must not lead out of their folder.
FileName = Annotated[str, AfterValidator(_file_name)]
# Mean radius (m) and mean mass (kg) of the disks of a file.
Means = tuple[float, float]


def means_of(info: ValidationInfo) -> Means | None:
    """The means of the disks of the file that is read, where there are any."""
    ask: Callable[[], Means | None] = (info.context or {}).get("means", lambda: None)
    return ask()


class Schema(BaseModel):
    """A table of a scene file: no key that is not known, numbers that are numbers."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @field_validator("*")
    @classmethod
    def _underflows_nowhere(cls, value: Any) -> Any:
        for part in value if isinstance(value, tuple) else (value,):
            if isinstance(part, float) and 0 < abs(part) < SMALLEST:
                raise ValueError(f"{part:g} is nearer to 0 than {SMALLEST:g}. Write 0")
        return value


# The keys that may stand for the stiffness of hertz.
YOUNG, POISSON = "young_modulus_Pa", "poisson_ratio"


def _known_law(name: str) -> str:
    if name not in LAWS:
        *most, last = map(repr, LAWS)
        raise ValueError(f"Input should be {', '.join(most)} or {last}")
    return name


LawName = Annotated[str, AfterValidator(_known_law), WithJsonSchema({"enum": list(LAWS)})]


class ContactModel(Schema):
    """Repel by k·overlap (hooke), K·overlap^1.5 (hertz) or as chests do (body, body_hertz), with a
    dashpot for the asked restitution and Coulomb friction.

    stiffness_N_per_m: N/m, k; of hertz the tangent stiffness at an overlap of 1 % of the mean
        radius; a file may give young_modulus_Pa and poisson_ratio instead
    wall_stiffness_N_per_m: N/m, the same of walls; that of the disks where left out
    restitution: 0 to 1, of two bodies
    friction: coefficient; 0 is none
    tangential_ratio: stiffness of the tangential spring over k
    arm_reach_m: m, the gap between two people, or a person and a wall, from which arms push
    arm_force_N: N, with which they push where bodies touch"""

    law: LawName = "hooke"
    stiffness_N_per_m: Positive  # noqa: N815  (the unit is newton)
    wall_stiffness_N_per_m: Positive | None = None  # noqa: N815
    restitution: Annotated[Number, Field(ge=0, le=1)]
    friction: Annotated[Number, Field(ge=0, le=10)] = 0.0
    tangential_ratio: Annotated[Number, Field(gt=0, le=1)] = 2 / 7
    arm_reach_m: Annotated[Number, Field(gt=0, le=1)] | None = None
    arm_force_N: Positive | None = None  # noqa: N815

    @model_validator(mode="after")
    def _both_or_none(self) -> ContactModel:
        if (self.arm_reach_m is None) != (self.arm_force_N is None):
            missing = "arm_reach_m" if self.arm_reach_m is None else "arm_force_N"
            raise ValueError(f"{missing}: arms need both arm_reach_m and arm_force_N")
        return self

    @property
    def arms(self) -> Arms | None:
        """Give the outer layer, where there is one."""
        if self.arm_reach_m is None or self.arm_force_N is None:
            return None
        return Arms(self.arm_reach_m, self.arm_force_N)

    @property
    def kind(self) -> Law:
        """Give the law itself."""
        return LAWS[self.law]

    @property
    def at_walls(self) -> float:
        """Give the stiffness of walls (N/m)."""
        if self.kind.own_stiffness:
            return NOMINAL[1]
        return self.wall_stiffness_N_per_m or self.stiffness_N_per_m

    def elastic(self, mean_radius: float) -> Elastic:
        """Give the springs of pairs and of walls, for disks of mean radius (m)."""
        return self.kind.springs(self.stiffness_N_per_m, self.at_walls, mean_radius)

    def stiffest(self, mean_radius: float) -> float:
        """Compute the stiffness (N/m) that time steps follow: the larger of disks and walls; of
        bodies the tangent at a wall at a depth of the mean radius (m); and of arms."""
        arms = self.arms.stiffness if self.arms else 0.0
        if self.kind.own_stiffness:
            return max(arms, self.elastic(mean_radius).wall.tangent(mean_radius, mean_radius))
        return max(arms, self.at_walls, self.stiffness_N_per_m)

    @model_validator(mode="before")
    @classmethod
    def _of_bodies(cls, given: Any) -> Any:
        """Refuse friction that a law has not; put the stiffness of a body where the law has it."""
        law = LAWS.get(str(given.get("law"))) if isinstance(given, dict) else None
        if law is not None and not law.friction and given.get("friction"):
            raise ValueError(f"friction: law = {given['law']} has none. Take law = {AS_HERTZ}")
        if law is None or not law.own_stiffness:
            return given
        for key in ("stiffness_N_per_m", "wall_stiffness_N_per_m"):
            if given.get(key) not in (None, NOMINAL[0]):
                raise ValueError(f"{key}: law = {given['law']} has a stiffness of its own")
        return given | {"stiffness_N_per_m": NOMINAL[0], "wall_stiffness_N_per_m": None}

    @model_validator(mode="before")
    @classmethod
    def _of_material(cls, given: Any, info: ValidationInfo) -> Any:
        """Put the stiffness in the place of Young's modulus and Poisson's ratio."""
        if not isinstance(given, dict) or not {YOUNG, POISSON} & given.keys():
            return given
        rest = {key: value for key, value in given.items() if key not in (YOUNG, POISSON)}
        if "stiffness_N_per_m" in rest or rest.get("law") != "hertz":
            raise ValueError(f"{YOUNG}: only for law = hertz, and instead of stiffness_N_per_m")
        material = Material.model_validate({key: given.get(key) for key in (YOUNG, POISSON)})
        means = means_of(info)
        if means is None:
            raise ValueError(f"{YOUNG}: only where the radius of the disks is known")
        radius, _ = means
        stiffness = hertz_stiffness(material.young_modulus_Pa, material.poisson_ratio, radius)
        return rest | {"stiffness_N_per_m": stiffness}


class Material(Schema):
    """What bodies are made of.

    young_modulus_Pa: Pa, E
    poisson_ratio: ν"""

    young_modulus_Pa: Positive  # noqa: N815  (the unit is pascal)
    poisson_ratio: Annotated[Number, Field(gt=-1, le=0.5)]


Extent = Annotated[Number, Field(ge=0)]
Counted = Annotated[int, Strict(), Field(ge=0)]

# What two keys say in the words of a table.
DECILE = ("decile", "that a tenth of people exceed")
SHARE = ("moved share over 1 cm", "share of people moved by more than 1 cm")


class Reconciliation(Schema):
    """Record how heads became disks that do not overlap: where they come from, what was there and
    how far people were moved. A length is in m, a density in 1/m², as its name says.

    Overlaps are those of pairs of disks; densities are local ones (one over the area of each
    person's Voronoi cell within the room and within 0.8 m of the person): the mean over people, and
    what a tenth of the people exceed (the largest is an artefact of cells that the door cuts); none
    where the cells could not be computed."""

    file: str
    frame: Annotated[int, Strict()]
    people: Counted
    left_out: Counted
    radius_m: Positive
    radius_sd_m: Positive | None = None
    velocity_window_s: Positive
    overlaps_before: Counted
    wall_overlaps_before: Counted
    overlap_before_largest_m: Extent
    overlap_before_mean_m: Extent
    overlap_before_sum_m: Extent
    overlap_after_m: Extent
    moved_mean_m: Extent
    moved_rms_m: Extent
    moved_largest_m: Extent
    moved_share_over_1_cm: Annotated[Number, Field(ge=0, le=1)]
    moved_mean_x_m: Number
    moved_mean_y_m: Number
    density_before_mean_per_m2: Extent | None = None
    density_before_decile_per_m2: Extent | None = None
    density_after_mean_per_m2: Extent | None = None
    density_after_decile_per_m2: Extent | None = None
    contacts_after: Counted
    wall_contacts_after: Counted
    linearisations: Counted

    @property
    def statement(self) -> str:
        """What this scene is and is not, one paragraph in words."""
        overlap, mean = 100 * self.overlap_before_largest_m, 100 * self.overlap_before_mean_m
        moved, most = 100 * self.moved_mean_m, 100 * self.moved_largest_m
        share = 100 * self.moved_share_over_1_cm
        heads = self.people + self.left_out
        spread = f" (standard deviation {self.radius_sd_m:.3g} m)" if self.radius_sd_m else ""
        before, after = self.density_before_decile_per_m2, self.density_after_decile_per_m2
        density = "The local densities are missing: their Voronoi cells could not be computed. "
        if before is not None and after is not None:
            density = (
                "The local density that a tenth of the people exceed went from "
                f"{before:.1f} to {after:.1f} people per m². "
            )
        return (
            f"Heads are not bodies. {self.file}, frame {self.frame}, has the heads of {heads} "
            f"people. {self.left_out} outside the walls were left out. The other {self.people} became "
            f"disks of radius {self.radius_m:.4g} m{spread} round the heads. These overlapped each other "
            f"{self.overlaps_before} times, by up to {overlap:.1f} cm (mean {mean:.1f} cm), and walls "
            f"{self.wall_overlaps_before} times. They were moved until none overlap, together as "
            "little as possible (least sum of squares, a local "
            f"minimum). They moved by {moved:.1f} cm in the mean and {most:.1f} cm at most, "
            f"{share:.0f} % of the people by more than 1 cm. {density}Contacts afterwards: "
            f"{self.contacts_after} between people, {self.wall_contacts_after} with walls. Who "
            "touches whom is an outcome of the stated radius and of this rule, not an "
            "observation, and so are the forces computed from it."
        )

    def rows(self) -> list[tuple[str, float | int | str]]:
        """List name with unit and value, in the order of the fields, for a table."""
        units = {"_per_m2": " (1/m²)", "_m": " (m)", "_s": " (s)"}
        rows: list[tuple[str, float | int | str]] = []
        for key, value in self.model_dump(exclude_none=True).items():
            unit = next((end for end in units if key.endswith(end)), "")
            words = key.removesuffix(unit).replace("_", " ").replace(*DECILE).replace(*SHARE)
            rows.append((words + units.get(unit, ""), value))
        return rows


class OtherFrames(Schema):
    """Name frames of the same film, near in time, that became crowds in the same way.

    frames: their numbers in the file
    after_s: s after the scene's own frame, negative before it
    data: names of their data files, in the folder of the scene
    refused: numbers of frames that could not be made crowds"""

    frames: tuple[Annotated[int, Strict()], ...]
    after_s: tuple[Number, ...]
    data: tuple[FileName, ...]
    refused: tuple[Annotated[int, Strict()], ...] = ()

    @model_validator(mode="after")
    def _one_of_each(self) -> OtherFrames:
        if not len(self.frames) == len(self.after_s) == len(self.data):
            raise ValueError("frames, after_s and data need one entry per frame")
        return self

    @staticmethod
    def files(scene: str, frames: Sequence[int]) -> tuple[str, ...]:
        """Name the data files of the frames of a scene."""
        return tuple(f"{scene}_{number}.data" for number in frames)

    @property
    def statement(self) -> str:
        """Say which frames there are, in one line."""
        found = [
            f"{number} ({time:+.3g} s)"
            for number, time in sorted(zip(self.frames, self.after_s, strict=True))
        ]
        words = f"Other frames of the film: {', '.join(found) or 'none'}."
        if self.refused:
            left = ", ".join(str(number) for number in sorted(self.refused))
            words += f" Of frames that were tried, these could not be made crowds: {left}."
        return words.replace("-", "−")

    def rows(self) -> list[tuple[str, float | int | str]]:
        """List the frames for a table."""
        rows: list[tuple[str, float | int | str]] = []
        for words, numbers in (("became", self.frames), ("could not become", self.refused)):
            if numbers:
                frames = ", ".join(str(number) for number in sorted(numbers))
                rows.append((f"other frames that {words} crowds", frames))
        return rows

    def of(self, scene: str) -> OtherFrames:
        """Name the data files after another scene."""
        return self.model_copy(update={"data": self.files(scene, self.frames)})


# The key that may stand for desired speed or relaxation time, and the latter where only it is
# given: pushed people lose their speed in 0.1 to 1 s.
PUSH, USUAL_RELAXATION_S = "push_N", 0.5
Mass = TypeVar("Mass", float, Floats)
# m: nobody comes beyond a line here.
NOWHERE = (1e30, 1e30)


class Wall(Schema):
    """Name a straight wall, which stands, or gives along its normal n as a mass on a spring with a
    damper: m s'' + c s' + k s = F·n with the force F of all contacts on it.

    name: a word of letters, digits and underscores
    start_m, end_m: m
    mass_kg: kg, m of a wall that gives
    stiffness_N_per_m, damping_N_s_per_m: N/m and N·s/m, k and c; 0 where left out"""

    name: Annotated[str, Field(pattern=r"^[A-Za-z]\w{0,99}$")]
    start_m: Point
    end_m: Point
    mass_kg: Positive | None = None
    stiffness_N_per_m: Annotated[Number, Field(ge=0)] | None = None  # noqa: N815
    damping_N_s_per_m: Annotated[Number, Field(ge=0)] | None = None  # noqa: N815

    @property
    def oscillator(self) -> tuple[float, float, float] | None:
        """Give m, k and c of a wall that gives; None of one that stands."""
        if self.mass_kg is None:
            return None
        return self.mass_kg, self.stiffness_N_per_m or 0.0, self.damping_N_s_per_m or 0.0

    @property
    def normal(self) -> Point:
        """Give the unit vector along which a wall gives: to the left on the way from start to end."""
        along = self.end_m[0] - self.start_m[0], self.end_m[1] - self.start_m[1]
        length = math.hypot(*along)
        return -along[1] / length, along[0] / length

    @model_validator(mode="after")
    def _has_mass(self) -> Wall:
        for key in ("stiffness_N_per_m", "damping_N_s_per_m"):
            if getattr(self, key) is not None and self.mass_kg is None:
                raise ValueError(f"{key}: a wall that gives needs a mass: give mass_kg")
        return self


# m: a door so far ahead that everybody walks along `outward` and nobody arrives.
AHEAD = 1e29


def _ahead(given: Any) -> Any:
    """Put a door far ahead where none is given."""
    if not isinstance(given, dict) or {"door_start_m", "door_end_m"} & given.keys():
        return given
    try:
        x, y = map(float, given["outward"])
    except (KeyError, TypeError, ValueError):
        return given
    start, end = ((x - 0.5 * s * y, y + 0.5 * s * x) for s in (1, -1))
    doors = {"door_start_m": start, "door_end_m": end}
    return given | {key: (AHEAD * x, AHEAD * y) for key, (x, y) in doors.items()}


class Exit:
    """Say where somebody wants to go: what a drive and its goals have in common."""

    if TYPE_CHECKING:  # the fields of both, each in the order of its own file
        door_start_m: Point
        door_end_m: Point
        outward: Point

    def _check_door(self) -> None:
        if abs(np.hypot(*self.outward) - 1) > 1e-9:
            raise ValueError("outward must be a unit vector")
        if self.door_start_m == self.door_end_m:
            raise ValueError("door_start_m and door_end_m are the same point")

    @property
    def has_door(self) -> bool:
        """Whether there is a door to walk to."""
        return bool(np.abs(self.door).max() < 0.1 * AHEAD)

    @property
    def door(self) -> tuple[Point, Point]:
        """The ends of the door, m."""
        return self.door_start_m, self.door_end_m

    def beyond(self, position: Floats) -> Flags:
        """Who (n,) at (n,2) m has passed the line of the door."""
        passed: Flags = (position - np.array(self.door_start_m)) @ np.array(self.outward) >= 0
        return passed


class Goal(Schema, Exit):
    """Send some people to a door of their own.

    people: ids, the first and the last
    door_start_m, door_end_m: m; left out, they walk along `outward`
    outward: unit vector out of the room"""

    people: tuple[Count, Count]
    door_start_m: Point
    door_end_m: Point
    outward: Point

    @model_validator(mode="before")
    @classmethod
    def _of_direction(cls, given: Any) -> Any:
        return _ahead(given)

    @model_validator(mode="after")
    def _in_order(self) -> Goal:
        self._check_door()
        if self.people[0] > self.people[1]:
            raise ValueError(f"people: {self.people[0]} to {self.people[1]}. The first comes first")
        return self

    def of(self, ids: Indices) -> Flags:
        """Who (n,) of these ids (n,) goes there."""
        return (ids >= self.people[0]) & (ids <= self.people[1])


# s: a stop as late as this before an instant counts as there, since instants are rounded.
INSTANT = 1e-9


class Stop(Schema):
    """Let some people want to go nowhere from a time on: they push no more, and the floor damps
    them with −m u/τ. An assumption about who faints, no medicine.

    people: ids, the first and the last
    time_s: s"""

    people: tuple[Count, Count]
    time_s: Positive

    @field_validator("people")
    @classmethod
    def _in_order(cls, people: tuple[int, int]) -> tuple[int, int]:
        if people[0] > people[1]:
            raise ValueError(f"{people[0]} to {people[1]}. The first comes first")
        return people


class Drive(Schema, Exit):
    """Drive people with m(u_d − u)/τ: u_d points to the nearest point of the door (or to its
    centre), and along `outward` for those who have passed the line of the door.

    speed_m_per_s: m/s, |u_d|
    relaxation_time_s: s, τ
    door_start_m, door_end_m: m; left out, people walk along `outward` and arrive nowhere
    outward: unit vector out of the room
    aim: nearest or centre
    goals: doors of those who go to another one
    stops: who wants to go nowhere from a time on
    clearance_m: m, kept from corners of walls on the way; who has a wall before the door then walks
        the shortest way that is wide enough, where left out straight at that wall"""

    speed_m_per_s: Positive
    relaxation_time_s: Positive
    door_start_m: Point
    door_end_m: Point
    outward: Point
    aim: Literal["nearest", "centre"] = "nearest"
    goals: tuple[Goal, ...] = ()
    stops: tuple[Stop, ...] = ()
    clearance_m: Annotated[Number, Field(ge=0)] | None = None
    _way: Way | None = PrivateAttr(None)

    def push(self, mass: Mass) -> Mass:
        """Give m U/τ (N): with how much people of this mass (kg) push who are held."""
        return mass * self.speed_m_per_s / self.relaxation_time_s

    @model_validator(mode="before")
    @classmethod
    def _of_direction(cls, given: Any) -> Any:
        return _ahead(given)

    @model_validator(mode="before")
    @classmethod
    def _of_push(cls, given: Any, info: ValidationInfo) -> Any:
        """Put speed and relaxation time in the place of the push of a person of mean mass,
        m̄ U/τ."""
        if not isinstance(given, dict) or PUSH not in given:
            return given
        rest = {key: value for key, value in given.items() if key != PUSH}
        push = Push.model_validate({PUSH: given[PUSH]}).push_N
        means = means_of(info)
        if means is None:
            raise ValueError(f"{PUSH}: only where the mass of the disks is known")
        if {"speed_m_per_s", "relaxation_time_s"} <= rest.keys():
            raise ValueError(f"{PUSH}: instead of speed_m_per_s, relaxation_time_s, or both")
        _, mass = means
        if "speed_m_per_s" in rest:
            speed = TypeAdapter(Positive).validate_python(rest["speed_m_per_s"])
            return rest | {"relaxation_time_s": mass * speed / push}
        time = TypeAdapter(Positive).validate_python(
            rest.get("relaxation_time_s", USUAL_RELAXATION_S)
        )
        return rest | {"relaxation_time_s": time, "speed_m_per_s": push * time / mass}

    @model_validator(mode="after")
    def _one_goal_each(self) -> Drive:
        self._check_door()
        if self.clearance_m is not None and not all(one.has_door for one in self.doors):
            raise ValueError("clearance_m: a way leads to a door. Give door_start_m and door_end_m")
        if self.clearance_m is not None and len(self.gates) < len(self.doors):
            raise ValueError("clearance_m: only where there are doors to walk to")
        for name, parts in (("goals", self.goals), ("stops", self.stops)):
            ranges = sorted(part.people for part in parts)
            for (_, last), (first, _) in pairwise(ranges):
                if first <= last:
                    raise ValueError(f"{name}: person {first} has two")
        return self

    @property
    def doors(self) -> tuple[Exit, ...]:
        """All doors, the drive's own first; those far ahead too."""
        return (self, *self.goals)

    @property
    def gates(self) -> list[tuple[Point, Point]]:
        """The ends (m) of the doors that there are, the drive's own first."""
        return [exit_.door for exit_ in self.doors if exit_.has_door]

    @property
    def ways(self) -> int:
        """Count the different doors to which people go."""
        return len({exit.door for exit in self.doors})

    def target(self, exit_: Exit | None = None) -> tuple[Point, Point]:
        """Give the segment whose nearest point people walk to (m): the door, or its centre twice;
        of the drive's own door, or of a goal."""
        start, end = (self if exit_ is None else exit_).door
        if self.aim == "nearest":
            return start, end
        centre = (0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1]))
        return centre, centre

    def exits(self, ids: Indices) -> list[tuple[Exit, Flags]]:
        """Give each door and who (n,) of people with these ids (n,) goes to it: those whom no goal
        names to the drive's own."""
        goals: list[tuple[Exit, Flags]] = [(goal, goal.of(ids)) for goal in self.goals]
        others = ~np.any([mine for _, mine in goals], axis=0) if goals else np.ones(len(ids), bool)
        return [(self, others), *goals]

    @property
    def needs_way(self) -> bool:
        """Whether people walk on a way that is not found yet."""
        return self.clearance_m is not None and self._way is None

    @property
    def way(self) -> Way | None:
        """The way on which people go; None where they go straight. Raises ValueError where walls
        and radii are not known yet (`routed`)."""
        if self.needs_way:
            raise ValueError("drive.clearance_m: the way needs walls and radii. Use Drive.routed")
        return self._way

    def routed(self, walls: Walls, radius: float) -> Drive:
        """Return the drive with the ways between walls for people of a radius (m), where there is a
        clearance."""
        if self.clearance_m is None:
            return self
        doors = np.array([(*exit_.door, exit_.outward) for exit_ in self.doors], dtype=float)
        routed = self.model_copy()
        routed._way = way_of(walls, doors, radius, self.clearance_m)
        return routed

    def straight(self) -> Drive:
        """Return the drive of people who walk straight to their door."""
        straight = self.model_copy(update={"clearance_m": None})
        straight._way = None
        return straight

    def check_way(self, walls: Walls, people: Snapshot) -> None:
        """Raise ValueError naming the door, and somebody whose way to it is shut or narrower than
        the widest person."""
        if self.way is None:
            return
        widest = 2 * float(people.radius.max())
        for number, (exit_, mine) in enumerate(self.exits(people.ids)):
            (x0, y0), (x1, y1) = exit_.door
            door = f"the door from ({x0:g}, {y0:g}) to ({x1:g}, {y1:g}) m"
            if np.hypot(x1 - x0, y1 - y0) < widest:
                raise ValueError(f"drive: {door} is narrower than the widest person, {widest:g} m")
            shut = mine & ~exit_.beyond(people.position)
            shut &= self.way.at(people.position, number, self.way.next) < 0
            if shut.any():
                place = people.position[shut][:1]
                thin = self.routed(walls, 1e-3).way
                narrow = thin is not None and thin.at(place, number, thin.next)[0] >= 0
                why = f"is narrower than the widest person, {widest:g} m" if narrow else "is shut"
                raise ValueError(f"drive: the way of person {people.ids[shut][0]} to {door} {why}")

    def legs(self, position: Floats, ids: Indices) -> Floats:
        """Give of people at (n,2) m with ids (n,) the segment that they walk to (start, end), and a
        point of the line behind which they walk outward with its unit vector: (4,n,2)."""
        legs = np.empty((4, len(position), 2))
        for number, (exit_, mine) in enumerate(self.exits(ids)):
            legs[:, mine] = np.array(
                [*self.target(exit_), exit_.door_start_m, exit_.outward], dtype=float
            )[:, None]
            if self.way:
                turning, corner = self.way.corner(position, number)
                legs[:2, mine & turning] = corner[mine & turning]
                legs[2:, mine & turning] = np.array([NOWHERE, (1.0, 0.0)])[:, None]
        return legs

    def desired_velocity(
        self, position: Floats, ids: Indices | None = None, time: Floats | float = 0.0
    ) -> Floats:
        """Compute u_d of disks at position (n,2) m with ids (n,) at a time (s; (n,) or one), in m/s,
        shape (n,2); ids are needed where there are goals or stops."""
        place = np.array(position, dtype=np.float64, order="C")
        if ids is None and (self.goals or self.stops):
            raise ValueError("goals, stops: the ids of people say who goes where")
        who = np.arange(len(place)) if ids is None else ids
        velocity = self._walked(place, who)
        velocity[self.stopped(who, time)] = 0.0
        return velocity

    def stopped(self, ids: Indices, time: Floats | float) -> Flags:
        """Tell who (n,) of people with these ids (n,) wants to go nowhere at a time (s; (n,) or one).
        Raises ValueError where it is not known."""
        if self.stops and np.isnan(time).any():
            raise ValueError("drive.stops: the time of the frame is not known")
        there = np.zeros(len(ids), dtype=bool)
        for stop in self.stops:
            mine = (ids >= stop.people[0]) & (ids <= stop.people[1])
            there |= mine & (np.asarray(time) >= stop.time_s - INSTANT)
        return there

    def _walked(self, place: Floats, who: Indices) -> Floats:
        velocity = np.zeros_like(place)
        if self.way:
            legs = self.legs(place, who)
            _core.soft_drive(velocity, place, velocity.copy(), self.speed_m_per_s, 1.0, *legs)
            return velocity
        for exit_, mine in self.exits(who):
            velocity[mine] = self._headed(place[mine], exit_)
        return velocity

    def _headed(self, place: Floats, exit_: Exit) -> Floats:
        start, end = (np.array(point, dtype=np.float64) for point in self.target(exit_))
        outward, door = np.array(exit_.outward, dtype=np.float64), np.array(exit_.door_start_m)
        return _core.headed(
            np.ascontiguousarray(place), start, end, outward, door, self.speed_m_per_s
        )

    def gone(self, position: Floats, ids: Indices) -> Flags:
        """Tell who (n,) at (n,2) m has passed the line of the own door."""
        passed = np.zeros(len(position), dtype=bool)
        for number, (exit_, mine) in enumerate(self.exits(ids)):
            passed |= mine & exit_.beyond(position)
            if self.way:
                passed &= ~(mine & self.way.corner(position, number)[0])
        return passed


class Push(Schema):
    """Say with how much people push.

    push_N: N, of a person of mean mass who is held; in proportion to the mass of others"""

    push_N: Positive  # noqa: N815  (the unit is newton)


# m/s², standard gravity.
GRAVITY = 9.80665


class BodyForce(Schema):
    """Accelerate everybody alike, as gravity does on a slope: by g sin(slope) downhill. What presses
    people on the ground is no force in its plane.

    acceleration_m_per_s2: (x, y) m/s²; the force on a disk is its mass times this
    slope_deg, downhill: instead of it, degrees and a unit vector"""

    acceleration_m_per_s2: Point | None = None
    slope_deg: Annotated[Number, Field(gt=0, lt=90)] | None = None
    downhill: Point | None = None

    @property
    def acceleration(self) -> Point:
        """Give (x, y) m/s²."""
        if self.acceleration_m_per_s2 is not None:
            return self.acceleration_m_per_s2
        assert self.slope_deg is not None
        assert self.downhill is not None
        along = GRAVITY * math.sin(math.radians(self.slope_deg))
        return along * self.downhill[0], along * self.downhill[1]

    @model_validator(mode="after")
    def _one_way(self) -> BodyForce:
        given = self.acceleration_m_per_s2, self.slope_deg, self.downhill
        if [one is None for one in given] not in ([False, True, True], [True, False, False]):
            raise ValueError("acceleration_m_per_s2, or slope_deg and downhill, are needed")
        if self.downhill is not None and abs(math.hypot(*self.downhill) - 1) > 1e-9:
            raise ValueError("downhill must be a unit vector")
        return self


class Run(Schema):
    """Say how long to simulate and how often to write.

    duration_s: s
    frames: how many after the first
    time_step_s: s, of LAMMPS and YADE at most; it is shortened to fit between frames. Follows from
        the stiffness where left out
    drive_interval_steps: steps between two evaluations of the drive, in LAMMPS and YADE
    rigid_step_s: s, of the rigid engine at most; it is shortened to fit between frames. Follows
        from radius and speed where left out
    rigid_tolerance: of the contact problem of a step; 1e-8 where left out
    impulses: whether LAMMPS and YADE sum the impulses of contacts between frames, which costs time;
        the rigid engine always does"""

    duration_s: Positive
    frames: Count
    time_step_s: Positive | None = None
    drive_interval_steps: Count = 10
    rigid_step_s: Positive | None = None
    rigid_tolerance: Annotated[Number, Field(ge=1e-12, le=0.1)] | None = None
    impulses: Annotated[bool, Strict()] | None = None


class Analysis(Schema):
    """Say which percussions are compared with which forces.

    kind: driven: p/τ with the force at time_s; impact: p of the initial state with ∫f dt over the
        run
    time_s: s
    contact_tolerance_m: m, gap up to which disks are in contact"""

    kind: Literal["driven", "impact"]
    time_s: Annotated[Number, Field(ge=0)] = 0.0
    contact_tolerance_m: Positive = 1e-6


class Room(Schema):
    """Hold a scene without its disks: what `percussions import` puts a crowd into.

    period_x_m: m, two places along x that are one: who leaves at the one comes in at the other"""

    title: str
    source: str
    period_x_m: Period | None = None
    walls: tuple[Wall, ...] = ()
    drive: Drive | None = None
    body_force: BodyForce | None = None
    contact: ContactModel
    run: Run
    analysis: Analysis

    def __repr__(self) -> str:
        return f"<Room: {self._shown()}>"

    def _shown(self) -> str:
        """The room in few words."""
        law = f"{self.contact.law} {self.contact.stiffness_N_per_m:g} N/m"
        return f"{len(self.walls)} walls, {self.analysis.kind}, {law}, {self.run.duration_s:g} s"

    def wall_segments(self) -> Walls:
        """Give the walls as nscd takes them, in the room's order."""
        return Walls(
            start=np.array([wall.start_m for wall in self.walls]).reshape(-1, 2),
            end=np.array([wall.end_m for wall in self.walls]).reshape(-1, 2),
            period_x=self.period_x_m,
        )

    def giving(self) -> list[Wall]:
        """List the walls that give."""
        return [wall for wall in self.walls if wall.oscillator]

    def check_period(self, snapshot: Snapshot) -> None:
        """Raise ValueError naming the field for a period that is shorter than two diameters, disks
        that are not in it, and walls that do not go on across its ends."""
        if self.period_x_m is None:
            return
        low, high = self.period_x_m
        reach = 2 * float(snapshot.radius.max())
        reach += self.contact.arms.reach if self.contact.arms else 0.0
        if not high - low > 2 * reach:
            said = "two diameters" + (" and reaches of arms" if self.contact.arms else "")
            raise ValueError(
                f"period_x_m: {high - low:g} m. More than {said}, {2 * reach:g} m, is needed"
            )
        x = snapshot.position[:, 0]
        if (out := (x < low) | (x >= high)).any():
            who = snapshot.ids[np.argmax(out)]
            raise ValueError(f"period_x_m: disk {who} is not in it, from {low:g} to {high:g} m")
        if snapshot.wide is not None:
            raise ValueError("period_x_m: only for people of one disk each, without disks.bodies")
        if self.giving():
            raise ValueError(f"period_x_m: wall {self.giving()[0].name} gives. Leave out mass_kg")
        if self.drive and self.drive.gates:
            raise ValueError(
                "period_x_m: a corridor without end has no door. Leave out door_start_m"
            )
        ends = {point for wall in self.walls for point in (wall.start_m, wall.end_m)}
        for wall in self.walls:
            (x0, y0), (x1, y1) = sorted([wall.start_m, wall.end_m])
            for at, end, other in ((x0, low, high), (x1, high, low)):
                if at == end and y0 == y1 and (other, y0) in ends:
                    continue
                if (at - end) * (other - end) < reach * (high - low):
                    raise ValueError(
                        f"period_x_m: wall {wall.name} comes within {reach:g} m of x = {end:g} m. It "
                        "must keep away, or be level there and go on at the other end"
                    )

    def acceleration(self) -> Point:
        """Give the acceleration (x, y) m/s² of the body force; 0 where there is none."""
        return self.body_force.acceleration if self.body_force else (0.0, 0.0)

    def door(self) -> Walls | None:
        """Give the doors as segments, where there is a drive."""
        if self.drive is None or not self.drive.gates:
            return None
        ends = np.array(self.drive.gates)
        return Walls(start=ends[:, 0], end=ends[:, 1])
