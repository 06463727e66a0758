"""percussions exposure."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from analysis.cli.app import progress, show, warn
from analysis.cli.options import NO_RUN, InputFile, OfFile, Out, Positive, is_run

if TYPE_CHECKING:
    from analysis.exposure.loads import RunLoads


def exposure(
    run: InputFile,
    *,
    limits: list[Path] | None = None,
    sensors: Path | None = None,
    stops: str | None = None,
    window: Positive = 0.1,
    of_file: OfFile,
    radius: Positive | None = None,
    out: Out | None = None,
) -> None:
    """List who carries more than the limits, for how long, and the loads on walls.

    Writes exposure_people.csv, exposure_walls.csv, exposure_crowd.csv and exposure_limits.csv into
    the folder of the run. The rigid engine always sums impulses. LAMMPS and YADE sum them in
    a run with --impulses.

    Of a LAMMPS dump or a trajectory the forces are the percussions of single frames, no sums of
    impulses. They need a room with a drive.

    run: Folder of a finished run with impulses, or a dump or trajectory file.
    sensors: TOML file of mats on walls and vests on people: their readings go to sensors.csv.
    stops: Limit of a force on a person. Writes the scene again beside the run's folder. In it
        those want to go nowhere whose sum of forces was above the limit for its time.
    window: Window over which forces are means, in s.
    radius: Of a trajectory: radius of each person in m. Default: 0.18.
    out: Folder for the results. Default: that of the run, or exposure.

    Example: percussions exposure out/arch/rigid_moreau_jean --limits mine.toml"""
    from analysis.exposure.limits import LimitError, known_limits
    from analysis.exposure.loads import HEAD, exposure_rows, read_exposure, write_exposure
    from analysis.exposure.sensors import write_sensors
    from analysis.exposure.stops import write_stops

    known = known_limits(limits or [])
    if stops and stops not in (names := [limit.name for limit in known]):
        raise LimitError(f"--stops {stops}: unknown limit. There are: {', '.join(names)}")
    if is_run(run):
        of_file.given(radius).refuse(NO_RUN)
        if out is not None:
            raise ValueError(f"--out: {NO_RUN}")
        found, folder = read_exposure(run, window), run
        what = f"forces are impulses over windows of {found.duration[0]:g} s. The run lasts"
    else:
        for name, given in (("sensors", sensors), ("stops", stops)):
            if given is not None:
                raise ValueError(f"--{name}: {run} is no run with impulses")
        found, folder = _of_file(run, of_file, radius), out or Path("exposure")
        apart = float(found.duration.max())
        if apart > (1 + 1e-9) * window:
            warn(
                f"{run}: frames are up to {apart:g} s apart, too far for windows of {window:g} s. "
                "Loads between frames are not seen"
            )
        what = (
            f"forces are those of {len(found.time)} single frames, not sums of impulses. It lasts"
        )
    written = [write_sensors(run, sensors)] if sensors else []
    written += write_exposure(found, known, folder)
    title = f"{found.scene.title}: {what} {found.time[-1]:g} s"
    show(HEAD, exposure_rows(found, known), numbers_from=len(HEAD), title=title)
    for limit in (one for one in known if one.name == stops):
        count, path = write_stops(found, limit, run.resolve().parent)
        print(f"{count} people stop. An assumption, no medicine")
        written.append(path)
    print(*written, sep="\n")


def _of_file(file: Path, of_file: OfFile, radius: float | None) -> RunLoads:
    from analysis.exposure.loads import loads_of_frames
    from analysis.film.files import open_any
    from analysis.film.frame import ENGINE, RIGID

    source, model = open_any(file, of_file.given(radius)), ENGINE if of_file.contacts else RIGID
    with progress():
        windows = [one.window(file, model) for one in source.frames(of_file.frames)]
    if len(windows) < 2:
        raise ValueError(f"{file}: one frame only. Times above limits need two")
    return loads_of_frames(source.scene, windows)
