"""Designs of one room compared: the same people in each, their replicates, and as many of them as the
question needs."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

from analysis.engines.run import EngineRun, run_ahead
from analysis.motion.designs import (
    Asked,
    Difference,
    Outcome,
    Table,
    looks,
    measured,
    needed,
    table_of,
)
from analysis.motion.inference import FEWEST, LEVEL
from analysis.report.runs import moves, replicate_run, with_own_noise
from analysis.scene.distance import Distance
from analysis.scene.scene import Scene, SceneError
from analysis.scene.shipped_scenes import variant
from analysis.support.machine import cores
from analysis.support.parallel import Progress, Task, do_all, workers
from nscd.stepping import StepError

# So few runs that are there are read in this process: others would take longer to start.
ALONE = 12
# So many replicates of a design at most.
MOST = 1000
# Keys of a drive that say how people push.
PUSH = ("speed_m_per_s", "relaxation_time_s", *Distance.model_fields, "stops", "aim")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Design:
    """Name a design and the scene that is run for it; moved: whether its people were put where those
    of the first design stand."""

    name: str
    scene: Scene
    moved: bool = False

    def run(self, engine: str, out: Path, number: int) -> EngineRun:
        """Name the run of a replicate. Raises SceneError and StepError where there is none."""
        scene = with_own_noise(variant(self.scene, number), number).with_run(impulses=True)
        return replicate_run(scene, engine, out, number)


def designs_of(scenes: Sequence[Scene], *, unpaired: bool = False) -> list[Design]:
    """Make scenes designs that can be compared. The people of each stand where those of the first do,
    as far as they fit there.

    unpaired: take designs with other people or another push, too

    Raises ValueError naming the scene and what is not the same."""
    first, names = scenes[0], [one.name for one in scenes]
    if len(scenes) < 2:
        raise ValueError("--compare: two designs at least are needed, the first to be compared with")
    for one in scenes:
        if names.count(one.name) > 1:
            raise ValueError(f"--compare: two designs are called {one.name}. Rename one file")
        if not moves(one):
            raise ValueError(
                f"--compare: {one.name} has no quantity in common with others. Its people are not "
                "driven, or it is an impact"
            )
    made = [Design(name=first.name, scene=first)]
    for one in scenes[1:]:
        for key in ("duration_s", "frames"):
            if (mine := getattr(one.run, key)) != (of := getattr(first.run, key)):
                raise ValueError(
                    f"--compare: {one.name}: run.{key}: {mine:g}, but {of:g} in {first.name}"
                )
        unlike = _unlike(one, first)
        if unlike and not unpaired:
            raise ValueError(
                f"--compare: {one.name}: {unlike} in {first.name}. --unpaired compares them all the same"
            )
        made.append(Design(name=one.name, scene=one) if unlike else _where(one, first))
    return made


def _unlike(one: Scene, first: Scene) -> str:
    """What is not the same of the people of two scenes, their bodies and their push."""
    mine, theirs = one.snapshot, first.snapshot
    if len(mine) != len(theirs):
        return f"{len(mine)} disks, but {len(theirs)}"
    for name in ("ids", "radius", "mass"):
        unlike = getattr(mine, name) != getattr(theirs, name)
        if unlike.any():
            return f"another {name} of disk {mine.ids[unlike.argmax()]} than"
    parts: list[tuple[str, object, object, Sequence[str]]] = [
        ("contact", one.contact, first.contact, [*type(one.contact).model_fields]),
        ("drive", one.drive, first.drive, PUSH),
    ]
    for part, new, old, keys in parts:
        for key in keys:
            if (given := getattr(new, key)) != (was := getattr(old, key)):
                return f"{part}.{key}: {given}, but {was}"
    return "" if one.body_force == first.body_force else "another body_force than"


def _where(one: Scene, first: Scene) -> Design:
    """The design with its people where those of the first stand, unless a wall is in the way."""
    if (one.snapshot.position == first.snapshot.position).all():
        return Design(name=one.name, scene=one)
    name = f"{one.name}_as_{first.name}"
    with suppress(SceneError):
        there = one.model_copy(update={"snapshot": first.snapshot, "name": name}).rerouted()
        there.check(one.name)
        return Design(name=one.name, scene=there, moved=True)
    return Design(name=one.name, scene=one)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Look:
    """Hold what is known after so many replicates of each design.

    alpha: how often any interval of this look may miss
    differences: of each design after the first, by QUANTITIES"""

    replicates: int
    alpha: float
    table: Table
    differences: Sequence[Mapping[str, Difference]]

    def still_open(self, asked: Asked) -> list[tuple[int, str, Difference]]:
        """List what is asked for and not answered: number of the design, quantity and difference."""
        return [
            (number, key, one)
            for number, every in enumerate(self.differences, start=1)
            for key, one in every.items()
            if asked.of(key) and not asked.answered(one)
        ]


@dataclass(slots=True, kw_only=True, eq=False)
class Replicates:
    """Run replicates of designs, and read each once.

    outcomes: by number of the design and of the replicate, of runs that ended well
    seconds: s, of all cores for one replicate of every design, as measured"""

    designs: Sequence[Design]
    engine: str
    out: Path
    progress: Progress | None = None
    scheduler: str | None = None
    made: int = 0
    outcomes: dict[tuple[int, int], Outcome] = field(default_factory=dict)
    runs: dict[tuple[int, int], EngineRun] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)
    seconds: float = 0.0

    def wanted(self, number: int) -> dict[tuple[int, int], EngineRun]:
        """Name the runs that are still to be read for so many replicates of each design."""
        new = dict[tuple[int, int], EngineRun]()
        for at in product(range(len(self.designs)), range(self.made, number)):
            try:
                new[at] = self.designs[at[0]].run(self.engine, self.out, at[1])
            except (SceneError, StepError) as error:  # no draw gives these people room
                said = f"{self.designs[at[0]].name}, replicate {at[1]}: {error}"
                self.failures += [said] * (said not in self.failures)
        return new

    def until(self, number: int) -> None:
        """Go on to so many replicates of each design, on all cores."""
        new = self.wanted(number)
        runs = list(new.values())
        missing = not all(run.is_finished() for run in runs)
        tasks = [Task(call=measured, arguments=(run,), work=1.0) for run in runs]
        with ExitStack() as stack:
            pool = None
            if missing or len(runs) > ALONE:
                pool = stack.enter_context(workers(None, self.scheduler))
                run_ahead(runs, self.progress, executor=pool)
            read = do_all(tasks, pool, "percussions", self.progress)
        for at, (outcome, seconds, failure) in zip(new, read, strict=True):
            if outcome:
                self.outcomes[at], self.runs[at] = outcome, new[at]
                self.seconds = max(self.seconds, len(self.designs) * seconds / cores())
            else:
                name = self.designs[at[0]].name
                self.failures.append(f"{name}, replicate {at[1]}: {failure}")
        self.made = number

    def look(self, alpha: float, *, paired: bool = True) -> Look:
        """Compare the replicates that ended well in every design. Raises ValueError where these are too
        few."""
        rows = range(len(self.designs))
        whole = [n for n in range(self.made) if all((row, n) in self.outcomes for row in rows)]
        if len(whole) < FEWEST:
            why = f". {self.failures[0]}" if self.failures else ""
            raise ValueError(f"--compare: {len(whole)} replicates ended well, {FEWEST} are needed{why}")
        table = table_of([[self.outcomes[row, n] for n in whole] for row in rows])
        found = table.differences(alpha, paired=paired)
        return Look(replicates=len(whole), alpha=alpha, table=table, differences=found)


@dataclass(frozen=True, slots=True, kw_only=True)
class Stop:
    """Say how far to go on: until what is answered, and for how long (s)."""

    asked: Asked
    seconds: float


# What is open: number of the design, quantity, and after how many replicates it will be answered; 0
# where no number of them in the time does it.
Forecast = list[tuple[int, str, int]]


def compare(
    of: Replicates,
    first: int,
    stop: Stop | None = None,
    say: Callable[[Forecast], None] = lambda _: None,
    *,
    paired: bool = True,
) -> tuple[list[Look], Forecast]:
    """Run the first replicates and look. With `stop` go on from look to look, and end where all is
    answered, or where what is open would take too long. Return all looks, and what stays open.

    say: told after the first look for how long it will go on"""
    began, made, ends = time.monotonic(), list[Look](), Forecast()
    for size, alpha in looks(first):
        of.until(size)
        made.append(look := of.look(alpha if stop else 1 - LEVEL, paired=paired))
        if stop is None:
            break
        left = stop.seconds - (time.monotonic() - began)
        most = min(MOST, size + int(max(0.0, left) / of.seconds))
        family = sum(map(len, look.differences))
        ends = [
            (number, key, needed(one, stop.asked, (first, size, most), family))
            for number, key, one in look.still_open(stop.asked)
        ]
        if len(made) == 1:
            say(ends)
        if not any(end for _, _, end in ends):
            break
    return made, ends
