"""Two runs of one crowd compared window by window: impulses contact by contact, loads, and files of
both."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from analysis.compare.comparison import correlation, relative_difference
from analysis.dumps import DumpError
from analysis.dumps.windows import RunWindows, Window
from analysis.engines.record import read_finished
from analysis.scene.rigid_bodies import people_of
from analysis.scene.scene import Scene
from analysis.studies.exposure.loads import MEASURES, SHORTEST_S, loads_of, passed, values_of
from analysis.studies.motion.inference import ROUNDING, correlation_windows, next_to_zero
from analysis.studies.motion.study import model_title
from analysis.support.columns import Columns
from analysis.support.files import write_columns, write_json
from nscd.arrays import Floats, Indices

WINDOWS = Columns("windows")
WINDOW_CONTACTS = Columns("window_contacts")
# Of the crowds: the field of a snapshot, and how it is called.
FIELDS = {
    "ids": "id",
    "mass": "mass (kg)",
    "radius": "radius (m)",
    "position": "place (m)",
    "velocity": "velocity (m/s)",
    "spin": "spin (1/s)",
}
ROOM = {"walls": "walls", "drive": "drive", "body_force": "body force"}


def check_same_crowd(first: tuple[Path, Scene], second: tuple[Path, Scene]) -> None:
    """Raise DumpError naming what is different, of two runs (folder, scene); contact laws, steps
    and durations may be."""
    (folder, one), (other_folder, other) = first, second
    where = f"{other_folder}: not the crowd of {folder}: "
    crowd, other_crowd = one.snapshot, other.snapshot
    if len(crowd) != len(other_crowd):
        raise DumpError(f"{where}{len(other_crowd)} people, not {len(crowd)}")
    for field, name in FIELDS.items():
        mine, theirs = getattr(crowd, field), getattr(other_crowd, field)
        unlike = (mine != theirs).reshape(len(crowd), -1).any(1)
        if unlike.any():
            row = int(np.argmax(unlike))
            raise DumpError(
                f"{where}{name} of disk {crowd.ids[row]}: {theirs[row]}, not {mine[row]}"
            )
    for field, name in ROOM.items():
        if getattr(one, field) != getattr(other, field):
            raise DumpError(f"{where}other {name}")


# Equal to the six digits of a text.
DIGITS = 2e-6
# Frames of two runs this near, over the shortest window, are at the same instant.
SAME = 1e-3
RUNS = ("first", "second")
# Of a window: its row of windows.csv, and the columns of its rows of window_contacts.csv.
Row = tuple[dict[str, float], dict[str, Floats | Indices]]
UNITS = {"N": "N", "N/m": "N_per_m", "m/s": "m_per_s", "1/m²": "per_m2", "1/s": "per_s"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WindowComparison:
    """Set two runs of one crowd side by side, window by window.

    scene: name of the scene of the first
    titles: of the models of the first and the second run
    windows: (t,) by the columns of windows.csv: the ends of the windows (s), the measures of both
        runs, and their agreement
    contacts: (k,) by the columns of window_contacts.csv: each contact that either has in a window,
        with its impulse (N·s) in both, 0 where it has not the contact"""

    scene: str
    titles: Sequence[str]
    windows: Mapping[str, Floats]
    contacts: Mapping[str, Floats | Indices]

    def values(self, key: str) -> list[Floats]:
        """Give a measure of the first and of the second run, each (t,), in its unit."""
        return [self.windows[column(run, key)] for run in RUNS]

    def paired(self) -> dict[str, Paired]:
        """Compare the means over all windows, measure by measure, window with window."""
        keys = [key for key in MEASURES if column("first", key) in self.windows]
        return {key: _paired(*self.values(key)) for key in keys}


def column(run: str, key: str) -> str:
    """Name the column of a measure of the first or the second run."""
    return f"{run}_{key}_{UNITS.get(MEASURES[key].unit, '')}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Paired:
    """Hold means over windows, and by how much the second is above the first. One pair of runs has
    no verdict: its windows follow from each other, and other replicates would have others.

    relative: whether that is a share of the first; in its unit where the first is next to zero"""

    first: float  # in the unit of the measure
    second: float  # in the unit of the measure
    more: float  # of the second than of the first
    relative: bool
    autocorrelation: float  # of the difference from one window to the next; NaN of a constant one
    independent: float  # how many windows count as such, by the correlation time of the differences


def compare_windows(
    first: Path, second: Path, shortest_s: float = SHORTEST_S, last_s: float | None = None
) -> WindowComparison:
    """Compare the impulses of two finished runs of one crowd over windows that both have.

    shortest_s: s, a window is as many frames as last that long
    last_s: s, how much of the end of what both have; all where left out

    Raises EngineError and DumpError for folders that hold no finished run or have no impulses,
    DumpError for different crowds and for frames that are at different instants."""
    if shortest_s < SHORTEST_S * (1 - SAME):
        raise DumpError(
            f"window: {shortest_s:g} s. Below {SHORTEST_S:g} s forces depend on the time step more "
            "than on the crowd"
        )
    folders = (first, second)
    scenes, records = zip(*map(read_finished, folders), strict=True)
    check_same_crowd(*zip(folders, scenes, strict=True))
    steps, engines = zip(*((one.time_step_s, one.engine) for one in records), strict=True)
    runs = [RunWindows(*one) for one in zip(folders, steps, strict=True)]
    frames = list(pairwise(_common(runs[0].times, runs[1].times, shortest_s)))
    if not frames:
        raise DumpError(
            f"{second}: no two frames at instants of {first} that are {shortest_s:g} s apart"
        )
    begins = runs[0].times[frames[-1][1][0]] - (last_s or np.inf) - SAME * shortest_s
    chosen = [ends for ends in frames if runs[0].times[ends[0][0]] >= begins]
    made = [_window(scenes[0], runs, begin, end) for begin, end in chosen]
    titles = [model_title(*one) for one in zip(scenes, engines, strict=True)]
    return _compared(scenes[0].name, titles, made)


def _compared(scene: str, titles: Sequence[str], made: Sequence[Row]) -> WindowComparison:
    windows, contacts = zip(*made, strict=True)
    return WindowComparison(
        scene=scene,
        titles=titles,
        windows={key: np.array([row[key] for row in windows]) for key in windows[0]},
        contacts={key: np.concatenate([rows[key] for rows in contacts]) for key in contacts[0]},
    )


def _common(first: Floats, second: Floats, shortest_s: float) -> list[tuple[int, int]]:
    """Frames (of the first, of the second) at the same instants, at least so far apart."""
    chosen: list[tuple[int, int]] = []
    for number, time in enumerate(first):
        near = int(np.argmin(np.abs(second - time)))
        if abs(second[near] - time) > SAME * shortest_s:
            continue
        if not chosen or time >= first[chosen[-1][0]] + shortest_s * (1 - SAME):
            chosen.append((number, near))
    return chosen


def compare_frames(
    scene: Scene, titles: Sequence[str], frames: Iterable[tuple[Window, Window]]
) -> WindowComparison:
    """Compare forces at instants, each as a window of one second: of two files of one crowd, or of
    two models of one file.

    Raises DumpError where there is no pair of frames, and naming the time and the disk where the
    crowds are not the same; who is in one of the frames only is left out of the sums of people."""
    made = []
    for windows in frames:
        _check_alike(windows)
        made.append(_row(scene, windows))
    if not made:
        raise DumpError(f"{titles[1]}: no frame at the time of one of {titles[0]}")
    return _compared(scene.title, titles, made)


def _check_alike(windows: Sequence[Window]) -> None:
    """Raise DumpError unless radii and masses are equal, to the digits of a text, of who is in both."""
    one, other = (window.now for window in windows)
    ids, mine, theirs = np.intersect1d(one.ids, other.ids, return_indices=True)
    where = f"the two are not of one crowd: at {one.time:g} s"
    if not len(ids) and len(one.ids) and len(other.ids):
        raise DumpError(f"{where} they have no id in common")
    for name in ("radius", "mass"):
        have, had = getattr(other, name)[theirs], getattr(one, name)[mine]
        if (unlike := np.abs(have - had) > DIGITS * had).any():
            row = int(np.argmax(unlike))
            raise DumpError(
                f"{where} the {name} of disk {ids[row]} is {had[row]:g} and {have[row]:g}"
            )


def _window(
    scene: Scene, runs: Sequence[RunWindows], begin: tuple[int, int], end: tuple[int, int]
) -> Row:
    """The window of both runs between two frames of each: its row of windows.csv, and the columns
    (k,) of its rows of window_contacts.csv."""
    windows = [run.window(a, b) for run, a, b in zip(runs, begin, end, strict=True)]
    flows: list[dict[str, float]] = [{}, {}]
    if scene.drive is not None:
        for flow, run, first, window in zip(flows, runs, begin, windows, strict=True):
            out = passed(scene, window.now) - passed(scene, run.at(first))
            flow["flow"] = out / window.duration
    return _row(scene, windows, flows)


def _row(
    scene: Scene, windows: Sequence[Window], flows: Sequence[dict[str, float]] = ({}, {})
) -> Row:
    """The row of a window of both, and the columns (k,) of its contacts."""
    keys = np.unique(np.concatenate([window.keys for window in windows]), axis=0)
    impulses, has = np.zeros((2, len(keys), 2)), np.zeros((2, len(keys)), dtype=np.int64)
    ids, others = (people_of(window.now)[0].ids for window in windows)
    shared = np.intersect1d(ids, others, return_indices=True)[1:]
    loads, values = [], []
    for number, window in enumerate(windows):
        every = np.concatenate([keys, window.keys])
        index = np.unique(every, axis=0, return_inverse=True)[1].ravel()[len(keys) :]
        impulses[number, index], has[number, index] = window.impulse, 1
        borne = loads_of(scene, window)
        loads.append(borne["contact_sum"][shared[number]])
        values.append(values_of(scene, window, borne) | flows[number])
    ends = {"start_s": windows[0].start, "end_s": windows[0].end}
    row = {
        column(name, key): measured[key]
        for key in values[0]
        for name, measured in zip(RUNS, values, strict=True)
    }
    contacts = {key: np.full(len(keys), end) for key, end in ends.items()}
    contacts |= dict(zip(("first", "second", "is_wall"), keys.T, strict=True))
    contacts |= {"in_first_run": has[0], "in_second_run": has[1]}
    for name, impulse in zip(RUNS, impulses, strict=True):
        contacts |= {f"{name}_run_x_Ns": impulse[:, 0], f"{name}_run_y_Ns": impulse[:, 1]}
    return ends | row | _agreement(impulses, has, keys, loads), contacts


def _agreement(
    impulses: Floats, has: Indices, keys: Indices, loads: Sequence[Floats]
) -> dict[str, float]:
    """How far the second run is from the first: rms differences over rms per contact that both have
    and per person, relative differences of sums.

    impulses, has: (2,k,2) N·s and (2,k) 0 or 1, of the first and the second run
    keys: (k,3), as a window has them; loads: (n,) N of people, of both"""
    both, wall = has.all(0), keys[:, 2] == 1
    size = np.hypot(impulses[..., 0], impulses[..., 1])
    first, second = impulses[:, both].reshape(2, -1)
    return {
        "contacts_both": float(both.sum()),
        "contacts_only_first": float((has[0] - both).sum()),
        "contacts_only_second": float((has[1] - both).sum()),
        "contact_relative_difference": relative_difference(first, second),
        "contact_correlation": correlation(size[0, both], size[1, both]),
        "person_relative_difference": relative_difference(*loads),
        "wall_difference": _above(*size[:, wall].sum(1)),
        "sum_difference": _above(*size.sum(1)),
    }


def _above(first: float, second: float) -> float:
    return second / first - 1 if first else float("nan")


def _paired(first: Floats, second: Floats) -> Paired:
    """The means of both (t,), and how their difference goes on from window to window."""
    difference = second - first
    difference[np.abs(difference) <= ROUNDING * np.maximum(first, second)] = 0.0
    mean, distance = float(first.mean()), difference - difference.mean()
    square = float((distance**2).sum())
    relative = not next_to_zero(first)
    return Paired(
        first=mean,
        second=float(second.mean()),
        more=float(difference.mean()) / (mean if relative else 1.0),
        relative=relative,
        autocorrelation=float(distance[1:] @ distance[:-1]) / square if square else float("nan"),
        independent=len(first) / correlation_windows([difference]),
    )


def write_windows(folder: Path, compared: WindowComparison, runs: tuple[Path, Path]) -> list[Path]:
    """Write a comparison into a folder, and return the files: measures and agreement window by
    window, impulses contact by contact, and all of it over the windows; runs: the two folders."""
    paths = [folder / name for name in ("windows.csv", "window_contacts.csv", "windows.json")]
    write_columns(paths[0], compared.windows)
    write_columns(paths[1], {name: compared.contacts[name] for name in WINDOW_CONTACTS})
    starts, ends = compared.windows["start_s"], compared.windows["end_s"]
    measures = {
        key: {
            "unit": MEASURES[key].unit,
            "first": found.first,
            "second": found.second,
            # a share, or in the unit where the first is next to zero
            "second_above_first" if found.relative else "second_minus_first": found.more,
            "autocorrelation": found.autocorrelation,
            "independent_windows": found.independent,
        }
        for key, found in compared.paired().items()
    }
    content = {
        "first": str(runs[0]),
        "second": str(runs[1]),
        "window_s": float(ends[0] - starts[0]),
        "windows": len(starts),
        "from_s": float(starts[0]),
        "to_s": float(ends[-1]),
        "measures": measures,
    }
    write_json(paths[2], content)
    return paths


def write_frames(folder: Path, stem: str, compared: WindowComparison) -> list[Path]:
    """Write a comparison of frames: measures and agreement, a row per frame, and forces (N), a row
    per frame and contact; return STEM_frames.csv and STEM_frame_contacts.csv."""
    paths = [folder / f"{stem}_{name}.csv" for name in ("frames", "frame_contacts")]
    for path, columns in zip(paths, (compared.windows, compared.contacts), strict=True):
        # what a window of one second has in N·s is in N
        named = {name.replace("end_s", "time_s").replace("_Ns", "_N"): name for name in columns}
        del named["start_s"]
        write_columns(path, {name: columns[own] for name, own in named.items()})
    return paths
