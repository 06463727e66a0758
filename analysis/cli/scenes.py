"""percussions scenes."""

from pathlib import Path

from analysis.cli.app import show, warn
from analysis.cli.options import Count, Out, Seed


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
    kinds = {"driven": "force against p/τ", "impact": "∫f dt against p"}
    every = [read_scene(name) for name in scene_names()]
    rows = [
        [one.name, str(len(one.snapshot)), one.title, kinds[one.analysis.kind]] for one in every
    ]
    show(["scene", "disks", "what", "compared"], rows, numbers_from=4)
