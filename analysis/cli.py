"""The `percussions` command."""

from __future__ import annotations

import contextlib
import json
import logging
import shlex
import sys
from collections.abc import Iterator
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from analysis.study import Progress as Report

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    help="Contact forces in a dense crowd: penalty (LAMMPS, YADE) against rigid (percussions), side by side.",
)
INTERRUPTED = 130
Out = Annotated[Path, typer.Option("--out", help="Folder for the results.")]
Stiffness = Annotated[float | None, typer.Option(help="Contact stiffness in N/m, instead of the scene's.")]


@contextlib.contextmanager
def _progress() -> Iterator[Report]:
    """A progress bar on a terminal; nothing where the output is not one."""
    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as bars:
        tasks: dict[str, int] = {}

        def report(label: str, share: float) -> None:
            if label not in tasks:
                tasks[label] = bars.add_task(label, total=1.0)
            bars.update(tasks[label], completed=share)  # type: ignore[arg-type]

        yield report


@app.command()
def scenes(
    make: Annotated[str | None, typer.Option(help="Make this scene anew instead of listing.")] = None,
    disks: Annotated[int | None, typer.Option(help="Number of disks.")] = None,
    seed: Annotated[int, typer.Option(help="Seed of the random numbers.")] = 1,
    out: Out = Path("."),
) -> None:
    """List the scenes, or make one of any size.

    Example: percussions scenes --make arch --disks 5000 --seed 3 --out mine
    """
    from analysis.making import make as make_scene
    from analysis.scene import read_scene, scene_names

    if make is not None:
        scene = make_scene(make, disks, seed)
        scene.check(scene.name)
        print(scene.write(out))
        return
    table = Table("scene", "disks", "what", "compared")
    for name in scene_names():
        scene = read_scene(name)
        compared = "force against p/τ" if scene.analysis.kind == "driven" else "∫f dt against p"
        table.add_row(name, str(len(scene.snapshot)), scene.title, compared)
    Console().print(table)


@app.command()
def run(
    scene: Annotated[str, typer.Argument(help="Name of a scene, or its .toml file.")],
    engine: Annotated[str, typer.Option(help="lammps or yade.")] = "lammps",
    stiffness: Stiffness = None,
    restitution: Annotated[float | None, typer.Option(help="Asked restitution, 0 to 1.")] = None,
    law: Annotated[str | None, typer.Option(help="hooke or hertz.")] = None,
    time_step: Annotated[float | None, typer.Option(help="Time step in s, instead of the rule's.")] = None,
    duration: Annotated[float | None, typer.Option(help="Simulated time in s.")] = None,
    out: Out = Path("out"),
) -> None:
    """Run a scene with one engine.

    Example: percussions run arch --engine yade --stiffness 1e7
    """
    from analysis.scene import read_scene
    from analysis.study import run_engine, run_folder

    chosen = read_scene(scene)
    for warning in chosen.check(scene):
        print(f"warning: {warning}", file=sys.stderr)
    contact = {"stiffness_N_per_m": stiffness, "restitution": restitution, "law": law}
    chosen = chosen.with_contact(**{key: value for key, value in contact.items() if value is not None})
    timing = {"time_step_s": time_step, "duration_s": duration}
    chosen = chosen.with_run(**{key: value for key, value in timing.items() if value is not None})
    folder = run_folder(out, chosen, engine)
    with _progress() as report:
        record = run_engine(chosen, engine, folder, report)
    print(
        f"{folder}: {record.steps} steps of {record.time_step_s:.3g} s, restitution obtained "
        f"{record.restitution_most:.3g}, {record.cpu_seconds:.2f} CPU s"
    )


@app.command()
def solve(
    dump: Annotated[
        Path, typer.Argument(help="LAMMPS text dump with at least id, x, y, radius and mass or density.")
    ],
    walls: Annotated[
        Path | None,
        typer.Option(
            help="Scene file (.toml) with the walls and the drive; scene.toml beside the dump if there."
        ),
    ] = None,
    left_velocity: Annotated[
        Literal["desired", "dump", "free"] | None,
        typer.Option(
            help="desired: p/τ is a force; dump: an impact; free: u + Δt F/m. Left out: desired where there is a drive."
        ),
    ] = None,
    window: Annotated[float | None, typer.Option(help="Δt of --left-velocity free, in s.")] = None,
    time_step: Annotated[
        float | None,
        typer.Option(help="Time step of the simulation in s (from run.json beside the dump if there)."),
    ] = None,
    contact_tolerance: Annotated[
        float, typer.Option(help="Gap in m up to which disks are in contact.")
    ] = 1e-6,
    tolerance: Annotated[float, typer.Option(help="Residual up to which a frame counts as solved.")] = 1e-8,
    workers: Annotated[int, typer.Option(help="Processes.")] = 1,
    out: Annotated[Path, typer.Option(help="CSV file, one row a contact.")] = Path("contacts.csv"),
) -> None:
    """Percussions at every contact of every frame of a dump. Exit status 0 only if every frame is solved.

    Example: percussions solve out/arch/lammps_hooke_k1e+06/bodies.dump --left-velocity desired --out contacts.csv
    """
    from analysis.trajectory import solve_dump

    with _progress() as report:
        unsolved = solve_dump(
            dump, walls, left_velocity, window, time_step, contact_tolerance, tolerance, workers, out, report
        )
    if unsolved:
        for line in unsolved:
            print(line, file=sys.stderr)
        raise typer.Exit(1)
    print(out)


@app.command()
def compare(
    runs: Annotated[list[Path], typer.Argument(help="Folders of finished runs.")],
    time: Annotated[float | None, typer.Option(help="Instant in s, instead of the scene's.")] = None,
) -> None:
    """Compare finished runs with the percussions of their snapshots; writes comparison.csv and .json into each.

    Example: percussions compare out/arch/lammps_hooke_k1e+06 out/arch/yade_hooke_k1e+06
    """
    from analysis.charts import engine_label
    from analysis.compare import compare_run, statistics
    from analysis.files import write_text
    from analysis.report import jsonable, number, write_contacts

    table = Table("quantity")
    columns = []
    failed = False
    for folder in runs:
        comparison = compare_run(folder, time)
        numbers = statistics(comparison)
        write_contacts(folder / "comparison.csv", comparison)
        content = {
            "status": str(comparison.answer.status),
            "unit": comparison.unit,
            "time_s": comparison.time,
            **numbers,
        }
        write_text(
            folder / "comparison.json", json.dumps(jsonable(content), indent=1, ensure_ascii=False) + "\n"
        )
        table.add_column(
            f"{comparison.scene.name}: {engine_label(comparison)} ({comparison.unit})", justify="right"
        )
        columns.append(
            {
                "status": str(comparison.answer.status),
                **{key: number(value) for key, value in numbers.items()},
            }
        )
        failed = failed or comparison.answer.status != "solved"
    for key in columns[0]:
        table.add_row(key.replace("_", " "), *(column[key] for column in columns))
    Console().print(table)
    if failed:
        raise typer.Exit(1)


@app.command()
def report(
    scenes: Annotated[list[str], typer.Argument(help="Scenes, by name or .toml file.")],
    engine: Annotated[
        list[str] | None,
        typer.Option(help="Engine; give it twice for both. Left out: all that are installed."),
    ] = None,
    stiffness: Annotated[
        list[float] | None,
        typer.Option(
            help="Stiffness in N/m; give it several times. Left out: the scene's and, for a driven crowd, ten times it."
        ),
    ] = None,
    runs: Annotated[Path, typer.Option(help="Folder for the runs; unchanged ones are used again.")] = Path(
        "out"
    ),
    out: Out = Path("report"),
) -> None:
    """Run, solve, compare, and write one HTML page with CSV and JSON beside it.

    Example: percussions report arch gate --out report
    """
    from analysis.engines import ENGINES
    from analysis.engines import engine as find_engine
    from analysis.report import write_report
    from analysis.scene import read_scene
    from analysis.study import study

    chosen = [read_scene(name) for name in scenes]
    names = engine or [known.NAME for known in ENGINES]
    for name in names:
        find_engine(name)
    studies = []
    with _progress() as bars:
        for scene in chosen:
            k = scene.contact.stiffness_N_per_m
            # the stiffness changes nothing in an impact, the damping does
            default = [k] if scene.analysis.kind == "impact" else [k, 10 * k]
            studies.append(study(scene, names, stiffness or default, runs, bars))
        page = write_report(studies, out, shlex.join(["percussions", *sys.argv[1:]]))
    for made in studies:
        for warning in made.warnings:
            print(f"warning: {made.scene.name}: {warning}", file=sys.stderr)
    print(page.resolve().as_uri())
    if any(comparison.answer.status != "solved" for made in studies for comparison in made.comparisons):
        raise typer.Exit(1)


class PaperSection(StrEnum):
    """A section of the paper of which a page can be made."""

    DISCRETE = "discrete"


@app.command()
def paper(
    section: Annotated[PaperSection, typer.Argument(help="Section of the paper.")],
    figure: Annotated[
        list[str] | None,
        typer.Option(help="Number of a figure; give it several times. Left out: all."),
    ] = None,
    runs: Annotated[Path, typer.Option(help="Folder for the runs; unchanged ones are used again.")] = Path(
        "out"
    ),
    out: Out = Path("paper"),
) -> None:
    """Make the paper's figures anew: one HTML page that says which of its statements hold, and the pictures as files.

    Example: percussions paper discrete --figure 1 --figure 3 --out paper
    """
    from analysis.paper.page import write_discrete_page

    assert section is PaperSection.DISCRETE
    with _progress() as bars:
        page, warnings = write_discrete_page(
            out, runs, shlex.join(["percussions", *sys.argv[1:]]), figure, bars
        )
    for warning in warnings:
        print(f"warning: {warning}", file=sys.stderr)
    print(page.resolve().as_uri())


@app.command(name="import")
def import_(
    file: Annotated[Path, typer.Argument(help="Trajectory file that PedPy can load.")],
    frame: Annotated[int, typer.Option(help="Number of the frame.")],
    room: Annotated[
        Path, typer.Option(help="TOML file with walls, drive, contact, run and analysis, as in a scene.")
    ],
    radius: Annotated[float, typer.Option(help="Radius of each disk in m.")] = 0.18,
    mass: Annotated[float, typer.Option(help="Mass of each person in kg.")] = 75.0,
    name: Annotated[str | None, typer.Option(help="Name of the scene; the room's by default.")] = None,
    unit: Annotated[
        Literal["m", "cm"] | None, typer.Option(help="Unit of the file, where it does not say.")
    ] = None,
    frame_rate: Annotated[
        float | None, typer.Option(help="Frames per second, where the file does not say.")
    ] = None,
    window: Annotated[float, typer.Option(help="Time in s over which velocities are measured.")] = 0.4,
    out: Out = Path("."),
) -> None:
    """Turn one frame of a real trajectory into a scene: heads become disks, overlaps are reconciled and reported.

    Example: percussions import scenes/gate_excerpt.txt --frame 405 --room scenes/rooms/gate.toml --name mine
    """
    from analysis.real_crowd import import_crowd

    imported = import_crowd(
        file,
        frame=frame,
        radius=radius,
        room=room,
        mass=mass,
        name=name,
        unit=unit,
        frame_rate=frame_rate,
        window_s=window,
    )
    print(imported.write(out))
    assert imported.scene.reconciliation is not None
    print(imported.scene.reconciliation.statement)


@app.command()
def doctor() -> None:
    """Which engines and libraries are there, their versions, and what to do about a missing one.

    Example: percussions doctor
    """
    from analysis.doctor import examine

    findings = examine()
    for finding in findings:
        print(f"{finding.name:<12}{finding.state:<10}{finding.version or '–'}  {finding.path or ''}")
        if finding.advice:
            print(f"{'':<12}{finding.advice}")
    if any(finding.state == "missing" for finding in findings):
        raise typer.Exit(1)


def main() -> None:
    """Run the command; errors of the input are one line and exit status 1."""
    from analysis.engines.record import EngineError

    logging.basicConfig(level=logging.INFO if "-v" in sys.argv else logging.WARNING, format="%(message)s")
    try:
        app()
    except SystemExit as end:
        if end.code == INTERRUPTED:
            print("percussions: interrupted; earlier results are untouched", file=sys.stderr)
        raise
    except (ValueError, OSError, EngineError) as error:
        print(f"percussions: {error}", file=sys.stderr)
        sys.exit(1)
