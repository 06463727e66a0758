"""Options of commands: their types, the help of those that commands share, and what makes a command
of a function."""

import dataclasses
import functools
import inspect
import math
import re
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_type_hints

import typer
from typer.models import OptionInfo

from analysis.cli.app import drop_none, refuse
from analysis.support.files import or_shipped
from analysis.support.machine import cores
from analysis.support.reading import note

# What is said of an option of this name where its command says nothing else.
SHARED = {
    "scene": "Name of a scene, or its .toml file.",
    "out": "Folder for the results.",
    "runs": "Folder for the runs. Unchanged ones are used again.",
    "jobs": "Processes. Default: as many as cores.",
    "scheduler": "Address of a Dask scheduler, instead of this machine's cores.",
    "seed": "Seed of the random numbers.",
    "limits": "TOML file with further limits. May be repeated.",
    "mass": "Mass of each person in kg.",
    "unit": "Unit of the file, where it does not say.",
    "frame_rate": "Frames per second, where the file does not say.",
    "mass_unit": "Of a dump: kg (densities: kg/m³) or g (g/cm³). Default: kg, but of densities beside "
    "cm.",
    "fixed_type": "Of a dump: type of disks that do not move (LAMMPS: fix freeze). May be repeated.",
    "mol": "Of a dump: disks of one mol are one rigid body, or move alone.",
    "time_unit": "Unit of times in the file. Default: s.",
    "take_as_is": "Take speeds, distances and times that people do not have.",
    "openness": "For each reaction: nothing, whether equilibrium determines it, also its "
    "least and largest value, or its mean and spread over all admissible ones. The first is about "
    "20 times faster than the second. The last two are slow.",
    "contacts_columns": "Which columns of --contacts are meant: \"first=c_ids[1] second=c_ids[2] fx=c_f[2] "
    "fy=c_f[3]\". Also tx and ty (tangential forces), dist, is_wall, step and time_s.",
    "contacts_factor": "N for 1 in fx, fy of --contacts as the force of the first on the second. -1: N on the "
    "first. Default: found from the bodies and said.",
    "rigid_law": "Contact law of the percussions: scene (an impact has the scene's restitution), "
    "inelastic, or a restitution. Default: scene.",
}


def _number(needed: str, fits: Callable[[float], bool]) -> Callable[[str], float]:
    """What reads the number of an option, which must fit."""

    def read(text: str) -> float:
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not fits(number):
            raise typer.BadParameter(f"{text}: {needed} is needed")
        return number

    return read


def _count(text: str) -> int:
    fits = _number("a whole number above 0", lambda n: 0 < n < math.inf and n == int(n))
    return int(fits(text))


def _processes(text: str) -> int:
    number = _count(text)
    if number > cores():
        note(f"{text} processes", f"{cores()} are started, as many as cores")
    return min(number, cores())


def _path(text: str) -> Path:
    """Read a path: an option in its place is one whose own value was left out."""
    if str(text).startswith("--"):
        raise typer.BadParameter(
            f"{text}: a path is needed. Write ./{text} for a file of that name"
        )
    return Path(text)


def _input_file(text: str) -> Path:
    """Read the path of a file to be read. From any folder `scenes/…` are the product's own."""
    return or_shipped(_path(text))


def _law(text: str) -> Any:
    """Read a law: scene (None: the scene's own), inelastic, or a restitution."""
    from nscd import ContactLaw

    if text == "scene":
        return None
    needed = "scene, inelastic or a restitution from 0 to below 1"
    read = _number(needed, lambda number: 0 <= number < 1)
    return ContactLaw(restitution=0.0 if text == "inelastic" else read(text))


# Types of options, with what reads their words.
Positive = Annotated[float, _number("a finite number above 0", lambda x: 0 < x < math.inf)]
NotNegative = Annotated[
    float, _number("a finite number of at least 0", lambda x: 0 <= x < math.inf)
]
Factor = Annotated[float, _number("a finite number that is not 0", lambda x: x != 0 and math.isfinite(x))]
Share = Annotated[float, _number("a number from 0 to 1", lambda x: 0 <= x <= 1)]
Count = Annotated[int, _count]
Processes = Annotated[int, _processes]
Seed = Annotated[int, typer.Option(min=0)]
Replicates = Annotated[int, typer.Option(min=0, max=1000)]
Out = Annotated[Path, _path]
InputFile = Annotated[Path, _input_file]
RigidLaw = Annotated[Any, typer.Option(parser=_law, metavar="LAW")]
Indeterminacy = Literal["none", "determined", "ranges", "ensemble"]
Unit = Literal["m", "cm"]


def _reader(hint: Any) -> Any:
    """What reads a type of options, or the type in it."""
    if hasattr(hint, "__metadata__"):
        return hint.__metadata__[0]
    return next(filter(None, map(_reader, get_args(hint))), None)


# What is written for a type in --help.
METAVARS = {Path: "PATH", float: "NUMBER", int: "COUNT", str: "TEXT"}


def _types_of(kind: Any) -> list[Any]:
    """The type of an option and those in it: Path of `list[Path] | None`."""
    return [kind, *(one for each in get_args(kind) for one in _types_of(each))]


def _options_of(function: Any) -> dict[str, inspect.Parameter]:
    """The parameters of a command, or the fields of a dataclass, as typer takes them. Those that can
    only be given by name are options, others are arguments."""
    plain, hints = get_type_hints(function), get_type_hints(function, include_extras=True)
    parameters = inspect.signature(function).parameters
    stated, _ = _words_of(function)
    options: dict[str, inspect.Parameter] = {}
    for name, one in parameters.items():
        reader, kind = _reader(hints[name]), plain[name]
        make = typer.Option if one.kind is inspect.Parameter.KEYWORD_ONLY else typer.Argument
        if dataclasses.is_dataclass(kind):
            options |= _options_of(kind)
        elif kind is typer.Context:
            options[name] = one.replace(annotation=kind)
        else:
            info = copy(reader) if isinstance(reader, OptionInfo) else make(parser=reader)
            # a Literal lists its words itself
            words = [METAVARS[each] for each in _types_of(kind) if each in METAVARS]
            if make is typer.Option:
                info.metavar = info.metavar or (words[0] if words else None)
            if kind is bool:
                info = typer.Option(f"--{name.replace('_', '-')}")
            info.help = stated.get(name) or SHARED.get(name)
            options[name] = one.replace(annotation=Annotated[kind, info])
    return options


def _words_of(function: Callable[..., Any]) -> tuple[dict[str, str], str]:
    """What a docstring says of parameters, by their names, and all the rest of it."""
    names = "|".join(inspect.signature(function).parameters)
    line = re.compile(rf"^({names}): (.+(?:\n +\S.*)*)\n?", re.M)
    text = inspect.getdoc(function) or ""
    stated = {one[1]: " ".join(one[2].split()) for one in line.finditer(text)}
    return stated, re.sub(r"\n{3,}", "\n\n", line.sub("", text)).strip()


def with_options(command: Callable[..., None]) -> Callable[..., None]:
    """Make a function a command. Its parameters, and the fields of those that are dataclasses, are
    options. Their help is in the docstrings of both, or is shared by all commands."""
    hints = get_type_hints(command)
    shared: dict[str, Any] = {
        name: hint for name, hint in hints.items() if dataclasses.is_dataclass(hint)
    }
    # no argument follows an option in a signature, and typer takes all by name
    options = sorted(_options_of(command).values(), key=lambda one: one.kind)

    @functools.wraps(command)
    def called(*values: Any, **named: Any) -> None:
        bound = signature.bind(*values, **named)
        bound.apply_defaults()
        arguments = bound.arguments
        for name, kind in shared.items():
            fields = {key.name: arguments.pop(key.name) for key in dataclasses.fields(kind)}
            arguments[name] = kind(**fields)
        command(**arguments)

    signature = inspect.Signature(options)
    called.__signature__ = signature  # type: ignore[attr-defined]
    called.__annotations__ = {one.name: one.annotation for one in options}
    _, called.__doc__ = _words_of(command)
    return called


@dataclass(frozen=True, kw_only=True)
class OfDump:
    """What is said of a dump that it does not say itself."""

    time_step: Positive | None = None
    unit: Literal["m", "cm", "mm"] | None = None
    mass_unit: Literal["kg", "g"] | None = None
    fixed_type: list[Count] | None = None
    mol: Literal["rigid", "single"] | None = None

    def of_dump(self) -> dict[str, Any]:
        """Give it as `open_bodies` calls it."""
        arguments = {one.name: getattr(self, one.name) for one in dataclasses.fields(OfDump)}
        return drop_none(**arguments | {"fixed_type": tuple(self.fixed_type or ()) or None})


@dataclass(frozen=True, kw_only=True)
class DumpOptions(OfDump):
    """How the contact problem of a frame is taken from a dump.

    room: Room or scene file (.toml) with the walls and the drive. Default: scene.toml beside
        the dump.
    left_velocity: desired (p/τ is a force), dump (an impact) or free (u + Δt F/m). Default:
        desired where there is a drive or a body force, and dump of an impact.
    friction: Coulomb's μ of people with each other. Default: the room's.
    wall_friction: μ of people with walls. Default: --friction.
    window: Δt of --left-velocity free, in s.
    time_step: Time step of the simulation in s. Default: that of run.json beside the dump.
        Without either the table has steps in place of times.
    unit: Unit of lengths in the dump, and of velocities per second. Default: its own, or m.
    contact_tolerance: Gap in m up to which disks are in contact. Default: the room's, or what the last
        digits of the dump allow, at least 1e-6.
    largest_overlap: Deepest overlap that is taken, as a share of the smaller radius. Default:
        0.5.
    tolerance: Residual up to which a frame counts as solved."""

    room: Annotated[Path | None, typer.Option("--room", "--walls", parser=_input_file)] = None
    left_velocity: Literal["desired", "dump", "free"] | None = None
    friction: NotNegative | None = None
    wall_friction: NotNegative | None = None
    window: Positive | None = None
    contact_tolerance: Positive | None = None
    largest_overlap: Positive | None = None
    tolerance: Positive = 1e-8

    def setting(self) -> dict[str, Any]:
        """Give what is said of the problem itself, as `Setting` calls it."""
        names = ("left_velocity", "window", "largest_overlap", "friction", "wall_friction")
        return drop_none(**{name: getattr(self, name) for name in (*names, "contact_tolerance")})


@dataclass(frozen=True, kw_only=True)
class OfFile(OfDump):
    """How frames are taken from a file that is no run: a LAMMPS dump of disks, or a trajectory.

    frames: first:last:step, both ends included. Default: of a film about 50, else all.
    room: Of a file: TOML file with walls and drive. Default: scene.toml beside a dump. Where it has
        no walls, a trajectory of JuPedSim (SQLite, HDF5) or of Jülich's archive (HDF5) gives
        its own. Without a drive or a body force percussions are those of the measured velocities,
        not forces.
    contacts: Of a dump: dump of its own contact forces in N. Columns: first second is_wall nx ny
        overlap fx fy. Or LAMMPS' own dump local of pairs, a table, or exaDEM's folder. Default:
        NAME_contacts.dump beside NAME.dump, or contacts.dump beside bodies.dump. `exposure` sums
        these instead, where given.
    mass: Of a trajectory: mass of each person in kg. Default: 75.
    unit: Unit of lengths, where the file does not say. Of a dump also mm.
    frame_rate: Of a trajectory: frames per second, where the file does not say.
    columns: Of a trajectory as text: what each column is, as 'frame id x y', where names do not say.
    time_unit: Of a trajectory: unit of its times. Default: s.
    take_as_is: Of a trajectory: take speeds, distances and times that people do not have.
    time_step: Of a dump: time step of the simulation in s, where the dump has no times."""

    frames: str | None = None
    room: InputFile | None = None
    contacts: InputFile | None = None
    contacts_columns: str | None = None
    contacts_factor: Factor | None = None
    mass: Positive | None = None
    frame_rate: Positive | None = None
    columns: str | None = None
    time_unit: Literal["s", "ms"] | None = None
    take_as_is: Annotated[bool | None, typer.Option("--take-as-is")] = None

    def refuse_run(self, **others: object) -> None:
        """Raise ValueError for the first of these options that is given beside a run."""
        selected = vars(self) | {"fixed_type": self.fixed_type or None}
        refuse("only of a dump or a trajectory file", **selected, **others)

    def file_options(self, radius: float | None = None) -> Any:
        """Give it as `analysis.studies.film.files.FileOptions`, with the radius (m) of heads."""
        from analysis.studies.film.files import FileOptions

        return FileOptions(radius=radius, **vars(self) | {"fixed_type": tuple(self.fixed_type or ())})


def one_dump(files: list[Path]) -> Path:
    """Give the one file. Raises ValueError that says how several, or those of a folder, become one."""
    if len(files) == 1 and not files[0].is_dir():
        return files[0]
    some = files[0] / "*" if len(files) == 1 else files[0].with_name(f"*{files[0].suffix}")
    message = "a folder" if len(files) == 1 else f"one of {len(files)} files"
    raise ValueError(
        f"{files[0]}: {message}. One file is read. Join those of single steps: cat $(ls -v {some}) > "
        "joined.dump"
    )


def is_run(target: Path) -> bool:
    """Tell whether a path is a folder, as of a run. Raises ValueError where nothing is there."""
    if not target.exists():
        raise ValueError(f"{target}: no such file or folder")
    return target.is_dir()
