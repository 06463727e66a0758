"""The engines: each is a module that fits `Engine`; what simulates a scene with one is in `run`."""

import functools
from pathlib import Path
from typing import Protocol

from analysis.engines import lammps, rigid, yade
from analysis.engines.process import Command, said
from analysis.engines.record import EngineError, RunRecord, Timing
from analysis.scene.scene import Scene

__all__ = [
    "ENGINES",
    "PENALTY",
    "Engine",
    "EngineError",
    "RunRecord",
    "engine",
    "installed",
    "why_not",
]


class Engine(Protocol):
    """Say what every engine offers.

    NAME: in commands and records
    TITLE: in sentences
    COMMAND: the program
    ASK: its option that says the version
    INSTALL: the command that installs it
    RESUMES: whether it goes on from the dumps of an interrupted run that are in its folder"""

    NAME: str
    TITLE: str
    COMMAND: str
    ASK: str
    INSTALL: str
    RESUMES: bool

    def find(self) -> Path | None:
        """Return where its program is."""

    def version(self) -> str | None:
        """Ask the program for its version; None where it is missing or does not start."""

    def deck_digest(self) -> str:
        """Return the digest of the decks or scripts that it runs."""

    def timing(self, scene: Scene) -> Timing:
        """Return when it steps and writes. Raises ValueError for steps that nobody can count."""

    def setting(self, scene: Scene) -> str:
        """Return what tells its runs of one scene apart, as a part of a folder's name."""

    def check(self, scene: Scene) -> None:
        """Raise EngineError naming the field of a scene that it cannot run."""

    def write_input(self, scene: Scene, decks: Path) -> None:
        """Write all that it reads, but for the scene itself, into a new folder `decks`."""

    def command(
        self, folder: Path, time_step_s: float, *, decks: str, out: str = ".", guard: bool = True
    ) -> Command:
        """Return the command that runs `scene.toml` of the folder with the input in its subfolder
        `decks` and writes the dumps into its subfolder `out`."""

    def collect(self, scene: Scene, folder: Path) -> None:
        """Bring what a run left in the folder into the form of all engines."""


# Those with springs, whose runs are soft; their contacts have forces at each instant.
PENALTY: tuple[Engine, ...] = (lammps, yade)
ENGINES: tuple[Engine, ...] = (*PENALTY, rigid)


def engine(name: str) -> Engine:
    """Return the engine of that name. Raises EngineError listing those there are."""
    for known in ENGINES:
        if name == known.NAME:
            return known
    raise EngineError(
        f"unknown engine {name!r}; there are: {', '.join(known.NAME for known in ENGINES)}"
    )


def installed(name: str) -> str:
    """Return the version of the engine that is here. Raises EngineError, with the command that
    installs it, where it is missing or does not start."""
    chosen = engine(name)
    path = chosen.find()
    if path is None:
        raise EngineError(
            f"{chosen.TITLE} (the command {chosen.COMMAND}) is not found; "
            f"install it with: {chosen.INSTALL}"
        )
    known = _version(name, path)
    if known is None:
        raise EngineError(f"{why_not(chosen)}; reinstall it with: {chosen.INSTALL}")
    return known


def why_not(chosen: Engine) -> str:
    """Say why an engine that is there does not start, in its own last words."""
    path = chosen.find()
    lines = said(path, chosen.ASK).split("\n") if path else []
    # two: what it said, and by what it was ended
    last = [line.strip() for line in lines if line.strip()][-2:] or ["without a word"]
    return f"{path} does not start ({'; '.join(last)})"


@functools.cache
def _version(name: str, path: Path) -> str | None:
    """Asked once in a process: asking starts the engine."""
    return engine(name).version()
