"""Heads of a real crowd: positions and velocities of one frame of a trajectory file, by PedPy."""

import gzip
import itertools
import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
import pedpy
from scipy.spatial import cKDTree

from analysis.support.reading import LARGEST_WHOLE, NUMBER, UnreadableError, lines_of, open_file
from nscd.arrays import Floats, Indices

Unit = Literal["m", "cm"]
# PedPy's loaders of files that are always in metres, by ending and, for .csv, by the columns that
# they need.
IN_METRES = {
    "sqlite": pedpy.load_trajectory_from_jupedsim_sqlite,
    "h5": pedpy.load_trajectory_from_ped_data_archive_hdf5,
    "hdf5": pedpy.load_trajectory_from_ped_data_archive_hdf5,
    "json": pedpy.load_trajectory_from_pathfinder_json,
    "pp": pedpy.load_trajectory_from_viswalk,
    "fzp": pedpy.load_trajectory_from_viswalk,
}
# Coordinates of cities have seven digits.
FARTHEST_M = 1e9
# Files that are no rows of text.
BINARY = ("sqlite", "h5", "hdf5", "json")
# Columns of whole numbers; a row of a table has at least so many numbers.
WHOLE = ("id", "frame", "pedID", "NO")
LEAST_NUMBERS = 3
CSV_COLUMNS = {
    frozenset({"pedID", "time", "posX", "posY"}): pedpy.load_trajectory_from_crowdit,
    frozenset({"id", "t", "x", "y"}): pedpy.load_trajectory_from_pathfinder_csv,
    frozenset({"NO", "SIMSEC", "COORDCENTX", "COORDCENTY"}): pedpy.load_trajectory_from_viswalk,
}


class TrajectoryError(ValueError):
    """A trajectory file that cannot be used; the message names the file and what is wrong in it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Heads:
    """Hold the heads in one frame of a file, ordered by id.

    file, frame: where they come from
    window_s: s, over which velocities were measured
    ids: (n,)
    position: (n,2) m
    velocity: (n,2) m/s, NaN for those who were not seen long enough to have one
    """

    file: Path
    frame: int
    window_s: float
    ids: Indices
    position: Floats
    velocity: Floats

    @property
    def origin(self) -> str:
        """File and frame in words, for messages."""
        return f"{self.file}: frame {self.frame}"


def read_heads(
    file: Path,
    frame: int,
    *,
    unit: Unit | None = None,
    frame_rate: float | None = None,
    window_s: float = 0.4,
) -> Heads:
    """Read the heads of frame number `frame`.

    unit, frame_rate (1/s): needed only where the file does not state them
    window_s: s; velocities are displacements over it, round the frame (over half of it for people
        who appear or vanish there)

    Raises TrajectoryError naming the file, and the frame where it matters, for a file that PedPy
    cannot read, a missing unit or frame rate, a missing frame, a position that is not a number, a
    person who occurs twice and two people at the same place."""
    trajectory = _load(file, unit, frame_rate)
    rate, half = trajectory.frame_rate, 0.5 * window_s * trajectory.frame_rate
    if not 0 < rate < np.inf:
        raise TrajectoryError(
            f"{file}: {rate:g} frames per second; its times must grow with frames"
        )
    if not 0.5 < half < len(trajectory.data):
        raise TrajectoryError(
            f"{file}: a window of {window_s:g} s is {2 * half:.3g} frames at {rate:g} frames per "
            f"second; at least 2, and no more than there are, are needed"
        )
    step = round(half)
    near = _near(file, trajectory.data, frame, step)
    now = near[near.frame == frame]
    ids, position = now.id.to_numpy(dtype=np.int64), now[["x", "y"]].to_numpy(dtype=np.float64)
    _check_places(f"{file}: frame {frame}", ids, position)
    try:
        moving = pedpy.compute_individual_speed(
            traj_data=pedpy.TrajectoryData(
                data=near[["id", "frame", "x", "y"]], frame_rate=trajectory.frame_rate
            ),
            frame_step=step,
            compute_velocity=True,
            speed_calculation=pedpy.SpeedCalculation.BORDER_SINGLE_SIDED,
        )
    except (pedpy.errors.PedPyError, ValueError, KeyError) as error:
        raise TrajectoryError(
            f"{file}: frame {frame}: no velocities over {window_s:g} s: {_first_line(error)}"
        ) from None
    found = moving[moving.frame == frame].set_index("id")[["v_x", "v_y"]]
    return Heads(
        file=file,
        frame=frame,
        window_s=window_s,
        ids=ids,
        position=position,
        velocity=found.reindex(ids).to_numpy(dtype=np.float64),
    )


def _near(file: Path, every: pd.DataFrame, frame: int, step: int) -> pd.DataFrame:
    """The rows up to `step` frames from the frame, by person and frame, each position a number and
    each person once."""
    near = every[(every.frame >= frame - step) & (every.frame <= frame + step)].sort_values(
        ["id", "frame"]
    )
    if not (near.frame == frame).any():
        first, last = every.frame.min(), every.frame.max()
        raise TrajectoryError(
            f"{file}: there is no frame {frame}; the frames go from {first} to {last}"
        )
    bad = near[~(near[["x", "y"]].abs() <= FARTHEST_M).all(axis=1)]
    if len(bad):
        person = bad.id.iloc[0]
        raise TrajectoryError(
            f"{file}: frame {bad.frame.iloc[0]}: the position of person {person} is no "
            f"number of metres up to {FARTHEST_M:g}"
        )
    twice = near[near.duplicated(["id", "frame"])]
    if len(twice):
        raise TrajectoryError(
            f"{file}: frame {twice.frame.iloc[0]}: person {twice.id.iloc[0]} occurs twice"
        )
    return near


def _check_places(origin: str, ids: Indices, position: Floats) -> None:
    if len(ids) < 2:
        return
    distance, other = cKDTree(position).query(position, k=2)
    nearest = distance[:, 1]
    if nearest.min() == 0:
        row = int(np.argmin(nearest))
        raise TrajectoryError(
            f"{origin}: persons {ids[row]} and {ids[other[row, 1]]} are at the same place"
        )
    # Heads of different people are never so near, and a crowd is never so far apart: it is the
    # unit.
    typical = float(np.median(nearest))
    if not 0.05 < typical < 10:
        raise TrajectoryError(
            f"{origin}: neighbours are {typical:.3g} m apart in the median; is the unit right "
            "(m, cm)?"
        )


def _check_rows(file: Path, end: str) -> None:
    """Raise TrajectoryError naming the first row of a text file that is not as the first one: as
    many cells, numbers in the same places, ids and frames whole. PedPy would take one cell for
    another."""
    whole: list[int] = []
    like: list[bool] = []
    with open_file(file) as content:
        for number, line in enumerate(lines_of(content, file), start=1):
            text = line.decode("utf-8", "replace").strip()
            mark = next((mark for mark in ";," if mark in text), None)
            cells = [cell.strip() for cell in text.split(mark)]
            numbers = [bool(NUMBER.fullmatch(cell)) for cell in cells]
            if not like:
                names = [cell.rpartition(":")[2] for cell in cells]
                whole = [k for k, name in enumerate(names) if name in WHOLE] or whole
                if text.startswith("#") or sum(numbers) < LEAST_NUMBERS:
                    continue
                like = numbers
                if end == "txt":
                    whole = [0, 1]
            if text and text[0] not in "#$*":
                broken = any(not _whole(cells[k]) for k in whole if k < len(cells))
                if numbers != like or broken:
                    raise TrajectoryError(
                        f"{file}, line {number}: {text[:60]!r} is not a row as the first one, with "
                        f"{len(like)} cells, ids and frames whole numbers"
                    )


def _whole(cell: str) -> bool:
    number = float(cell) if NUMBER.fullmatch(cell) else 0.5
    return number.is_integer() and abs(number) < LARGEST_WHOLE


def _load(file: Path, unit: Unit | None, frame_rate: float | None) -> pedpy.TrajectoryData:
    if not file.is_file():
        missing = "not a regular file" if file.exists() else "no such file"
        raise TrajectoryError(f"{file}: {missing}")
    end = file.name.lower().removesuffix(".gz").rpartition(".")[2]
    try:
        if end not in BINARY:
            _check_rows(file, end)
        # numpy's complaints of numbers that are none; the error that follows says more
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            return _loader(file, end, unit, frame_rate)()
    except TrajectoryError:
        raise
    except UnreadableError as error:
        raise TrajectoryError(str(error)) from None
    except Exception as error:  # PedPy lets the errors of pandas, h5py, sqlite3 and json through
        raise TrajectoryError(f"{file}: PedPy cannot read it: {_first_line(error)}") from None


def _loader(
    file: Path, end: str, unit: Unit | None, frame_rate: float | None
) -> Callable[[], pedpy.TrajectoryData]:
    """Which of PedPy's loaders reads the file: by its ending, and a .csv by the names of its
    columns."""
    columns = _columns(file) if end == "csv" else set()
    if columns >= {"id", "frame", "x", "y"}:
        return lambda: _table(file, unit, frame_rate)
    if end == "traj":
        if frame_rate is None:
            raise TrajectoryError(
                f"{file}: Vadere's files state no frame rate; give one (--frame-rate)"
            )
        return lambda: pedpy.load_trajectory_from_vadere(
            trajectory_file=file, frame_rate=frame_rate
        )
    in_metres = IN_METRES.get(end)
    if end == "csv":
        known = (names for names in CSV_COLUMNS if columns >= names)
        in_metres = CSV_COLUMNS.get(next(known, frozenset()))
        if in_metres is None:
            needed = " or ".join(", ".join(sorted(names)) for names in CSV_COLUMNS)
            raise TrajectoryError(
                f"{file}: its first lines have no columns that are known: id, frame, x, y or "
                f"{needed}"
            )
    if in_metres is None:
        return lambda: _text(file, unit, frame_rate)
    if unit == "cm":
        raise TrajectoryError(f"{file}: --unit cm: files of this format are in metres")
    return lambda: in_metres(trajectory_file=file)


def _columns(file: Path) -> set[str]:
    """All words between separators in the first lines: the names of the columns are among them."""
    with gzip.open(file, "rt") if file.suffix == ".gz" else file.open() as lines:
        top = "".join(itertools.islice(lines, 100))
    return set(re.split(r"[,;\s]+", top.removeprefix("\ufeff").replace("$PEDESTRIAN:", "")))


def _text(file: Path, unit: Unit | None, frame_rate: float | None) -> pedpy.TrajectoryData:
    known = {"m": pedpy.TrajectoryUnit.METER, "cm": pedpy.TrajectoryUnit.CENTIMETER}
    try:
        return pedpy.load_trajectory(
            trajectory_file=file,
            default_unit=known[unit] if unit else None,
            default_frame_rate=frame_rate,
        )
    except (pedpy.errors.PedPyError, ValueError) as error:
        message = str(error)
        if message.startswith("Unit is needed"):
            raise TrajectoryError(
                f"{file}: states no unit; give one (--unit m or --unit cm)"
            ) from None
        if message.startswith("Frame rate is needed"):
            raise TrajectoryError(
                f"{file}: states no frame rate; give one (--frame-rate)"
            ) from None
        raise


def _table(file: Path, unit: Unit | None, frame_rate: float | None) -> pedpy.TrajectoryData:
    """A table with the columns that PedPy's own data have; the frame rate follows from a column
    `time` (s)."""
    data = pd.read_csv(file, sep=None, engine="python")
    if unit is None:
        raise TrajectoryError(f"{file}: states no unit; give one (--unit m or --unit cm)")
    if frame_rate is None:
        if "time" not in data:
            raise TrajectoryError(f"{file}: no column time; give a frame rate (--frame-rate)")
        moving = data.groupby("id")[["frame", "time"]].diff().dropna()
        frame_rate = float(np.round((moving.frame / moving.time).median(), 6))
    scale = 0.01 if unit == "cm" else 1.0
    place = data[["x", "y"]].astype(float) * scale
    return pedpy.TrajectoryData(
        data=data[["id", "frame"]].astype("int64").join(place), frame_rate=frame_rate
    )


def _first_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0]
