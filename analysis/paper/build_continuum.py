"""The paper's continuum section (3): which figures there are, and how they are made, several at
once."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.pages.section import Section
from analysis.paper.built import Built
from analysis.paper.continuum.bridge import section as bridge
from analysis.paper.continuum.fig7_border import section as crowd_border
from analysis.paper.continuum.fig8_turbulence import section as turbulence
from analysis.paper.continuum.fig9_exit_pressure import section as exit_pressure
from analysis.paper.continuum.fig10_density import section as density_laws
from analysis.paper.continuum.fig11_left_velocities import section as left_velocities
from analysis.paper.continuum.mesh import section as mesh_precision
from analysis.paper.continuum.solid_chain import section as solid_chain
from analysis.paper.kept_sections import edition, keep, kept
from analysis.support.parallel import Task, do_all, workers
from analysis.support.progress import Progress


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """A figure of the paper, or a study beside them: its number, what makes it, and about how many
    CPU seconds that takes."""

    number: str
    build: Callable[[Progress | None], Section]
    seconds: float


PARTS: Sequence[Part] = (
    Part(number="7", build=crowd_border.build, seconds=8),
    Part(number="3.2.1", build=solid_chain.build, seconds=2),
    Part(number="8", build=turbulence.build, seconds=70),
    Part(number="9", build=exit_pressure.build, seconds=10),
    Part(number="10", build=density_laws.build, seconds=20),
    Part(number="11", build=left_velocities.build, seconds=6),
    Part(number="mesh", build=mesh_precision.build, seconds=30),
    Part(number="bridge", build=bridge.build, seconds=110),
)


def build_continuum(
    runs: Path, figures: Iterable[str] | None = None, progress: Progress | None = None
) -> list[Built]:
    """The sections of the chosen figures (all by default) in the paper's order, on as many cores as
    there are.

    Finished sections are kept in `runs`, and taken from there as long as the product is the same.
    Raises ValueError for a figure that the section does not have."""
    known = [part.number for part in PARTS]
    wanted = list(known if figures is None else figures)
    for number in wanted:
        if number not in known:
            raise ValueError(f"figure: {number}; the continuum section has {', '.join(known)}")
    parts = [part for part in PARTS if part.number in wanted]
    before = {part.number: kept(folder_of(runs, part)) for part in parts}
    missing = [part for part in parts if before[part.number] is None]
    if len(missing) == 1:
        _make(missing[0].number, runs, edition(), progress)
    elif missing:
        tasks = [
            Task(call=_make, arguments=(part.number, runs, edition()), work=part.seconds)
            for part in missing
        ]
        with workers() as executor:
            do_all(tasks, executor, "sections", progress)
    built = []
    for part in parts:
        found = before[part.number] or kept(folder_of(runs, part))
        if found is None:
            raise OSError(f"{folder_of(runs, part)}: a section was made but cannot be read there")
        built.append(Built(section=found[0], cpu_seconds=found[1], kept=part not in missing))
    return built


def folder_of(runs: Path, part: Part) -> Path:
    """Where a part's section is kept."""
    return runs / "paper_continuum" / part.number


def _make(number: str, runs: Path, made_by: str, progress: Progress | None = None) -> None:
    """Build a section and keep it; in a process of its own it has nobody to tell its progress
    to."""
    part = next(part for part in PARTS if part.number == number)
    started = time.process_time()
    section = part.build(progress)
    keep(section, time.process_time() - started, folder_of(runs, part), made_by)
