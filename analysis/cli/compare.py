"""Commands that look at runs, or at the frames of a file: compare, film, exposure."""

from __future__ import annotations

import contextlib
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import typer

from analysis.cli.app import command_line, progress, refuse, show, show_page, warn
from analysis.cli.options import (
    InputFile,
    OfFile,
    Out,
    Positive,
    Processes,
    RigidLaw,
    is_run,
    one_dump,
)
from analysis.support.extras import load, missing_extra

if TYPE_CHECKING:
    from analysis.compare.comparison import Comparison
    from analysis.studies.exposure.loads import RunLoads
    from analysis.studies.film.frame import Animation, FrameRange
    from analysis.studies.motion.pairwise import WindowComparison
    from nscd import ContactLaw


# Rows of the table of windows in the terminal.
MOST_ROWS = 12
# The first frame of a dump says within so many bytes whether it has a time.
HEAD_BYTES = 4096


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
        settings = {"time": time, "window": window, "last": last, "rigid_law": rigid_law}
        refuse("only of runs. Of files give --frames", **settings)
        if any(folders):
            raise ValueError(
                f"{runs[folders.index(True)]}: a folder. Give runs only, or files only"
            )
        _by_files(runs, of_file, radius, out or Path("compare"))
        return
    of_file.refuse_run(radius=radius, out=out)
    if window is not None and len(runs) < 2:
        raise ValueError("window: two runs or more are compared by windows")
    compared, reasons = _by_windows(runs, window, last)
    if window is not None:
        refuse("of an instant, and --window compares no instant", time=time, rigid_law=rigid_law)
        if reasons:
            raise DumpError(reasons[0])
        _show_windows(runs[0], compared)
        return
    # forces of a rigid run are means since the frame before; alone it is looked at all the same
    engines = [RunRecord.read(folder).engine for folder in runs]
    soft = [folder for folder, engine in zip(runs, engines, strict=True) if engine != RIGID]
    if len(runs) < 2:
        refuse("two runs or more are compared by windows", last=last)
    elif not soft:
        refuse("of an instant, at which rigid runs have no forces", time=time, rigid_law=rigid_law)
    well = _by_snapshot(soft or runs, time, rigid_law) if soft or len(runs) < 2 else True
    _show_windows(runs[0], compared)
    for reason in reasons:
        warn(f"not compared by windows: {reason}")
    raise typer.Exit(not well or bool(reasons))


def _ask(file: Path, of_file: OfFile, other: str = "") -> None:
    """Raise ValueError naming at once all that a dump lacks for times and forces, before anything is
    imported for it.

    other: what is needed where it has no contacts of its own"""
    from analysis.support.reading import DAMAGED, open_file

    with open_file(file) as content:
        try:
            head = content.read(HEAD_BYTES)
        except DAMAGED:
            return
    if not head.startswith(b"ITEM:"):
        return
    names = ("run.json", "scene.toml", f"{file.stem}_contacts.dump")
    run, scene, contacts = ((file.parent / one).exists() for one in names)
    own, lacks = bool(contacts or of_file.contacts), []
    if b"ITEM: TIME\n" not in head and not of_file.time_step and not run:
        lacks.append("times (--time-step)")
    if not (of_file.room or scene or own):
        lacks.append("what presses: walls and a [drive] (--room), or own forces (--contacts)")
    if other and not (own or scene):
        lacks.append(other)
    if len(lacks) > 1:
        raise ValueError(f"{file}: it lacks {', and '.join(lacks)}")


def _by_files(files: list[Path], of_file: OfFile, radius: float | None, out: Path) -> None:
    """Compare files by the frames that they share: own forces with percussions, then percussions of
    the first with those of each other."""
    if of_file.contacts and len(files) > 1:
        raise ValueError("--contacts: of one dump. Several have theirs beside them")
    for file in files:
        _ask(file, of_file, "" if len(files) > 1 else "something to compare with: a second file")
    from analysis.studies.film.files import open_any, paired
    from analysis.studies.film.frame import ENGINE, RIGID
    from analysis.studies.motion.pairwise import compare_frames, write_frames

    sources = [open_any(file, of_file.file_options(radius)) for file in files]
    made = []
    for one in sources:
        if one.engine:
            pairs = (
                (each.window(one.file, ENGINE), each.window(one.file, RIGID))
                for each in one.frames(of_file.frames)
            )
            if one.lacks_walls:
                pairs = ((own.of_pairs(), rigid.of_pairs()) for own, rigid in pairs)
            titles = (f"{one.file.name}, own forces", "percussions")
            made.append((f"{one.file.stem}_own", compare_frames(one.scene, titles, pairs)))
    first, *others = sources
    for one in others:
        frames = first.frames(of_file.frames), one.frames(of_file.frames)
        both = paired(*frames, max(first.same_s, one.same_s))
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
    from analysis.pages.numbers import decimals, significant
    from analysis.studies.exposure.loads import MEASURES
    from analysis.studies.motion.study import more_words

    rows = []
    for key, found in compared.paired().items():
        measure, means = MEASURES[key], [significant(found.first), significant(found.second)]
        more = more_words(found.more, found.relative, measure.unit)
        row = [more, decimals(found.autocorrelation, 2), significant(found.independent, 2)]
        rows.append([f"{measure.title} ({measure.unit})", *means, *row])
    head = [f"mean over {of}", *compared.titles, "second above first", "its autocorrelation"]
    show([*head, f"independent {of}"], rows, title=title)


def _by_windows(
    runs: Sequence[Path], window: float | None, last: float | None
) -> tuple[dict[Path, WindowComparison], list[str]]:
    """Compare the first of runs with each other, before anything is written, and say why some cannot
    be. Raises DumpError for runs of different crowds."""
    from analysis.dumps import DumpError
    from analysis.engines.record import read_finished
    from analysis.studies.exposure.loads import SHORTEST_S
    from analysis.studies.motion.pairwise import check_same_crowd, compare_windows

    compared, reasons = {}, []
    first, *others = ((folder, read_finished(folder)[0]) for folder in runs)
    for one in others:
        check_same_crowd(first, one)
    for other in runs[1:]:
        try:
            compared[other] = compare_windows(runs[0], other, window or SHORTEST_S, last)
        except DumpError as error:
            reasons.append(str(error))
    return compared, reasons


def _show_windows(first: Path, every: Mapping[Path, WindowComparison]) -> None:
    from analysis.pages.numbers import significant
    from analysis.studies.motion.pairwise import write_windows
    from analysis.studies.motion.study import more_words

    for other, compared in every.items():
        paths = write_windows(other, compared, (first, other))
        starts, ends = compared.windows["start_s"], compared.windows["end_s"]
        span = f"{len(starts)} from {starts[0]:.4g} to {ends[-1]:.4g} s"
        lasting = f"impulses over windows of {significant(ends[0] - starts[0])} s"
        _show_pair(compared, f"{compared.scene}: {lasting}, {span}", "windows")
        found = compared.paired()
        maximum = [more_words(found[key].more, found[key].relative, "N") for key in ("walls", "contact_largest")]
        print(f"the second run has {maximum[0]} load on all walls and {maximum[1]} largest force, in these windows")
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
    only = [f"{one:.0f}, {other:.0f}" for one, other in zip(first, second, strict=True)]
    columns = {
        when: [f"{end:.4g}" for end in shown["end_s"]],
        "contacts of both": [f"{count:.0f}" for count in shown["contacts_both"]],
        "of one only": only,
        "per contact": map(percent, shown["contact_relative_difference"]),
        "correlation": [decimals(fraction, 3) for fraction in shown["contact_correlation"]],
        "per person": map(percent, shown["person_relative_difference"]),
        "load on walls": map(percent, shown["wall_difference"]),
        "sum of all": map(percent, shown["sum_difference"]),
    }
    return [*columns], [list(row) for row in zip(*columns.values(), strict=True)]


def _by_snapshot(runs: Sequence[Path], time: float | None, rigid_law: ContactLaw | None) -> bool:
    """Each run with the percussions of its snapshot. Returns whether all were solved."""
    from analysis.compare.comparison import compare_run, statistics, write_contacts
    from analysis.compare.study import remarks
    from analysis.engines.rigid import NAME as RIGID
    from analysis.pages.numbers import statistic
    from analysis.studies.motion.study import model_title
    from analysis.support.files import write_json

    # all of them before anything is written
    compared = [compare_run(folder, time, rigid_law) for folder in runs]
    headers, columns = [], []
    for folder, comparison in zip(runs, compared, strict=True):
        numbers = {"time_s": comparison.snapshot.time} | statistics(comparison)
        law = comparison.law
        bouncing = f"restitution {law.restitution:g}" if law.restitution else "inelastic"
        words = {
            "status": str(comparison.solution.status),
            "unit": comparison.unit,
            "rigid_law": bouncing + (f", friction {law.friction:g}" if law.friction else ""),
        }
        sentences = [*remarks(comparison)]
        write_contacts(folder / "comparison.csv", comparison)
        write_json(folder / "comparison.json", words | numbers | {"remarks": sentences})
        for sentence in sentences:
            warn(f"{folder}: {sentence}")
        scene = comparison.scene
        headers.append(f"{scene.name}: {model_title(scene, comparison.record.engine)}")
        cells = {key: statistic(key, value, comparison.unit) for key, value in numbers.items()}
        columns.append(words | cells)
    small = all(abs(one.balance.closure_error) < ROUNDING for one in compared)
    names = {key: _row_name(key, compared[0].record.engine != RIGID) for key in columns[0]}
    if small:
        names.pop("closure_error")
    rows = [[name, *(column[key] for column in columns)] for key, name in names.items()]
    show(["quantity", *headers], rows)
    for head, comparison in zip(headers, compared, strict=True):
        print(f"{head}: {_verdict(comparison)}")
    for folder in runs:
        print(folder / "comparison.csv")
    return all(column["status"] == "solved" for column in columns)


# A balance that closes to rounding is no news; sums on people within AGREE are the same to a reader.
ROUNDING, AGREE = 1e-9, 0.1
ROWS = {
    "time_s": "time (s)",
    "contacts_only_penalty": "contacts of the springs alone",
    "contacts_only_rigid": "contacts of rigid bodies alone",
    "closure_error": "momentum not accounted for",
    "unbalanced_share": "still accelerating (share of the push)",
}
WORDS = {
    "penalty": "springs", "contact": "contact forces,", "determined": "determined contact forces,",
    "disk_sum": "sums on people,", "disk_vector": "resultants on people,", "mean": "mean of contacts",
    "max": "largest contact", "relative_difference": "difference (rms)",
}  # fmt: skip


def _row_name(key: str, springs: bool) -> str:
    """Name a number of a comparison in words. Without springs the engine is named as such."""
    name = ROWS.get(key, key)
    if parts := re.fullmatch(r"(.+?)_(mean|max|correlation|relative_difference)", name):
        name = " ".join(WORDS.get(one, one) for one in parts.groups())
    name = name.replace("_", " ")
    return name if springs else name.replace("springs", "engine")


def _verdict(one: Comparison) -> str:
    """Say in a sentence whether springs and rigid bodies agree at this instant, and by how much not."""
    from analysis.compare.comparison import statistics
    from analysis.compare.study import remarks
    from analysis.pages.numbers import percent, significant

    found = statistics(one)
    if one.solution.status != "solved" or not found["contacts_both"]:
        return "no verdict: no solved contact is in both models"
    difference = found["disk_sum_relative_difference"]
    means = [significant(found[f"{model}_mean"]) for model in ("penalty", "rigid")]
    agree = "agree" if difference <= AGREE else "differ"
    doubt = ". Take no single contact from it, see the warning" if [*remarks(one)] else ""
    return (
        f"the models {agree} by {percent(difference, 2)} in the sum on a person (rms, {AGREE:.0%} counts as "
        f"agreement), mean {means[0]} against {means[1]} {one.unit} a contact{doubt}"
    )


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
    openness: Literal["ranges", "ensemble"] = "ranges",
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
    openness: Of percussions: one state and the bounds of all, or mean and 90 % of all states.
        These are sampled, in seconds a frame, by default in 5 frames.
    parquet: Write film.parquet too (needs pyarrow).
    jobs: Processes that measure the frames.

    Example: percussions film scenes/gate_excerpt.txt --frames 400:410:5 --room scenes/rooms/gate.toml"""
    load("matplotlib")
    from analysis.studies.film import export as exports
    from analysis.studies.film.frame import FrameRange
    from analysis.studies.film.page import write_film
    from analysis.studies.film.summary import about, headline_rows, unsolved_kinds, write_table
    from analysis.support.parallel import workers

    if parquet:
        load("pyarrow")
    chosen = FrameRange() if of_file.frames is None else FrameRange.parse(of_file.frames)
    chosen = replace(chosen, ensemble=openness == "ensemble")
    folders = [is_run(one) for one in target]
    if all(folders):
        replace(of_file, frames=None).refuse_run(radius=radius or None)
        make = partial(exports.film_runs, target, chosen)
    elif len(target) > 1 and not any(folders):
        one_dump(target)
    elif len(target) > 1:
        odd = target[folders.index(False)]
        raise ValueError(f"{odd}: no folder of a run. Give folders of runs, or one file")
    else:
        make = partial(_reels_of, target[0], of_file, radius, chosen)
    with contextlib.ExitStack() as stack:
        executor = None
        if jobs > 1 or scheduler:
            executor = stack.enter_context(workers(jobs, scheduler))
        animations = make(progress=stack.enter_context(progress()), executor=executor)
    print(*write_table(animations, out, parquet=parquet), sep="\n")
    for form in dict.fromkeys(export or []):
        print(*exports.export(animations, form.value, out), sep="\n")
    page = write_film(animations, out, command_line(), "" if all(folders) else target[0].name)
    columns, rows = headline_rows(animations)
    print(*about(animations), sep=", ")
    show(["median (nine tenths)", *columns], rows)
    unsolved, of = unsolved_kinds(animations), sum(len(animation.frames) for animation in animations)
    for count, title, frame, reason in unsolved:
        first = f"The first is frame {frame.number} of {title}"
        print(f"{frame.status}: {count} of {of} frames. {first}: {reason}", file=sys.stderr)
    show_page(page)
    raise typer.Exit(bool(unsolved))


def _reels_of(
    file: Path, of_file: OfFile, radii: list[float] | None, chosen: FrameRange | None, **how: Any
) -> list[Animation]:
    """The reels of a dump, or of a trajectory with each radius."""
    from analysis.studies.film import export as exports
    from analysis.studies.film.files import open_any

    file_options = of_file.file_options(radii[0] if radii else None)
    source = open_any(file, file_options)
    if source.recording is None:
        return exports.film_dump(source, chosen, **how)
    if source.measured:
        warn(MEASURED)
    every = sorted(radii or RADII)
    return exports.film_heads(source.recording, of_file.room, every, chosen, file_options=file_options, **how)


def exposure(
    run: InputFile,
    *,
    limits: list[Path] | None = None,
    sensors: Path | None = None,
    stops: str | None = None,
    window: Positive | None = None,
    of_file: OfFile,
    radius: Positive | None = None,
    out: Out | None = None,
) -> None:
    """List who carries more than the limits, for how long, and the loads on walls.

    Writes exposure_people.csv, exposure_walls.csv, exposure_crowd.csv, exposure_limits.csv,
    exposure_outline.csv and exposure_places.csv (loads along joined walls), and exposure_walls.png
    into the folder of the run. The rigid engine always sums impulses. LAMMPS and YADE sum them in
    a run with --impulses.

    Of a LAMMPS dump or a trajectory the forces are the percussions of single frames, no sums of
    impulses. They need a room with a drive.

    run: Folder of a finished run with impulses, or a dump or trajectory file.
    sensors: TOML file of mats on walls and vests on people: their readings go to sensors.csv.
    stops: Limit of a force on a person. Writes the scene again beside the run's folder. In it
        those want to go nowhere whose sum of forces was above the limit for its time.
    window: Of a run: window over which forces are means, in s. Default: 0.1.
    radius: Of a trajectory: radius of each person in m. Default: 0.18.
    out: Folder for the results. Default: that of the run, or exposure.

    Example: percussions exposure out/arch/rigid_moreau_jean --limits mine.toml"""
    from analysis.studies.exposure import loads, positions
    from analysis.studies.exposure.limits import LimitError, known_limits
    from analysis.studies.exposure.sensors import write_sensors

    chosen_limits = known_limits(limits or [])
    if stops and stops not in (names := [limit.name for limit in chosen_limits]):
        raise LimitError(f"--stops {stops}: unknown limit. There are: {', '.join(names)}")
    if is_run(run):
        of_file.refuse_run(radius=radius, out=out)
        found, folder = loads.read_exposure(run, window or loads.SHORTEST_S), run
        what = f"forces are impulses over windows of {found.duration[0]:g} s. The run lasts"
    else:
        refuse(f"{run} is no run with impulses", sensors=sensors, stops=stops, window=window)
        found, folder = _loads_of(run, of_file, radius), out or Path("exposure")
        difference = float(found.duration.max())
        if difference > (1 + 1e-9) * loads.SHORTEST_S:
            warn(
                f"{run}: frames are up to {difference:g} s apart, too far for windows of {loads.SHORTEST_S:g} s. "
                "Loads between frames are not seen"
            )
        what = (
            f"forces are those of {len(found.time)} single frames, not sums of impulses. It lasts"
        )
    written = [write_sensors(run, sensors)] if sensors else []
    written += [*loads.write_exposure(found, chosen_limits, folder), *positions.write_along(found, folder)]
    if found.scene.walls:
        try:
            written.append(_draw_walls(found, folder))
        except ImportError as error:
            warn(missing_extra(error) or str(error))
    title = f"{found.scene.title}: {what} {found.time[-1]:g} s"
    show(loads.HEAD, loads.exposure_rows(found, chosen_limits), numbers_from=len(loads.HEAD), title=title)
    if where := positions.place_words(found):
        print(f"Largest load on any metre of walls: {where}")
    print(*loads.sources_of(chosen_limits), sep="\n")
    for limit in (one for one in chosen_limits if one.name == stops):
        count, path = loads.write_stops(found, limit, run.resolve().parent)
        print(f"{count} people stop. An assumption, no medicine")
        written.append(path)
    print(*written, sep="\n")


def _draw_walls(found: RunLoads, folder: Path) -> Path:
    """Draw the load along the walls into a folder. Raises ImportError without matplotlib."""
    from analysis.pages.html import saved
    from analysis.studies.exposure.picture import draw_loads
    from analysis.support.files import whole_file

    with whole_file(folder / "exposure_walls.png", "wb") as file:
        file.write(saved(draw_loads(found.scene, found.on_walls), "png"))
    return folder / "exposure_walls.png"


def _loads_of(file: Path, of_file: OfFile, radius: float | None) -> RunLoads:
    _ask(file, of_file)
    from analysis.studies.exposure.loads import loads_of_frames
    from analysis.studies.film.files import open_any
    from analysis.studies.film.frame import ENGINE, RIGID

    source, model = open_any(file, of_file.file_options(radius)), ENGINE if of_file.contacts else RIGID
    with progress():
        windows = [one.window(file, model) for one in source.frames(of_file.frames)]
    if len(windows) < 2:
        raise ValueError(f"{file}: one frame only. Times above limits need two")
    scene = source.scene
    if source.lacks_walls:
        scene, windows = scene.model_copy(update={"walls": ()}), [one.of_pairs() for one in windows]
    return loads_of_frames(scene, windows)
