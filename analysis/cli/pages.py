"""Commands that write a page: report, chart, stability, standards, advise, paper, push, measured, explore, infer,
audit."""

from __future__ import annotations

import math
import re
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from analysis.cli.app import (
    command_line,
    drop_none,
    progress,
    refuse_beside,
    say_expected,
    say_runs,
    show,
    show_page,
    warn,
)
from analysis.cli.compare_designs import NOT_COMPARED, Comparing
from analysis.cli.options import (
    InputFile,
    NotNegative,
    OfDump,
    Out,
    Positive,
    Processes,
    Replicates,
    RigidLaw,
    Seed,
    Share,
    Unit,
)
from analysis.support.machine import cores

if TYPE_CHECKING:
    from analysis.scene.scene import Scene
    from analysis.studies.report.page import Reported
    from analysis.studies.work_precision.whole_runs import Planned


def explore(scene: list[str] | None = None, *, out: Out = Path("explore")) -> None:
    """Write a page in which the rigid engine presses a crowd while you watch.

    It runs in the browser without a server or a network.

    scene: Scenes that it offers, the first of which opens. Default: all shipped scenes of a crowd that
        pushes.

    Example: percussions explore arch gate --out explore"""
    from analysis.scene.scene import read_scene
    from analysis.studies.explore.page import offered, write_explore

    scenes = [read_scene(name) for name in scene] if scene else offered()
    show_page(write_explore(scenes, out, command_line()))


def report(
    context: typer.Context,
    scenes: list[str],
    *,
    comparing: Comparing,
    engine: list[str] | None = None,
    stiffness: list[Positive] | None = None,
    seeds: Replicates = 5,
    last: Positive | None = None,
    rigid_law: RigidLaw = None,
    limits: list[Path] | None = None,
    sheet: bool = False,
    scheduler: str | None = None,
    runs: Out = Path("out"),
    out: Out = Path("report"),
) -> None:
    """Run, solve and compare: one HTML page, CSV and JSON beside it.

    Exit status 1 if a run failed or a snapshot is not solved. A driven crowd also has replicates
    from start to end, with friction, push, radius and bodies varied.

    scenes: Scenes, by name or .toml file.
    engine: Engine. May be repeated. Default: all that are installed. With --compare one: rigid.
    stiffness: Stiffness in N/m. May be repeated. Default: the scene's.
    last: How much of the end of each run of a driven scene counts, in s. Default: 1.
    sheet: Write a page A4 (PDF) for a safety file, too.

    seeds: Replicates of each driven scene. 0: none.

    Example: percussions report narrow.toml wide.toml --compare --until decided"""
    from analysis.compare.study import study
    from analysis.engines import ENGINES
    from analysis.percussions.setting import standing_walls
    from analysis.scene.scene import read_scene
    from analysis.studies.exposure.limits import limits_of_people
    from analysis.studies.motion.study import read_runs, study_motion
    from analysis.studies.report.page import Reported, write_report
    from analysis.studies.report.runs import films_of, motion_of, runs_of, scenes_of, snapshot_runs
    from analysis.studies.report.sheet import write_sheets
    from analysis.support.parallel import workers

    runs = runs.resolve() if scheduler else runs  # a worker is at home in another folder
    limits_of_people(own := tuple(limits or ()))  # a wrong file is refused before anything runs
    if comparing.compare:
        refuse_beside(context, NOT_COMPARED, "not with --compare")
        comparing.write(scenes, engine or ["rigid"], seeds, own, runs, out)
    comparing.refuse_alone()
    soft = _with_springs(names := engine or [each.NAME for each in ENGINES])
    read = [read_scene(scene) for scene in scenes]
    for one in read:
        standing_walls(one)
    chosen = [(one, stiffness or [one.contact.stiffness_N_per_m]) for one in read]
    motions = [motion_of(one, names, ks, seeds, runs) for one, ks in chosen]
    if last and not any(motions):
        raise ValueError("--last: only of driven scenes with replicates (--seeds)")
    say_runs(needed := runs_of(chosen, soft, motions, runs))
    reported = []
    with progress() as bars, workers(scheduler=scheduler) as pool:
        moving = [run for models in motions for model in models for run in model.runs]
        series = read_runs(moving, own, bars, pool, needed)  # all at once, so that no core waits
        for (one, ks), models in zip(chosen, motions, strict=True):
            where = snapshot_runs(runs, models)
            made = study(one, scenes_of(one, soft, models), ks, where, bars, rigid_law)
            whole_runs = study_motion(one, models, last or 1.0, own, series) if models else None
            animations = films_of(made, models, where, (last or 1.0) if models else math.inf, bars, pool)
            reported.append(Reported(study=made, motion=whole_runs, animations=animations))
        page = write_report(reported, out, command_line(), own, bars, pool)
        for path in write_sheets(reported, out, command_line()) if sheet else ():
            print(path)
    show_page(page)
    _say_reported(reported)


def _say_reported(reported: Sequence[Reported]) -> None:
    """Say what failed, and end with the status of a report."""
    for done in reported:
        for warning in done.study.warnings:
            warn(f"{done.scene.name}: {warning}")
        for failure in done.failures:
            print(f"failed: {done.scene.name}: {failure}", file=sys.stderr)
    every = [one.solution.status for done in reported for one in done.study.comparisons]
    solved = all(status == "solved" for status in every)
    compared = all(done.moved or done.study.comparisons for done in reported)
    raise typer.Exit(not (solved and compared) or any(done.failures for done in reported))


def _with_springs(names: Sequence[str]) -> list[str]:
    """The engines with springs among those named. There must be one."""
    from analysis.engines import PENALTY, engine

    for name in names:
        engine(name)
    every = [each.NAME for each in PENALTY]
    soft = [name for name in every if name in names]
    if not soft:
        raise ValueError(
            "engine: a report compares the rigid model with one that has springs. Name one of "
            + ", ".join(every)
        )
    return soft


# Crowds of whole runs: they about double what a chart costs.
SEEDS = 3


def chart(
    scene: str,
    *,
    quick: bool = False,
    seeds: Replicates | None = None,
    runs: Out = Path("out"),
    scheduler: str | None = None,
    jobs: Processes | None = None,
    out: Out = Path("chart"),
) -> None:
    """Measure cost against error of every method on a scene.

    Each on one instant, and the engines on whole runs of several crowds.

    Writes a page with charts, and its points as CSV and JSON.

    quick: A coarse chart: few settings, and one size.
    seeds: Crowds that every engine runs from start to end, for errors of means. 0: none. Default:
        3, none of a quick chart.

    Example: percussions chart arch --out chart/arch"""
    from analysis.scene.scene import read_scene
    from analysis.studies.work_precision import chart as instants
    from analysis.studies.work_precision import page, point, soft, whole_runs

    chosen = read_scene(scene)
    soft.check_chart(chosen)
    crowds = (0 if quick else SEEDS) if seeds is None else seeds
    full = whole_runs.whole_runs_of(chosen, crowds, runs)
    _say_chart(chosen, runs, quick, jobs, full)
    found, sections = None, []
    with progress() as bars:
        made = instants.build_chart(
            chosen, runs, quick=quick, processes=jobs, scheduler=scheduler, progress=bars
        )
        if full:
            found = whole_runs.measure_whole_runs(chosen, full, progress=bars, processes=jobs)
            sections = [whole_runs.whole_runs_section(found)]
    written = page.write_chart(made, out, command_line(), sections)
    if found:
        point.write_points(out, found.points, whole_runs.NAME, whole_runs.WholeRunPoint)
    for quantity in made.quantities:
        head, rows = page.front_table(made, quantity)
        title = f"Pareto fronts, all methods and soft contacts alone: {quantity.words}"
        show(head, rows, numbers_from=2, title=f"{title} ({quantity.unit})")
    for warning in made.warnings:
        warn(warning)
    show_page(written)


def _say_chart(
    scene: Scene, runs: Path, quick: bool, jobs: int | None, full: Sequence[Planned]
) -> None:
    from analysis.engines import PENALTY
    from analysis.engines.price import expected_seconds
    from analysis.studies.work_precision import soft
    from analysis.studies.work_precision.window import driven_window, impact_window

    driven = scene.drive is not None
    window = driven_window(scene, scene.snapshot.position) if driven else impact_window(scene)
    folder = runs / "work_precision" / scene.name
    names = [engine.NAME for engine in PENALTY if engine.find()]
    settings = soft.settings_of(window, names, soft.QUICK if quick else soft.FULL)
    missing = [one for one in settings if not soft.run_folder(folder, one).exists()]
    seconds = sum(expected_seconds(soft.scene_of(window, one), one.method) for one in missing)
    start = soft.pressing(scene)
    if start is not None and names and not (folder / "start.npz").exists():
        # on one core, before anything else
        seconds += (jobs or cores()) * expected_seconds(start, names[0])
    more = [one.run for one in full if not one.run.is_finished()]
    seconds += sum(expected_seconds(run.scene, run.engine) for run in more)
    say_expected(seconds, f"{len(missing) + len(more)} runs of engines", jobs)


# CPU seconds of an attempt, start of its engine included.
ATTEMPT_S = 2.0


def stability(
    *,
    case: list[str] | None = None,
    quick: bool = False,
    runs: Out = Path("out"),
    scheduler: str | None = None,
    jobs: Processes | None = None,
    out: Out = Path("stability"),
) -> None:
    """Find where each method fails, by provoked failures, and compare with theory.

    case: Name of a case. May be repeated. Default: all.
    quick: A coarse atlas.

    Example: percussions stability --case time_step --case skin --out stability"""
    from analysis.studies.stability.atlas import build, choose
    from analysis.studies.stability.page import summary, write_atlas

    started, cases = time.perf_counter(), choose(case, quick)
    attempts = sum(len(one.rows.values) * len(one.columns.values) for one in cases)
    say_expected(attempts * ATTEMPT_S, f"at most {attempts} attempts and their boundaries", jobs)
    with progress() as bars:
        maps = build(cases, runs, quick, bars, jobs, scheduler)
    page = write_atlas(maps, out, command_line(), quick, time.perf_counter() - started)
    print(*summary(maps), sep="\n")
    show_page(page)


def standards(
    *,
    case: list[str] | None = None,
    engine: str = "rigid",
    time_gap: Positive = 0.6,
    runs: Out = Path("out"),
    jobs: Processes | None = None,
    out: Out = Path("standards"),
) -> None:
    """Run tests of NIST TN 1822, ISO 20414 and RiMEA, and tell which pass.

    Exit status 1 if one fails. Writes standards.html, standards.csv and standards.json. About 3
    min of CPU with the rigid engine.

    case: Name of a test. May be repeated. Default: all.
    engine: Engine.
    time_gap: Of the people who wait, in s: 0.6 as in films, 0.8 as the standards' largest flow.

    Example: percussions standards --case corridor --case corner --out standards"""
    from analysis.studies.standards.page import choose, run_tests, write_page

    chosen = choose(case)
    with progress() as bars:
        tested = run_tests(chosen, engine, runs, bars, jobs, time_gap)
    page = write_page(tested, engine, out, command_line())
    rows = [(one.case.name, *one.called, one.result, one.words["found"]) for one in tested]
    show(("test", "NIST", "ISO", "RiMEA", "result", "found"), rows, numbers_from=6)
    show_page(page)
    raise typer.Exit(not all(one.judged.passed for one in tested))


def advise(
    scene: str,
    *,
    error: str,
    quantity: str = "disk-load",
    against: Literal["rigid", "model"] | None = None,
    method: list[str] | None = None,
    body: str | None = None,
    chart: Path | None = None,
    runs: Out = Path("out"),
    out: Out = Path("advice"),
) -> None:
    """Choose the cheapest method whose measured error is within what is asked.

    Exit status 1 if there is none.

    error: Error that is allowed, such as 5% or 0.05.
    quantity: Of an instant: disk-load, contact-load, wall-load or displacement. Of a whole run:
        arrest-load, mean-wall-load, mean-contact-force, contact-force-95 or flow. With --body
        also mean-person-load, largest-person-load or door-density.
    against: rigid (numerical and model error) or model (numerical error of the scene's own
        contacts). Default: rigid.
    method: rigid, lammps or yade. May be repeated. Default: all that are installed.
    body: chest, social_force or lemons: a whole run of people as soft as these. Default: the limit
        of hard people.
    chart: Folder of a chart of this very scene, to read instead of the stored library.

    Example: percussions advise arch --error 5% --quantity wall-load"""
    from analysis.scene.named_crowds import distance_lines
    from analysis.scene.scene import read_scene
    from analysis.studies.advice import choice, whole_runs
    from analysis.studies.advice.candidates import Question, asked_error
    from analysis.studies.advice.library import stored_library
    from analysis.studies.work_precision.point import Point, read_points
    from analysis.support.files import write_json

    chosen, allowed, methods = read_scene(scene), asked_error(error), choice.methods_here(method)
    file = out / "advice.json"
    if body is not None:
        if against or chart:
            raise ValueError("--body: it is of the stored library, without --against and --chart")
        soft = whole_runs.advise_bodies(chosen, allowed, quantity, methods, body)
        write_json(file, soft.content())
        print(*whole_runs.body_lines(soft), file, sep="\n")
        raise typer.Exit(not soft.engine)
    ladder = []
    if chosen.drive:
        is_measured = not chosen.drive.keeps_distance  # it was measured with who pushes for ever
        ladder = ["", *distance_lines(chosen.drive)]
        ladder += whole_runs.ladder_lines(chosen) if is_measured else []
    if quantity in whole_runs.QUANTITIES:
        if against:
            raise ValueError("--against: only of the quantities of an instant")
        own = None if chart is None else chart / whole_runs.FILE
        moving = whole_runs.advise_motion(chosen, allowed, quantity, methods, own)
        write_json(file, moving.content())
        print(*whole_runs.motion_lines(moving), *ladder, file, sep="\n")
        raise typer.Exit(moving.choice is None)
    points = None if chart is None else read_points(chart / "points.json", Point)
    about = against or "rigid"
    question = Question(error=allowed, quantity=quantity, against=about, methods=methods)
    advice = choice.advise(chosen, question, library=stored_library(), chart=points)
    with progress() as bars:
        bars(f"{chosen.name}: what it can do without", 0.0)
        left = [*choice.left_out(chosen, runs / "work_precision" / chosen.name)]
        bars(f"{chosen.name}: what it can do without", 1.0)
    write_json(file, advice.content() | {"left_out": left})
    print(*choice.report(advice, left), *ladder, file, sep="\n")
    raise typer.Exit(advice.choice is None)


def paper(
    section: Literal["discrete", "continuum"] | None = None,
    *,
    figure: list[str] | None = None,
    runs: Out = Path("out"),
    out: Out = Path("paper"),
) -> None:
    """Recompute the paper's figures, and say which of its statements hold.

    Writes a page for each section, and the pictures as files.

    section: Section of the paper. Default: both.
    figure: Number of a figure (continuum: also 3.2.1, mesh, bridge). May be repeated.
        Default: all.

    Example: percussions paper discrete --figure 1 --figure 3 --out paper"""
    from analysis.studies.paper.page import PAGES, write_pages

    names: list[str] = [section] if section else [*PAGES]
    _say_paper(names, runs, figure)
    with progress() as bars:
        pages, warnings = write_pages(names, out, runs, command_line(), figure, bars)
    for warning in warnings:
        warn(warning)
    for page in pages:
        show_page(page)


def _say_paper(names: list[str], runs: Path, figures: list[str] | None) -> None:
    from analysis.studies.paper.page import PAGES, folder_of, stored_section

    parts = [part for name in names for part in PAGES[name].parts if not figures or part.number in figures]
    seconds = sum(part.seconds for part in parts if part.engine_runs or not stored_section(folder_of(runs, part)))
    needed = [run for part in parts if part.engine_runs for run in part.engine_runs(runs)]
    say_runs(needed, "what is not there yet", seconds, None)


def push(
    file: InputFile,
    *,
    wall: float | None = None,
    arms: list[Share] | None = None,
    reach: list[Share] | None = None,
    time_unit: Literal["s", "ms"] = "s",
    take_as_is: bool = False,
    out: Out = Path("push"),
) -> None:
    """Compute a push trial after the event: which models beat the baselines?

    The first of the row moves as measured. The others move by penalty contacts (2·10³ to 10⁶ N/m)
    or as rigid people, in 5,000 cases of posture, arms, floor and chests. Nothing is fitted. Also read, if
    there: Weight_kg, Gender, MoCap_ID and Order_of_Participants_MoCap_ID.

    Writes a page, scores.csv and onsets.csv.

    file: CSV with id, time, x, y: heads of people in a row.
    wall: Where a wall crosses the row, in m: x or y as in the file.
    arms: Share of the room between chests that arms bridge from the start. Several: drawn between
        the least and the most. By default 0 to 1.
    reach: Reach of the soft layer of arms in m. Several: drawn between the
        least and the longest. By default 0 to 0.2.

    Example: percussions push scenes/push_excerpt.csv"""
    from analysis.studies.push.hindcast import ARMS, REACH_M, expected_seconds, hindcast
    from analysis.studies.push.page import HEAD, summary, verdicts, write_hindcast
    from analysis.studies.push.trial import read_trial

    trial = read_trial(file, wall, time_unit=time_unit, take_as_is=take_as_is)
    for note in trial.notes:
        warn(note)
    say_expected(expected_seconds(trial), f"rows of {len(trial.people)} people")
    with progress() as bars:
        found = hindcast(trial, arms or ARMS, reach=reach or REACH_M, progress=bars)
    *tables, page = write_hindcast(found, out, command_line())
    show(HEAD, summary(found), title=f"{file.name}: median (5 – 95 %) of the possible cases")
    for line in verdicts(found):
        print(f"- {line.replace('**', '')}")
    print(*tables, sep="\n")
    show_page(page)


def measured(
    folder: InputFile,
    *,
    friction: Positive = 0.3,
    step: list[str] | None = None,
    alpha: NotNegative | None = None,
    beta: Positive | None = None,
    bands: bool = False,
    out: Out = Path("measured"),
) -> None:
    """Compare predicted contact forces with measured ones, contact by contact.

    Of photoelastic disks: the loads on the boundary come from the measured forces, and models predict
    all others. Writes a page and measured.csv.

    folder: Folder with PREFIX_ParticleData.dlm and PREFIX_NormWeightedAdjacencyMatrix.dlm of each step,
        or PREFIX_coordinates.txt and PREFIX_bonds.txt.
    friction: Coulomb's μ of the disks.
    step: Name of a step. May be repeated. Default: all.
    alpha: Relative error of a force. Default: from both sides of the contacts, 0.085 if there is one.
    beta: Absolute error of a force in N. Default: from both sides, 0.0046 if there is one.
    bands: Also try which law has 90 % bands that hold 90 % of the forces.

    Example: percussions measured forward --step DSC05384"""
    from analysis.studies.measured.models import calibrate, judge
    from analysis.studies.measured.packing import ALPHA, BETA_N, ErrorBar, read_packing, steps_of
    from analysis.studies.measured.page import HEAD, SECONDS, summary, write_measured

    found = steps_of(folder)
    for name in step or ():
        if name not in found:
            raise ValueError(f"--step: no step {name}. There are {', '.join(found)}")
    inputs = None
    if alpha is not None or beta is not None:
        inputs = ErrorBar(ALPHA if alpha is None else alpha, BETA_N if beta is None else beta)
    packings = [read_packing(name, *found[name], inputs) for name in step or found]
    for packing in packings:
        if packing.error.assumed:
            warn(f"{packing.name}: the error bar is assumed, not from both sides of contacts")
    disks = sum(len(packing.snapshot) for packing in packings)
    say_expected(SECONDS * disks * (3 if bands else 1), f"{len(packings)} steps of {disks} disks")
    with progress() as bars:
        judged = []
        for index, packing in enumerate(packings):
            bars("steps", index / len(packings))
            judged.append(judge(packing, friction, index))
        laws = calibrate(packings, friction, bars) if bands else []
    *tables, page = write_measured(judged, laws, friction, out, command_line())
    show(HEAD, summary(judged), title=f"{folder.name}: mean of {len(judged)} steps")
    print(*tables, sep="\n")
    show_page(page)


def infer(
    file: InputFile,
    *,
    room: InputFile,
    row: str | None = None,
    without: list[str] | None = None,
    window: Positive | None = None,
    runs: Annotated[int, typer.Option(min=60, max=10_000)] = 600,
    seed: Seed = 1,
    unit: Unit | None = None,
    frame_rate: Positive | None = None,
    columns: str | None = None,
    time_unit: Literal["s", "ms"] | None = None,
    take_as_is: bool = False,
    jobs: Processes | None = None,
    out: Out = Path("infer"),
) -> None:
    """Infer how hard a crowd pushes before a door, and how large contact forces are, from what is seen.

    Crowds that keep their distance are simulated in the same room and compared with what was seen.
    Exit status 1 if none looks like it. There is no force then.

    Writes a page, infer.json and runs.csv.

    file: Trajectory of heads, or CSV with people, flow_per_s and, if known, density_per_m2 and
        speed_m_per_s. These are from zone_start_m to zone_end_m before the door.
    room: TOML file with the walls and the door.
    row: Of a table: the first cell of the row that is meant.
    without: Number that is not compared, as its column in runs.csv. May be repeated.
    window: Seconds. Infer the push in each window of the film in which five people leave, too.
    runs: Simulated crowds.
    columns: What each column is, as 'frame id x y', where names do not say.

    Example: percussions infer 040_c_56_h-.txt --room scenes/rooms/gate_passage.toml --unit m"""
    from analysis.studies.infer import inference, page
    from analysis.studies.infer.observations import see

    arguments = drop_none(unit=unit, frame_rate=frame_rate, columns=columns, time_unit=time_unit, take_as_is=take_as_is or None)
    observed = see(file, room, row, without=without or (), window_s=window, **arguments)
    say_expected(inference.expected_seconds(observed.site, runs), f"{runs} simulated crowds", jobs)
    with progress() as bars:
        ran = inference.run_prior(observed.site, runs, seed, bars, jobs)
        found = inference.infer(observed.site, observed.statistics, ran, seed, bars)
        parts = inference.infer_parts(observed.site, [one for *_, one in observed.windows], ran, seed)
    if window:
        course = page.write_course(observed.windows, parts, out / "windows.csv")
        show([*course], list(zip(*course.values(), strict=True)), title=f"{file.name}: windows of {window:g} s")
    *files, written = page.write_inferred(found, file.name, observed.notes, out, command_line())
    show(page.HEAD, page.rows(found), title=f"{file.name}: median (5–95 %)")
    print(page.verdict(found).replace("**", ""), *files, sep="\n")
    show_page(written)
    raise typer.Exit(not found.fits)


def audit(
    target: InputFile,
    *,
    of_dump: OfDump,
    contacts: InputFile | None = None,
    contacts_columns: str | None = None,
    room: InputFile | None = None,
    acceleration: str | None = None,
    friction: NotNegative | None = None,
    frames: str | None = None,
    within: Positive = 0.05,
    out: Out = Path("audit"),
) -> None:
    """Judge whether listed contact forces are forces, by the momentum of their bodies.

    Says what else they are where they are not: impulses, of another step or unit, normal parts only,
    without walls. Exit status: 0 they agree, 1 they do not, 2 it cannot be judged.
    Writes a page and audit.json.

    target: Folder of a run, or a LAMMPS dump of disks.
    contacts: Their contacts: a dump local, a table (CSV, Parquet) with step or time_s, or the folder that
        exaDEM writes. Default: those of the run.
    room: Room or scene file (.toml) with walls, drive and body force. Default: scene.toml beside the dump.
    acceleration: Body force over mass in m/s², such as "0,-9.81". "0,0": nothing else acts.
    friction: Coulomb's μ, to count forces outside its cone. Default: the room's.
    frames: first:last:step, both ends included. Default: all.
    within: Share of the needed force that may stay unexplained.

    Example: percussions audit bodies.dump --contacts pairs.csv --acceleration 0,-9.81 --time-step 1e-4"""
    from analysis.percussions.audit.judge import judge
    from analysis.studies.audit import open_record, write_audit

    if acceleration and not re.fullmatch(r"[-+.\de]+,[-+.\de]+", acceleration):
        raise ValueError(f"--acceleration: {acceleration}. Two numbers such as 0,-9.81 are needed")
    inputs, g = of_dump.of_dump(), [float(word) for word in acceleration.split(",")] if acceleration else None
    record, setting = open_record(target, contacts, contacts_columns, room, frames, g, **inputs)
    found = judge(record, setting.friction or None if friction is None else friction, record.step_s, within)
    table, page = write_audit(found, target.name, out, command_line())
    smallest_fault = [f"a fault below {found.smallest_fault:.2g} N on a body could not be seen"] if found.fits else []
    print(found.words, *found.remarks, *smallest_fault, table, sep="\n")
    show_page(page)
    raise typer.Exit(found.exit_status)
