"""Crowds of LEMONS: AgentDynamics.xml with Agents.xml and Geometry.xml beside it."""

import math
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import shapely

from analysis.scene.anthropometry import apart
from analysis.scene.floors import walls_between
from analysis.scene.scene import Scene, SceneError, Wall, read_room
from analysis.support.reading import UnreadableError, read_text
from nscd import Snapshot
from nscd.stepping import StepError

BODIES, ROOM = "Agents.xml", "Geometry.xml"
MOST_MASS_KG = 1000.0
# Corners of a quarter of a disk, where the area of several is measured.
CORNERS = 64


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LemonsCrowd:
    """Hold a crowd as LEMONS has it, each person one disk."""

    file: Path
    snapshot: Snapshot  # disks where LEMONS has their centres of mass; ids are LEMONS' plus one
    walls: tuple[Wall, ...]  # of Geometry.xml
    shapes: int  # how many disks each person has there

    def into(self, room: Path, name: str | None = None) -> Scene:
        """Put the crowd into the room of a TOML file, with that file's walls, or LEMONS' where it
        has none, pushed apart as little as possible where disks overlap.

        Drive and contact law are the room's: LEMONS' push is the same for everybody, its floor
        damps everybody alike, and its law is another. The notes say so. Raises SceneError for a
        crowd that does not fit."""
        disks = self.snapshot
        stated, notes = read_room(room, (float(disks.radius.mean()), float(disks.mass.mean())))
        if not stated.walls:
            stated = stated.model_copy(update={"walls": self.walls})
        try:
            moved = apart(disks, stated.wall_segments())
        except (StepError, ValueError) as error:
            raise SceneError(f"{self.file}: {error}") from None
        far = np.hypot(*(moved.position - disks.position).T)
        notes += f"""

{len(disks)} people of {self.file.name} (LEMONS), each with {self.shapes} disks there and one of the same area
here: {disks.radius.mean():.3f} m in the mean. Moved apart by {far.mean():.3f} m in the mean, {far.max():.3f} m
at most. Ids are those of LEMONS plus 1. Its pushes (Fp), floor damping, materials and orientations
are not taken. Drive and contact law are those of {room.name}."""
        scene = Scene.of(stated, name=name or room.stem, notes=notes.strip(), snapshot=moved)
        scene.check(str(self.file))
        return scene


def read_lemons(file: Path, *, one_disk: bool) -> LemonsCrowd:
    """Read AgentDynamics.xml, and Agents.xml and Geometry.xml beside it.

    one_disk: whether a person of several disks is taken as one disk of the area that they cover
        together; it is refused without, since the engines here know one disk per person

    Raises SceneError naming the file and the agent."""
    moving, bodies = _agents(file), _agents(file.with_name(BODIES))
    if missing := moving.keys() ^ bodies.keys():
        raise SceneError(f"{file}: agent {min(missing)} is not both here and in {BODIES}")
    if not moving:
        raise SceneError(f"{file}: no agent")
    ids = sorted(moving)
    position, velocity, spin = [], [], []
    radius, mass, shapes = [], [], 1
    for one in ids:
        where = f"{file}: agent {one}"
        motion = _child(where, moving[one], "Kinematics")
        position.append(_attribute(where, motion, "Position", 2))
        velocity.append(_attribute(where, motion, "Velocity", 2))
        spin += _attribute(where, motion, "Omega", 1)
        where = f"{file.with_name(BODIES)}: agent {one}"
        mass += _attribute(where, bodies[one], "Mass", 1)
        if not 0 < mass[-1] < MOST_MASS_KG:
            raise SceneError(
                f"{where}: Mass: {mass[-1]:g} kg. Between 0 and {MOST_MASS_KG:g} kg is needed"
            )
        disks = bodies[one].findall("Shape")
        if len(disks) > 1 and not one_disk:
            raise SceneError(
                f"{where}: {len(disks)} disks. Here a person is one: --one-disk takes one of the "
                "same area"
            )
        shapes = max(shapes, len(disks))
        radius.append(_radius(where, disks))
    try:
        snapshot = Snapshot(
            position=np.array(position),
            velocity=np.array(velocity),
            spin=np.array(spin),
            radius=np.round(radius, 6),
            mass=np.array(mass),
            ids=np.array(ids) + 1,
        )
    except ValueError as error:
        raise SceneError(f"{file}: {error}") from None
    return LemonsCrowd(
        file=file, snapshot=snapshot, walls=_walls(file.with_name(ROOM)), shapes=shapes
    )


def _xml(file: Path, name: str) -> ElementTree.Element:
    """The root of a file, which has this name."""
    try:
        text = read_text(file)
        if "<!DOCTYPE" in text:
            raise SceneError(f"{file}: a document type is not read")
        root = ElementTree.fromstring(text.encode())
    except UnreadableError as error:
        raise SceneError(str(error)) from None
    except ElementTree.ParseError as error:
        raise SceneError(f"{file}: no XML: {error}") from None
    if root.tag != name:
        what = "histories of contacts are not read" if root.tag == "Interactions" else "unknown"
        raise SceneError(f"{file}: <{root.tag}> where <{name}> is needed ({what})")
    return root


def _agents(file: Path) -> dict[int, ElementTree.Element]:
    found: dict[int, ElementTree.Element] = {}
    for agent in _xml(file, "Agents").findall("Agent"):
        said = agent.get("Id", "")
        if not said.isdigit() or int(said) in found:
            raise SceneError(f"{file}: agent {said!r}: one whole number each is needed as Id")
        found[int(said)] = agent
    return found


def _child(where: str, parent: ElementTree.Element, name: str) -> ElementTree.Element:
    child = parent.find(name)
    if child is None:
        raise SceneError(f"{where}: no <{name}>")
    return child


def _attribute(where: str, element: ElementTree.Element, key: str, count: int) -> list[float]:
    """The finite numbers of an attribute, separated by commas."""
    text = element.get(key)
    try:
        numbers = [float(word) for word in (text or "").split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise SceneError(f"{where}: {key}: {text!r} where {count} finite numbers are needed")
    return numbers


def _radius(where: str, shapes: list[ElementTree.Element]) -> float:
    """The radius (m) of the disk that has the area of these."""
    if not shapes:
        raise SceneError(f"{where}: no <Shape>")
    disks = []
    for shape in shapes:
        if shape.get("Type") != "disk":
            raise SceneError(f"{where}: Shape: {shape.get('Type')!r}. Only disks are read")
        (radius,) = _attribute(where, shape, "Radius", 1)
        if radius <= 0:
            raise SceneError(f"{where}: Radius: {radius:g}. A number above 0 is needed")
        disks.append((_attribute(where, shape, "Position", 2), radius))
    if len(disks) == 1:
        return disks[0][1]
    circles = [shapely.Point(place).buffer(radius, quad_segs=CORNERS) for place, radius in disks]
    # of a polygon that stands for a disk
    share = CORNERS * 4 / (2 * np.pi) * np.sin(2 * np.pi / (CORNERS * 4))
    return float(np.sqrt(shapely.union_all(circles).area / (np.pi * share)))


def _walls(file: Path) -> tuple[Wall, ...]:
    """The sides of all walls, corner to corner."""
    found: list[tuple[list[float], list[float]]] = []
    for wall in _xml(file, "Geometry").findall("Wall"):
        name = wall.get("Id", "")
        where = f"{file}: wall {name}"
        corners = [_attribute(where, one, "Coordinates", 2) for one in wall.findall("Corner")]
        if len(corners) < 2:
            raise SceneError(f"{where}: {len(corners)} corners. Two at least are needed")
        found += [pair for pair in pairwise(corners) if pair[0] != pair[1]]
    return walls_between(found)
