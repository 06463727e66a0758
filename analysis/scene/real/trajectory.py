"""Heads of a real crowd: trajectory files read by PedPy and checked row by row, and the positions and
velocities of one frame."""

import gzip
import itertools
import json
import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
import pedpy
from scipy.spatial import cKDTree

from analysis.support.foreign import Node, read_foreign
from analysis.support.reading import (
    LARGEST_WHOLE,
    NUMBER,
    UnreadableError,
    lines_of,
    open_file,
    read_text,
)
from nscd.arrays import Floats, Indices

Unit = Literal["m", "cm"]
# Files that are no rows of text.
BINARY = ("sqlite", "h5", "hdf5", "json")
# A file of Pathfinder has so many bytes at most, and one of Vadere so many frames, and more where
# it has many rows: its people are seen at steps, and PedPy fills the frames between them.
LARGEST_JSON = 1 << 30
MOST_FRAMES, FRAMES_OF_ROW = 1_000_000, 100
# Columns of whole numbers; a row of a table has at least so many numbers.
WHOLE = ("id", "frame", "pedID", "NO")
LEAST_NUMBERS = 3
# PedPy's loaders of .csv, by the columns that they need.
CSV_COLUMNS = {
    frozenset({"pedID", "time", "posX", "posY"}): pedpy.load_trajectory_from_crowdit,
    frozenset({"id", "t", "x", "y"}): pedpy.load_trajectory_from_pathfinder_csv,
    frozenset({"NO", "SIMSEC", "COORDCENTX", "COORDCENTY"}): pedpy.load_trajectory_from_viswalk,
}


class TrajectoryError(ValueError):
    """A trajectory file that cannot be used; the message names the file and what is wrong in it."""


def _check_rows(file: Path, end: str) -> int:
    """Count the rows of a text file. Raise TrajectoryError naming the first that is not as the one
    before all: as many cells, numbers in the same places, ids and frames whole. PedPy would take
    one cell for another."""
    rows = 0
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
                rows += 1
                broken = any(not _whole(cells[k]) for k in whole if k < len(cells))
                if numbers != like or broken:
                    raise TrajectoryError(
                        f"{file}, line {number}: {text[:60]!r} is not a row as the first one, with "
                        f"{len(like)} cells, ids and frames whole numbers"
                    )
    return rows


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
        rows = _check_rows(file, end) if end not in BINARY else None
        # numpy's complaints of numbers that are none; the error that follows says more
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            found = _loader(file, end, unit, frame_rate)()
        return _checked(file, found, rows if end != "traj" else None)
    except TrajectoryError:
        raise
    except UnreadableError as error:
        raise TrajectoryError(str(error)) from None
    except Exception as error:  # PedPy lets the errors of pandas, h5py, sqlite3 and json through
        raise TrajectoryError(f"{file}: PedPy cannot read it: {first_line(error)}") from None


def _checked(file: Path, found: pedpy.TrajectoryData, rows: int | None) -> pedpy.TrajectoryData:
    """A trajectory with ids and frames that are whole numbers, and with all rows of its file."""
    if rows is not None and len(found.data) != rows:
        raise TrajectoryError(
            f"{file}: PedPy takes {len(found.data)} of its {rows} rows; is a number missing, or not "
            "written as 1.5?"
        )
    for name in ("id", "frame"):
        values = found.data[name].to_numpy(dtype=np.float64)
        bad = ~(np.abs(values) < LARGEST_WHOLE) | (values % 1 != 0)
        if bad.any():
            raise TrajectoryError(
                f"{file}: row {np.argmax(bad) + 1}: {name}: {values[np.argmax(bad)]:g}; a whole "
                f"number below {LARGEST_WHOLE} is needed"
            )
    return found


def _loader(
    file: Path, end: str, unit: Unit | None, frame_rate: float | None
) -> Callable[[], pedpy.TrajectoryData]:
    """Which of PedPy's loaders reads the file: by its ending, and a .csv by the names of its
    columns."""
    columns = _columns(file) if end == "csv" else set()
    if columns >= {"id", "frame", "x", "y"}:
        return lambda: _table(file, unit, frame_rate)
    if end == "traj":
        return lambda: _vadere(file, frame_rate)
    in_metres = IN_METRES.get(end)
    if end == "csv":
        known = (names for names in CSV_COLUMNS if columns >= names)
        loader = CSV_COLUMNS.get(next(known, frozenset()))
        if loader is None:
            needed = " or ".join(", ".join(sorted(names)) for names in CSV_COLUMNS)
            raise TrajectoryError(
                f"{file}: its first lines have no columns that are known: id, frame, x, y or "
                f"{needed}"
            )
        in_metres = partial(_by_pedpy, loader)
    if in_metres is None:
        return lambda: _text(file, unit, frame_rate)
    if unit == "cm":
        raise TrajectoryError(f"{file}: --unit cm: files of this format are in metres")
    return partial(in_metres, file)


def _by_pedpy(loader: Callable[..., pedpy.TrajectoryData], file: Path) -> pedpy.TrajectoryData:
    return loader(trajectory_file=file)


def _jupedsim(file: Path) -> pedpy.TrajectoryData:
    """An SQLite file of JuPedSim."""
    found = read_foreign(file, "sqlite", ["trajectory_data", "metadata"]).below
    if missing := {"trajectory_data", "metadata"} - found.keys():
        raise TrajectoryError(f"{file}: no table {' and '.join(sorted(missing))}")
    said = dict(zip(found["metadata"].texts("key"), found["metadata"].texts("value"), strict=True))
    columns = {"id": "id", "frame": "frame", "x": "pos_x", "y": "pos_y"}
    data = {name: found["trajectory_data"].below[key].values for name, key in columns.items()}
    return pedpy.TrajectoryData(data=pd.DataFrame(data), frame_rate=_fps(file, said.get("fps")))


def _archive(file: Path) -> pedpy.TrajectoryData:
    """An HDF5 file of the Pedestrian Dynamics Data Archive."""
    found = read_foreign(file, "hdf5", ["trajectory"]).below.get("trajectory", Node())
    names = ("id", "frame", "x", "y")
    values = found.values
    if values is None or values.ndim != 1 or not set(names) <= set(values.dtype.names or ()):
        raise TrajectoryError(f"{file}: no table /trajectory with {', '.join(names)}")
    if odd := [name for name in names if values.dtype[name].kind not in "iuf"]:
        raise TrajectoryError(f"{file}: /trajectory: {odd[0]}: numbers are needed")
    data = {name: values[name].astype(np.float64 if name in "xy" else None) for name in names}
    return pedpy.TrajectoryData(
        data=pd.DataFrame(data), frame_rate=_fps(file, found.attributes.get("fps"))
    )


def _fps(file: Path, said: object) -> float:
    """The frame rate (1/s) that a file states."""
    if said is None or not NUMBER.fullmatch(str(said)):
        raise TrajectoryError(f"{file}: fps: {str(said)[:40]}; a number is needed")
    return float(str(said))


def _pathfinder_json(file: Path) -> pedpy.TrajectoryData:
    """A JSON file of Pathfinder: person → time → position, all of which PedPy must take."""
    content = json.loads(read_text(file, LARGEST_JSON), object_pairs_hook=_once)
    found = pedpy.load_trajectory_from_pathfinder_json(trajectory_file=file)
    return _checked(file, found, sum(len(person) for person in content.values()))


def _once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """An object of JSON, each key once."""
    made = dict(pairs)
    if len(made) < len(pairs):
        raise ValueError(f"a key occurs twice among {', '.join(key for key, _ in pairs)[:60]}")
    return made


def _vadere(file: Path, frame_rate: float | None) -> pedpy.TrajectoryData:
    """A file of Vadere: steps of people, between which PedPy fills the frames."""
    if frame_rate is None:
        raise _unstated(file, False, True)
    table = pd.read_csv(file, sep=" ", comment="#", encoding="utf-8-sig")
    who, when = (next(name for name in table if key in name) for key in ("edestrianId", "simTime"))
    seen = table.groupby(who)[when].agg(["min", "max"])
    frames = float((seen["max"] - seen["min"]).sum()) * frame_rate
    if not frames <= MOST_FRAMES + FRAMES_OF_ROW * len(table):
        raise TrajectoryError(
            f"{file}: {frames:.3g} frames of {len(table)} rows at {frame_rate:g} frames per "
            "second; is the frame rate right?"
        )
    return pedpy.load_trajectory_from_vadere(trajectory_file=file, frame_rate=frame_rate)


# Readers of files that are always in metres, by ending.
IN_METRES: dict[str, Callable[[Path], pedpy.TrajectoryData]] = {
    "sqlite": _jupedsim,
    "h5": _archive,
    "hdf5": _archive,
    "json": _pathfinder_json,
    "pp": partial(_by_pedpy, pedpy.load_trajectory_from_viswalk),
    "fzp": partial(_by_pedpy, pedpy.load_trajectory_from_viswalk),
}


def _columns(file: Path) -> set[str]:
    """All words between separators in the first lines: the names of the columns are among them."""
    opened = gzip.open if file.suffix == ".gz" else open
    with opened(file, "rt", encoding="utf-8", errors="replace") as lines:
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
        no_unit = str(error).startswith("Unit is needed")
        if not no_unit and not str(error).startswith("Frame rate is needed"):
            raise
        no_rate = not no_unit or (frame_rate is None and "framerate:" not in _columns(file))
        raise _unstated(file, no_unit, no_rate) from None


def _unstated(file: Path, *lacks: bool) -> TrajectoryError:
    """What a file does not state of unit and frame rate, and the options that say it."""
    every = (("unit", "--unit m or --unit cm"), ("frame rate", "--frame-rate"))
    words, ways = zip(*itertools.compress(every, lacks), strict=True)
    return TrajectoryError(f"{file}: states no {' and no '.join(words)}; give {' and '.join(ways)}")


def _table(file: Path, unit: Unit | None, frame_rate: float | None) -> pedpy.TrajectoryData:
    """A table with the columns that PedPy's own data have; the frame rate follows from a column
    `time` (s)."""
    data = pd.read_csv(file, sep=None, engine="python")
    lacks = unit is None, frame_rate is None and "time" not in data
    if any(lacks):
        raise _unstated(file, *lacks)
    if frame_rate is None:
        moving = data.groupby("id")[["frame", "time"]].diff().dropna()
        frame_rate = float(np.round((moving.frame / moving.time).median(), 6))
    place = data[["x", "y"]].astype(float) * (0.01 if unit == "cm" else 1.0)
    return pedpy.TrajectoryData(
        data=data[["id", "frame"]].astype("int64").join(place), frame_rate=frame_rate
    )


def first_line(error: Exception) -> str:
    """Take the first line of what an error says."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0]


# Coordinates of cities have seven digits.
FARTHEST_M = 1e9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Heads:
    """Hold the heads in one frame of a file, ordered by id."""

    file: Path  # where they come from
    frame: int  # where they come from
    window_s: float  # s, over which velocities were measured
    ids: Indices  # (n,)
    position: Floats  # (n,2) m
    velocity: Floats  # (n,2) m/s, NaN for those who were not seen long enough to have one

    @property
    def origin(self) -> str:
        """File and frame in words, for messages."""
        return f"{self.file}: frame {self.frame}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """Hold the heads of a whole file."""

    file: Path
    data: pd.DataFrame  # id, frame, x (m), y (m)
    frame_rate: float  # 1/s

    @classmethod
    def read(
        cls, file: Path, *, unit: Unit | None = None, frame_rate: float | None = None
    ) -> "Recording":
        """Read a file.

        unit, frame_rate (1/s): needed only where the file does not state them

        Raises TrajectoryError naming the file, for one that PedPy cannot read or that has nobody
        in it, a missing unit or frame rate."""
        found = load(file, unit, frame_rate)
        if not 0 < found.frame_rate < np.inf:
            raise TrajectoryError(
                f"{file}: {found.frame_rate:g} frames per second; its times must grow with frames"
            )
        if not len(found.data):
            raise TrajectoryError(f"{file}: no frame with anybody in it")
        return cls(file=file, data=found.data, frame_rate=found.frame_rate)

    @property
    def ends(self) -> tuple[int, int]:
        """The first and the last frame."""
        return int(self.data.frame.min()), int(self.data.frame.max())

    def still(self, frame: int) -> Heads:
        """Take the heads of a frame as `heads`, with no velocities but zeros."""
        now = _near(self.file, self.data, frame, 0)
        ids, position = now.id.to_numpy(dtype=np.int64), now[["x", "y"]].to_numpy(dtype=np.float64)
        _check_places(f"{self.file}: frame {frame}", ids, position)
        return Heads(
            file=self.file,
            frame=frame,
            window_s=1.0 / self.frame_rate,
            ids=ids,
            position=position,
            velocity=np.zeros_like(position),
        )

    def heads(self, frame: int, window_s: float = 0.4) -> Heads:
        """Take the heads of frame number `frame`.

        window_s: s; velocities are displacements over it, round the frame (over half of it for
            people who appear or vanish there)

        Raises TrajectoryError naming the file and the frame, for a missing frame, a position that
        is not a number, a person who occurs twice and two people at the same place."""
        file, half = self.file, 0.5 * window_s * self.frame_rate
        if not 0.5 < half < len(self.data):
            raise TrajectoryError(
                f"{file}: a window of {window_s:g} s is {2 * half:.3g} frames at "
                f"{self.frame_rate:g} frames per second; at least 2, and no more than there are, "
                "are needed"
            )
        step = round(half)
        near = _near(file, self.data, frame, step)
        now = near[near.frame == frame]
        ids, position = now.id.to_numpy(dtype=np.int64), now[["x", "y"]].to_numpy(dtype=np.float64)
        _check_places(f"{file}: frame {frame}", ids, position)
        try:
            moving = pedpy.compute_individual_speed(
                traj_data=pedpy.TrajectoryData(
                    data=near[["id", "frame", "x", "y"]], frame_rate=self.frame_rate
                ),
                frame_step=step,
                compute_velocity=True,
                speed_calculation=pedpy.SpeedCalculation.BORDER_SINGLE_SIDED,
            )
        except (pedpy.errors.PedPyError, ValueError, KeyError) as error:
            raise TrajectoryError(
                f"{file}: frame {frame}: no velocities over {window_s:g} s: {first_line(error)}"
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


def read_heads(
    file: Path,
    frame: int,
    *,
    unit: Unit | None = None,
    frame_rate: float | None = None,
    window_s: float = 0.4,
) -> Heads:
    """Read the heads of one frame of a file: see `Recording.read` and `Recording.heads`."""
    return Recording.read(file, unit=unit, frame_rate=frame_rate).heads(frame, window_s)


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
        twin = next(one for one in other[row] if one != row)
        raise TrajectoryError(f"{origin}: persons {ids[row]} and {ids[twin]} are at the same place")
    # Heads of different people are never so near, and a crowd is never so far apart: it is the
    # unit.
    typical = float(np.median(nearest))
    if not 0.05 < typical < 10:
        raise TrajectoryError(
            f"{origin}: neighbours are {typical:.3g} m apart in the median; is the unit right "
            "(m, cm)?"
        )
