"""percussions solve."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

import typer

from analysis.cli.app import count, positive, progress


def solve(
    dump: Annotated[
        Path,
        typer.Argument(help="LAMMPS text dump with at least id, x, y, radius and mass or density."),
    ],
    walls: Annotated[
        Path | None,
        typer.Option(
            help="Scene file (.toml) with the walls and the drive; scene.toml beside the dump "
            "if there."
        ),
    ] = None,
    left_velocity: Annotated[
        Literal["desired", "dump", "free"] | None,
        typer.Option(
            help="desired: p/τ is a force; dump: an impact; free: u + Δt F/m. Left out: desired "
            "where there is a drive."
        ),
    ] = None,
    window: Annotated[
        float | None, typer.Option(parser=positive, help="Δt of --left-velocity free, in s.")
    ] = None,
    time_step: Annotated[
        float | None,
        typer.Option(
            parser=positive,
            help="Time step of the simulation in s (from run.json beside the dump if there).",
        ),
    ] = None,
    contact_tolerance: Annotated[
        float,
        typer.Option(parser=positive, help="Gap in m up to which disks are in contact."),
    ] = 1e-6,
    tolerance: Annotated[
        float,
        typer.Option(parser=positive, help="Residual up to which a frame counts as solved."),
    ] = 1e-8,
    workers: Annotated[int, typer.Option(parser=count, help="Processes.")] = 1,
    out: Annotated[Path, typer.Option(help="CSV file, one row per contact.")] = Path(
        "contacts.csv"
    ),
) -> None:
    """Compute the percussions at every contact of every frame of a dump.

    Exit status 0 only if every frame is solved.

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
    for line in unsolved:
        print(line, file=sys.stderr)
    print(out)
    if unsolved:
        raise typer.Exit(1)
