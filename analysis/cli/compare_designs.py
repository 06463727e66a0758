"""What `percussions report --compare` does."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import typer

from analysis.cli.app import command_line, lasting, progress, refuse, say_runs, show_page
from analysis.cli.options import Positive

# Minutes for --until where none are given, and options of a report that does not compare designs.
MINUTES, NOT_COMPARED = 10.0, ("stiffness", "last", "rigid_law", "sheet", "scheduler")


@dataclass(frozen=True, kw_only=True)
class Comparing:
    """Say whether and how designs are compared.

    compare: Decide between designs of one room: each further scene against the first.
    until: With --compare: more replicates until all is decided, or a difference would be seen. Write
        it as decided, "decided kN/m" (of this unit), "0.2 kN/m", or 10% of the first design.
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

    def write(
        self, scenes: list[str], engine: list[str], seeds: int, limits: tuple[Path, ...], runs: Path, out: Path
    ) -> None:
        """Run the replicates that are missing, compare, write the page and say the verdict. Exits with
        1 where a run failed, or what --until asks for stays open."""
        from analysis.engines import engine as engine_named
        from analysis.scene.scene import read_scene
        from analysis.studies.motion.design_differences import QUANTITIES, Target
        from analysis.studies.motion.inference import FEWEST
        from analysis.studies.report.designs_page import (
            Compared,
            Forecast,
            Replicates,
            designs_of,
            write_designs,
        )

        if len(engine) > 1:
            raise ValueError("--engine: designs are compared by one engine")
        engine_named(engine[0])
        target = Target.parse(self.until) if self.until is not None else None
        if target is None:
            refuse("only with --until", minutes=self.minutes)
        if seeds < FEWEST:
            raise ValueError(f"--seeds {seeds}: a comparison needs {FEWEST} replicates or more")
        designs = designs_of([read_scene(scene) for scene in scenes], unpaired=self.unpaired)
        first, names = designs[0].scene, [design.name for design in designs]
        for name in (name for name, scene in designs if scene.name != name):
            print(f"note: {name}: its people stand where those of {names[0]} do", file=sys.stderr)
        seconds = 60 * (self.minutes or MINUTES)

        def say(ends: Forecast) -> None:
            for number, key, end in ends:
                title = QUANTITIES[key].title.format(out="so many")
                takes = f"no number of replicates in {lasting(seconds)} shows it"
                if end:
                    takes = f"about {end} replicates, {lasting((end - of.made) * of.seconds)}"
                print(f"open: {names[number]}, {title}: {takes}", file=sys.stderr)

        with progress() as bars:
            of = Replicates(designs=designs, engine=engine[0], out=runs, progress=bars)
            # who pushes for ever soon forgets the start (docs/results/designs.md)
            of.paired = bool(first.drive and first.drive.keeps_distance) and not self.unpaired
            say_runs(of.wanted(seeds).values(), jobs=None)
            interims, still = of.compare(seeds, target, seconds, say)
            done = Compared(of=of, interims=interims, still=still, limits=limits)
            page, formatted = write_designs(done, out, command_line(), bars)
        print(*(verdict.replace("**", "") for verdict in formatted), sep="\n")
        for failure in of.failures:
            print(f"failed: {failure}", file=sys.stderr)
        show_page(page)
        raise typer.Exit(bool(of.failures or still))
