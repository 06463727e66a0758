"""Commands that compute and compare contact forces: solve, compare, report."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console
from rich.table import Table

from analysis.cli.app import Out, Runs, command_line, progress

commands = typer.Typer()


@commands.command()
def solve(
    dump: Annotated[
        Path,
        typer.Argument(help="LAMMPS text dump with at least id, x, y, radius and mass or density."),
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
        typer.Option(
            help="Time step of the simulation in s (from run.json beside the dump if there)."
        ),
    ] = None,
    contact_tolerance: Annotated[
        float, typer.Option(help="Gap in m up to which disks are in contact.")
    ] = 1e-6,
    tolerance: Annotated[
        float, typer.Option(help="Residual up to which a frame counts as solved.")
    ] = 1e-8,
    workers: Annotated[int, typer.Option(help="Processes.")] = 1,
    out: Annotated[Path, typer.Option(help="CSV file, one row a contact.")] = Path("contacts.csv"),
) -> None:
    """Percussions at every contact of every frame of a dump. Exit status 0 only if every frame is
    solved.

    Example: percussions solve out/arch/lammps_hooke_k1e+06/bodies.dump --left-velocity desired
    --out contacts.csv"""
    from analysis.percussions.dump_to_csv import solve_dump

    with progress() as report:
        unsolved = solve_dump(
            dump,
            walls,
            left_velocity,
            window,
            time_step,
            contact_tolerance,
            tolerance,
            workers,
            out,
            report,
        )
    if unsolved:
        for line in unsolved:
            print(line, file=sys.stderr)
        raise typer.Exit(1)
    print(out)


@commands.command()
def compare(
    runs: Annotated[list[Path], typer.Argument(help="Folders of finished runs.")],
    time: Annotated[
        float | None, typer.Option(help="Instant in s, instead of the scene's.")
    ] = None,
) -> None:
    """Compare finished runs with the percussions of their snapshots; writes comparison.csv and
    .json into each.

    Example: percussions compare out/arch/lammps_hooke_k1e+06 out/arch/yade_hooke_k1e+06
    """
    from analysis.compare.comparison import compare_run
    from analysis.compare.contacts_csv import write_contacts
    from analysis.compare.statistics import statistics
    from analysis.pages.html import jsonable
    from analysis.pages.names import engine_label
    from analysis.pages.numbers import number
    from analysis.support.files import write_text

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
            "time_s": comparison.snapshot.time,
            **numbers,
        }
        write_text(
            folder / "comparison.json",
            json.dumps(jsonable(content), indent=1, ensure_ascii=False) + "\n",
        )
        table.add_column(
            f"{comparison.scene.name}: {engine_label(comparison)} ({comparison.unit})",
            justify="right",
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


@commands.command()
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
    runs: Runs = Path("out"),
    out: Out = Path("report"),
) -> None:
    """Run, solve, compare: one HTML page, CSV and JSON beside it. Exit status 1 if a run failed or
    a snapshot is not solved.

    Example: percussions report arch gate --out report
    """
    from analysis.compare.study import study
    from analysis.engines import ENGINES
    from analysis.engines import engine as find_engine
    from analysis.pages.report import write_report
    from analysis.scene.scene import read_scene

    chosen = [read_scene(name) for name in scenes]
    names = engine or [known.NAME for known in ENGINES]
    for name in names:
        find_engine(name)
    studies = []
    with progress() as bars:
        for scene in chosen:
            k = scene.contact.stiffness_N_per_m
            # the stiffness changes nothing in an impact, the damping does
            default = [k] if scene.analysis.kind == "impact" else [k, 10 * k]
            studies.append(study(scene, names, stiffness or default, runs, bars))
        page = write_report(studies, out, command_line())
    for made in studies:
        for warning in made.warnings:
            print(f"warning: {made.scene.name}: {warning}", file=sys.stderr)
        for failure in made.failures:
            print(f"failed: {made.scene.name}: {failure}", file=sys.stderr)
    print(page.resolve().as_uri())
    if any(made.failures for made in studies) or any(
        comparison.answer.status != "solved" for made in studies for comparison in made.comparisons
    ):
        raise typer.Exit(1)
