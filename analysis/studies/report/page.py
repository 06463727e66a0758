"""The page of a report: the first screen of each scene, what folds away below, and what lies beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from math import isfinite, nan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from analysis.compare.comparison import write_contacts
from analysis.compare.study import Study
from analysis.engines.energy import CSV as ENERGY
from analysis.engines.rigid import NAME as RIGID
from analysis.engines.softness import DEEP, VALID, softest
from analysis.pages.drawing import NARROW_IN, legend_below, line_style, panels
from analysis.pages.html import drawn, write_html
from analysis.pages.numbers import NONE, between, integer, significant, two
from analysis.pages.ranges import Chart
from analysis.pages.section import Cell, Picture, Section, Table
from analysis.pages.words import Words
from analysis.scene import named_crowds as named
from analysis.scene.scene import Scene, is_shipped
from analysis.scene.shipped_scenes import how_varied
from analysis.studies.explore.page import live_of, write_explore
from analysis.studies.exposure import limits as known_limits
from analysis.studies.exposure.loads import MEASURES
from analysis.studies.film.frame import Animation
from analysis.studies.film.page import charts_and_notes, draw_still, force_notes, packed
from analysis.studies.motion.study import (
    CROWD,
    FACTORS,
    Model,
    MotionStudy,
    difference_words,
    differences_of,
    interval_cell,
    least_words,
)
from analysis.studies.report.contacts import contacts_section, runs_of
from analysis.studies.report.sections import more_sections
from analysis.support.files import write_json, write_text
from analysis.support.parallel import Progress

# The limit whose people are counted on the first screen.
NAMED = "asphyxia_minutes"
REPLICATES = "replicates"
# What a reader is told in place of a factor.
SAID = {"bodies": "stiffness", REPLICATES: "start"}
# Of what models are compared in, in a sentence.
SHORT = {"contact_largest": "largest force", "wall_line_load": "wall load", "flow": "flow"}


def four(study: MotionStudy) -> Mapping[str, known_limits.Quantity]:
    """Name the four numbers of a first screen by their series."""
    limit = next(one for one in known_limits.limits_of_people(study.limits) if one.name == NAMED)
    above = f"people with contacts > {significant(limit.number, 4)} N"
    return {
        "contact_largest": known_limits.Quantity(title="largest contact force", unit="N"),
        "wall_line_load": known_limits.Quantity(title="wall load, worst metre", unit="kN/m"),
        known_limits.above_key(limit): known_limits.Quantity(
            title=above, unit=f"of {len(study.scene.people)}"
        ),
        "flow": known_limits.Quantity(title="people leaving", unit="per s"),
    }


class Range(NamedTuple):
    """Hold a quantity over everything that was varied."""

    low: float  # of all models, each with the range of 90 % of its moments
    high: float
    factors: Mapping[str, tuple[float, float]]  # the least and the largest mean, widest first


def range_of(study: MotionStudy, key: str) -> Range:
    """Find the range of a quantity, and what widens it."""
    models = [one for one in study.models if one.valid] or study.models
    ends = [end for one in models for end in _ends(one, key)]
    means = {
        factor: [one.interval(key).mean for one in models if one.factor in ("", factor)]
        for factor in FACTORS
    }
    sample = study.models[0].sample(key)
    means[REPLICATES] = [float(value) * sample.unit for value in sample.values]
    spans = {factor: (min(each), max(each)) for factor, each in means.items() if len(each) > 1}
    widest = sorted(spans, key=lambda factor: spans[factor][0] - spans[factor][1])
    return Range(min(ends), max(ends), {one: spans[one] for one in widest})


def _ends(one: Model, key: str) -> tuple[float, float]:
    """The range of a model; its mean where it has one replicate."""
    found = one.interval(key)
    low, high = (end if isfinite(end) else found.mean for end in (found.low, found.high))
    return low, high


def marks_of(study: MotionStudy, key: str) -> list[float]:
    """List the limits that are drawn beside a quantity."""
    limits_of = {
        "contact_largest": known_limits.limits_of_bodies,
        "wall_line_load": known_limits.limits_of_walls,
    }
    return [one.number for one in limits_of[key](study.limits)] if key in limits_of else []


def charts(study: MotionStudy, *, every: bool = False) -> list[Chart]:
    """Draw the four numbers, each as one bar, or (every) with a bar for each model."""
    made = []
    for key, measure in four(study).items():
        total = range_of(study, key)
        shown = study.models if every else study.models[:1]
        made.append(
            Chart(
                measure.title,
                measure.unit,
                {one.label: (one.interval(key).mean, *_ends(one, key)) for one in shown}
                | dict.fromkeys(study.absent if every else (), (nan,) * 3),
                widest=(total.low, total.high),
                marks=marks_of(study, key),
                most=float(len(study.scene.people)) if measure.unit.startswith("of ") else None,
            )
        )
    return made


def lead(scene: Scene, motion: MotionStudy | None = None) -> str:
    """Say what was simulated and what pushes."""
    return Words(__name__).text(
        "lead",
        crowds=motion is not None and CROWD in {one.factor for one in motion.models},
        shipped=is_shipped(scene),
        drive=scene.drive,
        people=len(scene.people),
        filmed=scene.reconciliation is not None,
        push=scene.mean_push,
        each=scene.push_range,
        ways=scene.drive.ways if scene.drive else 0,
    )


def crowds_of(study: MotionStudy) -> Mapping[str, list[Model]]:
    """Give the models of each named crowd by its label; nothing where crowds were not varied."""
    models = {one.label: one for one in study.models if one.factor == CROWD}
    found = dict[str, list[Model]]()
    for name, fraction, same in named.crowds_beside(study.scene) if models else ():
        model = study.models[0] if same else models.get(named.crowd_label(name, fraction))
        if model is not None:
            found.setdefault(named.CROWDS[name].label, []).append(model)
    return found


def crowds_table(study: MotionStudy) -> Table | None:
    """Say how hard the people of each crowd push and why, how many leave, and the largest force; a
    flow that no measured crowd has is said."""
    rows, does = list[list[Cell]](), {one.label: one.does for one in named.CROWDS.values()}
    for label, models in crowds_of(study).items():
        pushes = [end for one in models for end in one.runs[0].scene.push_range]
        ends = [end for one in models for end in _ends(one, "contact_largest")]
        push, force = (between(min(each), max(each)) for each in (pushes, ends))
        flow = _flow([one.flows(named.door_width(study.scene)) for one in models])
        rows.append([f"{label}: {does[label]}", push, flow, force])
    words = Words(__name__)
    return words.table("crowds", rows, measured=named.MEASURED_FLOW) if rows else None


def _flow(found: Sequence[Sequence[float]]) -> str:
    """Write flows per metre and second of the replicates of models, as one range."""
    every = [flow for flows in found for flow in flows]
    if not every:
        return "nobody leaves"
    minimum, maximum = named.MEASURED_FLOW
    unseen = [max(flows) < minimum or min(flows) > maximum for flows in found if flows]
    message = f": {'in part ' if not all(unseen) else ''}no measured crowd"
    flow = between(min(every), max(every))
    return f"**{flow}{message}**" if any(unseen) else flow


def notes(study: MotionStudy, drawn: Sequence[Chart]) -> list[str]:
    """Say how to read the bars that are drawn, what matters most, and for how long the limit must
    last."""
    found, base = range_of(study, "contact_largest").factors, study.models[0]
    own = [label for label, models in crowds_of(study).items() if base in models]
    factors = {SAID.get(one, one): ends for one, ends in found.items()}
    varied = {one.factor for one in study.models}
    bars = Words(__name__).text(
        "bars",
        first=", ".join([*own, base.label]),
        last=study.last_s,
        window=float(base.series[0].duration[0]),
        varied=[SAID.get(one, one) for one in FACTORS if one in varied],
        units=[one.unit for one in drawn if one.shown],
        crowds=len(study.models[0].series),
    )
    peak = max(float(one.values["contact_largest"].max()) for one in study.models[0].series)
    done = f"Simulated: {significant(study.scene.run.duration_s)} s, peak {two(peak)} N"
    done += f" of {len(base.series)} {base.label} runs"
    return [bars, *force_notes(factors, done, study.limits, "mean ")]


def verdicts(study: MotionStudy) -> list[str]:
    """Say in one line each how every model differs from the first one in the four numbers."""
    words, sentences = Words(__name__), []
    first, titles = study.models[0], four(study)
    for one in study.models[1:]:
        found = {key: each for key, each in differences_of(one, first).items() if key in SHORT}
        if not found:
            continue
        differ, alike = [], []
        for key, each in found.items():
            unit, title = titles[key].unit.replace("per s", "1/s"), SHORT[key]
            if each.significant:
                differ.append((title, *difference_words(each, unit)))
            else:
                alike.append((title, least_words(each, unit)))
        label = one.label[0].upper() + one.label[1:]
        sentences.append(words.text("verdict", label=label, differ=differ, alike=alike))
    return [words.text("against", first=first.label, crowds=study.crowds), *sentences] if sentences else []


def four_numbers(study: MotionStudy) -> dict[str, object]:
    """Give the four numbers as ranges with what widens them, for numbers.json."""
    found: dict[str, object] = {}
    for key, measure in four(study).items():
        total = range_of(study, key)
        found[key] = {
            "unit": measure.unit,
            "range": [total.low, total.high],
            "factors": {name: list(ends) for name, ends in total.factors.items()},
            "models": {
                one.title: [(each := one.interval(key)).mean, each.low, each.high]
                for one in study.models
            },
        }
    return found


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reported:
    """Hold what a report has of one scene.

    motion: None of a scene that does not move, or without replicates
    animations: the films of its first run of the first model and of that with springs
    """

    study: Study
    motion: MotionStudy | None = None
    animations: Sequence[Animation] = ()

    @property
    def scene(self) -> Scene:
        """The scene."""
        return self.study.scene

    @property
    def moved(self) -> MotionStudy | None:
        """What is known of it in motion; None where no replicate ended well."""
        return self.motion if self.motion and self.motion.models else None

    @property
    def failures(self) -> list[str]:
        """List the runs that failed."""
        return [*self.study.failures, *(self.motion.failures if self.motion else ())]

    @property
    def warnings(self) -> list[str]:
        """List what a reader of the first screen should know."""
        return [*self.failures, *(self.moved or self.study).warnings]


def write_report(
    reported: Sequence[Reported],
    folder: Path,
    command: str,
    limits: tuple[Path, ...] = (),
    progress: Progress | None = None,
    executor: Executor | None = None,
) -> Path:
    """Write the page and what lies beside it into the folder, pictures by the workers of an executor
    where there is one; return the page's path.

    Beside `index.html` are `explore.html`, which goes on from it live, `numbers.json`, one CSV of
    contacts per run, and in `figures/` every picture as PNG and PDF, its name beginning with that of
    the scene.
    """
    folder.mkdir(parents=True, exist_ok=True)
    reported = with_distinct_names(reported)
    screens, numbers = [], {}
    for number, one in enumerate(reported):
        if progress:
            progress("pictures", number / len(reported))
        runs = runs_of(one.study)
        for comparison, run in zip(one.study.comparisons, runs, strict=True):
            write_contacts(folder / run["csv"], comparison)
        energy = energy_of(one.moved, folder) if one.moved else None
        contacts = contacts_section(one.study, runs)
        if one.moved:  # of these contacts, not of the first screen
            contacts = replace(contacts, warnings=one.study.warnings)
        more, lacking = more_sections(one.moved, executor) if one.moved else ([], [])
        screens.append(_screen(one, [*more, contacts], limits, energy, lacking))
        numbers[one.scene.name] = {
            "failures": one.study.failures,
            "warnings": one.study.warnings,
            "runs": runs,
            **_reconciled(one.scene),
            **({"in_motion": motion_numbers(one.moved)} if one.moved else {}),
        }
    if progress:
        progress("page", 0.0)
    folds = [fold for screen in screens for fold in screen["folds"]]
    stills = [
        Section(number="", title="", pictures=[one["still"]]) for one in screens if one["still"]
    ]
    moving = [one.moved for one in reported if one.moved]
    if live := [one.scene for one in reported if one.animations and live_of(one.scene)]:
        write_explore(live, folder, command, stills[0].pictures[0] if stills else None)
    write_json(folder / "numbers.json", numbers)
    return write_html(
        folder / "index.html",
        "report.html",
        [*folds, *stills],
        executor=executor,
        screens=screens,
        contents=[(one["number"], one["title"]) for one in screens],
        limits=limits_table(moving, limits) if moving else None,
        engines=[one.record.engine for each in reported for one in each.study.comparisons]
        + [model.runs[0].engine for each in moving for model in each.models],
        command=command,
    )


def _reconciled(scene: Scene) -> dict[str, object]:
    """What was done to filmed heads, for numbers.json."""
    if not scene.reconciliation:
        return {}
    others = scene.other_frames.rows() if scene.other_frames else []
    return {"reconciliation": dict([*scene.reconciliation.rows(), *others])}


def _screen(
    one: Reported, sections: Sequence[Section], limits: tuple[Path, ...], energy: Picture | None, lacking: Sequence[str]
) -> dict[str, Any]:
    """A scene as report.html takes it: its first screen, with the film as text and bars of the first
    model, and what folds away below, with bars of every model."""
    words, scene, motion, still = Words(__name__), one.scene, one.moved, None
    for animation in one.animations[:1]:
        shown = animation.typical
        caption = words.text("still", time=shown.time, rigid=animation.engine == RIGID)
        figure = draw_still(animation, shown, limits)
        picture = Picture(name=f"{scene.name}-forces", caption=caption, figure=figure)
        still = drawn(picture)
    bars, sentences = charts(motion) if motion else [], list[str]()
    if motion:
        sentences = notes(motion, bars)
    elif scene.drive or scene.analysis.kind == "impact" or not one.animations:
        sentences = [words.text("once") if scene.drive else "", *sections[-1].words[:1]]
    else:  # a crowd that leans: nothing but its frames varies
        bars, sentences = charts_and_notes(one.animations)
    numbers = [_numbers(words, motion, energy)] if motion else []
    return {
        "number": f"{scene.name}-at-a-glance",
        "title": scene.title,
        "lead": lead(scene, motion),
        "crowds": crowds_table(motion) if motion else None,
        "film": packed(one.animations, limits, live_of(scene)) if one.animations else "",
        "still": still,
        "charts": bars,
        "notes": sentences,
        "every": charts(motion, every=True) if motion else (),
        "verdicts": verdicts(motion) if motion else (),
        "folds": [*numbers, *sections[:-1], _assumptions(words, scene, motion), sections[-1]],
        "warnings": [*one.warnings, *lacking],
    }


def energy_of(motion: MotionStudy, folder: Path) -> Picture | None:
    """Draw where the energy of the first run went, and put its table into the folder; nothing of an
    engine that wrote none."""
    path, name = motion.models[0].runs[0].folder / ENERGY, f"{motion.scene.name}-energy"
    if not path.exists():
        return None
    write_text(folder / f"{name}.csv", path.read_text(encoding="utf-8"))
    rows = np.genfromtxt(path, delimiter=",", names=True)
    figure, (axes,) = panels(NARROW_IN, 2.6)
    energy = rows["kinetic_J"] + rows["stored_J"]
    work = np.cumsum(rows["drive_J"] + rows["weight_J"])
    lines = {"work of drive and weight": work, "lost in impacts": np.cumsum(rows["impact_J"]),
             "lost in friction": np.cumsum(rows["friction_J"]), "motion and springs": energy}  # fmt: skip
    for number, (label, values) in enumerate(lines.items()):
        if values.any():
            axes.plot(rows["time_s"], values / 1000, label=label, **line_style(number) | {"marker": ""})
    axes.set(xlabel="time (s)", ylabel="energy (kJ)")
    legend_below(figure, axes, 2)
    error = np.abs(np.cumsum(rows["error_J"])).max() / max(np.abs(work).max(), 1e-300)
    caption = Words(__name__).text(
        "energy", error=f"{significant(error, 1)} of the first run's work"
    )
    return Picture(name=name, caption=caption, figure=figure)


def _numbers(words: Words, motion: MotionStudy, energy: Picture | None) -> Section:
    """Every quantity that is not drawn, of the models that differ in their bodies only."""
    shown = [one for one in motion.models if one.factor in ("", "bodies")]
    rows: list[list[Cell]] = [
        [f"{measure.title} ({measure.unit})", *(interval_cell(one.interval(key)) for one in shown)]
        for key, measure in MEASURES.items()
        if key not in (*four(motion), "wall_left", "wall_right")  # which stand along the walls
    ]
    first = shown[0]
    overlaps = [f"{significant(100 * one.overlap, 2)} %" if one.runs[0].engine != RIGID else NONE for one in shown]
    deep = [f"**{text}**" if one.overlap > DEEP else text for one, text in zip(shown, overlaps, strict=True)]
    rows.append(["largest overlap, from the start (of a radius)", *deep])
    rows = [[*row, *([NONE] * len(motion.absent))] for row in rows]
    table = words.table(
        "numbers",
        rows,
        models=[*(one.label for one in shown), *motion.absent],
        last=first.last_s,
        window=float(first.series[0].duration[0]),
    )
    number = f"{motion.scene.name}-numbers"
    return Section(
        number=number,
        title=words.text("numbers-title"),
        tables=[table],
        pictures=[energy] if energy else [],
        files=[f"{energy.name}.csv"] if energy else [],
    )


def assumptions(scene: Scene, motion: MotionStudy | None) -> list[str]:
    """Say what was assumed, and what that leaves unknown."""
    words, people, drive = Words(__name__), scene.people, scene.drive
    radius = (float(people.radius.min()), float(people.radius.max()))
    mass = (float(people.mass.min()), float(people.mass.max()))
    sentences = [words.text("bodies", radius=radius, mass=mass, contact=scene.contact)]
    if drive:
        sentences.append(words.text("push", drive=drive, each=scene.push_range))
    if motion:
        bodies = [one.label for one in motion.models if one.factor in ("", "bodies")]
        soft = f"soft, {significant(softest(scene) / 1000)} kN/m" in bodies
        sentences.append(words.text("springs", bodies=bodies, soft=soft, valid=VALID))
        sentences += [words.text("stopped", label=one, count=n) for one, n in motion.stopped.items()]
        varied = how_varied(scene, motion.crowds)
        fewer = min(len(one.series) for one in motion.models)
        has = len(motion.models[0].series)  # of those asked for, without the failed
        sentences.append(words.text("replicates", crowds=has, varied=varied, fewer=fewer))
    return [*sentences, words.text("cannot")] if drive else sentences


def _assumptions(words: Words, scene: Scene, motion: MotionStudy | None) -> Section:
    """What was assumed, with the notes of the scene."""
    sentences = [*assumptions(scene, motion), scene.notes, words.text("source", scene=scene)]
    return Section(
        number=f"{scene.name}-assumptions",
        title=words.text("assumptions-title"),
        introduction=[one for one in sentences if one],
    )


def limits_table(motions: Sequence[MotionStudy], files: tuple[Path, ...] = ()) -> Table:
    """Give the limits of people and walls with their sources, and how many people are above each in
    each scene, by its first model."""
    words, people = Words(__name__), known_limits.limits_of_people(files)
    first = [one.models[0] for one in motions]
    rows: list[list[Cell]] = [
        [
            f"{significant(limit.number, 4)} {limit.unit}",
            known_limits.QUANTITIES[limit.quantity].title.removesuffix(" of a person"),
            f"{limit.what}{limit.lasting} ({limit.population})",
            *(
                interval_cell(one.interval(known_limits.above_key(limit)), integer)
                if limit in people
                else NONE
                for one in first
            ),
            limit.signed,
        ]
        for limit in (*people, *known_limits.limits_of_walls(files))
    ]
    scenes = [f"{one.scene.name}, of {len(one.scene.people)}" for one in motions]
    return words.table("limits", rows, scenes=scenes, signs=known_limits.SIGNS)


def motion_numbers(study: MotionStudy) -> dict[str, object]:
    """Give all numbers of a study, for numbers.json."""
    first = study.models[0]
    people = {
        known_limits.above_key(one): "people" for one in known_limits.limits_of_people(study.limits)
    }
    units = {key: measure.unit for key, measure in MEASURES.items()}
    units |= {"wall_line_load": "kN/m"} | people
    models: dict[str, object] = {}
    for one in study.models:
        compared = {} if one is first else differences_of(one, first)
        found: dict[str, object] = {"varies": one.factor or None}
        for key, unit in units.items():
            interval = one.interval(key)
            entry: dict[str, object] = {
                "unit": unit,
                "mean": interval.mean,
                "range_90": [interval.low, interval.high],
                "replicates": interval.replicates,
                "windows_per_replicate": interval.windows,
                "independent_windows": interval.independent,
            }
            if (above := compared.get(key)) is not None:
                # a share, or in the unit where the first model is next to zero
                name = "above_first" if above.relative else "more_than_first"
                entry |= {name: above.value, f"{name}_interval_90": [above.low, above.high]}
                entry |= {"smallest_seen": above.least, "probability": above.probability}
            found[key] = entry
        models[one.title] = found
    return {
        "replicates": study.crowds,
        "last_s": study.last_s,
        "first": first.title,
        "four": four_numbers(study),
        "models": models,
    }


def with_distinct_names(reported: Sequence[Reported]) -> list[Reported]:
    """Number the scenes that have the name of an earlier one: pair, pair_2, …"""
    named: dict[str, Reported] = {}
    for one in reported:
        study = one.study
        name, count = study.scene.name, 1
        while name in named:
            count += 1
            name = f"{study.scene.name}_{count}"
        scene = study.scene.model_copy(update={"name": name})
        motion = one.motion and replace(one.motion, scene=scene)
        named[name] = replace(one, study=replace(study, scene=scene), motion=motion)
    return list(named.values())
