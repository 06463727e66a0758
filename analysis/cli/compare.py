"""percussions compare."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from analysis.cli.app import show, warn
from analysis.cli.rigid_law import RigidLaw, law_words


def compare(
    runs: Annotated[list[Path], typer.Argument(help="Folders of finished runs.")],
    time: Annotated[
        float | None, typer.Option(help="Instant in s, instead of the scene's.")
    ] = None,
    rigid_law: RigidLaw = None,
) -> None:
    """Compare finished runs with the percussions of their snapshots.

    Writes comparison.csv and comparison.json into the folder of each run.

    Example: percussions compare out/arch/lammps_hooke_k1e+06 out/arch/yade_hooke_k1e+06
    """
    from analysis.compare.comparison import compare_run
    from analysis.compare.contacts_csv import write_contacts
    from analysis.compare.remarks import remarks
    from analysis.compare.statistics import statistics
    from analysis.pages.html import jsonable
    from analysis.pages.names import engine_label
    from analysis.pages.numbers import statistic
    from analysis.support.files import write_text

    # all of them before anything is written
    compared = [compare_run(folder, time, rigid_law) for folder in runs]
    heads, columns = [], []
    for folder, comparison in zip(runs, compared, strict=True):
        numbers = {"time_s": comparison.snapshot.time} | statistics(comparison)
        words = {
            "status": str(comparison.answer.status),
            "unit": comparison.unit,
            "rigid_law": law_words(comparison.law),
        }
        said = remarks(comparison)
        write_contacts(folder / "comparison.csv", comparison)
        content = jsonable(words | numbers | {"remarks": said})
        write_text(
            folder / "comparison.json", json.dumps(content, indent=1, ensure_ascii=False) + "\n"
        )
        for sentence in said:
            warn(f"{folder}: {sentence}")
        heads.append(f"{comparison.scene.name}: {engine_label(comparison)}")
        cells = {key: statistic(key, value, comparison.unit) for key, value in numbers.items()}
        columns.append(words | cells)
    rows = [[key.replace("_", " "), *(column[key] for column in columns)] for key in columns[0]]
    show(["quantity", *heads], rows)
    for folder in runs:
        print(folder / "comparison.csv")
    if any(column["status"] != "solved" for column in columns):
        raise typer.Exit(1)
