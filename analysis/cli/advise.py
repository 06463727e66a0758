"""percussions advise."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from analysis.cli.app import Out, Runs, SceneName, progress


def advise(
    scene: SceneName,
    error: Annotated[str, typer.Option()],
    quantity: str = "disk-load",
    against: Literal["rigid", "model"] = "rigid",
    method: list[str] | None = None,
    body: str | None = None,
    chart: Path | None = None,
    runs: Runs = Path("out"),
    out: Out = Path("advice"),
) -> None:
    """Choose the cheapest method whose measured error is within what is asked.

    Exit status 1 if there is none.

    error: Error that is allowed, such as 5% or 0.05.
    quantity: Of an instant: disk-load, contact-load, wall-load or displacement. Of a whole run:
        arrest-load, mean-wall-load, mean-contact-force, contact-force-95 or flow; of one with
        --body also mean-person-load, largest-person-load or door-density.
    against: rigid: numerical and model error; model: the numerical error of the scene's own
        contacts.
    method: rigid, lammps or yade; give it several times. Left out: all that are installed.
    body: chest, social_force or lemons: of a whole run of people who are so soft, instead of the
        limit of hard ones.
    chart: Folder of a chart of this very scene, to read instead of the stored library.

    Example: percussions advise arch --error 5% --quantity wall-load"""
    from analysis.advice.bodies import (
        advise_bodies,
        body_lines,
        ladder_lines,
        write_body_advice,
    )
    from analysis.advice.candidates import Question, asked_error
    from analysis.advice.choice import advise as choose
    from analysis.advice.choice import left_out, methods_here, report, write_advice
    from analysis.advice.library import stored_library
    from analysis.advice.motion import (
        FILE,
        QUANTITIES,
        advise_motion,
        motion_lines,
        write_motion_advice,
    )
    from analysis.scene.scene import read_scene
    from analysis.work_precision.point import read_points

    chosen = read_scene(scene)
    if body is not None:
        soft = advise_bodies(chosen, asked_error(error), quantity, methods_here(method), body)
        print(*body_lines(soft), write_body_advice(soft, out), sep="\n")
        raise typer.Exit(not soft.engine)
    ladder = ["", *ladder_lines(chosen)] if chosen.drive else []
    if quantity in QUANTITIES:
        own = None if chart is None else chart / FILE
        moving = advise_motion(chosen, asked_error(error), quantity, methods_here(method), own)
        print(*motion_lines(moving), *ladder, write_motion_advice(moving, out), sep="\n")
        raise typer.Exit(moving.choice is None)
    points = None if chart is None else read_points(chart / "points.json")
    methods = methods_here(method)
    question = Question(
        error=asked_error(error), quantity=quantity, against=against, methods=methods
    )
    advice = choose(chosen, question, library=stored_library(), chart=points)
    with progress() as bars:
        bars(f"{chosen.name}: what it can do without", 0.0)
        left = left_out(chosen, runs / "work_precision" / chosen.name)
        bars(f"{chosen.name}: what it can do without", 1.0)
    print(*report(advice, left), *ladder, write_advice(advice, left, out), sep="\n")
    if advice.choice is None:
        raise typer.Exit(1)
