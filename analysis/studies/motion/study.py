"""A scene in motion: its runs by several models and of several replicates, and the intervals over
replicates."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import lru_cache
from math import isfinite
from pathlib import Path

import numpy as np

from analysis.dumps import DumpError
from analysis.engines import PENALTY, EngineError, engine
from analysis.engines.guard import RunStoppedError
from analysis.engines.run import EngineRun, finished_run
from analysis.engines.softness import VALID, softness
from analysis.pages import numbers
from analysis.pages.names import engine_name
from analysis.scene.scene import Scene
from analysis.studies.exposure.loads import MEASURES, RunLoads, read_exposure
from analysis.studies.exposure.times import flow_after_arrival, leaving
from analysis.studies.motion import inference
from analysis.support.parallel import Progress, Task, do_all
from nscd.arrays import Floats
from nscd.stepping import StepError

# What nobody knows of a crowd, and a report varies.
CROWD = "crowd"
FACTORS = (CROWD, "bodies", "friction", "push", "radius")
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Model:
    """Name a model of a scene with the runs of its replicates and, once it ran, what they say."""

    title: str  # as a page names it
    label: str = ""  # what it has of its own, in short
    factor: str = ""  # what it varies, of FACTORS; nothing for the first model
    runs: Sequence[EngineRun] = ()
    series: Sequence[RunLoads] = ()  # one per replicate that ended well
    last_s: float = 0.0  # s, how much of the end of each run counts

    def windows(self, measure: str) -> list[Floats]:
        """Give the windows (w,) of each replicate that count. The flow and the lifetime of arches
        are one number per replicate: people pass one by one, and in a window there are none or
        one."""
        if measure == "arch_lifetime":
            lives = [series.lifetimes(self.last_s) for series in self.series]
            return [np.array([np.mean(one)]) for one in lives if len(one)]
        having = [series for series in self.series if measure in series.values]
        if measure == "flow":
            return [np.array([flow_after_arrival(one).rate]) for one in having]
        return [series.values[measure][series.last(self.last_s)] for series in having]

    def sample(self, measure: str) -> inference.Sample:
        """Give one number per replicate, with the noise that chance gives it."""
        if measure == "flow":
            return inference.Sample.of_rates(*self._counted())
        return inference.Sample.of_windows(self.windows(measure))

    def interval(self, measure: str) -> Interval:
        """Give the mean, and the range that holds 90 % of further windows; of the flow, the counts
        of further replicates."""
        found = interval_of(self.windows(measure))
        if found.replicates > 1 and measure == "flow":
            people, seconds = self._counted()
            counts = np.rint(people / seconds * seconds.mean())
            low, high = (end / seconds.mean() for end in inference.range_of_counts(counts))
            return replace(found, low=float(low), high=float(high), alike=0)
        return replace(found, high=min(found.high, 1.0)) if measure == "arch_share" else found

    def flows(self, width: float) -> list[float]:
        """Give people per metre and second of each replicate through doors of a width (m) in all, from
        the first who leaves to the last; of those in which less than three leave, none."""
        times = [leaving(one) for one in self.series]
        out = [one[np.isfinite(one)] for one in times]
        return [float((len(one) - 1) / (one[-1] - one[0]) / width) for one in out if len(one) > 2]

    def _counted(self) -> tuple[Floats, Floats]:
        """Who passed after the first one in each replicate (n,), and in how long (s)."""
        flows = [flow_after_arrival(one) for one in self.series if "flow" in one.values]
        people, seconds = np.array(flows, dtype=float).reshape(-1, 2).T
        return people, np.where(seconds > 0, seconds, 1.0)  # where the first is the last

    @property
    def valid(self) -> bool:
        """Whether its bodies are hard enough for their crowd (`softness`)."""
        springs = self.runs and self.runs[0].engine in (each.NAME for each in PENALTY)
        return not springs or softness(self.runs[0].scene) < VALID

    @property
    def overlap(self) -> float:
        """The largest overlap of its bodies in any frame, as a share of the smaller radius."""
        records = [finished_run(run.scene, run.engine, run.folder) for run in self.runs]
        return max((one.overlap_largest for one in records if one), default=float("nan"))


def interval_of(windows: Sequence[Floats]) -> Interval:
    """Give the mean of the windows (w,) of each replicate, and the range that holds 90 % of further ones."""
    low = high = mean = float("nan")
    independent, alike = 0.0, 0
    if windows:
        pooled = np.concatenate(windows)
        mean = float(pooled.mean())
        independent = len(pooled) / inference.correlation_windows(windows)
        alike = 0 if np.ptp(pooled) else len(pooled)
    if len(windows) > 1:
        low, high = inference.range_of_windows(windows)
        low, high = min(low, mean), max(high, mean)
    return Interval(mean, low, high, len(windows), len(windows[0]) if windows else 0, independent, alike)


@lru_cache(maxsize=64)  # a page says them in several places
def differences_of(one: Model, other: Model) -> dict[str, inference.Difference]:
    """Say by how much each quantity is above that of another model, largest effects first, with one
    correction for all; empty where either has fewer than three replicates."""
    both = [key for key in COMPARED if one.windows(key) and other.windows(key)]
    mine, theirs = ({key: of.sample(key) for key in both} for of in (one, other))
    return inference.differences(mine, theirs)


@dataclass(frozen=True, slots=True, eq=False)
class MotionStudy:
    """Hold the models of one scene, each with the series of its crowds."""

    scene: Scene  # crowd 0
    models: Sequence[Model]
    crowds: int  # how many were asked for
    last_s: float  # s, how much of the end of each run counts
    failures: Sequence[str]  # what a reader should know
    warnings: Sequence[str]  # what a reader should know
    limits: tuple[Path, ...] = ()  # files of users' limits
    # how many replicates ended before their time, of models whose bodies are not valid, by label
    stopped: Mapping[str, int] = field(default_factory=dict)

    @property
    def absent(self) -> list[str]:
        """The labels of those of which none ended well."""
        return [label for label in self.stopped if label not in {one.label for one in self.models}]


def model_title(scene: Scene, name: str) -> str:
    """Name the model of a run: the engine with its stiffness or step, and friction where it has
    some."""
    if name in (each.NAME for each in PENALTY):
        setting = f"k = {numbers.number(scene.contact.stiffness_N_per_m)} N/m"
    else:
        setting = f"h = {numbers.number(1e3 * engine(name).timing(scene).time_step)} ms"
    friction = f", μ = {numbers.significant(scene.contact.friction)}" if scene.contact.friction else ""
    return f"{engine_name(name)}, {setting}{friction}"


# Of the run in a folder its series, or why there is none, and whether it was stopped.
Series = Mapping[Path, tuple[RunLoads | None, str, bool]]


def read_runs(
    runs: Sequence[EngineRun], limits: tuple[Path, ...] = (), progress: Progress | None = None,
    executor: Executor | None = None, unread: Sequence[EngineRun] = (),
) -> Series:  # fmt: skip
    """Run what is not finished, and read the series of each run while its dumps are at hand, by the
    workers of an executor where there is one; unread: runs besides, which are only run."""
    calls = {run.folder: (run, None) for run in unread} | {run.folder: (run, limits) for run in runs}
    tasks = [Task(call=_series_of, arguments=of, work=of[0].particle_steps) for of in calls.values()]
    return dict(zip(calls, do_all(tasks, executor, "engine runs", progress), strict=True))


def study_motion(
    scene: Scene, models: Sequence[Model], last_s: float, limits: tuple[Path, ...] = (), earlier: Series | None = None
) -> MotionStudy:
    """Take the series of all runs, which are run and read where they are not yet. A run that fails or
    is stopped is left out and named."""
    earlier = earlier or read_runs([run for model in models for run in model.runs], limits)
    read: list[Model] = []
    failures: list[str] = []
    warnings: list[str] = []
    stopped: dict[str, int] = {}
    for model in models:
        series = []
        for index, run in enumerate(model.runs):
            loads, why, is_stopped = earlier[run.folder]
            if loads:
                series.append(loads)
            elif is_stopped and not model.valid:
                stopped[model.label] = stopped.get(model.label, 0) + 1
            else:
                message = f"{model.title}, replicate {index}: {why}"
                (failures if is_stopped else warnings).append(message)
        if series:
            last = min(last_s, float(series[0].time[-1]))
            read.append(replace(model, series=series, last_s=last))
    crowds = max((len(model.runs) for model in models), default=0)
    once = sorted(set(warnings))
    return MotionStudy(scene, read, crowds, last_s, failures, once, limits, stopped)


def _series_of(run: EngineRun, limits: tuple[Path, ...] | None) -> tuple[RunLoads | None, str, bool]:
    """The series of a run, without limits only run; or why there is none and whether it was stopped."""
    try:
        run.record()
        return None if limits is None else read_exposure(run.folder, limits=limits), "", False
    except (EngineError, DumpError, StepError) as error:
        return None, str(error), isinstance(error, RunStoppedError)


def interval_cell(found: Interval, written: Callable[[float], str] = numbers.two) -> str:
    """Write a mean and its range: 120 (90 – 150); the mean alone of one replicate, – of none. Where
    all windows are equal: 120 in each of 3 moments."""
    if not found.replicates:
        return numbers.NONE
    if found.alike or found.replicates == 1:
        return in_each(written(found.mean), found.alike or 1, "moments")
    return f"{written(found.mean)} ({written(found.low)} – {written(found.high)})"


def in_each(value: str, count: int, of: str) -> str:
    """Write a number that all of so many replicates or moments gave, which have no interval."""
    return value if count == 1 else f"{value} in each of {count} {of}"


def more_words(value: float, relative: bool, unit: str) -> str:
    """Write a difference, two significant digits with their sign: in per cent of the other, or in
    the unit of the quantity where the other is next to zero."""
    return numbers.signed(value) if relative else numbers.with_unit(numbers.with_sign(value, numbers.two(value)), unit)


def difference_words(found: inference.Difference, unit: str) -> tuple[str, str, str]:
    """Write a difference and the ends of its interval."""
    ends = (found.value, found.low, found.high)
    value, low, high = (more_words(end, found.relative, unit) for end in ends)
    return value, low, high


def least_words(found: inference.Difference, unit: str) -> str:
    """Write the smallest difference that would have been seen: 12 %; none where no difference
    would."""
    if not isfinite(found.least):
        return "none"
    if not found.least:
        return "all equal"
    return numbers.percent(found.least, 2) if found.relative else numbers.with_unit(numbers.two(found.least), unit)
