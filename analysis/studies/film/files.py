"""Runs, and files that are none of an engine here: a dump of disks, or a trajectory of heads. The
percussions of their frames, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from analysis.compare.comparison import OpenRun, match_contacts
from analysis.dumps import DumpError, EngineContacts, open_bodies
from analysis.dumps.find_frames import is_binary
from analysis.dumps.listed_contacts import ListedContacts
from analysis.dumps.open_dump import RECORD
from analysis.dumps.windows import Window
from analysis.engines.record import RunRecord
from analysis.engines.rigid import NAME as RIGID_ENGINE
from analysis.percussions.listed_contacts import open_listed_contacts
from analysis.percussions.setting import FORCE, Setting, room_beside
from analysis.percussions.snapshot import SnapshotPercussions, percussions_of, percussions_of_frames
from analysis.percussions.solve_dump import STATED
from analysis.scene.floor_files import NoFloorError, read_floor, walled
from analysis.scene.real.import_crowd import ImportedCrowd, place_crowd, who_is_inside
from analysis.scene.real.separate import OverlapError
from analysis.scene.real.trajectory import Recording, TrajectoryError
from analysis.scene.scene import FOR_RUNS, Room, Scene, SceneError, read_room
from analysis.scene.schema import Wall
from analysis.scene.unused import CROWD, note_unused_keys
from analysis.scene.waiting import Doorway
from analysis.studies.film.frame import NOBODY, OWN, RIGID, FrameRange, window_of
from analysis.support.reading import note, start_of
from nscd import Snapshot
from nscd.arrays import Indices

RADIUS_M, MASS_KG = 0.18, 75.0
# The residual that the percussions of a run must reach.
TOLERANCE = 1e-10
# Frames of two files this near (s) are at one instant; of trajectories, whose times have few digits,
# those this near as a share of their step.
SAME_S, SAME_SHARE = 1e-6, 0.01
# No disks of people are faster.
FASTEST_M_PER_S = 20.0
NO_FORCES = "its percussions are impulses (N·s) of measured velocities, no forces. Give --room with a [drive]"


@dataclass(frozen=True, slots=True, kw_only=True)
class FileOptions:
    """Say of a file what it does not: which frames, its room (TOML), own contact forces, the names
    of their columns and N for 1 of them, radius (m) and mass (kg) of heads, unit of lengths, frames per second and columns of
    heads, unit of their times, whether they are taken whatever they look like, and of a dump its time
    step (s), unit of masses, types of disks that do not move, and how those of one mol move."""

    frames: str | None = None
    room: Path | None = None
    contacts: Path | None = None
    contacts_columns: str | None = None
    contacts_factor: float | None = None
    radius: float | None = None
    mass: float | None = None
    unit: Any = None
    frame_rate: float | None = None
    columns: str | None = None
    time_unit: Any = None
    take_as_is: bool | None = None
    time_step: float | None = None
    mass_unit: Any = None
    fixed_type: tuple[int, ...] = ()
    mol: Any = None

    def refuse(self, why: str, *names: str) -> None:
        """Raise ValueError for the first of these fields (all where left out) that is given."""
        for name in names or [one.name for one in fields(self)]:
            if getattr(self, name) not in (None, ()):
                raise ValueError(f"--{name.replace('_', '-')}: {why}")


class FileFrame(NamedTuple):
    """Hold a frame: its percussions, and of a dump its own contacts, of heads the crowd that they
    became; or the reason why there are none."""

    number: int
    time: float  # s
    found: SnapshotPercussions | None = None
    own: EngineContacts | None = None
    crowd: ImportedCrowd | None = None
    reason: str = ""

    def window(self, file: Path, model: str) -> Window:
        """Take the forces (N) of a model as a window of one second.

        Raises ValueError naming the frame for percussions that are none, not solved or no forces."""
        found, where = self.found, f"{file}, frame {self.number}, {self.time:g} s"
        if found is None:
            raise ValueError(f"{where}: {self.reason}")
        if model == RIGID and found.unit != FORCE:
            raise ValueError(f"{file}: {NO_FORCES}")
        if model == RIGID and found.solution.status != "solved":
            raise ValueError(f"{where}: {found.solution.status}: {found.solution.reason}")
        match = match_contacts(found, self.own or NOBODY, np.zeros(len(found.contacts), dtype=bool))
        return window_of(match, found.snapshot, model)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrameFile:
    """Hold an opened file.

    scene: its room, with nobody in it; numbers: of its frames, growing
    solve: solves frames by their numbers, one after the other
    engine: of its own contact forces: OWN, or the one that ran it; nothing where it has none
    recording: of heads; measured: whether the left velocity is theirs, else they want to go
    lacks_walls: whether its own contact forces are those of pairs alone
    about: how heads look, in a line"""

    file: Path
    scene: Scene
    numbers: Sequence[int] | Indices
    solve: Callable[[Iterable[int]], Iterator[FileFrame]]
    engine: str = ""
    recording: Recording | None = None
    measured: bool = False
    lacks_walls: bool = False
    about: str = ""

    @property
    def same_s(self) -> float:
        """The time (s) within which a frame of another file is at the instant of one of these."""
        return max(SAME_S, SAME_SHARE * self.recording.step_s if self.recording else 0.0)

    def frames(self, text: str | None) -> Iterator[FileFrame]:
        """Solve the frames of `first:last:step`, all of them where left out."""
        return self.solve(FrameRange.parse(text or "::1").of(self.numbers, self.file))


def open_any(file: Path, file_options: FileOptions) -> FrameFile:
    """Open a file by its first bytes: a dump of LAMMPS, text or binary, or else a trajectory.

    Raises DumpError, TrajectoryError, SceneError and ValueError naming the file and the column, key or
    option."""
    start = start_of(file, 16)
    if start.startswith(b"ITEM:") or is_binary(start):
        headers = ("radius", "mass", "frame_rate", "columns", "time_unit", "take_as_is")
        file_options.refuse(f"of heads. The disks of {file} have theirs", *headers)
        return _of_disks(file, file_options)
    of_dump = ("time_step", "contacts", "contacts_columns", "contacts_factor", "mass_unit", "fixed_type", "mol")
    file_options.refuse(f"of a dump. {file} is a trajectory", *of_dump)
    if file_options.unit == "mm":
        raise ValueError(f"--unit mm: {file} is a trajectory. Give m or cm")
    stated = ("unit", "frame_rate", "columns", "time_unit", "take_as_is")
    selected = {name: one for name in stated if (one := getattr(file_options, name)) is not None}
    recording = Recording.read(file, **selected)
    opened = of_heads(recording, file_options)
    note(file, opened.about)
    if file_options.room:
        kind = "dump" if opened.measured else "desired"
        note_unused_keys(file_options.room, f"left velocity {kind}", CROWD)
    return opened


def _of_disks(file: Path, file_options: FileOptions) -> FrameFile:
    """A dump of disks, with its own contacts where there are some beside it."""
    stated = {name: getattr(file_options, name) for name in STATED}
    trajectory = open_bodies(file, **stated).trajectory
    room, setting = room_beside(file, file_options.room, stated)
    setting, room = setting.of_dump(trajectory), room or bare(file)
    scene = empty(_with_standing(room, setting), "dump")
    name = "contacts.dump" if file.name == "bodies.dump" else f"{file.stem}_contacts.dump"
    beside = file.with_name(name)
    contacts = file_options.contacts or (beside if beside.is_file() else None)
    if contacts is not None and file_options.unit not in (None, "m"):
        raise DumpError(f"{contacts}: --unit {file_options.unit}: own forces are read in N and m only")
    own = None
    if contacts is None:
        file_options.refuse(f"there are no contacts of {file}. Give --contacts", "contacts_columns", "contacts_factor")
    else:
        own = listed_contacts(trajectory, contacts, room, setting, file_options.contacts_columns, file_options.contacts_factor)
    if np.isnan(trajectory[0].time):
        raise DumpError(f"{file}: its frames have no times. Give --time-step")

    solve, numbers = _of_frames(trajectory, file, setting, own), range(int(trajectory.n_frames))
    found = FrameFile(file=file, scene=scene, numbers=numbers, solve=solve)
    return replace(found, engine=OWN, lacks_walls=own.lacks_walls) if own else found


def listed_contacts(
    trajectory: Any, contacts: Path, room: Room | None, setting: Setting, columns: str | None, factor: float | None
) -> ListedContacts:
    """Open the contacts that came with a dump of disks in a room, see `open_listed_contacts`."""
    scene, geometry = empty(room or bare(trajectory.filename), "dump"), not _is_rigid(contacts)
    return open_listed_contacts(trajectory, contacts, scene, setting, columns=columns, factor=factor, geometry=geometry)


def _is_rigid(contacts: Path) -> bool:
    """Whether contacts are beside the record of a rigid run: means since the frame before."""
    record = contacts.parent / RECORD
    return record.exists() and RunRecord.read(contacts.parent).engine == RIGID_ENGINE


def of_run(folder: Path) -> FrameFile:
    """Take a finished run. Raises EngineError and DumpError for a folder without one of its scene."""
    run = OpenRun.of(folder)
    scene, trajectory = run.scene, run.universe.trajectory
    own = ListedContacts(run.index, scene, False)
    inputs = trajectory, folder / "bodies.dump", Setting.of(scene), own
    numbers, engine = range(len(run.index.frames)), run.record.engine
    solve = _of_frames(*inputs, tolerance=TOLERANCE)
    return FrameFile(file=folder, scene=scene, numbers=numbers, solve=solve, engine=engine)


def _of_frames(
    trajectory: Any, file: Path, setting: Setting, contacts: ListedContacts | None, **how: Any
) -> Callable[[Iterable[int]], Iterator[FileFrame]]:
    """What solves frames of a dump, with its own contacts where there are some; how: tolerance of the
    percussions."""

    def solve(numbers: Iterable[int]) -> Iterator[FileFrame]:
        maximum = FASTEST_M_PER_S
        for number, found in percussions_of_frames(trajectory, numbers, setting, **how):
            now = found.snapshot
            if (fast := np.hypot(*now.velocity.T).max(initial=0.0)) > maximum:
                note(file, f"frame {number}: disks are as fast as {fast:.3g} m/s, people are not")
                maximum = np.inf
            own = contacts.at(trajectory.ts, now) if contacts else None
            yield FileFrame(number, float(now.time), found, own)

    return solve


def of_heads(recording: Recording, file_options: FileOptions) -> FrameFile:
    """Take a trajectory. In each frame people are moved apart from where the frame before left them. A
    frame where they cannot be has a reason instead; one with nobody inside has no forces.

    Raises TrajectoryError where nobody is inside in any frame."""
    file, radius, mass = recording.file, file_options.radius or RADIUS_M, file_options.mass or MASS_KG
    room, name = bare(file), "trajectory"
    if file_options.room is not None:
        room, name = read_room(file_options.room, (radius, mass), complete=False)[0], file_options.room.stem
    if not room.walls:
        room = _with_walls_inside(room, file, needed=file_options.room is None)
    shift = max(0, 1 - int(recording.data.id.min()))  # ids of disks begin at 1
    if room.drive:
        ids = recording.data.id.to_numpy()
        room.drive.check_people([ids], f"{file_options.room}: ", f" in {file}")
        room = room.model_copy(update={"drive": room.drive.shifted(shift)})
    scene, origin = empty(room, name), str(file_options.room or file)
    kind = Setting.in_room(room).kind
    measured = kind == "dump"
    # velocities only where they count: who is held has none, and sees where to walk
    read = recording.head_positions if measured else recording.still
    occupied, about = who_is_inside(recording, scene, origin)

    def solve(numbers: Iterable[int]) -> Iterator[FileFrame]:
        crowd: ImportedCrowd | None = None
        found: SnapshotPercussions | None = None
        for number in numbers:
            time = recording.time_of(number)
            if number not in occupied:
                crowd, setting = None, Setting.in_room(scene, left_velocity=kind)
                found = percussions_of(setting, replace(scene.snapshot, time=time))
                yield FileFrame(number, time, found)
                continue
            try:
                tracked = read(number)
                tracked = replace(tracked, ids=tracked.ids + shift)
                crowd = place_crowd(
                    tracked, radius=radius, room=scene, origin=origin, mass=mass, before=crowd
                )
            except (OverlapError, SceneError, TrajectoryError) as error:
                yield FileFrame(number, time, reason=str(error))
                continue
            setting = Setting.in_room(crowd.scene, left_velocity=kind)
            found = percussions_of(setting, replace(crowd.scene.snapshot, time=time), before=found)
            yield FileFrame(number, time, found, crowd=crowd)

    opened = FrameFile(file=file, scene=scene, numbers=recording.numbers, solve=solve, about=about)
    return replace(opened, recording=recording, measured=measured)


def _with_walls_inside(room: Room, file: Path, *, needed: bool) -> Room:
    """The room with the walls that a trajectory holds, less the doors of the room. Raises SceneError
    where it holds none and they are `needed`, and for a door that is not on its outline."""
    try:
        if file.suffix not in (".sqlite", ".h5", ".hdf5"):
            raise NoFloorError(f"{file}: it holds no walls")
        polygon = read_floor(file).polygon
    except NoFloorError as error:
        if needed:
            raise SceneError(f"{error}. Give --room, a TOML file with walls and a drive") from None
        return room
    doors = [Doorway(ends=one.door) for one in room.drive.doors] if room.drive else []
    try:
        return room.model_copy(update={"walls": walled(polygon, doors)[0]})
    except SceneError as error:
        raise SceneError(f"{file}: {error}") from None


def bare(file: Path) -> Room:
    """A room without walls and drive."""
    return Room.model_validate(FOR_RUNS | {"title": file.name})


def _with_standing(room: Room, setting: Setting) -> Room:
    """The room with disks that do not move as walls behind the others, by which they are named and
    drawn: their diameters."""
    walls, fixed = [*room.walls], setting.fixed_disks
    names = setting.wall_names[len(walls) :]
    for name, (x, y), r in zip(names, fixed.position, fixed.radius, strict=True) if fixed else ():
        walls.append(
            Wall(name=name, start_m=(float(x - r), float(y)), end_m=(float(x + r), float(y)))
        )
    return room.model_copy(update={"walls": tuple(walls)})


def empty(parts: Room, name: str) -> Scene:
    """The room as a scene with nobody in it."""
    nobody = Snapshot(position=np.zeros((0, 2)), radius=np.zeros(0), mass=np.zeros(0))
    return Scene.of(parts, name=name, snapshot=nobody)


def paired(
    first: Iterator[FileFrame], second: Iterator[FileFrame], same_s: float = SAME_S
) -> Iterator[tuple[FileFrame, FileFrame]]:
    """Pair the frames of two files that are at one instant, within same_s."""
    one, other = next(first, None), next(second, None)
    while one and other:
        difference = one.time - other.time
        if abs(difference) <= same_s:
            yield one, other
        if difference <= same_s:
            one = next(first, None)
        if difference >= -same_s:
            other = next(second, None)
