"""The page of designs compared: the verdict, their pictures, and a row for each quantity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from math import floor, isfinite, log10
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from analysis.dumps import DumpError
from analysis.engines import EngineError
from analysis.exposure.limits import limits_of_bodies, limits_of_walls
from analysis.film.export import film_runs
from analysis.film.frame import Frame, Frames, Reel
from analysis.film.page import still_on
from analysis.motion.designs import QUANTITIES, Asked, Difference, Quantity
from analysis.motion.inference import range_of_windows
from analysis.pages.drawing import frame, panels, scene_picture, size_of
from analysis.pages.html import write_html
from analysis.pages.numbers import between, decimals, two, with_unit
from analysis.pages.ranges import Chart
from analysis.pages.section import Cell, Picture, Section
from analysis.pages.words import Words
from analysis.report.designs import Forecast, Look, Replicates
from analysis.scene.shipped_scenes import how_varied
from analysis.support.columns import Columns
from analysis.support.files import write_json, write_rows
from analysis.support.parallel import Progress
from nscd.arrays import Floats

# Frames of a run of which one is drawn.
STILLS = 6
RUNS = Columns("""
design, replicate | | which run; replicates of one number have the same people and seeds
quantity, unit, value | | what is compared, of the whole run from the first who leaves to the last
""")
DIFFERENCES = Columns("""
design, than, quantity, unit | | what is compared with the first design
mean, mean_first | unit | over the replicates of both
difference, low, high | unit | of these means, with its joint interval
least_seen | unit | half of that interval: smaller differences would not have been seen
cliffs_delta | – | share of pairs of runs in which the design is above the first, less that below it
paired | | 1 where replicates of one number are subtracted from each other
replicates | | of each design
""")


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """Say how a quantity of a design differs from the first, in words.

    text: behind a bar
    sentence: of a verdict, empty where the interval holds zero; ends: of the interval
    least: what could not be seen"""

    design: str
    found: Difference
    text: str
    sentence: str = ""
    ends: str = ""
    least: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """Hold a quantity with a bar for each design, and one for each difference from the first."""

    levels: Chart
    answers: Sequence[Answer]

    @property
    def top(self) -> float:
        """The end of the axis of differences, either way."""
        ends = [abs(end) for one in self.answers for end in (*one.found.ends, one.found.value)]
        highest = max(filter(isfinite, ends), default=0.0)
        return Chart("", "", {"": (highest, highest, highest)}).top

    def share(self, value: float) -> float:
        """Give the place of a difference on the axis, in per cent."""
        return round(50 + 50 * min(max(value / self.top, -1.0), 1.0), 2)


def answer_of(design: str, quantity: Quantity, found: Difference, out: int) -> Answer:
    """Put a difference into words, with as many places as half of its interval has two digits."""
    if not isfinite(found.half):
        return Answer(design=design, found=found, text="the same in all replicates")
    places = 1 - floor(log10(found.half))

    def said(value: float) -> str:
        return decimals(value, places) if places > 0 else two(value)

    least = with_unit(said(found.half), quantity.unit)
    if not found.significant:
        return Answer(design=design, found=found, text=f"none seen, {least} would be")
    more, number = quantity.words[found.value > 0], said(abs(found.value))
    ends = " to ".join(map(said, sorted(map(abs, found.ends))))
    size = with_unit(number, quantity.unit)
    sentence = quantity.says.format(number=number, size=size, more=more, out=out)
    return Answer(
        design=design, found=found, text=f"{number} {more} ({ends})",
        sentence=sentence, ends=ends, least=least,
    )  # fmt: skip


def rows_of(of: Replicates, look: Look, limits: tuple[Path, ...] = ()) -> dict[str, Row]:
    """Make a row of each quantity that all designs have."""
    names, out = [one.name for one in of.designs], look.table.reached
    walls = [one.number for one in limits_of_walls(limits)]
    marks = {"wall_left": walls, "wall_right": walls, "metre_largest": walls}
    marks["contact_largest"] = [one.number for one in limits_of_bodies(limits)]
    rows = {}
    for key in look.differences[0]:
        quantity = QUANTITIES[key]
        found = {
            name: _level(values[key]) for name, values in zip(names, look.table.values, strict=True)
        }
        title = quantity.title.format(out=out)
        rows[key] = Row(
            levels=Chart(title, quantity.unit, found, marks=marks.get(key, ())),
            answers=[
                answer_of(name, quantity, every[key], out)
                for name, every in zip(names[1:], look.differences, strict=True)
            ],
        )
    return rows


def _level(values: Floats) -> tuple[float, float, float]:
    """The mean of replicates, and the range that holds 90 % of further ones."""
    return float(values.mean()), *range_of_windows(list(values[:, None]))


def verdicts(of: Replicates, rows: Mapping[str, Row]) -> list[str]:
    """Say in one line for each design what is different from the first."""
    words, said = Words(__name__), []
    for number, design in enumerate(of.designs[1:]):
        answers = [row.answers[number] for row in rows.values()]
        differ = [one for one in answers if one.sentence]
        first = of.designs[0].name
        said.append(words.text("verdict", design=design.name, first=first, differ=differ))
    return said


def alike(of: Replicates, rows: Mapping[str, Row]) -> list[str]:
    """Say of each design and quantity in which no difference is seen, which one would be."""
    return [
        f"{design.name}, {row.levels.title}: {row.answers[number].text}"
        for number, design in enumerate(of.designs[1:])
        for row in rows.values()
        if not row.answers[number].sentence
    ]


def stills(of: Replicates, limits: tuple[Path, ...], progress: Progress | None) -> list[Picture]:
    """Draw the first replicate of each design at one time: that of the typical largest force in the
    first design. Of a run without a contact its start."""
    made, when = list[Picture](), None
    for row, design in enumerate(of.designs):
        run = next(of.runs[at] for at in sorted(of.runs) if at[0] == row)
        figure, time = scene_picture(run.scene), 0.0
        with suppress(EngineError, DumpError, ValueError):
            frames = Frames(step=max(1, run.scene.run.frames // STILLS))
            (reel,) = film_runs([run.folder], frames, progress)
            shown = reel.typical
            if when is not None:
                shown = min(reel.shown, key=lambda one: abs(one.time - (when or 0.0)))
            figure, time = _still(reel, shown, limits), shown.time
        when = time if when is None else when
        caption = Words(__name__).text("still", design=design.name, title=design.scene.title, time=time)
        made.append(Picture(name=f"{design.name}-forces", caption=caption, figure=figure))
    return made


def _still(reel: Reel, shown: Frame, limits: tuple[Path, ...]) -> Figure:
    """A frame, and of those who have left only who is near the door."""
    now, drive = shown.now, reel.scene.drive
    gone = drive.gone(now.position, now.ids) if drive else np.zeros(len(now), dtype=bool)
    ends = [now.position[~gone], *(np.array(one) for one in (drive.gates if drive else ()))]
    view, radius = np.concatenate(ends), float(now.radius.max())
    figure, (axes,) = panels(*size_of(view, radius))
    marks = still_on(axes, reel, shown, limits)
    frame(axes, view, radius)
    if marks:
        figure.legend(handles=marks, loc="outside lower center", ncols=3, fontsize=7, frameon=False)
    return figure


@dataclass(frozen=True, slots=True, kw_only=True)
class Compared:
    """Hold all that a page of designs says: their runs, all looks, and what was asked and stays open."""

    of: Replicates
    looks: Sequence[Look]
    asked: Asked | None = None
    still: Forecast = field(default_factory=list)
    paired: bool = True
    limits: tuple[Path, ...] = ()


def write_designs(
    one: Compared, folder: Path, command: str, progress: Progress | None = None
) -> tuple[Path, list[str]]:
    """Write the page, `numbers.json`, `differences.csv`, `designs.csv` (a row for each run and
    quantity) and `figures/`; return the page's path, and the verdicts with what is alike."""
    folder.mkdir(parents=True, exist_ok=True)
    of, look, words = one.of, one.looks[-1], Words(__name__)
    if progress:
        progress("pictures", 0.0)
    rows, pictures = rows_of(of, look, one.limits), stills(of, one.limits, None)
    if progress:
        progress("page", 0.0)
    said = verdicts(of, rows)
    _write_tables(one, folder)
    names = [design.name for design in of.designs]
    how = Section(
        number="how",
        title=words.text("how-title"),
        introduction=words.items("how", look=look, count=len(one.looks), family=sum(
            map(len, look.differences)), paired=one.paired, names=names,
            varied=how_varied(of.designs[0].scene, look.replicates),
            pairs=[rows[key].levels.title for key in rows if look.differences[0][key].paired]),
        tables=[words.table("numbers", _cells(look, rows), names=names)],
        files=["differences.csv", "designs.csv"],
    )  # fmt: skip
    warnings = [*of.failures]
    warnings += [words.text("places", design=name, first=names[0]) for name in _elsewhere(of)]
    page = write_html(
        folder / "index.html",
        "designs.html",
        [Section(number="pictures", title=words.text("pictures-title"), pictures=pictures), how],
        lead=words.text("lead", look=look, designs=of.designs, engine=of.engine),
        verdicts=said,
        open=words.text("open", still=one.still, titles={k: r.levels.title for k, r in rows.items()},
                        names=names) if one.still else "",
        rows=list(rows.values()),
        pictures=pictures,
        how=how,
        warnings=warnings,
        command=command,
    )  # fmt: skip
    return page, [*said, *alike(of, rows)]


def _elsewhere(of: Replicates) -> list[str]:
    """The designs whose people do not stand where those of the first do."""
    first = of.designs[0].scene.snapshot.position
    every = [(one.name, one.scene.snapshot.position) for one in of.designs]
    return [name for name, place in every if len(place) != len(first) or (place != first).any()]


def _cells(look: Look, rows: Mapping[str, Row]) -> list[list[Cell]]:
    cells = list[list[Cell]]()
    for row in rows.values():
        ends = row.levels.found.values()
        levels = [f"{two(mean)} ({between(low, high)})" for mean, low, high in ends]
        cells.append([f"{row.levels.title} ({row.levels.unit})", *levels])
        for one in row.answers:
            cells[-1] += [one.text, two(one.found.delta)]
    return cells


def _write_tables(one: Compared, folder: Path) -> None:
    """The files beside the page."""
    of, look = one.of, one.looks[-1]
    names, units = [design.name for design in of.designs], {k: q.unit for k, q in QUANTITIES.items()}
    write_rows(folder / "designs.csv", RUNS, (
        [name, number, key, units[key], value]
        for name, values in zip(names, look.table.values, strict=True)
        for key in values
        for number, value in enumerate(values[key].tolist())
    ))  # fmt: skip
    pairs = list(zip(names[1:], look.differences, strict=True))
    write_rows(folder / "differences.csv", DIFFERENCES, (
        [name, names[0], key, units[key], found.base + found.value, found.base, found.value,
         *found.ends, found.half, found.delta, int(found.paired), look.replicates]
        for name, every in pairs for key, found in every.items()
    ))  # fmt: skip
    write_json(folder / "numbers.json", {
        "designs": names,
        "replicates": look.replicates,
        "looks": [[each.replicates, each.alpha] for each in one.looks],
        "asked": one.asked and asdict(one.asked),
        "open": [[names[number], key, end or None] for number, key, end in one.still],
        "out": look.table.reached,
        "failures": of.failures,
        "differences": {
            name: {
                key: asdict(found) | {"interval": found.ends, "unit": units[key],
                                      "significant": found.significant}
                for key, found in every.items()
            }
            for name, every in pairs
        },
    })  # fmt: skip
