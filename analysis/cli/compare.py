"""percussions compare."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from analysis.cli.app import show, warn
from analysis.cli.options import NO_RUN, InputFile, OfFile, Out, Positive, RigidLaw, is_run

if TYPE_CHECKING:
    from analysis.motion.pairwise import WindowComparison
    from nscd import ContactLaw

# Rows of the table of windows in the terminal.
MOST_ROWS = 12


def compare(
    runs: list[InputFile],
    *,
    of_file: OfFile,
    radius: Positive | None = None,
    out: Out | None = None,
    time: float | None = None,
    window: Positive | None = None,
    last: Positive | None = None,
    rigid_law: RigidLaw = None,
) -> None:
    """Compare runs with each other, and each with the percussions of its snapshot.

    Several runs of one crowd, by any engines, are compared with the first by their impulses over
    windows of 0.1 s. The tables go contact by contact, wall by wall, and as distributions. That
    needs runs with --impulses (the rigid engine always has them).
    The snapshots of a rigid run are not compared then: a rigid contact has no force at an instant.
    One pair of runs gives numbers and no verdict: that takes replicates (percussions report).

    Exit status 1 if a snapshot is not solved or runs cannot be compared by windows.

    Writes windows.csv, window_contacts.csv and windows.json into the folder of each run but the
    first. Writes comparison.csv and comparison.json (the snapshot) into the folder of each.

    Files are compared frame by frame. Two LAMMPS dumps or trajectories of one crowd are compared by
    their percussions. The own contact forces of a dump are compared with its percussions.
    That writes NAME_frames.csv and NAME_frame_contacts.csv.

    runs: Folders of finished runs, or dump or trajectory files.
    radius: Of a trajectory: radius of each person in m. Default: 0.18.
    out: Of files: folder for the results. Default: compare.
    time: Instant in s, instead of the scene's.
    window: Only impulses over windows of so many s (at least 0.1), no instant.
    last: Only windows of the last so many s. Default: all.

    Example: percussions compare out/arch/lammps_hooke_k1e+06 out/arch/rigid_moreau_jean --window
        0.1"""
    from analysis.dumps import DumpError
    from analysis.engines.record import RunRecord
    from analysis.engines.rigid import NAME as RIGID

    folders = [is_run(one) for one in runs]
    if not all(folders):
        for name, value in {"time": time, "window": window, "last": last}.items():
            if value is not None:
                raise ValueError(f"--{name}: only of runs. Of files give --frames")
        if any(folders):
            raise ValueError(
                f"{runs[folders.index(True)]}: a folder. Give runs only, or files only"
            )
        _by_files(runs, of_file, radius, out or Path("compare"))
        return
    of_file.given(radius).refuse(NO_RUN)
    if out is not None:
        raise ValueError(f"--out: {NO_RUN}")
    if window is not None:
        if len(runs) < 2:
            raise ValueError("window: two runs or more are compared by windows")
        for other in runs[1:]:
            _by_windows(runs[0], other, window, last)
        return
    # forces of a rigid run are means since the frame before; alone it is looked at all the same
    engines = [RunRecord.read(folder).engine for folder in runs]
    soft = [folder for folder, engine in zip(runs, engines, strict=True) if engine != RIGID]
    well = _by_snapshot(soft or runs, time, rigid_law) if soft or len(runs) < 2 else True
    for other in runs[1:]:
        try:
            _by_windows(runs[0], other, None, last)
        except DumpError as error:
            warn(f"not compared by windows: {error}")
            well = False
    raise typer.Exit(not well)


def _by_files(files: list[Path], of_file: OfFile, radius: float | None, out: Path) -> None:
    """Compare files by the frames that they share: own forces with percussions, then percussions of
    the first with those of each other."""
    from analysis.film.files import open_any, paired
    from analysis.film.frame import ENGINE, RIGID
    from analysis.motion.pairwise import compare_frames, write_frames

    if of_file.contacts and len(files) > 1:
        raise ValueError("--contacts: of one dump. Several have theirs beside them")
    sources = [open_any(file, of_file.given(radius)) for file in files]
    made = []
    for one in sources:
        if one.own:
            every = one.frames(of_file.frames)
            pairs = (
                (each.window(one.file, ENGINE), each.window(one.file, RIGID)) for each in every
            )
            titles = (f"{one.file.name}, own forces", "percussions")
            made.append((f"{one.file.stem}_own", compare_frames(one.scene, titles, pairs)))
    first, *others = sources
    for one in others:
        both = paired(first.frames(of_file.frames), one.frames(of_file.frames))
        pairs = ((a.window(first.file, RIGID), b.window(one.file, RIGID)) for a, b in both)
        titles = (str(first.file), str(one.file))
        made.append((one.file.stem, compare_frames(first.scene, titles, pairs)))
    if not made:
        raise ValueError(
            f"{files[0]}: nothing to compare with. Give its own forces (--contacts) or a second file"
        )
    written: list[str] = []
    for stem, compared in made:
        written.append(stem if stem not in written else f"{stem}_{len(written) + 1}")
        times = compared.windows["end_s"]
        span = f"{len(times)} frames, from {times[0]:.4g} to {times[-1]:.4g} s"
        _show_pair(compared, f"{compared.scene}: forces of {span}", "frames")
        show(*_window_rows(compared, "at (s)"), title="frame by frame, second against first")
        print(*write_frames(out, written[-1], compared), sep="\n")


def _show_pair(compared: WindowComparison, title: str, of: str) -> None:
    """Print the means of both over windows or frames."""
    from analysis.exposure.loads import MEASURES
    from analysis.motion.study import more_words
    from analysis.pages.numbers import decimals, significant

    rows = []
    for key, found in compared.paired().items():
        measure, means = MEASURES[key], [significant(found.first), significant(found.second)]
        more = more_words(found.more, found.relative, measure.unit)
        row = [more, decimals(found.autocorrelation, 2), significant(found.independent, 2)]
        rows.append([f"{measure.title} ({measure.unit})", *means, *row])
    head = [f"mean over {of}", *compared.titles, "second above first", "its autocorrelation"]
    show([*head, f"independent {of}"], rows, title=title)


def _by_windows(first: Path, other: Path, window: float | None, last: float | None) -> None:
    from analysis.exposure.loads import SHORTEST_S
    from analysis.motion.pairwise import compare_windows, write_windows
    from analysis.pages.numbers import significant

    compared = compare_windows(first, other, window or SHORTEST_S, last)
    paths = write_windows(other, compared, (first, other))
    starts, ends = compared.windows["start_s"], compared.windows["end_s"]
    title = (
        f"{compared.scene}: impulses over windows of "
        f"{significant(ends[0] - starts[0])} s, {len(starts)} from {starts[0]:.4g} "
        f"to {ends[-1]:.4g} s"
    )
    _show_pair(compared, title, "windows")
    print("one pair of runs: no verdict. Replicates have one: percussions report SCENE --seeds 5")
    show(*_window_rows(compared), title="window by window, second against first")
    print(*paths, sep="\n")


def _window_rows(
    compared: WindowComparison, when: str = "to (s)"
) -> tuple[list[str], list[list[str]]]:
    """The agreement in some windows, evenly chosen."""
    from analysis.pages.numbers import decimals, percent

    every = -(-len(compared.windows["end_s"]) // MOST_ROWS)
    shown = {name: values[every - 1 :: every] for name, values in compared.windows.items()}
    first, second = shown["contacts_only_first"], shown["contacts_only_second"]
    columns = [
        [f"{end:.4g}" for end in shown["end_s"]],
        [f"{count:.0f}" for count in shown["contacts_both"]],
        [f"{one:.0f}, {other:.0f}" for one, other in zip(first, second, strict=True)],
        [percent(share) for share in shown["contact_relative_difference"]],
        [decimals(share, 3) for share in shown["contact_correlation"]],
        [percent(share) for share in shown["person_relative_difference"]],
        [percent(share) for share in shown["wall_difference"]],
        [percent(share) for share in shown["sum_difference"]],
    ]
    rows = [list(row) for row in zip(*columns, strict=True)]
    head = [when, "contacts of both", "of one only", "per contact", "correlation", "per person"]
    return [*head, "load on walls", "sum of all"], rows


def _law_words(law: ContactLaw) -> str:
    """Say a law in a few words."""
    bouncing = "inelastic" if not law.restitution else f"restitution {law.restitution:g}"
    return f"{bouncing}, friction {law.friction:g}" if law.friction else bouncing


def _by_snapshot(runs: Sequence[Path], time: float | None, rigid_law: ContactLaw | None) -> bool:
    """Each run with the percussions of its snapshot. Returns whether all were solved."""
    from analysis.compare.comparison import compare_run, write_contacts
    from analysis.compare.statistics import statistics
    from analysis.compare.study import remarks
    from analysis.engines.rigid import NAME as RIGID
    from analysis.motion.study import model_title
    from analysis.pages.numbers import statistic
    from analysis.support.files import write_json

    # all of them before anything is written
    compared = [compare_run(folder, time, rigid_law) for folder in runs]
    heads, columns = [], []
    for folder, comparison in zip(runs, compared, strict=True):
        numbers = {"time_s": comparison.snapshot.time} | statistics(comparison)
        words = {
            "status": str(comparison.answer.status),
            "unit": comparison.unit,
            "rigid_law": _law_words(comparison.law),
        }
        said = remarks(comparison)
        write_contacts(folder / "comparison.csv", comparison)
        write_json(folder / "comparison.json", words | numbers | {"remarks": said})
        for sentence in said:
            warn(f"{folder}: {sentence}")
        scene = comparison.scene
        heads.append(f"{scene.name}: {model_title(scene, comparison.record.engine)}")
        cells = {key: statistic(key, value, comparison.unit) for key, value in numbers.items()}
        columns.append(words | cells)
    own = "engine" if compared[0].record.engine == RIGID else "penalty"
    rows = [
        [key.replace("_", " ").replace("penalty", own), *(column[key] for column in columns)]
        for key in columns[0]
    ]
    show(["quantity", *heads], rows)
    for folder in runs:
        print(folder / "comparison.csv")
    return all(column["status"] == "solved" for column in columns)
