"""Options that commands on contact problems share."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from analysis.cli.app import input_file, not_negative, positive, share

RoomFile = Annotated[
    Path | None,
    typer.Option(
        "--room",
        "--walls",
        parser=input_file,
        help="Room or scene file (.toml) with the walls and the drive; scene.toml beside the "
        "dump if there.",
    ),
]
LeftVelocity = Annotated[
    Literal["desired", "dump", "free"] | None,
    typer.Option(
        help="desired: p/τ is a force; dump: an impact; free: u + Δt F/m. Left out: desired "
        "where there is a drive."
    ),
]
Friction = Annotated[
    float | None,
    typer.Option(
        parser=not_negative,
        help="Coulomb's μ of people with each other; the scene's own if left out, 0 in a room.",
    ),
]
WallFriction = Annotated[
    float | None,
    typer.Option(parser=not_negative, help="μ of people with walls; --friction if left out."),
]
Window = Annotated[
    float | None, typer.Option(parser=positive, help="Δt of --left-velocity free, in s.")
]
TimeStep = Annotated[
    float | None,
    typer.Option(
        parser=positive,
        help="Time step of the simulation in s (from run.json beside the dump if there; "
        "without either the table has steps in place of times).",
    ),
]
Unit = Annotated[
    Literal["m", "cm", "mm"] | None,
    typer.Option(
        help="Unit of lengths in the dump, and of velocities per second; m if left out. Masses "
        "are kg."
    ),
]
ContactTolerance = Annotated[
    float | None,
    typer.Option(
        parser=positive,
        help="Gap in m up to which disks are in contact; the room's or 1e-6 if left out.",
    ),
]
LargestOverlap = Annotated[
    float | None,
    typer.Option(
        parser=positive,
        help="Deepest overlap that is taken, as a share of the smaller radius; 0.5 if left out.",
    ),
]
Restitution = Annotated[
    float | None,
    typer.Option(parser=share, help="Restitution of the contacts; inelastic if left out."),
]
Tolerance = Annotated[
    float,
    typer.Option(parser=positive, help="Residual up to which a frame counts as solved."),
]
Openness = Annotated[
    Literal["none", "determined", "ranges"],
    typer.Option(
        help="What is said of reactions that the mechanics may leave open: nothing, whether "
        "each is determined, or also its least and largest value. The first is about 20 times "
        "faster than the second, the last slow."
    ),
]
