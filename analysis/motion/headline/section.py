"""The first screen about one scene in motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from analysis.engines.softness import NO_CROWD, known_bodies, softness
from analysis.exposure.counts import above_key, limits_of_people
from analysis.exposure.limits import QUANTITIES, Limit, known_limits
from analysis.motion.ensemble import Ensemble
from analysis.motion.headline.picture import loads_picture
from analysis.motion.intervals import count_cell, difference_cell, difference_words, interval_cell
from analysis.motion.series import MEASURES, Measure
from analysis.motion.study import MotionStudy
from analysis.pages.bodies import ladder_table
from analysis.pages.numbers import NONE, significant
from analysis.pages.section import Cell, Picture, Section, Table
from analysis.pages.words import Words
from analysis.scene.scene import Scene
from analysis.scene.variation import how_varied

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


def headline_section(study: MotionStudy) -> Section | None:
    """Put a scene in motion on one screen; None where no model ran."""
    models = several(study)
    if not models:
        return None
    words, scene = Words(__package__), study.scene
    name = f"{scene.name}-at-a-glance"
    values = {
        "models": [one.title for one in models],
        "people": len(scene.snapshot),
        "crowds": study.crowds,
        "varied": how_varied(scene, study.crowds),
        "window": models[0].series[0].window_s,
        "last": models[0].last_s,
        "duration": scene.run.duration_s,
        "reconciliation": scene.reconciliation,
        "refused": scene.other_frames.refused if scene.other_frames else (),
        "frames_vary": study.crowds > 1 and bool(scene.other_crowds),
    }
    caption = words.text("picture", time=models[-1].series[0].time[-1], **values)
    return Section(
        number=name,
        title=scene.title,
        introduction=[words.text("what", **values, **_bodies(scene)), words.text("people")],
        words=_said(words, study, models, values),
        pictures=[
            Picture(
                name=f"{scene.name}-who-bears-most",
                caption=caption,
                figure=loads_picture(scene, models, study.limits),
                narrow=loads_picture(scene, models, study.limits, narrow=True),
            )
        ],
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


def _said(
    words: Words, study: MotionStudy, models: Sequence[Ensemble], values: Mapping[str, object]
) -> list[str]:
    """What a safety engineer reads first, in sentences."""
    scene = study.scene
    chest = known_bodies()["chest"]
    ladder = (scene.contact.stiffness_N_per_m, chest.low_N_per_m, chest.high_N_per_m)
    soft = [(k, softness(scene, k)) for k in ladder]
    named = next(one for one in limits_of_people(study.limits) if one.name == NAMED)
    barriers = [one for one in known_limits() if one.depth_m is not None]
    said = [words.text("push", **_push(study.scene), green=GREEN_GUIDE_N)]
    above = [(one.title, count_cell(one.interval(above_key(named)))) for one in models]
    lasting = _lasting(named)
    said.append(words.text("above", limit=named, above=above, lasting=lasting, **values))
    if any(one.interval("walls").median > 0 for one in models):
        line = [(one.title, interval_cell(one.interval("wall_line_load"))) for one in models]
        said.append(words.text("walls", line=line, least=barriers[0], most=barriers[-1]))
    reference = study.reference
    if reference is not None and models[0] is not reference:
        found = {key: models[0].above(reference, key) for key in HEADLINES}
        known = {HEADLINES[key]: one for key, one in found.items() if one is not None}
        differ = [
            (measure.title, difference_words(one, measure.unit)[0])
            for measure, one in known.items()
            if one.distinguishable
        ]
        alike = [measure.title for measure, one in known.items() if not one.distinguishable]
        if known:
            titles = {"model": models[0].title, "rigid": reference.title}
            said.append(words.text("models", differ=differ, alike=alike, **titles))
    said.append(words.text("soft", soft=soft, no_crowd=NO_CROWD))
    return said


def _push(scene: Scene) -> dict[str, object]:
    """With how much each person pushes (N), and of what that is made."""
    drive = scene.drive
    assert drive is not None
    push = scene.snapshot.mass * drive.speed_m_per_s / drive.relaxation_time_s
    return {"push": (float(push.min()), float(push.max())), "drive": drive}


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
    """Whether a model differs from the rigid one by more than crowds do: yes, by how much."""
    found = one.above(reference, key)
    if found is None:
        return NONE
    said = difference_cell(found, HEADLINES[key].unit)
    return f"{'yes' if found.distinguishable else 'no'}: {said}"


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
                "median": (found := one.interval(key)).median,
                "interval_90": [found.low, found.high],
                "independent_windows": found.independent,
            }
            for key, unit in keys.items()
        }
        for one in study.ensembles
    }
