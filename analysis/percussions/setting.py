"""What surrounds a snapshot and presses it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from analysis.dumps import Bodies, open_bodies, snapshot_of
from analysis.dumps.frames import has_period
from analysis.engines.record import FILE, RunRecord
from analysis.scene.scene import Drive, Room, Scene, SceneError, means_of, read_room
from analysis.scene.unused import CROWD, note_unused_keys
from nscd import ContactLaw, Contacts, Snapshot, Walls, find_contacts
from nscd.arrays import Floats
from nscd.contacts import NO_WALLS
from nscd.stepping import Arms
from nscd.stepping.motion import segments_of

LeftVelocity = Literal["desired", "dump", "free"]
FORCE, IMPULSE = "N", "N·s"
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
    contact_tolerance: m, gap up to which disks are in contact, at most the smallest radius
    largest_overlap: share of the smaller radius; deeper overlaps are refused
    restitution: of an impact; contacts of a crowd that presses are inelastic
    left_velocity: see `left`; None: desired where there is a drive or a body force, else dump
    window: s, Δt of the left velocity `free`

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
    contact_tolerance: float = 1e-6
    largest_overlap: float = LARGEST_OVERLAP
    left_velocity: LeftVelocity | None = None
    window: float | None = None

    def __post_init__(self) -> None:
        self.law  # noqa: B018  (refuses what is no coefficient)
        if self.wall_friction is not None and not (self.walls is not None and len(self.walls)):
            raise ValueError(f"wall_friction: {self.wall_friction:g}. There are no walls")
        if not 0 <= self.contact_tolerance < math.inf:
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
            f"{self.friction:g}, contact tolerance {self.contact_tolerance:g} m>"
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
            "contact_tolerance": room.analysis.contact_tolerance_m,
            "left_velocity": "dump" if room.analysis.kind == "impact" else None,
        }
        return cls(**(parts | rest))

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
        rough = ContactLaw(friction=self.friction, wall_friction=self.wall_friction)
        return replace(rough, restitution=bouncing) if bouncing else rough

    @property
    def moves(self) -> bool:
        """Whether the velocities in the snapshot count."""
        return self.kind != "desired"

    def contacts(self, snapshot: Snapshot) -> Contacts:
        """Find who touches whom in a snapshot.

        Raises ValueError for a contact tolerance beyond the smallest radius, and naming the bodies
        for coinciding ones and for overlaps beyond `largest_overlap`."""
        smallest = float(snapshot.radius.min(initial=math.inf))
        if self.contact_tolerance > smallest:
            raise ValueError(
                f"contact_tolerance: {self.contact_tolerance:g} m. The smallest radius is "
                f"{smallest:g} m"
            )
        found = find_contacts(snapshot, self.walls, tolerance=self.contact_tolerance)
        radius = snapshot.radius[found.first]
        pairs = ~found.is_wall
        radius[pairs] = np.minimum(radius[pairs], snapshot.radius[found.second[pairs]])
        share = -found.gap / radius
        if len(found) and not share.max() <= self.largest_overlap:
            worst = int(np.argmax(share))
            raise ValueError(
                f"disk {snapshot.ids[found.first[worst]]} and {self.name(found, snapshot, worst)} "
                f"overlap by {share[worst]:.3g} of a radius. At most {self.largest_overlap:g} is "
                "taken (--largest-overlap, largest_overlap)"
            )
        return found

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
        place = snapshot.centres if isinstance(snapshot, Snapshot) else snapshot.position
        wanted = drive.desired_velocity(place, snapshot.ids, time) if drive else None
        if self.kind == "desired":
            if drive is None or wanted is None:
                if g.any():  # a crowd at rest: whatever the time, forces are the same
                    return np.broadcast_to(REST_S * g, snapshot.position.shape), REST_S
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
    dump: Path, room: Path | None = None, unit: str | None = None, **given: Any
) -> tuple[Room | None, Setting]:
    """Read a room or scene file, or scene.toml beside the dump, and take the setting from it; no room
    where there is neither. Its keys that are not used are said in a line, but those that a run used.

    unit: of lengths in the dump; given: fields of `Setting` that are used instead

    Raises EngineError where run.json beside the dump says that the run did not end well,
    SceneError for the file, and where goals or stops are of nobody in the dump, and ValueError for a
    field."""
    beside, run = dump.parent / "scene.toml", (dump.parent / FILE).exists()
    if run:
        RunRecord.read(dump.parent).check_beside(dump, beside if room is None else None)
    chosen = room if room is not None else beside if beside.exists() else None
    if chosen is None:
        return None, Setting(**given)
    found = read_room(chosen, lambda: means_of(next(_frames(dump, unit))), whole=False)[0]
    if not found.period_x_m and has_period(dump):
        raise SceneError(
            f"{chosen}: period_x_m: missing. scene.toml beside {dump} has one: contacts across its "
            "boundary would be missed"
        )
    setting = Setting.in_room(found, **given)
    if found.drive and setting.kind != "dump":
        ids = (frame.ids for frame in _frames(dump, unit))
        found.drive.check_people(ids, f"{chosen}: ", f" in {dump}")
    if room is not None or not run:
        free = setting.kind == "free" and found.drive
        own = free and next(_frames(dump, unit)).drive is not None
        drive = {"drive"} if own or setting.kind == "dump" else set()
        note_unused_keys(chosen, f"left velocity {setting.kind}", CROWD | drive)
    return found, setting


def _frames(dump: Path, unit: str | None) -> Iterator[Snapshot]:
    """The frames in which somebody is; the dump is opened when the first is asked for."""
    trajectory = open_bodies(dump, unit=unit).trajectory
    for number in np.flatnonzero(trajectory.index.counts):
        yield snapshot_of(trajectory[number], dump, needs_velocity=False)


def setting_beside(
    dump: Path, room: Path | None = None, unit: str | None = None, **given: Any
) -> Setting:
    """Take walls and drive of `room_beside`, which says what is raised."""
    return room_beside(dump, room, unit, **given)[1]


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
