"""percussions push."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from analysis.cli.app import Out, command_line, path, progress, share, show, warn


def push(
    file: Annotated[
        Path, typer.Argument(parser=path, help="CSV with id, time, x, y: heads of people in a row.")
    ],
    wall: Annotated[
        float | None,
        typer.Option(help="Where a wall crosses the row, in m: x or y as in the file."),
    ] = None,
    arms: Annotated[
        list[float] | None,
        typer.Option(
            parser=share,
            help="Share of the room between chests that arms bridge from the start; several "
            "times. Left out: 0, 0.5 and 1.",
        ),
    ] = None,
    out: Out = Path("push"),
) -> None:
    """Compute a push trial after the event: which models beat the baselines?

    The first of the row moves as measured, the others as LAMMPS (2·10³ to 10⁶ N/m) and rigid disks
    say. Nothing is fitted. Also read, where they are there: Weight_kg, Gender,
    MoCap_ID and Order_of_Participants_MoCap_ID.

    Writes a page, scores.csv and onsets.csv.

    Example: percussions push heads.csv --wall 0.4 --out push/heads
    """
    from analysis.push.hindcast import hindcast
    from analysis.push.page import HEAD, summary, verdicts, write_hindcast
    from analysis.push.row import ARMS

    with progress() as bars:
        found = hindcast(file, wall, sorted(set(arms)) if arms else ARMS, progress=bars)
    for note in found.trial.notes:
        warn(note)
    written = write_hindcast(found, out, command_line())
    title = f"{file.name}: median (5 – 95 %) over postures, floors and depths of chests"
    show(HEAD, summary(found), title=title)
    for line in verdicts(found):
        print(f"- {line.replace('**', '')}")
    for name in written[:-1]:
        print(name)
    print(written[-1].resolve().as_uri())
