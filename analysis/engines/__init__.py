"""The engines: each module has NAME, find(), version(), prepare(scene, folder) and run(folder)."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from analysis.engines import lammps, yade
from analysis.engines.process import Progress
from analysis.engines.record import EngineError, RunRecord
from analysis.scene.scene import Scene

__all__ = ["ENGINES", "Engine", "EngineError", "RunRecord", "engine"]


class Engine(Protocol):
    """What every engine offers."""

    NAME: str

    def find(self) -> Path | None:
        """Where its command is."""

    def version(self) -> str | None:
        """Its version."""

    def deck_digest(self) -> str:
        """Of the decks or scripts that it runs."""

    def prepare(self, scene: Scene, folder: Path) -> None:
        """Prepare a run whose results will be in `folder`."""

    def run(self, folder: Path, *, progress: Progress | None = None) -> RunRecord:
        """Run what was prepared."""


ENGINES: tuple[Engine, ...] = (lammps, yade)


def engine(name: str) -> Engine:
    """The engine of that name. Raises EngineError listing those there are."""
    for known in ENGINES:
        if name == known.NAME:
            return known
    raise EngineError(
        f"unknown engine {name!r}; there are: {', '.join(known.NAME for known in ENGINES)}"
    )
