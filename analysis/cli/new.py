"""percussions new."""

from __future__ import annotations

import math
import shlex
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from analysis.cli.app import progress, refuse_beside, warn, write_picture
from analysis.cli.options import Count, NotNegative, Out, Positive, Seed, Share

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from shapely import Polygon

    from analysis.scene.scene import Scene
    from analysis.scene.waiting import Doorway


def new(
    context: typer.Context,
    name: str,
    *,
    people: Count,
    door: list[str] | None = None,
    room: str | None = None,
    geometry: Path | None = None,
    stream: bool = False,
    block: list[str] | None = None,
    barrier: list[str] | None = None,
    people_from: str | None = None,
    radius: Positive = 0.2,
    radius_spread: Share = 0.1,
    mass: Positive = 75.0,
    push: Positive = 150.0,
    speed: Positive | None = None,
    tau: Positive | None = None,
    law: str = "hooke",
    friction: NotNegative = 0.0,
    duration: Positive = 10.0,
    seed: Seed = 1,
    out: Out = Path("."),
) -> None:
    """Write a scene of a crowd before the doors of a room, and a picture of it.

    name: Name of the scene, with or without .toml.
    people: How many people.
    door: Width in m of a door in the middle of a room's side, or its ends: x,y,x,y in m. Several
        times for several, each with its share of the crowd behind a colon (0,1,0,2:0.3).
    room: LENGTHxWIDTH in m: −LENGTH < x < 0, |y| < WIDTH/2. Its door is at x = 0.
    geometry: Floor in m instead of a room: WKT, GeoJSON, an SQLite trajectory of JuPedSim or a
        Vadere scenario, which has its own doors.
    stream: Two opposing streams along a room, open at both ends (or as --door).
    block: Pillar or thick wall: x,y,x,y of two opposite corners in m. May be repeated.
    barrier: Straight wall inside, without thickness: x,y,x,y in m. May be repeated.
    people_from: Radii and masses of a survey: 'ANSUR II', … men, … women.
    radius_spread: Radii are uniform within this share about it.
    speed: Desired speed in m/s. Default: push · tau / mass.
    tau: Relaxation time in s. Default: 0.5, or mass · speed / push with --speed.
    law: hooke, hertz, body or body_hertz (bodies as soft as people).
    friction: Coulomb's coefficient.
    duration: Time to simulate, in s.

    radius: Mean radius in m.
    mass: Mass of each in kg.
    push: Push of a person who is held, in N.

    Example: percussions new my_room --room 8x6 --door 0.8 --people 150 --people-from "ANSUR II"
    --push 100"""
    from analysis.scene import Crowd, Inside, from_geometry
    from analysis.scene import room as rectangle
    from analysis.scene.anthropometry import Varied

    if (room is None) == (geometry is None):
        raise ValueError("room: either --room or --geometry is needed")
    name = name.removesuffix(".toml")
    if (out / f"{name}.toml").exists():
        raise ValueError(f"{out / name}.toml: exists already. Give another name or --out")
    if people_from is not None:
        sizes = ("radius", "radius_spread", "mass")
        refuse_beside(context, sizes, "--people-from has radii and masses of its own")
    if speed is not None and tau is not None:
        refuse_beside(context, ("push",), "--speed and --tau give it: mass · speed / tau")
    varied = Varied(people=people_from, radius_share=radius_spread, seed=seed)
    who: dict[str, Any] = {"people": people, "radius": radius, "mass": mass, "varied": varied}
    who |= {"push": push, "speed": speed, "relaxation": tau, "law": law, "friction": friction}
    crowd = Crowd(**who)
    blocks, walls = _corners("block", block), _corners("barrier", barrier)
    inside = Inside(blocks=blocks, barriers=[(wall[:2], wall[2:]) for wall in walls])
    with progress():
        if geometry is None:
            length, width = _lengths("room", room or "", "x", 2)
            doors = _doors_of_room(door or [], (length, width), stream)
            scene = rectangle(name, length, width, doors, crowd, duration, inside)
        else:
            floor, ways = _floor(geometry, door or [], stream)
            scene = from_geometry(name, floor, ways, crowd, duration, inside)
    for warning in scene.check(name):
        warn(warning)
    made = scene.write(out)
    print(scene.notes, made, made.with_suffix(".data"), sep="\n")
    write_picture(made.with_suffix(".png"), partial(_picture, scene))
    print(f"next: percussions report {shlex.quote(str(made))}")


def _picture(scene: Scene) -> Figure:
    from analysis.pages.drawing import scene_picture

    return scene_picture(scene)


def _doors_of_room(
    doors: list[str], size: tuple[float, float], stream: bool
) -> float | list[Doorway]:
    """The doors of a rectangular room."""
    from analysis.scene.waiting import opposing

    if stream:
        if len(doors) > 1 or "," in "".join(doors):
            raise ValueError("stream: at most one --door is needed, the width of both")
        gap = _lengths("door", doors[0], ",", 1)[0] if doors else None
        if gap is not None and not 0 < gap <= size[1]:
            raise ValueError(f"door: {gap:g} m. It needs 0 to the side of {size[1]:g} m")
        return list(opposing(*size, gap))
    if not doors:
        raise ValueError("door: its width or its ends are needed (--door)")
    if len(doors) == 1 and "," not in doors[0]:
        return float(_lengths("door", doors[0], ",", 1)[0])
    return [_doorway(text) for text in doors]


def _floor(geometry: Path, doors: list[str], stream: bool) -> tuple[Polygon, list[Doorway]]:
    """The floor of a file, and its doors, or those that are given."""
    from analysis.scene.floors import read_floor

    if stream:
        raise ValueError("stream: only of a --room. Give the doors of a floor by --door")
    floor = read_floor(geometry)
    if not doors and not floor.doors:
        raise ValueError(f"door: {geometry} has none. Its ends are needed: --door x,y,x,y")
    return floor.polygon, [_doorway(text) for text in doors] or list(floor.doors)


def _doorway(text: str) -> Doorway:
    """A door by its ends and its share: x,y,x,y:SHARE."""
    from analysis.scene.waiting import Doorway

    ends, colon, part = text.partition(":")
    corners = _lengths("door", ends, ",", 4)
    given = {"share": _lengths("door share", part, ",", 1)[0]} if colon else {}
    return Doorway(ends=(corners[:2], corners[2:]), **given)


def _corners(key: str, texts: list[str] | None) -> Any:
    """Two corners each, x,y,x,y."""
    return [_lengths(key, text, ",", 4) for text in texts or ()]


def _lengths(key: str, text: str, between: str, wanted: int) -> Any:
    """The numbers of an option, in m, a tuple."""
    try:
        numbers = tuple(map(float, text.split(between)))
    except ValueError:
        numbers = ()
    if len(numbers) != wanted or not all(map(math.isfinite, numbers)):
        form = between.join(["m"] * wanted)
        raise ValueError(f"{key}: {text!r}. Numbers as {form} are needed")
    return numbers
