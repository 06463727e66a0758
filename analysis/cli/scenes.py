"""percussions scenes and new."""

from __future__ import annotations

import math
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from analysis.cli.app import Out, count, positive, share, show, warn

if TYPE_CHECKING:
    from analysis.scene.scene import Scene


def scenes(
    make: Annotated[
        str | None, typer.Option(help="Write this scene, of any size, instead of listing.")
    ] = None,
    disks: Annotated[int | None, typer.Option(parser=count, help="Number of disks.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random numbers.")] = 1,
    out: Out = Path("."),
) -> None:
    """List the scenes, or write one of any size.

    Example: percussions scenes --make arch --disks 5000 --seed 3 --out mine
    """
    from analysis.scene.scene import read_scene, scene_names
    from analysis.scene.shipped_scenes import make as make_scene

    if make is not None:
        scene = make_scene(make, disks, seed)
        for warning in scene.check(scene.name):
            warn(warning)
        print(scene.write(out))
        return
    every = [read_scene(name) for name in scene_names()]
    show(
        ["scene", "disks", "what", "compared"],
        [
            [
                scene.name,
                str(len(scene.snapshot)),
                scene.title,
                "force against p/τ" if scene.analysis.kind == "driven" else "∫f dt against p",
            ]
            for scene in every
        ],
        numbers_from=4,
    )


def new(
    name: Annotated[str, typer.Argument(help="Name of the scene.")],
    people: Annotated[int, typer.Option(parser=count, help="How many people.")],
    door: Annotated[
        str,
        typer.Option(help="Width in m; with --geometry its two ends: x,y,x,y in m."),
    ],
    room: Annotated[
        str | None,
        typer.Option(help="LENGTHxWIDTH in m; the door is in the middle of a side of WIDTH."),
    ] = None,
    geometry: Annotated[
        Path | None,
        typer.Option(help="WKT or GeoJSON file of the floor in m, instead of a room."),
    ] = None,
    people_from: Annotated[
        str | None,
        typer.Option(help="Radii and masses of a survey: 'ANSUR II', … men, … women."),
    ] = None,
    radius: Annotated[float, typer.Option(parser=positive, help="Mean radius in m.")] = 0.2,
    radius_spread: Annotated[
        float, typer.Option(parser=share, help="Radii are uniform within this share about it.")
    ] = 0.1,
    mass: Annotated[float, typer.Option(parser=positive, help="Mass of each in kg.")] = 75.0,
    push: Annotated[
        float, typer.Option(parser=positive, help="Push of a person who is held, in N.")
    ] = 150.0,
    speed: Annotated[
        float | None,
        typer.Option(parser=positive, help="Desired speed in m/s; else push · 0.5 s / mass."),
    ] = None,
    duration: Annotated[
        float, typer.Option(parser=positive, help="Time to simulate, in s.")
    ] = 10.0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random numbers.")] = 1,
    out: Out = Path("."),
) -> None:
    """Write a scene of a crowd before the door of a room, and a picture of it.

    Example: percussions new my_room --room 8x6 --door 0.8 --people 150 --people-from "ANSUR II"
    --push 100"""
    from analysis.scene.anthropometry import Varied
    from analysis.scene.rooms import Crowd, from_geometry, read_area
    from analysis.scene.rooms import room as rectangle

    if (room is None) == (geometry is None):
        raise ValueError("room: either --room or --geometry is needed")
    if (out / f"{name}.toml").exists():
        raise ValueError(f"{out / name}.toml: exists already; give another name or --out")
    varied = Varied(people=people_from, radius_share=radius_spread, seed=seed)
    crowd = Crowd(people=people, radius=radius, mass=mass, varied=varied, push=push, speed=speed)
    if geometry is None:
        (gap,) = _lengths("door", door, ",", 1)
        length, width = _lengths("room", room or "", "x", 2)
        scene = rectangle(name, length, width, gap, crowd, duration)
    else:
        x0, y0, x1, y1 = _lengths("door", door, ",", 4)
        scene = from_geometry(name, read_area(geometry), ((x0, y0), (x1, y1)), crowd, duration)
    _written(scene, out)


def _written(scene: Scene, out: Path) -> None:
    """Write a scene and its picture, and say so."""
    from analysis.pages.html import drawn
    from analysis.pages.report_charts import scene_picture
    from analysis.pages.section import Picture
    from analysis.support.files import whole_file

    made = scene.write(out)
    shown = drawn(Picture(name=scene.name, caption=scene.title, figure=scene_picture(scene)))
    with whole_file(made.with_suffix(".png"), "wb") as file:
        file.write(shown.png)
    print(scene.notes, made, made.with_suffix(".png"), sep="\n")
    print(f"next: percussions report {shlex.quote(str(made))}")


def _lengths(key: str, text: str, between: str, wanted: int) -> list[float]:
    """The numbers of an option, in m."""
    try:
        numbers = [float(part) for part in text.split(between)]
    except ValueError:
        numbers = []
    if len(numbers) != wanted or not all(map(math.isfinite, numbers)):
        form = between.join(["m"] * wanted)
        raise ValueError(f"{key}: {text!r}; numbers as {form} are needed")
    return numbers
