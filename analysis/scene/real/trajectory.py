"""Heads of a real crowd: trajectory files of each known format (`load` picks the reader), read and
checked row by row, and the positions and velocities of one frame."""

import itertools
import json
import re
import warnings
from array import array
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal
from xml.etree import ElementTree

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from analysis.scene.real import text_tables
from analysis.scene.real.plausible import (
    STOREYS,
    TAKE_AS_IS,
    Plausibility,
    doubt,
    heights,
    plausibility_of,
)
from analysis.scene.real.text_tables import PER_METRE, PLAIN, Table, numbered, seen_once
from analysis.scene.real.times import framed, in_seconds
from analysis.support import reading
from analysis.support.foreign import Node, read_foreign
from nscd.arrays import Floats, Indices

Unit = Literal["m", "cm"]
TimeUnit = Literal["s", "ms"]
# A file of Pathfinder has so many bytes at most, and one of Vadere so many frames, and more where
# it has many rows: its people are seen at steps, and the frames between them are filled.
LARGEST_JSON = 1 << 30
MOST_FRAMES, FRAMES_OF_ROW = 1_000_000, 100
# Tables of text whose columns must have names, by ending.
NAMED = ("csv", "pp", "fzp", "traj")
# Columns of the programs that write tables in metres: crowd:it, Pathfinder, Viswalk, Vadere, JuPedSim.
IN_METRES = (
    {"pedid", "time", "posx", "posy"},
    {"id", "t", "x", "y"},
    {"no", "simsec", "coordcentx", "coordcenty"},
    {"timestep", "pedestrianid", "x", "y"},
    {"id", "fr", "x", "y", "z", "a", "b", "angle", "color"},
)
# Columns of the BIWI walking pedestrians (obsmat.txt), which has no names: z is up.
OBSMAT = ("frame", "id", "x", "z", "y", "v_x", "v_z", "v_y")
# Velocities are differences of places up to this share: a row may have those after it.
VELOCITIES_AGREE = 0.2
# Times (s) and places (m) of two steps that are the same.
SAME_S, SAME_M = 1e-6, 0.01
# id, frame, x (m), y (m) of all rows, time (s) where the file has times, and the frame rate (1/s).
Loaded = tuple[pd.DataFrame, float]
# A frame rate that is given beside times may differ by this share from theirs.
SAME_RATE = 0.01


class TrajectoryError(ValueError):
    """A trajectory file that cannot be used; the message names the file and what is wrong in it."""


@dataclass(frozen=True, slots=True)
class _Source:
    """A file, and what is said of it; unit and frame rate (1/s) where it may not state them."""

    file: Path
    unit: Unit | None
    frame_rate: float | None
    time_unit: TimeUnit = "s"
    take_as_is: bool = False

    def refuse(self, why: str) -> TrajectoryError:
        return TrajectoryError(f"{self.file}: {why}")

    def loaded(self, columns: object, unit: str | None, frame_rate: float | None) -> Loaded:
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
        data = data.assign(**{axis: data[axis] / PER_METRE[unit] for axis in axes})
        if "z" in data and (message := heights(data)):
            if message.startswith(STOREYS) and not self.take_as_is:
                raise self.refuse(f"{message}. Give one storey, or {TAKE_AS_IS}")
            reading.note(self.file, f"z is not used: {message}")
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
        self, unit: str | None, frame_rate: float | None, *, timed: bool = False
    ) -> tuple[str, float]:
        """Unit and frame rate that the file states, by its times where it is timed, or that are
        given beside it."""
        if unit is not None and self.unit not in (None, unit):
            raise self.refuse(f"--unit {self.unit}: the file states {unit}")
        own, inputs = frame_rate or 0.0, self.frame_rate or frame_rate or 0.0
        if frame_rate and abs(inputs - own) > SAME_RATE * own * timed:
            says = f"has times {1 / own:.4g} s apart, which is" if timed else "states"
            raise self.refuse(f"--frame-rate {inputs:g}: the file {says} {own:g} per second")
        unit, frame_rate = unit or self.unit, frame_rate or self.frame_rate
        if unit and frame_rate:
            return unit, frame_rate
        every = (("unit", "--unit m or --unit cm"), ("frame rate", "--frame-rate"))
        lacks = itertools.compress(every, (not unit, not frame_rate))
        words, ways = zip(*lacks, strict=True)
        raise self.refuse(f"states no {' and no '.join(words)}. Give {' and '.join(ways)}")


def _load(source: _Source, columns: str | None) -> Loaded:
    """Read a file of any format that is known. Raises TrajectoryError as `Recording.read` does."""
    if not source.file.is_file():
        raise source.refuse("not a regular file" if source.file.exists() else "no such file")
    end = source.file.name.lower().removesuffix(".gz").rpartition(".")[2]
    try:
        # numpy's complaints of numbers that are none; the error that follows says more
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            if end not in FOREIGN:
                data, rate = _text(source, end, re.findall(r"[^\s,;]+", columns or ""))
            elif columns:
                raise source.refuse("--columns: only of a table of text")
            else:
                data, rate = FOREIGN[end](source)
        for name in ("id", "frame"):
            full = (np.abs(data[name]) < reading.LARGEST_WHOLE) & (data[name] % 1 == 0)
            if not full.all():
                index = full.idxmin()
                raise source.refuse(
                    f"{data.index.name or 'row'} {index}: {name}: {data[name][index]:g}. A whole "
                    f"number below {reading.LARGEST_WHOLE} is needed"
                )
        data = data.astype({"id": np.int64, "frame": np.int64})
        if not 0 < rate < np.inf:
            raise source.refuse(f"{rate:g} frames per second. Above 0 is needed")
        if not len(data):
            raise source.refuse("no frame with anybody in it")
        timed = "time" in data
        data = data if timed else data.assign(time=data.frame / rate)
        if not source.take_as_is and (why := doubt(data, timed=timed)):
            raise source.refuse(why)
        return data, rate
    except TrajectoryError:
        raise
    except reading.UnreadableError as error:
        raise TrajectoryError(str(error)) from None
    except Exception as error:  # of pandas, numpy, json and PedPy
        raise source.refuse(f"it cannot be read: {first_line(error)}") from None


def _text(source: _Source, end: str, columns: list[str]) -> Loaded:
    """A table of text: footsteps of Vadere, the BIWI walking pedestrians, or any other."""
    table = text_tables.read_table(source.file, named=end in NAMED, columns=columns)
    if any(line.startswith("$VEHICLE") for line in table.head):
        raise source.refuse("vehicles of Vissim. A table of its pedestrians is needed")
    names = {
        re.sub(r"-pid\d+$", "", name.rpartition(":")[2].lower()) for name in table.columns.names
    }
    if "startx" in names:
        return _vadere(source, table)
    if not (columns or table.columns.named) and len(names) == len(OBSMAT):
        other = text_tables.read_table(source.file, named=False, columns=OBSMAT)
        if rate := _rate_of_velocities(other.rows):
            if source.frame_rate and abs(source.frame_rate - rate) <= SAME_RATE * rate:
                rate = source.frame_rate  # which is not a measured one
            found = source.loaded(other.rows[[*PLAIN]], "m", rate)
            other.note(*PLAIN, "v_x", "v_y")
            return found
    implied = any(each <= names for each in IN_METRES) and not source.unit
    found = _people(source, table, table.length or ("m" if implied else None))
    table.note("id", "frame", "time", "x", "y", "z")
    return found


def _people(source: _Source, table: Table, length: str | None) -> Loaded:
    """People of a table, in this unit; the frame rate is in a comment, or follows from times (s)."""
    rows, units, stated = table.rows, table.columns.units, table.frame_rate(source.frame_rate)
    if "z" in units:  # in the unit of the others, as far as this is known
        per = PER_METRE[length or source.unit or "m"] / PER_METRE[units["z"]]
        rows = rows.assign(z=rows.z * per)
    if "time" in rows:
        if (times := units.get("time", "s")) not in text_tables.TIMES:
            raise source.refuse(f"the unit of its times is {times}. One of s and ms is read")
        rows = rows.assign(time=rows.time * text_tables.TIMES[times])
    understood = [one for one in (*PLAIN, "time", "z") if one in rows]
    found = source.loaded(rows[understood], length, None if "time" in rows else stated)
    if stated and "time" in rows and not abs(found[1] - stated) <= 0.05 * stated:
        raise source.refuse(f"states {stated:g} frames per second, and its times are {found[1]:g}")
    return found


def _rate_of_velocities(rows: pd.DataFrame) -> float | None:
    """Frames per second, where two columns are the velocities (m/s) between two rows of a person."""
    rows = rows.sort_values(["id", "frame"])
    moved = rows.groupby("id")[["frame", "x", "y"]].diff()
    present = moved.frame > 0
    way = moved[present][["x", "y"]].to_numpy()
    went = rows[present][["v_x", "v_y"]].to_numpy() * moved[present][["frame"]].to_numpy()
    step = (way * went).sum() / (went * went).sum()
    off = way - step * went
    maximum = VELOCITIES_AGREE * VELOCITIES_AGREE * (way * way).sum()
    agree = step > 0 and (off * off).sum() < maximum
    return float(np.round(1 / step, 3)) if agree else None


def _pathfinder_json(source: _Source) -> Loaded:
    # person → time → position
    content = json.loads(reading.read_text(source.file, LARGEST_JSON), object_pairs_hook=_once)
    try:
        rows = [
            (int(who), float(when), *(float(observed["position"].get(axis, "nan")) for axis in "xyz"))
            for who, person in content.items()
            for when, observed in person.items()
        ]
    except (AttributeError, KeyError, TypeError, ValueError):
        raise source.refuse("no JSON of Pathfinder: people, their times and a position") from None
    every = [observed for person in content.values() for observed in person.values()]
    reading.note_unused(
        source.file, "keys", (key for observed in every for key in observed if key != "position")
    )
    return source.loaded(pd.DataFrame(sorted(rows), columns=["id", "time", *"xyz"]), "m", None)


def _trajnet(source: _Source) -> Loaded:
    """Tracks of TrajNet++, an object of JSON a line; scenes say how many rows a person has in 1 s."""
    lines = reading.read_text(source.file, LARGEST_JSON).splitlines()
    content = [json.loads(line, object_pairs_hook=_once) for line in lines if line.strip()]
    try:
        tracks, scenes = ([one[key] for one in content if key in one] for key in ("track", "scene"))
        rows = pd.DataFrame([[float(one[key]) for key in "pfxy"] for one in tracks], columns=PLAIN)
        rates = sorted({float(one["fps"]) for one in scenes if "fps" in one})
    except (AttributeError, KeyError, TypeError, ValueError):
        raise source.refuse("no lines of TrajNet++: a track with f, p, x and y in each") from None
    if len(rates) > 1:
        raise source.refuse(f"scenes of {rates[0]:g} and {rates[-1]:g} rows per second")
    others = sorted({key for one in tracks for key in one} - {*"pfxy"})
    reading.note_unused(source.file, "keys", ["scenes but their fps", *others])
    step = float(rows.groupby("id").frame.diff().median())
    return source.loaded(seen_once(source.file, rows), "m", rates[0] * step if rates else None)


def _once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """An object of JSON, each key once."""
    made = dict(pairs)
    if len(made) < len(pairs):
        raise ValueError(f"a key occurs twice among {', '.join(key for key, _ in pairs)[:60]}")
    return made


def _jupedsim(source: _Source) -> Loaded:
    found = read_foreign(source.file, "sqlite", ["trajectory_data", "metadata"]).below
    if missing := {"trajectory_data", "metadata"} - found.keys():
        raise source.refuse(f"no table {' and '.join(sorted(missing))}")
    stated = dict(zip(found["metadata"].texts("key"), found["metadata"].texts("value"), strict=True))
    names = ("id", "frame", "pos_x", "pos_y")
    others = found["trajectory_data"].attributes["others"].split()
    understood = {("fps", stated.get("fps")), ("version", "1"), ("version", "2")}
    others += [key for key, value in stated.items() if (key, value) not in understood]
    reading.note_unused(source.file, "columns and keys", others)
    every = (found["trajectory_data"].below[name].values for name in names)
    rows = seen_once(source.file, pd.DataFrame(dict(zip(PLAIN, every, strict=True))))
    data, rate = source.loaded(rows, "m", _fps(source, stated.get("fps")))
    if not len(data):
        raise source.refuse("no rows: was the writer closed?")
    return data, rate


def _archive(source: _Source) -> Loaded:
    """An HDF5 file of the Pedestrian Dynamics Data Archive."""
    found = read_foreign(source.file, "hdf5", ["trajectory"]).below.get("trajectory", Node())
    values = found.values
    if values is None or values.ndim != 1 or not {*PLAIN} <= {*(values.dtype.names or ())}:
        raise source.refuse(f"no table /trajectory with {', '.join(PLAIN)}")
    if odd := [name for name in PLAIN if values.dtype[name].kind not in "iuf"]:
        raise source.refuse(f"/trajectory: {odd[0]}: numbers are needed")
    here = values.dtype.names or ()
    heights_too = "z" in here and values.dtype["z"].kind in "iuf"
    names = [*PLAIN, *(["z"] if heights_too else [])]
    columns = {name: values[name].astype(np.float64 if name in "xyz" else None) for name in names}
    reading.note_unused(source.file, "columns", [name for name in here if name not in names])
    column_names = " ".join(str(found.attributes.get(axis)) for axis in "xy")
    stated = text_tables.units_in(column_names)
    if stated - {"m", "cm"} or len(stated) > 1:
        raise source.refuse(f"/trajectory: x and y: {column_names[:80]}. One of m and cm is read")
    rate = _fps(source, found.attributes.get("fps"))
    rows = seen_once(source.file, pd.DataFrame(columns))
    return source.loaded(rows, "cm" if "cm" in stated else "m", rate)


def _fps(source: _Source, message: object) -> float:
    if message is None or not reading.NUMBER.fullmatch(str(message)):
        raise source.refuse(f"fps: {str(message)[:40]}. A number is needed")
    return float(str(message))


def _vadere(source: _Source, table: Table) -> Loaded:
    """Footsteps of Vadere: places at the frames between two steps, and to the end of the last."""
    if source.time_unit != "s":
        raise source.refuse(f"--time-unit {source.time_unit}: times of Vadere are in s")
    _, rate = source.stated("m", None)
    rows = table.rows.sort_values(["id", "time"], kind="stable")
    bad = ~np.isfinite(rows[["id", "time"]]).all(axis=1)
    if bad.any():
        raise source.refuse(f"line {bad.idxmax()}: an id and a time are needed")
    table.note("id", "time", "x", "y", "end_time", "end_x", "end_y")
    if {"end_time", "end_x", "end_y"} <= {*rows}:
        ends = rows[["id", "end_time", "end_x", "end_y"]].set_axis(["id", "time", "x", "y"], axis=1)
        following = rows.groupby("id")[["time", "x", "y"]].shift(-1)
        ended = (rows.end_time > rows.time) & np.isfinite(ends).all(axis=1)
        x, y = rows.end_x - following.x, rows.end_y - following.y
        difference = np.sqrt(x * x + y * y)
        late = rows.end_time - following.time
        wrong = ended & ((late > SAME_S) | (late.abs() <= SAME_S) & (difference > SAME_M))
        if wrong.any():
            raise source.refuse(
                f"line {wrong.idxmax()}: a step ends after or beside the next's start"
            )
        rows = pd.concat([rows[["id", "time", "x", "y"]], ends[ended & ~(late.abs() <= SAME_S)]])
        rows = rows.sort_values(["id", "time"], kind="stable")
    present = rows.groupby("id")["time"].agg(["min", "max"])
    frames = float((present["max"] - present["min"]).sum()) * rate
    if not frames <= MOST_FRAMES + FRAMES_OF_ROW * len(rows):
        raise source.refuse(
            f"{frames:.3g} frames of {len(table.rows)} rows at {rate:g} frames per second. Is the "
            "frame rate right?"
        )
    made = []
    for who, one in rows.groupby("id"):
        first, last = np.ceil(one.time.min() * rate - SAME_S), one.time.max() * rate + SAME_S
        at = np.arange(first, np.floor(last) + 1)
        positions = {axis: np.interp(at / rate, one.time, one[axis]) for axis in "xy"}
        made.append(pd.DataFrame({"id": who, "frame": at, **positions}))
    unseen = [f"{who:g}" for who, one in zip(present.index, made, strict=True) if one.empty]
    reading.note_unused(source.file, "people between two frames", unseen)
    return pd.concat(made).sort_values(["frame", "id"], ignore_index=True), rate


def is_fcd(file: Path) -> bool:
    """Tell whether a file is floating car data of SUMO. Raises UnreadableError for none."""
    return b"<fcd-export" in reading.start_of(file, reading.LONGEST_LINE)


def _fcd(source: _Source) -> Loaded:
    """Persons of SUMO (--fcd-output), in metres."""
    start = reading.start_of(source.file, reading.LONGEST_LINE).partition(b"<fcd-export")
    if not start[1] or b"<!DOCTYPE" in start[0]:
        raise source.refuse("no <fcd-export> of SUMO")
    if re.search(rb'fcd-output\.geo value="(?:t|1|y|on|x)', start[0]):
        raise source.refuse("places in degrees. Write it without --fcd-output.geo")
    ids: dict[str, int] = {}
    others: dict[str, None] = {}
    codes, values, time = array("q"), array("d"), ""
    with reading.open_file(source.file) as content:
        for event, node in ElementTree.iterparse(content, ["start", "end"]):
            if node.tag == "timestep":
                time = node.get("time", "")
                if event == "end":
                    node.clear()
            elif event == "start" and node.tag == "person" and "vehicle" not in node.attrib:
                row = (time, *(node.get(axis, "") for axis in "xy"))
                if "id" not in node.attrib or not all(map(reading.NUMBER.fullmatch, row)):
                    raise source.refuse(f"time {time[:40]!r}: a person without id or numbers")
                values.extend(map(float, row))
                codes.append(ids.setdefault(node.attrib["id"], len(ids)))
                others |= dict.fromkeys(node.attrib.keys() - {"id", "x", "y"})
            elif event == "start" and node.tag != "fcd-export":
                others[f"<{node.tag}>" if node.tag != "person" else "persons in vehicles"] = None
    reading.note_unused(source.file, "attributes and elements", sorted(others))
    rows = pd.DataFrame(np.frombuffer(values).reshape(len(codes), 3), columns=["time", "x", "y"])
    rows.insert(0, "id", numbered(source.file, list(ids), np.frombuffer(codes, dtype=np.int64)))
    return source.loaded(seen_once(source.file, rows), "m", None)


# Readers of files that are no rows of text, by ending.
FOREIGN = {"sqlite": _jupedsim, "json": _pathfinder_json, "ndjson": _trajnet, "xml": _fcd}
FOREIGN |= dict.fromkeys(("h5", "hdf5"), _archive)


def first_line(error: Exception) -> str:
    """Take the first line of what an error says."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0]


# Coordinates of cities have seven digits.
FARTHEST_M = 1e9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeadPositions:
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
        columns: str | None = None,
        time_unit: TimeUnit = "s",
        take_as_is: bool = False,
    ) -> "Recording":
        """Read a file.

        unit, frame_rate (1/s): needed only where the file does not state them
        columns: of a table of text: what each column is, as in "frame id x y"
        time_unit: of its times, where it has some
        take_as_is: take speeds, distances and times that people do not have

        Raises TrajectoryError naming the file, for one that PedPy cannot read or that has nobody
        in it, a missing unit or frame rate, and one that cannot be of people (see `Plausibility`)."""
        data, rate = _load(_Source(file, unit, frame_rate, time_unit, take_as_is), columns)
        return cls(file=file, data=data, frame_rate=rate)

    @property
    def plausibility(self) -> Plausibility:
        """How it looks."""
        return plausibility_of(self.data)

    @property
    def numbers(self) -> Indices:
        """The numbers of the frames that are there, growing."""
        return np.unique(self.data.frame)

    @property
    def step_s(self) -> float:
        """The usual time (s) from one frame that is there to the next."""
        intervals = np.diff(np.unique(self.data.time))
        return float(np.median(intervals)) if len(intervals) else 1.0 / self.frame_rate

    def time_of(self, frame: int) -> float:
        """The time (s) of a frame. Raises TrajectoryError naming the frames next to a missing one."""
        there = self.data.time[self.data.frame == frame]
        if len(there):
            return float(there.iloc[0])
        numbers = self.numbers
        message = f"The frames go from {numbers[0]} to {numbers[-1]}"
        if numbers[0] < frame < numbers[-1]:
            after = int(np.searchsorted(numbers, frame))
            message = f"The nearest are {numbers[after - 1]} and {numbers[after]}"
        raise TrajectoryError(f"{self.file}: there is no frame {frame}. {message}")

    def still(self, frame: int) -> HeadPositions:
        """Take the heads of a frame as `head_positions`, with no velocities but zeros."""
        now = self._near(frame, 0.0)
        return self._head_positions_of(now, frame, 1.0 / self.frame_rate, np.zeros((len(now), 2)))

    def head_positions(self, frame: int, window_s: float | None = None) -> HeadPositions:
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
        maximum = max(window, APART * step)
        near, time = self._rows(frame, 0.5 * window + maximum), self.time_of(frame)
        now = self._near(frame, 0.5 * window)
        now = now[now.frame == frame]
        found = self._head_positions_of(now, frame, window, np.full((len(now), 2), np.nan))
        for row, (_, own) in enumerate(near[near.id.isin(now.id)].groupby("id")):
            when, position = own.time.to_numpy() - time, own[["x", "y"]].to_numpy()
            at = partial(_position_at, when, position, maximum=maximum, same=EXACT * step)
            first, last = at(-window / 2), at(window / 2)
            span = window / 2 * ((first is not None) + (last is not None))
            if span:
                here = found.position[row]
                way = (here if last is None else last) - (here if first is None else first)
                found.velocity[row] = way / span
        return found

    def _head_positions_of(self, now: pd.DataFrame, frame: int, window_s: float, velocity: Floats) -> HeadPositions:
        """The heads of the rows of a frame, at places where heads can be."""
        found = HeadPositions(
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


def read_heads(file: Path, frame: int, *, window_s: float | None = None, **message: Any) -> HeadPositions:
    """Read the heads of one frame of a file: see `Recording.head_positions`, and what is `message` of the file
    `Recording.read`."""
    return Recording.read(file, **message).head_positions(frame, window_s)


def _position_at(time: Floats, position: Floats, when: float, maximum: float, same: float) -> Floats | None:
    """Where somebody was (2,) m, between two rows that are no more than `maximum` s apart; None for
    nowhere."""
    after = int(np.searchsorted(time, when - same))
    if after == len(time):
        return None
    if time[after] <= when + same:
        return np.asarray(position[after])
    if not after or time[after] - time[after - 1] > maximum:
        return None
    fraction = (when - time[after - 1]) / (time[after] - time[after - 1])
    return np.asarray(position[after - 1] + fraction * (position[after] - position[after - 1]))


def _check_places(origin: str, ids: Indices, position: Floats) -> None:
    if len(ids) < 2:
        return
    distance, other = cKDTree(position).query(position, k=2)
    row = int(np.argmin(distance[:, 1]))
    if distance[row, 1] == 0:
        twin = next(one for one in other[row] if one != row)
        raise TrajectoryError(f"{origin}: persons {ids[row]} and {ids[twin]} are at the same place")
