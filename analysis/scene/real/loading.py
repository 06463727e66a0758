"""Files of trajectories, read by PedPy and checked row by row."""

import gzip
import itertools
import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
import pedpy

from analysis.support.reading import LARGEST_WHOLE, NUMBER, UnreadableError, lines_of, open_file

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
                if cells and all(numbers) and len(cells) < LEAST_NUMBERS:
                    raise TrajectoryError(
                        f"{file}, line {number}: {text[:60]!r} has too few cells for a row"
                    )
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


def load(file: Path, unit: Unit | None, frame_rate: float | None) -> pedpy.TrajectoryData:
    """Read a file of any format that PedPy knows.

    unit, frame_rate (1/s): needed only where the file does not state them

    Raises TrajectoryError naming the file and what is wrong in it."""
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
        raise TrajectoryError(f"{file}: PedPy cannot read it: {first_line(error)}") from None


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


def first_line(error: Exception) -> str:
    """Take the first line of what an error says."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0]
