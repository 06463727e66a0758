"""The first screen about one scene in motion: who bears how much, beside the limits of people."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure

from analysis.engines.softness import DOUBTFUL, NO_CROWD, known_bodies, softness
from analysis.exposure.exposure import (
    QUANTITIES,
    Limit,
    above_key,
    known_limits,
    limits_of_people,
    loads_of,
)
from analysis.motion.section import against_rigid, changed_by, stop
from analysis.motion.study import (
    MEASURES,
    Ensemble,
    Measure,
    MotionStudy,
    count_cell,
    difference_cell,
    interval_cell,
    split,
)
from analysis.pages.bodies import ladder_table
from analysis.pages.drawing import NARROW_IN, SHADES, draw_disks, draw_walls, frame
from analysis.pages.numbers import NONE, significant
from analysis.pages.section import Cell, Picture, Section, Table
from analysis.pages.words import Words
from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import how_varied
from nscd.arrays import Flags, Floats

QUANTITY = "contact_largest"
# Of the picture: it stands beside words.
WIDE_IN = 6.5


def loads_picture(
    scene: Scene, models: Sequence[Ensemble], files: tuple[Path, ...] = (), *, narrow: bool = False
) -> Figure:
    """Draw crowd 0 in its last window by the first and the last model, people shaded by their
    largest contact force between the limits of that quantity; files: of further limits; narrow: for
    a telephone."""
    shown = [models[0], models[-1]] if len(models) > 1 else list(models)
    ends = [model.series[0].final for model in shown]
    windows = [window for window in ends if window is not None]
    loads = [loads_of(scene, window).person[QUANTITY] for window in windows]
    known = limits_of_people(files)
    limits = sorted({one.number for one in known if one.quantity == QUANTITY})
    top = max(max(float(load.max(initial=0.0)) for load in loads), 1.5 * limits[-1])
    steps = [0.0, *limits, float(f"{top:.1g}")]
    norm = BoundaryNorm(steps, 256)
    inside = [_inside(scene, window.now.position) for window in windows]
    places = np.concatenate([w.now.position[i] for w, i in zip(windows, inside, strict=True)])
    margin = float(scene.snapshot.radius.max())
    width, height = np.ptp(places, axis=0)
    # below each other where that makes the better use of half a screen
    rows = len(shown) if narrow or width > height else 1
    wide = NARROW_IN if narrow else WIDE_IN
    tall = np.clip(0.75 * wide * height / width * rows**2 / len(shown), 3.0, 7.0)
    figure = Figure(figsize=(wide, float(tall) + 0.6 * rows), layout="constrained")
    every = figure.subplots(rows, len(shown) // rows, squeeze=False).ravel()
    for axes, model, window, load in zip(every, shown, windows, loads, strict=True):
        draw_disks(axes, window.now, values=load, norm=norm)
        draw_walls(axes, [(wall.start_m, wall.end_m) for wall in scene.walls])
        frame(axes, places, margin)
        axes.set_title(model.title, fontsize=9)
    bar = figure.colorbar(
        ScalarMappable(norm, mpl.colormaps[SHADES]),
        ax=list(every),
        ticks=steps[:-1],
        spacing="uniform",
        shrink=0.8,
        label="largest contact force of a person (N)",
    )
    bar.ax.set_yticklabels([f"{step:,.0f}".replace(",", "\u202f") for step in steps[:-1]])
    return figure


def _inside(scene: Scene, position: Floats) -> Flags:
    """Who has not passed the line of the door."""
    drive = scene.drive
    assert drive is not None
    inside: Flags = (position - np.array(drive.door_start_m)) @ np.array(drive.outward) < 0
    return inside


HEADLINES: Mapping[str, Measure] = {
    "flow": MEASURES["flow"],
    "density_door": MEASURES["density_door"],
    "contact_largest": MEASURES["contact_largest"],
    "person_largest": MEASURES["person_largest"],
    "pressure_door": MEASURES["pressure_door"],
    "walls": MEASURES["walls"],
    "wall_line_load": Measure(title="load on the worst metre of wall", unit="kN/m"),
}
# The limit that the first screen names in a sentence; the table has all.
NAMED = "asphyxia_minutes"
# Pushes of people (N per person), and who says so; the words of the page name the sources.
GREEN_GUIDE_N = (213.0, 219.0)


def headline_section(
    scene: Scene, study: MotionStudy | None = None, rough: MotionStudy | None = None
) -> Section | None:
    """Put a driven scene on one screen; None where no model ran. Without a study, of no replicates,
    it has no numbers. rough: the study of the same with the other friction."""
    words = Words(__name__)
    values: dict[str, object] = {"people": len(scene.snapshot), "duration": scene.run.duration_s}
    name, title = f"{scene.name}-at-a-glance", scene.title
    said = [words.text("push", push=scene.push_range, drive=scene.drive, green=GREEN_GUIDE_N)]
    if study is None:
        introduction = [words.text("once", **values, **_bodies(scene)), words.text("people")]
        said += [words.text("none"), _soft(words, scene)]
        tables = [ladder_table(scene)]
        return Section(
            number=name, title=title, introduction=introduction, words=said, tables=tables
        )
    models = several(study)
    if not models:
        return None
    values |= {
        "models": [one.title for one in models],
        "crowds": study.crowds,
        "varied": how_varied(scene, study.crowds),
        "window": models[0].series[0].window_s,
        "last": models[0].last_s,
        "reconciliation": scene.reconciliation,
        "refused": scene.other_frames.refused if scene.other_frames else (),
        "frames_vary": study.crowds > 1 and bool(scene.other_crowds),
    }
    pictures = {
        "figure": loads_picture(scene, models, study.limits),
        "narrow": loads_picture(scene, models, study.limits, narrow=True),
    }
    caption = words.text("picture", time=models[-1].series[0].time[-1], **values)
    return Section(
        number=name,
        title=title,
        introduction=[words.text("what", **values, **_bodies(scene)), words.text("people")],
        words=[
            *_stops(words, study, rough),
            *said,
            *_loads(words, study, models, values),
            *_compared(words, study, models),
            _soft(words, scene),
        ],
        pictures=[Picture(name=f"{scene.name}-who-bears-most", caption=caption, **pictures)],
        tables=[
            _numbers(words, study, models),
            _limits(words, study, models, values),
            ladder_table(scene),
        ],
    )


def several(study: MotionStudy) -> list[Ensemble]:
    """List the models that ran more than one crowd, the rigid one last; all where none did."""
    ran = [one for one in study.ensembles if len(one.series) > 1] or list(study.ensembles)
    return sorted(ran, key=lambda one: one is study.reference)


def _bodies(scene: Scene) -> dict[str, float]:
    """Radii (m) and masses (kg) of a scene."""
    disks = scene.snapshot
    ends = {"radius": disks.radius, "mass": disks.mass}
    return {f"{key}_{end.__name__}": float(end(v)) for key, v in ends.items() for end in (min, max)}


def _stops(words: Words, study: MotionStudy, rough: MotionStudy | None) -> list[str]:
    """What stops the flow, of all models and by friction: the largest effect there can be."""
    pairs = against_rigid(study)
    if rough is not None:
        pairs += [*against_rigid(rough), *changed_by(rough, study)]
    return [words.text("stops", **found) for pair in pairs for found in stop(*pair)]


def _loads(
    words: Words, study: MotionStudy, models: Sequence[Ensemble], values: Mapping[str, object]
) -> list[str]:
    """What a safety engineer reads first: who is above a limit, and what walls bear."""
    named = next(one for one in limits_of_people(study.limits) if one.name == NAMED)
    barriers = [one for one in known_limits() if one.depth_m is not None]
    above = [(one.title, count_cell(one.interval(above_key(named)))) for one in models]
    lasting = _lasting(named)
    said = [words.text("above", limit=named, above=above, lasting=lasting, **values)]
    if any(one.interval("walls").mean > 0 for one in models):
        line = [(one.title, interval_cell(one.interval("wall_line_load"))) for one in models]
        said.append(words.text("walls", line=line, least=barriers[0], most=barriers[-1]))
    return said


def _compared(words: Words, study: MotionStudy, models: Sequence[Ensemble]) -> list[str]:
    """In which headline numbers the first model differs from the rigid one."""
    reference = study.reference
    if reference is None or models[0] is reference:
        return []
    differ, alike = split(models[0].differences(reference), HEADLINES)
    if not (differ or alike):
        return []
    titles = {"model": models[0].title, "rigid": reference.title}
    return [words.text("models", differ=differ, alike=alike, **titles)]


def _soft(words: Words, scene: Scene) -> str:
    """How much softer people are than these bodies."""
    chest = known_bodies()["chest"]
    ladder = (scene.contact.stiffness_N_per_m, chest.low_N_per_m, chest.high_N_per_m)
    soft = [(k, softness(scene, k)) for k in ladder]
    return words.text("soft", soft=soft, doubtful=DOUBTFUL, no_crowd=NO_CROWD)


def _numbers(words: Words, study: MotionStudy, models: Sequence[Ensemble]) -> Table:
    """Every headline number: interval in each model, whether they differ, independent instants."""
    reference = study.reference
    rows: list[list[Cell]] = []
    for key, measure in HEADLINES.items():
        cells = [interval_cell(one.interval(key)) for one in models]
        independent = significant(models[-1].interval(key).independent, 2)
        row: list[Cell] = [f"{measure.title} ({measure.unit})", *cells]
        if reference is not None and models[0] is not reference:
            row.append(_whether(models[0], reference, key))
        rows.append([*row, independent])
    names = [one.title for one in models]
    compared = names[0] if reference is not None and models[0] is not reference else None
    return words.table("numbers", rows, models=names, compared=compared)


def _whether(one: Ensemble, reference: Ensemble, key: str) -> str:
    """Whether a model differs from the rigid one, and by how much."""
    found = one.differences(reference).get(key)
    return NONE if found is None else difference_cell(found, HEADLINES[key].unit)


def _limits(
    words: Words, study: MotionStudy, models: Sequence[Ensemble], values: Mapping[str, object]
) -> Table:
    """How many people are above each limit at an instant, in each model."""
    rows: list[list[Cell]] = [
        [
            f"{significant(limit.number, 4)} {limit.unit}",
            f"{limit.what}{_lasting(limit)}; {limit.population}",
            QUANTITIES[limit.quantity].title,
            *(count_cell(one.interval(above_key(limit))) for one in models),
            limit.cited,
        ]
        for limit in limits_of_people(study.limits)
    ]
    return words.table("limits", rows, **values)


def _lasting(limit: Limit) -> str:
    """For how long a limit must last, in words."""
    if limit.duration_s is None:
        return ""
    if limit.duration_most_s is None:
        return f" in {significant(limit.duration_s)} s"
    low, high = (significant(time / 60) for time in (limit.duration_s, limit.duration_most_s))
    return f" in {low}–{high} min"


def headline_numbers(study: MotionStudy) -> dict[str, object]:
    """Give how many people are above each limit, and the load on the worst metre of wall."""
    keys = {above_key(one): "people" for one in limits_of_people(study.limits)} | {
        "wall_line_load": "kN/m"
    }
    return {
        one.title: {
            key: {
                "unit": unit,
                "mean": (found := one.interval(key)).mean,
                "range_90": [found.low, found.high],
                "independent_windows": found.independent,
            }
            for key, unit in keys.items()
        }
        for one in study.ensembles
    }
