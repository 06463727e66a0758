"""Designs of one room compared: the same people in each, as many replicates as the question needs, and
the page with the verdict, their pictures, and a row for each quantity."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import asdict, dataclass, field
from itertools import product
from math import floor, isfinite, log10
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from analysis.dumps import DumpError
from analysis.engines import EngineError
from analysis.engines.run import EngineRun
from analysis.pages.drawing import frame, panels, scene_picture, size_of
from analysis.pages.html import write_html
from analysis.pages.numbers import between, decimals, two, with_unit
from analysis.pages.ranges import Chart
from analysis.pages.section import Cell, Picture, Section
from analysis.pages.words import Words
from analysis.scene.distance import Distance
from analysis.scene.scene import Scene, SceneError
from analysis.scene.shipped_scenes import how_varied, variant
from analysis.studies.exposure.limits import limits_of_bodies, limits_of_walls
from analysis.studies.film.export import film_runs
from analysis.studies.film.frame import Animation, Frame, FrameRange
from analysis.studies.film.page import still_on
from analysis.studies.motion import design_differences as motion
from analysis.studies.motion.design_differences import QUANTITIES, Difference, Outcome, Quantity
from analysis.studies.motion.inference import FEWEST, LEVEL, range_of_windows
from analysis.studies.report.runs import moves, replicate_run, with_own_noise
from analysis.support.columns import Columns
from analysis.support.files import write_json, write_rows
from analysis.support.machine import cores
from analysis.support.parallel import Progress, Task, do_all, workers
from nscd.stepping import StepError

# So few runs that are there are read in this process: others would take longer to start. Replicates of
# a design at most. Frames of a run of which one is drawn.
ALONE, MOST, STILLS = 12, 1000, 6
# Keys of a drive that say how people push.
PUSH = ("speed_m_per_s", "relaxation_time_s", *Distance.model_fields, "stops", "aim")


class Design(NamedTuple):
    """Name a design and the scene that is run for it, which has another name where its people were put
    where those of the first design stand."""

    name: str
    scene: Scene


def designs_of(scenes: Sequence[Scene], *, unpaired: bool = False) -> list[Design]:
    """Make scenes designs that can be compared. The people of each stand where those of the first do,
    as far as they fit there. unpaired: take designs with other people or another push, too.

    Raises ValueError naming the scene and what is not the same."""
    first, names = scenes[0], [one.name for one in scenes]
    if len(scenes) < 2:
        raise ValueError("--compare: two designs at least are needed, to compare others with the first")
    for one in scenes:
        if names.count(one.name) > 1:
            raise ValueError(f"--compare: two designs are called {one.name}. Rename one file")
        if not moves(one):
            raise ValueError(
                f"--compare: {one.name} has no quantity in common with others. Its people are not "
                "driven, or it is an impact"
            )
    made = [Design(first.name, first)]
    for one in scenes[1:]:
        for key in ("duration_s", "frames"):
            if (mine := getattr(one.run, key)) != (of := getattr(first.run, key)):
                raise ValueError(f"--compare: {one.name}: run.{key}: {mine:g}, but {of:g} in {first.name}")
        unlike = _unlike(one, first)
        if unlike and not unpaired:
            raise ValueError(
                f"--compare: {one.name}: {unlike} in {first.name}. --unpaired compares them all the same"
            )
        made.append(Design(one.name, one) if unlike else _where(one, first))
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
    keys = [("contact", key) for key in type(one.contact).model_fields]
    for part, key in [*keys, *(("drive", key) for key in PUSH)]:
        inputs, was = (getattr(getattr(of, part), key) for of in (one, first))
        if inputs != was:
            return f"{part}.{key}: {inputs}, but {was}"
    return "" if one.body_force == first.body_force else "another body_force than"


def _where(one: Scene, first: Scene) -> Design:
    """The design with its people where those of the first stand, unless a wall is in the way."""
    if not (one.snapshot.position == first.snapshot.position).all():
        name = f"{one.name}_as_{first.name}"
        with suppress(SceneError):
            there = one.model_copy(update={"snapshot": first.snapshot, "name": name}).rerouted()
            there.check(one.name)
            return Design(one.name, there)
    return Design(one.name, one)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Interim:
    """Hold what is known after so many replicates of each design, by QUANTITIES of each design after the
    first; alpha: how often any interval of this look may miss."""

    replicates: int
    alpha: float
    table: motion.Table
    differences: Sequence[Mapping[str, Difference]]


# What is open: number of the design, quantity, and after how many replicates it will be answered; 0
# where no number of them in the time does it.
Forecast = list[tuple[int, str, int]]


@dataclass(slots=True, kw_only=True, eq=False)
class Replicates:
    """Run replicates of designs, and read each once.

    paired: whether replicates of one number belong together
    outcomes, runs: by number of the design and of the replicate, of those that ended well
    seconds: s, of all cores for one replicate of every design, as measured"""

    designs: Sequence[Design]
    engine: str
    out: Path
    progress: Progress | None = None
    paired: bool = True
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
                scene = with_own_noise(variant(self.designs[at[0]].scene, at[1]), at[1])
                new[at] = replicate_run(scene.with_run(impulses=True), self.engine, self.out, at[1])
            except (SceneError, StepError) as error:  # no draw gives these people room
                self._failed(at, str(error))
        return new

    def until(self, number: int) -> None:
        """Go on to so many replicates of each design, on all cores."""
        new = self.wanted(number)
        runs = list(new.values())
        tasks = [Task(call=motion.measured, arguments=(run,), work=run.particle_steps) for run in runs]
        with ExitStack() as stack:
            alone = len(runs) <= ALONE and all(run.is_finished() for run in runs)
            pool = None if alone else stack.enter_context(workers())
            read = do_all(tasks, pool, "runs and percussions", self.progress)
        for at, (outcome, seconds, failure) in zip(new, read, strict=True):
            if outcome is None:
                self._failed(at, failure)
                continue
            self.outcomes[at], self.runs[at] = outcome, new[at]
            self.seconds = max(self.seconds, len(self.designs) * seconds / cores())
        self.made = number

    def _failed(self, at: tuple[int, int], why: str) -> None:
        message = f"{self.designs[at[0]].name}, replicate {at[1]}: {why}"
        self.failures += [message] * (message not in self.failures)

    def interim(self, alpha: float) -> Interim:
        """Compare the replicates that ended well in every design. Raises ValueError where these are too
        few."""
        rows = range(len(self.designs))
        full = [n for n in range(self.made) if all((row, n) in self.outcomes for row in rows)]
        if len(full) < FEWEST:
            why = f". {self.failures[0]}" if self.failures else ""
            raise ValueError(f"--compare: {len(full)} replicates ended well, {FEWEST} are needed{why}")
        table = motion.table_of([[self.outcomes[row, n] for n in full] for row in rows])
        found = table.differences(alpha, paired=self.paired)
        return Interim(replicates=len(full), alpha=alpha, table=table, differences=found)

    def compare(
        self, first: int, target: motion.Target | None, seconds: float, say: Callable[[Forecast], None]
    ) -> tuple[list[Interim], Forecast]:
        """Run the first replicates and look. Where something is asked go on from look to look, for so
        many seconds, and end where all is answered, or what is open would take too long. Return all
        looks, and what stays open; say: told after the first look for how long it will go on."""
        began, made, ends = time.monotonic(), list[Interim](), Forecast()
        for size, alpha in motion.interim_levels(first):
            self.until(size)
            made.append(interim := self.interim(alpha if target else 1 - LEVEL))
            if target is None:
                break
            left = max(0.0, seconds - (time.monotonic() - began))
            sizes = first, size, min(MOST, size + int(left / self.seconds))
            family = sum(map(len, interim.differences))
            ends = [
                (number, key, motion.needed(one, target, sizes, family))
                for number, every in enumerate(interim.differences, start=1)
                for key, one in every.items()
                if target.of(key) and not target.answered(one)
            ]
            if len(made) == 1:
                say(ends)
            if not any(end for _, _, end in ends):
                break
        return made, ends


COLUMNS = Columns("designs")
RUNS = Columns("replicates")


class DesignDifference(NamedTuple):
    """Say how a quantity of a design differs from the first.

    text: behind a bar; sentence: of a verdict, empty where the interval holds zero, with its ends and
        what could not be seen"""

    design: str
    found: Difference
    text: str
    sentence: str = ""
    ends: str = ""
    least: str = ""


class Row(NamedTuple):
    """Hold a quantity with a bar for each design, and one for each difference from the first."""

    levels: Chart
    differences: Sequence[DesignDifference]

    def fraction(self, value: float) -> float:
        """Give the place of a difference on its axis, whose middle is zero, in per cent."""
        ends = [end for one in self.differences for end in (*one.found.ends, one.found.value)]
        top = Chart("", "", {"": (0.0, 0.0, max(filter(isfinite, map(abs, ends))))}).top
        return round(50 + 50 * min(max(value / top, -1.0), 1.0), 2)


def difference_of(design: str, quantity: Quantity, found: Difference, out: int) -> DesignDifference:
    """Put a difference into words, with as many places as half of its interval has two digits."""
    if not isfinite(found.half):
        return DesignDifference(design, found, "the same in all replicates")
    places = 1 - floor(log10(found.half))

    def stated(value: float) -> str:
        return decimals(value, places) if places > 0 else two(value)

    minimum = with_unit(stated(found.half), quantity.unit)
    if not found.significant:
        return DesignDifference(design, found, f"none seen, {minimum} would be")
    more, number = quantity.words[found.value > 0], stated(abs(found.value))
    ends = " to ".join(map(stated, sorted(map(abs, found.ends))))
    size = with_unit(number, quantity.unit)
    sentence = quantity.says.format(number=number, size=size, more=more, out=out)
    return DesignDifference(design, found, f"{number} {more} ({ends})", sentence, ends, minimum)


@dataclass(frozen=True, slots=True, kw_only=True)
class Compared:
    """Hold all that a page of designs says: their runs, all looks, and what stays open."""

    of: Replicates
    interims: Sequence[Interim]
    still: Forecast
    limits: tuple[Path, ...] = ()

    @property
    def names(self) -> list[str]:
        """The names of the designs."""
        return [one.name for one in self.of.designs]

    def rows(self) -> dict[str, Row]:
        """Make a row of each quantity that all designs have: means, 90 % of further replicates, limits
        and differences."""
        interim, walls = self.interims[-1], [one.number for one in limits_of_walls(self.limits)]
        marks = dict.fromkeys(("wall_left", "wall_right", "metre_largest"), walls)
        marks["contact_largest"] = [one.number for one in limits_of_bodies(self.limits)]
        rows, out = dict[str, Row](), interim.table.reached
        for key in interim.differences[0]:
            values = {name: one[key] for name, one in zip(self.names, interim.table.values, strict=True)}
            found = {
                name: (float(one.mean()), *range_of_windows(list(one[:, None])))
                for name, one in values.items()
            }
            title, unit, *_ = QUANTITIES[key]
            solutions = [
                difference_of(name, QUANTITIES[key], every[key], out)
                for name, every in zip(self.names[1:], interim.differences, strict=True)
            ]
            chart = Chart(title.format(out=out), unit, found, marks=marks.get(key, ()))
            rows[key] = Row(chart, solutions)
        return rows

    def verdicts(self, rows: Mapping[str, Row]) -> list[str]:
        """Say in one line for each design what is different from the first."""
        sentences = []
        for number, name in enumerate(self.names[1:]):
            differ = [one for row in rows.values() if (one := row.differences[number]).sentence]
            sentences.append(Words(__name__).text("verdict", design=name, first=self.names[0], differ=differ))
        return sentences

    def stills(self) -> list[Picture]:
        """Draw the first replicate of each design at one time: that of the typical largest force in the
        first design. Of a run without a contact its start."""
        made, when = list[Picture](), list[float]()
        for row, design in enumerate(self.of.designs):
            run = self.of.runs[min(at for at in self.of.runs if at[0] == row)]
            figure, shown_s = scene_picture(run.scene), 0.0
            with suppress(EngineError, DumpError, ValueError):
                (animation,) = film_runs([run.folder], FrameRange(step=max(1, run.scene.run.frames // STILLS)))
                nearest = [min(animation.shown, key=lambda one: abs(one.time - at)) for at in when[:1]]
                (shown,) = nearest or [animation.typical]
                figure, shown_s = _still(animation, shown, self.limits), shown.time
            when.append(shown_s)
            about = {"design": design.name, "title": design.scene.title, "time": shown_s}
            caption = Words(__name__).text("still", **about)
            made.append(Picture(name=f"{design.name}-forces", caption=caption, figure=figure))
        return made


def _still(animation: Animation, shown: Frame, limits: tuple[Path, ...]) -> Figure:
    """A frame, as far as the crowd stood at the start."""
    gates = animation.scene.drive.gates if animation.scene.drive else []
    view = np.concatenate([animation.scene.snapshot.position, *map(np.array, gates)])
    radius = float(shown.now.radius.max(initial=0.1))
    figure, (axes,) = panels(*size_of(view, radius))
    if marks := still_on(axes, animation, shown, limits):
        figure.legend(handles=marks, loc="outside lower center", ncols=3, fontsize=7, frameon=False)
    frame(axes, view, radius)
    return figure


def write_designs(one: Compared, folder: Path, command: str, progress: Progress) -> tuple[Path, list[str]]:
    """Write the page, `numbers.json`, `differences.csv`, `designs.csv` (a row for each run and
    quantity) and `figures/`; return the page's path, and the verdicts with what is not told apart."""
    folder.mkdir(parents=True, exist_ok=True)
    of, interim, words, names = one.of, one.interims[-1], Words(__name__), one.names
    rows = one.rows()
    titles = {key: row.levels.title for key, row in rows.items()}
    progress("pictures", 0.0)
    pictures = one.stills()
    progress("page", 0.0)
    _write_tables(one, folder)
    cells: list[list[Cell]] = [
        [f"{row.levels.title} ({row.levels.unit})",
         *(f"{two(mean)} ({between(low, high)})" for mean, low, high in row.levels.found.values()),
         *(cell for each in row.differences for cell in (each.text, two(each.found.delta)))]
        for row in rows.values()
    ]  # fmt: skip
    about = {
        "look": interim, "looks": len(one.interims), "family": len(rows) * (len(names) - 1), "names": names,
        "pairs": [titles[key] for key in rows if interim.differences[0][key].paired],
        "varied": how_varied(of.designs[0].scene, interim.replicates), "still": one.still, "titles": titles,
        "unlike": any(_unlike(each.scene, of.designs[0].scene) for each in of.designs),
    }  # fmt: skip
    how = Section(
        number="how", title=words.text("how-title"), introduction=words.items("how", **about),
        tables=[words.table("numbers", cells, names=names)], files=["differences.csv", "designs.csv"],
    )  # fmt: skip
    first = of.designs[0].scene.snapshot.position
    elsewhere = [each.name for each in of.designs if not np.array_equal(each.scene.snapshot.position, first)]
    sentences, pictured = one.verdicts(rows), words.text("pictures-title")
    page = write_html(
        folder / "index.html", "designs.html",
        [Section(number="pictures", title=pictured, pictures=pictures), how],
        lead=words.text("lead", **about), verdicts=sentences, rows=list(rows.values()), pictures=pictures,
        open=words.text("open", **about) if one.still else "", how=how, command=command,
        warnings=[*of.failures, *(words.text("places", design=each, first=names[0]) for each in elsewhere)],
    )  # fmt: skip
    alike = [f"{each.design}, {row.levels.title}: {each.text}"
             for row in rows.values() for each in row.differences if not each.sentence]  # fmt: skip
    return page, [*sentences, *alike]


def _write_tables(one: Compared, folder: Path) -> None:
    """The files beside the page."""
    interim, names, units = one.interims[-1], one.names, {key: each.unit for key, each in QUANTITIES.items()}
    write_rows(folder / "designs.csv", RUNS, (
        [name, number, key, units[key], value]
        for name, every in zip(names, interim.table.values, strict=True)
        for key, values in every.items() for number, value in enumerate(values.tolist())
    ))  # fmt: skip
    found = [(name, *item) for name, every in zip(names[1:], interim.differences, strict=True)
             for item in every.items()]  # fmt: skip
    write_rows(folder / "differences.csv", COLUMNS, (
        [name, key, units[key], each.base + each.value, each.base, each.value, *each.ends, each.half,
         each.delta, int(each.paired), interim.replicates] for name, key, each in found
    ))  # fmt: skip
    write_json(folder / "numbers.json", {
        "designs": names, "failures": one.of.failures, "out": interim.table.reached,
        "looks": [[each.replicates, each.alpha] for each in one.interims],
        "open": [[names[number], key, end or None] for number, key, end in one.still],
        "differences": [{"design": name, "quantity": key, "unit": units[key], "interval": each.ends,
                         "significant": each.significant} | asdict(each) for name, key, each in found],
    })  # fmt: skip
