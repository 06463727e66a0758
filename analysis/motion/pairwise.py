"""Two runs of one crowd compared window by window: impulses contact by contact, loads, and files of
both."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from analysis.compare.statistics import correlation, relative_difference
from analysis.dumps import DumpError
from analysis.dumps.windows import RunWindows
from analysis.engines.record import RunRecord
from analysis.motion.inference import ROUNDING, correlation_windows, next_to_zero
from analysis.motion.study import MEASURES, SHORTEST_S, passed, values_of
from analysis.scene.scene import Scene, read_scene
from analysis.support.files import write_json, write_rows
from nscd.arrays import Floats, Indices

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


# Frames of two runs this near, over the shortest window, are at the same instant.
SAME = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Both:
    """Hold one window of both runs.

    values: of the first and the second run, measure by measure"""

    start: float  # s
    end: float  # s
    keys: Indices  # (k,3) of every contact that either has, as a window has them
    impulses: Floats  # (2,k,2) N·s, first and second run; 0 where it has not the contact
    has: np.ndarray[tuple[int, int], np.dtype[np.bool_]]  # (2,k)
    values: tuple[dict[str, float], dict[str, float]]
    loads: Floats  # Σ of impulses at each person over the time, (2,n) N

    def agreement(self) -> dict[str, float]:
        """Say how far the second run is from the first: rms differences over rms per contact that
        both have and per person, relative differences of sums."""
        both = self.has.all(0)
        size = np.hypot(self.impulses[..., 0], self.impulses[..., 1])
        wall = self.keys[:, 2] == 1
        first, second = self.impulses[:, both].reshape(2, -1)
        return {
            "contacts_both": float(both.sum()),
            "contacts_only_first": float((self.has[0] & ~both).sum()),
            "contacts_only_second": float((self.has[1] & ~both).sum()),
            "contact_relative_difference": relative_difference(first, second),
            "contact_correlation": correlation(size[0, both], size[1, both]),
            "person_relative_difference": relative_difference(*self.loads),
            "wall_difference": _above(*size[:, wall].sum(1)),
            "sum_difference": _above(*size.sum(1)),
        }


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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WindowComparison:
    """Set two runs of one crowd side by side.

    scenes, records: of the first and the second run"""

    scenes: tuple[Scene, Scene]
    records: tuple[RunRecord, RunRecord]
    windows: Sequence[Both]  # in order of time

    def paired(self) -> dict[str, Paired]:
        """Compare the means over all windows, measure by measure, window with window."""
        return {
            key: _paired(*(np.array([w.values[run][key] for w in self.windows]) for run in (0, 1)))
            for key in MEASURES
            if key in self.windows[0].values[0]
        }


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
            f"window: {shortest_s:g} s; below {SHORTEST_S:g} s forces depend on the time step more "
            "than on the crowd"
        )
    (scene, record), (other, other_record) = (_finished(folder) for folder in (first, second))
    check_same_crowd((first, scene), (second, other))
    runs = [
        RunWindows(folder, one.time_step_s)
        for folder, one in ((first, record), (second, other_record))
    ]
    frames = _common(runs[0].times, runs[1].times, shortest_s)
    windows = [_both(scene, runs, begin, end) for begin, end in pairwise(frames)]
    if not windows:
        raise DumpError(
            f"{second}: no two frames at instants of {first} that are {shortest_s:g} s apart"
        )
    begins = windows[-1].end - (last_s or np.inf) - SAME * shortest_s
    return WindowComparison(
        scenes=(scene, other),
        records=(record, other_record),
        windows=[window for window in windows if window.start >= begins],
    )


def _finished(folder: Path) -> tuple[Scene, RunRecord]:
    record = RunRecord.read(folder)
    scene = read_scene(folder / "scene.toml").model_copy(update={"name": record.scene})
    record.check_finished(folder, scene)
    return scene, record


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


def _both(
    scene: Scene, runs: Sequence[RunWindows], begin: tuple[int, int], end: tuple[int, int]
) -> Both:
    """The window of both runs between two frames of each."""
    windows = [run.window(a, b) for run, a, b in zip(runs, begin, end, strict=True)]
    keys = np.unique(np.concatenate([window.keys for window in windows]), axis=0)
    impulses, has = np.zeros((2, len(keys), 2)), np.zeros((2, len(keys)), dtype=bool)
    values = []
    for number, (run, window) in enumerate(zip(runs, windows, strict=True)):
        every = np.concatenate([keys, window.keys])
        place = np.unique(every, axis=0, return_inverse=True)[1].ravel()[len(keys) :]
        impulses[number, place], has[number, place] = window.impulse, True
        measured = values_of(scene, window)
        if scene.drive is not None:
            out = passed(scene, window.now) - passed(scene, run.at(begin[number]))
            measured["flow"] = out / window.duration
        values.append(measured)
    return Both(
        start=windows[0].start,
        end=windows[0].end,
        keys=keys,
        impulses=impulses,
        has=has,
        values=(values[0], values[1]),
        loads=np.stack([window.at_people(window.force) for window in windows]),
    )


def _paired(first: Floats, second: Floats) -> Paired:
    """The means of both (w,), and how their difference goes on from window to window."""
    difference = second - first
    difference[np.abs(difference) <= ROUNDING * np.maximum(first, second)] = 0.0
    mean, apart = float(first.mean()), difference - difference.mean()
    square = float((apart**2).sum())
    relative = not next_to_zero(first)
    return Paired(
        first=mean,
        second=float(second.mean()),
        more=float(difference.mean()) / (mean if relative else 1.0),
        relative=relative,
        autocorrelation=float(apart[1:] @ apart[:-1]) / square if square else float("nan"),
        independent=len(first) / correlation_windows([difference]),
    )


def _above(first: float, second: float) -> float:
    return second / first - 1 if first else float("nan")


CONTACTS_HEAD = [
    "start_s", "end_s", "first", "second", "is_wall", "in_first_run", "in_second_run",
    "first_run_x_Ns", "first_run_y_Ns", "second_run_x_Ns", "second_run_y_Ns",
]  # fmt: skip
UNITS = {"N": "N", "N/m": "N_per_m", "m/s": "m_per_s", "1/m²": "per_m2", "1/s": "per_s"}


def write_windows(folder: Path, compared: WindowComparison, runs: tuple[Path, Path]) -> list[Path]:
    """Write a comparison into a folder, and return the files: measures and agreement window by
    window, impulses contact by contact, and all of it over the windows; runs: the two folders."""
    paths = [folder / name for name in ("windows.csv", "window_contacts.csv", "windows.json")]
    measures = list(compared.windows[0].values[0])
    columns = [
        f"{run}_{key}_{UNITS[MEASURES[key].unit]}"
        for key in measures
        for run in ("first", "second")
    ]
    agreement = list(compared.windows[0].agreement())
    rows: list[list[object]] = []
    for window in compared.windows:
        values = [run[key] for key in measures for run in window.values]
        rows.append([window.start, window.end, *values, *window.agreement().values()])
    write_rows(paths[0], ["start_s", "end_s", *columns, *agreement], rows)
    write_rows(paths[1], CONTACTS_HEAD, _contacts(compared))
    write_json(paths[2], _content(compared, runs))
    return paths


def _contacts(compared: WindowComparison) -> Iterator[list[object]]:
    for window in compared.windows:
        for row, key in enumerate(window.keys.tolist()):
            has = window.has[:, row].astype(int).tolist()
            yield [window.start, window.end, *key, *has, *window.impulses[:, row].ravel().tolist()]


def _content(compared: WindowComparison, runs: tuple[Path, Path]) -> dict[str, Any]:
    windows = compared.windows
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
    span = {"from_s": windows[0].start, "to_s": windows[-1].end, "measures": measures}
    counted = {"window_s": windows[0].end - windows[0].start, "windows": len(windows)}
    return {"first": str(runs[0]), "second": str(runs[1]), **counted, **span}
