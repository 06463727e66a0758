"""The engines, each an `Engine`; what simulates a scene with one is in `run`."""

import functools
from pathlib import Path

from analysis.engines.base import Engine
from analysis.engines.lammps import Lammps
from analysis.engines.process import output_of
from analysis.engines.record import EngineError, RunRecord
from analysis.engines.rigid import Rigid
from analysis.engines.yade import Yade

__all__ = [
    "ENGINES", "LAMMPS", "PENALTY", "RIGID", "YADE", "Engine", "EngineError", "RunRecord", "engine",
    "installed", "why_not",
]  # fmt: skip


LAMMPS, YADE, RIGID = Lammps(), Yade(), Rigid()
# Those with springs, whose runs are soft; their contacts have forces at each instant.
PENALTY: tuple[Engine, ...] = (LAMMPS, YADE)
ENGINES: tuple[Engine, ...] = (*PENALTY, RIGID)


def engine(name: str) -> Engine:
    """Return the engine of that name. Raises EngineError listing those there are."""
    for each in ENGINES:
        if name == each.NAME:
            return each
    raise EngineError(
        f"unknown engine {name!r}. There are: {', '.join(engine_module.NAME for engine_module in ENGINES)}"
    )


def installed(name: str) -> str:
    """Return the version of the engine that is here. Raises EngineError, with the command that
    installs it, where it is missing or does not start."""
    chosen = engine(name)
    path = chosen.find()
    if path is None:
        raise EngineError(
            f"{chosen.TITLE} (the command {chosen.COMMAND}) is not found. "
            f"Install it with: {chosen.INSTALL}"
        )
    version = _version(name, path)
    if version is None:
        raise EngineError(f"{why_not(chosen)}. Reinstall it with: {chosen.INSTALL}")
    return version


def why_not(chosen: Engine) -> str:
    """Say why an engine that is there does not start, in its own last words."""
    path = chosen.find()
    lines = output_of(path, chosen.ASK).split("\n") if path else []
    # two: what it said, and by what it was ended
    last = [line.strip() for line in lines if line.strip()][-2:] or ["without a word"]
    return f"{path} does not start ({'; '.join(last)})"


@functools.cache
def _version(name: str, path: Path) -> str | None:
    """Asked once in a process: asking starts the engine."""
    return engine(name).version()
