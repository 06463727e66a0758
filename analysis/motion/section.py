"""The section of a page about one scene in motion, with its picture and numbers."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.engines.rigid import NAME as RIGID
from analysis.motion.study import MEASURES, Ensemble, MotionStudy, Series, interval_cell, split
from analysis.pages.drawing import COLOURS, GRID, LINES, NARROW_IN
from analysis.pages.names import in_a_sentence
from analysis.pages.numbers import significant
from analysis.pages.section import Cell, Picture, Section
from analysis.pages.words import Words
from analysis.scene.shipped_scenes import how_varied
from nscd.arrays import Floats


def motion_picture(ensembles: Sequence[Ensemble], *, narrow: bool = False) -> Figure:
    """Draw people through the door and load on the walls against time, and how forces are spread:
    the median of the crowds and, as a band, where nine in ten of them are; for a telephone below
    each other."""
    size = (NARROW_IN, 9.0) if narrow else (11.0, 3.6)
    figure = Figure(figsize=size, layout="constrained")
    people, walls, spread = figure.subplots(*((3, 1) if narrow else (1, 3)))
    _bands(people, ensembles, lambda series: series.evacuated)
    people.set(xlabel="time (s)", ylabel="people through the door", title="flow")
    _bands(walls, ensembles, lambda series: 1e-3 * series.values["walls"])
    walls.set(xlabel="time (s)", ylabel="load on all walls (kN)", title="load on walls")
    for number, ensemble in enumerate(ensembles):
        share, force = _exceedance(ensemble)
        spread.semilogy(force, share, LINES[number % 4], color=COLOURS[number % 4])
    spread.set(
        xlabel="contact force / mean contact force",
        ylabel="share of contacts above",
        title="spread of forces",
        ylim=(1e-4, 1.5),
    )
    for axes in (people, walls, spread):
        axes.grid(color=GRID)
    figure.legend(
        *people.get_legend_handles_labels(),
        loc="outside lower center",
        ncols=1 if narrow else 3,
        fontsize=8,
    )
    return figure


def _bands(axes: Axes, ensembles: Sequence[Ensemble], of: Callable[[Series], Floats]) -> None:
    for number, ensemble in enumerate(ensembles):
        colour, line = COLOURS[number % 4], LINES[number % 4]
        values = np.stack([of(series) for series in ensemble.series])
        time = ensemble.series[0].time
        low, middle, high = np.quantile(values, [0.05, 0.5, 0.95], axis=0)
        axes.fill_between(time, low, high, color=colour, alpha=0.15, linewidth=0)
        axes.plot(time, middle, line, color=colour, label=ensemble.title)
    axes.set_ylim(bottom=0)


def _exceedance(ensemble: Ensemble) -> tuple[Floats, Floats]:
    """The share of contact forces of all windows that count above a multiple of their mean."""
    forces = np.concatenate(
        [
            force
            for series in ensemble.series
            for force, counts in zip(series.forces, series.last(ensemble.last_s), strict=True)
            if counts
        ]
        or [np.ones(1)]
    )
    share = np.geomspace(1.0, 1e-4, 60)
    return share, np.quantile(forces / forces.mean(), 1 - share)


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
    first, (least, most) = study.ensembles[0], scene.push_range
    values = {
        "least": least,
        "most": most,
        "ways": scene.drive.ways if scene.drive else 0,
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
            words.text("friction" if without else "push", **values),
            words.text("arch", **values),
        ],
        words=_said(words, study, without),
        pictures=[picture],
        tables=[
            words.table(
                "measures", _rows(study), counted=in_a_sentence(_counted(study).title), **values
            )
        ],
        warnings=warnings,
    )


def _said(words: Words, study: MotionStudy, without: MotionStudy | None) -> list[str]:
    """How each model compares with the rigid one, and with itself without friction, in sentences;
    what stops a flow first."""
    values = {"after": study.friction, "before": without.friction if without else 0.0}
    rigid = against_rigid(study)
    pairs = [(*pair, "differ", "alike") for pair in rigid]
    pairs += [(*pair, "changed", "unchanged") for pair in changed_by(study, without)]
    stops = [words.text("stops", **found) for one, other, *_ in pairs for found in stop(one, other)]
    told = [sentence for pair in pairs for sentence in _told(words, *pair, values)]
    if study.reference and not any(one.differences(other) for one, other in rigid):
        told.insert(0, words.text("few"))
    return stops + told


def against_rigid(study: MotionStudy) -> list[tuple[Ensemble, Ensemble]]:
    """List the models with springs, each with the rigid one."""
    reference = study.reference
    return [(one, reference) for one in study.ensembles if reference and one.engine != RIGID]


def changed_by(study: MotionStudy, without: MotionStudy | None) -> list[tuple[Ensemble, Ensemble]]:
    """List the models of a study, each with itself at the other friction."""
    return [
        (one, other)
        for one in study.ensembles
        for other in (without.ensembles if without else ())
        if one.title.startswith(other.title) or other.title.startswith(one.title)
    ]


def stop(one: Ensemble, other: Ensemble) -> list[dict[str, object]]:
    """Say which of two models lets nobody through where the other lets people through, for the
    words; nothing where none does."""
    found = one.differences(other).get("flow")
    if found is None or not (found.stops and found.significant):
        return []
    still, moving = (one, other) if found.value < 0 else (other, one)
    flow = interval_cell(moving.interval("flow"))
    names = {"still": in_a_sentence(still.title), "moving": in_a_sentence(moving.title)}
    return [names | {"count": len(still.series), "flow": flow}]


def _told(
    words: Words, one: Ensemble, other: Ensemble, differ: str, alike: str, values: dict[str, float]
) -> list[str]:
    """In which measures a model differs from another, and in which no significant difference was
    found, with the smallest that would have been seen."""
    apart, same = split(one.differences(other), MEASURES)
    model = in_a_sentence(one.title)
    return [
        words.text(block, model=model, found=rows, **values)
        for block, rows in ((differ, apart), (alike, same))
        if rows
    ]


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
        "replicates": study.crowds,
        "friction": study.friction,
        "last_s": study.last_s,
        "models": {one.title: _numbers(one, study.reference) for one in study.ensembles},
    }


def _numbers(one: Ensemble, reference: Ensemble | None) -> dict[str, object]:
    numbers: dict[str, object] = {}
    compared = {} if reference in (None, one) else one.differences(reference)
    for key, measure in MEASURES.items():
        found = one.interval(key)
        entry: dict[str, object] = {
            "unit": measure.unit,
            "mean": found.mean,
            "range_90": [found.low, found.high],
            "replicates": found.replicates,
            "windows_per_replicate": found.windows,
            "independent_windows": found.independent,
        }
        if (above := compared.get(key)) is not None:
            # a share, or in the unit where the rigid one is next to zero
            name = "above_rigid" if above.relative else "more_than_rigid"
            entry[name] = above.value
            entry[f"{name}_interval_90"] = [above.low, above.high]
            entry["smallest_seen"] = above.least
            entry["probability"] = above.probability
        numbers[key] = entry
    return numbers
