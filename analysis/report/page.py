"""The page of a report, and what lies beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from analysis.compare.comparison import write_contacts
from analysis.compare.study import Study
from analysis.engines.rigid import NAME as RIGID
from analysis.engines.softness import VALID, softest
from analysis.exposure.limits import (
    QUANTITIES,
    above_key,
    limits_of_people,
    limits_of_walls,
)
from analysis.exposure.loads import MEASURES
from analysis.film.frame import Reel
from analysis.film.page import draw_still, packed
from analysis.motion.study import MotionStudy, differences_of, interval_cell
from analysis.pages.html import render, write_pictures
from analysis.pages.numbers import NONE, significant, whole
from analysis.pages.section import Cell, Picture, Section, Table
from analysis.pages.words import Words
from analysis.report.contacts import contacts_section, runs_of
from analysis.report.first import charts, four, lead, notes, verdicts
from analysis.report.first import numbers as first_numbers
from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import how_varied
from analysis.support.files import write_json, write_text


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reported:
    """Hold what a report has of one scene.

    motion: None of a scene that does not move, or without replicates
    reels: the films of its first run of the first model and of that with springs
    """

    study: Study
    motion: MotionStudy | None = None
    reels: Sequence[Reel] = ()

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
        """List what a reader should know, of all engines of which it is said once."""
        moving = self.motion.warnings if self.motion else ()
        whose: dict[str, list[str]] = {}
        for one in (*self.failures, *self.study.warnings, *moving):
            name, colon, words = one.partition(": ")
            whose.setdefault(words if colon else one, []).append(name if colon else "")
        return [
            ": ".join(filter(None, (", ".join(names), words))) for words, names in whose.items()
        ]


def write_report(
    reported: Sequence[Reported], folder: Path, command: str, limits: tuple[Path, ...] = ()
) -> Path:
    """Write the page and what lies beside it into the folder; return the page's path.

    Beside `index.html` are `numbers.json`, one CSV of contacts per run, and in `figures/` every
    picture as PNG and PDF, its name beginning with that of the scene.
    """
    folder.mkdir(parents=True, exist_ok=True)
    reported = with_distinct_names(reported)
    screens, numbers = [], {}
    for one in reported:
        runs = runs_of(one.study)
        for comparison, run in zip(one.study.comparisons, runs, strict=True):
            write_contacts(folder / run["csv"], comparison)
        screens.append(_screen(one, contacts_section(one.study, runs), limits))
        numbers[one.scene.name] = {
            "failures": one.study.failures,
            "warnings": one.study.warnings,
            "runs": runs,
            **_reconciled(one.scene),
            **({"in_motion": motion_numbers(one.moved)} if one.moved else {}),
        }
    folds = [fold for screen in screens for fold in screen["folds"]]
    stills = [
        Section(number="", title="", pictures=[one["still"]]) for one in screens if one["still"]
    ]
    moving = [one.moved for one in reported if one.moved]
    page = render(
        "report.html",
        screens=screens,
        contents=[(one["number"], one["title"]) for one in screens],
        limits=limits_table(moving, limits) if moving else None,
        images=write_pictures([*folds, *stills], folder / "figures"),
        command=command,
    )
    write_json(folder / "numbers.json", numbers)
    write_text(folder / "index.html", page)
    return folder / "index.html"


def _reconciled(scene: Scene) -> dict[str, object]:
    """What was done to filmed heads, for numbers.json."""
    if not scene.reconciliation:
        return {}
    others = scene.other_frames.rows() if scene.other_frames else []
    return {"reconciliation": dict([*scene.reconciliation.rows(), *others])}


def _screen(one: Reported, contacts: Section, limits: tuple[Path, ...]) -> dict[str, Any]:
    """A scene as report.html takes it: its first screen, with the film as text and bars of the first
    model, and what folds away below, with bars of every model."""
    words, scene, motion, still = Words(__name__), one.scene, one.moved, None
    for reel in one.reels[:1]:
        shown = reel.strongest
        caption = words.text("still", time=shown.time, rigid=reel.engine == RIGID)
        drawn = draw_still(reel, shown, limits)
        still = Picture(name=f"{scene.name}-forces", caption=caption, figure=drawn)
    bars = charts(motion) if motion else []
    without = [words.text("once") if scene.drive else "", *contacts.words[:1]]
    numbers = [_numbers(words, motion)] if motion else []
    return {
        "number": f"{scene.name}-at-a-glance",
        "title": scene.title,
        "lead": lead(scene),
        "film": packed(one.reels, limits) if one.reels else "",
        "still": still,
        "charts": bars,
        "notes": notes(motion, bars) if motion else without,
        "every": charts(motion, every=True) if motion else (),
        "verdicts": verdicts(motion) if motion else (),
        "folds": [*numbers, _assumptions(words, scene, motion), contacts],
        "warnings": one.warnings,
    }


def _numbers(words: Words, motion: MotionStudy) -> Section:
    """Every quantity that is not drawn, of the models that differ in their bodies only."""
    shown = [one for one in motion.models if one.factor in ("", "bodies")]
    rows: list[list[Cell]] = [
        [f"{measure.title} ({measure.unit})", *(interval_cell(one.interval(key)) for one in shown)]
        for key, measure in MEASURES.items()
        if key not in four(motion)
    ]
    first = shown[0]
    table = words.table(
        "numbers",
        rows,
        models=[one.label for one in shown],
        last=first.last_s,
        window=float(first.series[0].duration[0]),
    )
    number = f"{motion.scene.name}-numbers"
    return Section(number=number, title=words.text("numbers-title"), tables=[table])


def assumptions(scene: Scene, motion: MotionStudy | None) -> list[str]:
    """Say what was assumed, and what that leaves unknown."""
    words, disks, drive = Words(__name__), scene.snapshot, scene.drive
    radius = (float(disks.radius.min()), float(disks.radius.max()))
    mass = (float(disks.mass.min()), float(disks.mass.max()))
    said = [words.text("bodies", radius=radius, mass=mass, contact=scene.contact)]
    if drive:
        said.append(words.text("push", drive=drive, each=scene.push_range))
    if motion:
        bodies = [one.label for one in motion.models if one.factor in ("", "bodies")]
        soft = f"soft, {significant(softest(scene) / 1000)} kN/m" in bodies
        said.append(words.text("springs", bodies=bodies, soft=soft, valid=VALID))
        varied = how_varied(scene, motion.crowds)
        fewer = min(len(one.series) for one in motion.models)
        has = len(motion.models[0].series)  # of those asked for, without the failed
        said.append(words.text("replicates", crowds=has, varied=varied, fewer=fewer))
    return [*said, words.text("cannot")] if drive else said


def _assumptions(words: Words, scene: Scene, motion: MotionStudy | None) -> Section:
    """What was assumed, with the notes of the scene."""
    said = [*assumptions(scene, motion), scene.notes, words.text("source", scene=scene)]
    return Section(
        number=f"{scene.name}-assumptions",
        title=words.text("assumptions-title"),
        introduction=[one for one in said if one],
    )


def limits_table(motions: Sequence[MotionStudy], files: tuple[Path, ...] = ()) -> Table:
    """Give the limits of people and walls with their sources, and how many people are above each in
    each scene, by its first model."""
    words, people = Words(__name__), limits_of_people(files)
    first = [one.models[0] for one in motions]
    rows: list[list[Cell]] = [
        [
            f"{significant(limit.number, 4)} {limit.unit}",
            QUANTITIES[limit.quantity].title.removesuffix(" of a person"),
            f"{limit.what}{limit.lasting} ({limit.population})",
            *(
                interval_cell(one.interval(above_key(limit)), whole) if limit in people else NONE
                for one in first
            ),
            limit.cited,
        ]
        for limit in (*people, *limits_of_walls(files))
    ]
    scenes = [f"{one.scene.name}, of {len(one.scene.snapshot)}" for one in motions]
    return words.table("limits", rows, scenes=scenes)


def motion_numbers(study: MotionStudy) -> dict[str, object]:
    """Give all numbers of a study, for numbers.json."""
    first = study.models[0]
    people = {above_key(one): "people" for one in limits_of_people(study.limits)}
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
                entry[name] = above.value
                entry[f"{name}_interval_90"] = [above.low, above.high]
                entry["smallest_seen"] = above.least
                entry["probability"] = above.probability
            found[key] = entry
        models[one.title] = found
    return {
        "replicates": study.crowds,
        "last_s": study.last_s,
        "first": first.title,
        "four": first_numbers(study),
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
