"""Options that commands on trajectories share."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Literal

import typer

from analysis.cli.app import input_file, positive

Unit = Annotated[
    Literal["m", "cm"] | None, typer.Option(help="Unit of the file, where it does not say.")
]
FrameRate = Annotated[
    float | None,
    typer.Option(parser=positive, help="Frames per second, where the file does not say."),
]
Mass = Annotated[float, typer.Option(parser=positive, help="Mass of each person in kg.")]
Room = Annotated[
    Path | None,
    typer.Option(parser=input_file, help="Of a trajectory: TOML file with walls and drive."),
]
Radii = Annotated[
    list[float] | None,
    typer.Option(
        parser=positive,
        help="Of a trajectory: radius in m, several times; the middle one counts, all make the "
        "band. Left out: 0.16, 0.17, 0.18, 0.19 and 0.20.",
    ),
]


class Form(StrEnum):
    """For which program a film is exported: ParaView or OVITO."""

    VTK = "vtk"
    OVITO = "ovito"


Exports = Annotated[
    list[Form] | None, typer.Option(help="Write files for ParaView or OVITO too; several times.")
]
