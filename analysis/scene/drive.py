"""The drive of a scene: where people want to go, how fast, by which way, and until when."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import Annotated, Any, Literal, Self, TypeVar

import numpy as np
import pydantic

from analysis.scene.distance import Distance, Some
from analysis.scene.fields import Number, Point, Positive, Schema, means_of
from analysis.scene.way import Way, way_of
from nscd import Snapshot, Walls, _core
from nscd.arrays import Floats, Indices, Mask
from nscd.segments import dots, lengths, nearest_on_segment

# The key that may stand for desired speed or relaxation time, and the latter where only it is
# given: pushed people lose their speed in 0.1 to 1 s.
PUSH, USUAL_RELAXATION_S = "push_N", 0.5
Mass = TypeVar("Mass", float, Floats)
# m: a line this near to a wall meets it, which ends this share before the door.
CROSSED_M, SHORT = 1e-9, 1e-6
# m: nobody comes beyond a line here.
NOWHERE = (1e30, 1e30)


# m: a door so far ahead that everybody walks along `outward` and nobody arrives.
AHEAD = 1e29


class Exit(Schema):
    """Say where somebody wants to go: what a drive and its goals have in common."""

    door_start_m: Point
    door_end_m: Point
    outward: Point

    @pydantic.model_validator(mode="before")
    @classmethod
    def _ahead(cls, value: Any) -> Any:
        """Put a door far ahead where none is given."""
        if not isinstance(value, dict) or {"door_start_m", "door_end_m"} & value.keys():
            return value
        try:
            x, y = map(float, value["outward"])
        except (KeyError, TypeError, ValueError):
            return value
        start, end = ((x - 0.5 * s * y, y + 0.5 * s * x) for s in (1, -1))
        doors = {"door_start_m": start, "door_end_m": end}
        return value | {key: (AHEAD * x, AHEAD * y) for key, (x, y) in doors.items()}

    @pydantic.model_validator(mode="after")
    def _check_door(self) -> Self:
        if abs(lengths(np.array(self.outward)) - 1) > 1e-9:
            raise ValueError("outward must be a unit vector")
        if self.door_start_m == self.door_end_m:
            raise ValueError("door_start_m and door_end_m are the same point")
        return self

    @property
    def has_door(self) -> bool:
        """Whether there is a door to walk to."""
        return bool(np.abs(self.door).max() < 0.1 * AHEAD)

    @property
    def door(self) -> tuple[Point, Point]:
        """The ends of the door, m."""
        return self.door_start_m, self.door_end_m

    def beyond(self, position: Floats) -> Mask:
        """Who (n,) at (n,2) m has passed the line of the door."""
        passed: Mask = dots(position - self.door_start_m, np.array(self.outward)) >= 0
        return passed


class Goal(Exit, Some):
    """Send some people to a door of their own.

    people: ids, the first and the last
    door_start_m, door_end_m: m; left out, they walk along `outward`
    outward: unit vector out of the room"""


# s: a stop as late as this before an instant counts as there, since instants are rounded.
INSTANT = 1e-9
# Keys whose tables name people.
NAMING = ("goals", "stops", "pushers")


class Stop(Some):
    """Let some people want to go nowhere from a time on: they push no more, and the floor damps
    them with −m u/τ. An assumption about who faints, no medicine.

    people: ids, the first and the last
    time_s: s"""

    time_s: Positive


class Push(Schema):
    """Say with how much people push.

    push_N: N, of a person of mean mass who is held; in proportion to the mass of others"""

    push_N: Positive  # noqa: N815  (the unit is newton)


class Pace(Schema):
    """Say how fast people want to walk, and how soon: speed (m/s) and relaxation time (s)."""

    speed_m_per_s: Positive
    relaxation_time_s: Positive

    def push(self, mass: Mass) -> Mass:
        """Give m U/τ (N): with how much people of this mass (kg) push who are held."""
        return mass * self.speed_m_per_s / self.relaxation_time_s

    @pydantic.model_validator(mode="before")
    @classmethod
    def _of_push(cls, raw: Any, info: pydantic.ValidationInfo) -> Any:
        """Put speed and relaxation time in the place of a push, m̄ U/τ of the mean mass."""
        if not isinstance(raw, dict) or PUSH not in raw:
            return raw
        rest = {key: value for key, value in raw.items() if key != PUSH}
        push = Push.model_validate({PUSH: raw[PUSH]}).push_N
        means = means_of(info)
        if means is None:
            raise ValueError(f"{PUSH}: only where the mass of the disks is known")
        if {"speed_m_per_s", "relaxation_time_s"} <= rest.keys():
            raise ValueError(f"{PUSH}: instead of speed_m_per_s, relaxation_time_s, or both")
        _, mass = means
        if "speed_m_per_s" in rest:
            speed = pydantic.TypeAdapter(Positive).validate_python(rest["speed_m_per_s"])
            return rest | {"relaxation_time_s": mass * speed / push}
        time = pydantic.TypeAdapter(Positive).validate_python(
            rest.get("relaxation_time_s", USUAL_RELAXATION_S)
        )
        return rest | {"relaxation_time_s": time, "speed_m_per_s": push * time / mass}


class Drive(Distance, Exit, Pace):
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
        the shortest way that is wide enough, where left out straight at that wall

    Who keeps a distance (`time_gap_s`, see `Distance`) has another u_d."""

    aim: Literal["nearest", "centre"] = "nearest"
    goals: tuple[Goal, ...] = ()
    stops: tuple[Stop, ...] = ()
    clearance_m: Annotated[Number, pydantic.Field(ge=0, le=100)] | None = None
    _way: Way | None = pydantic.PrivateAttr(None)
    _walls: Walls | None = pydantic.PrivateAttr(None)
    _cores: dict[bytes, _core.Drive] = pydantic.PrivateAttr(default_factory=dict)

    @pydantic.model_validator(mode="after")
    def _one_goal_each(self) -> Drive:
        if self.aim == "centre" and not self.gates:
            raise ValueError("aim: centre of a door, and there is none. Give door_start_m")
        if self.clearance_m is not None and not self.all_have_doors:
            raise ValueError("clearance_m: a way leads to a door. Give door_start_m and door_end_m")
        for name in NAMING:
            parts: tuple[Some, ...] = getattr(self, name)
            ranges = sorted(part.people for part in parts)
            for (_, last), (first, _) in pairwise(ranges):
                if first <= last:
                    raise ValueError(f"{name}: person {first} has two")
        return self

    def shifted(self, by: int) -> Drive:
        """Return it for people whose ids are larger by so much."""
        named = {key: tuple(part.shifted(by) for part in getattr(self, key)) for key in NAMING}
        return self.model_copy(update=named)

    def check_people(self, ids: Iterable[Indices], before: str = "", where: str = "") -> None:
        """Raise ValueError naming a goal or a stop of people who are nowhere among these ids (n,), frame
        by frame; before, where: of the message."""
        frames = iter(ids)
        parts = [
            (f"drive.{key}: number {k + 1}", p)
            for key in NAMING
            for k, p in enumerate(getattr(self, key))
        ]
        while parts and (frame := next(frames, None)) is not None:
            parts = [(name, part) for name, part in parts if not part.of(frame).any()]
        for name, part in parts:
            first, last = part.people
            raise ValueError(f"{before}{name}: nobody{where} has an id from {first} to {last}")

    @property
    def fastest(self) -> float:
        """Give the fastest speed (m/s) that anybody wants: with jostling, of 5 standard deviations."""
        return self.speed_m_per_s + 5.0 * self.jostling_m_per_s

    @property
    def doors(self) -> tuple[Exit, ...]:
        """All doors, the drive's own first; those far ahead too."""
        return (self, *self.goals)

    @property
    def gates(self) -> list[tuple[Point, Point]]:
        """The ends (m) of the doors that there are, the drive's own first."""
        return [exit_.door for exit_ in self.doors if exit_.has_door]

    @property
    def all_have_doors(self) -> bool:
        """Whether everybody has a door to walk to."""
        return len(self.gates) == len(self.doors)

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

    def exits(self, ids: Indices) -> list[tuple[Exit, Mask]]:
        """Give each door and who (n,) of people with these ids (n,) goes to it: those whom no goal
        names to the drive's own."""
        goals: list[tuple[Exit, Mask]] = [(goal, goal.of(ids)) for goal in self.goals]
        others = ~np.any([mine for _, mine in goals], axis=0) if goals else np.ones(len(ids), bool)
        return [(self, others), *goals]

    @property
    def needs_way(self) -> bool:
        """Whether walls are needed that are not known yet, for a way or a distance."""
        has_way = self.clearance_m is not None and self._way is None
        return has_way or (self.keeps_distance and self._walls is None)

    @property
    def way(self) -> Way | None:
        """The way on which people go; None where they go straight. Raises ValueError where walls
        and radii are not known yet (`routed`)."""
        if self.clearance_m is not None and self._way is None:
            raise ValueError("drive.clearance_m: the way needs walls and radii. Use Drive.routed")
        return self._way

    def routed(self, walls: Walls, radius: float) -> Drive:
        """Return the drive with ways between walls for a radius (m), where it has a clearance, and with
        the walls from which people keep their distance."""
        if self.clearance_m is None and not self.keeps_distance:
            return self
        doors = np.array([(*exit_.door, exit_.outward) for exit_ in self.doors], dtype=float)
        routed = self.model_copy()
        routed._walls, routed._cores = walls if self.keeps_distance else None, {}
        if self.clearance_m is not None:
            routed._way = way_of(walls, doors, radius, self.clearance_m)
        return routed

    def straight(self) -> Drive:
        """Return the drive of people who walk straight to their door."""
        straight = self.model_copy(update={"clearance_m": None})
        straight._way = None
        return straight

    def hidden(self, walls: Walls, people: Snapshot) -> Mask:
        """Tell who (n,) has a wall on the straight line to the own door."""
        position = people.position
        start, end = self.straight().legs(position, people.ids)[:2]
        # a door ends where a wall does, and who walks there has no wall before it
        door = position + (1 - SHORT) * (nearest_on_segment(position, start, end) - position)
        clear = _core.clear_of(position, door, walls.start, walls.end, CROSSED_M)
        return np.asarray(clear == 0.0)

    def check_way(self, walls: Walls, people: Snapshot) -> None:
        """Raise ValueError naming a door and somebody whose way there is shut or too narrow."""
        if self.way is None:
            return
        widest = 2 * float(people.radius.max())
        for number, (exit_, mine) in enumerate(self.exits(people.ids)):
            (x0, y0), (x1, y1) = exit_.door
            door = f"the door from ({x0:g}, {y0:g}) to ({x1:g}, {y1:g}) m"
            if lengths(np.subtract(*exit_.door)) < widest:
                raise ValueError(f"drive: {door} is narrower than the widest person, {widest:g} m")
            shut = mine & (self.hidden(walls, people) | ~exit_.beyond(people.position))
            shut &= self.way.at(people.position, number, self.way.next) < 0
            if shut.any():
                position = people.position[shut][:1]
                thin = self.routed(walls, 1e-3).way
                narrow = thin is not None and thin.at(position, number, thin.next)[0] >= 0
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
        self,
        position: Floats,
        ids: Indices | None = None,
        time: Floats | float = 0.0,
        radius: Floats | None = None,
    ) -> Floats:
        """Compute u_d of disks at position (n,2) m with ids (n,) and radii (n,) m at a time (s; (n,) or
        one), in m/s, shape (n,2); ids are needed where there are goals or stops, and radii where
        people keep their distance, from those of the same time. Disks at one centre are then one
        body, as wide as its widest."""
        location = np.array(position, dtype=np.float64, order="C")
        if ids is None and (self.goals or self.stops or self.keeps_distance):
            raise ValueError("goals, stops, time_gap_s: the ids of people say who goes where")
        who = np.arange(len(location)) if ids is None else ids
        if self.keeps_distance:
            if radius is None:
                raise ValueError("drive.time_gap_s: the radii of people say how far they are apart")
            return self._at_a_distance(location, who, time, radius)
        velocity, speed = np.zeros_like(location), self.speed_m_per_s
        if self.way:
            legs = self.legs(location, who)
            _core.soft_drive(velocity, location, velocity.copy(), speed, 1.0, *legs)
        else:
            for exit_, mine in self.exits(who):
                positions = [*self.target(exit_), exit_.outward, exit_.door_start_m]
                start, end, outward, door = np.array(positions, dtype=float)
                velocity[mine] = _core.headed(location[mine], start, end, outward, door, speed)
        velocity[self.stopped(who, time)] = 0.0
        return velocity

    def _at_a_distance(
        self, position: Floats, ids: Indices, time: Floats | float, radius: Floats
    ) -> Floats:
        """The same of people who keep their distance from those of their time; a time that nobody knows
        is 0."""
        if self.stops or self.noisy:
            self._check_times(time)
        finite = np.nan_to_num(time)
        if finite.ndim:
            velocity = np.empty_like(position)
            for now in np.unique(finite):
                of = finite == now
                velocity[of] = self._at_a_distance(position[of], ids[of], float(now), radius[of])
            return velocity
        centre = position.view(np.complex128).ravel()
        column = np.sort(position[:, 0])  # far quicker than the pairs, and mostly says it
        if (column[1:] > column[:-1]).all() or len(np.unique(centre)) == len(position):
            return self._core(ids).desired(position, np.ascontiguousarray(radius), float(finite))
        # bodies of several disks, in the order of their first
        _, first, body = np.unique(centre, return_index=True, return_inverse=True)
        body = np.argsort(np.argsort(first))[body.ravel()]
        np.maximum.at(widest := np.zeros(len(first)), body, radius)
        first = np.sort(first)
        return self._core(ids[first]).desired(position[first], widest, float(finite))[body]

    def _check_times(self, time: Floats | float) -> None:
        if np.isnan(time).any():
            key = "stops" if self.stops else "heading_sd_rad, jostling_m_per_s"
            raise ValueError(f"drive.{key}: the time of the frame is not known")

    def _core(self, ids: Indices) -> _core.Drive:
        """The drive of people with these ids as the core takes it."""
        key = np.asarray(ids, dtype=np.int64).tobytes()
        if key not in self._cores:
            self._cores.clear()
            self._cores[key] = _core.Drive(self.row(ids))
        return self._cores[key]

    def row(self, ids: Indices) -> Floats:
        """Give the numbers of people with these ids who keep their distance in a row, as the core reads
        them, in every engine."""
        if self.needs_way or self._walls is None:
            raise ValueError("drive.time_gap_s: the distance needs walls. Use Drive.routed")
        goes, stop = np.zeros(len(ids)), np.full(len(ids), np.inf)
        exits, walls = self.exits(ids), self._walls
        for number, (_, mine) in enumerate(exits):
            goes[mine] = number
        for one in self.stops:
            stop[one.of(ids)] = one.time_s
        low, high = walls.period_x or (0.0, 0.0)
        corners = len(self.way.corners) if self.way else 0
        head = len(exits), len(ids), len(walls), corners, low, high - low, self.speed_m_per_s
        positions = [np.ravel([*self.target(to), to.outward, to.door_start_m]) for to, _ in exits]
        parts = [head, self.numbers(), np.hstack([walls.start, walls.end]), *positions]
        parts += [goes, stop, ids, self.push_shares(ids), *(self.way.numbers() if self.way else ())]
        return np.concatenate([np.ravel(np.asarray(part, dtype=float)) for part in parts])

    def stopped(self, ids: Indices, time: Floats | float) -> Mask:
        """Tell who (n,) of people with these ids (n,) wants to go nowhere at a time (s; (n,) or one).
        Raises ValueError where it is not known."""
        if self.stops:
            self._check_times(time)
        there = np.zeros(len(ids), dtype=bool)
        for stop in self.stops:
            there |= stop.of(ids) & (np.asarray(time) >= stop.time_s - INSTANT)
        return there

    def gone(self, position: Floats, ids: Indices) -> Mask:
        """Tell who (n,) at (n,2) m has passed the line of the own door."""
        passed = np.zeros(len(position), dtype=bool)
        for number, (exit_, mine) in enumerate(self.exits(ids)):
            passed |= mine & exit_.beyond(position)
            if self.way:
                passed &= ~(mine & self.way.corner(position, number)[0])
        return passed
