"""What a scene consists of besides its disks: walls, drive, contact law, run, analysis."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, Strict, TypeAdapter, ValidationInfo, model_validator

from analysis.scene.contact import ContactModel
from analysis.scene.values import Count, Number, Part, Point, Positive, means_of
from nscd import Walls
from nscd.segments import headed

# The key that may stand for desired speed or relaxation time, and the latter where only it is
# given: pushed people lose their speed in 0.1 to 1 s.
PUSH, USUAL_RELAXATION_S = "push_N", 0.5


class Wall(Part):
    """Name a straight wall.

    name: a word of letters, digits and underscores
    start_m, end_m: m
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z]\w*$")]
    start_m: Point
    end_m: Point


class Drive(Part):
    """Drive people with m(u_d − u)/τ: u_d points to the nearest point of the door (or to its
    centre), and along `outward` for those who have passed the line of the door.

    speed_m_per_s: m/s, |u_d|
    relaxation_time_s: s, τ
    door_start_m, door_end_m: m
    outward: unit vector out of the room
    aim: nearest or centre
    """

    speed_m_per_s: Positive
    relaxation_time_s: Positive
    door_start_m: Point
    door_end_m: Point
    outward: Point
    aim: Literal["nearest", "centre"] = "nearest"

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
    def _unit_outward(self) -> Drive:
        if abs(np.hypot(*self.outward) - 1) > 1e-9:
            raise ValueError("outward must be a unit vector")
        if self.door_start_m == self.door_end_m:
            raise ValueError("door_start_m and door_end_m are the same point")
        return self

    def target(self) -> tuple[Point, Point]:
        """Give the segment whose nearest point people walk to (m): the door, or its centre
        twice."""
        if self.aim == "nearest":
            return self.door_start_m, self.door_end_m
        (x0, y0), (x1, y1) = self.door_start_m, self.door_end_m
        centre = (0.5 * (x0 + x1), 0.5 * (y0 + y1))
        return centre, centre

    def desired_velocity(self, position: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        """Compute u_d of disks at position (n,2) m, in m/s, shape (n,2)."""
        velocity: np.ndarray[Any, Any] = headed(
            np.array(position, dtype=np.float64, order="C"),
            *self.target(),
            self.outward,
            self.door_start_m,
            self.speed_m_per_s,
        )
        return velocity


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
        """Give the door as a segment, where there is a drive."""
        if self.drive is None:
            return None
        return Walls(
            start=np.array([self.drive.door_start_m]), end=np.array([self.drive.door_end_m])
        )
