"""percussions report."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from analysis.cli.app import Out, Runs, command_line, positive, progress, say_runs, warn
from analysis.cli.rigid_law import RigidLaw

if TYPE_CHECKING:
    from analysis.compare.study import Study
    from analysis.scene.scene import Scene


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
    from analysis.engines import ENGINES
    from analysis.motion.report import in_motion, motion_of, runs_of
    from analysis.pages.report import write_report
    from analysis.scene.scene import read_scene

    names = engine or [known.NAME for known in ENGINES]
    soft = _with_springs(names)
    chosen = [(scene, stiffness or _usual(scene)) for scene in map(read_scene, scenes)]
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
    for (scene, _), motion in zip(chosen, moved, strict=True):
        failures += [(scene.name, failure) for failure in motion.failures] if motion else []
    _say(studies, failures)
    print(page.resolve().as_uri())
    if failures or any(
        comparison.answer.status != "solved" for made in studies for comparison in made.comparisons
    ):
        raise typer.Exit(1)


def _say(studies: Sequence[Study], failures: Sequence[tuple[str, str]]) -> None:
    for made in studies:
        for warning in made.warnings:
            warn(f"{made.scene.name}: {warning}")
    for where, failure in failures:
        print(f"failed: {where}: {failure}", file=sys.stderr)


def _with_springs(names: Sequence[str]) -> list[str]:
    """The engines with springs among those named; there must be one."""
    from analysis.engines import PENALTY, engine

    for name in names:
        engine(name)
    every = [known.NAME for known in PENALTY]
    soft = [name for name in every if name in names]
    if not soft:
        raise ValueError(
            "engine: a report compares the rigid model with one that has springs; name one of "
            + ", ".join(every)
        )
    return soft


def _usual(scene: Scene) -> list[float]:
    """The stiffnesses (N/m) that a report compares: an impact changes with the damping only."""
    k = scene.contact.stiffness_N_per_m
    return [k] if scene.analysis.kind == "impact" else [k, 10 * k]
