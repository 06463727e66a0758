"""percussions film."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from analysis.cli.app import command_line, progress, show, show_page
from analysis.cli.options import InputFile, Out, Positive, Processes, Unit
from analysis.support.extras import load

if TYPE_CHECKING:
    from analysis.film.frame import Reel

RADII = (0.16, 0.17, 0.18, 0.19, 0.20)


class Form(StrEnum):
    """For which program a film is exported: ParaView or OVITO."""

    VTK = "vtk"
    OVITO = "ovito"


def film(
    target: list[InputFile],
    *,
    frames: str | None = None,
    room: InputFile | None = None,
    radius: list[Positive] | None = None,
    mass: Positive = 75.0,
    unit: Unit | None = None,
    frame_rate: Positive | None = None,
    export: list[Form] | None = None,
    parquet: bool = False,
    jobs: Processes = 1,
    scheduler: str | None = None,
    out: Out = Path("film"),
) -> None:
    """Make a film of the contact forces of a run, or of a real trajectory.

    Writes film.html, which opens offline and plays, and film.csv. Runs (of LAMMPS, YADE and the
    rigid engine, side by side) show what the engine wrote, the percussions of the same places, and
    the difference. In a trajectory heads become disks that do not overlap, in every frame.

    Exit status 1 if the percussions of a frame are not solved.

    target: Folders of finished runs of one scene, or one trajectory file.
    frames: first:last:step, both ends included. Default: about 50.
    room: Of a trajectory: TOML file with walls and drive.
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
    chosen = None if frames is None else Frames.parse(frames)
    folders = [_is_folder(one) for one in target]
    if all(folders):
        if room or radius or unit or frame_rate:
            raise ValueError("--room, --radius, --unit and --frame-rate: only of a trajectory file")
        make = partial(exports.film_runs, target, chosen)
    elif len(target) > 1:
        odd = target[folders.index(False)]
        raise ValueError(f"{odd}: no folder of a run. Give folders of runs, or one trajectory file")
    elif room is None:
        raise ValueError("--room: a trajectory needs a TOML file with walls and drive")
    else:
        from analysis.scene.real.trajectory import Recording

        recording = Recording.read(target[0], unit=unit, frame_rate=frame_rate)
        radii = sorted(radius or RADII)
        make = partial(exports.film_heads, recording, room, radii, chosen, mass=mass)
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


def _is_folder(target: Path) -> bool:
    if not target.exists():
        raise ValueError(f"{target}: no such file or folder")
    return target.is_dir()


def _made(make: Callable[..., list[Reel]], jobs: int, scheduler: str | None) -> list[Reel]:
    """Make the reels, with as many processes, or on the cluster of a scheduler."""
    from analysis.support.parallel import workers

    with contextlib.ExitStack() as stack:
        executor = None
        if jobs > 1 or scheduler:
            executor = stack.enter_context(workers(jobs, scheduler))
        return make(progress=stack.enter_context(progress()), executor=executor)
