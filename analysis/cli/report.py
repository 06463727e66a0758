"""percussions report."""

import sys
from collections.abc import Sequence
from pathlib import Path

import typer

from analysis.cli.app import command_line, progress, say_runs, show_page, warn
from analysis.cli.options import Out, Positive, Replicates, RigidLaw


def report(
    scenes: list[str],
    *,
    engine: list[str] | None = None,
    stiffness: list[Positive] | None = None,
    seeds: Replicates = 5,
    last: Positive = 1.0,
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
    engine: Engine. May be repeated. Default: all that are installed.
    stiffness: Stiffness in N/m. May be repeated. Default: the scene's.
    last: How much of the end of each run counts, in s.
    sheet: Write a page A4 (PDF) for a safety file, too.

    seeds: Replicates of each driven scene. 0: none.

    Example: percussions report arch jam gate --seeds 10 --out report"""
    from analysis.compare.study import study
    from analysis.engines import ENGINES
    from analysis.engines.run import run_ahead
    from analysis.exposure.limits import limits_of_people
    from analysis.motion.study import study_motion
    from analysis.percussions.setting import standing_walls
    from analysis.report.page import Reported, write_report
    from analysis.report.runs import films_of, motion_of, runs_of, snapshot_runs
    from analysis.report.sheet import write_sheets
    from analysis.scene.scene import read_scene

    runs = runs.resolve() if scheduler else runs  # a worker is at home in another folder
    limits_of_people(own := tuple(limits or ()))  # a wrong file is refused before anything runs
    soft = _with_springs(names := engine or [known.NAME for known in ENGINES])
    read = [read_scene(scene) for scene in scenes]
    for one in read:
        standing_walls(one)
        if seeds and one.snapshot.wide is not None:
            raise ValueError(f"{one.name}: disks.bodies: loads of people need --seeds 0")
    chosen = [(one, stiffness or [one.contact.stiffness_N_per_m]) for one in read]
    motions = [motion_of(one, names, ks, seeds, runs) for one, ks in chosen]
    say_runs(needed := runs_of(chosen, soft, motions, runs))
    reported = []
    with progress() as bars:
        run_ahead(needed, bars, scheduler=scheduler)  # all at once, so that no core waits
        for (one, ks), models in zip(chosen, motions, strict=True):
            where = snapshot_runs(runs, models)
            scene = one.with_run(impulses=True) if models else one
            made = study(scene, soft, ks, where, bars, rigid_law)
            motion = study_motion(one, models, last, bars, own) if models else None
            reported.append(
                Reported(study=made, motion=motion, reels=films_of(made, models, where, bars))
            )
        page = write_report(reported, out, command_line(), own)
        for path in write_sheets(reported, out, command_line()) if sheet else ():
            print(path)
    well = True
    for done in reported:
        for warning in done.study.warnings:
            warn(f"{done.study.scene.name}: {warning}")
        for failure in done.failures:
            print(f"failed: {done.study.scene.name}: {failure}", file=sys.stderr)
        solved = all(one.answer.status == "solved" for one in done.study.comparisons)
        well = well and solved and not done.failures
    show_page(page)
    raise typer.Exit(not well)


def _with_springs(names: Sequence[str]) -> list[str]:
    """The engines with springs among those named. There must be one."""
    from analysis.engines import PENALTY, engine

    for name in names:
        engine(name)
    every = [known.NAME for known in PENALTY]
    soft = [name for name in every if name in names]
    if not soft:
        raise ValueError(
            "engine: a report compares the rigid model with one that has springs. Name one of "
            + ", ".join(every)
        )
    return soft
