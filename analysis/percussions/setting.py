"""What surrounds a snapshot and presses it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from analysis.dumps import Bodies, DumpError, open_bodies, snapshot_of
from analysis.dumps.bodies import FixedDisks
from analysis.dumps.find_frames import has_period
from analysis.dumps.last_digits import Digits
from analysis.engines.record import FILE, RunRecord
from analysis.scene.scene import Drive, Room, Scene, SceneError, means_of, read_room
from analysis.scene.unused import CROWD, note_unused_keys
from analysis.support.reading import note
from nscd import ContactLaw, Contacts, Snapshot, Walls, find_contacts
from nscd.arrays import Floats
from nscd.contacts import NO_WALLS
from nscd.stepping import Arms
from nscd.stepping.motion import segments_of

LeftVelocity = Literal["desired", "dump", "free"]
FORCE, IMPULSE = "N", "N·s"
# Gap (m) up to which disks are in contact, unless text has fewer digits: their rounding then, if it is no
# more than this share of the smallest radius.
TOUCH, MOST_ROUNDING = 1e-6, 0.05
# The ends of a period, in the room and in the dump, may differ by this share of it.
SAME = 1e-4
# Disks that overlap by more than this share of the smaller radius are no snapshot of a crowd.
LARGEST_OVERLAP = 0.5
# Of two bodies; a dissipation as large as an elastic contact's would leave rounding errors only.
NEARLY_ELASTIC = 0.9999
# A crowd that rests on a slope has the forces of this time, as of any other, s.
REST_S = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """Hold what surrounds a snapshot and presses it: the parts of a scene that its percussions
    need.

    walls
    wall_names: of the walls, in their order; their numbers from 1 where left out
    drive: who wants to go where
    acceleration: (x, y) m/s², g of a body force
    arms: the soft layer that pushes before bodies touch; a part of the left velocity
    friction, wall_friction: μ of people with each other and with walls (None: the same)
    contact_tolerance: m, gap up to which disks are in contact, at most the smallest radius; where left
        out 1e-6, or what gaps may be wrong by where a text has few `digits`
    largest_overlap: share of the smaller radius; deeper overlaps are refused
    restitution: of an impact; contacts of a crowd that presses are inelastic
    left_velocity: see `left`; None: desired where there is a drive or a body force, else dump
    window: s, Δt of the left velocity `free`
    fixed_disks: that do not move, as walls do not; they have numbers behind those of walls
    digits: how exact the text is that disks come from; see `of_dump`
    listed: the contacts of a snapshot, in place of those that are found

    Raises ValueError naming the field for what is not finite, negative or unknown, for friction of
    walls where there are none, and for a window of another left velocity."""

    walls: Walls | None = None
    wall_names: tuple[str, ...] = ()
    drive: Drive | None = None
    acceleration: tuple[float, float] = (0.0, 0.0)
    arms: Arms | None = None
    friction: float = 0.0
    wall_friction: float | None = None
    restitution: float = 0.0
    contact_tolerance: float | None = None
    largest_overlap: float = LARGEST_OVERLAP
    left_velocity: LeftVelocity | None = None
    window: float | None = None
    fixed_disks: FixedDisks | None = None
    digits: Digits | None = None
    listed: Contacts | None = None

    def __post_init__(self) -> None:
        self.law  # noqa: B018  (refuses what is no coefficient)
        if self.wall_friction is not None and not (self.walls is not None and len(self.walls)):
            raise ValueError(f"wall_friction: {self.wall_friction:g}. There are no walls")
        if self.contact_tolerance is not None and not 0 <= self.contact_tolerance < math.inf:
            raise ValueError(
                f"contact_tolerance: {self.contact_tolerance} m. A finite length ≥ 0 is needed"
            )
        if not self.largest_overlap >= 0:
            raise ValueError(f"largest_overlap: {self.largest_overlap}. A share ≥ 0 is needed")
        if self.window is not None and not 0 < self.window < math.inf:
            raise ValueError(f"window: {self.window} s. A finite time above 0 is needed")
        if self.window is not None and self.kind != "free":
            raise ValueError(f"window: {self.window:g} s. It is only of left velocity `free`")
        if self.left_velocity not in (None, *get_args(LeftVelocity)):
            kinds = ", ".join(get_args(LeftVelocity))
            raise ValueError(f"left_velocity: {self.left_velocity!r}. There are: {kinds}")

    def __repr__(self) -> str:
        walls = 0 if self.walls is None else len(self.walls)
        drive = "a drive" if self.drive else "no drive"
        return (
            f"<Setting: {walls} walls, {drive}, left velocity {self.kind}, friction "
            f"{self.friction:g}, contact tolerance {self.usual_touch:g} m>"
        )

    @classmethod
    def of(cls, scene: Scene) -> Setting:
        """Take the setting from a scene: an impact keeps the velocities of the snapshot."""
        impact = scene.analysis.kind == "impact"
        return cls.in_room(scene, left_velocity="dump" if impact else "desired")

    @classmethod
    def in_room(cls, room: Room, **rest: Any) -> Setting:
        """Take walls, drive, body force, arms, friction, restitution and contact tolerance from a room;
        an impact (analysis.kind) keeps the velocities of the snapshot; `rest`: other fields."""
        parts: dict[str, Any] = {
            "walls": standing_walls(room),
            "wall_names": tuple(wall.name for wall in room.walls),
            "drive": room.drive,
            "acceleration": room.acceleration(),
            "arms": room.contact.arms,
            "friction": room.contact.friction,
            "restitution": room.contact.restitution,
            "left_velocity": "dump" if room.analysis.kind == "impact" else None,
        }
        if "contact_tolerance_m" in room.analysis.model_fields_set:
            parts["contact_tolerance"] = room.analysis.contact_tolerance_m
        return cls(**(parts | rest))

    def of_dump(self, trajectory: Any) -> Setting:
        """Take from a dump, as `open_bodies` gives it, who does not move and how exact it is.

        Raises DumpError where its box and the period of the room contradict, and for arms beside disks
        that do not move."""
        path, index, fixed_disks = trajectory.filename, trajectory.index, trajectory.fixed_disks
        digits = trajectory.digits
        low, high = (self.walls and self.walls.period_x) or (0.0, 0.0)
        for frame in index.frames if low < high and index.periodic else ():
            x0, x1 = (trajectory.columns.unit * end for end in (frame.low[0], frame.high[0]))
            if not max(abs(x0 - low), abs(x1 - high)) <= SAME * (high - low):
                raise DumpError(
                    f"{path}, step {frame.step}: its box is periodic from x = {x0:g} to {x1:g} m, and "
                    f"period_x_m of the room is from {low:g} to {high:g} m"
                )
        if fixed_disks is not None and self.arms:
            raise DumpError(f"{path}: fixed types (--fixed-type) are not for people with arms")
        if digits != self.digits and digits is not None and (wrong := digits.rounding()) > TOUCH:
            message = f"positions have {digits.position.digits} digits, so gaps may be wrong by {wrong:.2g} m"
            inputs = self.contact_tolerance
            if inputs is None:
                note(path, f"{message}. Such gaps are contacts (--contact-tolerance)")
            elif inputs < wrong:
                note(path, f"{message}. The contact tolerance {inputs:g} m is finer")
        names = self.wall_names
        if fixed_disks is not None and self.fixed_disks is None:
            names = names or tuple(map(str, range(1, 1 + len(self.walls or ()))))
            names += tuple(f"disk_{one}" for one in fixed_disks.ids)
        return replace(self, fixed_disks=fixed_disks, digits=digits, wall_names=names)

    def touch(self, position: Floats, radius: Floats) -> tuple[float, bool]:
        """Give the gap (m) up to which disks at (n,2) m of radii (n,) m are in contact, and whether that
        is too much to tell contacts from gaps."""
        if self.contact_tolerance is not None or self.digits is None or not len(radius):
            return TOUCH if self.contact_tolerance is None else self.contact_tolerance, False
        wrong = self.digits.rounding(position, float(radius.max()))
        return max(TOUCH, wrong), wrong > MOST_ROUNDING * float(radius.min())

    @property
    def usual_touch(self) -> float:
        """Give the gap (m) up to which disks are in contact in most frames."""
        rounding = self.digits.rounding() if self.digits else 0.0
        return max(TOUCH, rounding) if self.contact_tolerance is None else self.contact_tolerance

    @property
    def kind(self) -> LeftVelocity:
        """The left velocity that is taken."""
        pressed = self.drive is not None or any(self.acceleration)
        return self.left_velocity or ("desired" if pressed else "dump")

    @property
    def law(self) -> ContactLaw:
        """The law of contacts with this friction; inelastic, in an impact of this restitution, and of
        elastic ones that nearest to it which a finite dissipation gives."""
        bouncing = min(self.restitution, NEARLY_ELASTIC) if self.kind == "dump" else 0.0
        frictional = ContactLaw(friction=self.friction, wall_friction=self.wall_friction)
        return replace(frictional, restitution=bouncing) if bouncing else frictional

    @property
    def moves(self) -> bool:
        """Whether the velocities in the snapshot count."""
        return self.kind != "desired"

    def contacts(self, snapshot: Snapshot) -> Contacts:
        """Find who touches whom in a snapshot.

        Raises ValueError for a contact tolerance beyond the smallest radius, and naming the bodies
        for coinciding ones and for overlaps beyond `largest_overlap`."""
        smallest = float(snapshot.radius.min(initial=math.inf))
        touch, coarse = self.touch(snapshot.position, snapshot.radius)
        if touch > smallest and not coarse:
            raise ValueError(
                f"contact_tolerance: {touch:g} m. The smallest radius is {smallest:g} m"
            )
        found = self.find(snapshot, touch) if self.listed is None else self.listed
        if coarse and ((found.gap > TOUCH) & (found.gap <= touch)).any():
            raise ValueError(
                f"positions of few digits: gaps may be wrong by {touch:.2g} m, and the smallest radius is "
                f"{smallest:g} m. Write more digits, or give a contact tolerance (--contact-tolerance)"
            )
        radius = snapshot.radius[found.first]
        pairs = ~found.is_wall
        radius[pairs] = np.minimum(radius[pairs], snapshot.radius[found.second[pairs]])
        fraction = -found.gap / radius
        if len(found) and not fraction.max() <= self.largest_overlap:
            worst = int(np.argmax(fraction))
            raise ValueError(
                f"disk {snapshot.ids[found.first[worst]]} and {self.name(found, snapshot, worst)} "
                f"overlap by {fraction[worst]:.3g} of a radius. At most {self.largest_overlap:g} is "
                "taken (--largest-overlap, largest_overlap)"
            )
        return found

    def find(self, snapshot: Snapshot, touch: float) -> Contacts:
        """Find contacts up to a gap (m), those with disks that do not move as those with walls behind the others."""
        fixed = self.fixed_disks
        if fixed is None or not len(fixed):
            return find_contacts(snapshot, self.walls, tolerance=touch)
        n, bodies = len(snapshot), snapshot.bodies
        found = find_contacts(fixed.behind(snapshot), self.walls, tolerance=touch)
        found = found.select(found.first < n)
        on_fixed = ~found.is_wall & (found.second >= n)
        second = np.where(on_fixed, found.second - n + len(self.walls or ()), found.second)
        found = replace(found, second=second, is_wall=found.is_wall | on_fixed)
        if bodies is not None:
            other = np.where(found.is_wall, 0, found.second)
            within = ~found.is_wall & (bodies.number[found.first] == bodies.number[other])
            found = found.select(~within)
        return found.select(np.argsort(found.is_wall, kind="stable"))

    def name(self, contacts: Contacts, snapshot: Snapshot, row: int) -> str:
        """Name the second body of a contact."""
        second = int(contacts.second[row])
        if not contacts.is_wall[row]:
            return f"disk {snapshot.ids[second]}"
        return f"wall {self.wall_names[second] if self.wall_names else second + 1}"

    def left(self, snapshot: Snapshot | Bodies) -> tuple[Floats, float | None]:
        """Give the left velocity u⁻ (n,2) m/s of a snapshot, and the time (s) that turns its
        percussions into forces (None for an impact).

        desired: u_d + τ g, what drive and body force make of a crowd without contacts, forces p/τ; at
            rest, without drive, g times 1 s
        dump: the velocity in the snapshot, an impact, which takes no time and so knows no body force
        free: u + Δt (F_drive/m + g), what both make of it in `window` Δt, forces p/Δt

        g is the body force and what arms give, both over m: percussions are then those of bodies
        alone, beside the forces of arms.

        Raises ValueError where the drive or the window is missing."""
        drive, window, g = self.drive, self.window, np.array(self.acceleration)
        if self.arms and self.kind != "dump":
            walls = segments_of(self.walls)
            pushed = self.arms.forces(snapshot.position, snapshot.radius, walls)
            g = g + pushed / snapshot.mass[:, None]
        if self.kind == "dump":
            return snapshot.velocity, None
        if drive and drive.needs_way:
            drive = drive.routed(self.walls or NO_WALLS, float(snapshot.radius.max()))
        time = snapshot.time if isinstance(snapshot, Snapshot) else snapshot.time_of_rows
        # frames of bodies of several disks are not solved at once
        position = snapshot.centres if isinstance(snapshot, Snapshot) else snapshot.position
        who = snapshot.ids, time, snapshot.radius
        wanted = drive.desired_velocity(position, *who) if drive else None
        if self.kind == "desired":
            if drive is None or wanted is None:
                if g.any():  # a crowd at rest: whatever the time, forces are the same
                    return REST_S * g + np.zeros_like(snapshot.position), REST_S
                raise ValueError(
                    "left velocity `desired` needs a scene with a [drive] or a [body_force] "
                    "(--room SCENE.toml)"
                )
            return wanted + drive.relaxation_time_s * g, drive.relaxation_time_s
        added = g
        if snapshot.drive is not None:
            added = g + snapshot.drive / snapshot.mass[:, None]
        elif drive is not None and wanted is not None:
            added = g + (wanted - snapshot.velocity) / drive.relaxation_time_s
        elif not g.any():
            raise ValueError(
                "left velocity `free` needs drive_x and drive_y in the dump, or a scene with a "
                "[drive] or a [body_force]"
            )
        if window is None:
            raise ValueError("left velocity `free` needs a window > 0 s (--window)")
        return snapshot.velocity + window * added, window


def standing_walls(room: Room) -> Walls:
    """Give the walls of a room. Raises ValueError where one gives: where it is, only its run knows."""
    if giving := room.giving():
        raise ValueError(
            f"walls.mass_kg: {giving[0].name} gives. Percussions are for walls that stand. Loads of its "
            "runs: percussions exposure"
        )
    return room.wall_segments()


def room_beside(
    dump: Path, room: Path | None = None, stated: Mapping[str, Any] | None = None, **value: Any
) -> tuple[Room | None, Setting]:
    """Read a room or scene file, or scene.toml beside the dump, and take the setting from it; no room
    where there is neither. Its keys that are not used are said in a line, but those that a run used.

    stated: what `open_bodies` is told of the dump; value: fields of `Setting` that are used instead

    Raises EngineError where run.json beside the dump says that the run did not end well,
    SceneError for the file, and where goals or stops are of nobody in the dump, and ValueError for a
    field."""
    beside, run = dump.parent / "scene.toml", (dump.parent / FILE).exists()
    if run:
        RunRecord.read(dump.parent).check_beside(dump, beside if room is None else None)
    chosen = room if room is not None else beside if beside.exists() else None
    if chosen is None:
        return None, Setting(**value)
    found = read_room(chosen, lambda: means_of(next(_frames(dump, stated))), complete=False)[0]
    if not found.period_x_m and has_period(dump):
        raise SceneError(
            f"{chosen}: period_x_m: missing. scene.toml beside {dump} has one: contacts across its "
            "boundary would be missed"
        )
    setting = Setting.in_room(found, **value)
    if found.drive and setting.kind != "dump":
        ids = (frame.ids for frame in _frames(dump, stated))
        found.drive.check_people(ids, f"{chosen}: ", f" in {dump}")
    if room is not None or not run:
        free = setting.kind == "free" and found.drive
        own = free and next(_frames(dump, stated)).drive is not None
        drive = {"drive"} if own or setting.kind == "dump" else set()
        note_unused_keys(chosen, f"left velocity {setting.kind}", CROWD | drive)
    return found, setting


def _frames(dump: Path, stated: Mapping[str, Any] | None) -> Iterator[Snapshot]:
    """The frames in which somebody is; the dump is opened when the first is asked for."""
    trajectory = open_bodies(dump, **(stated or {})).trajectory
    for number in np.flatnonzero(trajectory.index.counts):
        yield snapshot_of(trajectory[number], dump, needs_velocity=False)


def setting_beside(
    dump: Path, room: Path | None = None, stated: Mapping[str, Any] | None = None, **value: Any
) -> Setting:
    """Take walls and drive of `room_beside`, which says what is raised."""
    return room_beside(dump, room, stated, **value)[1]


def law_of(scene: Scene) -> ContactLaw:
    """Give the rigid law of a scene's own contacts: its friction, and in an impact its restitution,
    which is part of the model. A crowd that is pressed rests, and its forces do not depend on it.

    Raises ValueError for an impact of restitution 1, which no finite dissipation gives."""
    setting = Setting.of(scene)
    if setting.law.restitution == NEARLY_ELASTIC:
        raise ValueError(
            f"scene {scene.name}: contact.restitution: {setting.restitution:g}. The rigid model needs a "
            "restitution below 1"
        )
    return setting.law
