"""What `percussions report --compare` does."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import typer

from analysis.cli.app import command_line, lasting, progress, refuse, say_expected, show_page
from analysis.cli.options import Positive
from analysis.support.machine import cores

# Minutes for --until where none are given.
MINUTES = 10.0
# Of a report that does not compare designs.
NOT_COMPARED = ("stiffness", "last", "rigid_law", "sheet")


@dataclass(frozen=True, kw_only=True)
class Comparing:
    """Say whether and how designs are compared.

    compare: Decide between designs of one room: each further scene against the first.
    until: With --compare: more replicates until every quantity is decided ("decided kN/m": those in
        this unit), or a difference would be seen: "0.2 kN/m", or 10% of the first design.
    minutes: With --until: for so long. Default: 10.
    unpaired: With --compare: take designs with other people or another push, too."""

    compare: bool = False
    until: str | None = None
    minutes: Positive | None = None
    unpaired: bool = False

    def refuse_alone(self) -> None:
        """Raise ValueError for what is said of a comparison where there is none."""
        more = {"until": self.until, "minutes": self.minutes, "unpaired": self.unpaired or None}
        refuse("only with --compare", **more)


@dataclass(frozen=True, kw_only=True)
class Run:
    """Say how designs are run: engines and replicates before the first look, as typed."""

    engine: list[str] | None
    seeds: int
    limits: tuple[Path, ...]
    scheduler: str | None
    runs: Path


def compare_designs(scenes: list[str], how: Comparing, run: Run, out: Path) -> None:
    """Run the replicates that are missing, compare, write the page and say the verdict. Exits with 1
    where a run failed, or what --until asks for stays open."""
    from analysis.advice.library import expected_seconds
    from analysis.engines import engine as engine_named
    from analysis.engines.rigid import NAME as RIGID
    from analysis.motion.designs import QUANTITIES, Asked
    from analysis.motion.inference import FEWEST
    from analysis.report.decision import Compared, write_designs
    from analysis.report.designs import Forecast, Replicates, Stop, compare, designs_of
    from analysis.scene.scene import read_scene

    engine, *more = run.engine or [RIGID]
    if more:
        raise ValueError("--engine: designs are compared by one engine")
    engine_named(engine)
    asked = Asked.parse(how.until) if how.until is not None else None
    if asked is None:
        refuse("only with --until", minutes=how.minutes)
    if run.seeds < FEWEST:
        raise ValueError(f"--seeds {run.seeds}: a comparison needs {FEWEST} replicates or more")
    designs = designs_of([read_scene(scene) for scene in scenes], unpaired=how.unpaired)
    names = [design.name for design in designs]
    for design in designs:
        if design.moved:
            print(f"note: {design.name}: its people stand where those of {names[0]} do", file=sys.stderr)
    # who pushes for ever soon forgets the start (docs/results/designs.md)
    alike = [d.scene.drive is not None and d.scene.drive.keeps_distance for d in designs]
    paired = all(alike) and not how.unpaired
    stop = Stop(asked=asked, seconds=60 * (how.minutes or MINUTES)) if asked else None

    def say(ends: Forecast) -> None:
        for number, key, end in ends:
            title = QUANTITIES[key].title.format(out="so many")
            takes = f"no number of replicates in {lasting(stop.seconds if stop else 0)} shows it"
            if end:
                takes = f"about {end} replicates, {lasting((end - of.made) * of.seconds)}"
            print(f"open: {names[number]}, {title}: {takes}", file=sys.stderr)

    with progress() as bars:
        of = Replicates(
            designs=designs, engine=engine, out=run.runs, progress=bars, scheduler=run.scheduler
        )
        missing = [one for one in of.wanted(run.seeds).values() if not one.is_finished()]
        seconds = sum(expected_seconds(one.scene, one.engine) for one in missing)
        say_expected(seconds, f"{len(missing)} runs of engines", cores())
        looks, still = compare(of, run.seeds, stop, say, paired=paired)
        done = Compared(
            of=of, looks=looks, asked=asked, still=still, paired=paired, limits=run.limits
        )
        page, said = write_designs(done, out, command_line(), bars)
    for verdict in said:
        print(verdict.replace("**", ""))
    for failure in of.failures:
        print(f"failed: {failure}", file=sys.stderr)
    show_page(page)
    raise typer.Exit(bool(of.failures or still))
