"""Heads of a real crowd: trajectory files of each known format (`load` picks the reader), read and
checked row by row, and the positions and velocities of one frame."""

import itertools
import json
import re
import warnings
from array import array
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pedpy
from scipy.spatial import cKDTree

from analysis.scene.real.tables import (
    LENGTHS,
    PLAIN,
    TIMES,
    Table,
    numbered,
    read_table,
    seen_once,
    units_in,
)
from analysis.support import reading
from analysis.support.foreign import Node, read_foreign
from nscd.arrays import Floats, Indices

Unit = Literal["m", "cm"]
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
# Heads of one floor, stairs included, are within so much (m) in height.
FLOOR_M = 2.5
# Velocities are differences of places up to this share: a row may have those after it.
VELOCITIES_AGREE = 0.2
# Times (s) and places (m) of two steps that are the same.
SAME_S, SAME_M = 1e-6, 0.01
# id, frame, x (m), y (m) of all rows, and the frame rate (1/s).
Loaded = tuple[pd.DataFrame, float]


class TrajectoryError(ValueError):
    """A trajectory file that cannot be used; the message names the file and what is wrong in it."""


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


def load(
    file: Path, unit: Unit | None, frame_rate: float | None, columns: str | None = None
) -> Loaded:
    """Read a file of any format that is known: id, frame, x, y (m) of all rows, and the frame rate.

    unit, frame_rate (1/s): needed only where the file does not state them
    columns: of a table of text: what each column is, as in "frame id x y"

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
            if end not in FOREIGN:
                data, rate = _text(given, end, re.findall(r"[^\s,;]+", columns or ""))
            elif columns:
                raise given.refuse("--columns: only of a table of text")
            else:
                data, rate = FOREIGN[end](given)
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


def _text(given: _Given, end: str, columns: list[str]) -> Loaded:
    """A table of text: footsteps of Vadere, the BIWI walking pedestrians, or any other."""
    table = read_table(given.file, named=end in NAMED, columns=columns)
    if any(line.startswith("$VEHICLE") for line in table.head):
        raise given.refuse("vehicles of Vissim. A table of its pedestrians is needed")
    names = {
        re.sub(r"-pid\d+$", "", name.rpartition(":")[2].lower()) for name in table.columns.names
    }
    if "startx" in names:
        return _vadere(given, table)
    if not (columns or table.columns.named) and len(names) == len(OBSMAT):
        other = read_table(given.file, named=False, columns=OBSMAT)
        if rate := _rate_of_velocities(other.rows):
            found = given.loaded(other.rows[[*PLAIN]], "m", rate)
            other.note(*PLAIN, "v_x", "v_y")
            return found
    implied = any(known <= names for known in IN_METRES) and not given.unit
    found = _people(given, table, table.length or ("m" if implied else None))
    table.note("id", "frame", "time", "x", "y")
    return found


def _people(given: _Given, table: Table, length: str | None) -> Loaded:
    """People of a table, in this unit; the frame rate is in a comment, or follows from times (s)."""
    rows, units, said = table.rows, table.columns.units, table.frame_rate(given.frame_rate)
    if length == "mm" and given.unit:
        raise given.refuse(f"--unit {given.unit}: the file states mm")
    if "z" in rows:
        _one_floor(given, rows.z * LENGTHS.get(units.get("z", length or given.unit or "m"), 1.0))
    if length == "mm":
        rows, length = rows.assign(x=rows.x / 1000, y=rows.y / 1000), "m"
    unit: Unit | None = "cm" if length == "cm" else "m" if length else None
    if "time" in rows:
        if (times := units.get("time", "s")) not in TIMES:
            raise given.refuse(f"the unit of its times is {times}. One of s and ms is read")
        rows = rows.assign(time=rows.time * TIMES[times])
    if "frame" in rows:
        rate = said or given.frame_rate
        if rate is None and "time" in rows:
            moving = rows.groupby("id")[["frame", "time"]].diff().dropna()
            rate = float(np.round((moving.frame / moving.time).median(), 6))
        return given.loaded(rows[[*PLAIN]], unit, rate)
    unit, _ = replace(given, frame_rate=None).stated(unit, 1.0)
    places = {axis: rows[axis] / (100 if unit == "cm" else 1) for axis in "xy"}
    found = _timed(replace(given, unit=None), rows[["id", "time", "x", "y"]].assign(**places))
    if said and not abs(found[1] - said) <= 0.05 * said:
        raise given.refuse(f"states {said:g} frames per second, and its times are {found[1]:g}")
    return found


def _one_floor(given: _Given, height: Any) -> None:
    """Refuse people of several floors, who would stand in each other: height (m) of each row."""
    if len(height) and np.nanmax(height) - np.nanmin(height) > FLOOR_M:
        low, high = np.nanmin(height), np.nanmax(height)
        raise given.refuse(
            f"z from {low:g} to {high:g} m: several floors. Cut one out, or name the columns without z"
        )


def _rate_of_velocities(rows: pd.DataFrame) -> float | None:
    """Frames per second, where two columns are the velocities (m/s) between two rows of a person."""
    rows = rows.sort_values(["id", "frame"])
    moved = rows.groupby("id")[["frame", "x", "y"]].diff()
    seen = moved.frame > 0
    way = moved[seen][["x", "y"]].to_numpy()
    went = rows[seen][["v_x", "v_y"]].to_numpy() * moved[seen][["frame"]].to_numpy()
    step = (way * went).sum() / (went**2).sum()
    apart = ((way - step * went) ** 2).sum()
    agree = step > 0 and apart < VELOCITIES_AGREE**2 * (way**2).sum()
    return float(np.round(1 / step, 3)) if agree else None


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
    every = [seen for person in content.values() for seen in person.values()]
    reading.note_unused(
        given.file, "keys", (key for seen in every for key in seen if key != "position")
    )
    _one_floor(given, [float(seen["position"].get("z", 0)) for seen in every])
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
    others = found["trajectory_data"].attributes["others"].split()
    known = {("fps", said.get("fps")), ("version", "1"), ("version", "2")}
    others += [key for key, value in said.items() if (key, value) not in known]
    reading.note_unused(given.file, "columns and keys", others)
    columns = (found["trajectory_data"].below[name].values for name in names)
    rows = seen_once(given.file, pd.DataFrame(dict(zip(PLAIN, columns, strict=True))))
    return given.loaded(rows, "m", _fps(given, said.get("fps")))


def _archive(given: _Given) -> Loaded:
    """An HDF5 file of the Pedestrian Dynamics Data Archive."""
    found = read_foreign(given.file, "hdf5", ["trajectory"]).below.get("trajectory", Node())
    values = found.values
    if values is None or values.ndim != 1 or not {*PLAIN} <= {*(values.dtype.names or ())}:
        raise given.refuse(f"no table /trajectory with {', '.join(PLAIN)}")
    if odd := [name for name in PLAIN if values.dtype[name].kind not in "iuf"]:
        raise given.refuse(f"/trajectory: {odd[0]}: numbers are needed")
    columns = {name: values[name].astype(np.float64 if name in "xy" else None) for name in PLAIN}
    others = [name for name in values.dtype.names or () if name not in PLAIN]
    reading.note_unused(given.file, "columns", others)
    if "z" in others and values.dtype["z"].kind in "iuf":
        _one_floor(given, values["z"])
    told = " ".join(str(found.attributes.get(axis)) for axis in "xy")
    said = units_in(told)
    if said - {"m", "cm"} or len(said) > 1:
        raise given.refuse(f"/trajectory: x and y: {told[:80]}. One of m and cm is read")
    rate = _fps(given, found.attributes.get("fps"))
    rows = seen_once(given.file, pd.DataFrame(columns))
    return given.loaded(rows, "cm" if "cm" in said else "m", rate)


def _fps(given: _Given, said: object) -> float:
    if said is None or not reading.NUMBER.fullmatch(str(said)):
        raise given.refuse(f"fps: {str(said)[:40]}. A number is needed")
    return float(str(said))


def _vadere(given: _Given, table: Table) -> Loaded:
    """Footsteps of Vadere: places at the frames between two steps, and to the end of the last."""
    _, rate = given.stated("m", None)
    rows = table.rows.sort_values(["id", "time"], kind="stable")
    bad = ~np.isfinite(rows[["id", "time"]]).all(axis=1)
    if bad.any():
        raise given.refuse(f"line {bad.idxmax()}: an id and a time are needed")
    table.note("id", "time", "x", "y", "end_time", "end_x", "end_y")
    if {"end_time", "end_x", "end_y"} <= {*rows}:
        ends = rows[["id", "end_time", "end_x", "end_y"]].set_axis(["id", "time", "x", "y"], axis=1)
        following = rows.groupby("id")[["time", "x", "y"]].shift(-1)
        ended = (rows.end_time > rows.time) & np.isfinite(ends).all(axis=1)
        apart = np.hypot(rows.end_x - following.x, rows.end_y - following.y)
        late = rows.end_time - following.time
        wrong = ended & ((late > SAME_S) | (late.abs() <= SAME_S) & (apart > SAME_M))
        if wrong.any():
            raise given.refuse(
                f"line {wrong.idxmax()}: a step ends after or beside the next's start"
            )
        rows = pd.concat([rows[["id", "time", "x", "y"]], ends[ended & ~(late.abs() <= SAME_S)]])
        rows = rows.sort_values(["id", "time"], kind="stable")
    seen = rows.groupby("id")["time"].agg(["min", "max"])
    frames = float((seen["max"] - seen["min"]).sum()) * rate
    if not frames <= MOST_FRAMES + FRAMES_OF_ROW * len(rows):
        raise given.refuse(
            f"{frames:.3g} frames of {len(table.rows)} rows at {rate:g} frames per second. Is the "
            "frame rate right?"
        )
    made = []
    for who, one in rows.groupby("id"):
        first, last = np.ceil(one.time.min() * rate - SAME_S), one.time.max() * rate + SAME_S
        at = np.arange(first, np.floor(last) + 1)
        places = {axis: np.interp(at / rate, one.time, one[axis]) for axis in "xy"}
        made.append(pd.DataFrame({"id": who, "frame": at, **places}))
    unseen = [f"{who:g}" for who, one in zip(seen.index, made, strict=True) if one.empty]
    reading.note_unused(given.file, "people between two frames", unseen)
    return pd.concat(made).sort_values(["frame", "id"], ignore_index=True), rate


def is_fcd(file: Path) -> bool:
    """Tell whether a file is floating car data of SUMO. Raises UnreadableError for none."""
    return b"<fcd-export" in _start(file)


def _start(file: Path) -> bytes:
    with reading.open_file(file) as content:
        try:
            return content.read(reading.LONGEST_LINE)
        except reading.DAMAGED:
            return b""


def _fcd(given: _Given) -> Loaded:
    """Persons of SUMO (--fcd-output), in metres."""
    start = _start(given.file).partition(b"<fcd-export")
    if not start[1] or b"<!DOCTYPE" in start[0]:
        raise given.refuse("no <fcd-export> of SUMO")
    if re.search(rb'fcd-output\.geo value="(?:t|1|y|on|x)', start[0]):
        raise given.refuse("places in degrees. Write it without --fcd-output.geo")
    ids: dict[str, int] = {}
    others: dict[str, None] = {}
    codes, values, time = array("q"), array("d"), ""
    with reading.open_file(given.file) as content:
        for event, node in ElementTree.iterparse(content, ["start", "end"]):
            if node.tag == "timestep":
                time = node.get("time", "")
                if event == "end":
                    node.clear()
            elif event == "start" and node.tag == "person" and "vehicle" not in node.attrib:
                row = (time, *(node.get(axis, "") for axis in "xy"))
                if "id" not in node.attrib or not all(map(reading.NUMBER.fullmatch, row)):
                    raise given.refuse(f"time {time[:40]!r}: a person without id or numbers")
                values.extend(map(float, row))
                codes.append(ids.setdefault(node.attrib["id"], len(ids)))
                others |= dict.fromkeys(node.attrib.keys() - {"id", "x", "y"})
            elif event == "start" and node.tag != "fcd-export":
                others[f"<{node.tag}>" if node.tag != "person" else "persons in vehicles"] = None
    reading.note_unused(given.file, "attributes and elements", sorted(others))
    rows = pd.DataFrame(np.frombuffer(values).reshape(len(codes), 3), columns=["time", "x", "y"])
    rows.insert(0, "id", numbered(given.file, list(ids), np.frombuffer(codes, dtype=np.int64)))
    return _timed(given, seen_once(given.file, rows))


# Readers of files that are no rows of text, by ending.
FOREIGN = {"sqlite": _jupedsim, "json": _pathfinder_json, "xml": _fcd}
FOREIGN |= dict.fromkeys(("h5", "hdf5"), _archive)


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
        cls,
        file: Path,
        *,
        unit: Unit | None = None,
        frame_rate: float | None = None,
        columns: str | None = None,
    ) -> "Recording":
        """Read a file.

        unit, frame_rate (1/s): needed only where the file does not state them
        columns: of a table of text: what each column is, as in "frame id x y"

        Raises TrajectoryError naming the file, for one that PedPy cannot read or that has nobody
        in it, a missing unit or frame rate."""
        data, rate = load(file, unit, frame_rate, columns)
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
