"""Body dumps: opened as an MDAnalysis Universe, and the disks of a frame."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from analysis.dumps.bodies import MASS_UNITS, UNITS, Stated, joined_of, snapshot_at, state_of
from analysis.dumps.find_frames import DumpError
from analysis.dumps.index import DumpIndex, index_dump
from analysis.support.reading import UnreadableError, read_text
from nscd import Snapshot
from nscd.arrays import LARGEST

if TYPE_CHECKING:
    from MDAnalysis import Universe
    from MDAnalysis.coordinates.timestep import Timestep

RECORD = "run.json"
# Times in a dump, and those of its steps, may differ by this share: they have few digits.
SAME = 1e-3


def open_bodies(
    path: str | Path,
    time_step: float | None = None,
    unit: str | None = None,
    *,
    mass_unit: str | None = None,
    fixed_type: int | Iterable[int] = (),
    mol: str | None = None,
) -> Universe:
    """Open a body dump as an MDAnalysis Universe.

    time_step: s, of the simulation; that of run.json beside the dump where left out. Without
        either, and without ITEM: TIME in the dump, times are NaN
    unit: of lengths, and of velocities per second: m, cm or mm; that of ITEM: UNITS, or m, where left
        out, and then radii of which half are above 2 m are refused, but in a run of an engine here
    mass_unit: kg (densities: kg/m³) or g (g/cm³); kg where left out, but of densities beside cm;
        masses of which half are below 0.5 kg or above 1000 kg are then refused as such radii are
    fixed_type: types of disks that do not move, as those of LAMMPS' fix freeze: they are no people,
        in no snapshot, and `PercussionAnalysis` takes them as walls
    mol: rigid where disks of one `mol` are one body, single where they move alone; needed where they
        touch and there is no body_inertia

    Raises DumpError naming the file and the line, step, column or key.

    >>> universe = open_bodies("out/gate/lammps_hooke_k1e+06/bodies.dump")
    >>> universe.atoms.n_atoms, round(universe.trajectory[-1].time, 6)  # s
    (55, 2.0)
    """
    # imported when first needed: an engine that only writes dumps starts a third of a second sooner
    from MDAnalysis import Universe

    from analysis.dumps.mdanalysis_reader import BodiesReader

    path = Path(path)
    if time_step is None:
        time_step = _recorded_time_step(path)
    elif not 0 < time_step <= LARGEST:
        raise DumpError(
            f"time_step: {time_step} s. A finite time above 0, at most {LARGEST:g}, is needed"
        )
    for name, word, choices in (
        ("unit", unit, (*UNITS,)),
        ("mass_unit", mass_unit, (*MASS_UNITS,)),
        ("mol", mol, ("rigid", "single")),
    ):
        if word not in (None, *choices):
            raise DumpError(f"{name}: {word!r}. There are: {', '.join(choices)}")
    types = (fixed_type,) if isinstance(fixed_type, int) else (*fixed_type,)
    stated = Stated(unit=unit, mass_unit=mass_unit, fixed_type=types, mol=mol)
    index = index_dump(path)
    _check_time_step(index, time_step)
    universe = Universe.empty(max(1, *index.counts), trajectory=False)
    foreign = not (path.parent / RECORD).exists()
    arguments = {"index": index, "stated": stated, "foreign": foreign}
    universe.load_new(str(path), format=BodiesReader, dt=time_step, **arguments)
    return universe


def _check_time_step(index: DumpIndex, time_step: float) -> None:
    """Refuse a time step (s) that its times contradict."""
    first, last = index.frames[0], index.frames[-1]
    if first.time is None or last.time is None or math.isnan(time_step):
        return
    own, stated = last.time - first.time, time_step * (last.step - first.step)
    if abs(own - stated) > SAME * own:
        raise DumpError(
            f"{index.path}: its frames last {own:g} s by their times, and {stated:g} s by a time step of "
            f"{time_step:g} s"
        )


def _recorded_time_step(dump: Path) -> float:
    """The time step (s) in run.json beside a dump, NaN where there is none."""
    record = dump.parent / RECORD
    if not record.exists():
        return math.nan
    try:
        content = json.loads(read_text(record))
        step = content["time_step_s"]
    except UnreadableError as error:
        raise DumpError(str(error)) from None
    except (ValueError, KeyError, TypeError, RecursionError):
        raise DumpError(f"{record}: time_step_s: missing. Not the record of a run") from None
    if isinstance(step, bool) or not isinstance(step, int | float) or not 0 < step < math.inf:
        raise DumpError(f"{record}: time_step_s: {step!r}. A finite time above 0 s is needed")
    return float(step)


def snapshot_of(ts: Timestep, path: str | Path = "", *, needs_velocity: bool = True) -> Snapshot:
    """Take the disks of the current frame, ids in increasing order.

    needs_velocity: whether a dump without vx, vy is refused; else they are 0

    Spins are 0 and drives None where the dump has none; the time is 0 where it is not known. Raises
    DumpError naming the step and the field."""
    data = ts.data
    if "radius" not in data or "mass" not in data or "id" not in data:
        raise DumpError(
            f"{path or 'this trajectory'}: no float64 columns id, x, y, radius, mass: open the "
            "dump with analysis.dumps.open_bodies(path) and give that universe"
        )
    state = state_of(data, path, needs_velocity)
    where = f"{path}, step {data['step']}"
    return snapshot_at(state, float(ts.time), where, joined_of(data))
