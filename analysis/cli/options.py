"""Options that commands share."""

import dataclasses
import functools
import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Literal, get_type_hints

import typer

from analysis.cli.app import drop_none, input_file, not_negative, positive, share


def flat(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the fields of its dataclasses as options of its own."""
    hints = get_type_hints(command, include_extras=True)
    own, options = inspect.signature(command).parameters, dict[str, inspect.Parameter]()
    shared = {name: hints[name] for name in own if dataclasses.is_dataclass(hints[name])}
    for name, one in own.items():
        fields = inspect.signature(shared[name]).parameters if name in shared else {name: one}
        kinds = get_type_hints(shared[name], include_extras=True) if name in shared else hints
        for key, field in fields.items():
            options[key] = field.replace(annotation=kinds[key], kind=one.kind)

    @functools.wraps(command)
    def called(*values: Any, **named: Any) -> None:
        bound = signature.bind(*values, **named)
        bound.apply_defaults()
        said = bound.arguments
        for name, kind in shared.items():
            said[name] = kind(**{key.name: said.pop(key.name) for key in dataclasses.fields(kind)})
        command(**said)

    signature = inspect.Signature(list(options.values()))
    called.__signature__ = signature  # type: ignore[attr-defined]
    called.__annotations__ = {key: one.annotation for key, one in options.items()}
    return called


@dataclass(frozen=True, kw_only=True)
class Taken:
    """How the contact problem of a frame is taken from a dump."""

    room: Annotated[
        Path | None,
        typer.Option(
            "--room",
            "--walls",
            parser=input_file,
            help="Room or scene file (.toml) with the walls and the drive; scene.toml beside the "
            "dump if there.",
        ),
    ] = None
    left_velocity: Annotated[
        Literal["desired", "dump", "free"] | None,
        typer.Option(
            help="desired: p/τ is a force; dump: an impact; free: u + Δt F/m. Left out: desired "
            "where there is a drive."
        ),
    ] = None
    friction: Annotated[
        float | None,
        typer.Option(
            parser=not_negative,
            help="Coulomb's μ of people with each other; the scene's own if left out, 0 in a room.",
        ),
    ] = None
    wall_friction: Annotated[
        float | None,
        typer.Option(parser=not_negative, help="μ of people with walls; --friction if left out."),
    ] = None
    window: Annotated[
        float | None, typer.Option(parser=positive, help="Δt of --left-velocity free, in s.")
    ] = None
    time_step: Annotated[
        float | None,
        typer.Option(
            parser=positive,
            help="Time step of the simulation in s (from run.json beside the dump if there; "
            "without either the table has steps in place of times).",
        ),
    ] = None
    unit: Annotated[
        Literal["m", "cm", "mm"] | None,
        typer.Option(
            help="Unit of lengths in the dump, and of velocities per second; m if left out. Masses "
            "are kg."
        ),
    ] = None
    contact_tolerance: Annotated[
        float | None,
        typer.Option(
            parser=positive,
            help="Gap in m up to which disks are in contact; the room's or 1e-6 if left out.",
        ),
    ] = None
    largest_overlap: Annotated[
        float | None,
        typer.Option(
            parser=positive,
            help="Deepest overlap that is taken, as a share of the smaller radius; 0.5 if left out.",
        ),
    ] = None
    tolerance: Annotated[
        float, typer.Option(parser=positive, help="Residual up to which a frame counts as solved.")
    ] = 1e-8

    def setting(self) -> dict[str, Any]:
        """Give what is said of the problem itself, as `Setting` calls it."""
        names = ("left_velocity", "window", "largest_overlap", "friction", "wall_friction")
        return drop_none(**{name: getattr(self, name) for name in (*names, "contact_tolerance")})

    def of_dump(self) -> dict[str, Any]:
        """Give what is said of the dump."""
        return drop_none(time_step=self.time_step, unit=self.unit)


Restitution = Annotated[
    float | None,
    typer.Option(parser=share, help="Restitution of the contacts; inelastic if left out."),
]
Openness = Annotated[
    Literal["none", "determined", "ranges"],
    typer.Option(
        help="What is said of reactions that the mechanics may leave open: nothing, whether "
        "each is determined, or also its least and largest value. The first is about 20 times "
        "faster than the second, the last slow."
    ),
]
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


def _law(text: str) -> Any:
    """Read a law: scene (None: the scene's own), inelastic, or a restitution."""
    from nscd import ContactLaw

    if text == "scene":
        return None
    if text == "inelastic":
        return ContactLaw()
    try:
        restitution = float(text)
    except ValueError:
        restitution = math.nan
    if not 0 <= restitution < 1:
        raise typer.BadParameter(
            f"{text}: scene, inelastic or a restitution from 0 to below 1 is needed"
        )
    return ContactLaw(restitution=restitution)


def law_words(law: Any) -> str:
    """Say a law in a few words."""
    bouncing = "inelastic" if not law.restitution else f"restitution {law.restitution:g}"
    return f"{bouncing}, friction {law.friction:g}" if law.friction else bouncing


RigidLaw = Annotated[
    Any,
    typer.Option(
        parser=_law,
        metavar="LAW",
        help="Contact law of the percussions: scene (an impact has the scene's restitution), "
        "inelastic, or a restitution. Left out: scene.",
    ),
]
