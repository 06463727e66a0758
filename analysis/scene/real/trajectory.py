"""Heads of a real crowd: trajectory files of each known format (`load` picks the reader), read and
checked row by row, and the positions and velocities of one frame."""

import csv
import itertools
import json
import re
import warnings
from array import array
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd
import pedpy
from scipy.spatial import cKDTree

from analysis.scene.real.plausible import STOREYS, TAKE_AS_IS, Look, doubt, heights, look_at
from analysis.scene.real.times import framed, in_seconds
from analysis.support import reading
from analysis.support.foreign import Node, read_foreign
from nscd.arrays import Floats, Indices

Unit = Literal["m", "cm"]
TimeUnit = Literal["s", "ms"]
# A file of Pathfinder has so many bytes at most, and one of Vadere so many frames, and more where
# it has many rows: its people are seen at steps, and PedPy fills the frames between them.
LARGEST_JSON = 1 << 30
MOST_FRAMES, FRAMES_OF_ROW = 1_000_000, 100
# A row of a table has at least so many numbers, and its columns are named where one is an id.
LEAST_NUMBERS = 3
ID = re.compile(r"id|pedID|NO|\w*edestrianId\S*")
# Tables of text with named columns, by ending; all other text is id, frame, x, y.
NAMED = ("csv", "pp", "fzp", "traj")
PLAIN = ("id", "frame", "x", "y")
# Names of heights (m), which only tell storeys apart.
HEIGHTS = ("z", "posZ", "COORDCENTZ")
# Columns for id, time (s), x and y (m), as the programs name them that write tables in metres:
# Crowdit, Pathfinder, Viswalk.
TIMED = (
    ("pedID", "time", "posX", "posY"),
    ("id", "t", "x", "y"),
    ("NO", "SIMSEC", "COORDCENTX", "COORDCENTY"),
)
# id, frame, x (m), y (m) of all rows, time (s) where the file has times, and the frame rate (1/s).
Loaded = tuple[pd.DataFrame, float]
# A frame rate that is given beside times may differ by this share from theirs.
SAME_RATE = 0.01


class TrajectoryError(ValueError):
    """A trajectory file that cannot be used; the message names the file and what is wrong in it."""


# A unit in a comment: "x/m", "in cm", "in metres"; no "in Mannheim".
UNIT = re.compile(r"(?:x/|\bin )(cm|m)(?:et(?:er|re)s?)?\b")


@dataclass(frozen=True, slots=True)
class _Given:
    """A file, and what is said of it; unit and frame rate (1/s) where it may not state them."""

    file: Path
    unit: Unit | None
    frame_rate: float | None
    time_unit: TimeUnit = "s"
    take_as_is: bool = False

    def refuse(self, why: str) -> TrajectoryError:
        return TrajectoryError(f"{self.file}: {why}")

    def loaded(self, columns: object, unit: Unit | None, frame_rate: float | None) -> Loaded:
        """The data in metres, of columns in this unit; frame numbers and rate from their times,
        where there are some."""
        data = pd.DataFrame(columns)
        timed = "time" in data
        if timed:
            data, frame_rate = self._on_clock(data)
        elif self.time_unit != "s":
            raise self.refuse(f"--time-unit {self.time_unit}: its rows have frames, no times")
        unit, frame_rate = self.stated(unit, frame_rate, timed=timed)
        axes = {*"xyz"} & {*data}
        data = data.assign(**{axis: data[axis] / (100 if unit == "cm" else 1) for axis in axes})
        if "z" in data and (said := heights(data)):
            if said.startswith(STOREYS) and not self.take_as_is:
                raise self.refuse(f"{said}. Give one storey, or {TAKE_AS_IS}")
            reading.note(self.file, f"z is not used: {said}")
        return data.drop(columns="z", errors="ignore"), frame_rate

    def _on_clock(self, data: pd.DataFrame) -> tuple[pd.DataFrame, float | None]:
        """The data with times in s and the numbers of frames, and the frame rate."""
        try:
            time = in_seconds(data["time"], self.time_unit == "ms", self.file)
            data = data.assign(time=time)
            data = data if "frame" in data else framed(data, self.file)
        except ValueError as error:
            raise self.refuse(str(error)) from None
        ends = data.groupby("frame").time.agg(["min", "max"])
        if (odd := ends["max"] > ends["min"]).any():
            low, high = ends[odd].iloc[0]
            raise self.refuse(f"frame {ends[odd].index[0]:g}: two times, {low:g} and {high:g} s")
        times, numbers = ends["min"].to_numpy(), ends.index.to_numpy()
        if (np.diff(times) <= 0).any():
            back = int(np.argmin(np.diff(times) > 0))
            raise self.refuse(f"time does not grow from frame {numbers[back]:g} to the next")
        if len(times) < 2:
            return data, None
        return data, round(float(np.ptp(numbers) / np.ptp(times)), 6)

    def stated(
        self, unit: Unit | None, frame_rate: float | None, *, timed: bool = False
    ) -> tuple[Unit, float]:
        """Unit and frame rate that the file states, by its times where it is timed, or that are
        given beside it."""
        if unit is not None and self.unit not in (None, unit):
            raise self.refuse(f"--unit {self.unit}: the file states {unit}")
        own, given = frame_rate or 0.0, self.frame_rate or frame_rate or 0.0
        if frame_rate and abs(given - own) > SAME_RATE * own * timed:
            says = f"has times {1 / own:.4g} s apart, which is" if timed else "states"
            raise self.refuse(f"--frame-rate {given:g}: the file {says} {own:g} per second")
        unit, frame_rate = unit or self.unit, frame_rate or self.frame_rate
        if unit and frame_rate:
            return unit, frame_rate
        every = (("unit", "--unit m or --unit cm"), ("frame rate", "--frame-rate"))
        lacks = itertools.compress(every, (not unit, not frame_rate))
        words, ways = zip(*lacks, strict=True)
        raise self.refuse(f"states no {' and no '.join(words)}. Give {' and '.join(ways)}")


def _read_rows(file: Path, named: bool) -> tuple[list[str], pd.DataFrame]:
    """The lines before the first row of a text file, and all rows by their lines, the columns named
    by the last of these lines that has the name of an id, or numbered.

    Raises TrajectoryError naming the first row that is not as the one before all: as many cells,
    numbers in the same places."""
    head: list[str] = []
    like: list[bool] = []
    values, lines = array("d"), array("q")
    with reading.open_file(file) as content:
        for number, line in enumerate(reading.lines_of(content, file), start=1):
            text = line.decode("utf-8", "replace").removeprefix("\ufeff").strip()
            cells = _cells(text)
            numbers = [bool(reading.NUMBER.fullmatch(cell)) for cell in cells]
            where = f"{file}, line {number}: {text[:60]!r}"
            if "\r" in text:
                raise TrajectoryError(f"{where} has a carriage return. Lines end in \\n or \\r\\n")
            if not like:
                if cells and all(numbers) and len(cells) < LEAST_NUMBERS:
                    raise TrajectoryError(f"{where} has too few cells for a row")
                if text.startswith("#") or sum(numbers) < LEAST_NUMBERS:
                    head.append(text)
                    continue
                like = numbers
            if text and text[0] not in "#$*":
                if numbers != like:
                    raise TrajectoryError(
                        f"{where} is not a row as the first one, with {len(like)} cells"
                    )
                values.extend(map(float, itertools.compress(cells, numbers)))
                lines.append(number)
    if not like:
        raise TrajectoryError(f"{file}: no row of numbers")
    names: list[Any] = [*range(len(like))]
    for text in head if named else ():
        cells = [cell.rpartition(":")[2] for cell in _cells(text)]
        if len(cells) == len(like) and any(map(ID.fullmatch, cells)):
            names = cells
    table = np.frombuffer(values).reshape(len(lines), sum(like))
    columns = pd.Index(list(itertools.compress(names, like)))
    return head, pd.DataFrame(table, index=pd.Index(lines, name="line"), columns=columns)


def _cells(text: str) -> list[str]:
    mark = next((mark for mark in ";," if mark in text), None)
    cells = next(csv.reader([text], delimiter=mark)) if mark and '"' in text else text.split(mark)
    return [cell.strip() for cell in cells]


def load(
    file: Path, unit: Unit | None, frame_rate: float | None, time_unit: TimeUnit, take_as_is: bool
) -> Loaded:
    """Read a file of any format that is known: id, frame, time (s), x, y (m) of all rows, and the
    frame rate.

    unit, frame_rate (1/s): needed only where the file does not state them
    time_unit: of its times, where it has some
    take_as_is: take people on several storeys as if on one

    Raises TrajectoryError naming the file and what is wrong in it."""
    if not file.is_file():
        missing = "not a regular file" if file.exists() else "no such file"
        raise TrajectoryError(f"{file}: {missing}")
    end = file.name.lower().removesuffix(".gz").rpartition(".")[2]
    given = _Given(file, unit, frame_rate, time_unit, take_as_is)
    try:
        # numpy's complaints of numbers that are none; the error that follows says more
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            if end in FOREIGN:
                data, rate = FOREIGN[end](given)
            else:
                head, table = _read_rows(file, end in NAMED)
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
        data = data.astype({"id": np.int64, "frame": np.int64})
        if not 0 < rate < np.inf:
            raise given.refuse(f"{rate:g} frames per second. Above 0 is needed")
        if not len(data):
            raise given.refuse("no frame with anybody in it")
        timed = "time" in data
        data = data if timed else data.assign(time=data.frame / rate)
        if not take_as_is and (why := doubt(data, timed=timed)):
            raise given.refuse(why)
        return data, rate
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
    names = [*PLAIN, "z"] if re.search(r"\bz\b", "\n".join(comments).lower()) else [*PLAIN]
    table = table.iloc[:, : len(names)].set_axis(names[: table.shape[1]], axis=1)
    return given.loaded(table, unit, next(iter(rates), None))


def _named(given: _Given, head: list[str], table: pd.DataFrame) -> Loaded:
    """A table with known names, as PedPy's own data have them or other programs."""
    if {*PLAIN} <= {*table}:
        return given.loaded(table[[*PLAIN, *({"time", "z"} & {*table})]], None, None)
    table = table.rename(columns=dict.fromkeys(HEIGHTS, "z"))
    for names in TIMED:
        if {*names} <= {*table}:
            columns = dict(zip(names, ("id", "time", "x", "y"), strict=True))
            rows = table[[*names, *({"z"} & {*table})]]
            return given.loaded(rows.rename(columns=columns), "m", None)
    needed = " or ".join(", ".join(sorted(names)) for names in TIMED)
    raise given.refuse(
        f"its first lines have no columns that are known: id, frame, x, y or {needed}"
    )


def _pathfinder_json(given: _Given) -> Loaded:
    # person → time → position
    content = json.loads(reading.read_text(given.file, LARGEST_JSON), object_pairs_hook=_once)
    rows = [
        (int(who), float(when), *(float(seen["position"].get(axis, "nan")) for axis in "xyz"))
        for who, person in content.items()
        for when, seen in person.items()
    ]
    return given.loaded(pd.DataFrame(sorted(rows), columns=["id", "time", *"xyz"]), "m", None)


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
    every = (found["trajectory_data"].below[name].values for name in names)
    columns = dict(zip(PLAIN, every, strict=True))
    data, rate = given.loaded(columns, "m", _fps(given, said.get("fps")))
    if not len(data):
        raise given.refuse("no rows: was the writer closed?")
    return data, rate


def _archive(given: _Given) -> Loaded:
    """An HDF5 file of the Pedestrian Dynamics Data Archive."""
    found = read_foreign(given.file, "hdf5", ["trajectory"]).below.get("trajectory", Node())
    values = found.values
    if values is None or values.ndim != 1 or not {*PLAIN} <= {*(values.dtype.names or ())}:
        raise given.refuse(f"no table /trajectory with {', '.join(PLAIN)}")
    if odd := [name for name in PLAIN if values.dtype[name].kind not in "iuf"]:
        raise given.refuse(f"/trajectory: {odd[0]}: numbers are needed")
    names = [*PLAIN, *({"z"} & {*(values.dtype.names or ())})]
    columns = {name: values[name].astype(np.float64 if name in "xyz" else None) for name in names}
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


# Velocities are over this time (s), or two frames where they are farther apart; and no row farther
# from the next than so many frames says where somebody was between.
WINDOW_S, APART = 0.4, 2.5
# Instants nearer than this share of a step are one.
EXACT = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """Hold the heads of a whole file."""

    file: Path
    data: pd.DataFrame  # id, frame, time (s), x (m), y (m)
    frame_rate: float  # 1/s, of frame numbers

    @classmethod
    def read(
        cls,
        file: Path,
        *,
        unit: Unit | None = None,
        frame_rate: float | None = None,
        time_unit: TimeUnit = "s",
        take_as_is: bool = False,
    ) -> "Recording":
        """Read a file.

        unit, frame_rate (1/s): needed only where the file does not state them
        time_unit: of its times, where it has some
        take_as_is: take speeds, distances and times that people do not have

        Raises TrajectoryError naming the file, for one that PedPy cannot read or that has nobody
        in it, a missing unit or frame rate, and one that cannot be of people (see `Look`)."""
        data, rate = load(file, unit, frame_rate, time_unit, take_as_is)
        return cls(file=file, data=data, frame_rate=rate)

    @property
    def look(self) -> Look:
        """How it looks."""
        return look_at(self.data)

    @property
    def numbers(self) -> Indices:
        """The numbers of the frames that are there, growing."""
        return np.unique(self.data.frame)

    @property
    def step_s(self) -> float:
        """The usual time (s) from one frame that is there to the next."""
        apart = np.diff(np.unique(self.data.time))
        return float(np.median(apart)) if len(apart) else 1.0 / self.frame_rate

    def time_of(self, frame: int) -> float:
        """The time (s) of a frame. Raises TrajectoryError naming the frames next to a missing one."""
        there = self.data.time[self.data.frame == frame]
        if len(there):
            return float(there.iloc[0])
        numbers = self.numbers
        said = f"The frames go from {numbers[0]} to {numbers[-1]}"
        if numbers[0] < frame < numbers[-1]:
            after = int(np.searchsorted(numbers, frame))
            said = f"The nearest are {numbers[after - 1]} and {numbers[after]}"
        raise TrajectoryError(f"{self.file}: there is no frame {frame}. {said}")

    def still(self, frame: int) -> Heads:
        """Take the heads of a frame as `heads`, with no velocities but zeros."""
        now = self._near(frame, 0.0)
        return self._heads(now, frame, 1.0 / self.frame_rate, np.zeros((len(now), 2)))

    def heads(self, frame: int, window_s: float | None = None) -> Heads:
        """Take the heads of frame number `frame`.

        window_s: s; velocities are displacements over it, round the frame (over half of it for
            people who appear or vanish there), between rows by interpolation; 0.4 s, or two frames
            if that is longer, where left out

        Raises TrajectoryError naming the file and the frame, for a missing frame, a position that
        is not a number, a person who occurs twice and two people at the same place."""
        step = self.step_s
        window = window_s or max(WINDOW_S, 2 * step)
        if not step * (1 - EXACT) <= window < 2 * step * max(len(self.data), 2):
            raise TrajectoryError(
                f"{self.file}: a window of {window:g} s is {window / step:.3g} frames at "
                f"{1 / step:g} frames per second. At least 1, and no more than there are, "
                "are needed"
            )
        most = max(window, APART * step)
        near, time = self._rows(frame, 0.5 * window + most), self.time_of(frame)
        now = self._near(frame, 0.5 * window)
        now = now[now.frame == frame]
        found = self._heads(now, frame, window, np.full((len(now), 2), np.nan))
        for row, (_, own) in enumerate(near[near.id.isin(now.id)].groupby("id")):
            when, place = own.time.to_numpy() - time, own[["x", "y"]].to_numpy()
            ends = [
                _place_at(when, place, end, most, EXACT * step) for end in (-window / 2, window / 2)
            ]
            both = [end for end in ends if end is not None]
            if both:
                span = window * len(both) / 2
                first, last = ends[0], ends[1]
                here = found.position[row]
                found.velocity[row] = (
                    (here if last is None else last) - (here if first is None else first)
                ) / span
        return found

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

    def _rows(self, frame: int, reach_s: float) -> pd.DataFrame:
        """The rows up to so many s from the frame, by person and time."""
        near = (self.data.time - self.time_of(frame)).abs() <= reach_s + 1e-6
        return self.data[near].sort_values(["id", "time"])

    def _near(self, frame: int, reach_s: float) -> pd.DataFrame:
        """As `_rows`, each position a number and each person once in a frame."""
        near = self._rows(frame, reach_s)
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
    window_s: float | None = None,
    time_unit: TimeUnit = "s",
    take_as_is: bool = False,
) -> Heads:
    """Read the heads of one frame of a file: see `Recording.read` and `Recording.heads`."""
    read = partial(Recording.read, time_unit=time_unit, take_as_is=take_as_is)
    return read(file, unit=unit, frame_rate=frame_rate).heads(frame, window_s)


def _place_at(time: Floats, place: Floats, when: float, most: float, same: float) -> Floats | None:
    """Where somebody was (2,) m, between two rows that are no more than `most` s apart; None for
    nowhere."""
    after = int(np.searchsorted(time, when - same))
    if after == len(time):
        return None
    if time[after] <= when + same:
        return np.asarray(place[after])
    if not after or time[after] - time[after - 1] > most:
        return None
    share = (when - time[after - 1]) / (time[after] - time[after - 1])
    return np.asarray(place[after - 1] + share * (place[after] - place[after - 1]))


def _check_places(origin: str, ids: Indices, position: Floats) -> None:
    if len(ids) < 2:
        return
    distance, other = cKDTree(position).query(position, k=2)
    nearest = distance[:, 1]
    if nearest.min() == 0:
        row = int(np.argmin(nearest))
        twin = next(one for one in other[row] if one != row)
        raise TrajectoryError(f"{origin}: persons {ids[row]} and {ids[twin]} are at the same place")
