"""percussions run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from analysis.cli.app import Out, SceneName, positive, progress, say_expected, share, warn


def run(
    scene: SceneName,
    engine: Annotated[
        str | None,
        typer.Option(help="lammps or yade; lammps if left out, or what --error chooses."),
    ] = None,
    error: Annotated[
        str | None,
        typer.Option(
            help="Let law, stiffness and time step be advised for this error, such as 5%."
        ),
    ] = None,
    stiffness: Annotated[
        float | None,
        typer.Option(parser=positive, help="Contact stiffness in N/m, instead of the scene's."),
    ] = None,
    restitution: Annotated[
        float | None, typer.Option(parser=share, help="Asked restitution, 0 to 1.")
    ] = None,
    law: Annotated[str | None, typer.Option(help="hooke or hertz.")] = None,
    time_step: Annotated[
        float | None,
        typer.Option(parser=positive, help="Time step in s, instead of the rule's."),
    ] = None,
    duration: Annotated[
        float | None, typer.Option(parser=positive, help="Simulated time in s.")
    ] = None,
    out: Out = Path("out"),
) -> None:
    """Run a scene with one engine.

    Example: percussions run arch --engine yade --stiffness 1e7
    """
    from analysis.advice.price import expected_seconds
    from analysis.engines.run import check_before, finished_run, run_engine, run_folder
    from analysis.scene.scene import read_scene

    chosen = read_scene(scene)
    if error is not None and (stiffness, law, time_step) != (None, None, None):
        raise ValueError(
            "error: it chooses law, stiffness and time step; "
            "leave out --law, --stiffness, --time-step"
        )
    for warning in chosen.check(scene):
        warn(warning)
    contact = {"stiffness_N_per_m": stiffness, "restitution": restitution, "law": law}
    timing = {"time_step_s": time_step, "duration_s": duration}
    chosen = chosen.with_contact(
        **{key: value for key, value in contact.items() if value is not None}
    ).with_run(**{key: value for key, value in timing.items() if value is not None})
    if error is not None:
        from analysis.advice.advised_run import scene_within

        chosen, engine, choice = scene_within(chosen, error, engine)
        print(f"advised: {choice}")
    engine = engine or "lammps"
    folder = run_folder(out, chosen, engine)
    if not finished_run(chosen, engine, folder):
        check_before(chosen, engine, folder)
        say_expected(expected_seconds(chosen, engine), f"{chosen.name} with {engine}")
    with progress() as report:
        record = run_engine(chosen, engine, folder, report)
    print(
        f"{folder}: {record.steps} steps of {record.time_step_s:.3g} s, restitution obtained "
        f"{record.restitution_most:.3g}, {record.cpu_seconds:.2f} CPU s"
    )
