"""What a scene consists of besides its disks: walls, drive, contact law, run, analysis."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    Strict,
    TypeAdapter,
    ValidationInfo,
    field_validator,
    model_validator,
)

from nscd import Walls
from nscd.segments import nearest_on_segment

# Engines do not read numbers whose squares or quotients underflow.
SMALLEST = 1e-100


# strict: neither `true` nor "1.0" is a number
Number = Annotated[float, Strict(), Field(allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0)]
Count = Annotated[int, Strict(), Field(ge=1)]
# beyond this, distances leave double precision
Length = Annotated[Number, Field(ge=-1e30, le=1e30)]
Point = tuple[Length, Length]
# Mean radius (m) and mean mass (kg) of the disks of a file.
Means = tuple[float, float]
# The key that may stand for desired speed or relaxation time, and the latter where only it is
# given: pushed people lose their speed in 0.1 to 1 s.
PUSH, USUAL_RELAXATION_S = "push_N", 0.5


def _means_of(info: ValidationInfo) -> Means | None:
    """The means of the disks of the file that is read, where there are any."""
    ask: Callable[[], Means | None] = (info.context or {}).get("means", lambda: None)
    return ask()


class Part(BaseModel):
    """A table of a scene file: no key that is not known, numbers that are numbers."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @field_validator("*")
    @classmethod
    def _underflows_nowhere(cls, value: Any) -> Any:
        for part in value if isinstance(value, tuple) else (value,):
            if isinstance(part, float) and 0 < abs(part) < SMALLEST:
                raise ValueError(f"{part:g} is nearer to 0 than {SMALLEST:g}; write 0")
        return value


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
        means = _means_of(info)
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
        start, end = (np.array(point) for point in self.target())
        outward = np.array(self.outward)
        to_door = nearest_on_segment(position, start, end) - position
        distance = np.hypot(*to_door.T)
        gone = ((position - np.array(self.door_start_m)) @ outward >= 0) | (distance == 0)
        direction = to_door / np.where(distance > 0, distance, 1.0)[:, None]
        return np.asarray(self.speed_m_per_s * np.where(gone[:, None], outward, direction))


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


# The keys that may stand for the stiffness of hertz.
YOUNG, POISSON = "young_modulus_Pa", "poisson_ratio"
# The overlap, over the mean radius, at which hertz has the stiffness that is given.
HERTZ_OVERLAP = 0.01


def hertz_stiffness(young_modulus: float, poisson_ratio: float, mean_radius: float) -> float:
    """Compute the tangent stiffness (N/m) of two disks of mean radius r̄ (m) at an overlap of 1 %
    of it, for bodies of Young's modulus E (Pa) and Poisson's ratio ν.

    F = K √R δ^1.5 with K = ⁴⁄₃ E* = ⅔ E/(1 − ν²) and R = r̄/2 (Hertz; Johnson, Contact Mechanics,
    1985, 4.2), so k = ³⁄₂ K √(R δ)."""
    k = 2 / 3 * young_modulus / (1 - poisson_ratio**2)
    return k / hertz_constant(1.0, mean_radius)


def hertz_constant(stiffness: float, mean_radius: float) -> float:
    """Compute K (Pa) of a Hertz contact F = K √R δ^1.5 from the tangent stiffness k (N/m) of two
    disks of mean radius r̄ (m) at an overlap of 1 % of it: k = ³⁄₂ K √(½ r̄ 0.01 r̄)."""
    return stiffness / (1.5 * float(np.sqrt(0.5 * HERTZ_OVERLAP)) * mean_radius)


class ContactModel(Part):
    """Repel by k·overlap (hooke) or K·overlap^1.5 (hertz), with a dashpot for the asked restitution
    and Coulomb friction.

    stiffness_N_per_m: N/m, k; of hertz the tangent stiffness at an overlap of 1 % of the mean
        radius; a file may give young_modulus_Pa and poisson_ratio instead
    restitution: 0 to 1, of two bodies
    friction: coefficient; 0 is none
    tangential_ratio: stiffness of the tangential spring over k
    """

    law: Literal["hooke", "hertz"] = "hooke"
    stiffness_N_per_m: Positive  # noqa: N815  (the unit is newton)
    restitution: Annotated[Number, Field(ge=0, le=1)]
    friction: Annotated[Number, Field(ge=0)] = 0.0
    tangential_ratio: Positive = 2 / 7

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
        means = _means_of(info)
        if means is None:
            raise ValueError(f"{YOUNG}: only where the radius of the disks is known")
        radius, _ = means
        stiffness = hertz_stiffness(material.young_modulus_Pa, material.poisson_ratio, radius)
        return rest | {"stiffness_N_per_m": stiffness}


class Material(Part):
    """What bodies are made of.

    young_modulus_Pa: Pa, E
    poisson_ratio: ν
    """

    young_modulus_Pa: Positive  # noqa: N815  (the unit is pascal)
    poisson_ratio: Annotated[Number, Field(gt=-1, le=0.5)]


class Run(Part):
    """Say how long to simulate and how often to write.

    duration_s: s
    frames: how many after the first
    time_step_s: s, of LAMMPS and YADE; follows from the stiffness where left out
    drive_interval_steps: steps between two evaluations of the drive, in LAMMPS and YADE
    rigid_step_s: s, of the rigid engine; follows from radius and speed where left out
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
