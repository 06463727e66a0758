"""Options that commands share."""

import dataclasses
import functools
import inspect
import math
import re
from collections.abc import Callable, Iterable
from copy import copy
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_type_hints

import typer

from analysis.cli.app import drop_none, input_file, not_negative, positive


def _parameters_in(names: Iterable[str], text: str) -> tuple[dict[str, str], str]:
    """What a docstring says of parameters, by their names, and all the rest of it."""
    line = rf"^({'|'.join(names)}): (.+(?:\n +\S.*)*)\n?"
    found = {one[1]: " ".join(one[2].split()) for one in re.finditer(line, text, re.M)}
    return found, re.sub(r"\n{3,}", "\n\n", re.sub(line, "", text, flags=re.M)).strip()


def _with_help(field: inspect.Parameter, hint: Any, said: str | None) -> inspect.Parameter:
    """A parameter as typer takes it: an option where it has a default."""
    kind, *infos = get_args(hint) if hasattr(hint, "__metadata__") else (hint,)
    default = field.default is not inspect.Parameter.empty
    info = copy(infos[0]) if infos else typer.Option() if default else typer.Argument()
    if said and not info.help:
        info.help = said
    known = bool(infos) or bool(said)
    return field.replace(annotation=Annotated[kind, info] if known else hint)


def with_options(command: Callable[..., None]) -> Callable[..., None]:
    """Make a function a command: its parameters, and the fields of those that are dataclasses, are
    options with the help that the docstrings of both have."""
    hints = get_type_hints(command, include_extras=True)
    own, options = inspect.signature(command).parameters, dict[str, inspect.Parameter]()
    shared = {name: hints[name] for name in own if dataclasses.is_dataclass(hints[name])}
    said, words = _parameters_in(own, inspect.getdoc(command) or "")
    for name, one in own.items():
        fields, kinds, told = {name: one}, hints, said
        if name in shared:
            fields = dict(inspect.signature(shared[name]).parameters)
            kinds = get_type_hints(shared[name], include_extras=True)
            told, _ = _parameters_in(fields, inspect.getdoc(shared[name]) or "")
        for key, field in fields.items():
            made = _with_help(field, kinds[key], told.get(key))
            options[key] = made.replace(kind=one.kind)

    @functools.wraps(command)
    def called(*values: Any, **named: Any) -> None:
        bound = signature.bind(*values, **named)
        bound.apply_defaults()
        given = bound.arguments
        for name, kind in shared.items():
            given[name] = kind(
                **{key.name: given.pop(key.name) for key in dataclasses.fields(kind)}
            )
        command(**given)

    signature = inspect.Signature(list(options.values()))
    called.__signature__ = signature  # type: ignore[attr-defined]
    called.__annotations__ = {key: one.annotation for key, one in options.items()}
    called.__doc__ = words
    return called


@dataclass(frozen=True, kw_only=True)
class Taken:
    """How the contact problem of a frame is taken from a dump.

    room: Room or scene file (.toml) with the walls and the drive; scene.toml beside the dump if
        there.
    left_velocity: desired: p/τ is a force; dump: an impact; free: u + Δt F/m. Left out: desired
        where there is a drive.
    friction: Coulomb's μ of people with each other; the scene's own if left out, 0 in a room.
    wall_friction: μ of people with walls; --friction if left out.
    window: Δt of --left-velocity free, in s.
    time_step: Time step of the simulation in s (from run.json beside the dump if there; without
        either the table has steps in place of times).
    unit: Unit of lengths in the dump, and of velocities per second; m if left out. Masses are kg.
    contact_tolerance: Gap in m up to which disks are in contact; the room's or 1e-6 if left out.
    largest_overlap: Deepest overlap that is taken, as a share of the smaller radius; 0.5 if left
        out.
    tolerance: Residual up to which a frame counts as solved."""

    room: Annotated[Path | None, typer.Option("--room", "--walls", parser=input_file)] = None
    left_velocity: Literal["desired", "dump", "free"] | None = None
    friction: Annotated[float | None, typer.Option(parser=not_negative)] = None
    wall_friction: Annotated[float | None, typer.Option(parser=not_negative)] = None
    window: Annotated[float | None, typer.Option(parser=positive)] = None
    time_step: Annotated[float | None, typer.Option(parser=positive)] = None
    unit: Literal["m", "cm", "mm"] | None = None
    contact_tolerance: Annotated[float | None, typer.Option(parser=positive)] = None
    largest_overlap: Annotated[float | None, typer.Option(parser=positive)] = None
    tolerance: Annotated[float, typer.Option(parser=positive)] = 1e-8

    def setting(self) -> dict[str, Any]:
        """Give what is said of the problem itself, as `Setting` calls it."""
        names = ("left_velocity", "window", "largest_overlap", "friction", "wall_friction")
        return drop_none(**{name: getattr(self, name) for name in (*names, "contact_tolerance")})

    def of_dump(self) -> dict[str, Any]:
        """Give what is said of the dump."""
        return drop_none(time_step=self.time_step, unit=self.unit)


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
