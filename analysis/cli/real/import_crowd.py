"""percussions import."""

from pathlib import Path
from typing import Annotated

import typer

from analysis.cli.app import Out, positive, share
from analysis.cli.real.options import FrameRate, Mass, Unit


def import_(
    file: Annotated[Path, typer.Argument(help="Trajectory file that PedPy can load.")],
    frame: Annotated[int, typer.Option(help="Number of the frame.")],
    room: Annotated[
        Path,
        typer.Option(help="TOML file with walls, drive, contact, run and analysis, as in a scene."),
    ],
    radius: Annotated[
        float, typer.Option(parser=positive, help="Radius of each disk in m.")
    ] = 0.18,
    mass: Mass = 75.0,
    radius_spread: Annotated[
        float,
        typer.Option(parser=share, help="Radii are uniform within this share about --radius."),
    ] = 0.0,
    people: Annotated[
        str | None,
        typer.Option(help="Radii and masses of a survey instead: 'ANSUR II', … men, … women."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of radii and masses.")] = 1,
    name: Annotated[
        str | None, typer.Option(help="Name of the scene; the room's by default.")
    ] = None,
    unit: Unit = None,
    frame_rate: FrameRate = None,
    window: Annotated[
        float,
        typer.Option(parser=positive, help="Time in s over which velocities are measured."),
    ] = 0.4,
    out: Out = Path("."),
) -> None:
    """Turn one frame of a real trajectory into a scene without overlaps.

    Example: percussions import scenes/gate_excerpt.txt --frame 405 --room scenes/rooms/gate.toml
    --name mine"""
    from analysis.scene.anthropometry import Varied
    from analysis.scene.real.import_crowd import import_crowd
    from analysis.scene.real.trajectory import read_heads

    varied = Varied(people=people, radius_share=radius_spread, seed=seed)
    heads = read_heads(file, frame, unit=unit, frame_rate=frame_rate, window_s=window)
    imported = import_crowd(heads, radius=radius, room=room, mass=mass, name=name, varied=varied)
    beside = out / f"{imported.scene.name}.toml"
    if beside.exists() and beside.samefile(room):
        raise ValueError(f"{beside}: the scene would replace its room; give --name or --out")
    print(imported.write(out))
    print(imported.statement)
