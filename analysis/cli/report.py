"""percussions report."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from analysis.cli.app import Out, Runs, command_line, positive, progress, say_runs, warn
from analysis.cli.rigid_law import RigidLaw


def report(
    scenes: Annotated[list[str], typer.Argument(help="Scenes, by name or .toml file.")],
    engine: Annotated[
        list[str] | None,
        typer.Option(help="Engine; give it several times. Left out: all that are installed."),
    ] = None,
    stiffness: Annotated[
        list[float] | None,
        typer.Option(
            parser=positive,
            help="Stiffness in N/m; give it several times. Left out: the scene's and, for a "
            "driven crowd, ten times it.",
        ),
    ] = None,
    seeds: Annotated[
        int, typer.Option(min=0, max=1000, help="Crowds of each driven scene in motion; 0: none.")
    ] = 5,
    last: Annotated[
        float, typer.Option(parser=positive, help="How much of the end of each run counts, in s.")
    ] = 1.0,
    rigid_law: RigidLaw = None,
    runs: Runs = Path("out"),
    out: Out = Path("report"),
) -> None:
    """Run, solve and compare: one HTML page, CSV and JSON beside it.

    Exit status 1 if a run failed or a snapshot is not solved.

    Example: percussions report arch gate --out report
    """
    from analysis.compare.study import study
    from analysis.engines import ENGINES, PENALTY
    from analysis.engines import engine as find_engine
    from analysis.motion.report import in_motion, motion_of, runs_of
    from analysis.pages.report import write_report
    from analysis.scene.scene import read_scene

    names = engine or [known.NAME for known in ENGINES]
    for name in names:
        find_engine(name)
    soft = [known.NAME for known in PENALTY if known.NAME in names]
    if not soft:
        raise ValueError(
            "engine: a report compares the rigid model with one that has springs; name one of "
            + ", ".join(known.NAME for known in PENALTY)
        )
    chosen = []
    for scene in map(read_scene, scenes):
        k = scene.contact.stiffness_N_per_m
        # the stiffness changes nothing in an impact, the damping does
        default = [k] if scene.analysis.kind == "impact" else [k, 10 * k]
        chosen.append((scene, stiffness or default))
    motions = [motion_of(scene, names, k, seeds, runs) for scene, k in chosen]
    say_runs(runs_of(chosen, soft, motions, runs))
    with progress() as bars:
        moved = [
            in_motion(scene, motion, last, bars)
            for (scene, _), motion in zip(chosen, motions, strict=True)
        ]
        studies = [study(scene, soft, k, runs, bars, rigid_law) for scene, k in chosen]
        page = write_report(studies, out, command_line(), moved)
    failures = [(made.scene.name, failure) for made in studies for failure in made.failures]
    failures += [
        (scene.name, failure)
        for (scene, _), motion in zip(chosen, moved, strict=True)
        if motion
        for failure in motion.failures
    ]
    for made in studies:
        for warning in made.warnings:
            warn(f"{made.scene.name}: {warning}")
    for where, failure in failures:
        print(f"failed: {where}: {failure}", file=sys.stderr)
    print(page.resolve().as_uri())
    if failures or any(
        comparison.answer.status != "solved" for made in studies for comparison in made.comparisons
    ):
        raise typer.Exit(1)
