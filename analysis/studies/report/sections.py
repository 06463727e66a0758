"""What a report folds away below its first screen: loads along the walls, times, density and speed."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import replace
from math import isfinite

import numpy as np
from matplotlib.figure import Figure

from analysis.pages import drawing
from analysis.pages.numbers import between, integer, significant, two
from analysis.pages.section import Cell, Picture, Section
from analysis.pages.words import Words
from analysis.studies.exposure.limits import QUANTITIES, limits_of_bodies, limits_of_people
from analysis.studies.exposure.pedestrians import FRAMES, before_door
from analysis.studies.exposure.picture import draw_loads
from analysis.studies.exposure.positions import moments_of, place_words, worst_metres
from analysis.studies.exposure.times import leaving, time_until
from analysis.studies.exposure.walls import (
    CORNER,
    Stretch,
    at_corners,
    beside_doors,
    loads_on,
    outlines_of,
)
from analysis.studies.motion.study import Model, MotionStudy, interval_cell, interval_of
from analysis.support.extras import MissingExtraError
from analysis.support.parallel import Task, do_all
from nscd.continuum.rivals.density_laws import kladek_speed

# Of corners and of named walls, those with the largest load.
CORNERS, WALLS = 4, 12
# Weidmann's own constants: people per m², m/s.
JAM_PER_M2, FREE_M_PER_S = 5.4, 1.34


def more_sections(motion: MotionStudy, executor: Executor | None = None) -> tuple[list[Section], list[str]]:
    """Make the sections of a scene in motion, and say what is left out for want of a library."""
    words, models, warnings = Words(__name__), bodies_of(motion), list[str]()
    made = [walls_section(words, motion, models)] if motion.scene.walls else []
    made.append(times_section(words, motion, models))
    if motion.scene.drive and motion.scene.drive.has_door:
        try:
            made.append(density_section(words, motion, models[0], executor))
        except MissingExtraError as error:
            warnings.append(str(error))
        except Exception as error:  # of PedPy, whose errors have no common kind: no page is lost by it
            warnings.append(f"density and speed by PedPy: {error}")
    return made, warnings


def bodies_of(motion: MotionStudy) -> list[Model]:
    """The models that differ in their bodies only."""
    return [one for one in motion.models if one.factor in ("", "bodies")]


def walls_section(words: Words, motion: MotionStudy, models: Sequence[Model]) -> Section:
    """Draw the load along the walls, and give it at the worst metre, doors, corners and named walls."""
    scene, first = motion.scene, models[0]
    parts = beside_doors(scene) + at_corners(scene)
    windows = [[(run, run.last(one.last_s)) for run in one.series] for one in models]
    at = [[loads_on(run.scene, run.on_walls, parts)[last] for run, last in each] for each in windows]
    mean = np.concatenate(at[0]).mean(0) if parts else np.zeros(0)
    shown = [n for n, one in enumerate(parts) if CORNER not in one.name]
    some = sorted((n for n in range(len(parts)) if n not in shown and mean[n] > 0), key=lambda n: -mean[n])
    rows: list[list[Cell]]
    rows = [["largest metre anywhere", *(interval_cell(one.interval("wall_line_load")) for one in models)]]
    for n in [*shown, *sorted(some[:CORNERS])]:
        name = f"{CORNER} at ({', '.join(two(x) for x in _point(motion, parts[n]))}) m" if n in some else parts[n].name
        rows.append([name, *(interval_cell(interval_of([one[:, n] for one in each])) for each in at)])
    walls = [[run.loads["wall_line_load"][last] for run, last in each] for each in windows]
    largest = np.concatenate(walls[0]).mean(0)
    for n in sorted(np.argsort(-largest, kind="stable")[:WALLS].tolist()):
        if largest[n] > 0:
            cells = (interval_cell(interval_of([one[:, n] for one in each])) for each in walls)
            rows.append([f"largest metre on {scene.walls[n].name}", *cells])
    peaks = [max((one.load for one in worst_metres(run)), default=0.0) for run in first.series]
    index = place_words(first.series[number := int(np.argmax(peaks))])
    picture = words.picture(
        "walls-picture", draw_loads(scene, moments_of(first.series, first.last_s)), model=first.label,
        last=first.last_s, replicates=len(first.series),
    )  # fmt: skip
    return Section(
        number=f"{scene.name}-walls", title=words.text("walls-title"),
        words=[words.text("largest", number=number, model=first.label, place=index)] if index else [],
        pictures=[_named(picture, motion)],
        tables=[words.table("walls", rows, models=[one.label for one in models])],
    )  # fmt: skip


def _point(motion: MotionStudy, part: Stretch) -> tuple[float, float]:
    return outlines_of(motion.scene).point(part.outline, part.at)


def _named(picture: Picture, motion: MotionStudy) -> Picture:
    """The picture with the name of its scene before its own, as its files have it."""
    return replace(picture, name=f"{motion.scene.name}-{picture.name.removesuffix('-picture')}")


def times_section(words: Words, motion: MotionStudy, models: Sequence[Model]) -> Section:
    """Say who is above each limit for how long, over replicates and bodies, and until when people are
    out."""
    headers = [one.label for one in models]
    above: list[list[Cell]] = []
    for limit in limits_of_people(motion.limits):
        name = f"{significant(limit.number, 4)} {limit.unit}, {QUANTITIES[limit.quantity].title.removesuffix(' of a person')}"
        every = [[run.time_above(limit) for run in one.series] for one in models]
        if not any(total.any() for each in every for total, _ in each):
            continue
        above.append([name, *(
            _ever([float((total > 0).sum()) for total, _ in each], max(one.max(initial=0.0) for _, one in each))
            for each in every)])  # fmt: skip
        if limit.duration_s and limit.duration_s <= min(float(one.series[0].time[-1]) for one in models):
            long = limit.duration_s - 1e-9
            cells = (_counts([float((one >= long).sum()) for _, one in each]) for each in every)
            above.append([f"… for {significant(limit.duration_s)} s", *cells])
    inside = min((len(leaving(run)) for one in models for run in one.series), default=0)
    names = {1: "first person out (s)", 10: "10 people out (s)", -(-inside // 2): "half of them out (s)",
             inside: "last person out (s)"}  # fmt: skip
    driven = motion.scene.drive is not None and motion.scene.drive.has_door and inside > 0
    out: list[list[Cell]] = [
        [names[n], *(_time([time_until(run, n) for run in one.series]) for one in models)]
        for n in sorted(names) if driven and n <= inside
        and any(isfinite(time_until(run, n)) for one in models for run in one.series)
    ]  # fmt: skip
    out += [["people per second after the first", *(interval_cell(one.interval("flow")) for one in models)]] * driven
    tables = [words.table("above", above, models=headers, people=len(motion.scene.people))]
    return Section(
        number=f"{motion.scene.name}-times", title=words.text("times-title"),
        pictures=[_named(words.picture("times-picture", _draw_times(models, driven)), motion)],
        tables=[*tables, *([words.table("out", out, models=headers)] if driven else [])],
    )  # fmt: skip


def _ever(counts: Sequence[float], longest: float) -> str:
    return f"{_counts(counts)}, {two(longest)} s" if any(counts) else "nobody"


def _counts(counts: Sequence[float]) -> str:
    """Write counts of replicates: their mean, and the least and the most."""
    mean, ends = significant(float(np.mean(counts)), 2), between(min(counts), max(counts), integer)
    return f"{mean} ({ends})" if len(counts) > 1 else mean


def _time(times: Sequence[float]) -> str:
    """Write times of replicates, of which some may be none."""
    done = [one for one in times if isfinite(one)]
    if len(done) == len(times):
        return interval_cell(interval_of([np.array([one]) for one in times]))
    return f"in {len(done)} of {len(times)} runs" if done else "in no run"


def _draw_times(models: Sequence[Model], driven: bool) -> Figure:
    figure, every = drawing.panels(8.0 if driven else 4.4, 3.2, 1, 2 if driven else 1)
    lowest = limits_of_bodies()[0]
    for number, model in enumerate(models):
        style, label = drawing.line_style(number % 4) | {"marker": ""}, model.label
        times = [np.sort(run.time_above(lowest)[0])[::-1] for run in model.series]
        at = np.unique(np.concatenate(times))
        left = np.array([(one[:, None] >= at[at > 0]).sum(0) for one in times])
        if (at > 0).any():
            every[0].plot(at[at > 0], left.mean(0), label=label, **style)
            drawing.shade(every[0], at[at > 0], left.min(0), left.max(0), style["color"], 0.2)
        for run in model.series if driven else ():
            out = leaving(run)
            out = out[np.isfinite(out)]
            steps = np.append(out, run.time[-1]), np.append(np.arange(1, len(out) + 1), len(out))
            every[1].step(*steps, where="post", lw=0.8, label=label, **style)
    every[0].set(xlabel="at least so long (s)", ylim=(0, None), xlim=(0, None),
                 ylabel=f"people above {significant(lowest.number, 4)} {lowest.unit}")  # fmt: skip
    if driven:
        every[1].set(xlabel="time (s)", ylabel="people out", ylim=(0, None), xlim=(0, None))
    drawing.legend_below(figure, every, 3)
    return figure


def density_section(words: Words, motion: MotionStudy, model: Model, executor: Executor | None = None) -> Section:
    """Measure density and speed before the door by PedPy's methods. Raises as `before_door`."""
    there = [run for run in model.runs if run.is_finished()]
    tasks = [Task(call=before_door, arguments=(run.folder, run.scene), work=1.0) for run in there]
    every = do_all(tasks, executor, "density and speed")
    figure, (axes,) = drawing.panels(drawing.NARROW_IN, 3.0)
    for number, one in enumerate(every):
        observed = one[one["density_per_m2"] > 0]
        axes.plot(observed["density_per_m2"], observed["speed_m_per_s"], ".", ms=4, color=drawing.COLOURS[number % 4],
                  label=f"replicate {number}" if number < 4 else None)  # fmt: skip
    density = np.linspace(0.3, JAM_PER_M2, 60)
    speed = kladek_speed(density, free_speed=FREE_M_PER_S, greatest_density=JAM_PER_M2)
    axes.plot(density, speed, color=drawing.BLACK, lw=1, label="Weidmann 1993")
    axes.set(xlabel="density (1/m²)", ylabel="speed (m/s)", xlim=(0, None), ylim=(0, None))
    drawing.legend_below(figure, axes, 2)
    last = [one[one["time_s"] >= one["time_s"].max() - model.last_s - 1e-9] for one in every]
    titles = {"density_per_m2": "density (1/m²), Voronoi", "classic_density_per_m2": "density (1/m²), count over area",
              "speed_m_per_s": "speed (m/s), Voronoi"}  # fmt: skip
    rows: list[list[Cell]] = []
    for key, title in titles.items():
        fewest = min(map(len, last))
        rows.append([title, interval_cell(interval_of([one[key].to_numpy()[-fewest:] for one in last]))])
    picture = words.picture("density-picture", figure, frames=FRAMES, model=model.label)
    table = words.table("density", rows, model=model.label, last=model.last_s)
    name = f"{motion.scene.name}-density"
    return Section(number=name, title=words.text("density-title"), pictures=[_named(picture, motion)], tables=[table])
