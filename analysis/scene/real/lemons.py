"""Crowds of LEMONS: AgentDynamics.xml with Agents.xml and Geometry.xml beside it."""

import math
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import shapely

from analysis.scene.anthropometry import separated
from analysis.scene.floor_files import walls_between
from analysis.scene.scene import Scene, SceneError, Wall, read_room
from analysis.support.reading import UnreadableError, parsed_xml, read_text
from nscd import Snapshot
from nscd.arrays import Floats
from nscd.segments import lengths
from nscd.stepping import StepError

BODIES, ROOM = "Agents.xml", "Geometry.xml"
MOST_MASS_KG = 1000.0
# Corners of a quarter of a disk, where the area of several is measured.
CORNERS = 64
# Place (m) and radius (m).
Disk = tuple[list[float], float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LemonsCrowd:
    """Hold a crowd as LEMONS has it, each person one disk, or a body of their disks there."""

    file: Path
    snapshot: Snapshot  # of one disk, or of bodies, the ids are LEMONS' plus one
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
            moved = separated(disks, stated.wall_segments())
        except (StepError, ValueError) as error:
            raise SceneError(f"{self.file}: {error}") from None
        far = lengths(moved.position - disks.position)
        notes += f"""

{self._people()}. Moved apart by {far.mean():.3f} m in the mean, {far.max():.3f} m at most. Ids of
people are those of LEMONS plus 1. Its pushes (Fp), floor damping and materials are not taken.
Drive and contact law are those of {room.name}."""
        scene = Scene.of(stated, name=name or room.stem, notes=notes.strip(), snapshot=moved)
        scene.check(str(self.file))
        return scene

    def _people(self) -> str:
        disks, message = (
            self.snapshot,
            f"people of {self.file.name} (LEMONS), each with {self.shapes} disks",
        )
        if disks.bodies is not None:
            return (
                f"{len(disks.bodies)} {message}, with their masses, moments of inertia, centres of mass\n"
                "and orientations. The disks share the mass so that its centre is where LEMONS has it"
            )
        size = f"{disks.radius.mean():.3f} m in the mean"
        return f"{len(disks)} {message} there and one of the same area\nhere: {size}"


def read_lemons(file: Path, *, one_disk: bool) -> LemonsCrowd:
    """Read AgentDynamics.xml, and Agents.xml and Geometry.xml beside it.

    one_disk: whether a person of several disks is taken as one disk of the area that they cover
        together, without orientation; without, all are rigid bodies, if anyone has several disks

    Raises SceneError naming the file and the agent."""
    moving, bodies = _agents(file), _agents(file.with_name(BODIES))
    if missing := moving.keys() ^ bodies.keys():
        raise SceneError(f"{file}: agent {min(missing)} is not both here and in {BODIES}")
    if not moving:
        raise SceneError(f"{file}: no agent")
    ids = sorted(moving)
    rows: list[tuple[float, ...]] = []  # id, x, y, vx, vy, spin, radius, mass
    inertia, shapes = [], max(len(bodies[one].findall("Shape")) for one in ids)
    for one in ids:
        where = f"{file}: agent {one}"
        motion = moving[one].find("Kinematics")
        if motion is None:
            raise SceneError(f"{where}: no <Kinematics>")
        centre, velocity = (_attribute(where, motion, key, 2) for key in ("Position", "Velocity"))
        way = (*velocity, *_attribute(where, motion, "Omega", 1))
        turn = 0.0 if one_disk or shapes == 1 else _attribute(where, motion, "Theta", 1)[0]
        where = f"{file.with_name(BODIES)}: agent {one}"
        (mass,) = _attribute(where, bodies[one], "Mass", 1)
        if not 0 < mass < MOST_MASS_KG:
            raise SceneError(
                f"{where}: Mass: {mass:g} kg. Between 0 and {MOST_MASS_KG:g} kg is needed"
            )
        disks = _disks(where, bodies[one].findall("Shape"))
        if one_disk or shapes == 1:
            rows.append((one + 1, *centre, *way, round(_radius(disks), 6), mass))
            continue
        inertia += _attribute(where, bodies[one], "MomentOfInertia", 1)
        c, s = math.cos(turn), math.sin(turn)
        for ((x, y), radius), fraction in zip(disks, _mass_fractions(where, disks), strict=True):
            # picometres are those of every processor
            position = (round(at, 12) for at in (centre[0] + c * x - s * y, centre[1] + s * x + c * y))
            rows.append((one + 1, *position, *way, radius, mass * fraction))
    return LemonsCrowd(
        file=file,
        snapshot=_crowd(file, np.array(rows), np.array(inertia)),
        walls=_walls(file.with_name(ROOM)),
        shapes=shapes,
    )


def _crowd(file: Path, rows: Floats, inertia: Floats) -> Snapshot:
    """The disks of rows, joined where there are inertias (kg m²)."""
    ids, x, y, vx, vy, spin, radius, mass = rows.T
    try:
        disks = Snapshot(
            position=np.column_stack([x, y]), velocity=np.column_stack([vx, vy]), spin=spin,
            radius=radius, mass=mass, ids=np.arange(1, 1 + len(ids)) if len(inertia) else ids,
        )  # fmt: skip
        return disks.joined(ids, inertia=inertia) if len(inertia) else disks
    except ValueError as error:
        raise SceneError(f"{file}: {error}") from None


def _mass_fractions(where: str, disks: list[Disk]) -> Floats:
    """The share of the mass (n,) of each disk, near that of its area w, so that the centre of mass is
    at 0: w (1 + a·p) of the least a; 12 digits, which are those of every processor."""
    positions, weight = np.array([position for position, _ in disks]), np.array([r * r for _, r in disks])
    weighted = weight[:, None] * positions
    tilt = np.linalg.lstsq(positions.T @ weighted, -weighted.sum(0), rcond=1e-9)[0]
    fraction = weight * (1 + positions @ tilt)
    if fraction.min() <= 0 or np.abs(fraction @ positions).max() > 1e-9 * fraction.sum():
        raise SceneError(f"{where}: its disks are not about its centre of mass")
    fraction = (fraction / fraction.sum()).round(12)
    fraction[fraction.argmax()] += 1 - math.fsum(fraction)  # the mass of the person is the stated one
    return np.asarray(fraction)


def _xml(file: Path, name: str) -> ElementTree.Element:
    """The root of a file, which has this name."""
    try:
        root = parsed_xml(file, read_text(file))
    except UnreadableError as error:
        raise SceneError(str(error)) from None
    if root.tag != name:
        what = "histories of contacts are not read" if root.tag == "Interactions" else "unknown"
        raise SceneError(f"{file}: <{root.tag}> where <{name}> is needed ({what})")
    return root


def _agents(file: Path) -> dict[int, ElementTree.Element]:
    found: dict[int, ElementTree.Element] = {}
    for agent in _xml(file, "Agents").findall("Agent"):
        stated = agent.get("Id", "")
        if not stated.isdigit() or int(stated) in found:
            raise SceneError(f"{file}: agent {stated!r}: one whole number each is needed as Id")
        found[int(stated)] = agent
    return found


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


def _disks(where: str, shapes: list[ElementTree.Element]) -> list[Disk]:
    """Places and radii (m) of the disks of a person."""
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
    return disks


def _radius(disks: list[Disk]) -> float:
    """The radius (m) of the disk that has the area of these; micrometres are those of every processor."""
    if len(disks) == 1:
        return disks[0][1]
    circles = [shapely.Point(position).buffer(radius, quad_segs=CORNERS) for position, radius in disks]
    # of a polygon that stands for a disk
    fraction = CORNERS * 4 / (2 * np.pi) * np.sin(2 * np.pi / (CORNERS * 4))
    return float(np.sqrt(shapely.union_all(circles).area / (np.pi * fraction)))


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
