"""What FCLIB's form leaves out of a crowd: bodies, contacts, walls and time, with their units, and
what is known of the answer."""

import dataclasses
import math
from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

import numpy as np

from analysis.exchange.problem import GlobalProblem, Group, put_numbers, put_whole, put_words
from analysis.percussions import Setting, SnapshotPercussions
from analysis.percussions.snapshot import openness_of
from analysis.percussions.table import Openness
from nscd import Contacts, Snapshot, Walls, solve
from nscd.arrays import Floats, Indices
from nscd.indeterminacy import determinacy

# Of this form of /crowd; a reader refuses others.
VERSION = 1
# The units of what /crowd holds, by array.
BODIES = {
    "position": "m", "velocity": "m/s", "radius": "m", "mass": "kg", "spin": "rad/s",
    "left_velocity": "m/s",
}  # fmt: skip
ONE_EACH = ("radius", "mass", "spin")
# Of the radii: normals and gaps are those of the positions up to it.
SAME_PLACE = 1e-6
CONTACTS = {"normal": "1", "gap": "m", "point": "m"}


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CrowdProblem:
    """Hold a problem that this program wrote: a crowd at one instant."""

    setting: Setting  # walls and their names, friction
    snapshot: Snapshot
    contacts: Contacts
    left_velocity: Floats  # (n,2) m/s, u⁻
    window: float | None  # s, the time that turns percussions into forces; None for an impact

    def matrices(self, friction: Floats) -> GlobalProblem:
        """State it as matrices, with μ (k,)."""
        return GlobalProblem.of(self.snapshot, self.contacts, self.left_velocity, friction)

    def solve(self, tolerance: float = 1e-8) -> SnapshotPercussions:
        """Solve it as `nscd.solve` does."""
        parts = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        answer = solve(
            self.snapshot,
            self.contacts,
            left_velocity=self.left_velocity,
            law=self.setting.law,
            tolerance=tolerance,
        )
        return SnapshotPercussions(**parts, answer=answer)


def put_crowd(group: Any, found: SnapshotPercussions, origin: Mapping[str, str]) -> None:
    """Write /crowd; each array has its unit as an attribute."""
    snapshot, setting = found.answer.snapshot, found.setting
    group.attrs["version"] = VERSION
    group.attrs["program"] = f"crowd-percussions {version('crowd-percussions')}"
    group.attrs["of_v"] = "x, y (m/s), spin (rad/s) of each body"
    group.attrs["of_r"] = "normal, tangent (N s) of each contact, what its first body gives"
    group.attrs["tangent"] = "(-ny, nx) of the normal, which points from the first body away"
    group.attrs["left_velocity"] = setting.kind
    for key, value in origin.items():
        group.attrs[key] = value
    put_numbers(group, "time", [snapshot.time], "s")
    if found.window is not None:
        put_numbers(group, "dt", [found.window], "s")
    bodies = group.create_group("bodies")
    bodies.create_dataset("id", data=snapshot.ids)
    for name, unit in BODIES.items():
        values = found.left_velocity if name == "left_velocity" else getattr(snapshot, name)
        put_numbers(bodies, name, values, unit)
    contacts = group.create_group("contacts")
    for name in ("first", "second", "is_wall"):
        contacts.create_dataset(name, data=getattr(found.contacts, name).astype(np.int32))
    for name, unit in CONTACTS.items():
        put_numbers(contacts, name, getattr(found.contacts, name), unit)
    walls = group.create_group("walls")
    ends = setting.walls or Walls(start=np.empty((0, 2)), end=np.empty((0, 2)))
    put_numbers(walls, "start", ends.start, "m")
    put_numbers(walls, "end", ends.end, "m")
    put_words(walls, "names", "\n".join(setting.wall_names))


def put_truth(group: Any, found: SnapshotPercussions, openness: Openness) -> None:
    """Write /truth: what balance, and reactions that only push, leave open of a solved problem."""
    answer = found.answer
    group.attrs["given"] = "v of /solution, and contacts that only push"
    group.attrs["solver"] = answer.solver
    group.attrs["residual"] = answer.residual
    group.attrs["velocity_error_m_per_s"] = answer.velocity_error
    known = determinacy(found.contacts, len(found.snapshot), found.snapshot)
    put_whole(group, "rank", known.rank)
    group["rank"].attrs["meaning"] = "of the normal columns of H"
    left_open = openness_of(found, openness == "ranges")
    group.create_dataset("determined", data=left_open.determined.astype(np.int32))
    group["determined"].attrs["meaning"] = "1: the same in every answer, 0: not, -1: not known"
    if openness != "ranges":
        return
    ends = ("lower", "upper", "friction_lower", "friction_upper")
    for name in ends[: 2 if answer.friction is None else 4]:
        put_numbers(group, name, getattr(left_open, name), "N s")
        group[name].attrs["meaning"] = "nan: no end, or none is known"


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Truth:
    """Hold what is known of the reactions along the normal of a problem with k contacts.

    lower, upper: (k,) N·s, least and largest; nan where there is no end, or none is known"""

    determined: Indices  # (k,) 1: the same in every answer, 0: not, −1: not known
    lower: Floats
    upper: Floats


def read_truth(group: Group, contacts: int) -> Truth:
    """Read /truth. Raises ExchangeError naming what is missing or wrong."""
    ends = {
        name: group.numbers(name, (contacts,), "N s", gaps=True)
        if name in group
        else np.full(contacts, math.nan)
        for name in ("lower", "upper")
    }
    return Truth(determined=group.wholes("determined", (contacts,)), **ends)


def read_crowd(group: Group, friction: Floats) -> CrowdProblem:
    """Read /crowd; friction: μ (k,) of the problem beside it. Raises ExchangeError naming what is
    missing or wrong."""
    said = group.content.attributes.get("version")
    if said != VERSION:
        raise group.refuse("version", f"{said}. Version {VERSION} is read")
    bodies, touching = group.group("bodies"), group.group("contacts")
    n, k = bodies.length("id"), len(friction)
    arrays: dict[str, Any] = {
        name: bodies.numbers(name, (n,) if name in ONE_EACH else (n, 2), unit)
        for name, unit in BODIES.items()
    }
    left = arrays.pop("left_velocity")
    ends = {name: touching.wholes(name, (k,)) for name in ("first", "second", "is_wall")}
    frame: dict[str, Any] = {
        name: touching.numbers(name, (k,) if name == "gap" else (k, 2), unit)
        for name, unit in CONTACTS.items()
    }
    ids, time = bodies.wholes("id", (n,)), float(group.numbers("time", (1,), "s")[0])
    window = float(group.numbers("dt", (1,), "s")[0]) if "dt" in group else None
    if window is not None and not window > 0:
        raise group.refuse("dt", f"{window:g} s. A time above 0 is needed")
    walls = group.group("walls")
    w = walls.length("start")
    starts, stops = (walls.numbers(name, (w, 2), "m") for name in ("start", "end"))
    names = tuple(walls.words("names").split("\n")) if w else ()
    try:
        snapshot = Snapshot(**arrays, ids=ids, time=time)
        contacts = Contacts(**ends, **frame)
        contacts.check_disks(n)
        at_walls = Walls(start=starts, end=stops) if w else None
    except ValueError as error:
        raise group.refuse("", str(error)) from None
    if len(names) != w or contacts.second[contacts.is_wall].max(initial=-1) >= w:
        raise group.refuse("walls", f"{w} walls, {len(names)} names, and contacts with others")
    _check_positions(group, snapshot, contacts, at_walls)
    return CrowdProblem(
        setting=Setting(
            walls=at_walls,
            wall_names=names,
            left_velocity="dump" if window is None else "free",
            window=window,
            **_coefficients(group, contacts, friction),
        ),
        snapshot=snapshot,
        contacts=contacts,
        left_velocity=left,
        window=window,
    )


def _check_positions(
    group: Group, snapshot: Snapshot, contacts: Contacts, walls: Walls | None
) -> None:
    """Refuse contacts whose normals and gaps are not those of the disks and walls."""
    at_wall, first, second = contacts.is_wall, contacts.first, contacts.second
    other = snapshot.position[np.where(at_wall, 0, second)]
    between = snapshot.radius[first] + np.where(at_wall, 0.0, snapshot.radius[second * ~at_wall])
    if walls is not None:
        other[at_wall] = walls.nearest_point(snapshot.position[first[at_wall]], second[at_wall])
    apart = other - snapshot.position[first]
    length = np.hypot(*apart.T)
    wrong = np.abs(contacts.gap - (length - between)) > SAME_PLACE * between
    turned = np.hypot(*(contacts.normal * length[:, None] - apart).T)
    wrong |= turned > SAME_PLACE * between
    if wrong.any():
        row = int(np.argmax(wrong))
        raise group.refuse(
            "contacts",
            f"number {row + 1}: its normal and gap are not those of disk "
            f"{snapshot.ids[first[row]]} and what it touches, at the positions in bodies",
        )


def _coefficients(group: Group, contacts: Contacts, friction: Floats) -> dict[str, Any]:
    """One μ of people with each other, and one with walls."""
    found: dict[str, Any] = {}
    for name, kind in (("friction", False), ("wall_friction", True)):
        values = np.unique(friction[contacts.is_wall == kind])
        if len(values) > 1:
            raise group.refuse("contacts", "several μ. One with people and one with walls is read")
        if len(values):
            found[name] = float(values[0])
    return found
