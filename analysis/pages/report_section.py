"""One scene of the report: what came out, its tables and its pictures."""

import math
from collections.abc import Mapping, Sequence, Set
from typing import Any

import numpy as np

from analysis.compare.comparison import FORCE, Comparison
from analysis.compare.load_ranges import Range, carried_ranges
from analysis.compare.relaxed import AT_REST, FEWEST
from analysis.compare.study import Study
from analysis.pages import report_charts as charts
from analysis.pages.approach import MEASURES, SAME, fit_power, moved_between
from analysis.pages.names import engine_label
from analysis.pages.numbers import number, percent, summed
from analysis.pages.section import Cell, Picture, Section, Table
from analysis.pages.words import Words
from analysis.percussions.snapshot import percussions_of
from analysis.scene.scene import Scene
from nscd.indeterminacy.determinacy import determinacy

MOST = 5

Run = dict[str, Any]


def report_section(study: Study, runs: Sequence[Run]) -> Section:
    """Put a study into words, tables and pictures; runs: the numbers of each comparison."""
    scene = study.scene
    words = Words(__package__, kind="impulse" if scene.analysis.kind == "impact" else "force")
    failures = list(study.failures)
    some = bool(study.comparisons)
    if not some:
        failures.append(words.text("nothing"))
    return Section(
        number=scene.name,
        title=words.text("title", title=scene.title, time=scene.analysis.time_s),
        introduction=[
            words.text("instant"),
            words.text("determined", friction=scene.contact.friction),
            scene.notes,
            words.text("source", scene=scene),
        ],
        words=_found(words, study, runs) if some else (),
        pictures=_pictures(words, study) if some else (),
        tables=_tables(words, study, runs) if some else (),
        warnings=[*failures, *study.warnings],
        files=[run["csv"] for run in runs],
    )


def _found(words: Words, study: Study, runs: Sequence[Run]) -> list[str]:
    """What came out, in sentences."""
    said = []
    for run in runs:
        block = "found" if run["difference_from_first_engine"] is None else "agree"
        said.append(words.text(block, run=run))
    said += _trends(words, runs, _moved(study), study.anew)
    moving = max(c.balance.unbalanced for c in study.comparisons)
    if moving > AT_REST:
        said.append(words.text("moving", share=moving))
    if study.scene.reconciliation:
        frame, done = _real_frame(study.scene), study.scene.reconciliation
        said.append(words.text("frame", frame=frame, done=done))
    return said


def _trends(
    words: Words, runs: Sequence[Run], moved: Mapping[str, float], anew: Set[str] = frozenset()
) -> list[str]:
    """What rising stiffness does, one sentence for all engines of which the same is to be said.

    moved: how far (m) somebody is from one run of an engine to another; where that is not nothing,
        motion and softness cannot be told apart and nothing is concluded
    anew: engines whose stiffer runs began where the softest had come to rest"""
    said: dict[str, list[str]] = {}
    for engine in sorted({run["engine"] for run in runs}):
        mine = sorted((run for run in runs if run["engine"] == engine), key=_of_stiffness)
        k = [run["stiffness"] for run in mine]
        table = {key: [_difference(run, key) for run in mine] for key in MEASURES}
        if len(k) < 2 or not all(math.isfinite(value) for value in table["contact"]):
            continue
        same = engine in anew or not moved.get(engine)
        fits = {MEASURES[key]: fit_power(k, values) for key, values in table.items() if same}
        values = {
            "stiffnesses": k,
            "differences": [(MEASURES[key], row) for key, row in table.items()],
            "moved": moved.get(engine, 0.0),
            "anew": engine in anew,
            "fits": {title: fit for title, fit in fits.items() if fit},
            "fewest": FEWEST,
        }
        sentence = words.text("trend", engines="ENGINES", **values)
        said.setdefault(sentence, []).append(mine[0]["engine_name"])
    return [sentence.replace("ENGINES", " and ".join(names), 1) for sentence, names in said.items()]


def _of_stiffness(run: Run) -> float:
    return float(run["stiffness"])


def _difference(run: Run, key: str) -> float:
    return float(run["statistics"][f"{key}_relative_difference"])


def _moved(study: Study) -> dict[str, float]:
    """How far somebody is from one run of an engine to another (m); 0 where it is rounding."""
    scale = SAME * float(study.scene.snapshot.radius.mean())
    engines = {comparison.record.engine for comparison in study.comparisons}
    found = {engine: moved_between(study, engine) for engine in engines}
    return {engine: moved if moved > scale else 0.0 for engine, moved in found.items()}


def _real_frame(scene: Scene) -> dict[str, Any]:
    """Percussions of the imported frame as forces p/τ (N)."""
    found = percussions_of(scene, scene.snapshot, tolerance=1e-10)
    force = found.answer.reaction / (found.window or 1.0)
    return {
        "contacts": len(found.contacts),
        "mean": float(force.mean()) if len(force) else 0.0,
        "largest": float(force.max(initial=0.0)),
        "determined": int(determinacy(found.contacts, len(scene.snapshot)).determined.sum()),
        "status": str(found.answer.status),
        "residual": found.answer.residual,
    }


def _pictures(words: Words, study: Study) -> list[Picture]:
    comparisons = study.comparisons
    largest = _stiffness(_stiffest(study))
    stiffest = [c for c in comparisons if _stiffness(c) == largest]
    drawn = {
        "scene": [charts.scene_picture(study.scene)],
        "networks": [charts.force_networks(stiffest, narrow=narrow) for narrow in (False, True)],
        "carried": [charts.carried_maps(stiffest[0], narrow=narrow) for narrow in (False, True)],
        "scatter": [charts.scatter(comparisons, narrow=narrow) for narrow in (False, True)],
        "distributions": [
            charts.distributions(stiffest, narrow=narrow) for narrow in (False, True)
        ],
    }
    if len(stiffest) < len(comparisons):
        drawn["stiffness"] = [
            charts.stiffness_study(comparisons, narrow=narrow) for narrow in (False, True)
        ]
    return [
        Picture(
            name=f"{study.scene.name}-{name}",
            caption=words.text(name),
            figure=figures[0],
            narrow=figures[-1] if len(figures) > 1 else None,
        )
        for name, figures in drawn.items()
    ]


def _tables(words: Words, study: Study, runs: Sequence[Run]) -> list[Table]:
    scene, unit = study.scene, runs[0]["unit"]
    impact = unit != FORCE
    names = [engine_label(comparison) for comparison in study.comparisons]
    contacts = [_per_contact(name, run) for name, run in zip(names, runs, strict=True)]
    balances = [_balance(name, run, impact) for name, run in zip(names, runs, strict=True)]
    tables = [
        words.table("per-contact", contacts),
        words.table("carriers", _carriers(study), unit=unit, run=engine_label(_stiffest(study))),
        words.table("balance", balances, unit=unit, impact=impact),
        *_walls(words, names, runs),
        words.table("parameters", _parameters(scene, runs)),
        words.table("engines", [_engine(run) for run in runs]),
    ]
    if scene.reconciliation:
        rows = scene.reconciliation.rows()
        if scene.other_frames:
            rows += scene.other_frames.rows()
        tables.append(words.table("reconciliation", list(rows)))
    return tables


def _per_contact(name: str, run: Run) -> list[Cell]:
    s = run["statistics"]
    differences = ("contact", "determined", "disk_sum", "disk_vector")
    return [
        name,
        s["contacts_both"],
        s["contacts_only_penalty"],
        s["contacts_only_rigid"],
        number(s["contact_correlation"], 4),
        *(percent(s[f"{kind}_relative_difference"]) for kind in differences),
        run["status"],
        number(s["residual"], 2),
        number(run["percussion_seconds"]),
    ]


def _balance(name: str, run: Run, impact: bool) -> list[Cell]:
    of = run["drive_magnitudes"]
    sums = [
        f"{summed(run[key][0], of, 6)}, {summed(run[key][1], of)}"
        for key in ("drive_sum", "wall_sum", "rigid_wall_sum")
    ]
    row: list[Cell] = [name, *sums, percent(run["statistics"]["closure_error"])]
    return row if impact else [*row, percent(run["statistics"]["unbalanced_share"])]


def _walls(words: Words, names: Sequence[str], runs: Sequence[Run]) -> list[Table]:
    """The loads of the walls that anybody presses."""
    loaded = {
        wall
        for run in runs
        for wall, *loads, _ in run["walls"]
        if any(summed(load, run["drive_magnitudes"]) != "0" for load in loads)
    }
    rows: list[list[Cell]] = []
    for name, run in zip(names, runs, strict=True):
        row: list[Cell] = [name]
        for wall, penalty, rigid, span in run["walls"]:
            if wall in loaded:
                loads = [summed(load, run["drive_magnitudes"], 4) for load in (penalty, rigid)]
                row += [*loads, reach(span)]
        rows.append(row)
    walls = [wall for wall, *_ in runs[0]["walls"] if wall in loaded]
    return [words.table("walls", rows, unit=runs[0]["unit"], walls=walls)] if walls else []


def _parameters(scene: Scene, runs: Sequence[Run]) -> list[list[Cell]]:
    snapshot, contact = scene.snapshot, scene.contact
    rows: list[list[Cell]] = [
        ["disks", len(snapshot)],
        ["radius (m)", _from_to(float(snapshot.radius.min()), float(snapshot.radius.max()))],
        ["mass (kg)", _from_to(float(snapshot.mass.min()), float(snapshot.mass.max()))],
    ]
    if scene.drive:
        wish = f"{number(scene.drive.speed_m_per_s)}, {number(scene.drive.relaxation_time_s)}"
        rows.append(["desired speed (m/s), relaxation time τ (s)", wish])
    law = f"{contact.law}, {number(contact.restitution)}, {number(contact.friction)}"
    compared = (
        f"forces at {number(runs[0]['time_s'])} s"
        if runs[0]["unit"] == FORCE
        else f"impulses over the whole run of {number(scene.run.duration_s)} s"
    )
    return [*rows, ["law, asked restitution, friction", law], ["compared", compared]]


def _engine(run: Run) -> list[Cell]:
    record, cpu = run["record"], run["record"]["cpu_seconds"]
    step = number(record["time_step_s"])
    return [
        run["engine_name"],
        record["version"],
        number(run["stiffness"]),
        f"**{step}**" if record["time_step_s"] > 1.001 * run["safe_time_step_s"] else step,
        number(run["safe_time_step_s"]),
        _from_to(record["restitution_least"], record["restitution_most"]),
        record["steps"],
        number(cpu),
        number(record["particle_steps"] / cpu if cpu else None),
    ]


def _carriers(study: Study) -> list[list[Cell]]:
    """The disks that carry most in the rigid model of the stiffest run, and their ranks."""
    comparison = _stiffest(study)
    penalty, rigid = comparison.disk_sums()
    rank = np.argsort(np.argsort(-penalty, kind="stable"), kind="stable") + 1
    first = [int(disk) for disk in np.argsort(-rigid, kind="stable")[:MOST]]
    rows: list[list[Cell]] = []
    for disk, span in zip(first, carried_ranges(comparison, first), strict=True):
        x, y = comparison.snapshot.position[disk]
        who, where = int(comparison.snapshot.ids[disk]), f"{number(x)}, {number(y)}"
        loads = number(rigid[disk]), reach(span), number(penalty[disk])
        rows.append([len(rows) + 1, who, where, *loads, int(rank[disk])])
    return rows


def _stiffest(study: Study) -> Comparison:
    return max(study.comparisons, key=_stiffness)


def _stiffness(comparison: Comparison) -> float:
    return comparison.scene.contact.stiffness_N_per_m


def reach(span: Range) -> str:
    """Write a range: determined, its ends, and a status that is not proven."""
    if span.status == "determined":
        return "determined"
    ends = f"{number(span.lower, 4)} – {number(span.upper, 4)}"
    return ends if span.status == "proven" else f"{ends} ({span.status})"


def _from_to(least: float, most: float) -> str:
    return number(least) if most - least <= 1e-9 else f"{number(least)} – {number(most)}"
