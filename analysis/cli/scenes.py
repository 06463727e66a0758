"""percussions scenes."""

from pathlib import Path
from typing import Annotated

import typer

from analysis.cli.app import Out, count, show, warn


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
