"""percussions solve."""

from __future__ import annotations

import contextlib
import functools
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from analysis.cli.app import (
    Scheduler,
    given,
    not_negative,
    path,
    positive,
    processes,
    progress,
    say_expected,
    share,
    show,
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
RoomFile = Annotated[
    Path | None,
    typer.Option(
        "--room",
        "--walls",
        help="Room or scene file (.toml) with the walls and the drive; scene.toml beside the "
        "dump if there.",
    ),
]
LeftVelocity = Annotated[
    Literal["desired", "dump", "free"] | None,
    typer.Option(
        help="desired: p/τ is a force; dump: an impact; free: u + Δt F/m. Left out: desired "
        "where there is a drive."
    ),
]
Friction = Annotated[
    float | None,
    typer.Option(
        parser=not_negative,
        help="Coulomb's μ of people with each other; the scene's own if left out, 0 in a room.",
    ),
]
WallFriction = Annotated[
    float | None,
    typer.Option(parser=not_negative, help="μ of people with walls; --friction if left out."),
]
Window = Annotated[
    float | None, typer.Option(parser=positive, help="Δt of --left-velocity free, in s.")
]
TimeStep = Annotated[
    float | None,
    typer.Option(
        parser=positive,
        help="Time step of the simulation in s (from run.json beside the dump if there; "
        "without either the table has steps in place of times).",
    ),
]
ContactTolerance = Annotated[
    float | None,
    typer.Option(
        parser=positive,
        help="Gap in m up to which disks are in contact; the room's or 1e-6 if left out.",
    ),
]
LargestOverlap = Annotated[
    float | None,
    typer.Option(
        parser=positive,
        help="Deepest overlap that is taken, as a share of the smaller radius; 0.5 if left out.",
    ),
]
Restitution = Annotated[
    float | None,
    typer.Option(parser=share, help="Restitution of the contacts; inelastic if left out."),
]
Tolerance = Annotated[
    float,
    typer.Option(parser=positive, help="Residual up to which a frame counts as solved."),
]
Openness = Annotated[
    Literal["none", "determined", "ranges"],
    typer.Option(
        help="What is said of reactions that the mechanics may leave open: nothing, whether "
        "each is determined, or also its least and largest value. The first is about 20 times "
        "faster than the second, the last slow."
    ),
]
Table = Annotated[Path, typer.Option(parser=path, help="CSV file, one row per contact.")]


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

    if others:
        name = others[0].replace("_", "-")
        raise ValueError(f"--{name}: {problem} has its own; this option is for dumps")
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
