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
        typer.Option(help="Engine; give it twice for both. Left out: all that are installed."),
    ] = None,
    stiffness: Annotated[
        list[float] | None,
        typer.Option(
            parser=positive,
            help="Stiffness in N/m; give it several times. Left out: the scene's and, for a "
            "driven crowd, ten times it.",
        ),
    ] = None,
    rigid_law: RigidLaw = None,
    runs: Runs = Path("out"),
    out: Out = Path("report"),
) -> None:
    """Run, solve and compare: one HTML page, CSV and JSON beside it.

    Exit status 1 if a run failed or a snapshot is not solved.

    Example: percussions report arch gate --out report
    """
    from analysis.compare.study import study
    from analysis.engines import PENALTY
    from analysis.engines import engine as find_engine
    from analysis.engines.run import EngineRun
    from analysis.pages.report import write_report
    from analysis.scene.scene import read_scene

    names = engine or [known.NAME for known in PENALTY]
    for name in names:
        find_engine(name)
    chosen = []
    for scene in map(read_scene, scenes):
        k = scene.contact.stiffness_N_per_m
        # the stiffness changes nothing in an impact, the damping does
        default = [k] if scene.analysis.kind == "impact" else [k, 10 * k]
        chosen.append((scene, stiffness or default))
    say_runs(
        EngineRun.of(scene.with_contact(stiffness_N_per_m=k), name, runs)
        for scene, stiffnesses in chosen
        for k in stiffnesses
        for name in names
    )
    with progress() as bars:
        studies = [study(scene, names, k, runs, bars, rigid_law) for scene, k in chosen]
        page = write_report(studies, out, command_line())
    for made in studies:
        for warning in made.warnings:
            warn(f"{made.scene.name}: {warning}")
        for failure in made.failures:
            print(f"failed: {made.scene.name}: {failure}", file=sys.stderr)
    print(page.resolve().as_uri())
    if any(made.failures for made in studies) or any(
        comparison.answer.status != "solved" for made in studies for comparison in made.comparisons
    ):
        raise typer.Exit(1)
