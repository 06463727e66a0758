"""The report: one self-contained HTML page from studies, with CSV and JSON beside it."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from analysis.compare.comparison import FORCE, Comparison
from analysis.compare.contacts_csv import write_contacts
from analysis.compare.load_ranges import carried_ranges, wall_ranges
from analysis.compare.statistics import penalty_difference, statistics
from analysis.compare.study import Study
from analysis.engines.penalty import penalty_of
from analysis.pages import report_charts as charts
from analysis.pages.html import inline, jsonable, render
from analysis.pages.names import engine_name
from analysis.pages.numbers import number, percent
from analysis.percussions.snapshot import percussions_of
from analysis.scene.scene import Scene
from analysis.support.files import write_text
from nscd.indeterminacy.determinacy import determinacy

# The share of the drive that may still accelerate a crowd "at rest".
MOVING = 0.01


def write_report(studies: Sequence[Study], folder: Path, command: str) -> Path:
    """Write `index.html`, `numbers.json` and one CSV of contacts a run into the folder; return the
    page's path."""
    folder.mkdir(parents=True, exist_ok=True)
    scenes = [
        _heading(study) | (_results(study, folder) if study.comparisons else {})
        for study in studies
    ]
    page = render(
        "report.html",
        scenes=scenes,
        command=command,
    )
    numbers = {
        content["name"]: {key: content[key] for key in ("failures", "warnings", "runs")}
        for content in scenes
    }
    write_text(
        folder / "numbers.json", json.dumps(jsonable(numbers), indent=1, ensure_ascii=False) + "\n"
    )
    write_text(folder / "index.html", page)
    return folder / "index.html"


def _heading(study: Study) -> dict[str, Any]:
    return {
        "name": study.scene.name,
        "scene": study.scene,
        "runs": [],
        "failures": study.failures,
        "warnings": study.warnings,
    }


def _results(study: Study, folder: Path) -> dict[str, Any]:
    scene, comparisons = study.scene, study.comparisons
    best = max(comparisons, key=lambda c: c.scene.contact.stiffness_N_per_m)
    stiffest = [
        c
        for c in comparisons
        if c.scene.contact.stiffness_N_per_m == best.scene.contact.stiffness_N_per_m
    ]
    figures = [
        ("scene", "The scene at the start", charts.scene_picture(scene)),
        ("networks", "Force networks on the same snapshot", charts.force_networks(stiffest)),
        ("carried", "Who carries most", charts.carried_maps(stiffest[0])),
        ("scatter", "Rigid against penalty, contact by contact", charts.scatter(comparisons)),
        ("distributions", "Distribution of the normal forces", charts.distributions(stiffest)),
    ]
    if len({c.scene.contact.stiffness_N_per_m for c in comparisons}) > 1:
        figures.append(
            (
                "stiffness",
                "Do they approach each other as the stiffness grows?",
                charts.stiffness_study(comparisons),
            )
        )
    runs = []
    for comparison in comparisons:
        name = f"{scene.name}_{comparison.record.engine}_k{comparison.scene.contact.stiffness_N_per_m:.6g}.csv"
        write_contacts(folder / name, comparison)
        same = [c for c in comparisons if c.scene.contact == comparison.scene.contact]
        apart = None if same[0] is comparison else penalty_difference(same[0], comparison)
        runs.append(
            _run_content(comparison)
            | {
                "csv": name,
                "difference_from_first_engine": apart,
                "first_engine": engine_name(same[0].record.engine),
            }
        )
    return {
        "impact": comparisons[0].unit != FORCE,
        "unit": comparisons[0].unit,
        "disks": len(scene.snapshot),
        "radius": (float(scene.snapshot.radius.min()), float(scene.snapshot.radius.max())),
        "mass": (float(scene.snapshot.mass.min()), float(scene.snapshot.mass.max())),
        "figures": [(key, title, inline(figure)) for key, title, figure in figures],
        "runs": runs,
        "moving": max(c.balance.unbalanced for c in comparisons)
        if max(c.balance.unbalanced for c in comparisons) > MOVING
        else 0.0,
        "loaded": {
            wall
            for run in runs
            for wall, penalty, rigid, _ in run["walls"]
            if abs(penalty) + abs(rigid) > 0
        },
        "frame": _real_frame(scene) if scene.reconciliation else None,
        "verdicts": _verdicts(runs),
        "carriers": _carriers(stiffest[0]),
    }


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


def _run_content(comparison: Comparison) -> dict[str, Any]:
    record, penalty = comparison.record, penalty_of(comparison.scene)
    return {
        "engine": record.engine,
        "engine_name": engine_name(record.engine),
        "stiffness": comparison.scene.contact.stiffness_N_per_m,
        "safe_time_step_s": penalty.safe_time_step,
        "time_s": comparison.snapshot.time,
        "record": asdict(record) | {"particle_steps": record.particle_steps},
        "statistics": statistics(comparison),
        "status": str(comparison.answer.status),
        "solver": comparison.answer.solver,
        "percussion_seconds": comparison.answer.seconds,
        "drive_sum": comparison.balance.drive.tolist(),
        "wall_sum": comparison.balance.walls.tolist(),
        "rigid_wall_sum": comparison.balance.rigid_walls.tolist(),
        "walls": [
            (*load, span)
            for load, span in zip(
                comparison.wall_loads(),
                wall_ranges(comparison, range(len(comparison.scene.walls))),
                strict=True,
            )
        ],
        "unit": comparison.unit,
    }


def _verdicts(runs: list[dict[str, Any]]) -> list[str]:
    """What the numbers say about rising stiffness, a sentence an engine."""
    sentences = []
    for engine in sorted({run["engine"] for run in runs}):
        mine = sorted(
            (run for run in runs if run["engine"] == engine),
            key=lambda run: float(run["stiffness"]),
        )
        soft, stiff = mine[0], mine[-1]
        if soft is stiff:
            continue
        before, after = (
            float(run["statistics"]["contact_relative_difference"]) for run in (soft, stiff)
        )
        if not (math.isfinite(before) and math.isfinite(after)):
            continue
        trend = (
            "approach each other"
            if after < 0.8 * before
            else "do not approach each other"
            if after > 0.95 * before
            else "approach each other a little"
        )
        sentences.append(
            f"{stiff['engine_name']}: from k = {number(soft['stiffness'])} to {number(stiff['stiffness'])} N/m "
            f"the relative difference per contact goes from {percent(before)} to {percent(after)} "
            f"(per disk: {percent(float(soft['statistics']['disk_sum_relative_difference']))} to "
            f"{percent(float(stiff['statistics']['disk_sum_relative_difference']))}): penalty and rigid forces {trend}."
        )
    return sentences


def _carriers(comparison: Comparison, most: int = 5) -> list[dict[str, Any]]:
    """The disks that carry most in the rigid model, with the range that the mechanics leaves open,
    what they carry in the penalty model, and both ranks."""
    penalty, rigid = comparison.disk_sums()
    rank_penalty = np.argsort(np.argsort(-penalty, kind="stable"), kind="stable") + 1
    rows: list[dict[str, Any]] = []
    first = np.argsort(-rigid, kind="stable")[:most]
    ranges = carried_ranges(comparison, [int(disk) for disk in first])
    for place, (disk, span) in enumerate(zip(first, ranges, strict=True), start=1):
        x, y = comparison.snapshot.position[disk]
        rows.append(
            {
                "place": place,
                "id": int(comparison.snapshot.ids[disk]),
                "x": float(x),
                "y": float(y),
                "rigid": float(rigid[disk]),
                "range": span,
                "penalty": float(penalty[disk]),
                "penalty_place": int(rank_penalty[disk]),
            }
        )
    return rows
