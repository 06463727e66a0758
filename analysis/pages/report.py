"""The report: one self-contained HTML page from studies, with CSV, JSON and pictures beside it."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from analysis.compare.comparison import Comparison
from analysis.compare.contacts_csv import write_contacts
from analysis.compare.load_ranges import wall_ranges
from analysis.compare.statistics import penalty_difference, statistics
from analysis.compare.study import Study
from analysis.engines.penalty import penalty_of
from analysis.pages.html import render, write_pictures
from analysis.pages.names import engine_name
from analysis.pages.report_section import report_section
from analysis.pages.section import Section
from analysis.support.files import write_json, write_text


@dataclass(frozen=True, slots=True, kw_only=True)
class InMotion:
    """Hold what a report takes of a scene in motion: its first screen, its sections, its numbers,
    the runs that failed."""

    first: Section | None
    sections: Sequence[Section]
    numbers: Mapping[str, object]
    failures: Sequence[str]


def write_report(
    studies: Sequence[Study],
    folder: Path,
    command: str,
    in_motion: Sequence[InMotion | None] = (),
) -> Path:
    """Write the page and what lies beside it into the folder; return the page's path.

    in_motion: one per study, None where the scene does not move. First screens open the page; a
        scene in motion stands before its snapshots

    Beside `index.html` are `numbers.json`, one CSV of contacts per run, and in `figures/` every
    picture as PNG and PDF, its name beginning with that of the scene.
    """
    folder.mkdir(parents=True, exist_ok=True)
    studies = _with_distinct_names(studies)
    runs = {study.scene.name: _runs(study) for study in studies}
    for study in studies:
        for comparison, run in zip(study.comparisons, runs[study.scene.name], strict=True):
            write_contacts(folder / run["csv"], comparison)
    moving = list(in_motion) or [None] * len(studies)
    firsts = [motion.first for motion in moving if motion and motion.first]
    sections: list[Section] = []
    for study, motion in zip(studies, moving, strict=True):
        if motion:
            sections += motion.sections
        sections.append(report_section(study, runs[study.scene.name]))
    images = write_pictures([*firsts, *sections], folder / "figures")
    page = render("report.html", firsts=firsts, sections=sections, images=images, command=command)
    numbers = {
        study.scene.name: {
            "failures": study.failures,
            "warnings": study.warnings,
            "runs": runs[study.scene.name],
            **({"in_motion": motion.numbers} if motion and motion.numbers else {}),
        }
        for study, motion in zip(studies, moving, strict=True)
    }
    write_json(folder / "numbers.json", numbers)
    write_text(folder / "index.html", page)
    return folder / "index.html"


def _with_distinct_names(studies: Sequence[Study]) -> list[Study]:
    """Number the scenes that have the name of an earlier one: pair, pair_2, …"""
    named: dict[str, Study] = {}
    for study in studies:
        name, count = study.scene.name, 1
        while name in named:
            count += 1
            name = f"{study.scene.name}_{count}"
        scene = study.scene.model_copy(update={"name": name})
        named[name] = study if count == 1 else replace(study, scene=scene)
    return list(named.values())


def _runs(study: Study) -> list[dict[str, Any]]:
    """The numbers of each run, and how far it is from the first engine with the same contacts."""
    runs = []
    for comparison in study.comparisons:
        same = [c for c in study.comparisons if c.scene.contact == comparison.scene.contact]
        stiffness = comparison.scene.contact.stiffness_N_per_m
        first, engine = same[0], comparison.record.engine
        runs.append(
            _numbers(comparison)
            | {
                "csv": f"{study.scene.name}_{engine}_k{stiffness:.6g}.csv",
                "difference_from_first_engine": None
                if first is comparison
                else penalty_difference(first, comparison),
                "first_engine": engine_name(first.record.engine),
            }
        )
    return runs


def _numbers(comparison: Comparison) -> dict[str, Any]:
    record, penalty = comparison.record, penalty_of(comparison.scene)
    spans = wall_ranges(comparison, range(len(comparison.scene.walls)))
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
        "drive_magnitudes": comparison.balance.magnitudes,
        "walls": [(*load, span) for load, span in zip(comparison.wall_loads(), spans, strict=True)],
        "unit": comparison.unit,
    }
