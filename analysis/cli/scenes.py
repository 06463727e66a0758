"""Commands that write a scene: scenes, new, import."""

from __future__ import annotations

import math
import shlex
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from analysis.cli.app import progress, refuse_beside, show, warn, write_picture
from analysis.cli.options import Count, InputFile, NotNegative, Out, Positive, Seed, Share, Unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from analysis.scene.plan_roles import Floor
    from analysis.scene.real.import_crowd import ImportedCrowd
    from analysis.scene.scene import Scene
    from analysis.scene.waiting import Doorway


def scenes(
    *, make: str | None = None, disks: Count | None = None, seed: Seed = 1, out: Out = Path(".")
) -> None:
    """List the scenes, or write one of any size.

    make: Write this scene, of any size, instead of listing.
    disks: Number of disks.

    Example: percussions scenes --make arch --disks 5000 --seed 3 --out mine"""
    from analysis.scene.scene import read_scene, scene_names
    from analysis.scene.shipped_scenes import make as make_scene

    if make is not None:
        scene = make_scene(make, disks, seed)
        for warning in scene.check(scene.name):
            warn(warning)
        print(scene.write(out))
        return
    if disks or (seed, out) != (1, Path(".")):
        raise ValueError("--make: missing. --disks, --seed and --out are of a scene that it makes")
    kinds = {"driven": "force against p/τ", "impact": "∫f dt against p"}
    every = [read_scene(name) for name in scene_names()]
    rows = [
        [one.name, str(len(one.snapshot)), one.title, kinds[one.analysis.kind]] for one in every
    ]
    show(["scene", "disks", "what", "compared"], rows, numbers_from=4)


SIZES = ("radius", "radius_spread", "mass")


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
    crowd: str = "pushing",
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
    geometry: Floor in m instead of a room: WKT, GeoJSON, a floor of crowd:it, a trajectory of
        JuPedSim or a Vadere scenario. --door replaces the doors that it has.
    stream: Two opposing streams along a room, open at both ends (or as --door).
    block: Pillar or thick wall: x,y,x,y of two opposite corners in m. May be repeated.
    barrier: Straight wall inside, without thickness: x,y,x,y in m. May be repeated.
    people_from: Radii and masses of a survey: 'ANSUR II', 'ANSUR II men' or 'ANSUR II women'.
    crowd: waiting (nobody pushes), pressing or pushing (for ever, with --push). A report runs all.
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
        raise ValueError("room: --room or --geometry is needed, not both")
    if (out / f"{(name := name.removesuffix('.toml'))}.toml").exists():
        raise ValueError(f"{out / name}.toml: exists already. Give another name or --out")
    if people_from is not None:
        refuse_beside(context, SIZES, "--people-from has radii and masses of its own")
    if speed is not None and tau is not None:
        refuse_beside(context, ("push",), "--speed and --tau give it: mass · speed / tau")
    refuse_beside(context, ("push",) * (crowd != "pushing"), "it is of --crowd pushing")
    varied = Varied(people=people_from, radius_share=radius_spread, seed=seed)
    who: Any = {"people": people, "radius": radius, "mass": mass, "varied": varied, "does": crowd}
    stands = Crowd(**who, push=push, speed=speed, relaxation=tau, law=law, friction=friction)
    walls = [(wall[:2], wall[2:]) for wall in _corners("barrier", barrier)]
    inside = Inside(blocks=_corners("block", block), barriers=walls)
    with progress():
        if geometry is None:
            length, width = _lengths("room", room or "", "x", 2)
            doors = _doors_of_room(door or [], (length, width), stream)
            scene = rectangle(name, length, width, doors, stands, duration, inside)
        else:
            floor = _floor(geometry, door or [], stream)
            inside = replace(inside, barriers=[*floor.barriers, *walls])
            scene = from_geometry(name, floor.polygon, floor.doors, stands, duration, inside)
            has = f"{len(scene.walls)} walls, {len(floor.doors)} doors"
            print(f"{geometry}: {floor.polygon.area:.6g} m², {has}")
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


def _floor(geometry: Path, doors: list[str], stream: bool) -> Floor:
    """The floor of a file with its doors, or with those that are given."""
    from analysis.scene.floor_files import read_floor

    if stream:
        raise ValueError("stream: only of a --room. Give the doors of a floor by --door")
    inputs = tuple(_doorway(text) for text in doors)
    floor = read_floor(geometry, own_doors=not inputs)
    if not inputs and not floor.doors:
        raise ValueError(f"door: {geometry} has none. Its ends are needed: --door x,y,x,y")
    return replace(floor, doors=inputs or floor.doors)


def _doorway(text: str) -> Doorway:
    """A door by its ends and its share: x,y,x,y:SHARE."""
    from analysis.scene.waiting import Doorway

    ends, colon, part = text.partition(":")
    corners = _lengths("door", ends, ",", 4)
    arguments = {"share": _lengths("door share", part, ",", 1)[0]} if colon else {}
    return Doorway(ends=(corners[:2], corners[2:]), **arguments)


def _corners(key: str, texts: list[str] | None) -> Any:
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


# Options that make disks of the heads of a trajectory.
OF_HEADS = (
    *("frame", "people", "radius", "mass", "radius_spread", "seed", "unit", "frame_rate"),
    *("columns", "window", "others", "apart", "time_unit", "take_as_is"),
)


def _refuse_unused(
    context: typer.Context, people: str | None, radius_spread: float, others: int
) -> None:
    """Raise ValueError for options of disks that change nothing beside the others."""
    if people is not None:
        refuse_beside(context, SIZES, "--people has radii and masses of its own")
    elif not radius_spread:
        refuse_beside(context, ["seed"], "only with --radius-spread or --people")
    if not others:
        refuse_beside(context, ["apart"], "there are no other frames (--others 0)")


def import_(
    context: typer.Context,
    file: InputFile,
    *,
    room: InputFile,
    frame: int | None = None,
    one_disk: bool = False,
    radius: Positive = 0.18,
    mass: Positive = 75.0,
    radius_spread: Share = 0.0,
    people: str | None = None,
    seed: Seed = 1,
    name: str | None = None,
    unit: Unit | None = None,
    frame_rate: Positive | None = None,
    columns: str | None = None,
    time_unit: Literal["s", "ms"] = "s",
    take_as_is: bool = False,
    window: Positive | None = None,
    others: Annotated[int, typer.Option(min=0, max=100)] = 4,
    apart: Positive = 1.0,
    out: Out = Path("."),
) -> None:
    """Turn a frame of a real trajectory, and frames near it, or a crowd of LEMONS into a scene.

    room: TOML file with walls, drive, contact, run and analysis, as in a scene.
    frame: Of a trajectory: number of the frame.
    one_disk: Of LEMONS: take a person of several disks as one of the same area.
    radius: Radius of each disk in m.
    radius_spread: Radii are uniform within this share about --radius.
    people: Radii and masses of a survey instead: 'ANSUR II', 'ANSUR II men' or 'ANSUR II women'.
    seed: Seed of radii and masses.
    name: Name of the scene. Default: the room's.
    others: Other frames that a report varies the crowd by. 0: none.
    apart: Time in s from one of these frames to the next.

    columns: Of a table without names: what each column is, as 'frame id x y'.
    file: Trajectory: a table of text, JuPedSim, Pathfinder, Viswalk, Vadere, SUMO, Jülich's archive,
        or AgentDynamics.xml of LEMONS, with its other files beside it.
    window: Time in s over which velocities are measured. Default: 0.4, or two frames.

    Example: percussions import scenes/gate_excerpt.txt --frame 405 --room scenes/rooms/gate.toml
    --name mine"""
    from analysis.scene.real.trajectory import Recording, is_fcd

    if file.suffix.lower() == ".xml" and not is_fcd(file):
        refuse_beside(context, OF_HEADS, "of XML only for <fcd-export> of SUMO. Files of LEMONS say it")
        _import_lemons(file, room, name, one_disk, out)
        return
    _refuse_unused(context, people, radius_spread, others)
    if frame is None or one_disk:
        raise ValueError("--frame: of a trajectory it is needed, and --one-disk is for LEMONS")
    from analysis.scene.anthropometry import Varied
    from analysis.scene.real.import_crowd import import_crowd, who_is_inside, with_other_frames
    from analysis.scene.scene import read_room
    from analysis.scene.unused import note_unused_keys
    from analysis.support.reading import note

    how: dict[str, Any] = {"columns": columns, "time_unit": time_unit, "take_as_is": take_as_is}
    recording = Recording.read(file, unit=unit, frame_rate=frame_rate, **how)
    read, _ = read_room(room, (radius, mass))
    note(file, who_is_inside(recording, read, str(room))[1])
    note_unused_keys(room, "import")

    def crowd_of(number: int) -> ImportedCrowd:
        after = number - frame
        own = seed + 2 * abs(after) - (after > 0)  # each frame has its own
        varied = Varied(people=people, radius_share=radius_spread, seed=own)
        tracked = recording.head_positions(number, window)
        return import_crowd(tracked, radius=radius, room=room, mass=mass, name=name, varied=varied)

    _check_place(out / f"{name or room.stem}.toml", room)
    crowd = crowd_of(frame)
    imported, refused = with_other_frames(crowd, recording, others, apart, crowd_of)
    for reason in refused:
        warn(f"left out of the other frames: {reason}")
    print(imported.write(out))
    print(imported.statement)
    if more := imported.scene.other_frames:
        print(more.statement)


def _check_place(scene: Path, room: Path) -> None:
    if scene.exists() and scene.samefile(room):
        raise ValueError(f"{scene}: the scene would replace its room. Give --name or --out")


def _import_lemons(file: Path, room: Path, name: str | None, one_disk: bool, out: Path) -> None:
    from analysis.scene.real.lemons import read_lemons

    scene = read_lemons(file, one_disk=one_disk).into(room, name)
    _check_place(out / f"{scene.name}.toml", room)
    print(scene.write(out))
    print(scene.notes)
