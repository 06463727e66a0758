"""percussions exposure."""

from pathlib import Path

from analysis.cli.app import show
from analysis.cli.options import Positive


def exposure(
    run: Path,
    *,
    limits: list[Path] | None = None,
    sensors: Path | None = None,
    window: Positive = 0.1,
) -> None:
    """List who carries more than the limits, for how long, and the loads on walls.

    Writes exposure_people.csv, exposure_walls.csv, exposure_crowd.csv and exposure_limits.csv into
    the folder of the run. The rigid engine always sums impulses. LAMMPS and YADE sum them in
    a run with --impulses.

    run: Folder of a finished run with impulses.
    sensors: TOML file of mats on walls and vests on people: their readings go to sensors.csv.
    window: Window over which forces are means, in s.

    Example: percussions exposure out/arch/rigid_moreau_jean --limits mine.toml"""
    from analysis.exposure.limits import known_limits
    from analysis.exposure.loads import HEAD, exposure_rows, read_exposure, write_exposure
    from analysis.exposure.sensors import write_sensors

    known = known_limits(limits or [])
    found = read_exposure(run, window)
    written = [write_sensors(run, sensors)] if sensors else []
    written += write_exposure(found, known, run)
    title = (
        f"{found.scene.title}: forces are impulses over windows of {found.duration[0]:g} s. "
        f"The run lasts {found.time[-1]:g} s"
    )
    show(HEAD, exposure_rows(found, known), numbers_from=len(HEAD), title=title)
    print(*written, sep="\n")
