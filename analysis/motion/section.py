"""The section of a page about one scene in motion."""

from __future__ import annotations

from analysis.engines.rigid import NAME as RIGID
from analysis.motion.ensemble import Ensemble
from analysis.motion.intervals import difference_words, interval_cell
from analysis.motion.pictures import motion_picture
from analysis.motion.series import MEASURES
from analysis.motion.study import MotionStudy
from analysis.pages.names import in_a_sentence
from analysis.pages.numbers import significant
from analysis.pages.section import Cell, Picture, Section
from analysis.pages.words import Words
from analysis.scene.scene import Scene
from analysis.scene.variation import how_varied


def motion_section(study: MotionStudy, without: MotionStudy | None = None) -> Section:
    """Put a study of a scene in motion into words, a picture and a table; without: the same scene
    with its own friction, where this one has another."""
    words, scene = Words(__package__), study.scene
    name, title = f"{scene.name}-in-motion", words.text("title", title=scene.title)
    if without is not None:
        name = f"{scene.name}-friction"
        title = words.text("title-friction", title=scene.title, friction=study.friction)
    warnings = [*study.failures, *study.warnings]
    if not study.ensembles:
        return Section(number=name, title=title, warnings=warnings)
    first = study.ensembles[0]
    values = {
        "models": [one.title for one in study.ensembles],
        "crowds": study.crowds,
        "varied": how_varied(scene, study.crowds),
        "window": first.series[0].window_s,
        "last": first.last_s,
        "count": len(study.ensembles),
        "friction": study.friction,
        "arches": any(series.arches for one in study.ensembles for series in one.series),
        "frame": scene.run.duration_s / scene.run.frames,
        "windows": sum(int(series.last(first.last_s).sum()) for series in first.series),
    }
    picture = Picture(
        name=name,
        caption=words.text("motion", **values),
        figure=motion_picture(study.ensembles),
        narrow=motion_picture(study.ensembles, narrow=True),
    )
    return Section(
        number=name,
        title=title,
        introduction=[
            words.text("what", **values),
            words.text("friction" if without else "push", **_push(scene), **values),
            words.text("arch", **values),
        ],
        words=[*_found(words, study), *(_changed(words, study, without) if without else ())],
        pictures=[picture],
        tables=[
            words.table(
                "measures", _rows(study), counted=in_a_sentence(_counted(study).title), **values
            )
        ],
        warnings=warnings,
    )


def _push(scene: Scene) -> dict[str, float]:
    """The least and the largest force (N) with which a person pushes, and to how many doors."""
    drive = scene.drive
    assert drive is not None
    push = scene.snapshot.mass * drive.speed_m_per_s / drive.relaxation_time_s
    return {"least": float(push.min()), "most": float(push.max()), "ways": drive.ways}


def _found(words: Words, study: MotionStudy) -> list[str]:
    """How each model compares with the rigid one, in sentences."""
    reference = study.reference
    if reference is None:
        return []
    said = []
    for one in study.ensembles:
        if one.engine != RIGID:
            said += _told(words, ("differ", "alike"), one, reference)
    return said or [words.text("few")]


def _changed(words: Words, study: MotionStudy, without: MotionStudy) -> list[str]:
    """What friction changes in each model, in sentences."""
    said = []
    for one in study.ensembles:
        for other in without.ensembles:
            if one.title.startswith(other.title) or other.title.startswith(one.title):
                values = {"after": study.friction, "before": without.friction}
                said += _told(words, ("changed", "unchanged"), one, other, **values)
    return said


def _told(
    words: Words, blocks: tuple[str, str], one: Ensemble, other: Ensemble, **values: float
) -> list[str]:
    """In which measures a model is told from another, and in which it is not."""
    compared = {key: one.above(other, key) for key in MEASURES}
    known = {key: found for key, found in compared.items() if found is not None}
    differ = [
        (MEASURES[key].title, *difference_words(f, MEASURES[key].unit))
        for key, f in known.items()
        if f.distinguishable
    ]
    alike = [MEASURES[key].title for key, f in known.items() if not f.distinguishable]
    model = in_a_sentence(one.title)
    said = [words.text(blocks[0], model=model, found=differ, **values)] if differ else []
    return said + ([words.text(blocks[1], model=model, names=alike, **values)] if alike else [])


def _counted(study: MotionStudy) -> Ensemble:
    """The model whose independent windows are counted."""
    return study.reference or study.ensembles[0]


def _rows(study: MotionStudy) -> list[list[Cell]]:
    reference = _counted(study)
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
        "friction": study.friction,
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
                # a share, or in the unit where the rigid one is next to zero
                name = "above_rigid" if above.relative else "more_than_rigid"
                entry[name] = above.value
                entry[f"{name}_interval_90"] = [above.low, above.high]
        numbers[key] = entry
    return numbers
