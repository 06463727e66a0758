"""A scene: what a crowd is, as data. One TOML file and one LAMMPS data file with the initial
state."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
import tomli_w
from pydantic import ConfigDict, Field, Strict, ValidationError

from analysis.scene.anthropometry import bodies_of, separated
from analysis.scene.distance import Distance
from analysis.scene.drive import NAMING, Drive
from analysis.scene.fields import FileName, Means, Schema
from analysis.scene.lammps_data import read_data, write_data, written_mass
from analysis.scene.law import LAWS
from analysis.scene.placement import check_room
from analysis.scene.rigid_bodies import people_of, read_bodies, write_bodies
from analysis.scene.schema import ContactModel, OtherFrames, Reconciliation, Room, Run, Wall
from analysis.support.files import or_shipped, shipped, write_text
from analysis.support.reading import UnreadableError, note, read_text
from nscd import Snapshot
from nscd.contacts import connected
from nscd.stepping import StepError

__all__ = [
    "ContactModel", "Drive", "Room", "Run", "Scene", "SceneError", "Wall",
    "read_room", "read_scene", "scene_names",
]  # fmt: skip


# m: kept from corners on a way that nobody asked for.
CLEARANCE_M = 0.15
# Of a scene file, in their order.
TABLES = ("drive", "body_force", "contact", "run", "analysis", "reconciliation")

# Stands for the tables and keys of a room file that only a run needs, where they are missing.
FOR_RUNS: dict[str, Any] = {
    "title": "",
    "source": "",
    "contact": {"stiffness_N_per_m": 1.0, "restitution": 0.0},
    "run": {"duration_s": 1.0, "frames": 1},
    "analysis": {"kind": "driven"},
}


class SceneError(ValueError):
    """Refuse a scene that cannot be simulated; the message names the file and the field or disk."""


class _Disks(Schema):
    data: FileName
    bodies: FileName | None = None
    people: Literal["ANSUR II", "ANSUR II men", "ANSUR II women"] | None = None
    people_seed: Annotated[int, Strict(), Field(ge=0)] = 1


class SceneFile(Room):
    """Hold what a scene file says: a room, which files have its disks, and where these come from."""

    disks: _Disks
    reconciliation: Reconciliation | None = None
    other_frames: OtherFrames | None = None


class Scene(Room):
    """Hold a whole scene: a room with its crowd.

    name: of its files
    notes: the comment at the head of the file
    snapshot: the initial state
    reconciliation: how the heads of a real crowd became disks
    other_frames, other_crowds: which other frames of its film became crowds, and these"""

    model_config = ConfigDict(arbitrary_types_allowed=True)

    name: FileName
    notes: str = ""
    snapshot: Snapshot
    reconciliation: Reconciliation | None = None
    other_frames: OtherFrames | None = None
    other_crowds: tuple[Snapshot, ...] = ()

    def __repr__(self) -> str:
        return f"<Scene {self.name}: {len(self.snapshot)} disks, {self._shown()}>"

    @classmethod
    def of(cls, room: Room, **rest: Any) -> Scene:
        """Put a crowd into a room. Raises SceneError naming the field."""
        try:
            scene = cls(**{key: getattr(room, key) for key in Room.model_fields}, **rest)
        except ValidationError as error:
            raise SceneError(first_problem(error)) from None
        return scene.rerouted()

    def rerouted(self) -> Scene:
        """Return the scene with the ways of its people between its walls, where its drive has a
        clearance or they keep their distance, and somebody is there."""
        if self.drive is None or not len(self.snapshot):
            return self
        radius = float(self.snapshot.radius.max())
        return self.model_copy(update={"drive": self.drive.routed(self.wall_segments(), radius)})

    @property
    def hidden(self) -> int:
        """Count the people who have a wall on the straight line to their door."""
        if self.drive is None or not all(exit_.has_door for exit_ in self.drive.doors):
            return 0
        return int(self.drive.hidden(self.wall_segments(), self.snapshot).sum())

    def round_walls(self) -> Scene:
        """Return the scene with a way, and notes that say so, where somebody's door is behind a wall."""
        if self.drive is None or self.drive.clearance_m is not None or not self.hidden:
            return self
        drive = self.drive.model_copy(update={"clearance_m": CLEARANCE_M})
        message = f"{self.hidden} of them have a wall between them and the door, and walk round it."
        notes = f"{self.notes}\n{message}".strip()
        return self.model_copy(update={"drive": drive, "notes": notes}).rerouted()

    @property
    def push_range(self) -> tuple[float, float]:
        """Give the least and the largest force (N) with which a person pushes; 0 without a drive."""
        people, push = self.people, np.zeros(1)
        if self.drive:
            push = self.drive.push(people.mass)
            push = push * (self.drive.push_shares(people.ids) if self.drive.keeps_distance else 1.0)
        return float(push.min()), float(push.max())

    @property
    def mean_push(self) -> float:
        """Give the mean force (N) with which people push who push all they can; 0 without a drive."""
        return self.drive.push(float(self.people.mass.mean())) if self.drive else 0.0

    @property
    def people(self) -> Snapshot:
        """Give its people as one disk each, see `people_of`."""
        return people_of(self.snapshot)[0]

    def with_contact(self, **changes: object) -> Scene:
        """Return the scene with some keys of its contact model changed; the laws of a body bring
        their stiffness. Raises SceneError naming the key."""
        law = LAWS.get(str(changes.get("law")))
        if law is not None and law.own_stiffness:
            own: dict[str, object] = {"stiffness_N_per_m": None, "wall_stiffness_N_per_m": None}
            changes = own | changes
        return self._with("contact", changes)

    def with_run(self, **changes: object) -> Scene:
        """Return the scene with some keys of its run changed. Raises SceneError naming the key."""
        return self._with("run", changes)

    def with_drive(self, **changes: object) -> Scene:
        """Return the driven scene with fields of its drive changed, not checked, and ways found again."""
        assert self.drive is not None
        return self.model_copy(update={"drive": self.drive.model_copy(update=changes)}).rerouted()

    def _with(self, name: str, changes: dict[str, object]) -> Scene:
        old: Schema = getattr(self, name)
        try:
            new = type(old).model_validate(old.model_dump() | changes)
        except ValidationError as error:
            raise SceneError(f"{self.name}: {name}.{first_problem(error)}") from None
        return self.model_copy(update={name: new})

    def check_plain(self, what: str) -> None:
        """Raise ValueError naming the field where contacts rub, a body force acts or arms push; `what`
        is not for such scenes."""
        if self.contact.friction:
            raise ValueError(
                f"scene {self.name}: contact.friction: {self.contact.friction:g}, but "
                f"{what} for frictionless contacts"
            )
        for name, found in (
            ("body_force", self.body_force),
            ("contact.arm_reach_m", self.contact.arms),
            ("disks.bodies", self.snapshot.bodies),
            ("walls.mass_kg", self.giving()),
            ("period_x_m", self.period_x_m),
            ("drive.stops", self.drive and self.drive.stops),
            ("drive.time_gap_s", self.drive and self.drive.keeps_distance),
            (
                "drive.outward without a door",
                self.drive and len(self.drive.gates) < len(self.drive.doors),
            ),
        ):
            if found:
                raise ValueError(f"scene {self.name}: {name}: {what} for scenes without")

    def check(self, origin: str) -> list[str]:
        """Raise SceneError for a scene that cannot be simulated; return warnings (a door narrower
        than a disk).

        `origin` names the file in the message."""
        if len({w.name for w in self.walls}) < len(self.walls):
            raise SceneError(f"{origin}: walls: two walls have the same name")
        if self.contact.arms and self.snapshot.bodies is not None:
            raise SceneError(f"{origin}: contact.arm_reach_m: only for people of one disk each")
        for name in NAMING if self.drive else ():
            for number, part in enumerate(getattr(self.drive, name), start=1):
                mine = part.of(self.snapshot.ids)
                if (compound := self.snapshot.compound) is not None:
                    cut = np.intersect1d(compound.number[mine], compound.number[~mine])
                    if len(cut):
                        raise SceneError(
                            f"{origin}: drive.{name}: number {number}: `people` has some disks of "
                            f"body {compound.ids[cut[0]]}, and not all"
                        )
        self._check_giving(origin)
        try:
            self.check_period(self.snapshot)
            warnings = check_room(self.snapshot, self.wall_segments(), self.door())
            if self.drive:
                self.drive.check_people([self.snapshot.ids])
                self.drive.check_way(self.wall_segments(), self.snapshot)
            return warnings
        except ValueError as error:
            raise SceneError(f"{origin}: {error}") from None

    def _check_giving(self, origin: str) -> None:
        """Refuse a wall that gives and meets others, and one with arms or a crowd to the other side."""
        meeting = connected(self.wall_segments())
        for number, wall in ((n, one) for n, one in enumerate(self.walls) if one.oscillator):
            others = np.delete(meeting.vertex, number, axis=0)
            met = np.isin(meeting.vertex[number], others).any() or meeting.inner[number].any()
            why = ": not with contact.arm_reach_m" if self.contact.arms else ""
            why = " and meets another wall: end it 1 mm before that" if met else why
            if why:
                raise SceneError(f"{origin}: walls.{number}: {wall.name} gives (mass_kg){why}")

    def content(self) -> dict[str, Any]:
        """Return what the scene file says, but for the name of its data file."""
        walls = [wall.model_dump(exclude_none=True) for wall in self.walls]
        tables = {key: getattr(self, key) for key in TABLES}
        return (
            {"title": self.title, "source": self.source}
            | ({"period_x_m": self.period_x_m} if self.period_x_m else {})
            | ({"walls": walls} if walls else {})
            | {key: _entries(table) for key, table in tables.items() if table}
        )

    def to_toml(self) -> str:
        """Write out the text of the scene file; its disks are in `<name>.data` beside it."""
        content = self.content()
        if self.other_frames:
            content["other_frames"] = _entries(self.other_frames.of(self.name))
        tops = ("title", "source", "period_x_m")
        head = {key: content.pop(key) for key in tops if key in content}
        comment = "".join(f"# {line}".rstrip() + "\n" for line in self.notes.splitlines())
        disks = {"data": f"{self.name}.data"}
        if self.snapshot.bodies is not None:
            disks["bodies"] = f"{self.name}.bodies"
        # points read better on one line
        text = re.sub(
            r"\[\n\s+([^\[\]]+?),\n\]",
            lambda m: "[" + re.sub(r",\s+", ", ", m[1]) + "]",
            tomli_w.dumps(head | {"disks": disks} | content),
        )
        return comment + "\n" + text

    def write(self, folder: Path) -> Path:
        """Write `<name>.toml` and `<name>.data` into the folder, `<name>.way` where people walk a way,
        and a data file of each other frame; return the path of the first."""
        folder.mkdir(parents=True, exist_ok=True)
        if self.other_frames:
            files = self.other_frames.of(self.name).data
            for file, crowd in zip(files, self.other_crowds, strict=True):
                write_data(folder / file, crowd, self.title)
        arms = self.contact.arms is not None
        write_data(folder / f"{self.name}.data", self.snapshot, self.title, by_radius=arms)
        if self.drive and self.drive.way:
            way = self.drive.way.to_json(self.wall_segments())
            write_text(folder / f"{self.name}.way", way)
        if self.snapshot.bodies is not None:
            write_bodies(folder / f"{self.name}.bodies", self.snapshot)
        write_text(folder / f"{self.name}.toml", self.to_toml())
        return folder / f"{self.name}.toml"

    def digest(self) -> str:
        """Compute the SHA-256 of all that the files of the scene say, but for its name, its notes
        and other frames."""
        disks = self.snapshot
        arrays = (disks.position, disks.velocity, disks.radius, written_mass(disks))
        state = hashlib.sha256(json.dumps(self.content(), sort_keys=True).encode())
        of = disks.bodies
        joined = () if of is None else (of.number, of.inertia)
        for array in (*arrays, *joined, disks.spin, disks.ids):
            state.update(array.tobytes())
        return state.hexdigest()


def _entries(part: Schema) -> dict[str, Any]:
    """What a table of a scene file says: keys that have something to say."""
    stated = {key: value for key, value in part.model_dump(exclude_none=True).items() if value != ()}
    if isinstance(part, Drive):
        if not part.keeps_distance:
            stated = {key: value for key, value in stated.items() if key not in Distance.model_fields}
        for exit_, table in zip(part.doors, (stated, *stated.get("goals", ())), strict=True):
            for key in () if exit_.has_door else ("door_start_m", "door_end_m"):
                del table[key]
    return stated


def scene_names() -> list[str]:
    """List the names of the product's own scenes."""
    return sorted(path.stem for path in shipped("scenes").glob("*.toml"))


def is_shipped(scene: Scene) -> bool:
    """Tell whether a scene is one of the product's own, of any size."""
    path = shipped("scenes") / f"{scene.name}.toml"
    return path.exists() and _read_toml(path)[0].get("source") == scene.source


def read_scene(name_or_path: str | Path) -> Scene:
    """Read a scene by its name (`arch`) or the path of its TOML file.

    Raises SceneError naming the file and the key for anything that is unknown, missing, out of
    range or impossible to simulate (overlapping disks, a disk outside the walls).

    >>> scene = read_scene("pair")
    >>> scene.title, len(scene.snapshot), scene.analysis.kind
    ('Two disks, head-on', 2, 'impact')
    """
    path = _path_of(name_or_path)
    content, notes = _read_toml(path)
    stated = _validated(path, content, SceneFile, lambda: means_of(_bodies(path, content)))
    try:
        snapshot = _bodies(path, content)
        others = stated.other_frames
        crowds = tuple(read_data(path.parent / name) for name in others.data) if others else ()
    except ValueError as error:
        raise SceneError(str(error)) from None
    of = stated.reconciliation
    if of and of.people != len(snapshot):
        raise SceneError(
            f"{path}: reconciliation.people: {of.people}, but {stated.disks.data} has {len(snapshot)}"
        )
    if stated.disks.people:
        try:
            snapshot = separated(snapshot, stated.wall_segments())
        except (StepError, ValueError) as error:
            raise SceneError(f"{path}: disks.people: they do not fit: {error}") from None
    more = {"reconciliation": stated.reconciliation, "other_frames": others, "other_crowds": crowds}
    scene = Scene.of(stated, name=path.stem, notes=notes, snapshot=snapshot, **more)
    scene.check(str(path))
    return scene


def _path_of(name_or_path: str | Path) -> Path:
    path = Path(name_or_path)
    if path.suffix == ".toml":
        return or_shipped(path)
    path = shipped("scenes") / f"{name_or_path}.toml"
    if not path.exists():
        raise SceneError(
            f"unknown scene {str(name_or_path)!r}. There are: {', '.join(scene_names())}, or a "
            ".toml file"
        )
    return path


def read_room(
    name_or_path: str | Path,
    means: Means | Callable[[], Means | None] | None = None,
    *,
    complete: bool = True,
) -> tuple[Room, str]:
    """Read a room (a scene file with or without disks) and the comment at its head; means: radius
    (m) and mass (kg) of the disks to come, or what gives them, asked only where Young's modulus or a
    push stands in it; complete: whether it must also have what only a run needs.

    Raises SceneError naming the file and the key for anything unknown, missing or out of range."""
    path = _path_of(name_or_path)
    content, notes = _read_toml(path)
    if not complete:
        for key, table in content.items():
            if isinstance(table, dict) and key in FOR_RUNS:
                own = {"law", "young_modulus_Pa"} & table.keys()  # a stiffness may be of these
                content[key] = ({"restitution": 0.0} if own else FOR_RUNS[key]) | table
        content = FOR_RUNS | content
    if "disks" in content:
        return _validated(path, content, SceneFile, lambda: means_of(_bodies(path, content))), notes
    return _validated(path, content, Room, means if callable(means) else lambda: means), notes


def _bodies(path: Path, content: dict[str, Any]) -> Snapshot:
    """The disks of a scene file, with the bodies of people where it asks for them, and not yet
    pushed apart."""
    disks = _Disks.model_validate(content.get("disks"))
    inputs = read_data(path.parent / disks.data)
    if disks.people is None and "people_seed" in disks.model_fields_set:
        raise ValueError(f"{path}: disks.people_seed: only with people, whose sizes it draws")
    if (inputs.bodies is None) != (disks.bodies is None):
        raise ValueError(
            f"{path}: disks.bodies: goes with the section Molecules of {disks.data}. Both are needed"
        )
    if disks.bodies:
        if disks.people:
            raise ValueError(
                f"{path}: disks.people: bodies of several disks have sizes of their own"
            )
        return read_bodies(path.parent / disks.bodies, inputs)
    if disks.people is None:
        return inputs
    radius, mass = bodies_of(disks.people, len(inputs), disks.people_seed)
    return dataclasses.replace(inputs, radius=radius, mass=mass)


def means_of(snapshot: Snapshot) -> Means:
    """Give the mean radius (m) and mass (kg) of disks."""
    return float(snapshot.radius.mean()), float(snapshot.mass.mean())


def _read_toml(path: Path) -> tuple[dict[str, Any], str]:
    """The content of a TOML file and the comment at its head. Raises SceneError."""
    try:
        text = read_text(path)
        head = (line for line in text.split("\n\n")[0].splitlines() if line.startswith("#"))
        return tomllib.loads(text), "\n".join(line[1:].strip() for line in head)
    except UnreadableError as error:
        raise SceneError(str(error)) from None
    except (ValueError, RecursionError) as error:
        raise SceneError(f"{path}: {error}") from None


def file_content(name_or_path: str | Path) -> tuple[Path, dict[str, Any]]:
    """Give the path of a scene or room file and what it states. Raises SceneError."""
    path = _path_of(name_or_path)
    return path, _read_toml(path)[0]


AnyRoom = TypeVar("AnyRoom", bound=Room)


# Time gaps (s) below their τ (s) that were said once: runs read their copies of a scene.
NOTED = set[tuple[float, float]]()


def _validated(
    path: Path, content: dict[str, Any], kind: type[AnyRoom], means: Callable[[], Means | None]
) -> AnyRoom:
    """Make the content of a file a room or a scene; means are asked for only where Young's modulus
    or a push is given."""
    try:
        made = kind.model_validate(content, context={"means": means})
    except ValidationError as error:
        raise SceneError(f"{path}: {first_problem(error)}") from None
    gap, tau = (made.drive.time_gap_s, made.drive.relaxation_time_s) if made.drive else (None, 0.0)
    if gap and gap < tau and (gap, tau) not in NOTED:
        NOTED.add((gap, tau))
        message = f"{gap:g} s, below relaxation_time_s of {tau:g} s: people walk to and fro"
        note(path, f"drive.time_gap_s: {message}")
    return made


def first_problem(error: ValidationError) -> str:
    """Name the first thing that is wrong with a file, by its key; of what is missing, all."""
    problems = error.errors()
    too_many = ("extra_forbidden", "unexpected_keyword_argument")
    unknown = [problem for problem in problems if problem["type"] in too_many]
    first = (unknown or problems)[0]
    alike = [one for one in problems if one["type"] == "missing" == first["type"]] or [first]
    where = ", ".join(".".join(map(str, one["loc"])) for one in alike)
    message = "unknown key" if unknown else first["msg"].removeprefix("Value error, ")
    # pydantic writes bounds as whole numbers
    message = re.sub(r"\b10{9,}\b", lambda found: f"{float(found[0]):g}", message)
    return f"{where}: {message}" if where else message
