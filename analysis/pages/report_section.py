"""One scene of the report: what came out, its tables and its pictures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from analysis.compare.comparison import FORCE, Comparison
from analysis.compare.load_ranges import Range, carried_ranges
from analysis.compare.study import Study
from analysis.pages import report_charts as charts
from analysis.pages.names import engine_label
from analysis.pages.numbers import number, percent
from analysis.pages.section import Cell, Picture, Section, Table
from analysis.pages.words import Words
from analysis.percussions.snapshot import percussions_of
from analysis.scene.scene import Scene
from nscd.indeterminacy.determinacy import determinacy

# The share of the drive that may still accelerate a crowd "at rest".
MOVING = 0.01
# Two relative differences whose ratio is between these are nearly the same.
MUCH_LESS, NO_LESS = 0.8, 0.95
MOST = 5

Run = dict[str, Any]


def report_section(study: Study, runs: Sequence[Run]) -> Section:
    """Put a study into words, tables and pictures; runs: the numbers of each comparison."""
    scene, words = study.scene, Words(__package__)
    failures = list(study.failures)
    if not study.comparisons:
        failures.append(words.text("nothing"))
    introduction = [scene.notes, words.text("source", scene=scene)]
    if not study.comparisons:
        return Section(
            number=scene.name,
            title=scene.title,
            introduction=introduction,
            warnings=[*failures, *study.warnings],
        )
    return Section(
        number=scene.name,
        title=scene.title,
        introduction=introduction,
        words=_found(words, study, runs),
        pictures=_pictures(words, study),
        tables=_tables(words, study, runs),
        warnings=[*failures, *study.warnings],
        files=[run["csv"] for run in runs],
    )


def _found(words: Words, study: Study, runs: Sequence[Run]) -> list[str]:
    """What came out, in sentences."""
    kind = "force" if runs[0]["unit"] == FORCE else "impulse"
    said = []
    for run in runs:
        first = run["difference_from_first_engine"] is None
        name = "found" if first else "agree"
        said.append(words.text(name, run=run, engines=run["engine_name"], kind=kind))
    said += _trends(words, runs, kind)
    moving = max(c.balance.unbalanced for c in study.comparisons)
    if moving > MOVING:
        said.append(words.text("moving", share=moving))
    if study.scene.reconciliation:
        said.append(words.text("frame", frame=_real_frame(study.scene)))
    return said


def _trends(words: Words, runs: Sequence[Run], kind: str) -> list[str]:
    """What rising stiffness does, one sentence for all engines of which the same is to be said."""
    said: dict[str, list[str]] = {}
    for engine in sorted({run["engine"] for run in runs}):
        mine = sorted(
            (r for r in runs if r["engine"] == engine), key=lambda r: float(r["stiffness"])
        )
        soft, stiff = mine[0], mine[-1]
        before, after = (
            float(run["statistics"]["contact_relative_difference"]) for run in (soft, stiff)
        )
        if soft is stiff or not (math.isfinite(before) and math.isfinite(after)):
            continue
        verdict = (
            "approach each other"
            if after < MUCH_LESS * before
            else "do not approach each other"
            if after > NO_LESS * before
            else "approach each other a little"
        )
        values = {"soft": soft, "stiff": stiff, "before": before, "after": after}
        sentence = words.text("trend", engines="ENGINES", kind=kind, verdict=verdict, **values)
        said.setdefault(sentence, []).append(stiff["engine_name"])
    return [sentence.replace("ENGINES", " and ".join(names), 1) for sentence, names in said.items()]


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
    largest = max(c.scene.contact.stiffness_N_per_m for c in comparisons)
    stiffest = [c for c in comparisons if c.scene.contact.stiffness_N_per_m == largest]
    drawn = {
        "scene": charts.scene_picture(study.scene),
        "networks": charts.force_networks(stiffest),
        "carried": charts.carried_maps(stiffest[0]),
        "scatter": charts.scatter(comparisons),
        "distributions": charts.distributions(stiffest),
    }
    if len({c.scene.contact.stiffness_N_per_m for c in comparisons}) > 1:
        drawn["stiffness"] = charts.stiffness_study(comparisons)
    return [
        Picture(name=f"{study.scene.name}-{name}", caption=words.text(name), figure=figure)
        for name, figure in drawn.items()
    ]


def _tables(words: Words, study: Study, runs: Sequence[Run]) -> list[Table]:
    scene, unit = study.scene, runs[0]["unit"]
    impact = unit != FORCE
    names = [engine_label(comparison) for comparison in study.comparisons]
    tables = [
        words.table("per-contact", [_per_contact(n, r) for n, r in zip(names, runs, strict=True)]),
        words.table("carriers", _carriers(study), unit=unit, run=_stiffest_words(study)),
        words.table(
            "balance",
            [_balance(n, r, impact) for n, r in zip(names, runs, strict=True)],
            unit=unit,
            impact=impact,
        ),
        *_walls(words, names, runs),
        words.table("parameters", _parameters(scene, runs)),
        words.table("engines", [_engine(run) for run in runs]),
    ]
    if scene.reconciliation:
        tables.append(words.table("reconciliation", list(scene.reconciliation.rows())))
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
    sums = [
        f"{number(run[key][0], 6)}, {number(run[key][1])}"
        for key in ("drive_sum", "wall_sum", "rigid_wall_sum")
    ]
    row: list[Cell] = [name, *sums, percent(run["statistics"]["closure_error"])]
    return row if impact else [*row, percent(run["statistics"]["unbalanced_share"])]


def _walls(words: Words, names: Sequence[str], runs: Sequence[Run]) -> list[Table]:
    """The loads of the walls that anybody presses."""
    loaded = {wall for run in runs for wall, penalty, rigid, _ in run["walls"] if penalty or rigid}
    rows: list[list[Cell]] = []
    for name, run in zip(names, runs, strict=True):
        row: list[Cell] = [name]
        for wall, penalty, rigid, span in run["walls"]:
            if wall in loaded:
                row += [number(penalty, 4), number(rigid, 4), reach(span)]
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
        speed, time = scene.drive.speed_m_per_s, scene.drive.relaxation_time_s
        rows.append(
            ["desired speed (m/s), relaxation time τ (s)", f"{number(speed)}, {number(time)}"]
        )
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
    for place, (disk, span) in enumerate(
        zip(first, carried_ranges(comparison, first), strict=True), start=1
    ):
        x, y = comparison.snapshot.position[disk]
        rows.append(
            [
                place,
                int(comparison.snapshot.ids[disk]),
                f"{number(float(x))}, {number(float(y))}",
                number(float(rigid[disk])),
                reach(span),
                number(float(penalty[disk])),
                int(rank[disk]),
            ]
        )
    return rows


def _stiffest(study: Study) -> Comparison:
    return max(study.comparisons, key=lambda c: c.scene.contact.stiffness_N_per_m)


def _stiffest_words(study: Study) -> str:
    return engine_label(_stiffest(study))


def reach(span: Range) -> str:
    """Write a range: determined, its ends, and a status that is not proven."""
    if span.status == "determined":
        return "determined"
    ends = f"{number(span.lower, 4)} – {number(span.upper, 4)}"
    return ends if span.status == "proven" else f"{ends} ({span.status})"


def _from_to(least: float, most: float) -> str:
    return number(least) if most - least <= 1e-9 else f"{number(least)} – {number(most)}"
