"""percussions solve."""

from __future__ import annotations

import contextlib
import functools
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from analysis.cli.app import Scheduler, given, path, processes, progress, say_expected, show
from analysis.cli.problems.options import (
    ContactTolerance,
    Friction,
    LargestOverlap,
    LeftVelocity,
    Openness,
    Restitution,
    RoomFile,
    TimeStep,
    Tolerance,
    WallFriction,
    Window,
)

if TYPE_CHECKING:
    from analysis.percussions.dump_to_csv import SolvedDump

Dump = Annotated[
    Path,
    typer.Argument(
        help="LAMMPS text dump, plain or gz, bz2, xz, zst, with at least id, a place (x y, "
        "xu yu or xs ys), radius and mass or density; or an FCLIB file (HDF5), which has its own "
        "contacts."
    ),
]
Table = Annotated[
    Path,
    typer.Option(
        parser=path, help="Table, one row per contact: CSV, or Parquet if it ends in .parquet."
    ),
]


def solve(
    dump: Dump,
    room: RoomFile = None,
    left_velocity: LeftVelocity = None,
    friction: Friction = None,
    wall_friction: WallFriction = None,
    window: Window = None,
    time_step: TimeStep = None,
    contact_tolerance: ContactTolerance = None,
    largest_overlap: LargestOverlap = None,
    restitution: Restitution = None,
    tolerance: Tolerance = 1e-8,
    openness: Openness = "determined",
    workers: Annotated[int, typer.Option(parser=processes, help="Processes.")] = 1,
    scheduler: Scheduler = None,
    out: Table = Path("contacts.csv"),
) -> None:
    """Compute the percussions at every contact of every frame of a dump, or of an FCLIB problem.

    Exit status 0 only if every frame is solved.

    Example: percussions solve out/arch/lammps_hooke_k1e+06/bodies.dump --left-velocity desired
    --out contacts.csv"""
    from analysis.exchange.layout import is_hdf5
    from analysis.percussions.dump_to_csv import DumpToSolve, setting_beside, solve_dump
    from analysis.support.parallel import workers as pool
    from nscd import ContactLaw

    if out.is_file() and any(out.samefile(file) for file in (dump, room) if file and file.exists()):
        raise ValueError(f"--out: {out}: the table would replace what it is made of")
    options = given(
        left_velocity=left_velocity,
        window=window,
        largest_overlap=largest_overlap,
        friction=friction,
        wall_friction=wall_friction,
        contact_tolerance=contact_tolerance,
    )
    others = given(room=room, time_step=time_step, restitution=restitution, scheduler=scheduler)
    if is_hdf5(dump):
        _solve_problem(dump, out, tolerance, openness, [*options, *others])
        return
    job = DumpToSolve(
        path=dump,
        time_step=time_step,
        setting=setting_beside(dump, room, **options),
        law=ContactLaw(restitution=restitution),
        tolerance=tolerance,
        openness=openness,
    )
    with contextlib.ExitStack() as stack:
        executor = None
        if workers > 1 or scheduler:
            executor = stack.enter_context(pool(workers, scheduler))
        found = solve_dump(
            job,
            out,
            executor=executor,
            workers=workers,
            progress=stack.enter_context(progress()),
            expected=functools.partial(say_expected, what=f"percussions of {dump}"),
        )
    _say(found, dump, out)
    if found.unsolved:
        raise typer.Exit(1)


def _solve_problem(
    problem: Path, out: Path, tolerance: float, openness: Openness, others: list[str]
) -> None:
    """Solve an FCLIB problem; `others` are options that it has no use for."""
    from analysis.exchange.solved import solve_file
    from analysis.percussions.rows import is_parquet

    if others:
        name = others[0].replace("_", "-")
        raise ValueError(f"--{name}: {problem} has its own; this option is for dumps")
    if is_parquet(out):
        raise ValueError(f"--out: {out}: Parquet is for dumps; of a problem the table is CSV")
    found = solve_file(problem, out, tolerance, openness)
    rows = [["contacts", str(found.contacts)], ["residual", f"{found.residual:.1e}"]]
    if found.difference is not None:
        rows.append(["largest difference of u from /solution", f"{found.difference:.1e}"])
    show([str(problem), ""], rows)
    print(out)
    if found.why:
        print(f"{problem}: {found.why}", file=sys.stderr)
        raise typer.Exit(1)


def _say(found: SolvedDump, dump: Path, out: Path) -> None:
    for line in found.unsolved:
        print(line, file=sys.stderr)
    largest = f"{found.largest:.4g} {found.unit} at {found.when}"
    rows = [["frames", str(found.frames)], ["contacts", str(found.contacts)]]
    rows += [["largest per contact", largest], ["worst residual", f"{found.residual:.1e}"]]
    show([str(dump), ""], rows)
    print(out)
