"""The paper's discrete section (2): which figures there are, and how each is made and what it
costs."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.engines.ahead import Cost, EngineRun, make_ahead
from analysis.pages.section import Section
from analysis.paper.built import Built
from analysis.paper.discrete.fig1_four_disks import section as four_disks
from analysis.paper.discrete.fig2_corridor import section as corridor
from analysis.paper.discrete.fig3_chains import section as chains
from analysis.paper.discrete.fig4_fig5_arches import fig4 as arch
from analysis.paper.discrete.fig4_fig5_arches import fig5 as arch_masses
from analysis.paper.discrete.fig6_rivals import section as rivals
from analysis.support.progress import Progress


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """A figure of the paper: its number, the engine runs that it needs, and what makes its section
    of them."""

    number: str
    engine_runs: Callable[[Path], list[EngineRun]]
    build: Callable[[Path, Progress | None], Section]


PARTS: Sequence[Part] = (
    Part(number="1", engine_runs=four_disks.engine_runs, build=four_disks.build),
    Part(number="2", engine_runs=corridor.engine_runs, build=corridor.build),
    Part(
        number="3", engine_runs=lambda runs: [], build=lambda runs, progress: chains.build(progress)
    ),
    Part(number="4", engine_runs=arch.engine_runs, build=arch.build),
    Part(number="5", engine_runs=arch_masses.engine_runs, build=arch_masses.build),
    Part(number="6", engine_runs=rivals.engine_runs, build=rivals.build),
)


def build_discrete(
    runs: Path, figures: Iterable[str] | None = None, progress: Progress | None = None
) -> list[Built]:
    """The sections of the chosen figures (all by default) in the paper's order; engine runs first,
    several at once.

    Raises ValueError for a figure that the section does not have.
    """
    known = [part.number for part in PARTS]
    wanted = list(known if figures is None else figures)
    for number in wanted:
        if number not in known:
            raise ValueError(f"figure: {number}; the discrete section has {', '.join(known)}")
    parts = [part for part in PARTS if part.number in wanted]
    needed = {part.number: part.engine_runs(runs) for part in parts}
    costs = make_ahead([run for part in parts for run in needed[part.number]], progress)
    built = []
    for done, part in enumerate(parts):
        if progress:
            progress("sections", done / len(parts))
        started = time.process_time()
        section = part.build(runs, progress)
        spent = time.process_time() - started
        # a run that several figures share counts for the first of them
        mine = [
            cost for run in needed[part.number] if (cost := costs.pop(run.folder, None)) is not None
        ]
        built.append(Built(section=section, cpu_seconds=spent, engines=sum(mine, Cost())))
    if progress:
        progress("sections", 1.0)
    return built
