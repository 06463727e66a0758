"""A scene: what a crowd is, as data. One TOML file and one LAMMPS data file with the initial
state."""

from __future__ import annotations

import hashlib
import re
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tomli_w
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from analysis.scene.account import Reconciliation
from analysis.scene.lammps_data import read_data, write_data
from analysis.scene.placement import check_room
from analysis.support.files import write_text
from analysis.support.shipped import shipped
from nscd import Snapshot, Walls
from nscd.segments import nearest_on_segment

Point = tuple[float, float]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class SceneError(ValueError):
    """A scene that cannot be simulated; the message names the file and the field or disk."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Wall(_Part):
    """A straight wall from start_m to end_m; `name` is a word of letters, digits and
    underscores."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z]\w*$")]
    start_m: Point
    end_m: Point


class Drive(_Part):
    """Desired-velocity drive m(u_d − u)/τ: u_d points to the nearest point of the door (or to its
    centre), and along `outward` for those who have passed the line of the door."""

    speed_m_per_s: Positive
    relaxation_time_s: Positive
    door_start_m: Point
    door_end_m: Point
    outward: Point
    aim: Literal["nearest", "centre"] = "nearest"

    @model_validator(mode="after")
    def _unit_outward(self) -> Drive:
        if abs(np.hypot(*self.outward) - 1) > 1e-9:
            raise ValueError("outward must be a unit vector")
        if self.door_start_m == self.door_end_m:
            raise ValueError("door_start_m and door_end_m are the same point")
        return self

    def target(self) -> tuple[Point, Point]:
        """The segment whose nearest point people walk to (m): the door, or its centre twice."""
        if self.aim == "nearest":
            return self.door_start_m, self.door_end_m
        (x0, y0), (x1, y1) = self.door_start_m, self.door_end_m
        centre = (0.5 * (x0 + x1), 0.5 * (y0 + y1))
        return centre, centre

    def desired_velocity(self, position: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        """u_d of disks at position (n,2) m, in m/s, shape (n,2)."""
        start, end = (np.array(point) for point in self.target())
        outward = np.array(self.outward)
        to_door = nearest_on_segment(position, start, end) - position
        distance = np.hypot(*to_door.T)
        gone = ((position - np.array(self.door_start_m)) @ outward >= 0) | (distance == 0)
        direction = to_door / np.where(distance > 0, distance, 1.0)[:, None]
        return np.asarray(self.speed_m_per_s * np.where(gone[:, None], outward, direction))


class ContactModel(_Part):
    """The penalty law: repulsion k·overlap (hooke) or K·overlap^1.5 (hertz), a dashpot for the
    asked restitution, and Coulomb friction with a tangential spring of stiffness
    tangential_ratio·k."""

    law: Literal["hooke", "hertz"] = "hooke"
    stiffness_N_per_m: Positive  # noqa: N815  (the unit is newton)
    restitution: Annotated[float, Field(ge=0, le=1)]
    friction: Annotated[float, Field(ge=0)] = 0.0
    tangential_ratio: Positive = 2 / 7


class Run(_Part):
    """How long to simulate and how often to write; the time step follows from the stiffness unless
    given."""

    duration_s: Positive
    frames: Annotated[int, Field(ge=1)]
    time_step_s: Positive | None = None
    drive_interval_steps: Annotated[int, Field(ge=1)] = 10


class Analysis(_Part):
    """Which percussions are compared with which forces: `driven`: p/τ with the force at time_s;
    `impact`: p of the initial state with ∫f dt over the run."""

    kind: Literal["driven", "impact"]
    time_s: Annotated[float, Field(ge=0)] = 0.0
    contact_tolerance_m: Positive = 1e-6


class Room(_Part):
    """A scene without its disks: what `percussions import` puts a crowd into."""

    title: str
    source: str
    walls: list[Wall] = []
    drive: Drive | None = None
    contact: ContactModel
    run: Run
    analysis: Analysis


class _SceneFile(Room):
    disks: dict[Literal["data"], str]
    reconciliation: Reconciliation | None = None


class Scene(_Part):
    """A whole scene. `snapshot` is its initial state; `notes` the comment at the head of the
    file."""

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True)

    name: str
    title: str
    source: str
    notes: str = ""
    snapshot: Snapshot
    walls: tuple[Wall, ...] = ()
    drive: Drive | None = None
    contact: ContactModel
    run: Run
    analysis: Analysis
    reconciliation: Reconciliation | None = None

    def wall_segments(self) -> Walls:
        """The walls as nscd takes them, in the scene's order."""
        return Walls(
            start=np.array([w.start_m for w in self.walls]).reshape(-1, 2),
            end=np.array([w.end_m for w in self.walls]).reshape(-1, 2),
        )

    def with_contact(self, **changes: object) -> Scene:
        """The same scene with some keys of its contact model changed, validated."""
        contact = ContactModel.model_validate(self.contact.model_dump() | changes)
        return self.model_copy(update={"contact": contact})

    def with_run(self, **changes: object) -> Scene:
        """The same scene with some keys of its run changed, validated."""
        return self.model_copy(update={"run": Run.model_validate(self.run.model_dump() | changes)})

    def check(self, origin: str) -> list[str]:
        """Raise SceneError for a scene that cannot be simulated; return warnings (a door narrower
        than a disk).

        `origin` names the file in the message.
        """
        if len({w.name for w in self.walls}) < len(self.walls):
            raise SceneError(f"{origin}: walls: two walls have the same name")
        door = (self.drive.door_start_m, self.drive.door_end_m) if self.drive else None
        try:
            return check_room(self.snapshot, self.wall_segments(), door)
        except ValueError as error:
            raise SceneError(f"{origin}: {error}") from None

    def to_toml(self) -> str:
        """The text of the scene file; its disks are in `<name>.data` beside it."""
        content: dict[str, Any] = {
            "title": self.title,
            "source": self.source,
            "disks": {"data": f"{self.name}.data"},
        }
        if self.walls:
            content["walls"] = [wall.model_dump() for wall in self.walls]
        for part in ("drive", "contact", "run", "analysis", "reconciliation"):
            value = getattr(self, part)
            if value is not None:
                content[part] = value.model_dump(exclude_none=True)
        comment = "".join(f"# {line}".rstrip() + "\n" for line in self.notes.splitlines())
        # points read better on one line
        text = re.sub(
            r"\[\n\s+([^\[\]]+?),\n\]",
            lambda m: "[" + re.sub(r",\s+", ", ", m[1]) + "]",
            tomli_w.dumps(content),
        )
        return comment + "\n" + text

    def write(self, folder: Path) -> Path:
        """Write `<name>.toml` and `<name>.data` into the folder; return the path of the first."""
        folder.mkdir(parents=True, exist_ok=True)
        write_data(folder / f"{self.name}.data", self.snapshot, self.title)
        write_text(folder / f"{self.name}.toml", self.to_toml())
        return folder / f"{self.name}.toml"

    def digest(self) -> str:
        """SHA-256 of everything that the simulation depends on."""
        state = hashlib.sha256(self.to_toml().encode())
        for array in (
            self.snapshot.position,
            self.snapshot.velocity,
            self.snapshot.radius,
            self.snapshot.mass,
        ):
            state.update(array.tobytes())
        return state.hexdigest()


def scene_names() -> list[str]:
    """The names of the product's own scenes."""
    return sorted(path.stem for path in shipped("scenes").glob("*.toml"))


def read_scene(name_or_path: str | Path) -> Scene:
    """Read a scene by its name (`arch`) or the path of its TOML file.

    Raises SceneError naming the file and the key for anything that is unknown, missing, out of
    range or impossible to simulate (overlapping disks, a disk outside the walls)."""
    path = Path(name_or_path)
    if path.suffix != ".toml":
        path = shipped("scenes") / f"{name_or_path}.toml"
        if not path.exists():
            raise SceneError(
                f"unknown scene {str(name_or_path)!r}; there are: {', '.join(scene_names())}, or a .toml file"
            )
    try:
        text = path.read_text(encoding="utf-8")
        parts = _SceneFile.model_validate(tomllib.loads(text))
        snapshot = read_data(path.parent / parts.disks["data"])
    except FileNotFoundError as error:
        raise SceneError(f"{error.filename}: no such file") from None
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"{path}: {error}") from None
    except ValidationError as error:
        raise SceneError(f"{path}: {first_problem(error)}") from None
    except KeyError:
        raise SceneError(
            f"{path}: disks.data: missing; it names the data file with the initial state"
        ) from None
    except (ValueError, UnicodeDecodeError) as error:
        raise SceneError(str(error)) from None
    notes = head_comment(text)
    rest = {
        key: getattr(parts, key)
        for key in ("title", "source", "drive", "contact", "run", "analysis", "reconciliation")
    }
    scene = Scene(name=path.stem, notes=notes, snapshot=snapshot, walls=tuple(parts.walls), **rest)
    scene.check(str(path))
    return scene


def head_comment(text: str) -> str:
    """The comment in the first paragraph of a scene or room file, without its number signs."""
    return "\n".join(
        line[1:].strip() for line in text.split("\n\n")[0].splitlines() if line.startswith("#")
    )


def first_problem(error: ValidationError) -> str:
    """The first thing that is wrong with a file, with the key that it stands under."""
    problems = error.errors()
    unknown = [problem for problem in problems if problem["type"] == "extra_forbidden"]
    first = (unknown or problems)[0]
    where = ".".join(str(part) for part in first["loc"])
    message = "unknown key" if unknown else first["msg"].removeprefix("Value error, ")
    return f"{where}: {message}"
