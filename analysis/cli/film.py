"""percussions film."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from analysis.cli.app import command_line, progress, show, show_page, warn
from analysis.cli.options import NO_RUN, InputFile, OfFile, Out, Positive, Processes, is_run
from analysis.support.extras import load

if TYPE_CHECKING:
    from analysis.film.frame import Frames, Reel

MEASURED = (
    "no door and no drive: the left velocity is the measured one, and percussions are impulses. Forces "
    "need --room with a [drive]"
)
RADII = (0.16, 0.17, 0.18, 0.19, 0.20)


class Form(StrEnum):
    """For which program a film is exported: ParaView or OVITO."""

    VTK = "vtk"
    OVITO = "ovito"


def film(
    target: list[InputFile],
    *,
    of_file: OfFile,
    radius: list[Positive] | None = None,
    export: list[Form] | None = None,
    parquet: bool = False,
    jobs: Processes = 1,
    scheduler: str | None = None,
    out: Out = Path("film"),
) -> None:
    """Make a film of the contact forces of a run, of a LAMMPS dump, or of a real trajectory.

    Writes film.html, which opens offline and plays, and film.csv. Runs (of LAMMPS, YADE and the
    rigid engine, side by side) show what the engine wrote, the percussions of the same places, and
    the difference. A dump of disks shows its own contact forces where it has some. In a trajectory
    heads become disks that do not overlap, in every frame.

    Exit status 1 if the percussions of a frame are not solved.

    target: Folders of finished runs of one scene, or one dump or trajectory file.
    radius: Of a trajectory: radius in m. May be repeated: the middle one counts, all make the band.
        Default: 0.16, 0.17, 0.18, 0.19 and 0.20.
    export: Write files for ParaView or OVITO too. May be repeated.
    parquet: Write film.parquet too (needs pyarrow).
    jobs: Processes that measure the frames.

    Example: percussions film scenes/gate_excerpt.txt --frames 400:410:5 --room scenes/rooms/gate.toml"""
    load("matplotlib")
    from analysis.film import export as exports
    from analysis.film.frame import Frames
    from analysis.film.page import write_film
    from analysis.film.summary import headline_rows, write_table

    if parquet:
        load("pyarrow")
    chosen = None if of_file.frames is None else Frames.parse(of_file.frames)
    folders = [is_run(one) for one in target]
    if all(folders):
        replace(of_file, frames=None).given(radius[0] if radius else None).refuse(NO_RUN)
        make = partial(exports.film_runs, target, chosen)
    elif len(target) > 1:
        odd = target[folders.index(False)]
        raise ValueError(f"{odd}: no folder of a run. Give folders of runs, or one file")
    else:
        make = partial(_of_file, target[0], of_file, radius, chosen)
    reels = _made(make, jobs, scheduler)
    print(*write_table(reels, out, parquet=parquet), sep="\n")
    for form in dict.fromkeys(export or []):
        print(*exports.export(reels, form.value, out), sep="\n")
    page = write_film(reels, out, command_line(), "" if all(folders) else target[0].name)
    columns, rows = headline_rows(reels)
    show(["median (nine tenths)", *columns], rows)
    unsolved = [(reel.title, frame) for reel in reels for frame in reel.unsolved]
    for title, frame in unsolved:
        print(f"{title}, frame {frame.number}: {frame.status}: {frame.reason}", file=sys.stderr)
    show_page(page)
    raise typer.Exit(bool(unsolved))


def _of_file(
    file: Path, of_file: OfFile, radii: list[float] | None, chosen: Frames | None, **how: Any
) -> list[Reel]:
    """The reels of a dump, or of a trajectory with each radius."""
    from analysis.film import export as exports
    from analysis.film.files import open_any

    given = of_file.given(radii[0] if radii else None)
    source = open_any(file, given)
    if source.recording is None:
        return exports.film_dump(source, chosen, **how)
    if source.measured:
        warn(MEASURED)
    every = sorted(radii or RADII)
    return exports.film_heads(source.recording, of_file.room, every, chosen, given=given, **how)


def _made(make: Callable[..., list[Reel]], jobs: int, scheduler: str | None) -> list[Reel]:
    """Make the reels, with as many processes, or on the cluster of a scheduler."""
    from analysis.support.parallel import workers

    with contextlib.ExitStack() as stack:
        executor = None
        if jobs > 1 or scheduler:
            executor = stack.enter_context(workers(jobs, scheduler))
        return make(progress=stack.enter_context(progress()), executor=executor)
