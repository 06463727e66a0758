"""What a scene consists of besides its disks: walls, drive, contact law, run, analysis."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import Field, Strict, TypeAdapter, ValidationInfo, model_validator

from analysis.scene.contact import ContactModel
from analysis.scene.values import Count, Number, Part, Point, Positive, means_of
from nscd import Walls, _core
from nscd.arrays import Flags, Floats, Indices

# The key that may stand for desired speed or relaxation time, and the latter where only it is
# given: pushed people lose their speed in 0.1 to 1 s.
PUSH, USUAL_RELAXATION_S = "push_N", 0.5
Mass = TypeVar("Mass", float, Floats)


class Wall(Part):
    """Name a straight wall.

    name: a word of letters, digits and underscores
    start_m, end_m: m
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z]\w{0,99}$")]
    start_m: Point
    end_m: Point


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
    def door(self) -> tuple[Point, Point]:
        """The ends of the door, m."""
        return self.door_start_m, self.door_end_m

    def beyond(self, position: Floats) -> Flags:
        """Who (n,) at (n,2) m has passed the line of the door."""
        passed: Flags = (position - np.array(self.door_start_m)) @ np.array(self.outward) >= 0
        return passed


class Goal(Part, Exit):
    """Send some people to a door of their own.

    people: ids, the first and the last
    door_start_m, door_end_m: m
    outward: unit vector out of the room
    """

    people: tuple[Count, Count]
    door_start_m: Point
    door_end_m: Point
    outward: Point

    @model_validator(mode="after")
    def _in_order(self) -> Goal:
        self._check_door()
        if self.people[0] > self.people[1]:
            raise ValueError(f"people: {self.people[0]} to {self.people[1]}; the first comes first")
        return self

    def of(self, ids: Indices) -> Flags:
        """Who (n,) of these ids (n,) goes there."""
        return (ids >= self.people[0]) & (ids <= self.people[1])


class Drive(Part, Exit):
    """Drive people with m(u_d − u)/τ: u_d points to the nearest point of the door (or to its
    centre), and along `outward` for those who have passed the line of the door.

    speed_m_per_s: m/s, |u_d|
    relaxation_time_s: s, τ
    door_start_m, door_end_m: m
    outward: unit vector out of the room
    aim: nearest or centre
    goals: doors of those who go to another one
    """

    speed_m_per_s: Positive
    relaxation_time_s: Positive
    door_start_m: Point
    door_end_m: Point
    outward: Point
    aim: Literal["nearest", "centre"] = "nearest"
    goals: tuple[Goal, ...] = ()

    def push(self, mass: Mass) -> Mass:
        """Give m U/τ (N): with how much people of this mass (kg) push who are held."""
        return mass * self.speed_m_per_s / self.relaxation_time_s

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
        ranges = sorted(goal.people for goal in self.goals)
        for (_, last), (first, _) in pairwise(ranges):
            if first <= last:
                raise ValueError(f"goals: person {first} has two")
        return self

    @property
    def doors(self) -> tuple[Exit, ...]:
        """All doors, the drive's own first."""
        return (self, *self.goals)

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

    def desired_velocity(self, position: Floats, ids: Indices | None = None) -> Floats:
        """Compute u_d of disks at position (n,2) m with ids (n,), in m/s, shape (n,2); ids are
        needed where there are goals."""
        place = np.array(position, dtype=np.float64, order="C")
        if not self.goals:
            return self._headed(place, self)
        if ids is None:
            raise ValueError("goals: the ids of people say who goes where")
        velocity = np.empty_like(place)
        for exit_, mine in self.exits(ids):
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
        for exit_, mine in self.exits(ids):
            passed |= mine & exit_.beyond(position)
        return passed


class Push(Part):
    """Say with how much people push.

    push_N: N, of a person of mean mass who is held; in proportion to the mass of others
    """

    push_N: Positive  # noqa: N815  (the unit is newton)


class BodyForce(Part):
    """Accelerate everybody alike, as gravity does on a slope.

    acceleration_m_per_s2: (x, y) m/s², g; the force on a disk is m g
    """

    acceleration_m_per_s2: Point


class Run(Part):
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
        the rigid engine always does
    """

    duration_s: Positive
    frames: Count
    time_step_s: Positive | None = None
    drive_interval_steps: Count = 10
    rigid_step_s: Positive | None = None
    rigid_tolerance: Annotated[Number, Field(ge=1e-12, le=0.1)] | None = None
    impulses: Annotated[bool, Strict()] | None = None


class Analysis(Part):
    """Say which percussions are compared with which forces.

    kind: driven: p/τ with the force at time_s; impact: p of the initial state with ∫f dt over the
        run
    time_s: s
    contact_tolerance_m: m, gap up to which disks are in contact
    """

    kind: Literal["driven", "impact"]
    time_s: Annotated[Number, Field(ge=0)] = 0.0
    contact_tolerance_m: Positive = 1e-6


class Room(Part):
    """Hold a scene without its disks: what `percussions import` puts a crowd into."""

    title: str
    source: str
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
        )

    def acceleration(self) -> Point:
        """Give the acceleration (x, y) m/s² of the body force; 0 where there is none."""
        return self.body_force.acceleration_m_per_s2 if self.body_force else (0.0, 0.0)

    def door(self) -> Walls | None:
        """Give the doors as segments, where there is a drive."""
        if self.drive is None:
            return None
        ends = np.array([exit_.door for exit_ in self.drive.doors])
        return Walls(start=ends[:, 0], end=ends[:, 1])
