"""percussions advise."""

from pathlib import Path
from typing import Literal

import typer

from analysis.cli.app import progress
from analysis.cli.options import Out


def advise(
    scene: str,
    *,
    error: str,
    quantity: str = "disk-load",
    against: Literal["rigid", "model"] = "rigid",
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
        contacts).
    method: rigid, lammps or yade. May be repeated. Default: all that are installed.
    body: chest, social_force or lemons: a whole run of people as soft as these. Default: the limit
        of hard people.
    chart: Folder of a chart of this very scene, to read instead of the stored library.

    Example: percussions advise arch --error 5% --quantity wall-load"""
    from analysis.advice import bodies, choice, motion
    from analysis.advice.candidates import Question, asked_error
    from analysis.advice.library import stored_library
    from analysis.scene.scene import read_scene
    from analysis.work_precision.point import read_points

    chosen, allowed, methods = read_scene(scene), asked_error(error), choice.methods_here(method)
    if body is not None:
        soft = bodies.advise_bodies(chosen, allowed, quantity, methods, body)
        print(*bodies.body_lines(soft), bodies.write_body_advice(soft, out), sep="\n")
        raise typer.Exit(not soft.engine)
    ladder = ["", *bodies.ladder_lines(chosen)] if chosen.drive else []
    if quantity in motion.QUANTITIES:
        own = None if chart is None else chart / motion.FILE
        moving = motion.advise_motion(chosen, allowed, quantity, methods, own)
        written = motion.write_motion_advice(moving, out)
        print(*motion.motion_lines(moving), *ladder, written, sep="\n")
        raise typer.Exit(moving.choice is None)
    points = None if chart is None else read_points(chart / "points.json")
    question = Question(error=allowed, quantity=quantity, against=against, methods=methods)
    advice = choice.advise(chosen, question, library=stored_library(), chart=points)
    with progress() as bars:
        bars(f"{chosen.name}: what it can do without", 0.0)
        left = choice.left_out(chosen, runs / "work_precision" / chosen.name)
        bars(f"{chosen.name}: what it can do without", 1.0)
    written = choice.write_advice(advice, left, out)
    print(*choice.report(advice, left), *ladder, written, sep="\n")
    raise typer.Exit(advice.choice is None)
