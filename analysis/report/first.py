"""The first screen of a scene: its film, and four numbers as ranges over what nobody knows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import NamedTuple

from analysis.exposure.limits import (
    Limit,
    Quantity,
    above_key,
    limits_of_bodies,
    limits_of_people,
    limits_of_walls,
)
from analysis.film.page import force_notes
from analysis.motion.study import (
    FACTORS,
    Model,
    MotionStudy,
    difference_words,
    differences_of,
    least_words,
)
from analysis.pages.numbers import significant
from analysis.pages.ranges import Chart, chart
from analysis.pages.words import Words
from analysis.scene.scene import Scene

# The limit whose people are counted on the first screen.
NAMED = "asphyxia_minutes"
REPLICATES = "replicates"
# What a reader is told in place of a factor.
SAID = {"bodies": "stiffness"}
# Of what models are compared in, in a sentence.
SHORT = {"contact_largest": "largest force", "wall_line_load": "wall load", "flow": "flow"}


def named_limit(study: MotionStudy) -> Limit:
    """Give the limit that the first screen counts people above."""
    return next(one for one in limits_of_people(study.limits) if one.name == NAMED)


def four(study: MotionStudy) -> Mapping[str, Quantity]:
    """Name the four numbers of a first screen by their series."""
    limit = named_limit(study)
    above = f"people above {significant(limit.number, 4)} N at once"
    return {
        "contact_largest": Quantity(title="largest contact force", unit="N"),
        "wall_line_load": Quantity(title="load on the worst metre of wall", unit="kN/m"),
        above_key(limit): Quantity(title=above, unit=f"of {len(study.scene.snapshot)}"),
        "flow": Quantity(title="people through the door", unit="per s"),
    }


class Range(NamedTuple):
    """Hold a quantity over everything that was varied."""

    low: float  # of all models, each with the range of 90 % of its moments
    high: float
    factors: Mapping[str, tuple[float, float]]  # the least and the largest mean, widest first


def range_of(study: MotionStudy, key: str) -> Range:
    """Find the range of a quantity, and what widens it."""
    ends = [end for one in study.models for end in _ends(one, key)]
    means = {
        factor: [one.interval(key).mean for one in study.models if one.factor in ("", factor)]
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
    known = {"contact_largest": limits_of_bodies, "wall_line_load": limits_of_walls}
    return [one.number for one in known[key](study.limits)] if key in known else []


def charts(study: MotionStudy, *, every: bool = False) -> list[Chart]:
    """Draw the four numbers, each as one bar, or (every) with a bar for each model."""
    made = []
    for key, measure in four(study).items():
        whole = range_of(study, key)
        shown = study.models if every else study.models[:1]
        made.append(
            chart(
                measure.title,
                measure.unit,
                {one.label: (one.interval(key).mean, *_ends(one, key)) for one in shown},
                widest=(whole.low, whole.high),
                marks=marks_of(study, key),
                most=float(len(study.scene.snapshot)) if measure.unit.startswith("of ") else None,
            )
        )
    return made


def lead(scene: Scene) -> str:
    """Say what was simulated and what pushes."""
    return Words(__name__).text(
        "lead",
        people=len(scene.snapshot),
        push=scene.mean_push,
        each=scene.push_range,
        ways=scene.drive.ways if scene.drive else 0,
    )


def notes(study: MotionStudy, drawn: Sequence[Chart]) -> list[str]:
    """Say how to read the bars that are drawn, what matters most, and for how long the limit must
    last."""
    found = range_of(study, "contact_largest").factors
    factors = {SAID.get(one, one): ends for one, ends in found.items()}
    varied = {one.factor for one in study.models}
    bars = Words(__name__).text(
        "bars",
        first=study.models[0].label,
        last=study.last_s,
        varied=[SAID.get(one, one) for one in FACTORS if one in varied],
        units=[one.unit for one in drawn if one.shown],
    )
    return [
        bars,
        *force_notes(factors, "run", study.scene.run.duration_s, study.limits),
    ]


def verdicts(study: MotionStudy) -> list[str]:
    """Say in one line each how every model differs from the first one in the four numbers."""
    words, said = Words(__name__), []
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
        said.append(words.text("verdict", label=label, differ=differ, alike=alike))
    return [words.text("against", first=first.label), *said] if said else []


def numbers(study: MotionStudy) -> dict[str, object]:
    """Give the four numbers as ranges with what widens them, for numbers.json."""
    found: dict[str, object] = {}
    for key, measure in four(study).items():
        whole = range_of(study, key)
        found[key] = {
            "unit": measure.unit,
            "range": [whole.low, whole.high],
            "factors": {name: list(ends) for name, ends in whole.factors.items()},
            "models": {
                one.title: [(each := one.interval(key)).mean, each.low, each.high]
                for one in study.models
            },
        }
    return found
