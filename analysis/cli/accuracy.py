"""Commands about how far each method can be trusted: chart, stability, advise."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Annotated, Literal

import typer

from analysis.cli.app import Out, Runs, SceneName, command_line, progress

commands = typer.Typer()
Scheduler = Annotated[
    str | None, typer.Option(help="Address of a Dask scheduler, instead of this machine's cores.")
]
Jobs = Annotated[int | None, typer.Option(help="Processes; as many as cores if left out.")]


@commands.command()
def chart(
    scene: SceneName,
    runs: Runs = Path("out"),
    scheduler: Scheduler = None,
    jobs: Jobs = None,
    out: Out = Path("chart"),
) -> None:
    """Cost against error of every method on a scene: a page with charts, and its points as CSV and
    JSON.

    Example: percussions chart arch --out chart/arch
    """
    from analysis.scene.scene import read_scene
    from analysis.work_precision.chart import build_chart
    from analysis.work_precision.page import front_table, write_chart

    chosen = read_scene(scene)
    with progress() as bars:
        made = build_chart(chosen, runs, processes=jobs, scheduler=scheduler, progress=bars)
    page = write_chart(made, out, command_line())
    for quantity in made.measured.quantities:
        head, rows = front_table(made, quantity)
        print(
            f"\nPareto fronts, all methods and soft contacts alone: {quantity.words} ({quantity.unit})"
        )
        for row in (head, *rows):
            print(f"{row[0]:<28}{row[1]:<46}" + "".join(f"{cell:>12}" for cell in row[2:]))
    for warning in made.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    print(page.resolve().as_uri())


@commands.command()
def stability(
    case: Annotated[
        list[str] | None, typer.Option(help="Name of a case; give it several times. Left out: all.")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="A coarse atlas.")] = False,
    runs: Runs = Path("out"),
    scheduler: Scheduler = None,
    jobs: Jobs = None,
    out: Out = Path("stability"),
) -> None:
    """Where each method fails: an atlas of provoked failures, with its boundaries against theory.

    Example: percussions stability --case time_step --case skin --out stability
    """
    from analysis.stability.atlas import build, choose
    from analysis.stability.page import summary, write_atlas

    started = time.perf_counter()
    with progress() as bars:
        maps = build(choose(case, quick), runs, quick, bars, jobs, scheduler)
    page = write_atlas(maps, out, command_line(), quick, time.perf_counter() - started)
    for line in summary(maps):
        print(line)
    print(page.resolve().as_uri())


@commands.command()
def advise(
    scene: SceneName,
    error: Annotated[str, typer.Option(help="Error that is allowed, such as 5% or 0.05.")],
    quantity: Annotated[
        str,
        typer.Option(
            help="disk-load, contact-load, wall-load or displacement (of a driven crowd)."
        ),
    ] = "disk-load",
    against: Annotated[
        Literal["rigid", "model"],
        typer.Option(
            help="rigid: numerical and model error; model: the numerical error of the scene's own contacts."
        ),
    ] = "rigid",
    method: Annotated[
        list[str] | None,
        typer.Option(
            help="rigid, lammps or yade; give it several times. Left out: all that are installed."
        ),
    ] = None,
    chart: Annotated[
        Path | None,
        typer.Option(
            help="Folder of a chart of this very scene, to read instead of the stored library."
        ),
    ] = None,
    runs: Runs = Path("out"),
    out: Out = Path("advice"),
) -> None:
    """The cheapest method whose measured error on such a scene is within what is asked. Exit status
    1 if there is none.

    Example: percussions advise arch --error 5% --quantity wall-load
    """
    from analysis.advice.advised_run import methods_here
    from analysis.advice.asked import asked_error
    from analysis.advice.choice import advise as choose
    from analysis.advice.library import stored_library
    from analysis.advice.unneeded import left_out
    from analysis.advice.words import report as words
    from analysis.advice.words import to_json, where_measured
    from analysis.scene.scene import read_scene
    from analysis.support.files import write_text
    from analysis.work_precision.point import read_points

    chosen = read_scene(scene)
    points = None if chart is None else read_points(chart / "points.json")
    advice = choose(
        chosen,
        asked_error(error),
        quantity=quantity,
        against=against,
        methods=methods_here(method),
        library=stored_library(),
        chart=points,
    )
    with progress() as bars:
        bars(f"{chosen.name}: what it can do without", 0.0)
        left = left_out(chosen, runs / "work_precision" / chosen.name)
        bars(f"{chosen.name}: what it can do without", 1.0)
    measured = where_measured(advice, stored_library(), points)
    for line in words(advice, measured, left):
        print(line)
    content = to_json(advice, measured, left)
    write_text(out / "advice.json", json.dumps(content, indent=1, ensure_ascii=False) + "\n")
    if advice.choice is None:
        raise typer.Exit(1)
