"""percussions solve."""

import contextlib
import functools
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import typer

from analysis.cli.app import drop_none, progress, say_expected, show
from analysis.cli.options import Count, Openness, Out, Processes, Share, Taken


def solve(
    dump: Path,
    *,
    taken: Taken,
    restitution: Share | None = None,
    openness: Openness = "determined",
    workers: Processes = 1,
    threads: Count = 1,
    scheduler: str | None = None,
    part_frames: Count | None = None,
    out: Out = Path("contacts.csv"),
) -> None:
    """Compute the percussions at every contact of every frame of a dump, or of an FCLIB problem.

    Exit status 0 only if every frame is solved.

    dump: LAMMPS dump, text or binary, plain or gz, bz2, xz, zst. It needs id, a position (x y, xu yu
        or xs ys), radius, and mass or density. Or an FCLIB file (HDF5), which has its own
        contacts.
    restitution: Restitution of the contacts. Default: inelastic.
    workers: Cores that work on it.
    threads: Threads for each frame of 10,000 disks or more.
    part_frames: Write a folder of Parquet files, each of so many frames, and keep those that are
        there: what was interrupted goes on.

    out: Table, one row per contact: CSV, or Parquet if it ends in .parquet.

    Example: percussions solve out/arch/lammps_hooke_k1e+06/bodies.dump --left-velocity desired
    --out contacts.csv"""
    from analysis.exchange.problem import is_hdf5
    from analysis.percussions.setting import setting_beside
    from analysis.percussions.solving import (
        DumpToSolve,
        executor_for,
        solve_dump,
        solve_in_chunks,
    )
    from analysis.percussions.table import is_parquet

    if out.is_file() and any(
        out.samefile(file) for file in (dump, taken.room) if file and file.exists()
    ):
        raise ValueError(f"--out: {out}: the table would replace what it is made of")
    options = taken.setting()
    if is_hdf5(dump):
        others = {"room": taken.room, "restitution": restitution, "scheduler": scheduler}
        others |= taken.of_dump() | {"part_frames": part_frames}
        _solve_problem(dump, out, taken.tolerance, openness, [*options, *drop_none(**others)])
        return
    setting = setting_beside(dump, taken.room, **options)
    job = DumpToSolve(
        path=dump,
        time_step=taken.time_step,
        unit=taken.unit,
        setting=setting,
        law=None if restitution is None else replace(setting.law, restitution=restitution),
        tolerance=taken.tolerance,
        openness=openness,
        threads=threads,
    )
    if part_frames and not is_parquet(out):
        raise ValueError(f"--part-frames: {out}: parts are Parquet. End --out in .parquet")
    with contextlib.ExitStack() as stack:
        executor = stack.enter_context(executor_for(job, workers, scheduler))
        bars = stack.enter_context(progress())
        if part_frames:
            found = solve_in_chunks(job, out, part_frames, executor=executor, progress=bars)
        else:
            expected = functools.partial(say_expected, what=f"percussions of {dump}")
            found = solve_dump(
                job, out, executor=executor, workers=workers, progress=bars, expected=expected
            )
    largest = f"{found.largest:.4g} {found.unit} at {found.when}"
    rows = [["frames", str(found.frames)], ["contacts", str(found.contacts)]]
    rows += [["largest per contact", largest], ["worst residual", f"{found.residual:.1e}"]]
    _say(dump, out, rows, found.unsolved)


def _solve_problem(
    problem: Path, out: Path, tolerance: float, openness: Openness, others: list[str]
) -> None:
    """Solve an FCLIB problem. `others` are options that it has no use for."""
    from analysis.exchange.fclib import solve_file
    from analysis.percussions.table import is_parquet

    if others:
        name = others[0].replace("_", "-")
        raise ValueError(f"--{name}: {problem} has its own. This option is for dumps")
    if is_parquet(out):
        raise ValueError(f"--out: {out}: Parquet is for dumps. The table of a problem is CSV")
    found = solve_file(problem, out, tolerance, openness)
    rows = [["contacts", str(found.contacts)], ["residual", f"{found.residual:.1e}"]]
    if found.difference is not None:
        rows.append(["largest difference of u from /solution", f"{found.difference:.1e}"])
    _say(problem, out, rows, [f"{problem}: {found.why}"] if found.why else [])


def _say(solved: Path, out: Path, rows: list[list[str]], unsolved: Sequence[str]) -> None:
    """Print numbers, where the table is and what is not solved, which is the exit status."""
    for line in unsolved:
        print(line, file=sys.stderr)
    show([str(solved), ""], rows)
    print(out)
    if unsolved:
        raise typer.Exit(1)
