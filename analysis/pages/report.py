"""The report: charts, sections of scenes, and the page with its files."""

import math
from collections.abc import Mapping, Sequence, Set
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from analysis.compare.comparison import AT_REST, FEWEST, FORCE, Comparison, write_contacts
from analysis.compare.statistics import (
    Range,
    carried_ranges,
    penalty_difference,
    statistics,
    wall_ranges,
)
from analysis.compare.study import Study
from analysis.engines.penalty import penalty_of
from analysis.pages.approach import MEASURES, SAME, fit_power, moved_between
from analysis.pages.drawing import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    LINES,
    MARKERS,
    NARROW_IN,
    ORANGE,
    PALE_BLUE,
    add_scale,
    contact_lines,
    draw_disks,
    draw_forces,
    draw_vectors,
    draw_walls,
    frame,
    size_of,
)
from analysis.pages.html import render, write_pictures
from analysis.pages.names import engine_label, engine_name
from analysis.pages.numbers import number, percent, summed
from analysis.pages.section import Cell, Picture, Section, Table
from analysis.pages.words import Words
from analysis.percussions.snapshot import percussions_of
from analysis.scene.scene import Scene
from analysis.support.files import write_json, write_text
from nscd.arrays import Floats
from nscd.indeterminacy.determinacy import determinacy


def scene_picture(scene: Scene) -> Figure:
    """Draw the initial state: disks, walls, the door, and who moves or walks where."""
    snapshot, drive = scene.snapshot, scene.drive
    shown = snapshot.position
    if drive and drive.goals:
        shown = np.concatenate([shown, *(exit_.door for exit_ in drive.doors)])
    size = size_of(shown, float(snapshot.radius.max()), 1)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    draw_disks(axes, snapshot, PALE_BLUE)
    draw_walls(axes, _walls(scene))
    velocity = (
        drive.desired_velocity(snapshot.position, snapshot.ids) if drive else snapshot.velocity
    )
    moving = np.hypot(*velocity.T) > 0
    if moving.any():
        x, v = snapshot.position[moving], velocity[moving]
        label = "desired direction" if drive else "velocity at the start"
        length = 1.5 * snapshot.radius.mean() / np.hypot(*velocity.T).max()
        draw_vectors(axes, x, length * v, color=ORANGE, width=0.003, label=label)
    if drive:
        for number, exit_ in enumerate(drive.doors):
            (x0, y0), (x1, y1) = exit_.door
            name = None if number else "door"
            axes.plot([x0, x1], [y0, y1], color=GREEN, lw=3, ls=":", label=name)
    if axes.get_legend_handles_labels()[0]:
        figure.legend(loc="outside lower center", ncols=3, fontsize=8)
    frame(axes, shown, float(snapshot.radius.max()))
    return figure


def force_networks(comparisons: Sequence[Comparison], *, narrow: bool = False) -> Figure:
    """Draw the contact forces of each engine and of the rigid model on the same snapshot, side by
    side or, for a telephone, below each other.

    Width and shade grow with the normal force, on one scale."""
    parts = [(engine_label(c), c, c.match.normal_parts()[0]) for c in comparisons]
    first = comparisons[0]
    snapshot_of = f"Percussions on the {engine_name(first.record.engine)} snapshot"
    parts.append((snapshot_of, first, first.match.normal_parts()[1]))
    view = _lines(comparisons[0]).reshape(-1, 2)
    radius = float(comparisons[0].snapshot.radius.max())
    size = size_of(view, radius, len(parts), narrow=narrow)
    figure = Figure(figsize=size, layout="constrained")
    every = np.concatenate([force[force > 0] for _, _, force in parts])
    top = float(np.quantile(every, 0.99)) if len(every) else 1.0
    norm = Normalize(0.0, top)
    for place, (label, comparison, force) in enumerate(parts):
        axes = figure.add_subplot(*_grid(len(parts), narrow), place + 1)
        snapshot = comparison.snapshot
        draw_disks(axes, snapshot)
        draw_walls(axes, _walls(comparison.scene))
        draw_forces(axes, _lines(comparison), force, norm)
        axes.set_title(label, fontsize=10)
        frame(axes, view, float(snapshot.radius.max()))
    unit = comparisons[0].unit
    quantity = "normal contact force" if unit == FORCE else "normal contact impulse"
    add_scale(figure, figure.axes, norm, f"{quantity} ({unit})", narrow=narrow)
    return figure


def carried_maps(comparison: Comparison, *, narrow: bool = False) -> Figure:
    """Draw what each disk carries, the sum of the magnitudes of its normal forces.

    Penalty and rigid, on one scale."""
    sums = comparison.disk_sums()
    lines = _lines(comparison).reshape(-1, 2)
    size = size_of(lines, float(comparison.snapshot.radius.max()), 2, narrow=narrow)
    figure = Figure(figsize=size, layout="constrained")
    norm = Normalize(0.0, float(np.quantile(np.concatenate(sums), 0.995)) or 1.0)
    labels = (engine_label(comparison), "Percussions")
    for axes, label, values in zip(figure.subplots(*_grid(2, narrow)), labels, sums, strict=True):
        snapshot = comparison.snapshot
        draw_disks(axes, snapshot, values=values, norm=norm)
        draw_walls(axes, _walls(comparison.scene))
        axes.set_title(label, fontsize=10)
        frame(axes, lines, float(snapshot.radius.max()))
    words = f"sum of normal magnitudes ({comparison.unit})"
    add_scale(figure, figure.axes, norm, words, narrow=narrow)
    return figure


def scatter(comparisons: Sequence[Comparison], *, narrow: bool = False) -> Figure:
    """Draw rigid against penalty, contact by contact; filled where mechanics determines the rigid
    force."""
    columns = 1 if narrow else min(len(comparisons), 4)
    rows = -(-len(comparisons) // columns)
    figure = Figure(figsize=(3.9 * columns, 3.9 * rows + 0.4), layout="constrained")
    for place, comparison in enumerate(comparisons):
        axes = figure.add_subplot(rows, columns, place + 1)
        penalty, rigid = comparison.match.normal_parts()
        fixed = comparison.match.determined
        top = 1.05 * max(float(penalty.max()), float(rigid.max()), 1e-12)
        low = min(0.0, 1.05 * float(penalty.min()), 1.05 * float(rigid.min()))
        axes.plot([low, top], [low, top], color=BLACK, lw=0.8, label="equal")
        axes.plot(
            penalty[~fixed], rigid[~fixed], "o", ms=4, mfc="none", mec=ORANGE, mew=0.8,
            label="not determined, or in one model only",
        )  # fmt: skip
        axes.plot(penalty[fixed], rigid[fixed], "s", ms=2.5, color=BLUE, label="determined")
        unit = comparison.unit
        axes.set(xlim=(low, top), ylim=(low, top), aspect="equal", title=engine_label(comparison))
        axes.set_xlabel(f"penalty ({'contact force' if unit == FORCE else '∫f dt'}, {unit})")
        axes.set_ylabel(f"rigid ({'p/τ' if unit == FORCE else 'percussion p'}, {unit})")
        axes.title.set_fontsize(10)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    ncols = 1 if narrow else 3
    figure.legend(handles, labels, loc="outside lower center", ncols=ncols, fontsize=8)
    return figure


def distributions(comparisons: Sequence[Comparison], *, narrow: bool = False) -> Figure:
    """Draw the share of contacts whose normal force exceeds f, over its mean.

    The penalty model of each run, and the rigid one."""
    figure = Figure(figsize=(NARROW_IN, 3.6) if narrow else (6.5, 4.0), layout="constrained")
    axes = figure.add_subplot()
    for place, comparison in enumerate(comparisons):
        penalty, rigid = comparison.match.normal_parts()
        colour, width = COLOURS[place % 4], 3.0 / (place + 1)
        label, had = engine_label(comparison), penalty[comparison.match.in_penalty]
        _exceedance(axes, had, label, color=colour, lw=width)
        if not place:
            label, had = "percussions on the same snapshot", rigid[comparison.match.in_rigid]
            _exceedance(axes, had, label, color=BLACK, ls="--", lw=1.2)
    axes.set(yscale="log", xlabel="normal force / its mean over pressed contacts")
    axes.set_ylabel("share of pressed contacts beyond")
    axes.grid(alpha=0.3)
    if axes.lines:
        axes.legend(fontsize=7)
    else:
        axes.text(0.5, 0.5, "too few contacts", ha="center", transform=axes.transAxes)
    return figure


def stiffness_study(comparisons: Sequence[Comparison], *, narrow: bool = False) -> Figure:
    """Draw the relative difference of rigid and penalty forces against the stiffness.

    With a guide of the slope of 1/k."""
    figure = Figure(figsize=(NARROW_IN, 3.6) if narrow else (6.5, 4.0), layout="constrained")
    axes = figure.add_subplot()
    engines = sorted({c.record.engine for c in comparisons})
    kinds = (
        ("contact", "all contacts", BLUE),
        ("determined", "determined contacts", ORANGE),
        ("disk_sum", "sum at each disk", GREEN),
    )
    stiffness = np.array(sorted({c.scene.contact.stiffness_N_per_m for c in comparisons}))
    for row, engine in enumerate(engines):
        chosen = sorted(
            (c for c in comparisons if c.record.engine == engine),
            key=lambda c: c.scene.contact.stiffness_N_per_m,
        )
        for kind, words, colour in kinds:
            values = [statistics(c)[f"{kind}_relative_difference"] for c in chosen]
            x = [c.scene.contact.stiffness_N_per_m for c in chosen]
            axes.plot(
                x, values, MARKERS[row], ls=LINES[row], color=colour,
                mfc="none" if row else colour, label=f"{engine_name(engine)}: {words}",
            )  # fmt: skip
    first = [
        v for line in axes.lines if np.isfinite(v := np.asarray(line.get_ydata())[0]) and v > 0
    ]
    if first and len(stiffness) > 1:
        guide = max(first) * stiffness[0] / stiffness
        axes.plot(stiffness, guide, color=GREY, lw=1, label="slope −1")
    axes.set(xscale="log", yscale="log", xlabel="stiffness k (N/m)")
    axes.set_ylabel("rms(rigid − penalty) / rms(penalty)")
    axes.grid(alpha=0.3, which="both")
    axes.legend(fontsize=7)
    return figure


def _exceedance(axes: Axes, force: Floats, label: str, **look: Any) -> None:
    pressed = np.sort(force[force > 1e-9 * force.max(initial=0.0)])
    if len(pressed) > 1:
        beyond = 1.0 - np.arange(len(pressed)) / len(pressed)
        axes.step(pressed / pressed.mean(), beyond, label=label, **look)


def _grid(panels: int, narrow: bool) -> tuple[int, int]:
    """Rows and columns of so many panels."""
    return (panels, 1) if narrow else (1, panels)


def _lines(comparison: Comparison) -> Floats:
    return contact_lines(comparison.snapshot, comparison.match.contacts)


def _walls(scene: Scene) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    return [(wall.start_m, wall.end_m) for wall in scene.walls]


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
        "scene": [scene_picture(study.scene)],
        "networks": [force_networks(stiffest, narrow=narrow) for narrow in (False, True)],
        "carried": [carried_maps(stiffest[0], narrow=narrow) for narrow in (False, True)],
        "scatter": [scatter(comparisons, narrow=narrow) for narrow in (False, True)],
        "distributions": [distributions(stiffest, narrow=narrow) for narrow in (False, True)],
    }
    if len(stiffest) < len(comparisons):
        drawn["stiffness"] = [
            stiffness_study(comparisons, narrow=narrow) for narrow in (False, True)
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
        *_wall_tables(words, names, runs),
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


def _wall_tables(words: Words, names: Sequence[str], runs: Sequence[Run]) -> list[Table]:
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
