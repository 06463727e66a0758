"""The section of a page about one scene in motion."""

from __future__ import annotations

from analysis.engines.rigid import NAME as RIGID
from analysis.motion.ensemble import Ensemble
from analysis.motion.intervals import interval_cell, signed
from analysis.motion.pictures import motion_picture
from analysis.motion.series import MEASURES
from analysis.motion.study import MotionStudy
from analysis.pages.numbers import significant
from analysis.pages.section import Cell, Picture, Section
from analysis.pages.words import Words
from analysis.scene.scene import Scene
from analysis.scene.variation import how_varied


def motion_section(study: MotionStudy) -> Section:
    """Put a study of a scene in motion into words, a picture and a table."""
    words, scene = Words(__package__), study.scene
    name, title = f"{scene.name}-in-motion", words.text("title", title=scene.title)
    warnings = [*study.failures, *study.warnings]
    if not study.ensembles:
        return Section(number=name, title=title, warnings=warnings)
    first = study.ensembles[0]
    values = {
        "models": [one.title for one in study.ensembles],
        "crowds": study.crowds,
        "varied": how_varied(scene),
        "window": first.series[0].window_s,
        "last": first.last_s,
        "count": len(study.ensembles),
        "windows": sum(int(series.last(first.last_s).sum()) for series in first.series),
    }
    picture = Picture(
        name=name, caption=words.text("motion", **values), figure=motion_picture(study.ensembles)
    )
    return Section(
        number=name,
        title=title,
        introduction=[words.text("what", **values), words.text("push", **_push(scene))],
        words=_found(words, study),
        pictures=[picture],
        tables=[words.table("measures", _rows(study), **values)],
        warnings=warnings,
    )


def _push(scene: Scene) -> dict[str, float]:
    """The least and the largest force (N) with which a person pushes."""
    drive = scene.drive
    assert drive is not None
    push = scene.snapshot.mass * drive.speed_m_per_s / drive.relaxation_time_s
    return {"least": float(push.min()), "most": float(push.max())}


def _found(words: Words, study: MotionStudy) -> list[str]:
    """How each model compares with the rigid one, in sentences."""
    reference = study.reference
    if reference is None:
        return []
    said = []
    for one in study.ensembles:
        if one.engine == RIGID:
            continue
        compared = {key: one.above(reference, key) for key in MEASURES}
        known = {key: found for key, found in compared.items() if found is not None}
        if not known:
            continue
        differ = [
            {"title": MEASURES[key].title}
            | {name: signed(getattr(f, name)) for name in ("share", "low", "high")}
            for key, f in known.items()
            if f.distinguishable
        ]
        alike = [MEASURES[key].title for key, f in known.items() if not f.distinguishable]
        if differ:
            said.append(words.text("differ", model=one.title, found=differ))
        if alike:
            said.append(words.text("alike", model=one.title, names=alike))
    return said or [words.text("few")]


def _rows(study: MotionStudy) -> list[list[Cell]]:
    reference = study.reference or study.ensembles[0]
    rows: list[list[Cell]] = []
    for key, measure in MEASURES.items():
        cells = [interval_cell(one.interval(key)) for one in study.ensembles]
        independent = significant(reference.interval(key).independent, 2)
        rows.append([f"{measure.title} ({measure.unit})", *cells, independent])
    return rows


def motion_numbers(study: MotionStudy) -> dict[str, object]:
    """Give all numbers of a study, for numbers.json."""
    return {
        "crowds": study.crowds,
        "last_s": study.last_s,
        "models": {one.title: _numbers(one, study.reference) for one in study.ensembles},
    }


def _numbers(one: Ensemble, reference: Ensemble | None) -> dict[str, object]:
    numbers: dict[str, object] = {}
    for key, measure in MEASURES.items():
        found = one.interval(key)
        entry: dict[str, object] = {
            "unit": measure.unit,
            "median": found.median,
            "interval_90": [found.low, found.high],
            "crowds": found.crowds,
            "windows_per_crowd": found.windows,
            "independent_windows": found.independent,
        }
        if reference is not None and one is not reference:
            above = one.above(reference, key)
            if above is not None:
                entry["above_rigid"] = above.share
                entry["above_rigid_interval_90"] = [above.low, above.high]
        numbers[key] = entry
    return numbers
