"""A scene in motion: its runs by several models and of several replicates, window by window, with
arches, and the intervals over replicates."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import isfinite
from pathlib import Path

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from analysis.dumps import DumpError
from analysis.dumps.windows import RunWindows, Window, joined
from analysis.engines import PENALTY, EngineError, engine
from analysis.engines.guard import RunStoppedError
from analysis.engines.run import EngineRun, run_ahead
from analysis.exposure.exposure import exposure_values
from analysis.motion.inference import (
    Difference,
    Sample,
    correlation_windows,
    differences,
    range_of_counts,
    range_of_windows,
)
from analysis.pages.names import engine_name
from analysis.pages.numbers import (
    NONE,
    number,
    percent,
    signed,
    significant,
    two,
    whole,
    with_sign,
    with_unit,
)
from analysis.scene.scene import Scene, read_scene
from analysis.support.parallel import Progress
from nscd import Snapshot
from nscd.arrays import Floats, Indices
from nscd.stepping import StepError

# The force (N) below which two bodies hardly touch.
LEAST_N = 10.0
# An arch is made of people within half the door's width and so many mean diameters of its middle.
DIAMETERS = 2.0
# Ends of walls this near (m) to an end of the door flank it.
AT_POST_M = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Arch:
    """Name who holds an arch, and when.

    start, end: s, of the first and the last window between two frames in which it was seen"""

    people: frozenset[int]  # ids
    start: float
    end: float

    @property
    def lifetime(self) -> float:
        """Give how long it was seen (s)."""
        return self.end - self.start


def arches_of(scene: Scene, frames: Sequence[Window]) -> tuple[Arch, ...]:
    """Follow the arches before the door of a scene, window by window: one lives as long as the same
    people form it in windows that follow each other. None where the door has no walls beside it."""
    found: list[Arch] = []
    for window in frames:
        people = arch_in(scene, window)
        if not people:
            continue
        last = found[-1] if found else None
        if last and last.people == people and window.start - last.end < 0.5 * window.duration:
            found[-1] = Arch(people=people, start=last.start, end=window.end)
        else:
            found.append(Arch(people=people, start=window.start, end=window.end))
    return tuple(found)


def share_of(window: Window, arches: Sequence[Arch]) -> float:
    """Give the share of a window's time in which an arch stood."""
    stood = (min(window.end, arch.end) - max(window.start, arch.start) for arch in arches)
    return sum(time for time in stood if time > 0) / window.duration


def arch_in(scene: Scene, window: Window) -> frozenset[int]:
    """Find the shortest chain of people who press each other, and whose ends press the walls on
    either side of the door; empty where there is none near the door. Of several doors the own of
    the drive is looked at.

    Its length is that of the line from one end of the door through the centres to the other end."""
    drive = scene.drive
    if drive is None:
        return frozenset()
    posts = np.array(drive.door)
    flanks = [_flanking(scene, post) for post in posts]
    now, n = window.now, len(window.now)
    reach = 0.5 * np.hypot(*(posts[1] - posts[0])) + DIAMETERS * 2 * now.radius.mean()
    near = np.hypot(*(now.position - posts.mean(0)).T) <= reach
    near &= (now.position - posts[0]) @ np.array(drive.outward) < 0
    presses = window.force > LEAST_N
    first = np.searchsorted(now.ids, window.keys[:, 0])
    second = np.searchsorted(now.ids, np.where(window.is_wall, now.ids[0], window.keys[:, 1]))
    pairs = presses & ~window.is_wall & near[first] & near[second]
    rows, columns = [first[pairs]], [second[pairs]]
    lengths = [_distance(now.position[first[pairs]], now.position[second[pairs]])]
    for side, (post, walls) in enumerate(zip(posts, flanks, strict=True)):
        on = presses & window.is_wall & near[first] & np.isin(window.keys[:, 1], walls)
        who = np.unique(first[on])
        rows.append(who)
        columns.append(np.full(len(who), n + side))
        lengths.append(_distance(now.position[who], post))
    return _shortest(np.concatenate(rows), np.concatenate(columns), np.concatenate(lengths), window)


def _shortest(rows: Indices, columns: Indices, lengths: Floats, window: Window) -> frozenset[int]:
    """Who is on the shortest way between the two ends of the door, which follow the people."""
    n = len(window.now)
    graph = csr_array((lengths, (rows, columns)), shape=(n + 2, n + 2))
    length, before = dijkstra(graph, directed=False, indices=n, return_predecessors=True)
    if not np.isfinite(length[n + 1]):
        return frozenset()
    chain, at = [], int(before[n + 1])
    while at != n:
        chain.append(int(window.now.ids[at]))
        at = int(before[at])
    return frozenset(chain)


def _flanking(scene: Scene, post: Floats) -> Indices:
    """Numbers, from 1, of the walls that end at an end of the door."""
    walls = scene.wall_segments()
    ends = [_distance(end, post) <= AT_POST_M for end in (walls.start, walls.end)]
    return np.flatnonzero(ends[0] | ends[1]) + 1


def _distance(places: Floats, other: Floats) -> Floats:
    return np.asarray(np.hypot(*(places - other).T))


# The shortest window (s) that is worth comparing: below it a quantile of forces depends on the
# step.
SHORTEST_S = 0.1
# Near the door (m).
NEAR_M = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Measure:
    """Name a headline quantity: its title and its unit."""

    title: str
    unit: str


MEASURES: Mapping[str, Measure] = {
    "contact_largest": Measure(title="largest contact force", unit="N"),
    "contact_95": Measure(title="95 % quantile of contact forces", unit="N"),
    "contact_mean": Measure(title="mean contact force", unit="N"),
    "person_largest": Measure(title="sum on the most loaded person", unit="N"),
    "walls": Measure(title="load on all walls", unit="N"),
    "pressure_door": Measure(title="pressure on people within 2 m of the door", unit="N/m"),
    "speed_door": Measure(title="speed within 2 m of the door", unit="m/s"),
    "density_door": Measure(title="density within 2 m of the door", unit="1/m²"),
    "flow": Measure(title="people through the door per second", unit="1/s"),
    "arch_share": Measure(title="share of time with an arch before the door", unit="–"),
    "arch_lifetime": Measure(title="mean lifetime of an arch", unit="s"),
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Series:
    """Hold what a run says, one number per window."""

    time: Floats  # (w,) s, the ends of the windows
    window_s: float  # s, over which forces are means: impulse over time
    values: Mapping[str, Floats]  # (w,) per measure in its unit, and what `exposure_values` gives
    evacuated: Floats  # (w,) people beyond the line of the door
    forces: tuple[Floats, ...]  # for each window the contact forces (N) above 10 N
    arches: tuple[Arch, ...] = ()  # before the door, in order of time
    final: Window | None = None  # the last window

    def last(self, duration_s: float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Choose the windows (w,) that begin in the last `duration_s` of the run."""
        kept: np.ndarray[tuple[int], np.dtype[np.bool_]] = (
            self.time - self.window_s >= self.time[-1] - duration_s - 1e-9
        )
        return kept

    def lifetimes(self, duration_s: float) -> list[float]:
        """List the lifetimes (s) of the arches that stood in the last `duration_s` of the run."""
        begins = float(self.time[-1]) - duration_s + 1e-9
        return [arch.lifetime for arch in self.arches if arch.end > begins]


def read_series(folder: Path, time_step_s: float, limits: tuple[Path, ...] = ()) -> Series:
    """Read the windows of a run of a driven crowd. A window is as many frames as make 0.1 s or
    more; limits: files of further ones.

    Raises DumpError for a run without impulses."""
    scene = read_scene(folder / "scene.toml")
    run = RunWindows(folder, time_step_s)
    frames = list(run.between_frames())
    together = max(1, math.ceil(SHORTEST_S / frames[0].duration - 1e-9))
    windows = [joined(frames[n - together : n]) for n in range(together, len(run.times), together)]
    if not windows:
        raise DumpError(f"{folder}: {run.times[-1]:g} s; a window of {SHORTEST_S:g} s is the least")
    people = [passed(scene, window.now) for window in windows]
    gone = np.diff([passed(scene, scene.snapshot), *people])
    arches = arches_of(scene, frames)
    rows = [
        values_of(scene, window)
        | exposure_values(scene, window, limits)
        | {"flow": out / window.duration, "arch_share": share_of(window, arches)}
        for window, out in zip(windows, gone, strict=True)
    ]
    return Series(
        time=np.array([window.end for window in windows]),
        window_s=windows[0].duration,
        values={key: np.array([row[key] for row in rows]) for key in rows[0]},
        evacuated=np.array(people),
        forces=tuple(pressing(window) for window in windows),
        arches=arches,
        final=windows[-1],
    )


def pressing(window: Window) -> Floats:
    """Give the contact forces of a window above 10 N."""
    return window.force[window.force > LEAST_N]


def passed(scene: Scene, now: Snapshot) -> float:
    """Count who is beyond the line of the door."""
    return float(_gone(scene, now).sum())


def values_of(scene: Scene, window: Window) -> dict[str, float]:
    """Measure a window: the loads, and of a driven crowd pressure, speed and density at the
    door."""
    now, force, pressed = window.now, window.force, pressing(window)
    load = window.at_people(force)
    values = {
        "contact_largest": float(force.max(initial=0.0)),
        "contact_95": float(np.quantile(pressed, 0.95)) if len(pressed) else 0.0,
        "contact_mean": float(pressed.mean()) if len(pressed) else 0.0,
        "person_largest": float(load.max(initial=0.0)),
        "walls": float(force[window.is_wall].sum()),
    }
    if scene.drive is None:
        return values
    near = near_door(scene, now)
    walking = np.hypot(*now.velocity[near].T)
    outline = 2 * np.pi * now.radius
    return values | {
        "pressure_door": float((load[near] / outline[near]).mean()) if near.any() else 0.0,
        "speed_door": float(walking.mean()) if near.any() else 0.0,
        "density_door": float(near.sum()) / (0.5 * np.pi * NEAR_M**2),
    }


def near_door(scene: Scene, now: Snapshot) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Tell who (n,) is within 2 m of the own door and has not passed it."""
    return ~_gone(scene, now) & (_from_door(scene, now) <= NEAR_M)


def _gone(scene: Scene, snapshot: Snapshot) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Who has passed the line of the own door."""
    drive = scene.drive
    assert drive is not None
    return drive.gone(snapshot.position, snapshot.ids)


def _from_door(scene: Scene, snapshot: Snapshot) -> Floats:
    """Distance (n,) m from the middle of the own door."""
    assert scene.drive is not None
    distance = np.empty(len(snapshot))
    for exit_, mine in scene.drive.exits(snapshot.ids):
        middle = np.mean(exit_.door, axis=0)
        distance[mine] = np.hypot(*(snapshot.position[mine] - middle).T)
    return distance


# What nobody knows of a crowd, and a report varies.
FACTORS = ("bodies", "friction", "push", "radius")
# What two models are compared in, all at once.
COMPARED = (*MEASURES, "wall_line_load")


@dataclass(frozen=True, slots=True)
class Interval:
    """Hold a mean with the range that holds 90 % of further windows, of other replicates too.

    mean, low, high: in the unit of the measure; the range is NaN of a single replicate
    replicates, windows: of each, how many there are
    alike: how many windows there are, where all are equal; else 0. Equal numbers do not say by how
        much others vary, so their range, of no width, is no certainty"""

    mean: float
    low: float
    high: float
    replicates: int
    windows: int
    independent: float  # how many of all windows count as independent, by their correlation time
    alike: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Ensemble:
    """Hold the series of one model over its replicates."""

    title: str  # of the model, as a page names it
    engine: str  # its name in commands
    series: Sequence[Series]  # one per replicate
    last_s: float  # s, how much of the end of each run counts
    label: str = ""  # what it has of its own, in short
    factor: str = ""  # what it varies, of FACTORS; nothing for the first model

    def windows(self, measure: str) -> list[Floats]:
        """Give the windows (w,) of each replicate that count. The flow and the lifetime of arches
        are one number per replicate: people pass one by one, and in a window there are none or
        one."""
        if measure == "arch_lifetime":
            lives = [series.lifetimes(self.last_s) for series in self.series]
            return [np.array([np.mean(one)]) for one in lives if len(one)]
        chosen = [series.values[measure][series.last(self.last_s)] for series in self.series]
        return [values.mean(keepdims=True) for values in chosen] if measure == "flow" else chosen

    def sample(self, measure: str) -> Sample:
        """Give one number per replicate; of the flow how many people passed."""
        windows = self.windows(measure)
        if measure == "flow":
            return Sample.of_counts(np.concatenate(windows) * self._counted_s(), self._counted_s())
        return Sample.of_windows(windows)

    def interval(self, measure: str) -> Interval:
        """Give the mean, and the range that holds 90 % of further windows; of the flow, the counts
        of further replicates."""
        windows = self.windows(measure)
        low = high = mean = float("nan")
        independent, alike = 0.0, 0
        if windows:
            pooled = np.concatenate(windows)
            mean = float(pooled.mean())
            independent = len(pooled) / correlation_windows(windows)
            alike = 0 if np.ptp(pooled) or measure == "flow" else len(pooled)
        if len(windows) > 1 and measure == "flow":
            sample = self.sample(measure)
            low, high = (end * sample.unit for end in range_of_counts(sample.values))
        elif len(windows) > 1:
            low, high = range_of_windows(windows)
            high = min(high, 1.0) if measure == "arch_share" else high
            low, high = min(low, mean), max(high, mean)
        counts = len(windows), len(windows[0]) if windows else 0
        return Interval(mean, low, high, *counts, independent, alike)

    def differences(self, other: Ensemble) -> dict[str, Difference]:
        """Say by how much each quantity is above that of another model, largest effects first, with
        one correction for all; empty where either has fewer than three replicates."""
        return _differences(self, other)

    def _counted_s(self) -> float:
        """How long the windows of a replicate that count last together (s)."""
        first = self.series[0]
        return float(first.last(self.last_s).sum()) * first.window_s


@lru_cache(maxsize=64)  # a page says them in several places
def _differences(one: Ensemble, other: Ensemble) -> dict[str, Difference]:
    both = [key for key in COMPARED if one.windows(key) and other.windows(key)]
    mine, theirs = ({key: of.sample(key) for key in both} for of in (one, other))
    return differences(mine, theirs)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Model:
    """Name a model of a scene and the runs of its replicates."""

    title: str  # as that of Ensemble
    label: str  # as that of Ensemble
    factor: str  # as that of Ensemble
    runs: Sequence[EngineRun]


@dataclass(frozen=True, slots=True, eq=False)
class MotionStudy:
    """Hold the models of one scene, each with the series of its crowds."""

    scene: Scene  # crowd 0
    ensembles: Sequence[Ensemble]
    crowds: int  # how many were asked for
    last_s: float  # s, how much of the end of each run counts
    failures: Sequence[str]  # what a reader should know
    warnings: Sequence[str]  # what a reader should know
    limits: tuple[Path, ...] = ()  # files of users' limits


def model_title(scene: Scene, name: str) -> str:
    """Name the model of a run: the engine with its stiffness or step, and friction where it has
    some."""
    if name in (known.NAME for known in PENALTY):
        setting = f"k = {number(scene.contact.stiffness_N_per_m)} N/m"
    else:
        setting = f"h = {number(1e3 * engine(name).timing(scene).time_step)} ms"
    friction = f", μ = {significant(scene.contact.friction)}" if scene.contact.friction else ""
    return f"{engine_name(name)}, {setting}{friction}"


def study_motion(
    scene: Scene,
    models: Sequence[Model],
    last_s: float,
    progress: Progress | None = None,
    limits: tuple[Path, ...] = (),
) -> MotionStudy:
    """Run what is not finished, on all cores, and read the series of all. A run that fails or is
    stopped is left out and named."""
    run_ahead([run for model in models for run in model.runs], progress)
    ensembles: list[Ensemble] = []
    failures: list[str] = []
    warnings: list[str] = []
    for model in models:
        series = []
        for index, run in enumerate(model.runs):
            try:
                series.append(read_series(run.folder, run.record().time_step_s, limits))
            except (EngineError, DumpError, StepError) as error:
                said = f"{model.title}, replicate {index}: {error}"
                (failures if isinstance(error, RunStoppedError) else warnings).append(said)
        if series:
            last = min(last_s, float(series[0].time[-1]))
            name, engine = model.title, model.runs[0].engine
            ensembles.append(Ensemble(name, engine, series, last, model.label, model.factor))
    crowds = max((len(model.runs) for model in models), default=0)
    once = sorted(set(warnings))
    return MotionStudy(scene, ensembles, crowds, last_s, failures, once, limits)


def interval_cell(found: Interval) -> str:
    """Write a mean and its range: 120 (90 – 150); the mean alone of one replicate, – of none. Where
    all windows are equal: 120 in each of 3 moments."""
    return _cell(found, two)


def count_cell(found: Interval) -> str:
    """Write a mean of counts and its range, whole numbers of two digits: 12 (3 – 200)."""
    return _cell(found, whole)


def _cell(found: Interval, written: Callable[[float], str]) -> str:
    if not found.replicates:
        return NONE
    if found.alike or found.replicates == 1:
        return in_each(written(found.mean), found.alike or 1, "moments")
    return f"{written(found.mean)} ({written(found.low)} – {written(found.high)})"


def in_each(value: str, count: int, of: str) -> str:
    """Write a number that all of so many replicates or moments gave, which have no interval."""
    return value if count == 1 else f"{value} in each of {count} {of}"


def more_words(value: float, relative: bool, unit: str) -> str:
    """Write a difference, two significant digits with their sign: in per cent of the other, or in
    the unit of the quantity where the other is next to zero."""
    return signed(value) if relative else with_unit(with_sign(value, two(value)), unit)


def difference_words(found: Difference, unit: str) -> tuple[str, str, str]:
    """Write a difference and the ends of its interval."""
    ends = (found.value, found.low, found.high)
    value, low, high = (more_words(end, found.relative, unit) for end in ends)
    return value, low, high


def least_words(found: Difference, unit: str) -> str:
    """Write the smallest difference that would have been seen: 12 %; none where no difference
    would."""
    if not isfinite(found.least):
        return "none"
    if not found.least:
        return "all equal"
    return percent(found.least, 2) if found.relative else with_unit(two(found.least), unit)
