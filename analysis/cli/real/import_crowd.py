"""percussions import."""

from pathlib import Path
from typing import Annotated

import typer

from analysis.cli.app import Out, positive, share
from analysis.cli.real.options import FrameRate, Mass, Unit

Crowd = Annotated[
    Path,
    typer.Argument(
        help="Trajectory file that PedPy can load, or AgentDynamics.xml of LEMONS, with its other "
        "files beside it."
    ),
]
RoomFile = Annotated[
    Path,
    typer.Option(help="TOML file with walls, drive, contact, run and analysis, as in a scene."),
]


def import_(
    file: Crowd,
    room: RoomFile,
    frame: Annotated[int | None, typer.Option(help="Of a trajectory: number of the frame.")] = None,
    one_disk: Annotated[
        bool,
        typer.Option(
            "--one-disk", help="Of LEMONS: take a person of several disks as one of the same area."
        ),
    ] = False,
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
    """Turn one frame of a real trajectory, or a crowd of LEMONS, into a scene without overlaps.

    Example: percussions import scenes/gate_excerpt.txt --frame 405 --room scenes/rooms/gate.toml
    --name mine"""
    from analysis.scene.anthropometry import Varied
    from analysis.scene.real.import_crowd import import_crowd
    from analysis.scene.real.trajectory import read_heads

    if file.suffix.lower() == ".xml":
        if frame is not None or people is not None:
            raise ValueError("--frame, --people: only of a trajectory")
        _import_lemons(file, room, name, one_disk, out)
        return
    if frame is None or one_disk:
        raise ValueError("--frame: of a trajectory it is needed, and --one-disk is for LEMONS")
    varied = Varied(people=people, radius_share=radius_spread, seed=seed)
    heads = read_heads(file, frame, unit=unit, frame_rate=frame_rate, window_s=window)
    imported = import_crowd(heads, radius=radius, room=room, mass=mass, name=name, varied=varied)
    beside = out / f"{imported.scene.name}.toml"
    if beside.exists() and beside.samefile(room):
        raise ValueError(f"{beside}: the scene would replace its room; give --name or --out")
    print(imported.write(out))
    print(imported.statement)


def _import_lemons(file: Path, room: Path, name: str | None, one_disk: bool, out: Path) -> None:
    from analysis.scene.real.lemons import read_lemons

    scene = read_lemons(file, one_disk=one_disk).into(room, name)
    beside = out / f"{scene.name}.toml"
    if beside.exists() and beside.samefile(room):
        raise ValueError(f"{beside}: the scene would replace its room; give --name or --out")
    print(scene.write(out))
    print(scene.notes)
