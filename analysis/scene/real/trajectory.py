"""Heads of a real crowd: trajectory files of each known format (`load` picks the reader), read and
checked row by row, and the positions and velocities of one frame."""

import itertools
import json
import re
import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd
import pedpy
from scipy.spatial import cKDTree

from analysis.scene.real.tables import read_rows
from analysis.support import reading
from analysis.support.foreign import Node, read_foreign
from nscd.arrays import Floats, Indices

Unit = Literal["m", "cm"]
# A file of Pathfinder has so many bytes at most, and one of Vadere so many frames, and more where
# it has many rows: its people are seen at steps, and PedPy fills the frames between them.
LARGEST_JSON = 1 << 30
MOST_FRAMES, FRAMES_OF_ROW = 1_000_000, 100
# Tables of text with named columns, by ending; all other text is id, frame, x, y.
NAMED = ("csv", "pp", "fzp", "traj")
PLAIN = ("id", "frame", "x", "y")
# Columns for id, time (s), x and y (m), as the programs name them that write tables in metres:
# Crowdit, Pathfinder, Viswalk.
TIMED = (
    ("pedID", "time", "posX", "posY"),
    ("id", "t", "x", "y"),
    ("NO", "SIMSEC", "COORDCENTX", "COORDCENTY"),
)
# id, frame, x (m), y (m) of all rows, and the frame rate (1/s).
Loaded = tuple[pd.DataFrame, float]


class TrajectoryError(ValueError):
    """A trajectory file that cannot be used; the message names the file and what is wrong in it."""


# A unit in a comment: "x/m", "in cm", "in metres"; no "in Mannheim".
UNIT = re.compile(r"(?:x/|\bin )(cm|m)(?:et(?:er|re)s?)?\b")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Given:
    """A file, and what is said of it; unit and frame rate (1/s) where it may not state them."""

    file: Path
    unit: Unit | None
    frame_rate: float | None

    def refuse(self, why: str) -> TrajectoryError:
        return TrajectoryError(f"{self.file}: {why}")

    def loaded(self, columns: object, unit: Unit | None, frame_rate: float | None) -> Loaded:
        """The data in metres, of columns in this unit."""
        unit, frame_rate = self.stated(unit, frame_rate)
        data = pd.DataFrame(columns)
        places = {axis: data[axis] / (100 if unit == "cm" else 1) for axis in "xy"}
        return data.assign(**places), frame_rate

    def stated(self, unit: Unit | None, frame_rate: float | None) -> tuple[Unit, float]:
        """Unit and frame rate that the file states, or that are given beside it."""
        for said, given, option in (
            (unit, self.unit, "--unit"),
            (frame_rate, self.frame_rate, "--frame-rate"),
        ):
            if said is not None and given not in (None, said):
                raise self.refuse(f"{option} {given}: the file states {said}")
        unit, frame_rate = unit or self.unit, frame_rate or self.frame_rate
        if unit and frame_rate:
            return unit, frame_rate
        every = (("unit", "--unit m or --unit cm"), ("frame rate", "--frame-rate"))
        lacks = itertools.compress(every, (not unit, not frame_rate))
        words, ways = zip(*lacks, strict=True)
        raise self.refuse(f"states no {' and no '.join(words)}. Give {' and '.join(ways)}")


def load(file: Path, unit: Unit | None, frame_rate: float | None) -> Loaded:
    """Read a file of any format that is known: id, frame, x, y (m) of all rows, and the frame rate.

    unit, frame_rate (1/s): needed only where the file does not state them

    Raises TrajectoryError naming the file and what is wrong in it."""
    if not file.is_file():
        missing = "not a regular file" if file.exists() else "no such file"
        raise TrajectoryError(f"{file}: {missing}")
    end = file.name.lower().removesuffix(".gz").rpartition(".")[2]
    given = _Given(file=file, unit=unit, frame_rate=frame_rate)
    try:
        # numpy's complaints of numbers that are none; the error that follows says more
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            if end in FOREIGN:
                data, rate = FOREIGN[end](given)
            else:
                head, table = read_rows(file, end in NAMED)
                reader = _vadere if end == "traj" else _named if end in NAMED else _text
                data, rate = reader(given, head, table)
        for name in ("id", "frame"):
            whole = (np.abs(data[name]) < reading.LARGEST_WHOLE) & (data[name] % 1 == 0)
            if not whole.all():
                place = whole.idxmin()
                raise given.refuse(
                    f"{data.index.name or 'row'} {place}: {name}: {data[name][place]:g}. A whole "
                    f"number below {reading.LARGEST_WHOLE} is needed"
                )
        return data.astype({"id": np.int64, "frame": np.int64}), rate
    except TrajectoryError:
        raise
    except reading.UnreadableError as error:
        raise TrajectoryError(str(error)) from None
    except Exception as error:  # of pandas, numpy, json and PedPy
        raise given.refuse(f"it cannot be read: {first_line(error)}") from None


def _text(given: _Given, head: list[str], table: pd.DataFrame) -> Loaded:
    """Rows of id, frame, x, y; comments before them may state unit and frame rate."""
    comments = [*itertools.takewhile(lambda line: line.startswith("#"), head)]
    said = UNIT.findall("\n".join(comments).lower())
    unit: Unit | None = ("cm" if said[-1] == "cm" else "m") if said else None
    words = [word for line in comments if "framerate" in line for word in line.split()]
    rates = [float(word) for word in words if reading.NUMBER.fullmatch(word)]
    return given.loaded(table.iloc[:, :4].set_axis(PLAIN, axis=1), unit, next(iter(rates), None))


def _named(given: _Given, head: list[str], table: pd.DataFrame) -> Loaded:
    """A table with known names; with those of PedPy's own data, the frame rate follows from a column
    `time` (s)."""
    if {*PLAIN} <= {*table}:
        rate = given.frame_rate
        if rate is None and "time" in table:
            moving = table.groupby("id")[["frame", "time"]].diff().dropna()
            rate = float(np.round((moving.frame / moving.time).median(), 6))
        return given.loaded(table[[*PLAIN]], None, rate)
    for names in TIMED:
        if {*names} <= {*table}:
            return _timed(given, table[[*names]])
    needed = " or ".join(", ".join(sorted(names)) for names in TIMED)
    raise given.refuse(
        f"its first lines have no columns that are known: id, frame, x, y or {needed}"
    )


def _timed(given: _Given, rows: pd.DataFrame) -> Loaded:
    """Rows of id, time (s), x, y: frames follow from the mean time between two of a person."""
    data = rows.set_axis(["id", "time", "x", "y"], axis=1)
    step = data.groupby("id")["time"].diff().mean()
    if not step > 0:
        raise given.refuse("no frame rate: nobody is seen at two times that grow")
    rate = float(round(1 / step))
    return given.loaded(data.assign(frame=np.round(data["time"] * rate)), "m", rate)


def _pathfinder_json(given: _Given) -> Loaded:
    # person → time → position
    content = json.loads(reading.read_text(given.file, LARGEST_JSON), object_pairs_hook=_once)
    rows = [
        (int(who), float(when), *(float(seen["position"][axis]) for axis in "xy"))
        for who, person in content.items()
        for when, seen in person.items()
    ]
    return _timed(given, pd.DataFrame(sorted(rows)))


def _once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """An object of JSON, each key once."""
    made = dict(pairs)
    if len(made) < len(pairs):
        raise ValueError(f"a key occurs twice among {', '.join(key for key, _ in pairs)[:60]}")
    return made


def _jupedsim(given: _Given) -> Loaded:
    found = read_foreign(given.file, "sqlite", ["trajectory_data", "metadata"]).below
    if missing := {"trajectory_data", "metadata"} - found.keys():
        raise given.refuse(f"no table {' and '.join(sorted(missing))}")
    said = dict(zip(found["metadata"].texts("key"), found["metadata"].texts("value"), strict=True))
    names = ("id", "frame", "pos_x", "pos_y")
    columns = (found["trajectory_data"].below[name].values for name in names)
    return given.loaded(dict(zip(PLAIN, columns, strict=True)), "m", _fps(given, said.get("fps")))


def _archive(given: _Given) -> Loaded:
    """An HDF5 file of the Pedestrian Dynamics Data Archive."""
    found = read_foreign(given.file, "hdf5", ["trajectory"]).below.get("trajectory", Node())
    values = found.values
    if values is None or values.ndim != 1 or not {*PLAIN} <= {*(values.dtype.names or ())}:
        raise given.refuse(f"no table /trajectory with {', '.join(PLAIN)}")
    if odd := [name for name in PLAIN if values.dtype[name].kind not in "iuf"]:
        raise given.refuse(f"/trajectory: {odd[0]}: numbers are needed")
    columns = {name: values[name].astype(np.float64 if name in "xy" else None) for name in PLAIN}
    return given.loaded(columns, "m", _fps(given, found.attributes.get("fps")))


def _fps(given: _Given, said: object) -> float:
    if said is None or not reading.NUMBER.fullmatch(str(said)):
        raise given.refuse(f"fps: {str(said)[:40]}. A number is needed")
    return float(str(said))


def _vadere(given: _Given, head: list[str], table: pd.DataFrame) -> Loaded:
    """A file of Vadere: steps of people, between which PedPy fills the frames."""
    _, rate = given.stated("m", None)
    who, when = (next(name for name in table if key in name) for key in ("edestrianId", "simTime"))
    seen = table.groupby(who)[when].agg(["min", "max"])
    frames = float((seen["max"] - seen["min"]).sum()) * rate
    if not frames <= MOST_FRAMES + FRAMES_OF_ROW * len(table):
        raise given.refuse(
            f"{frames:.3g} frames of {len(table)} rows at {rate:g} frames per second. Is the frame "
            "rate right?"
        )
    found = pedpy.load_trajectory_from_vadere(trajectory_file=given.file, frame_rate=rate)
    return found.data[[*PLAIN]], found.frame_rate


# Readers of files that are no rows of text, by ending.
FOREIGN = {"sqlite": _jupedsim, "h5": _archive, "hdf5": _archive, "json": _pathfinder_json}


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
        data, rate = load(file, unit, frame_rate)
        if not 0 < rate < np.inf:
            raise TrajectoryError(
                f"{file}: {rate:g} frames per second. Its times must grow with frames"
            )
        if not len(data):
            raise TrajectoryError(f"{file}: no frame with anybody in it")
        return cls(file=file, data=data, frame_rate=rate)

    @property
    def ends(self) -> tuple[int, int]:
        """The first and the last frame."""
        return int(self.data.frame.min()), int(self.data.frame.max())

    def still(self, frame: int) -> Heads:
        """Take the heads of a frame as `heads`, with no velocities but zeros."""
        now = self._near(frame, 0)
        return self._heads(now, frame, 1.0 / self.frame_rate, np.zeros((len(now), 2)))

    def heads(self, frame: int, window_s: float = 0.4) -> Heads:
        """Take the heads of frame number `frame`.

        window_s: s; velocities are displacements over it, round the frame (over half of it for
            people who appear or vanish there)

        Raises TrajectoryError naming the file and the frame, for a missing frame, a position that
        is not a number, a person who occurs twice and two people at the same place."""
        half = 0.5 * window_s * self.frame_rate
        if not 0.5 < half < len(self.data):
            raise TrajectoryError(
                f"{self.file}: a window of {window_s:g} s is {2 * half:.3g} frames at "
                f"{self.frame_rate:g} frames per second. At least 2, and no more than there are, "
                "are needed"
            )
        near = self._near(frame, round(half))
        now = near[near.frame == frame]
        found = self._heads(now, frame, window_s, np.full((len(now), 2), np.nan))
        try:
            moving = pedpy.compute_individual_speed(
                traj_data=pedpy.TrajectoryData(data=near, frame_rate=self.frame_rate),
                frame_step=round(half),
                compute_velocity=True,
                speed_calculation=pedpy.SpeedCalculation.BORDER_SINGLE_SIDED,
            )
        except (pedpy.errors.PedPyError, ValueError, KeyError) as error:
            raise TrajectoryError(
                f"{found.origin}: no velocities over {window_s:g} s: {first_line(error)}"
            ) from None
        velocity = moving[moving.frame == frame].set_index("id")[["v_x", "v_y"]]
        return replace(found, velocity=velocity.reindex(found.ids).to_numpy(dtype=np.float64))

    def _heads(self, now: pd.DataFrame, frame: int, window_s: float, velocity: Floats) -> Heads:
        """The heads of the rows of a frame, at places where heads can be."""
        found = Heads(
            file=self.file,
            frame=frame,
            window_s=window_s,
            ids=now.id.to_numpy(dtype=np.int64),
            position=now[["x", "y"]].to_numpy(dtype=np.float64),
            velocity=velocity,
        )
        _check_places(found.origin, found.ids, found.position)
        return found

    def _near(self, frame: int, step: int) -> pd.DataFrame:
        """The rows up to `step` frames from the frame, by person and frame, each position a number
        and each person once."""
        frames = self.data.frame
        near = self.data[(frames >= frame - step) & (frames <= frame + step)]
        near = near[["id", "frame", "x", "y"]].sort_values(["id", "frame"])
        if not (near.frame == frame).any():
            first, last = self.ends
            raise TrajectoryError(
                f"{self.file}: there is no frame {frame}. The frames go from {first} to {last}"
            )
        far = ~(near[["x", "y"]].abs() <= FARTHEST_M).all(axis=1)
        for bad, what in (
            (far, f"the position of person {{}} is no number of metres up to {FARTHEST_M:g}"),
            (near.duplicated(["id", "frame"]), "person {} occurs twice"),
        ):
            if bad.any():
                row = near[bad].iloc[0]
                raise TrajectoryError(
                    f"{self.file}: frame {row.frame:.0f}: {what.format(int(row.id))}"
                )
        return near


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
            f"{origin}: neighbours are {typical:.3g} m apart in the median. Is the unit right "
            "(m, cm)?"
        )
